//! Meanings of the columns of tables, for the tables' own metadata.

use serde_json::{Map, Value, json};

/// The columns that say how long the machine took: two runs of the same plans differ in these alone.
pub const TIMES: [&str; 5] =
    ["stage1_time_s", "stage2_time_s", "inference_s", "time_s", "cpu_time_s"];

/// Entry of a table's metadata: what its columns mean. A name that ends in `*` is of all that begin so.
pub fn about(columns: &[(&str, &str)]) -> (&'static str, String) {
    let pairs = columns.iter().map(|(name, about)| (name.to_string(), (*about).into()));
    ("remora.about", json!(pairs.collect::<Map<String, Value>>()).to_string())
}

/// Columns whose name needs words, and the words.
const ABOUT: [(&str, &str); 39] = [
    ("scenario", "id; a drawn one's seed and index"),
    ("status", "the worse of the stages'; infeasible where refused before planning"),
    ("stage1_iterations", "convex programs of the path of the centre of mass"),
    ("stage1_cost", "cost of the path"),
    ("stage1_time_s", "wall time of stage 1"),
    ("stage2_iterations", "convex programs of attitude and arm"),
    ("stage2_cost", "cost of attitude and arm"),
    ("stage2_time_s", "wall time of stage 2"),
    ("inference_s", "wall time of the learned start"),
    ("verdict", "optimal, verified_not_converged or not_flyable"),
    ("reason", "residual farthest beyond its tolerance, or constraint for which it was refused"),
    ("clearance_arm_m", "smallest distance of arm, end effector included, and target"),
    ("clearance_arm_time_s", "when, in the plan's time"),
    ("clearance_bus_m", "smallest distance of bus and target"),
    ("clearance_bus_time_s", "when, in the plan's time"),
    ("clearance_own_m", "smallest distance of arm and own bus"),
    ("clearance_own_time_s", "when, in the plan's time"),
    ("mode", "what was asked of stage 2"),
    ("warm_start", "what stage 2 started from; none where refused before planning"),
    ("qp", "solver of the convex programs"),
    ("integrator", "discretisation of stage 2"),
    ("verified", "the verifier found every constraint kept"),
    ("target_rate_rad_s", "norm of the target's rate relative to RTN at the start"),
    ("start_distance_m", "distance of the centres of mass at the start"),
    ("peak_force_n", "largest component of the force"),
    ("peak_bus_torque_n_m", "largest component of the bus torque"),
    ("peak_joint_torque_n_m", "largest joint torque"),
    ("delta_v_m_s", "force over mass, summed over the plan"),
    ("clearance_smallest_m", "smallest distance of two bodies, the end effector left out"),
    ("time_s", "wall time of the whole plan"),
    ("cpu_time_s", "processor time of the thread that planned"),
    ("stage1_corrections", "second-order corrections of stage 1"),
    ("stage2_corrections", "second-order corrections of stage 2"),
    (
        "plan_checksum",
        "FNV-1a of the plan's trajectories; the same plan has the same on every machine",
    ),
    (
        "clearance_smallest_pair",
        "these two: bus or link and target, or link and own bus; links from 1",
    ),
    ("clearance_smallest_time_s", "when, in the plan's time"),
    (
        "clearance_end_effector_m",
        "smallest distance of end effector and target, or edge of its corridor",
    ),
    (
        "clearance_end_effector_time_s",
        "when, in the plan's time: at the port, at capture, as a rule",
    ),
    ("residual_*", "largest violation of the constraint of this name"),
];

/// Entries of a table's metadata: what its columns mean, and which of them are times of the machine.
pub(super) fn entries() -> [(&'static str, String); 2] {
    [about(&ABOUT), ("remora.times", json!(TIMES).to_string())]
}

/// Asserts that each name has one entry on its meaning, and each entry a name.
#[cfg(test)]
pub(super) fn each_once(names: &[&str], about: &[(&str, &str)]) {
    let is_of = |name: &str, entry: &str| match entry.strip_suffix('*') {
        Some(start) => name.starts_with(start),
        None => name == entry,
    };
    for name in names {
        assert_eq!(about.iter().filter(|(entry, _)| is_of(name, entry)).count(), 1, "{name}");
    }
    for (entry, _) in about {
        assert!(names.iter().any(|name| is_of(name, entry)), "{entry}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::columns;
    use crate::formats::results::tests::rows;
    use crate::method::Method;

    #[test]
    fn every_column_is_explained_once_and_nothing_else() {
        let columns = columns(&rows()[0], &Method::default());
        let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
        each_once(&names, &ABOUT);
        // In the table's order.
        let named = names.iter().copied().filter(|name| !name.starts_with("residual_"));
        assert!(named.eq(ABOUT.iter().map(|(name, _)| *name).filter(|name| !name.ends_with('*'))));
        assert!(TIMES.iter().all(|time| names.contains(time)));
    }
}
