//! What a plan is good for, how near bodies come to each other, and what a plan that cannot be
//! flown fails by.

use super::{PlanResiduals, PlanStatus};
use remora_core::advanced::model::Tolerances;
use remora_core::advanced::planner;
use remora_core::advanced::stages::{Clearances, Closest, Residuals};
use serde::{Deserialize, Serialize};
use std::fmt;

/// What a plan is good for: the three outcomes, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlanVerdict {
    /// Verified, and what was asked for was reached.
    Optimal,
    /// Verified, but not converged: it can be flown.
    VerifiedNotConverged,
    /// Not to be flown.
    NotFlyable,
}

impl PlanVerdict {
    /// All of them, best first.
    pub const ALL: [Self; 3] = [Self::Optimal, Self::VerifiedNotConverged, Self::NotFlyable];

    /// The verdict on a plan that is verified or not and ended so.
    pub fn of(is_verified: bool, status: PlanStatus) -> Self {
        match (is_verified, status) {
            (true, PlanStatus::Solved) => Self::Optimal,
            (true, _) => Self::VerifiedNotConverged,
            (false, _) => Self::NotFlyable,
        }
    }

    /// Name in files.
    pub fn name(self) -> &'static str {
        planner::Verdict::from(self).name()
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Optimal => "optimal",
            Self::VerifiedNotConverged => "verified but not converged",
            Self::NotFlyable => "not flyable",
        }
    }
}

impl fmt::Display for PlanVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl From<planner::Verdict> for PlanVerdict {
    fn from(verdict: planner::Verdict) -> Self {
        match verdict {
            planner::Verdict::Optimal => Self::Optimal,
            planner::Verdict::Verified => Self::VerifiedNotConverged,
            planner::Verdict::NotFlyable => Self::NotFlyable,
        }
    }
}

impl From<PlanVerdict> for planner::Verdict {
    fn from(verdict: PlanVerdict) -> Self {
        match verdict {
            PlanVerdict::Optimal => Self::Optimal,
            PlanVerdict::VerifiedNotConverged => Self::Verified,
            PlanVerdict::NotFlyable => Self::NotFlyable,
        }
    }
}

/// The smallest distances over a plan between the servicer's bodies, the target and each other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the clearances")]
pub struct PlanClearances {
    /// The arm and the target.
    pub arm: PlanClosest,
    /// The bus and the target.
    pub bus: PlanClosest,
    /// The arm and its own bus.
    pub own: PlanClosest,
}

/// The smallest distance between two bodies over a plan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with distance_m, time_s and body")]
pub struct PlanClosest {
    /// Distance [m], negative where they overlap; null where nobody has looked.
    #[serde(deserialize_with = "Option::deserialize")]
    pub distance_m: Option<f64>,
    /// When [s].
    pub time_s: f64,
    /// Which body of the servicer: 0 the bus, then the links, from 1.
    pub body: u32,
}

impl PlanClearances {
    /// Names and values, in the order of the plan file.
    pub fn named(&self) -> [(&'static str, PlanClosest); 3] {
        [("arm", self.arm), ("bus", self.bus), ("own", self.own)]
    }
}

impl PlanClearances {
    /// Nobody has looked.
    pub fn none() -> Self {
        Clearances { arm: Closest::NONE, bus: Closest::NONE, own: Closest::NONE }.into()
    }
}

impl From<Clearances> for PlanClearances {
    fn from(c: Clearances) -> Self {
        Self { arm: c.arm.into(), bus: c.bus.into(), own: c.own.into() }
    }
}

impl From<Closest> for PlanClosest {
    fn from(closest: Closest) -> Self {
        let Closest { distance, time_s, body } = closest;
        Self { distance_m: distance.is_finite().then_some(distance), time_s, body }
    }
}

/// Name of the residual that is farthest beyond its tolerance, where one is.
pub fn worst_residual(residuals: &PlanResiduals, tolerances: &Tolerances) -> Option<&'static str> {
    let rows = Residuals::from(*residuals).against(tolerances);
    // What is not a number is the worst.
    let over = |value: f64, tolerance: f64| match value.is_nan() {
        true => f64::INFINITY,
        false => value / tolerance,
    };
    let beyond = rows.into_iter().filter(|(_, value, tolerance)| !(value <= tolerance));
    let worst = beyond.max_by(|a, b| over(a.1, a.2).total_cmp(&over(b.1, b.2)));
    worst.map(|(name, _, _)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_are_the_cores() {
        for (i, verdict) in PlanVerdict::ALL.into_iter().enumerate() {
            let core = planner::Verdict::from(verdict);
            assert_eq!((core.code(), PlanVerdict::from(core)), (i as u32, verdict));
            assert_eq!(serde_json::to_value(verdict).unwrap(), core.name());
        }
        for status in PlanStatus::ALL {
            let solved = status == PlanStatus::Solved;
            let expected = if solved { "optimal" } else { "verified_not_converged" };
            assert_eq!(PlanVerdict::of(true, status).name(), expected);
            assert_eq!(PlanVerdict::of(false, status).name(), "not_flyable");
        }
    }

    #[test]
    fn the_worst_residual_is_named() {
        let worst = |residuals: Residuals| worst_residual(&residuals.into(), &Default::default());
        assert_eq!(worst(Residuals::default()), None);
        let over = Residuals { dynamics2: 1e-3, joint: 1e-4, ee_angle: 9e-4, ..Default::default() };
        assert_eq!(worst(over), Some("joint"));
        assert_eq!(worst(Residuals { preset: f64::NAN, ..over }), Some("preset"));
    }
}
