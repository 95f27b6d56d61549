//! Stage 2 under verification: attitude and arm.

use super::PARTS;
use super::residuals::{RATE_SCALE, worst};
use crate::dynamics::{Control, Integrator, State, articulated};
use crate::math::quaternion;
use crate::model::Mission;
use crate::stages::worse;
use nalgebra::{Vector3, Vector4};

/// Substeps of the coarsest integration of an interval by RK4.
const COARSEST: usize = 5;

/// How often the substeps of an interval are doubled at most: from 5 to 640.
pub(crate) const MAX_DOUBLINGS: usize = 7;

/// Most substeps of an integration that a part of an interval gets.
pub(crate) const MAX_PART_SUBSTEPS: usize = 1 << (MAX_DOUBLINGS - 1);

/// Share of the tolerance of Stage 2's dynamics by which two integrations of an interval may
/// differ; the finer one errs by a fifteenth of that.
const RESOLVED: f64 = 0.1;

/// Interval of a plan, with the control and the force that act in it.
pub(super) struct Interval<'a, const NL: usize> {
    pub mission: &'a Mission<NL>,
    pub integrator: Integrator,
    pub dt: f64,
    pub control: &'a Control<NL>,
    pub force: &'a Vector3<f64>,
}

/// The motion through an interval.
pub(super) struct Flown<const NL: usize> {
    /// States at the ends of the interval's parts.
    pub states: [State<NL>; PARTS + 1],
    /// Largest error left in the last state, scaled; zero where the integration is resolved.
    pub unresolved: f64,
}

impl<const NL: usize> Interval<'_, NL> {
    /// From `x` to the interval's end: by the paper's one step of Euler and the straight line to
    /// it, or by RK4 in as many substeps as it takes, whatever the plan's.
    ///
    /// Cost of RK4: 20 evaluations of the dynamics for 5 substeps, 40 for 10, and so on.
    pub fn fly(&self, x: &State<NL>) -> Flown<NL> {
        if !self.integrator.is_flown() {
            let rates = self.rates(x);
            let at = |part: usize| renormalized(moved(x, &rates, self.share(part)));
            let states = core::array::from_fn(|part| if part == 0 { *x } else { at(part) });
            return Flown { states, unresolved: 0.0 };
        }
        let tolerance = RESOLVED * self.mission.tolerances.dynamics;
        let mut coarse = self.substeps(x, self.dt / COARSEST as f64, COARSEST);
        let mut flown = Flown { states: [*x; PARTS + 1], unresolved: f64::INFINITY };
        // Bound: doublings.
        for doubled in 0..MAX_DOUBLINGS {
            flown.states = self.parts(x, 1 << doubled);
            let fine = &flown.states[PARTS];
            let apart = difference(&coarse, fine);
            if apart <= tolerance {
                flown.unresolved = 0.0;
                return flown;
            }
            flown.unresolved = apart;
            // Gives up where the integrations do not stay finite.
            if !apart.is_finite() {
                return flown;
            }
            coarse = *fine;
        }
        flown
    }

    /// Time from the interval's beginning to the end of its part `part` [s].
    fn share(&self, part: usize) -> f64 {
        self.dt * (part as f64 / PARTS as f64)
    }

    /// States at the ends of the parts, each in so many substeps of RK4.
    fn parts(&self, x: &State<NL>, substeps: usize) -> [State<NL>; PARTS + 1] {
        let h = self.dt / (PARTS * substeps) as f64;
        let mut states = [*x; PARTS + 1];
        for part in 0..PARTS {
            states[part + 1] = self.substeps(&states[part], h, substeps);
        }
        states
    }

    fn substeps(&self, x: &State<NL>, h: f64, count: usize) -> State<NL> {
        let mut x = *x;
        // Bound: verified_substeps.
        for _ in 0..count {
            let k1 = self.rates(&x);
            let k2 = self.rates(&moved(&x, &k1, 0.5 * h));
            let k3 = self.rates(&moved(&x, &k2, 0.5 * h));
            let k4 = self.rates(&moved(&x, &k3, h));
            for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                x = moved(&x, &k, weight * h / 6.0);
            }
            x = renormalized(x);
        }
        x
    }

    /// Time derivative of a state, on articulated-body accelerations.
    // One copy of it and of its stack.
    #[inline(never)]
    fn rates(&self, x: &State<NL>) -> State<NL> {
        let spin = Vector4::new(x.rate.x, x.rate.y, x.rate.z, 0.0);
        let (servicer, n) = (&self.mission.servicer, self.mission.mean_motion());
        let a = articulated::acceleration(servicer, n, x, self.control, self.force);
        State {
            attitude: quaternion::product(&spin, &x.attitude) * 0.5,
            joint_angle: x.joint_rate,
            rate: a.bus,
            joint_rate: a.joint,
        }
    }
}

fn moved<const NL: usize>(x: &State<NL>, rates: &State<NL>, h: f64) -> State<NL> {
    State {
        attitude: x.attitude + rates.attitude * h,
        joint_angle: x.joint_angle + rates.joint_angle * h,
        rate: x.rate + rates.rate * h,
        joint_rate: x.joint_rate + rates.joint_rate * h,
    }
}

fn renormalized<const NL: usize>(x: State<NL>) -> State<NL> {
    State { attitude: quaternion::normalized(&x.attitude), ..x }
}

/// Largest scaled difference of two states; the quaternion's sign does not count.
pub(super) fn difference<const NL: usize>(a: &State<NL>, b: &State<NL>) -> f64 {
    let same = worst((a.attitude - b.attitude).as_slice());
    let opposite = worst((a.attitude + b.attitude).as_slice());
    let attitude = if opposite < same { opposite } else { same };
    let angle = worst((a.joint_angle - b.joint_angle).as_slice());
    let rate = worst(((a.rate - b.rate) / RATE_SCALE).as_slice());
    let joint_rate = worst(((a.joint_rate - b.joint_rate) / RATE_SCALE).as_slice());
    worse(worse(attitude, angle), worse(rate, joint_rate))
}
