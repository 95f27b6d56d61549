//! Tables that `cargo xtask firmware` prints.

use crate::audit::emulation::{Phase, ReportFile, RunRecord, TargetRecord};
use remora_host::report::{Align, Table};

/// Bytes of the images, then one table for each integrator and start, a column a board.
pub fn report_tables(report: &ReportFile) -> Vec<(String, Table)> {
    let mut tables = vec![("Bytes".into(), bytes(&report.targets))];
    let first = report.targets.first().map_or(&[][..], |target| &target.runs);
    for (i, run) in first.iter().enumerate() {
        let runs: Vec<_> = report.targets.iter().filter_map(|target| target.runs.get(i)).collect();
        let heading = format!(
            "{} start, {}: mean instructions of {} plans",
            run.start.name(),
            run.integrator.label(),
            run.plans.len()
        );
        tables.push((heading, instructions(&report.targets, &runs)));
    }
    tables
}

/// Calls and instructions of the parts of a plan, a table a board.
pub fn parts_tables(report: &ReportFile) -> Vec<(String, Table)> {
    let table = |target: &TargetRecord| {
        let mut table = Table::new("part | >calls | >instructions");
        for part in &target.parts {
            table.row([part.name.clone(), part.calls.to_string(), part.instructions.to_string()]);
        }
        (format!("{}: parts of a plan", target.board), table)
    };
    report.targets.iter().map(table).collect()
}

/// An empty table with a column a board.
fn by_board(targets: &[TargetRecord]) -> Table {
    let boards = targets.iter().map(|target| (target.board.clone(), Align::Right));
    Table::with_columns([(String::new(), Align::Left)].into_iter().chain(boards).collect())
}

fn bytes(targets: &[TargetRecord]) -> Table {
    let mut table = by_board(targets);
    let mut row = |title: &str, of: &dyn Fn(&TargetRecord) -> String| {
        table.push([title.to_string()].into_iter().chain(targets.iter().map(of)).collect());
    };
    row("image", &|target| target.image_bytes.to_string());
    row("models", &|target| target.model_bytes.to_string());
    row("workspace", &|target| target.workspace_bytes.to_string());
    row("solver", &|target| target.solver_bytes.to_string());
    row("network's memory", &|target| target.network_bytes.to_string());
    let bytes = |bytes: Option<u64>| bytes.map_or("-".into(), |bytes| bytes.to_string());
    row("state of guidance", &|target| bytes(target.guidance_bytes));
    row("plan as it is flown", &|target| bytes(target.flight_plan_bytes));
    row("static memory in all", &|target| target.static_bytes.to_string());
    row("free of panics", &|target| yes(target.panic_free));
    table
}

fn instructions(targets: &[TargetRecord], runs: &[&RunRecord]) -> Table {
    let mut table = by_board(targets);
    let mut row = |title: &str, cells: Vec<String>| {
        table.push([title.to_string()].into_iter().chain(cells).collect());
    };
    for phase in Phase::ALL {
        row(phase.label(), runs.iter().map(|run| mean(run, phase).to_string()).collect());
    }
    let mark = |run: &&RunRecord| run.stack_bytes.get("plan").copied().unwrap_or_default();
    row("stack, high-water mark", runs.iter().map(|run| mark(run).to_string()).collect());
    let some = |value: Option<u64>| value.map_or("-".into(), |value| value.to_string());
    let slice =
        |run: &&RunRecord| some(run.plans.iter().filter_map(|plan| plan.longest_slice).max());
    row("longest slice", runs.iter().map(slice).collect());
    let step = |run: &&RunRecord| some(run.guidance.map(|flown| flown.next.instructions));
    row("step of guidance", runs.iter().map(step).collect());
    let first = |run: &&RunRecord| some(run.guidance.map(|flown| flown.first.instructions));
    row("first step somewhere", runs.iter().map(first).collect());
    let own = |run: &&RunRecord| some(run.guidance.and_then(|flown| flown.stack_bytes));
    row("stack of a step", runs.iter().map(own).collect());
    let solved = |run: &&RunRecord| {
        let solved = run.plans.iter().filter(|plan| plan.is_solved()).count();
        format!("{solved} of {}", run.plans.len())
    };
    row("plans solved", runs.iter().map(solved).collect());
    row("same bits as host", runs.iter().map(|run| yes(run.same_bits_as_host)).collect());
    let estimate = |(target, run): (&TargetRecord, &&RunRecord)| {
        target.clock_hz.map_or("-".into(), |hz| {
            let ms = mean(run, Phase::Total) as f64 / hz as f64 * 1e3;
            format!("{ms:.0} ({} MHz)", hz / 1_000_000)
        })
    };
    row("ESTIMATE [ms]", targets.iter().zip(runs).map(estimate).collect());
    table
}

fn mean(run: &RunRecord, phase: Phase) -> u64 {
    let sum: u64 = run.plans.iter().map(|plan| plan.instructions.of(phase)).sum();
    sum / (run.plans.len() as u64).max(1)
}

fn yes(holds: bool) -> String {
    if holds { "yes".into() } else { "NO".into() }
}
