//! Report of `remora campaign`.

use super::{Table, number, time};
use remora_host::campaign::{NearestOf, Results, Statistics, Summary};
use remora_host::stopwatch::busy_share;
use std::fmt::Write;

/// Success rate, statistics, ids that were not solved, files.
pub fn campaign_report(results: &Results) -> String {
    let mut out = summary_report(&results.summary);
    let run = &results.summary.run;
    let _ = write!(out, "{} planned in {}", run.planned, time(run.wall_s));
    if run.resumed > 0 {
        let _ = write!(out, ", {} taken from the journal", run.resumed);
    }
    out.push('\n');
    for file in &results.files {
        let _ = writeln!(out, "written: {}", file.display());
    }
    out
}

/// Success rate, statistics, ids that were not solved.
pub fn summary_report(summary: &Summary) -> String {
    let mut out = format!(
        "{} scenarios: {} solved ({:.2} %)\n{} mode, {} start, {}, {}\n",
        summary.scenarios,
        summary.solved,
        100.0 * summary.success_rate,
        summary.mode.name(),
        summary.warm_start.name(),
        summary.integrator,
        summary.qp.name(),
    );
    for (verdict, count) in &summary.by_verdict {
        let _ = writeln!(out, "  {verdict:<27} {count:>6}");
    }
    for (reason, count) in &summary.by_reason {
        let _ = writeln!(out, "    by {reason:<22} {count:>6}");
    }
    if summary.refused > 0 {
        let _ = writeln!(out, "  refused before planning: {}", summary.refused);
    }
    let _ = writeln!(out, "status");
    for (status, count) in &summary.by_status {
        let _ = writeln!(out, "  {status:<18} {count:>6}");
    }
    if summary.fallbacks > 0 {
        let _ = writeln!(out, "  from the heuristic instead of the model: {}", summary.fallbacks);
    }
    let _ = writeln!(out, "\n{}", statistics(summary));
    if let Some(nearest) = &summary.nearest {
        let NearestOf { scenario, pair, distance_m, time_s } = nearest;
        let _ = writeln!(
            out,
            "smallest distance, end effector left out: {distance_m:.3} m, {pair}, at {time_s:.0} s of {scenario}\n"
        );
    }
    if let Some(share) = busy_share(summary.time_s.mean, summary.cpu_time_s.mean) {
        let _ = writeln!(
            out,
            "the machine was busy: a plan had {:.0} % of a core, times say little\n",
            100.0 * share
        );
    }
    if !summary.unsolved.is_empty() {
        let _ = writeln!(out, "not solved:\n{}", wrapped(&summary.unsolved));
    }
    out
}

fn statistics(summary: &Summary) -> Table {
    let mut table = Table::new(" | >mean | >std | >median | >p99 | >max");
    let mut row = |name: &str, s: &Statistics, show: fn(f64) -> String| {
        let [mean, std, median, p99, max] = [s.mean, s.std, s.median, s.p99, s.max].map(show);
        table.row([name.into(), mean, std, median, p99, max]);
    };
    let (translation, reorientation) = (&summary.stage1, &summary.stage2);
    row("stage 1 iterations", &translation.iterations, number);
    row("stage 1 corrections", &translation.corrections, number);
    row("stage 1 time", &translation.time_s, time);
    row("stage 1 cost (solved)", &translation.cost, number);
    row("stage 2 iterations", &reorientation.iterations, number);
    row("stage 2 corrections", &reorientation.corrections, number);
    row("stage 2 time", &reorientation.time_s, time);
    if summary.inference_s.max > 0.0 {
        row("  of it inference", &summary.inference_s, time);
    }
    row("stage 2 cost (solved)", &reorientation.cost, number);
    row("whole plan time", &summary.time_s, time);
    row("  of it processor", &summary.cpu_time_s, time);
    table
}

/// Words in lines of at most 100 columns.
fn wrapped(words: &[String]) -> String {
    let mut out = String::new();
    let mut column = 0;
    for word in words {
        if column > 0 && column + 1 + word.len() > 98 {
            out.push('\n');
            column = 0;
        }
        let space = if column == 0 { "  " } else { " " };
        out.push_str(space);
        out.push_str(word);
        column += 1 + word.len();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lists_are_wrapped() {
        let ids: Vec<String> = (0..50).map(|i| format!("s1-{i:03}")).collect();
        let text = wrapped(&ids);
        assert!(text.lines().all(|line| line.len() <= 100 && line.starts_with("  s1-")));
        assert_eq!(text.split_whitespace().count(), 50);
    }
}
