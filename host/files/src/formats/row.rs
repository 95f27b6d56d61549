//! Row of a campaign's journal and tables: the record of one plan.

use super::{
    ArmClearances, Clearances, Closest, Mission, NamedScenario, Nearest, PlanFile, Residuals,
    Status, Verdict,
};
use crate::error::FieldError;
use remora_core::advanced::model::{Refusal, Tolerances};
use serde::{Deserialize, Deserializer, Serialize};

/// Record of one plan in a campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Id of the scenario.
    pub scenario: String,
    /// The worse of the stages'; infeasible where it was refused before planning.
    pub status: Status,
    /// Verdict: whether the plan is optimal, verified or not flyable.
    pub verdict: Verdict,
    /// Name of what makes a plan not flyable: the constraint for which it was refused, or the
    /// residual farthest beyond its tolerance. Empty where it can be flown.
    pub reason: String,
    /// Initial guess of Stage 2: heuristic, model, or fallback where a model was asked for.
    pub warm_start: String,
    /// Stage 1.
    pub stage1: StageRow,
    /// Stage 2.
    pub stage2: StageRow,
    /// Time in a learned warm start [s].
    #[serde(deserialize_with = "number")]
    pub inference_s: f64,
    /// The residuals in the order of the plan file.
    #[serde(deserialize_with = "numbers")]
    pub residuals: [f64; Residuals::COUNT],
    /// How near bodies come to each other.
    pub clearances: Clearances,
    /// The pair of bodies that comes nearest, without the end effector.
    pub nearest: Nearest,
    /// Smallest distance of the end effector from the target, or from the edge of the corridor to its port.
    pub end_effector: Closest,
    /// How hard the scenario is and what the plan asks of the servicer.
    pub flight: Flight,
    /// Time of the whole plan [s].
    #[serde(deserialize_with = "number")]
    pub time_s: f64,
    /// Processor time of the thread that planned [s]; NaN where the system does not tell.
    #[serde(deserialize_with = "number")]
    pub cpu_time_s: f64,
    /// Checksum of the plan's trajectories as evidence has it; empty where there is no plan.
    pub plan_checksum: String,
}

/// Record of one stage of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageRow {
    /// Iterations.
    pub iterations: u64,
    /// Second-order corrections beside them.
    pub corrections: u64,
    /// Cost.
    #[serde(deserialize_with = "number")]
    pub cost: f64,
    /// Time of the whole stage [s].
    #[serde(deserialize_with = "number")]
    pub time_s: f64,
}

/// How hard a scenario is, and what its plan asks of the servicer. NaN where nothing was planned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Flight {
    /// Norm of the target's rate relative to RTN at the start [rad/s].
    #[serde(deserialize_with = "number")]
    pub target_rate_rad_s: f64,
    /// Distance of the system's centre of mass from the target's at the start [m].
    #[serde(deserialize_with = "number")]
    pub start_distance_m: f64,
    /// Largest component of the force [N].
    #[serde(deserialize_with = "number")]
    pub peak_force_n: f64,
    /// Largest component of the bus torque [N m].
    #[serde(deserialize_with = "number")]
    pub peak_bus_torque_n_m: f64,
    /// Largest joint torque [N m].
    #[serde(deserialize_with = "number")]
    pub peak_joint_torque_n_m: f64,
    /// The force's norm over the system's mass, summed over the plan [m/s].
    #[serde(deserialize_with = "number")]
    pub delta_v_m_s: f64,
}

impl Flight {
    /// Figures of a scenario and its plan.
    pub fn new(mission: &Mission, scenario: &NamedScenario, plan: &PlanFile) -> Self {
        fn peak<'a>(numbers: impl Iterator<Item = &'a f64>) -> f64 {
            numbers.fold(0.0, |most, x| most.max(x.abs()))
        }
        let (one, two) = (&plan.stage1, &plan.stage2);
        let dt = mission.grid(&scenario.scenario()).interval();
        let impulse = one.force.iter().map(norm).sum::<f64>() * dt;
        Self {
            peak_force_n: peak(one.force.iter().flatten()),
            peak_bus_torque_n_m: peak(two.bus_torque.iter().flatten()),
            peak_joint_torque_n_m: peak(two.joint_torque.iter().flatten()),
            delta_v_m_s: impulse / mission.servicer.total_mass(),
            ..Self::refused(scenario)
        }
    }

    /// Figures of a scenario that was refused before planning.
    pub fn refused(scenario: &NamedScenario) -> Self {
        Self {
            target_rate_rad_s: norm(&scenario.target.rate),
            start_distance_m: norm(&scenario.servicer.position),
            peak_force_n: f64::NAN,
            peak_bus_torque_n_m: f64::NAN,
            peak_joint_torque_n_m: f64::NAN,
            delta_v_m_s: f64::NAN,
        }
    }
}

fn norm(v: &[f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// JSON has no NaN: it is written as null.
fn number<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

fn numbers<'de, D: Deserializer<'de>, const N: usize>(from: D) -> Result<[f64; N], D::Error>
where
    [Option<f64>; N]: Deserialize<'de>,
{
    let values = <[Option<f64>; N]>::deserialize(from)?;
    Ok(values.map(|value| value.unwrap_or(f64::NAN)))
}

/// Initial guess of a scenario that was refused before planning.
const UNPLANNED: &str = "none";
/// Initial guesses of plans in campaigns.
const STARTS: [&str; 3] = ["heuristic", "model", "fallback"];
/// Digits of a plan's checksum.
const CHECKSUM_DIGITS: usize = 16;
/// More iterations than all tries of a stage have, whatever the settings.
const MOST_ITERATIONS: u64 = 1000;
/// More corrections than all tries of a stage have, whatever the settings.
const MOST_CORRECTIONS: u64 = 10_000;
/// More than a cost or another size of a plan can be.
const MOST_SIZE: f64 = 1e100;

/// Whether a number is a size that there can be.
fn is_size(value: f64) -> bool {
    (0.0..MOST_SIZE).contains(&value)
}

/// How large the residuals of a plan that can be flown may be, in the order of the plan file.
pub fn residual_limits(tolerances: &Tolerances) -> [f64; Residuals::COUNT] {
    Residuals::default().against(tolerances).map(|(_, _, tolerance)| tolerance)
}

impl Row {
    /// The row of a plan. Its file lacks the corrections, the violated constraint and the clearance of each part
    /// of the arm. Its checksum comes with its evidence.
    pub fn new(
        plan: &PlanFile,
        corrections: [u64; 2],
        reason: Option<&str>,
        flight: Flight,
        arm: &ArmClearances,
    ) -> Self {
        let clearances = plan.clearances.unwrap_or(Clearances::NONE);
        let (one, two) = (&plan.stage1, &plan.stage2);
        let residuals = plan.residuals.against(&Default::default());
        Self {
            scenario: plan.scenario.clone(),
            status: plan.status,
            verdict: plan.verdict.unwrap_or(Verdict::NotFlyable),
            reason: reason.unwrap_or_default().into(),
            warm_start: plan.warm_start.clone(),
            stage1: StageRow {
                iterations: one.iterations,
                corrections: corrections[0],
                cost: one.cost,
                time_s: one.time_s,
            },
            stage2: StageRow {
                iterations: two.iterations,
                corrections: corrections[1],
                cost: two.cost,
                time_s: two.time_s,
            },
            inference_s: two.inference_s,
            residuals: residuals.map(|(_, value, _)| value),
            clearances,
            nearest: Nearest::of(&clearances, &arm.links),
            end_effector: arm.end_effector,
            flight,
            time_s: plan.time_s.unwrap_or(f64::NAN),
            cpu_time_s: plan.cpu_time_s.unwrap_or(f64::NAN),
            plan_checksum: String::new(),
        }
    }

    /// The row of a scenario that was refused before planning: no iteration, no time, no number.
    pub fn refused(scenario: &NamedScenario, refusal: &Refusal) -> Self {
        let stage = StageRow { iterations: 0, corrections: 0, cost: f64::NAN, time_s: 0.0 };
        Self {
            scenario: scenario.id.clone(),
            status: Status::Infeasible,
            verdict: Verdict::NotFlyable,
            reason: refusal.name().into(),
            warm_start: UNPLANNED.into(),
            stage1: stage,
            stage2: stage,
            inference_s: 0.0,
            residuals: [f64::NAN; Residuals::COUNT],
            clearances: Clearances::NONE,
            nearest: Nearest::NONE,
            end_effector: Closest::NONE,
            flight: Flight::refused(scenario),
            time_s: 0.0,
            cpu_time_s: 0.0,
            plan_checksum: String::new(),
        }
    }

    /// Refuses a row that no plan has, such as one that can be flown with a residual beyond its tolerance.
    ///
    /// # Errors
    /// The field and what is wrong with it.
    pub fn check(&self, tolerances: &Tolerances) -> Result<(), FieldError> {
        self.check_within(&residual_limits(tolerances))
    }

    /// Checks the row against the [`residual_limits`] of its residuals.
    ///
    /// # Errors
    /// The field and what is wrong with it.
    pub fn check_within(&self, limits: &[f64; Residuals::COUNT]) -> Result<(), FieldError> {
        if self.verdict != Verdict::of(self.is_verified(), self.status) {
            return Err(FieldError::new("verdict", "contradicts the status"));
        }
        self.check_words()?;
        self.check_counts()?;
        self.nearest.check(&self.clearances)?;
        for (field, value) in self.times() {
            if !is_size(value) {
                return Err(FieldError::new(field, format!("is {value}, and no time is")));
            }
        }
        match self.is_verified() {
            true => self.check_verified(limits),
            false => Ok(()),
        }
    }

    /// Start, reason and checksum, as far as each other and the verdict tell.
    fn check_words(&self) -> Result<(), FieldError> {
        let wrong = |field: &str, reason: String| Err(FieldError::new(field, reason));
        if !self.is_refused() && !STARTS.contains(&self.warm_start.as_str()) {
            return wrong("warm_start", format!("{:?} is unknown", self.warm_start));
        }
        if self.is_refused() && (self.status != Status::Infeasible || self.is_verified()) {
            return wrong("warm_start", "is none, and the scenario was not refused".into());
        }
        if self.is_verified() && !self.reason.is_empty() {
            let reason = format!("is {:?}, and the plan is said to be flyable", self.reason);
            return wrong("reason", reason);
        }
        if self.is_refused() && self.reason.is_empty() {
            return wrong("reason", "is missing, and the scenario was refused".into());
        }
        let is_hex = |text: &str| {
            text.len() == CHECKSUM_DIGITS
                && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
        };
        match self.is_refused() {
            true if !self.plan_checksum.is_empty() => {
                wrong("plan_checksum", "is there, and the scenario was refused".into())
            }
            false if !is_hex(&self.plan_checksum) => {
                let reason =
                    format!("is {:?}, not {CHECKSUM_DIGITS} digits of hex", self.plan_checksum);
                wrong("plan_checksum", reason)
            }
            _ => Ok(()),
        }
    }

    /// Iterations and corrections, of which a refused scenario has none.
    fn check_counts(&self) -> Result<(), FieldError> {
        let most = |most: u64| if self.is_refused() { 0 } else { most };
        for (field, count, most) in [
            ("stage1.iterations", self.stage1.iterations, most(MOST_ITERATIONS)),
            ("stage1.corrections", self.stage1.corrections, most(MOST_CORRECTIONS)),
            ("stage2.iterations", self.stage2.iterations, most(MOST_ITERATIONS)),
            ("stage2.corrections", self.stage2.corrections, most(MOST_CORRECTIONS)),
        ] {
            if count > most {
                return Err(FieldError::new(field, format!("is {count}, of {most} at most")));
            }
        }
        Ok(())
    }

    /// Times of the machine; where the system does not tell that of the processor, zero.
    fn times(&self) -> [(&'static str, f64); 5] {
        let cpu = if self.cpu_time_s.is_nan() { 0.0 } else { self.cpu_time_s };
        [
            ("stage1.time_s", self.stage1.time_s),
            ("stage2.time_s", self.stage2.time_s),
            ("inference_s", self.inference_s),
            ("time_s", self.time_s),
            ("cpu_time_s", cpu),
        ]
    }

    /// Residuals within their limits, and sizes that are some.
    fn check_verified(&self, limits: &[f64; Residuals::COUNT]) -> Result<(), FieldError> {
        let names = Residuals::default().against(&Default::default());
        for (((name, _, _), tolerance), value) in names.iter().zip(limits).zip(self.residuals) {
            if !(0.0..=*tolerance).contains(&value) {
                let reason =
                    format!("is {value} of {tolerance}, and the plan is said to be flyable");
                return Err(FieldError::new(format!("residuals.{name}"), reason));
            }
        }
        for (field, value) in [
            ("stage1.cost", self.stage1.cost),
            ("stage2.cost", self.stage2.cost),
            ("flight.target_rate_rad_s", self.flight.target_rate_rad_s),
            ("flight.start_distance_m", self.flight.start_distance_m),
            ("flight.peak_force_n", self.flight.peak_force_n),
            ("flight.peak_bus_torque_n_m", self.flight.peak_bus_torque_n_m),
            ("flight.peak_joint_torque_n_m", self.flight.peak_joint_torque_n_m),
            ("flight.delta_v_m_s", self.flight.delta_v_m_s),
        ] {
            if !is_size(value) {
                let reason = format!("is {value}, and the plan is said to be flyable");
                return Err(FieldError::new(field, reason));
            }
        }
        Ok(())
    }

    /// Whether the verifier found every constraint kept: such a plan can be flown.
    pub fn is_verified(&self) -> bool {
        self.verdict != Verdict::NotFlyable
    }

    /// Whether it was refused before planning: then Stage 2 started from nothing.
    pub fn is_refused(&self) -> bool {
        self.warm_start == UNPLANNED
    }
}
