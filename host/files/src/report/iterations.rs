//! The iterations of a stage, a line each.

use super::{Table, number, time};
use remora_core::advanced::scp::IterationRecord;

/// The iteration log of a stage, a line an iteration.
pub fn iteration_log(title: &str, log: &[IterationRecord]) -> String {
    let mut table = Table::new(
        ">it | >cost | >penalty | >ratio | >radius | >weight | >worst |  | >QP it | >corr | QP status | >time",
    );
    for (i, record) in log.iter().enumerate() {
        table.row([
            (i + 1).to_string(),
            number(record.cost),
            format!("{:.1e}", record.l1_violation),
            ratio(record.rho),
            format!("{:.1e}", record.radius),
            format!("{:.0e}", record.penalty_parameter),
            format!("{:.1e}", record.violation),
            if record.accepted { "+" } else { "-" }.into(),
            record.qp_iterations.to_string(),
            record.corrections.to_string(),
            words(&format!("{:?}", record.qp_status)),
            time(record.time_s),
        ]);
    }
    format!("{title} (+ step taken; worst: largest violation over its tolerance)\n{table}\n")
}

fn ratio(ratio: f64) -> String {
    if ratio.abs() < 1000.0 { format!("{ratio:.3}") } else { format!("{ratio:.1e}") }
}

/// `ReducedAccuracy` as `reduced accuracy`.
fn words(camel: &str) -> String {
    let mut out = String::new();
    for c in camel.chars() {
        if c.is_uppercase() && !out.is_empty() {
            out.push(' ');
        }
        out.extend(c.to_lowercase());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_statuses_become_words() {
        assert_eq!(words("ReducedAccuracy"), "reduced accuracy");
        assert_eq!(words("Solved"), "solved");
    }

    #[test]
    fn the_log_fits_a_hundred_columns() {
        let record = IterationRecord {
            cost: -1.234e-12,
            l1_violation: 1.5e-10,
            rho: -1000.5,
            radius: 1e-3,
            penalty_parameter: 1e6,
            violation: 1e10,
            accepted: true,
            qp_iterations: 300,
            qp_status: remora_core::advanced::qp::QpStatus::NumericalFailure,
            time_s: 0.1234,
            ..Default::default()
        };
        let text = iteration_log("Stage 1", &[record]);
        assert!(text.lines().all(|line| line.len() <= 100), "{text}");
    }
}
