//! Memory that is overwritten for tests, and what is left of it.

extern crate std;

use super::super::*;
use std::format;
use std::string::String;
use std::vec::Vec;

/// The numbers that a value's description holds.
fn numbers(description: &str) -> Vec<String> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || "+-._".contains(c);
    let words = description.split(|c| !is_part(c));
    words.filter(|word| word.parse::<f64>().is_ok()).map(String::from).collect()
}

/// Every number of the working memory is overwritten: a result that depends on one would show it.
#[test]
fn no_number_of_the_working_memory_is_left_out() {
    let mut solver = EmbeddedQp::<2, 3, 2, 1>::new();
    let before = numbers(&format!("{solver:?}"));
    solver.fill(7.0);
    let description = format!("{solver:?}");
    let after = numbers(&description);
    assert_eq!(before.len(), after.len());
    let left: Vec<_> =
        after.iter().filter(|number| !["7", "7.0"].contains(&number.as_str())).collect();
    // The settings, all zero bits until configured, and how many stages are left out.
    assert_eq!(left, ["0", "0.0", "0.0", "0.0", "0"]);
    assert!(solver.is_translation && solver.solved);
    assert!(description.contains("has_slack: true") && !description.contains("has_slack: false"));
    solver.fill(-7.0);
    assert!(!solver.is_translation);
    let description = format!("{solver:?}");
    assert!(description.contains("has_slack: false") && !description.contains("has_slack: true"));
    assert_eq!(description.matches("is_rigid: false").count(), 3);
    solver.fill(0.0);
    assert!(!solver.is_translation && !format!("{solver:?}").contains("has_slack: true"));
}

#[test]
fn no_number_of_a_program_or_a_point_is_left_out() {
    let mut qp = Qp::<2, 3, 2, 1>::ZERO;
    qp.fill(3.5);
    let found = numbers(&format!("{qp:?}"));
    // How many stages are left out stays.
    assert_eq!(found.iter().filter(|number| *number != "3.5").count(), 1);
    // Five more than the memory that a program is said to take.
    assert_eq!(found.len(), 2 * (2 * 9 + 2 * 6 + 4 + 4 * 3 + 3 * 2 + 4) + 5);
    let mut point = Solution::<2, 3, 2, 1>::ZERO;
    point.fill(f64::NAN);
    let found = numbers(&format!("{point:?}"));
    assert_eq!(found.len(), 2 * (3 * 3 + 2 * 2 + 1));
    assert!(found.iter().all(|number| number == "NaN"));
}

/// Fresh memory is all zero bits: static memory costs no room in an image.
#[test]
fn fresh_memory_is_zero() {
    let solver = EmbeddedQp::<2, 3, 2, 1>::new();
    let found = numbers(&format!("{solver:?}"));
    assert!(found.iter().all(|number| ["0", "0.0"].contains(&number.as_str())));
    assert!(!format!("{solver:?}").contains("true"));
}

/// Code for a translation's size is there for twelve states on one kind of processor, and used for padding alone.
#[test]
fn padding_is_left_out_where_there_is_some() {
    fn leaves_out<const NX: usize, const NU: usize>(entry: f64) -> bool {
        let mut qp = Qp::<2, NX, NU, 0> { defect_penalty: 1.0, ..Qp::ZERO };
        qp.stages[0].a[(NX - 1, 0)] = entry;
        let mut solver = EmbeddedQp::<2, NX, NU, 0>::new();
        solver.fill(7.0);
        solver.start(&qp).unwrap();
        assert_eq!(solver.is_translation, solver.leaves_padding_out());
        solver.leaves_padding_out()
    }
    let has_code = cfg!(target_arch = "x86_64");
    assert_eq!(leaves_out::<12, 6>(0.0), has_code);
    assert!(!leaves_out::<12, 6>(1e-9));
    assert!(!leaves_out::<9, 3>(0.0) && !leaves_out::<14, 7>(0.0) && !leaves_out::<9, 3>(1.0));
}
