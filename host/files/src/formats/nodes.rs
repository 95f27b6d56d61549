//! Trajectories as a tidy table: a row a node.

use super::{Cell, Column, PlanFile};

/// Meanings of the columns, for the table's own metadata.
pub const ABOUT_NODES: [(&str, &str); 14] = [
    ("scenario", "id; a drawn one's seed and index"),
    ("node", "counted from 0"),
    ("time_s", "since the plan begins"),
    ("position_*", "centre of mass of the servicer with its arm from the target's, RTN axes"),
    ("velocity_*", "its velocity relative to RTN, RTN axes"),
    ("force_*", "held until the next node, RTN axes; zero at the last"),
    ("bus_attitude_*", "quaternion, body to RTN"),
    ("bus_rate_*", "rate of the bus relative to RTN, RTN axes"),
    ("bus_torque_*", "held until the next node, bus axes; zero at the last"),
    ("joint_angle_*", "of each joint, from the bus on"),
    ("joint_rate_*", "of each joint"),
    ("joint_torque_*", "held until the next node; zero at the last"),
    ("target_attitude_*", "quaternion, body to RTN"),
    ("target_rate_*", "rate of the target relative to RTN, RTN axes"),
];

/// Names and units of a node's columns, which follow scenario, node and time.
pub fn node_columns(joints: usize) -> Vec<(String, &'static str)> {
    let mut columns = Vec::new();
    let mut vector = |name: &str, axes: &[&str], end: &str, unit| {
        columns.extend(axes.iter().map(|axis| (format!("{name}_{axis}{end}"), unit)));
    };
    let (rtn, body, quaternion) = (["r", "t", "n"], ["x", "y", "z"], ["x", "y", "z", "w"]);
    let numbers: Vec<String> = (0..joints).map(|i| i.to_string()).collect();
    let joints: Vec<&str> = numbers.iter().map(String::as_str).collect();
    vector("position", &rtn, "_m", "m");
    vector("velocity", &rtn, "_m_s", "m/s");
    vector("force", &rtn, "_n", "N");
    vector("bus_attitude", &quaternion, "", "");
    vector("bus_rate", &rtn, "_rad_s", "rad/s");
    vector("bus_torque", &body, "_n_m", "N m");
    vector("joint_angle", &joints, "_rad", "rad");
    vector("joint_rate", &joints, "_rad_s", "rad/s");
    vector("joint_torque", &joints, "_n_m", "N m");
    vector("target_attitude", &quaternion, "", "");
    vector("target_rate", &rtn, "_rad_s", "rad/s");
    columns
}

/// The numbers of a plan, a row a node, time first. Nothing is done at the last node: zero.
pub fn node_numbers(plan: &PlanFile) -> Vec<Vec<f64>> {
    let (one, two, target) = (&plan.stage1, &plan.stage2, &plan.target);
    let dt = plan.grid.dt_s;
    let joints = two.joint_angle.first().map_or(0, Vec::len);
    (0..one.position.len())
        .map(|k| {
            let mut row = vec![k as f64 * dt];
            row.extend(one.position[k]);
            row.extend(one.velocity[k]);
            row.extend(one.force.get(k).unwrap_or(&[0.0; 3]));
            row.extend(two.attitude[k]);
            row.extend(two.rate[k]);
            row.extend(two.bus_torque.get(k).unwrap_or(&[0.0; 3]));
            row.extend(&two.joint_angle[k]);
            row.extend(&two.joint_rate[k]);
            row.extend(two.joint_torque.get(k).unwrap_or(&vec![0.0; joints]));
            row.extend(target.attitude[k]);
            row.extend(target.rate[k]);
            row
        })
        .collect()
}

/// A row of the table.
pub fn node_row(
    scenario: &str,
    node: usize,
    numbers: &[f64],
    columns: &[(String, &'static str)],
) -> Vec<Column> {
    let named = |name: &str, unit, cell| Column { name: name.to_string(), unit, cell };
    let at = |i: usize| Cell::Number(numbers.get(i).copied().unwrap_or(f64::NAN));
    let mut row = vec![
        named("scenario", "", Cell::Text(scenario.to_string())),
        named("node", "", Cell::Integer(i64::try_from(node).unwrap_or(i64::MAX))),
        named("time_s", "s", at(0)),
    ];
    row.extend(columns.iter().enumerate().map(|(i, (name, unit))| named(name, unit, at(i + 1))));
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::results_about::each_once;

    #[test]
    fn every_column_is_explained_once_and_nothing_else() {
        let row = node_row("a", 0, &[], &node_columns(7));
        let names: Vec<&str> = row.iter().map(|column| column.name.as_str()).collect();
        each_once(&names, &ABOUT_NODES);
    }
}
