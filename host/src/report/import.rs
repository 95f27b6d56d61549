//! Report of `remora mission import`.

use super::{Table, vehicle_report};
use remora_host::importing::ImportedMission;

/// Reports the decisions, the joints' angles, and what follows from the mission.
pub fn import_report(imported: &ImportedMission) -> String {
    let ImportedMission { robot, joints, decided, notes, doubts, vehicle, .. } = imported;
    let mut table = Table::new("joint |  | >start [deg] | >capture [deg]");
    for (i, joint) in joints.iter().enumerate() {
        let degrees = |angle: f64| format!("{:.2}", angle.to_degrees() + 0.0);
        let number = (i + 1).to_string();
        table.row([
            number,
            joint.name.clone(),
            degrees(joint.start_rad),
            degrees(joint.capture_rad),
        ]);
    }
    let count = joints.len();
    let notes = match notes.len() {
        0 => String::new(),
        count => format!("{count} notes on the file: --explain tells them\n\n"),
    };
    let said = list("decided", decided) + &list("look at", doubts) + &notes;
    format!("robot {robot}: an arm of {count} joints\n\n{table}\n{said}{}", vehicle_report(vehicle))
}

/// Reports what was understood of a file that is not imported, and what is wrong with it.
pub fn refused_import(explanation: &str, faults: &[String]) -> String {
    // The file's own faults are in its explanation.
    let missing: Vec<String> =
        faults.iter().filter(|fault| !explanation.contains(*fault)).cloned().collect();
    let line =
        if missing.is_empty() { String::new() } else { format!("\n{}", list("faults", &missing)) };
    format!("{explanation}{}\nnot imported\n", line.trim_end_matches('\n'))
}

fn list(title: &str, lines: &[String]) -> String {
    if lines.is_empty() {
        return String::new();
    }
    let lines: String = lines.iter().map(|line| format!("- {line}\n")).collect();
    format!("{title}\n{lines}\n")
}
