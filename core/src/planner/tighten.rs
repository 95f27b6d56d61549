//! What planning changes about its problem where the verifier finds a limit passed between nodes,
//! or Stage 2 cannot follow Stage 1.

use crate::model::Integrator;
use crate::stages::{Formulation, NODES, Residuals, TranslationTrajectory};
use remora_qp::dense::clamp;

/// How much wider a margin becomes, over what the limit was passed by.
const FACTOR: f64 = 1.5;

/// Error of the dynamics, over its tolerance, up to which the planner's steps are too long rather
/// than the plan no solution.
const COARSE: f64 = 30.0;

/// Widest margins, of the joint rate limit and of the field of view.
const WIDEST: f64 = 0.8;

/// The formulation with margins, and steps of the integrator, with which the limits that `found` says are passed would have been
/// kept, all else being equal. `None` where nothing is passed, or something is that no margin is
/// about.
pub(super) fn tightened<'a, const NL: usize>(
    formulation: &Formulation<'a, NL>,
    found: &Residuals,
) -> Option<Formulation<'a, NL>> {
    let (mission, integrator) = (formulation.mission, formulation.integrator);
    let approach = &mission.approach;
    let between = approach.between_nodes.is_on(integrator);
    let clear = approach.clearance.is_on(integrator);
    let tolerances = &mission.tolerances;
    let mut wider = *formulation;
    let margins = &mut wider.margins;
    let half_angle = approach.field_of_view_half_angle;
    let mut passed = false;
    for (name, value, tolerance) in found.against(tolerances) {
        // What is not a number stands for nothing.
        if value <= tolerance {
            continue;
        }
        let more = FACTOR * value;
        match name {
            _ if !value.is_finite() => return None,
            "joint" if between => margins.joint_angle += more,
            "joint_rate" if between => {
                margins.joint_rate = clamp(margins.joint_rate + more, 0.0, WIDEST);
            }
            "keep_out" if between => margins.keep_out += more,
            "pointing" if between => {
                let angle = margins.field_of_view + more / libm::sin(half_angle).max(more);
                margins.field_of_view = clamp(angle, 0.0, WIDEST * half_angle);
            }
            "clearance" if clear => wider.extra_clearance += more,
            "dynamics2" if value <= COARSE * tolerance => match &mut wider.integrator {
                Integrator::Rk4 { substeps } => *substeps *= 2,
                Integrator::Euler => return None,
            },
            _ => return None,
        }
        passed = true;
    }
    passed.then_some(wider)
}

/// Largest force of a path with which Stage 2 may do better, over the largest that it could not
/// follow.
const GENTLER: f64 = 0.75;

/// Force that a gentler path keeps over the least that could reach its end.
const SPARE: f64 = 1.2;

/// The formulation with a gentler Stage 1, where torques were too weak for the moment of its force:
/// it acts beside the centre of mass. `None` where that would leave too little force, of which
/// `least` is needed.
pub(super) fn gentler<'a, const NL: usize>(
    formulation: &Formulation<'a, NL>,
    path: &TranslationTrajectory<NODES>,
    least: f64,
) -> Option<Formulation<'a, NL>> {
    let max_force = (GENTLER * largest_force(path)).min(formulation.max_force);
    (max_force >= SPARE * least).then_some(Formulation { max_force, ..*formulation })
}

/// Limit of each component of Stage 1's force [N] with which the wheels can hold its moment about
/// the centre of mass, as far as that leaves the force it needs, of which `least` is needed; and the
/// largest component of `path`, which is more. `None` where `path` is such already.
pub(super) fn held<const NL: usize>(
    formulation: &Formulation<'_, NL>,
    path: &TranslationTrajectory<NODES>,
    least: f64,
) -> Option<[f64; 2]> {
    let servicer = &formulation.mission.servicer;
    let lever = [&servicer.initial_joint_angle, &servicer.capture_joint_angle]
        .map(|angles| servicer.center_of_mass_and_end_effector(angles).0)
        .iter()
        .map(|center| libm::sqrt(center.dot(center)))
        .fold(0.0, f64::max);
    let moment = path.force.iter().map(|force| lever * libm::sqrt(force.dot(force)));
    if !(moment.fold(0.0, f64::max) > servicer.max_bus_torque) {
        return None;
    }
    let (largest, force) = (largest_force(path), servicer.max_bus_torque / lever);
    let force = force.max(SPARE * least);
    (force < largest).then_some([force, largest])
}

/// Largest component of the force along a path [N].
fn largest_force(path: &TranslationTrajectory<NODES>) -> f64 {
    path.force.iter().map(|force| force.amax()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Margins, Mission};

    fn wider(change: fn(&mut Residuals), integrator: Integrator) -> Option<Margins> {
        let mission = Mission::default();
        let mut found = Residuals::default();
        change(&mut found);
        tightened(&Formulation::new(&mission, integrator), &found)
            .map(|wider| Margins { clearance: 0.03 + wider.extra_clearance, ..wider.margins })
    }

    #[test]
    fn only_what_is_passed_between_nodes_widens_a_margin() {
        let (rk4, euler) = (Integrator::Rk4 { substeps: 4 }, Integrator::Euler);
        let margins = Margins::default();
        assert_eq!(wider(|_| (), rk4), None);
        let rate = wider(|r| r.joint_rate = 0.02, rk4).unwrap();
        assert_eq!(rate, Margins { joint_rate: margins.joint_rate + 1.5 * 0.02, ..margins });
        let body = wider(|r| r.clearance = 0.01, rk4).unwrap();
        assert_eq!(body, Margins { clearance: margins.clearance + 0.015, ..margins });
        assert_eq!(wider(|r| r.joint_rate = 0.02, euler), None);
        assert_eq!(wider(|r| r.dynamics2 = 1.0, rk4), None);
        assert_eq!(wider(|r| (r.joint, r.dynamics2) = (0.1, 1.0), rk4), None);
        assert_eq!(wider(|r| r.joint = f64::NAN, rk4), None);
        assert!(wider(|r| r.pointing = 2.0, rk4).unwrap().field_of_view < 0.35);
    }

    #[test]
    fn a_gentler_path_keeps_the_force_it_needs() {
        let mission = Mission::default();
        let formulation = Formulation::new(&mission, Integrator::Rk4 { substeps: 4 });
        let mut path = TranslationTrajectory::<NODES>::ZERO;
        path.force[3].y = -0.2;
        let gentle = gentler(&formulation, &path, 0.1).unwrap();
        assert_eq!(gentle.max_force, 0.75 * 0.2);
        assert!(gentler(&gentle, &path, 0.13).is_none());
    }

    #[test]
    fn a_path_is_held_by_the_wheels_where_it_can_be() {
        let mission = Mission::default();
        let formulation = Formulation::new(&mission, Integrator::Rk4 { substeps: 4 });
        let mut path = TranslationTrajectory::<NODES>::ZERO;
        path.force[3].y = -0.02;
        assert!(held(&formulation, &path, 0.01).is_none());
        path.force[3].y = -0.5;
        let [force, largest] = held(&formulation, &path, 0.01).unwrap();
        let center = |q| mission.servicer.center_of_mass_and_end_effector(q).0.norm();
        let servicer = &mission.servicer;
        let lever =
            center(&servicer.initial_joint_angle).max(center(&servicer.capture_joint_angle));
        assert!((force * lever / servicer.max_bus_torque - 1.0).abs() < 1e-12);
        assert_eq!(held(&formulation, &path, 0.4), Some([1.2 * 0.4, largest]));
        assert!(held(&formulation, &path, 3.0).is_none());
    }
}
