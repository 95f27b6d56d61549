//! Tables for the terminal, at most 100 columns wide; pages for people and plots.

mod campaign;
mod check;
mod dataset;
mod envelope;
mod export;
mod inject;
pub mod page;
mod plan;
pub mod plot;
mod profile;
mod table;

pub use campaign::campaign_report;
pub use check::check_report;
pub use dataset::dataset_report;
pub use envelope::envelope_report;
pub use export::export_report;
pub use inject::{injection_report, replay_report};
pub use page::{Block, Page};
pub use plan::{evidence, iteration_log, plan_report};
pub use profile::{profile_preamble, profile_report};
pub use table::{Align, Table};

use crate::formats::PlanResiduals;
use remora_core::model::Tolerances;
use remora_core::stages::Residuals;

/// A number in four significant digits: plain where that is short, otherwise with an exponent.
pub fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".into()
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

/// Residuals against their tolerances.
fn residual_table(residuals: &PlanResiduals, tolerances: &Tolerances) -> Table {
    let mut table = Table::new([
        ("residual", Align::Left),
        ("value", Align::Right),
        ("tolerance", Align::Right),
        ("", Align::Left),
        ("unit", Align::Left),
    ]);
    let units = [
        "1 m, 1e-2 m/s",
        "m",
        "1, 1 rad, 1e-2 rad/s",
        "of the limit",
        "rad",
        "of the limit",
        "cosine",
        "1 rad, 1e-2 rad/s",
        "1e-2 rad/s",
        "m",
        "rad",
    ];
    let rows = Residuals::from(*residuals).against(tolerances);
    for ((name, value, tolerance), unit) in rows.into_iter().zip(units) {
        let mark = if value <= tolerance { "ok" } else { "TOO LARGE" };
        table.row([
            name.to_string(),
            if value == 0.0 { "0".into() } else { format!("{value:.1e}") },
            format!("{tolerance:.0e}"),
            mark.into(),
            unit.into(),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let shown = [0.0, 0.123456, 1.0, 12345.678, 1e-9, -0.5, 1234567.0].map(number);
        assert_eq!(shown, ["0", "0.1235", "1.000", "12346", "1.00e-9", "-0.5000", "1.23e6"]);
        let shown = [0.0, 3.14159e-5, 0.0123, 2.5, 1234.0].map(time);
        assert_eq!(shown, ["0 s", "31.4 us", "12.3 ms", "2.50 s", "1234 s"]);
    }
}
