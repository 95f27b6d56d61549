//! Missions of URDFs.

use crate::raised::{argument, raised};
use pyo3::prelude::*;
use remora_core::nalgebra::Vector3;
use remora_host::formats::{MissionFile, read_mission_file};
use remora_host::importing::{Request, import};
use remora_urdf::Pose;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Arguments beside a URDF.
pub(crate) struct Said {
    pub(crate) tip: Option<String>,
    pub(crate) base: Option<String>,
    pub(crate) bus: Option<PathBuf>,
    pub(crate) mount: Option<Vec<f64>>,
    pub(crate) boresight: Option<[f64; 3]>,
    pub(crate) axis: Option<[f64; 3]>,
    pub(crate) start: Option<Vec<f64>>,
    pub(crate) armature: Option<Vec<f64>>,
    pub(crate) limits: Option<BTreeMap<String, [f64; 4]>>,
    pub(crate) hold: Option<BTreeMap<String, f64>>,
    pub(crate) point_mass: Option<BTreeSet<String>>,
}

/// The mission file of a URDF.
pub(crate) fn mission_file(path: &Path, said: Said) -> PyResult<MissionFile> {
    let mut request = Request::of(path).map_err(raised)?;
    let options = &mut request.options;
    (options.root, options.end_effector) = (said.base, said.tip);
    options.point_masses = said.point_mass.unwrap_or_default();
    for (joint, [lower, upper, rate, torque]) in said.limits.unwrap_or_default() {
        let text = format!("{joint}={lower},{upper},{rate},{torque}");
        options.add_limit(&text).map_err(|error| argument("limits", error))?;
    }
    for (joint, angle) in said.hold.unwrap_or_default() {
        let text = format!("{joint}={angle}");
        options.add_hold(&text).map_err(|error| argument("hold", error))?;
    }
    if let Some(bus) = said.bus {
        let file = read_mission_file(Some(&bus)).map_err(raised)?;
        request.bus = Some((bus, file));
    }
    request.mount = said.mount.map(|numbers| pose(&numbers)).transpose()?;
    request.boresight = said.boresight.map(Vector3::from);
    request.axis = said.axis.map(Vector3::from);
    (request.start, request.armature) = (said.start, said.armature);
    let imported = import(&request).map_err(|refusal| raised(refusal.error(&request)))?;
    Ok(imported.mission)
}

/// Position and, where they are given, roll, pitch and yaw.
fn pose(numbers: &[f64]) -> PyResult<Pose> {
    let is_finite = numbers.iter().all(|x| x.is_finite());
    match *numbers {
        [x, y, z] if is_finite => Ok(Pose::from_xyz_rpy([x, y, z], [0.0; 3])),
        [x, y, z, roll, pitch, yaw] if is_finite => {
            Ok(Pose::from_xyz_rpy([x, y, z], [roll, pitch, yaw]))
        }
        _ => {
            Err(argument("mount", "expects x, y, z or x, y, z, roll, pitch, yaw [m, rad], finite"))
        }
    }
}
