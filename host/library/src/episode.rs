//! An approach flown by a policy, node by node, for reinforcement learning. The policy chooses
//! torques and gets their cost and, at the end, the end effector's distance from the port.

use crate::approach::Approach;
use crate::formats::MAX_JOINTS;
use remora_core::advanced::dynamics::{Control, State};
use remora_core::advanced::stages::size;
use remora_core::advanced::warmstart::Encoding;
use std::sync::Arc;

/// Fastest that bus and joints may turn [rad/s]: faster than any scenario may begin, and than steps can follow.
pub const MAX_RATE: f64 = 1.0;

/// The miss of an episode that is lost by it [m].
pub const LOST_MISS_M: f64 = 100.0;

/// Result of one step of an episode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Minus the cost of the interval; at the last node also minus the weighted miss.
    pub reward: f64,
    /// Whether the last node is reached, or the episode lost: something turns faster than [`MAX_RATE`].
    pub is_last: bool,
}

/// Terms of an episode: the policy's features and the cost of a miss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// Encoding of the features that the policy sees.
    pub encoding: Encoding,
    /// Cost of a metre of miss [1/m].
    pub miss_weight: f64,
}

/// An episode on one of several approaches.
#[derive(Clone)]
pub struct Episode {
    approaches: Arc<Vec<Approach>>,
    terms: Terms,
    /// Index of the approach that is flown.
    at: usize,
    node: usize,
    state: State<MAX_JOINTS>,
    /// The torques held last.
    held: Control<MAX_JOINTS>,
    is_lost: bool,
    cost: f64,
}

impl Episode {
    /// An episode that has not begun; there is at least one approach.
    pub fn new(approaches: Arc<Vec<Approach>>, terms: Terms) -> Self {
        let mut episode = Self {
            approaches,
            terms,
            at: 0,
            node: 0,
            state: State::ZERO,
            held: Control::ZERO,
            is_lost: false,
            cost: 0.0,
        };
        episode.begin(0);
        episode
    }

    fn approach(&self) -> &Approach {
        &self.approaches[self.at]
    }

    /// Begins again, on another approach.
    pub fn begin(&mut self, approach: usize) {
        self.at = approach % self.approaches.len();
        self.state = State::at_start(&self.approach().mission, &self.approach().scenario);
        (self.node, self.held, self.is_lost, self.cost) = (0, Control::ZERO, false, 0.0);
    }

    /// Writes what the policy sees at the node it is at: the scene's features, with the torques of the
    /// interval before among them [N m].
    pub fn observe(&self, out: &mut [f32]) {
        let Control { bus_torque, joint_torque } = &self.held;
        let mut previous = [0.0; size::controls(MAX_JOINTS)];
        let held = bus_torque.iter().chain(joint_torque.iter());
        previous.iter_mut().zip(held).for_each(|(x, torque)| *x = *torque as f32);
        self.approach().features(self.terms.encoding, self.node, &self.state, &previous, out);
    }

    /// Holds torques over the next interval: an action from -1 to 1 for each, of its limit. Once the episode
    /// has ended nothing happens any more.
    pub fn step(&mut self, action: &[f32]) -> Step {
        let (approach, k) = (&self.approaches[self.at], self.node);
        let last = approach.nodes() - 1;
        if k >= last || self.is_lost {
            return Step { reward: 0.0, is_last: true };
        }
        let mut torques = [0.0; size::controls(MAX_JOINTS)];
        let scaled = action.iter().zip(approach.torque_limits());
        torques.iter_mut().zip(scaled).for_each(|(torque, (share, limit))| {
            *torque = (f64::from(*share) * limit) as f32;
        });
        let (held, next) = approach.step(k, &self.state, &torques, &self.held);
        let cost = approach.cost(&held);
        self.is_lost = !is_slow(&next);
        if !self.is_lost {
            (self.node, self.state) = (k + 1, next);
        }
        let is_last = self.node == last || self.is_lost;
        (self.held, self.cost) = (held, self.cost + cost);
        let miss = if is_last { self.miss() } else { 0.0 };
        Step { reward: -cost - self.terms.miss_weight * miss, is_last }
    }

    /// Distance of the end effector from the port, were this the last node; that of a lost episode is
    /// [`LOST_MISS_M`] [m].
    pub fn miss(&self) -> f64 {
        match self.is_lost {
            true => LOST_MISS_M,
            false => self.approach().miss(&self.state),
        }
    }

    /// Cost of the torques so far.
    pub fn cost(&self) -> f64 {
        self.cost
    }
}

/// Whether nothing turns faster than it may; a state that is not finite does.
fn is_slow(state: &State<MAX_JOINTS>) -> bool {
    state.is_finite()
        && state.rate.iter().chain(state.joint_rate.iter()).all(|rate| rate.abs() <= MAX_RATE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::ScenarioSet;
    use crate::memory::on_large_stack;
    use crate::method::{Integrator, Method};
    use crate::planning::Planner;
    use crate::request::PlanRequest;

    /// A plan's torques, flown as actions, cost what the plan says and end where it ends.
    #[test]
    fn the_actions_of_a_plan_earn_minus_its_cost() {
        let scenario = &ScenarioSet::built_in().unwrap().scenarios[0];
        let method = Method { integrator: Integrator::Euler, ..Method::default() };
        let request = PlanRequest { method, ..PlanRequest::default() };
        let (plan, approach) = on_large_stack(|| {
            let mut planner = Planner::new();
            let plan = planner.plan(&request, scenario).file;
            (plan, planner.approach(&request, scenario).unwrap())
        })
        .unwrap();
        let limits: Vec<f64> = approach.torque_limits().collect();
        let terms = Terms { encoding: Encoding::Body, miss_weight: 2.0 };
        let mut episode = Episode::new(Arc::new(vec![approach]), terms);
        let mut features = [f32::NAN; 70];
        episode.observe(&mut features);
        assert_eq!(Encoding::Body.features(3), features.len());
        assert!(features.iter().all(|x| x.is_finite()));
        let mut sum = 0.0;
        for (k, (bus, joint)) in
            plan.stage2.bus_torque.iter().zip(&plan.stage2.joint_torque).enumerate()
        {
            let torques = bus.iter().chain(joint).zip(&limits);
            let action: Vec<f32> = torques.map(|(x, limit)| (x / limit) as f32).collect();
            let step = episode.step(&action);
            assert_eq!(step.is_last, k == 58);
            sum += step.reward;
        }
        assert!(episode.miss() < 1e-3, "{}", episode.miss());
        assert!((episode.cost() / plan.stage2.cost - 1.0).abs() < 1e-5);
        assert!((sum + episode.cost() + 2.0 * episode.miss()).abs() < 1e-12);
        assert_eq!(episode.step(&[1.0; 6]), Step { reward: 0.0, is_last: true });
        episode.begin(0);
        let mut again = [f32::NAN; 70];
        episode.observe(&mut again);
        assert_eq!(again, features);

        // A constant torque on one joint spins it up until the episode is lost.
        let steps: Vec<Step> =
            std::iter::repeat_with(|| episode.step(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.05]))
                .take(59)
                .collect();
        let lost = steps.iter().position(|step| step.is_last).unwrap();
        assert!((5..58).contains(&lost), "{lost}");
        assert!(steps[..lost].iter().all(|step| step.reward > -LOST_MISS_M));
        assert!(steps[lost].reward < -2.0 * LOST_MISS_M && episode.miss() == LOST_MISS_M);
        assert!(steps[lost + 1..].iter().all(|step| *step == Step { reward: 0.0, is_last: true }));
        episode.observe(&mut again);
        assert!(again.iter().all(|x| x.is_finite()));
    }
}
