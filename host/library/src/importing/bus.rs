//! The bus that carries the arm, and the arm's mount on it.

use super::{NoImport, Request, mount, name, unit};
use crate::error::FieldError;
use crate::formats::{MissionFile, Radius};
use nalgebra::{Matrix3, Vector3};
use remora_urdf::{Arm, Base, Body, Options, Pose, import};

/// An arm on a bus.
pub(super) struct ArmOnBus {
    pub arm: Arm,
    /// Options with which the arm was read.
    pub options: Options,
    /// Whether the bus is the URDF's own.
    pub is_own: bool,
    /// Mass properties in the frame in which the arm was read.
    pub body: Body,
    /// Half edge lengths of the box about its centre of mass that holds it [m].
    pub half_extents: Vector3<f64>,
    /// Unit vector, bus axes.
    pub boresight: Vector3<f64>,
    /// All else but the arm.
    pub mission: MissionFile,
    /// Decisions, in words.
    pub decided: Vec<String>,
}

/// A mission's bus.
struct BusProperties {
    mass: f64,
    inertia: Matrix3<f64>,
    half_extents: Vector3<f64>,
    boresight: Vector3<f64>,
}

/// Reads the arm and settles which bus carries it: the one that is given, the URDF's own, or the
/// built-in mission's. Where the arm's mount on it is not given, it is one of several, in the order in
/// which they are to be tried.
pub(super) fn settle(request: &Request) -> Result<Vec<ArmOnBus>, NoImport> {
    let (file, mission) = match &request.bus {
        Some((file, mission)) => (file.clone(), mission.clone()),
        None => ("built-in mission".into(), MissionFile::default()),
    };
    let given = BusProperties::of(&mission).map_err(|error| error.at(&file))?;
    let boresight = unit(request.boresight, "--boresight")?;
    let mut options = request.options.clone();
    options.mount = request.mount.unwrap_or_else(Pose::identity);
    let arm = read(request, &options)?;
    match (&request.bus, arm.base.clone()) {
        (None, Some(base)) => on_own_bus(request, &arm, &base, boresight, &mission),
        _ => on_given_bus(request, &options, &given, boresight, &mission),
    }
}

fn read(request: &Request, options: &Options) -> Result<Arm, NoImport> {
    import(&name(&request.file), &request.urdf, options).map_err(NoImport::Urdf)
}

/// On the URDF's own bus, the camera looking along each of its axes, the nearest to the arm first, unless
/// its boresight is given. Planning begins with +z of the bus towards the target: the bus axes are the root
/// link's, turned until the boresight is their +z.
fn on_own_bus(
    request: &Request,
    arm: &Arm,
    base: &Base,
    boresight: Option<Vector3<f64>>,
    mission: &MissionFile,
) -> Result<Vec<ArmOnBus>, NoImport> {
    let boresights = match boresight {
        Some(boresight) => vec![boresight],
        None => axes(&(arm.arm_base - base.body.center_of_mass)),
    };
    let looking = |along: Vector3<f64>| {
        let turn = turn_to_z(&along);
        let mount = request.mount.unwrap_or_else(Pose::identity);
        let mount = Pose { position: turn * mount.position, rotation: turn * mount.rotation };
        let options = Options { mount, ..request.options.clone() };
        let arm = read(request, &options)?;
        let mut decided = vec![format!(
            "the bus is the URDF's own, link `{}` of {} kg; --bus FILE gives another",
            base.link, base.body.mass
        )];
        if boresight.is_none() {
            decided.push(format!(
                "the camera looks along ({}) of the URDF's bus, where the arm is; --boresight x,y,z gives another",
                shown(&along)
            ));
        }
        if turn != Matrix3::identity() {
            let x = turn.row(0).transpose();
            decided.push(format!(
                "bus axes: +z is ({}) of the URDF's bus, +x is ({})",
                shown(&along),
                shown(&x)
            ));
        }
        let (body, half_extents) = own_box(&arm, base, &mut decided);
        let (boresight, mission) = (Vector3::z(), mission.clone());
        Ok(ArmOnBus { arm, options, is_own: true, body, half_extents, boresight, mission, decided })
    };
    boresights.into_iter().map(looking).collect()
}

/// The body of the URDF's own bus, and the box about its centre of mass that holds it.
fn own_box(arm: &Arm, otherwise: &Base, decided: &mut Vec<String>) -> (Body, Vector3<f64>) {
    let Base { link, body, bounds } = arm.base.as_ref().unwrap_or(otherwise);
    if let Some(bounds) = bounds {
        let (lower, upper) = (bounds.lower, bounds.upper);
        let half = (upper - body.center_of_mass).abs().sup(&(lower - body.center_of_mass).abs());
        return (*body, half);
    }
    let half = uniform_box(body);
    decided.push(format!(
        "link `{link}` has no collision shape that is read: the box of the bus is that of an even body of its inertia, \
         half {} m",
        shown(&half)
    ));
    (*body, half)
}

fn on_given_bus(
    request: &Request,
    options: &Options,
    given: &BusProperties,
    boresight: Option<Vector3<f64>>,
    mission: &MissionFile,
) -> Result<Vec<ArmOnBus>, NoImport> {
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
    given: &BusProperties,
    boresight: Vector3<f64>,
    mission: MissionFile,
) -> ArmOnBus {
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
    let dropped = of_another_arm(&mission);
    if !dropped.is_empty() {
        decided.push(format!(
            "of the bus's mission is left out what is of another arm: {}",
            dropped.join(", ")
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
    ArmOnBus { arm, options, is_own: false, body, half_extents, boresight, mission, decided }
}

impl BusProperties {
    /// The bus of a mission that must be valid, whatever its arm.
    fn of(file: &MissionFile) -> Result<Self, FieldError> {
        let s = file.mission()?.servicer;
        Ok(Self {
            mass: s.bus_mass_kg,
            inertia: s.bus_inertia_kg_m2,
            half_extents: s.bus_half_extents_m,
            boresight: s.boresight,
        })
    }
}

/// Half edge lengths of the even box, along the body's axes, that has its moments of inertia [m].
fn uniform_box(body: &Body) -> Vector3<f64> {
    let moments = body.inertia.diagonal();
    let half = |i: usize| (1.5 * (moments.sum() - 2.0 * moments[i]) / body.mass).max(0.0).sqrt();
    Vector3::new(half(0), half(1), half(2))
}

/// The rotation that makes a unit vector +z; exact for the axes.
fn turn_to_z(along: &Vector3<f64>) -> Matrix3<f64> {
    let axis = along.iamax();
    let mut x = Vector3::zeros();
    x[(axis + 1) % 3] = 1.0;
    let x = (x - along * x.dot(along)).normalize();
    let y = along.cross(&x);
    Matrix3::from_rows(&[x.transpose(), y.transpose(), along.transpose()])
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

/// Entries of a mission that belong to its own arm, which an import leaves out.
fn of_another_arm(mission: &MissionFile) -> Vec<&'static str> {
    let approach = &mission.approach;
    let is_given = |radius: Radius| matches!(radius, Radius::Metres(_));
    let said = [
        (mission.typical.is_some(), "[typical]"),
        (mission.roll.is_some(), "[roll]"),
        (is_given(approach.keep_out_far_m), "keep_out_far_m"),
        (is_given(approach.keep_out_near_m), "keep_out_near_m"),
    ];
    said.into_iter().filter(|(is_said, _)| *is_said).map(|(_, what)| what).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_direction_becomes_z() {
        assert_eq!(turn_to_z(&Vector3::z()), Matrix3::identity());
        for along in axes(&Vector3::new(3.0, -2.0, 1.0)) {
            assert_eq!(turn_to_z(&along) * along, Vector3::z());
        }
        let turn = turn_to_z(&Vector3::new(0.6, 0.0, -0.8));
        assert!((turn * turn.transpose() - Matrix3::identity()).norm() < 1e-15);
        assert!((turn.determinant() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_axis_that_leads_there_comes_first() {
        let nearest = |x, y, z| axes(&Vector3::new(x, y, z))[0];
        assert_eq!(nearest(0.1, -3.0, 2.0), -Vector3::y());
        assert_eq!(nearest(0.0, 0.0, 0.0), Vector3::z());
        assert_eq!(axes(&Vector3::new(1.0, 2.0, 3.0)).len(), 3);
    }

    #[test]
    fn a_box_has_its_own_moments() {
        let (mass, half) = (60.0, Vector3::new(0.5, 0.4, 0.3));
        let square = half.component_mul(&half);
        let moments = square.map(|own| mass * (square.sum() - own) / 3.0);
        let inertia = Matrix3::from_diagonal(&moments);
        let body = Body { mass, center_of_mass: Vector3::zeros(), inertia };
        assert!((uniform_box(&body) - half).norm() < 1e-12);
    }
}
