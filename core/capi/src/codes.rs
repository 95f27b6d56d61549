//! Codes that structures and functions hold as numbers of 32 bits, by name. Numbers never change their meaning.
//!
//! A structure of the caller's may hold any number, so its members are numbers here; the header gives them the
//! name of their enumeration, whose size is fixed in every C and C++.

use remora_core::advanced::guidance::{FlightMode, Reason};
use remora_core::advanced::model::Switch;
use remora_core::advanced::planner::{Fallback, GuessRecord, Verdict};
use remora_core::advanced::scp::Status as SolveStatus;

/// Goal at which planning ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraMode {
    /// Ends at the optimum.
    Optimal = 0,
    /// Ends at the first plan that satisfies every constraint.
    Feasible = 1,
}

/// Integrator of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraIntegrator {
    /// RK4: its plans can be flown.
    Rk4 = 0,
    /// Explicit Euler, the paper's: its plans cannot be flown.
    Euler = 1,
}

/// Whether a part of the problem is in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraSwitch {
    /// In force with RK4 only.
    Auto = 0,
    /// In force.
    On = 1,
    /// Not in force.
    Off = 2,
}

/// Verdict on a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraVerdict {
    /// Verified and converged; in feasibility mode verified and feasible.
    Optimal = 0,
    /// Verified but not converged: it can be flown, perhaps at a higher cost.
    Verified = 1,
    /// The verifier found a violation: it cannot be flown.
    NotFlyable = 2,
}

/// End of a solver's run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraSolveStatus {
    /// Feasible, and converged unless the first feasible iterate was asked for.
    Solved = 0,
    /// The iteration limit was reached, or steps became too small.
    IterationLimit = 1,
    /// Constraints cannot be satisfied, or the verifier found a violation.
    Infeasible = 2,
    /// The deadline passed first, or the caller stopped planning.
    Deadline = 3,
    /// Arithmetic broke down.
    NumericalFailure = 4,
}

/// Initial guess of Stage 2, and why the heuristic took the place of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraStart {
    /// The heuristic, as asked.
    Heuristic = 0,
    /// The model's.
    Model = 1,
    /// The heuristic: the model's file is damaged.
    Refused = 2,
    /// The heuristic: the other guess was not finite.
    NotFinite = 3,
    /// The heuristic: the other guess was worse.
    Worse = 4,
    /// The heuristic: the solver did not converge from the other guess.
    Unsolved = 5,
    /// The heuristic: the deadline had passed.
    Deadline = 6,
    /// The user's; not from C.
    User = 7,
    /// The rest of the plan in force.
    Nominal = 8,
    /// The heuristic: the model is for other plans.
    Unfit = 9,
}

/// Iterate that a stage left in place of its last one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraFallback {
    /// None: the last one stands.
    None = 0,
    /// An earlier one.
    EarlierIterate = 1,
    /// The initial guess.
    Start = 2,
}

/// Constraint for which a scenario was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraRefusal {
    /// None: the scenario was not refused.
    None = 0,
    /// A number is not finite.
    NotFinite = 1,
    /// The target's attitude is not a rotation.
    Attitude = 2,
    /// The servicer starts at the target's centre.
    Position = 3,
    /// Nodes are too far apart for the orbit.
    NodeInterval = 4,
    /// The preset time is too long for the approach.
    PresetLead = 5,
    /// A joint is too slow for its way to the capture angles.
    JointRate = 6,
    /// The port is outside the field of view at capture.
    CaptureView = 7,
    /// The bus is inside the target at capture.
    Clearance = 8,
    /// The servicer starts within the keep-out distance.
    KeepOut = 9,
    /// The port is outside the field of view at the start.
    FieldOfView = 10,
    /// The target turns too far from node to node.
    Tumble = 11,
    /// The end effector does not reach as far as the keep-out distance.
    Reach = 12,
    /// The thrusters are too weak.
    Force = 13,
    /// The bus cannot be turned as fast as the target.
    BusTorque = 14,
    /// The time to capture is not above zero.
    Duration = 15,
    /// A joint starts too far beyond its stop.
    JointStop = 16,
    /// Too few nodes, or too many.
    Nodes = 17,
    /// The arm is inside its own bus at capture.
    OwnBus = 18,
    /// Memory changed during planning.
    Damaged = 19,
}

/// Limits that a start violates and its plan leads back into: a bit each of RemoraRecord.recovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraRecovery {
    /// Stop of a joint.
    Joint = 1,
    /// Rate of a joint.
    JointRate = 2,
    /// Field of view.
    Pointing = 4,
    /// Keep-out distance.
    KeepOut = 8,
}

/// State of guidance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraFlightMode {
    /// Tracks the plan.
    Track = 0,
    /// Tracks the plan and wants another one.
    ReplanWanted = 1,
    /// The estimate has NaN or infinity: the planned command goes out without feedback.
    Degraded = 2,
    /// Leaves the target.
    Abort = 3,
    /// The plan's time is over.
    Done = 4,
}

/// Reason why another plan is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraReason {
    /// None: no other plan is wanted.
    None = 0,
    /// The plan is as old as it may be.
    Time = 1,
    /// The servicer is too far from the plan.
    Error = 2,
    /// The target's attitude is too far from the plan's prediction.
    Tumble = 3,
    /// The caller asked for it.
    Caller = 4,
}

/// Request of remora_ask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum RemoraRequest {
    /// Another plan is wanted.
    Replan = 1,
    /// Leave the target, from the next step on; there is no way back.
    Abort = 2,
}

/// Code of a RemoraStatus; any number is a valid value.
pub type RemoraStatusCode = u32;
/// Code of a RemoraMode; any number is a valid value.
pub type RemoraModeCode = u32;
/// Code of a RemoraIntegrator; any number is a valid value.
pub type RemoraIntegratorCode = u32;
/// Code of a RemoraSwitch; any number is a valid value.
pub type RemoraSwitchCode = u32;
/// Code of a RemoraVerdict; any number is a valid value.
pub type RemoraVerdictCode = u32;
/// Code of a RemoraSolveStatus; any number is a valid value.
pub type RemoraSolveStatusCode = u32;
/// Code of a RemoraStart; any number is a valid value.
pub type RemoraStartCode = u32;
/// Code of a RemoraFallback; any number is a valid value.
pub type RemoraFallbackCode = u32;
/// Code of a RemoraRefusal; any number is a valid value.
pub type RemoraRefusalCode = u32;
/// Code of a RemoraFlightMode; any number is a valid value.
pub type RemoraFlightModeCode = u32;
/// Code of a RemoraReason; any number is a valid value.
pub type RemoraReasonCode = u32;
/// Code of a RemoraRequest; any number is a valid value.
pub type RemoraRequestCode = u32;

/// Holds codes to those of the core, variant by variant.
macro_rules! same {
    ($ours:ident, $core:ident: $($variant:ident),*) => {
        $(assert!($ours::$variant as u32 == $core::$variant as u32);)*
    };
}

const _: () = {
    same!(RemoraSwitch, Switch: Auto, On, Off);
    same!(RemoraVerdict, Verdict: Optimal, Verified, NotFlyable);
    same!(RemoraSolveStatus, SolveStatus: Solved, IterationLimit, Infeasible, Deadline);
    same!(RemoraSolveStatus, SolveStatus: NumericalFailure);
    same!(RemoraStart, GuessRecord: Heuristic, Refused, NotFinite, Worse, Unsolved, Deadline);
    same!(RemoraStart, GuessRecord: User, Nominal, Unfit);
    assert!(RemoraStart::Model as u32 == GuessRecord::Learned as u32);
    same!(RemoraFallback, Fallback: None, EarlierIterate, Start);
    same!(RemoraFlightMode, FlightMode: Track, ReplanWanted, Degraded, Abort, Done);
    same!(RemoraReason, Reason: Time, Error, Tumble, Caller);
};

#[cfg(test)]
mod tests {
    use super::*;
    use remora_core::advanced::model::Refusal;

    #[test]
    fn refusals_have_the_codes_of_the_core() {
        let refusals = [
            (Refusal::NotFinite { field: "" }, RemoraRefusal::NotFinite),
            (Refusal::Attitude { norm: 0.0 }, RemoraRefusal::Attitude),
            (Refusal::Position { distance: 0.0 }, RemoraRefusal::Position),
            (Refusal::NodeInterval { interval: 0.0, limit: 0.0 }, RemoraRefusal::NodeInterval),
            (Refusal::PresetLead { lead: 0, limit: 0 }, RemoraRefusal::PresetLead),
            (Refusal::CaptureView { angle: 0.0, limit: 0.0 }, RemoraRefusal::CaptureView),
            (Refusal::Clearance { distance: 0.0, limit: 0.0 }, RemoraRefusal::Clearance),
            (Refusal::KeepOut { distance: 0.0, limit: 0.0 }, RemoraRefusal::KeepOut),
            (Refusal::FieldOfView { angle: 0.0, limit: 0.0 }, RemoraRefusal::FieldOfView),
            (Refusal::Tumble { turn: 0.0, limit: 0.0, duration: 0.0 }, RemoraRefusal::Tumble),
            (Refusal::Reach { distance: 0.0, before: 0.0, limit: 0.0 }, RemoraRefusal::Reach),
            (Refusal::Force { needed: 0.0, limit: 0.0 }, RemoraRefusal::Force),
            (Refusal::BusTorque { needed: 0.0, limit: 0.0 }, RemoraRefusal::BusTorque),
            (Refusal::Duration { duration: 0.0 }, RemoraRefusal::Duration),
            (Refusal::JointStop { joint: 0, beyond: 0.0, time: 0.0 }, RemoraRefusal::JointStop),
            (Refusal::Nodes { nodes: 0, most: 0 }, RemoraRefusal::Nodes),
            (Refusal::OwnBus { link: 0, depth: 0.0 }, RemoraRefusal::OwnBus),
            (Refusal::Damaged { what: "" }, RemoraRefusal::Damaged),
        ];
        for (refusal, code) in refusals {
            assert_eq!(refusal.code(), code as u32, "{refusal:?}");
        }
        let (joint, travel, rate, time, duration) = (0, 0.0, 0.0, 0.0, 0.0);
        let slow = Refusal::JointRate { joint, travel, rate, time, duration };
        assert_eq!(slow.code(), RemoraRefusal::JointRate as u32);
    }
}
