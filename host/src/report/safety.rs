//! Report of `remora fly --safety`.

use remora_flight::ways_out::{NodeWays, WaysOut};
use remora_host::report::{Align, Table};
use std::fmt::Write;

/// A row a node, and what they come to.
pub fn safety_report(ways: &WaysOut) -> String {
    let is_flown = ways.nodes.iter().any(|node| node.flown.is_some());
    let right = Align::Right;
    let mut columns = vec![
        ("node", right),
        ("time s", right),
        ("abort", Align::Left),
        ("clear after s", right),
        ("nearest m", right),
        ("drift keeps out", Align::Left),
        ("nearest m", right),
    ];
    if is_flown {
        columns.extend([("| flown: abort", Align::Left), ("nearest m", right), ("drift m", right)]);
    }
    let columns = columns.into_iter().map(|(name, align)| (name.to_string(), align)).collect();
    let mut table = Table::with_columns(columns);
    for (k, node) in ways.nodes.iter().enumerate() {
        table.push(cells(k, node));
    }
    let mut out = format!("ways out of {}\n\n{table}\n", ways.scenario);
    let _ = match ways.point_of_no_return {
        None => writeln!(out, "point of no return: none, every abort leaves the target clear"),
        Some(k) => {
            let time = ways.nodes[k].planned.time;
            writeln!(out, "POINT OF NO RETURN: node {k}, {time:.0} s")
        }
    };
    let drifts = ways.nodes.iter().filter(|node| node.planned.drift.clears).count();
    let _ = writeln!(
        out,
        "a free drift of one orbit keeps out from {drifts} of {} nodes",
        ways.nodes.len()
    );
    if is_flown {
        let flown = ways.nodes.iter().filter_map(|node| node.flown.as_ref());
        let cleared = flown.filter(|flown| flown.escape_clears).count();
        let _ = writeln!(out, "flown aborts that cleared: {cleared} of {}", ways.nodes.len());
    }
    out
}

fn cells(k: usize, node: &NodeWays) -> Vec<String> {
    let mark = |clears: bool| if clears { "clears" } else { "DOES NOT" }.to_string();
    let (escape, drift) = (&node.planned.escape, &node.planned.drift);
    let mut cells = vec![
        k.to_string(),
        format!("{:.0}", node.planned.time),
        mark(escape.clears),
        if escape.time.is_finite() { format!("{:.0}", escape.time) } else { "never".into() },
        format!("{:.3}", escape.clearance),
        if drift.clears { "yes" } else { "no" }.to_string(),
        format!("{:.3}", drift.distance),
    ];
    if let Some(flown) = &node.flown {
        cells.extend([
            format!("| {}", mark(flown.escape_clears)),
            format!("{:.3}", flown.escape_clearance_m),
            format!("{:.3}", flown.drift_distance_m),
            format!("{:.3}", flown.drift_clearance_m),
        ]);
    }
    cells
}
