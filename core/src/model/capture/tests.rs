extern crate std;

mod arms;

use self::arms::{Draw, chain, link, servicer, seven, six};
use super::constraints::{Constraints, Limit, Take};
use super::*;
use crate::model::{Link, Mission};
use nalgebra::{Matrix3, Rotation3, Unit};
use proptest::prelude::*;
use std::vec::Vec;

const SEARCH: CaptureSearch = CaptureSearch {
    axis: Vector3::new(0.0, 0.0, 1.0),
    max_off_boresight: 0.35,
    clearance: 0.03,
    stop_margin: 0.02,
};

/// The largest violation, by rotation matrices and points along each link, apart from the code.
fn independent<const NL: usize>(
    servicer: &Servicer<NL>,
    search: &CaptureSearch,
    angles: &SVector<f64, NL>,
) -> [f64; 5] {
    let mut turn = Matrix3::identity();
    let (mut joint, mut moment, mut mass) =
        (servicer.arm_base_m, Vector3::zeros(), servicer.bus_mass_kg);
    let mut ends = Vec::new();
    for (i, link) in servicer.links.iter().enumerate() {
        let axis = Unit::new_normalize(link.axis);
        turn *= Rotation3::from_axis_angle(&axis, angles[i]).into_inner();
        moment += (joint + turn * link.center_of_mass_m) * link.mass_kg;
        mass += link.mass_kg;
        ends.push((joint, joint + turn * link.tip_m, link.radius_m));
        joint += turn * link.tip_m;
    }
    let toward = (joint - moment / mass).normalize();
    let is_long = |(start, end, _): &(Vector3<f64>, Vector3<f64>, f64)| start != end;
    let first = ends.iter().position(is_long).unwrap();
    let last = ends.iter().rposition(is_long).unwrap();
    let half = servicer.bus_half_extents_m;
    let (mut bus, mut port) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    for (i, (start, end, radius)) in ends.iter().enumerate() {
        let room = radius + search.clearance;
        for k in 0..=400 {
            let point = start + (end - start) * (k as f64 / 400.0);
            if i > first && is_long(&ends[i]) {
                let out = (point.abs() - half).map(|d| d.max(0.0));
                bus = bus.max(room - out.norm());
            }
            if i < last {
                port = port.max((point - joint).dot(&toward) + room);
            }
        }
    }
    for k in 0..8 {
        let sign = |bit: usize| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
        let corner = Vector3::new(sign(0) * half.x, sign(1) * half.y, sign(2) * half.z);
        port = port.max((corner - joint).dot(&toward) + search.clearance);
    }
    let stop = (0..NL).map(|i| {
        let angle = angles[i] + search.stop_margin;
        (angle - servicer.max_joint_angle_rad[i])
            .max(servicer.min_joint_angle_rad[i] + 2.0 * search.stop_margin - angle)
    });
    let axis = 2.0 * (0.5 * (turn * search.axis - toward).norm()).asin();
    let view = servicer.boresight.angle(&toward) - search.max_off_boresight;
    [axis, view, stop.fold(f64::NEG_INFINITY, f64::max), bus, port]
}

/// Found, satisfying all by the independent check, and no worse than the code says.
fn checked<const NL: usize>(
    servicer: &Servicer<NL>,
    search: &CaptureSearch,
) -> Result<SVector<f64, NL>, CaptureFailure> {
    let found = servicer.capture_configuration(search, &servicer.initial_joint_angle_rad)?;
    let [axis, others @ ..] = independent(servicer, search, &found);
    assert!(axis < CAPTURE_ALIGNMENT, "{axis:e}");
    assert!(others.iter().all(|beyond| *beyond <= 1e-12), "{others:?}");
    Ok(found)
}

fn time<const NL: usize>(servicer: &Servicer<NL>, angles: &SVector<f64, NL>) -> f64 {
    let way = (angles - servicer.initial_joint_angle_rad).abs();
    way.component_div(&servicer.joint_rate_limit_rad_s).max()
}

/// Inequalities as they are taken: name, number and gradient.
struct Rows<const NL: usize>(Vec<(Limit, f64, SVector<f64, NL>)>);

impl<const NL: usize> Take<NL> for Rows<NL> {
    fn take(&mut self, limit: Limit, beyond: f64, gradient: impl Fn(usize) -> f64) {
        self.0.push((limit, beyond, SVector::from_fn(|j, _| gradient(j))));
    }
}

fn inequalities<const NL: usize>(
    constraints: &Constraints<NL>,
    angles: &SVector<f64, NL>,
) -> Vec<(Limit, f64, SVector<f64, NL>)> {
    let mut rows = Rows(Vec::new());
    constraints.inequalities(&constraints.pose(angles), &mut rows);
    rows.0
}

#[test]
fn the_default_arm_finds_one_near_its_start() {
    let mut mission = Mission::default();
    let found = checked(&mission.servicer, &SEARCH).unwrap();
    // The mission's own takes three minutes.
    assert!(time(&mission.servicer, &found) < 45.0, "{found}");
    mission.servicer.capture_joint_angle_rad = found;
    remora_qp::Validate::validate(&mission).unwrap();
    let direction = mission.servicer.capture_geometry().direction;
    assert!(direction.angle(&Vector3::z()) < SEARCH.max_off_boresight);
}

/// The mission's arm has its last link along the boresight, and its centre of mass 1 cm beside it.
#[test]
fn the_missions_own_capture_satisfies_all_but_the_last_half_degree() {
    let servicer = Servicer::default();
    let violation = servicer.capture_violation(&SEARCH, &servicer.capture_joint_angle_rad);
    assert!((violation.axis - 6.6266e-3).abs() < 1e-7, "{violation:?}");
    assert_eq!(violation.worst(0.01), None);
    let failure = violation.worst(CAPTURE_ALIGNMENT).unwrap();
    assert_eq!(failure.constraint, "the end effector's axis");
    let own = independent(&servicer, &SEARCH, &servicer.capture_joint_angle_rad);
    let CaptureViolation { axis, view, stop, bus, port } = violation;
    for (ours, theirs) in [axis, view, stop, bus, port].into_iter().zip(own) {
        assert!((ours - theirs).abs() < 1e-9, "{violation:?} {own:?}");
    }
}

/// Arms of robots, from anywhere, to rounding.
#[test]
fn arms_with_wrists_find_one_from_anywhere() {
    let mut draw = Draw(7);
    let (mut seven, mut six) = (seven(), six());
    for _ in 0..40 {
        seven.initial_joint_angle_rad = SVector::from_fn(|_, _| draw.between(-3.0, 3.0));
        six.initial_joint_angle_rad = SVector::from_fn(|_, _| draw.between(-3.0, 3.0));
        let found = checked(&seven, &SEARCH).unwrap();
        assert!(seven.capture_violation(&SEARCH, &found).axis < 1e-12);
        let found = checked(&six, &SEARCH).unwrap();
        assert!(six.capture_violation(&SEARCH, &found).axis < 1e-12);
    }
}

/// Up to 53 degrees off: it stays clear of the plane that the wrist must be behind.
#[test]
fn the_end_effectors_axis_need_not_be_its_links() {
    let mut draw = Draw(8);
    for _ in 0..20 {
        let axis = (Vector3::z() + draw.direction() * 0.8).normalize();
        let search = CaptureSearch { axis, ..SEARCH };
        checked(&seven(), &search).unwrap();
    }
}

#[test]
fn nearly_all_chains_find_one() {
    fn found<const NL: usize>(seed: u64) -> usize {
        let mut draw = Draw(seed);
        (0..100).filter(|_| checked(&chain::<NL>(&mut draw), &SEARCH).is_ok()).count()
    }
    let counts = [found::<4>(4), found::<5>(5), found::<6>(6), found::<7>(7)];
    // For the one of five joints 3000 starts find none either.
    assert_eq!(counts, [100, 99, 100, 100]);
}

/// Joint angles found from other starts satisfy all constraints, too, and are no nearer.
#[test]
fn none_that_is_known_is_nearer() {
    fn compare<const NL: usize>(servicer: &Servicer<NL>, seed: u64) {
        let nearest = time(servicer, &checked(servicer, &SEARCH).unwrap());
        let mut draw = Draw(seed);
        for _ in 0..100 {
            let start = servicer.initial_joint_angle_rad;
            let other = start.map(|angle| angle + draw.between(-0.6, 0.6));
            let other = servicer.capture_configuration(&SEARCH, &other).unwrap();
            assert!(time(servicer, &other) > 0.99 * nearest, "{nearest} {other}");
        }
    }
    compare(&Servicer::default(), 1);
    compare(&six(), 2);
    compare(&seven(), 3);
}

#[test]
fn an_arm_that_is_there_stays() {
    let mut servicer = seven();
    servicer.initial_joint_angle_rad = checked(&servicer, &SEARCH).unwrap();
    let again = checked(&servicer, &SEARCH).unwrap();
    assert!((again - servicer.initial_joint_angle_rad).amax() < 1e-8, "{again}");
}

#[test]
fn the_same_search_has_the_same_bits() {
    let bits = |angles: SVector<f64, 6>| angles.map(f64::to_bits);
    let near = six().initial_joint_angle_rad;
    let first = six().capture_configuration(&SEARCH, &near).unwrap();
    assert_eq!(bits(first), bits(six().capture_configuration(&SEARCH, &near).unwrap()));
}

fn refused<const NL: usize>(servicer: &Servicer<NL>, search: &CaptureSearch) -> CaptureFailure {
    servicer.capture_configuration(search, &servicer.initial_joint_angle_rad).unwrap_err()
}

#[test]
fn what_cannot_be_had_is_refused_by_name() {
    let servicer = Servicer::default();
    // A planar arm's end effector whose axis is across its plane.
    let across = CaptureSearch { axis: Vector3::y(), ..SEARCH };
    let failure = refused(&servicer, &across);
    assert_eq!(failure.constraint, "the end effector's axis");
    assert!(failure.violation > 0.5, "{failure}");
    // A camera that looks the other way, past an arm that bends by half a turn at the most.
    let behind = Servicer { boresight: Vector3::y(), ..servicer };
    let failure = refused(&behind, &SEARCH);
    assert_eq!(failure.constraint, "the camera's view");
    assert!((failure.violation - 1.2208).abs() < 1e-3, "{failure}");
    // More room than the arm has length, and more margin than stops have between them.
    let failure = refused(&servicer, &CaptureSearch { clearance: 2.0, ..SEARCH });
    assert!(failure.constraint.starts_with("clearance of"), "{failure}");
    let failure = refused(&servicer, &CaptureSearch { stop_margin: 1.6, ..SEARCH });
    assert_eq!(failure.constraint, "the joints' stops");
    assert!((failure.violation - (1.6 - 0.5 * core::f64::consts::PI)).abs() < 1e-12);
}

#[test]
fn arms_of_two_one_and_no_joints_are_answered() {
    let y = |length: f64| link(Vector3::y(), Vector3::z() * length, 10.0);
    checked(&servicer(0.5, [y(0.8), y(0.6)]), &SEARCH).unwrap();
    // A link that leans at the root of a straight one: its one joint cannot make up for it.
    let bent = Link { tip_m: Vector3::new(0.3, 0.0, 0.5), ..y(0.6) };
    assert_eq!(refused(&servicer(0.5, [bent]), &SEARCH).constraint, "the end effector's axis");
    let failure = refused(&servicer(0.5, []), &SEARCH);
    assert_eq!(failure.constraint, "clearance of the port's plane");
}

#[test]
fn numbers_that_are_none_end_in_an_answer() {
    let mut servicer = seven();
    let search = CaptureSearch { max_off_boresight: f64::NAN, ..SEARCH };
    assert_eq!(refused(&servicer, &search).constraint, "the camera's view");
    let nan = SVector::repeat(f64::NAN);
    assert!(servicer.capture_violation(&SEARCH, &nan).worst(1.0).is_some());
    let _ = servicer.capture_configuration(&SEARCH, &nan);
    servicer.max_joint_angle_rad[3] = f64::NAN;
    assert_eq!(refused(&servicer, &SEARCH).constraint, "the joints' stops");
    servicer = seven();
    servicer.links[2].tip_m.x = f64::NAN;
    assert!(refused(&servicer, &SEARCH).violation.is_nan());
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_returned_satisfies_all(
        seed in any::<u64>(),
        max_off_boresight in 0.01..1.0f64,
        clearance in 0.0..0.2f64,
        stop_margin in 0.0..0.5f64,
    ) {
        let mut draw = Draw(seed);
        let axis = (Vector3::z() + draw.direction() * 0.8).normalize();
        let search = CaptureSearch { axis, max_off_boresight, clearance, stop_margin };
        // Those that have none say what they miss.
        let missed = [
            checked(&chain::<4>(&mut draw), &search).err(),
            checked(&chain::<5>(&mut draw), &search).err(),
            checked(&chain::<6>(&mut draw), &search).err(),
            checked(&chain::<7>(&mut draw), &search).err(),
        ];
        for failure in missed.into_iter().flatten() {
            prop_assert!(failure.violation > 0.0, "{failure}");
        }
    }

    #[test]
    fn derivatives_are_those_of_differences(seed in any::<u64>()) {
        let mut draw = Draw(seed);
        let servicer = chain::<5>(&mut draw);
        let search = CaptureSearch { axis: draw.direction(), ..SEARCH };
        let constraints = Constraints::new(&servicer, &search);
        let angles = SVector::from_fn(|_, _| draw.between(-3.0, 3.0));
        let (pose, rows) = (constraints.pose(&angles), inequalities(&constraints, &angles));
        let h = 1e-6;
        for j in 0..5 {
            let (mut up, mut down) = (angles, angles);
            (up[j], down[j]) = (up[j] + h, down[j] - h);
            let (ahead, behind) = (constraints.pose(&up), constraints.pose(&down));
            let slope = |a: Vector3<f64>, b: Vector3<f64>| (a - b) / (2.0 * h);
            for (exact, apart) in [
                (pose.tip.by_joint[j], slope(ahead.tip.value, behind.tip.value)),
                (pose.tool.by_joint[j], slope(ahead.tool.value, behind.tool.value)),
                (pose.direction.by_joint[j], slope(ahead.direction.value, behind.direction.value)),
            ] {
                prop_assert!((exact - apart).norm() < 1e-7, "{exact} {apart}");
            }
            let (ahead, behind) =
                (inequalities(&constraints, &up), inequalities(&constraints, &down));
            for ((limit, value, gradient), (plus, minus)) in
                rows.iter().zip(ahead.iter().zip(&behind))
            {
                let (rise, fall) = ((plus.1 - value) / h, (value - minus.1) / h);
                // Kinks apart: another corner or another side of the box is nearer.
                if (rise - fall).abs() < 1e-3 {
                    let apart = 0.5 * (rise + fall);
                    prop_assert!((gradient[j] - apart).abs() < 1e-3, "{limit:?} {gradient} {apart}");
                }
            }
        }
    }
}
