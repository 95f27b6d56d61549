#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod arm;
mod body;
mod chain;
mod explain;
mod fault;
mod hull;
mod limits;
mod links;
mod note;
mod options;
mod plain;
mod pose;
mod selection;
mod text;
mod tree;
mod written;

pub use arm::{Arm, Base, Joint};
pub use body::Body;
pub use fault::{
    Fault, MAX_ATTRIBUTES, MAX_BYTES, MAX_DEPTH, MAX_NODES, MAX_NUMBER, Place, Refusal,
};
pub use hull::{Bounds, Capsule};
pub use note::Note;
pub use options::{DEFAULT_RADIUS, Limits, MAX_ANGLE, OptionError, Options};
pub use pose::Pose;
pub use selection::MAX_JOINTS;

use arm::LinkRow;
use chain::Chain;
use links::Links;
use note::Findings;
use tree::Tree;

/// Reads the text of a URDF; `file` is its name, for messages. All that is wrong is listed at once.
///
/// # Errors
///
/// A text that is not a URDF of a serial arm with all that is needed of it.
pub fn import(file: &str, text: &[u8], options: &Options) -> Result<Arm, Refusal> {
    let (reading, found) = read(text, options);
    match reading.arm {
        Some(arm) => Ok(Arm { notes: found.notes, ..arm }),
        None => Err(Refusal { file: file.to_owned(), faults: found.faults }),
    }
}

/// Tables of what is understood of a URDF, whether it gives an arm or not: links, joints, what was
/// assumed, what is wrong. Equal files and options give equal texts.
pub fn explain(file: &str, text: &[u8], options: &Options) -> String {
    let (reading, found) = read(text, options);
    explain::explanation(file, &reading.links, reading.arm.as_ref(), &found)
}

/// Result of reading a text.
#[derive(Default)]
struct Reading {
    links: Vec<LinkRow>,
    arm: Option<Arm>,
}

fn read(text: &[u8], options: &Options) -> (Reading, Findings) {
    let mut found = Findings::default();
    let reading = match text::checked(text) {
        Ok(text) => read_text(&text, options, &mut found),
        Err(fault) => {
            found.faults.push(fault);
            None
        }
    };
    (reading.unwrap_or_default(), found)
}

fn read_text(text: &str, options: &Options, found: &mut Findings) -> Option<Reading> {
    let document = text::document(text).map_err(|fault| found.faults.push(fault)).ok()?;
    let written = written::look(&document, &mut found.faults);
    let turned = written.turned.iter().cloned();
    found.notes.extend(turned.map(|(place, value)| Note::Turned { place, value }));
    let robot = match urdf_rs::read_from_string(&text::reduced(&document)) {
        Ok(robot) => robot,
        // Earlier faults say it better.
        Err(_) if !found.faults.is_empty() => return None,
        Err(error) => {
            found.faults.push(Fault::Parser { reason: error.to_string() });
            return None;
        }
    };
    let tree = Tree::new(&robot, &mut found.faults)?;
    let Some(selection) = selection::select(&tree, &written, options, found) else {
        let links = Links::new(&tree, &written, options, &found.faults).all(found);
        return Some(Reading { links, arm: None });
    };
    let chain = Chain { tree: &tree, selection: &selection, written: &written, options };
    let (arm, links) = chain.assemble(&robot.name, found);
    Some(Reading { links, arm })
}
