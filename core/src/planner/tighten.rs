//! What planning changes about its problem where the verifier finds a limit passed between nodes,
//! or Stage 2 cannot follow Stage 1.

use crate::math::clamp;
use crate::stages::{Formulation, NODES, Residuals, TranslationTrajectory};

/// How much wider a margin becomes, over what the limit was passed by.
const FACTOR: f64 = 1.5;

/// Widest margins, of the joint rate limit and of the field of view.
const WIDEST: f64 = 0.8;

/// The formulation with margins with which the limits that `found` says are passed would have been
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
    let largest = path.force.iter().map(|force| force.amax()).fold(0.0, f64::max);
    let max_force = (GENTLER * largest).min(formulation.max_force);
    (max_force >= SPARE * least).then_some(Formulation { max_force, ..*formulation })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Integrator, Margins, Mission};

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
}
