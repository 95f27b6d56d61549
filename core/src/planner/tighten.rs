//! Changes of the formulation after the verifier found a violation between nodes, or after Stage 2 could
//! not follow Stage 1.

use crate::model::Integrator;
use crate::stages::{Formulation, NODES, Residuals, TranslationTrajectory};
use nalgebra::Vector3;
use remora_qp::dense::{clamp, divisor};

/// Widening of a margin, over the violation.
const FACTOR: f64 = 1.5;

/// Error of the dynamics, over its tolerance, up to which more substeps help.
const COARSE: f64 = 30.0;

/// Widest margins, of the joint rate limit and of the field of view.
const WIDEST: f64 = 0.8;

/// The formulation with wider margins, or more substeps, for the violations in `found`. `None` where
/// nothing is violated, or something that no margin covers.
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
    let half_angle = approach.field_of_view_half_angle_rad;
    let mut passed = false;
    for (name, value, tolerance) in found.against(tolerances) {
        // NaN is handled below.
        if value <= tolerance {
            continue;
        }
        let more = FACTOR * value;
        match name {
            _ if !value.is_finite() => return None,
            "joint" if between => margins.joint_angle_rad += more,
            "joint_rate" if between => {
                margins.joint_rate = clamp(margins.joint_rate + more, 0.0, WIDEST);
            }
            "keep_out" if between => margins.keep_out_m += more,
            "pointing" if between => {
                let angle = margins.field_of_view_rad + more / libm::sin(half_angle).max(more);
                margins.field_of_view_rad = clamp(angle, 0.0, WIDEST * half_angle);
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

/// Largest force of the next trial of Stage 1, over that of the trial that Stage 2 could not follow.
const GENTLER: f64 = 0.75;

/// Least force limit of a gentler translation, over the least force that the scenario needs.
const SPARE: f64 = 1.2;

/// The formulation with less force in Stage 1, whose moment about the centre of mass was too large for
/// the torques. `None` where less than the needed force `least` [N] would be left.
pub(super) fn gentler<'a, const NL: usize>(
    formulation: &Formulation<'a, NL>,
    translation: &TranslationTrajectory<NODES>,
    least: f64,
) -> Option<Formulation<'a, NL>> {
    let max_force = (GENTLER * largest_force(translation)).min(formulation.max_force);
    (max_force >= SPARE * least).then_some(Formulation { max_force, ..*formulation })
}

/// The formulation with a line of sight that the bus can follow in Stage 1. The bus turns from rest: while it
/// speeds up, the target must stay in the field of view. `None` where the path already satisfies this, or
/// an earlier trial did.
pub(super) fn slower<'a, const NL: usize>(
    formulation: &Formulation<'a, NL>,
    translation: &TranslationTrajectory<NODES>,
) -> Option<Formulation<'a, NL>> {
    let Formulation { mission, scenario, sight_rate, .. } = *formulation;
    let servicer = &mission.servicer;
    let inertia = servicer.system_inertia(&mission.joint_angle_at_start(scenario)).diagonal().max();
    let acceleration = servicer.bus_torque_limit_n_m.min() / divisor(inertia);
    let rate = libm::sqrt(2.0 * acceleration * mission.approach.field_of_view_half_angle_rad);
    (sight_rate > rate && fastest_sight(translation) > rate)
        .then_some(Formulation { sight_rate: rate, ..*formulation })
}

/// Largest rate of the line of sight to the target's centre [rad/s].
fn fastest_sight(translation: &TranslationTrajectory<NODES>) -> f64 {
    let states = translation.position.iter().zip(&translation.velocity);
    let rate = |(r, v): (&Vector3<f64>, &Vector3<f64>)| {
        let momentum = r.cross(v);
        libm::sqrt(momentum.dot(&momentum)) / divisor(r.dot(r))
    };
    states.map(rate).fold(0.0, f64::max)
}

/// Limit on each component of Stage 1's force [N] with which the wheels can hold its moment about the
/// centre of mass, but at least the needed force `least`; and the largest component of the force. `None`
/// where the force already satisfies the limit.
pub(super) fn force_limit_of_wheels<const NL: usize>(
    formulation: &Formulation<'_, NL>,
    translation: &TranslationTrajectory<NODES>,
    least: f64,
) -> Option<[f64; 2]> {
    let (mission, scenario) = (formulation.mission, formulation.scenario);
    let servicer = &mission.servicer;
    let lever = [&mission.joint_angle_at_start(scenario), &servicer.capture_joint_angle_rad]
        .map(|angles| servicer.center_of_mass_and_end_effector(angles).0)
        .iter()
        .map(|center| libm::sqrt(center.dot(center)))
        .fold(0.0, f64::max);
    // The moment may be about any of the bus's axes.
    let weakest = servicer.bus_torque_limit_n_m.min();
    let moment = translation.force.iter().map(|force| lever * libm::sqrt(force.dot(force)));
    if !(moment.fold(0.0, f64::max) > weakest) {
        return None;
    }
    let (largest, force) = (largest_force(translation), weakest / divisor(lever));
    let force = force.max(SPARE * least);
    (force < largest).then_some([force, largest])
}

/// Largest component of the force [N].
fn largest_force(translation: &TranslationTrajectory<NODES>) -> f64 {
    translation.force.iter().map(|force| force.amax()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Margins, Mission, Scenario};

    fn wider(change: fn(&mut Residuals), integrator: Integrator) -> Option<Margins> {
        let (mission, scenario) = (Mission::default(), Scenario::default());
        let mut found = Residuals::default();
        change(&mut found);
        tightened(&Formulation::new(&mission, &scenario, integrator), &found)
            .map(|wider| Margins { clearance_m: 0.03 + wider.extra_clearance, ..wider.margins })
    }

    #[test]
    fn only_what_is_passed_between_nodes_widens_a_margin() {
        let (rk4, euler) = (Integrator::Rk4 { substeps: 4 }, Integrator::Euler);
        let margins = Margins::default();
        assert_eq!(wider(|_| (), rk4), None);
        let rate = wider(|r| r.joint_rate = 0.02, rk4).unwrap();
        assert_eq!(rate, Margins { joint_rate: margins.joint_rate + 1.5 * 0.02, ..margins });
        let body = wider(|r| r.clearance = 0.01, rk4).unwrap();
        assert_eq!(body, Margins { clearance_m: margins.clearance_m + 0.015, ..margins });
        assert_eq!(wider(|r| r.joint_rate = 0.02, euler), None);
        assert_eq!(wider(|r| r.dynamics2 = 1.0, rk4), None);
        assert_eq!(wider(|r| (r.joint, r.dynamics2) = (0.1, 1.0), rk4), None);
        assert_eq!(wider(|r| r.joint = f64::NAN, rk4), None);
        assert!(wider(|r| r.pointing = 2.0, rk4).unwrap().field_of_view_rad < 0.35);
    }

    #[test]
    fn a_gentler_path_keeps_the_force_it_needs() {
        let (mission, scenario) = (Mission::default(), Scenario::default());
        let rk4 = Integrator::Rk4 { substeps: 4 };
        let formulation = Formulation::new(&mission, &scenario, rk4);
        let mut translation = TranslationTrajectory::<NODES>::ZERO;
        translation.force[3].y = -0.2;
        let gentle = gentler(&formulation, &translation, 0.1).unwrap();
        assert_eq!(gentle.max_force, 0.75 * 0.2);
        assert!(gentler(&gentle, &translation, 0.13).is_none());
    }

    #[test]
    fn the_line_of_sight_turns_as_fast_as_the_bus_can_follow() {
        let (mission, scenario) = (Mission::default(), Scenario::default());
        let formulation = Formulation::new(&mission, &scenario, Integrator::RK4);
        let mut translation = TranslationTrajectory::<NODES>::ZERO;
        translation.position[3] = Vector3::new(2.0, 0.0, 0.0);
        translation.velocity[3] = Vector3::new(-1.0, 0.006, 0.0);
        assert!(slower(&formulation, &translation).is_none());
        translation.velocity[3].y = 0.02;
        let slow = slower(&formulation, &translation).unwrap();
        // From rest to this rate, the bus falls behind by the field of view's half angle.
        let servicer = &mission.servicer;
        let inertia = servicer.system_inertia(&servicer.initial_joint_angle_rad).diagonal().max();
        let seconds = slow.sight_rate * inertia / servicer.bus_torque_limit_n_m.x;
        let behind = 0.5 * slow.sight_rate * seconds;
        assert!((behind / mission.approach.field_of_view_half_angle_rad - 1.0).abs() < 1e-12);
        assert!(slower(&slow, &translation).is_none());
    }

    #[test]
    fn a_path_is_held_by_the_wheels_where_it_can_be() {
        let (mission, scenario) = (Mission::default(), Scenario::default());
        let rk4 = Integrator::Rk4 { substeps: 4 };
        let formulation = Formulation::new(&mission, &scenario, rk4);
        let mut translation = TranslationTrajectory::<NODES>::ZERO;
        translation.force[3].y = -0.02;
        assert!(force_limit_of_wheels(&formulation, &translation, 0.01).is_none());
        translation.force[3].y = -0.5;
        let [force, largest] = force_limit_of_wheels(&formulation, &translation, 0.01).unwrap();
        let center = |q| mission.servicer.center_of_mass_and_end_effector(q).0.norm();
        let servicer = &mission.servicer;
        let lever = center(&servicer.initial_joint_angle_rad)
            .max(center(&servicer.capture_joint_angle_rad));
        assert!((force * lever / servicer.bus_torque_limit_n_m.x - 1.0).abs() < 1e-12);
        assert_eq!(
            force_limit_of_wheels(&formulation, &translation, 0.4),
            Some([1.2 * 0.4, largest])
        );
        assert!(force_limit_of_wheels(&formulation, &translation, 3.0).is_none());
    }
}
