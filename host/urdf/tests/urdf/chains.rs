//! Chains that are drawn, against the tree evaluated directly, link by link.

use crate::scene::{Rigid, Scene, of_arm, turn};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use remora_urdf::{Arm, Options, import};
use std::fmt::Write;

/// A joint and its child.
#[derive(Clone, Debug)]
struct Part {
    is_fixed: bool,
    /// Whether the next part is fixed to the same parent as this one: a leaf beside the chain.
    is_side: bool,
    origin: ([f64; 3], [f64; 3]),
    axis: [f64; 3],
    angle: f64,
    mass: f64,
    /// Where the principal axes are, and half the sums of the moments.
    inertial: ([f64; 3], [f64; 3]),
    thirds: [f64; 3],
}

fn triple(range: std::ops::Range<f64>) -> impl Strategy<Value = [f64; 3]> {
    [range.clone(), range.clone(), range]
}

fn part() -> impl Strategy<Value = Part> {
    let pose = || (triple(-1.0..1.0), triple(-3.2..3.2));
    let axis = triple(-1.0..1.0).prop_filter("short", |a| Vector3::from(*a).norm() > 0.1);
    let inertial = (0.1..20.0, pose(), triple(0.01..2.0));
    (0..3, prop::bool::ANY, pose(), axis, -3.0..3.0, inertial).prop_map(
        |(kind, is_side, origin, axis, angle, (mass, inertial, thirds))| Part {
            is_fixed: kind == 0,
            is_side: is_side && kind == 0,
            origin,
            axis,
            angle,
            mass,
            inertial,
            thirds,
        },
    )
}

/// Chains of which one to seven joints move, the last of them not fixed beside.
fn chain() -> impl Strategy<Value = Vec<Part>> {
    prop::collection::vec(part(), 2..10).prop_filter("joints", |parts| {
        let moving = parts.iter().filter(|part| !part.is_fixed).count();
        (1..=7).contains(&moving) && parts.last().is_some_and(|part| !part.is_side)
    })
}

/// Roll, pitch, yaw by their definition.
fn rotation(rpy: [f64; 3]) -> Matrix3<f64> {
    let [roll, pitch, yaw] = rpy;
    turn(&Vector3::z(), yaw) * turn(&Vector3::y(), pitch) * turn(&Vector3::x(), roll)
}

fn moments(part: &Part) -> Vector3<f64> {
    let [a, b, c] = part.thirds;
    Vector3::new(b + c, a + c, a + b)
}

/// The links' names: the root is `l0`.
fn parents(parts: &[Part]) -> Vec<usize> {
    let mut last = 0;
    let mut parents = Vec::new();
    for (i, part) in parts.iter().enumerate() {
        parents.push(last);
        if !part.is_side {
            last = i + 1;
        }
    }
    parents
}

fn inertial(part: &Part) -> String {
    let (xyz, rpy) = part.inertial;
    let m = moments(part);
    format!(
        "<inertial><origin xyz='{}' rpy='{}'/><mass value='{:?}'/><inertia ixx='{:?}' ixy='0' ixz='0' \
         iyy='{:?}' iyz='0' izz='{:?}'/></inertial>",
        words(xyz),
        words(rpy),
        part.mass,
        m.x,
        m.y,
        m.z
    )
}

fn words(v: [f64; 3]) -> String {
    v.map(|x| format!("{x:?}")).join(" ")
}

/// The chain's URDF; the root's inertial is that of the first part.
fn urdf(parts: &[Part]) -> String {
    let mut text = format!("<robot name='drawn'><link name='l0'>{}</link>", inertial(&parts[0]));
    for (i, (part, parent)) in parts.iter().zip(parents(parts)).enumerate() {
        let kind = if part.is_fixed { "fixed" } else { "revolute" };
        let (xyz, rpy) = part.origin;
        write!(
            text,
            "<link name='l{child}'>{}</link><joint name='j{child}' type='{kind}'><origin xyz='{}' rpy='{}'/>\
             <parent link='l{parent}'/><child link='l{child}'/><axis xyz='{}'/>\
             <limit lower='-3' upper='3' velocity='1' effort='1'/></joint>",
            inertial(part), words(xyz), words(rpy), words(part.axis), child = i + 1
        )
        .unwrap();
    }
    text + "</robot>"
}

/// The tree by the definition of URDF, without merging anything.
fn direct(parts: &[Part]) -> Scene {
    let rigid = |part: &Part, joints, (at, axes): (Vector3<f64>, Matrix3<f64>)| {
        let (xyz, rpy) = part.inertial;
        let own = axes * rotation(rpy);
        Rigid {
            joints,
            mass: part.mass,
            center_of_mass: at + axes * Vector3::from(xyz),
            inertia: own * Matrix3::from_diagonal(&moments(part)) * own.transpose(),
        }
    };
    let root = (Vector3::zeros(), Matrix3::identity());
    let mut frames = vec![(root, 0)];
    let mut scene =
        Scene { joints: Vec::new(), bodies: vec![rigid(&parts[0], 0, root)], end_effector: root };
    for (part, parent) in parts.iter().zip(parents(parts)) {
        let ((at, axes), mut joints) = frames[parent];
        let (xyz, rpy) = part.origin;
        let at = at + axes * Vector3::from(xyz);
        let mut axes = axes * rotation(rpy);
        if !part.is_fixed {
            let axis = Vector3::from(part.axis).normalize();
            scene.joints.push((at, axes * axis));
            axes *= turn(&axis, part.angle);
            joints += 1;
        }
        frames.push(((at, axes), joints));
        scene.bodies.push(rigid(part, joints, (at, axes)));
    }
    scene.end_effector = frames[parts.len()].0;
    scene
}

fn read(parts: &[Part]) -> Arm {
    let end_effector = Some(format!("l{}", parts.len()));
    let options = Options { end_effector, ..Options::default() };
    import("drawn", urdf(parts).as_bytes(), &options).unwrap_or_else(|error| panic!("{error}"))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn parallel_frames_and_merged_bodies_are_the_tree(parts in chain()) {
        let angles: Vec<f64> = parts.iter().filter(|p| !p.is_fixed).map(|p| p.angle).collect();
        let (found, expected) = (of_arm(&read(&parts), &angles), direct(&parts));
        let (position, axes) = found.end_effector;
        prop_assert!((position - expected.end_effector.0).norm() < 1e-12);
        prop_assert!((axes - expected.end_effector.1).amax() < 1e-12);
        prop_assert!((found.mass() - expected.mass()).abs() < 1e-12 * expected.mass());
        prop_assert!((found.center_of_mass() - expected.center_of_mass()).norm() < 1e-12);
        for is_free in [false, true] {
            let matrix = expected.mass_matrix(is_free);
            let difference = (found.mass_matrix(is_free) - matrix).amax();
            prop_assert!(difference < 1e-12 * matrix.amax(), "{difference:e}");
        }
    }

    #[test]
    fn a_mount_moves_everything_with_it(parts in chain(), xyz in triple(-2.0..2.0), rpy in triple(-3.0..3.0)) {
        let mut options = Options { end_effector: Some(format!("l{}", parts.len())), ..Options::default() };
        let values = [xyz, rpy].concat().iter().map(|x| format!("{x:?}")).collect::<Vec<_>>();
        options.set_mount(&values.join(",")).unwrap();
        let mounted = import("drawn", urdf(&parts).as_bytes(), &options).unwrap();
        let angles = vec![0.7; mounted.joints.len()];
        let (found, bare) = (of_arm(&mounted, &angles), of_arm(&read(&parts), &angles));
        let expected = Vector3::from(xyz) + rotation(rpy) * bare.end_effector.0;
        prop_assert!((found.end_effector.0 - expected).norm() < 1e-12);
        let expected = bare.mass_matrix(false);
        prop_assert!((found.mass_matrix(false) - expected).amax() < 1e-12 * expected.amax());
    }
}
