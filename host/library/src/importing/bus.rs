//! What carries the arm, and where the arm is on it.

use super::{NoImport, Request, mount, name, unit};
use crate::error::FieldError;
use crate::formats::{MissionFile, PLANNED_JOINTS};
use crate::with_joints;
use nalgebra::{Matrix3, Vector3};
use remora_urdf::{Arm, Base, Body, Options, Pose, import};

/// An arm on a bus.
pub(super) struct Settled {
    pub arm: Arm,
    /// With which the arm was read.
    pub options: Options,
    /// Mass properties in the frame in which the arm was read.
    pub body: Body,
    /// Half edge lengths of the box about its centre of mass that holds it [m].
    pub half_extents: Vector3<f64>,
    /// Unit vector, bus axes.
    pub boresight: Vector3<f64>,
    /// All else but the arm.
    pub mission: MissionFile,
    /// What was decided.
    pub decided: Vec<String>,
}

/// A mission's bus.
struct Given {
    mass: f64,
    inertia: Matrix3<f64>,
    half_extents: Vector3<f64>,
    boresight: Vector3<f64>,
}

/// Reads the arm and settles which bus carries it: the one that is given, the URDF's own, or the
/// built-in mission's. Where the arm's mount on it is not given, it is one of several, in the order in
/// which they are to be tried.
pub(super) fn settle(request: &Request) -> Result<Vec<Settled>, NoImport> {
    let (file, mission) = match &request.bus {
        Some((file, mission)) => (file.clone(), mission.clone()),
        None => ("built-in mission".into(), MissionFile::default()),
    };
    let given = Given::of(&mission).map_err(|error| error.at(&file))?;
    let boresight = unit(request.boresight, "--boresight")?;
    let mut options = request.options.clone();
    options.mount = request.mount.unwrap_or_else(Pose::identity);
    let arm = read(request, &options)?;
    match (&request.bus, arm.base.clone()) {
        (None, Some(base)) => Ok(on_own_bus(&arm, &options, &base, boresight, &mission)),
        _ => on_given_bus(request, &options, &given, boresight, &mission),
    }
}

fn read(request: &Request, options: &Options) -> Result<Arm, NoImport> {
    import(&name(&request.file), &request.urdf, options).map_err(NoImport::Urdf)
}

/// On the URDF's own bus, the camera looking along each of the bus axes, the nearest to the arm first,
/// unless its boresight is given.
fn on_own_bus(
    arm: &Arm,
    options: &Options,
    base: &Base,
    boresight: Option<Vector3<f64>>,
    mission: &MissionFile,
) -> Vec<Settled> {
    let Base { link, body, bounds } = base;
    let mut decided = vec![format!(
        "the bus is the URDF's own, link `{link}` of {} kg; --bus FILE gives another",
        body.mass
    )];
    let half_extents = match bounds {
        Some(bounds) => {
            let (lower, upper) = (bounds.lower, bounds.upper);
            (upper - body.center_of_mass).abs().sup(&(lower - body.center_of_mass).abs())
        }
        None => {
            let half = uniform_box(body);
            decided.push(format!(
                "link `{link}` has no collision shape that is read: the box of the bus is that of an even body of its \
                 inertia, half {} m",
                shown(&half)
            ));
            half
        }
    };
    let looking = |boresight: Vector3<f64>, decided: Vec<String>| Settled {
        arm: arm.clone(),
        options: options.clone(),
        body: *body,
        half_extents,
        boresight,
        mission: mission.clone(),
        decided,
    };
    if let Some(boresight) = boresight {
        return vec![looking(boresight, decided)];
    }
    let along = |axis: Vector3<f64>| {
        let said = format!(
            "the camera looks along ({}) of the bus, towards the arm; --boresight x,y,z gives another",
            shown(&axis)
        );
        looking(axis, decided.iter().cloned().chain([said]).collect())
    };
    axes(&(arm.arm_base - body.center_of_mass)).into_iter().map(along).collect()
}

fn on_given_bus(
    request: &Request,
    options: &Options,
    given: &Given,
    boresight: Option<Vector3<f64>>,
    mission: &MissionFile,
) -> Result<Vec<Settled>, NoImport> {
    let boresight = boresight.unwrap_or(given.boresight);
    let poses = match request.mount {
        Some(mount) => vec![mount],
        None => mount::candidates(&given.half_extents, &boresight),
    };
    let mounted = |mount: Pose| {
        let options = Options { mount, ..options.clone() };
        let arm = read(request, &options)?;
        Ok(carried(request, arm, options, given, boresight, mission.clone()))
    };
    poses.into_iter().map(mounted).collect()
}

fn carried(
    request: &Request,
    arm: Arm,
    options: Options,
    given: &Given,
    boresight: Vector3<f64>,
    mission: MissionFile,
) -> Settled {
    let mut decided = Vec::new();
    if request.bus.is_none() {
        decided.push("the bus is the built-in mission's; --bus FILE gives another".to_string());
    }
    if request.mount.is_none() {
        decided.push(format!(
            "the arm's root is mounted at ({}) m, on the face of the bus that the boresight leaves, its +z along the \
             boresight; --mount x,y,z[,roll,pitch,yaw] moves it",
            shown(&options.mount.position)
        ));
    }
    let center_of_mass = Vector3::zeros();
    let mut body = Body { mass: given.mass, center_of_mass, inertia: given.inertia };
    if let Some(base) = &arm.base {
        body = body.merged(&base.body);
        decided.push(format!(
            "link `{}`, {} kg, is fixed to the bus; its shape is not part of the bus's box",
            base.link, base.body.mass
        ));
    }
    // The box is about the centre of mass, which the arm's base has moved.
    let half_extents = given.half_extents + body.center_of_mass.abs();
    Settled { arm, options, body, half_extents, boresight, mission, decided }
}

impl Given {
    /// The bus of a mission that must be valid, whatever its arm.
    fn of(file: &MissionFile) -> Result<Self, FieldError> {
        with_joints!(file.joints(), NL => {
            let s = file.mission_of::<NL>()?.servicer;
            Ok(Self {
                mass: s.bus_mass,
                inertia: s.bus_inertia,
                half_extents: s.bus_half_extents,
                boresight: s.boresight,
            })
        } else {
            Err(file.wrong_joints(PLANNED_JOINTS))
        })
    }
}

/// Half edge lengths of the even box, along the body's axes, that has its moments of inertia [m].
fn uniform_box(body: &Body) -> Vector3<f64> {
    let moments = body.inertia.diagonal();
    let half = |i: usize| (1.5 * (moments.sum() - 2.0 * moments[i]) / body.mass).max(0.0).sqrt();
    Vector3::new(half(0), half(1), half(2))
}

/// The axes, either way, those first that lead to `v`.
fn axes(v: &Vector3<f64>) -> Vec<Vector3<f64>> {
    let both = |axis: Vector3<f64>| [axis, -axis];
    let mut all: Vec<_> =
        [Vector3::z(), Vector3::x(), Vector3::y()].into_iter().flat_map(both).collect();
    all.sort_by(|a, b| b.dot(v).total_cmp(&a.dot(v)));
    all.retain(|axis| axis.dot(v) >= 0.0);
    all
}

/// Three numbers, rounded.
fn shown(v: &Vector3<f64>) -> String {
    numbers(v.as_slice())
}

/// Joint angles, rounded, in brackets.
pub(super) fn shown_angles(angles: &[f64]) -> String {
    format!("[{}]", numbers(angles))
}

/// Numbers to four digits, none of which is minus zero.
pub(super) fn numbers(of: &[f64]) -> String {
    let shown = |x: &f64| ((x * 1e4).round() / 1e4 + 0.0).to_string();
    of.iter().map(shown).collect::<Vec<_>>().join(", ")
}
