//! Which other axis of the end effector could be meant, where one finds no joint angles at capture.

use super::Request;
use crate::formats::MissionFile;
use nalgebra::Vector3;
use remora_urdf::Arm;

/// What would mend a search that has failed: an axis of the end effector's frame that does not.
pub(super) fn advice<const NL: usize>(request: &Request, file: &MissionFile, arm: &Arm) -> String {
    let asked = request.axis.and_then(|axis| axis.try_normalize(1e-9)).unwrap_or_else(Vector3::z);
    let others = [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().flat_map(|v| [v, -v]);
    let works = |own: &Vector3<f64>| {
        let mut other = file.clone();
        other.servicer.end_effector_axis =
            Some((arm.end_effector.rotation * own).normalize().into());
        own.dot(&asked) < 0.99 && other.mission_of::<NL>().is_ok()
    };
    let flags: Vec<String> = others.filter(works).map(|own| flag(&own)).collect();
    match flags.is_empty() {
        true => "none of +-x, +-y, +-z of the end effector would do as its axis: another --mount, \
                 --boresight or --start may"
            .into(),
        false => format!("as the end effector's axis would do {}", flags.join(", ")),
    }
}

fn flag(v: &Vector3<f64>) -> String {
    let [x, y, z] = [v.x, v.y, v.z].map(|x| x + 0.0);
    format!("--axis {x},{y},{z}")
}
