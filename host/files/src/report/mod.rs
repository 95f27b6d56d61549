//! Tables, pages for people and plots: how numbers are shown.

mod iterations;
pub mod page;
pub mod plot;
mod table;

pub use iterations::iteration_log;
pub use page::{Block, Page};
pub use table::{Align, Table};

/// A number in four significant digits: plain where that is short, otherwise with an exponent. Whole numbers
/// are shown as such.
pub fn number(x: f64) -> String {
    let size = x.abs();
    if x == x.trunc() && size < 1e5 {
        // Minus zero is zero.
        format!("{:.0}", x + 0.0)
    } else if (1e-3..1e5).contains(&size) {
        let digits = 3 - size.log10().floor() as i32;
        format!("{x:.*}", digits.max(0) as usize)
    } else {
        format!("{x:.2e}")
    }
}

/// A time in the unit that suits it.
pub fn time(seconds: f64) -> String {
    match seconds {
        s if s >= 100.0 => format!("{s:.0} s"),
        s if s >= 1.0 => format!("{s:.2} s"),
        s if s >= 1e-3 => format!("{:.1} ms", s * 1e3),
        s if s > 0.0 => format!("{:.1} us", s * 1e6),
        _ => "0 s".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let shown = [0.0, 0.123456, 1.0, 12345.678, 1e-9, -0.5, 1234567.0].map(number);
        assert_eq!(shown, ["0", "0.1235", "1", "12346", "1.00e-9", "-0.5000", "1.23e6"]);
        let shown = [0.0, 3.14159e-5, 0.0123, 2.5, 1234.0].map(time);
        assert_eq!(shown, ["0 s", "31.4 us", "12.3 ms", "2.50 s", "1234 s"]);
    }
}
