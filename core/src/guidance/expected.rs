//! Estimate of navigation if everything goes as guidance expects.

use super::{Estimate, FlightPlan, Guidance};
use crate::model::Mission;
use remora_qp::Valid;

impl<const NL: usize> Guidance<NL> {
    /// The estimate of a servicer and a target that are exactly where the next step expects them, if that step
    /// comes at `time` [s] between the plan's first node and its last. The target is where the plan expects it.
    /// The servicer is on the plan, turned with the target; near capture it is ahead of the plan and away from
    /// the port. A step with this estimate finds no error.
    ///
    /// A flight without a step so far counts as guided from the plan's first node on. After an abort the answer
    /// is still the plan's.
    /// Cost: that of a step without feedback, and the plan's motion from the node before.
    pub fn expected(
        &self,
        mission: &Valid<Mission<NL>>,
        plan: &FlightPlan<NL>,
        time: f64,
    ) -> Estimate<NL> {
        let planned = Estimate::as_planned(mission, time, &plan.at(mission, time));
        // A copy makes the step, so that this guidance stays as it is.
        let mut next = *self;
        next.restore();
        next.notice(plan);
        next.tick(&planned);
        next.memory.first.get_or_insert(plan.begins);
        let pace = plan.pace(&next.closing(plan), time);
        next.cursor.advance(plan, mission, pace.time);
        let mut wanted = next.cursor.reference(plan, mission);
        next.aim(mission, plan, &planned, &pace, &mut wanted);
        Estimate { target: planned.target, ..Estimate::as_planned(mission, time, &wanted) }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::super::{FlightMode, GuidanceSettings, Limits};
    use super::*;
    use crate::dynamics::Multibody;
    use crate::math::quaternion;
    use crate::model::Scenario;
    use crate::plan::Planner;
    use crate::planner::Options;
    use crate::stages::Mode;
    use nalgebra::Vector3;
    use remora_qp::Validate;
    use std::boxed::Box;

    /// Distance of the end effector from the port [m], and their relative speed [m/s].
    fn apart(mission: &Mission<3>, estimate: &Estimate<3>) -> [f64; 2] {
        let body = Multibody::new(mission);
        let at = |e: &Estimate<3>| {
            let (center, _) = body.center_of_mass(&e.state);
            e.position + center + body.end_effector(&e.state).position
        };
        let port =
            quaternion::rotation_matrix(&estimate.target.attitude) * mission.target.port_position_m;
        let off = at(estimate) - port;
        let h = 1e-3;
        let mut later = *estimate;
        later.position += estimate.velocity * h;
        let turn = quaternion::exp(&(estimate.state.rate * h));
        later.state.attitude = quaternion::product(&turn, &estimate.state.attitude);
        later.state.joint_angle += estimate.state.joint_rate * h;
        let moved = (at(&later) - at(estimate)) / h - estimate.target.rate.cross(&port);
        [off.norm(), moved.norm()]
    }

    /// Flies the expected estimates from `begins` to the plan's end, with a step every `period` [s].
    fn flies(mission: &Valid<Mission<3>>, plan: &FlightPlan<3>, begins: f64, period: f64) {
        let mut guidance = Guidance::new(GuidanceSettings::DEFAULT.validated().unwrap());
        let limits = Limits::of(&mission.servicer);
        let steps = libm::ceil((plan.duration() - begins) / period) as usize;
        for step in 0..=steps {
            let time = (begins + step as f64 * period).min(plan.duration());
            let estimate = guidance.expected(mission, plan, time);
            let command = guidance.step(mission, plan, &estimate, &limits);
            let error = command.error;
            let is_exact = error.position < 1e-9 && error.attitude < 1e-9 && error.joint < 1e-9;
            // Guidance that begins near capture has less of it: only its first step cannot be predicted.
            let is_late = step == 0 && begins > 0.0;
            assert!(is_exact || is_late, "{begins} {period} {time}: {error:?}");
            let mode = if step < steps { FlightMode::Track } else { FlightMode::Done };
            assert_eq!(command.mode, mode, "{begins} {period} {time}");
            if step == steps {
                let [far, fast] = apart(mission, &estimate);
                assert!(far < 1e-3 && fast < 1e-4, "{begins} {period}: {far} m, {fast} m/s");
            }
        }
    }

    /// The default vehicle and others, at several rates and from several times on.
    #[test]
    fn what_guidance_expects_is_flown_to_a_capture() {
        let heavy = |mission: &mut Mission<3>| mission.servicer.bus_mass_kg = 700.0;
        let short_arm = |mission: &mut Mission<3>| {
            for link in &mut mission.servicer.links {
                link.mass_kg *= 0.7;
                link.inertia_kg_m2 *= 0.7;
            }
        };
        let high = |mission: &mut Mission<3>| mission.orbit.semi_major_axis_m = 7.4e6;
        let vehicles: [fn(&mut Mission<3>); 4] = [|_| {}, heavy, short_arm, high];
        let mut planner = Box::new(Planner::new());
        for (i, change) in vehicles.into_iter().enumerate() {
            let mut mission = Mission::default();
            change(&mut mission);
            let mission = mission.validated().unwrap();
            let scenario = Scenario {
                target_rate: Vector3::new(2.0e-4, 0.0, 1.0e-3) * (0.5 + 0.5 * i as f64),
                position: Vector3::new(8.0, 0.0, 0.0),
                ..Scenario::default()
            };
            let options = Options::builder().mode(Mode::Feasible).build().unwrap();
            let plan = planner.plan(&mission, &scenario.validated().unwrap(), &options).unwrap();
            assert!(plan.is_verified(), "vehicle {i}");
            let plan = plan.flight_plan(0.0).unwrap();
            for (begins, period) in [(0.0, 1.0), (300.0, 5.0), (0.0, 2.5), (900.0, 0.5)] {
                flies(&mission, &plan, begins, period);
            }
        }
    }
}
