//! Reading plans and writing them.

use super::kind::{is_named_packet, is_packet};
use super::plan_file::{FORMAT, PlanFile};
use super::{Kind, Limit, Residuals, as_text, check_id, json, unit};
use crate::error::{Error, FieldError};
use std::path::Path;

impl PlanFile {
    /// Parses and validates a plan.
    ///
    /// # Errors
    /// The first field found wrong: unknown format or field, numbers that are not, numbers of
    /// rows that do not fit the horizon, quaternions not of unit length.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        let mut plan: Self = json::parse(text, FORMAT)?;
        plan.check_head()?;
        plan.normalise()?;
        plan.validate()?;
        Ok(plan)
    }

    /// Reads and validates a file.
    ///
    /// # Errors
    /// The file with the error of [`PlanFile::parse`].
    pub fn read(file: &Path) -> Result<Self, Error> {
        Kind::Plan.read(file, Limit::DOCUMENT, Self::from_bytes)
    }

    /// Parses and validates what a file holds, JSON or [a packet](PlanFile::to_packet).
    ///
    /// # Errors
    /// The error of [`PlanFile::parse`]; a packet that is damaged.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, FieldError> {
        match is_packet(bytes) {
            // Numbers that are none become `null`, which the reader of the text refuses.
            true => Self::parse(&Self::from_packet(bytes)?.text()?),
            false => Self::parse(as_text(bytes)?),
        }
    }

    /// Whether another plan flies alike: all is equal but times and the program that made it.
    pub fn flies_as(&self, other: &Self) -> bool {
        let (a, b) = (&self.stage1, &other.stage1);
        let paths = a.position == b.position && a.velocity == b.velocity && a.force == b.force;
        let (a, b) = (&self.stage2, &other.stage2);
        let states = a.attitude == b.attitude
            && a.joint_angle == b.joint_angle
            && a.rate == b.rate
            && a.joint_rate == b.joint_rate;
        let controls = a.bus_torque == b.bus_torque && a.joint_torque == b.joint_torque;
        let asked = self.integrator == other.integrator && self.inputs == other.inputs;
        asked && self.grid == other.grid && paths && states && controls
    }

    /// Writes the file whole or not at all; as a packet where its name ends in `.postcard`.
    ///
    /// # Errors
    /// The file with the reason why it cannot be written.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        super::write_atomically(file, &self.bytes(file)?)
    }

    /// The plan as bytes: a packet or JSON, by the name of the file.
    pub(super) fn bytes(&self, file: &Path) -> Result<Vec<u8>, Error> {
        let bytes = match is_named_packet(file) {
            true => self.to_packet(),
            false => self.text().map(String::into_bytes),
        };
        let failed = |error: FieldError| Error::Output { file: file.into(), reason: error.reason };
        bytes.map_err(failed)
    }

    fn text(&self) -> Result<String, FieldError> {
        json::to_text(self).map_err(|error| FieldError::new("", error.to_string()))
    }

    /// Refuses inputs that are not sound, and a grid that is not theirs.
    fn check_head(&self) -> Result<(), FieldError> {
        let Self { inputs, grid, .. } = self;
        check_id(&self.scenario, || "scenario".into())?;
        let made_for = inputs.read(&self.scenario)?;
        grid.check(&made_for.mission, &made_for.scenario)
    }

    /// Quaternions that are nearly of unit length are normalised; any other is refused.
    fn normalise(&mut self) -> Result<(), FieldError> {
        let (two, target) = (&mut self.stage2.attitude, &mut self.target.attitude);
        for (part, rows) in [("stage2", two), ("target", target)] {
            for (k, q) in rows.iter_mut().enumerate() {
                *q = unit::quaternion(q, || format!("{part}.attitude_body_to_rtn[{k}]"))?;
            }
        }
        Ok(())
    }

    fn validate(&self) -> Result<(), FieldError> {
        self.check_rows()?;
        self.check_numbers()
    }

    fn check_rows(&self) -> Result<(), FieldError> {
        let (one, two, target) = (&self.stage1, &self.stage2, &self.target);
        let nodes = self.grid.nodes;
        for (section, key, found, expected) in [
            ("stage1", "position_rtn_m", one.position.len(), nodes),
            ("stage1", "velocity_rtn_m_s", one.velocity.len(), nodes),
            ("stage1", "force_rtn_n", one.force.len(), nodes - 1),
            ("stage2", "attitude_body_to_rtn", two.attitude.len(), nodes),
            ("stage2", "joint_angle_rad", two.joint_angle.len(), nodes),
            ("stage2", "rate_rtn_rad_s", two.rate.len(), nodes),
            ("stage2", "joint_rate_rad_s", two.joint_rate.len(), nodes),
            ("stage2", "bus_torque_body_n_m", two.bus_torque.len(), nodes - 1),
            ("stage2", "joint_torque_n_m", two.joint_torque.len(), nodes - 1),
            ("target", "attitude_body_to_rtn", target.attitude.len(), nodes),
            ("target", "rate_rtn_rad_s", target.rate.len(), nodes),
        ] {
            if found != expected {
                let reason = format!("has {found} rows; the horizon has {expected}");
                return Err(FieldError::new(format!("{section}.{key}"), reason));
            }
        }
        self.check_joints()
    }

    /// Rows of joints have as many numbers as the mission has joints.
    fn check_joints(&self) -> Result<(), FieldError> {
        let two = &self.stage2;
        let joints = self.inputs.mission.joints();
        for (key, rows) in [
            ("joint_angle_rad", &two.joint_angle),
            ("joint_rate_rad_s", &two.joint_rate),
            ("joint_torque_n_m", &two.joint_torque),
        ] {
            if let Some(k) = rows.iter().position(|row| row.len() != joints) {
                let reason = format!("has {} numbers; the arm has {joints} joints", rows[k].len());
                return Err(FieldError::new(format!("stage2.{key}[{k}]"), reason));
            }
        }
        Ok(())
    }

    fn check_numbers(&self) -> Result<(), FieldError> {
        let (one, two) = (&self.stage1, &self.stage2);
        for (field, value) in [
            ("stage1.cost", one.cost),
            ("stage1.time_s", one.time_s),
            ("stage2.cost", two.cost),
            ("stage2.time_s", two.time_s),
            ("stage2.inference_s", two.inference_s),
            ("time_s", self.time_s.unwrap_or(0.0)),
            ("cpu_time_s", self.cpu_time_s.unwrap_or(0.0)),
        ] {
            if value < 0.0 {
                return Err(FieldError::new(field, format!("must not be negative, is {value}")));
            }
        }
        check_residuals(&self.residuals)
    }
}

fn check_residuals(residuals: &Residuals) -> Result<(), FieldError> {
    for (name, value, _) in residuals.against(&Default::default()) {
        if value < 0.0 {
            let reason = format!("must not be negative, is {value}");
            return Err(FieldError::new(format!("residuals.{name}"), reason));
        }
    }
    Ok(())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::formats::{
        Mission, MissionFile, Motion, PlanGrid, PlanInputs, PlanStage1, PlanStage2, PlanTarget,
        Program, Scenario, ScenarioSet, StageEnd, Status, Verdict,
    };
    use crate::method::{Integrator, Mode};
    use remora_core::advanced::model::TargetState;
    use remora_core::advanced::stages::{Clearances, Closest, NODES, TranslationTrajectory};

    pub(crate) fn plan() -> PlanFile {
        let residuals = Residuals { dynamics1: 1e-9, ee_angle: 2e-9, ..Default::default() };
        let status = Status::Solved;
        let arm = Closest { distance: -0.01, time_s: 612.5, body: 3 };
        let clearances = Clearances { arm, bus: Closest::NONE, own: Closest::NONE };
        let end = StageEnd { status, iterations: 9, cost: 0.2, time_s: 0.1 };
        let scenario = &ScenarioSet::built_in().unwrap().scenarios[0];
        PlanFile {
            format: FORMAT.into(),
            program: Some(Program::this()),
            scenario: "a".into(),
            inputs: PlanInputs::new(&Mission::default(), scenario, Integrator::RK4),
            grid: PlanGrid::of(&Mission::default(), &Scenario::default()),
            frames: None,
            time_s: Some(0.25),
            cpu_time_s: None,
            status,
            mode: Mode::Optimal,
            warm_start: "heuristic".into(),
            qp: "clarabel".into(),
            integrator: Integrator::RK4,
            stage1: PlanStage1::new(end, NODES, &TranslationTrajectory::ZERO),
            stage2: PlanStage2::new(end, 0.0, NODES, Mission::default().joints(), &Motion::ZERO),
            target: PlanTarget::from([TargetState::ZERO; NODES].as_slice()),
            residuals,
            verdict: Some(Verdict::Optimal),
            clearances: Some(clearances),
        }
    }

    #[test]
    fn plans_survive_a_round_trip_and_have_the_contracts_rows() {
        let plan = plan();
        let text = json::to_text(&plan).unwrap();
        assert_eq!(PlanFile::parse(&text).unwrap(), plan);
        assert_eq!((plan.stage1.position.len(), plan.stage1.force.len()), (60, 59));
        assert_eq!((plan.stage2.attitude.len(), plan.stage2.joint_torque.len()), (60, 59));
        assert_eq!(plan.stage2.trajectory(), Motion::ZERO);
    }

    /// JSON and packet hold the same plan, and either is read whatever its file is called.
    #[test]
    fn a_packet_holds_the_same_plan() {
        let dir = tempfile::tempdir().unwrap();
        let (json, packet) = (dir.path().join("a.plan.json"), dir.path().join("a.plan.postcard"));
        let mut heavy = MissionFile::default();
        heavy.target.mass_kg += 1.0;
        let mission = heavy.mission().unwrap();
        let mut scenario = ScenarioSet::built_in().unwrap().scenarios[3].clone();
        scenario.servicer.joint_angle_rad = Some(vec![-0.5, 0.4, 0.3]);
        scenario.duration_s = Some(1100.0);
        let inputs = PlanInputs::new(&mission, &scenario, Integrator::RK4);
        let grid = PlanGrid::of(&mission, &scenario.scenario());
        let usual = PlanFile { frames: Some(crate::formats::frames()), ..plan() };
        let moved = PlanFile { inputs, grid, ..usual.clone() };
        let moved = PlanFile { verdict: None, clearances: None, ..moved };
        for plan in [usual, moved] {
            plan.write(&json).unwrap();
            plan.write(&packet).unwrap();
            let [from_json, from_packet] =
                [&json, &packet].map(|file| PlanFile::read(file).unwrap());
            assert!(from_json == plan && from_packet == plan);
            let size = std::fs::metadata(&packet).unwrap().len();
            assert!((17_000..19_000).contains(&size), "{size}");
        }
    }

    // Verifies REM-IO-005.
    #[test]
    fn damage_to_a_packet_is_named() {
        let whole = plan().to_packet().unwrap();
        let reason = |change: &dyn Fn(&mut Vec<u8>)| {
            let mut bytes = whole.clone();
            change(&mut bytes);
            PlanFile::from_bytes(&bytes).unwrap_err().reason
        };
        assert_eq!(reason(&|b| b[3000] ^= 1), "is damaged: its CRC-32 does not match");
        assert_eq!(reason(&|b| b.truncate(500)), "is damaged: its CRC-32 does not match");
        assert_eq!(reason(&|b| b.truncate(3)), "expected value at line 1 column 1");
        assert_eq!(reason(&|b| b[7] = b'E'), "is not a plan");
        // A number that is not finite must be refused, not turned into one that is.
        let mut plan = plan();
        plan.stage1.position[7][1] = f64::NAN;
        let error = PlanFile::from_bytes(&plan.to_packet().unwrap()).unwrap_err();
        assert_eq!(error.field, "stage1.position_rtn_m[7][1]");
    }

    #[test]
    fn what_was_not_verified_in_time_is_infinite_and_null_in_the_file() {
        let unfinished = PlanFile { residuals: Residuals::UNFINISHED, ..plan() };
        let text = json::to_text(&unfinished).unwrap();
        let mut fields: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert!(fields["residuals"]["dynamics1"].is_null());
        assert_eq!(PlanFile::parse(&text).unwrap(), unfinished);
        fields["residuals"].as_object_mut().unwrap().remove("dynamics1");
        assert_eq!(PlanFile::parse(&fields.to_string()).unwrap_err().field, "residuals");
    }

    #[test]
    fn each_kind_of_nonsense_is_named() {
        let field = |change: fn(&mut PlanFile)| {
            let mut plan = plan();
            change(&mut plan);
            PlanFile::parse(&json::to_text(&plan).unwrap()).unwrap_err().field
        };
        assert_eq!(field(|p| p.format = "remora-plan/9".into()), "format");
        assert_eq!(field(|p| p.scenario = "a/b".into()), "scenario");
        assert_eq!(field(|p| p.stage1.force.truncate(58)), "stage1.force_rtn_n");
        assert_eq!(field(|p| p.stage2.joint_rate.clear()), "stage2.joint_rate_rad_s");
        assert_eq!(field(|p| p.stage1.position[7][1] = f64::NAN), "stage1.position_rtn_m[7][1]");
        assert_eq!(field(|p| p.stage2.attitude[5][0] = 2.0), "stage2.attitude_body_to_rtn[5]");
        assert_eq!(field(|p| p.target.attitude[59] = [0.0; 4]), "target.attitude_body_to_rtn[59]");
        assert_eq!(field(|p| p.stage2.time_s = -1.0), "stage2.time_s");
        assert_eq!(field(|p| p.residuals.preset = -1.0), "residuals.preset");
        assert_eq!(field(|p| p.grid.preset_node = 7), "grid.preset_node");
        assert_eq!(field(|p| p.grid.dt_s *= 1.001), "grid.dt_s");
        let field = |change: fn(&mut PlanInputs)| {
            let mut plan = plan();
            change(&mut plan.inputs);
            PlanFile::parse(&json::to_text(&plan).unwrap()).unwrap_err().field
        };
        let checksum = "inputs.scenario_checksum";
        assert_eq!(field(|i| i.scenario.target_rate_body_rad_s[1] += 1e-12), checksum);
        assert_eq!(field(|i| i.mission.target.mass_kg += 1.0), "inputs.mission_checksum");
        assert_eq!(field(|i| i.mission.target.mass_kg = -1.0), "inputs.mission.target.mass_kg");
        let attitude = "inputs.scenario.target_attitude_body_to_rtn";
        assert_eq!(field(|i| i.scenario.target_attitude_body_to_rtn = [1.0; 4]), attitude);
        let text = json::to_text(&plan()).unwrap();
        let field =
            |from: &str, to: &str| PlanFile::parse(&text.replace(from, to)).unwrap_err().field;
        assert_eq!(field("\"rk4\"", "\"rk4:2\""), "integrator");
        assert_eq!(field("\"keep_out\"", "\"keepout\""), "residuals.keepout");
        assert_eq!(field("\"status\": \"solved\"", "\"status\": \"fine\""), "status");
        assert_eq!(field("\"verdict\": \"optimal\"", "\"verdict\": \"good\""), "verdict");
        assert_eq!(field("\"body\": 3", "\"body\": -1"), "clearances.arm.body");
        for key in ["inputs", "grid"] {
            let mut plan: serde_json::Value = serde_json::from_str(&text).unwrap();
            plan.as_object_mut().unwrap().remove(key).unwrap();
            let error = PlanFile::parse(&plan.to_string()).unwrap_err();
            assert!(error.reason.contains(&format!("missing field `{key}`")), "{error:?}");
        }
    }
}
