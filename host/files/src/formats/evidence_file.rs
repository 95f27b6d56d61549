//! Evidence beside a plan: `*.evidence.json`.

use super::kind::{is_named_packet, is_packet};
use super::{Limit, Status, Verdict, as_text, json, read_bytes};
use crate::error::{Error, FieldError};
use remora_core::advanced::model::RECOVERY_NAMES;
use remora_core::advanced::planner::{GuessRecord, SolveRecord, StageSolveRecord};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The `format` of evidence.
pub const FORMAT: &str = "remora-evidence/2";

/// Inputs, program and result of a plan. It holds no times, so that equal plans have equal
/// files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a record of evidence")]
pub struct EvidenceFile {
    /// [`FORMAT`].
    pub format: String,
    /// Id of the scenario.
    pub scenario: String,
    /// Version of the core that planned.
    pub core_version: String,
    /// Version of the program around it.
    pub host_version: String,
    /// Solver of the subproblems.
    pub qp: String,
    /// Checksum of mission and scenario: 16 hexadecimal digits.
    pub input: String,
    /// Checksum of options and solvers' settings.
    pub settings: String,
    /// Checksum of the plan's trajectories.
    pub output: String,
    /// Status of the plan.
    pub status: Status,
    /// Whether the verifier found every residual within its tolerance.
    pub is_verified: bool,
    /// Verdict: whether the plan is optimal, verified or not flyable.
    pub verdict: Verdict,
    /// Limits that the scenario's start violates and the plan leads back into, by the residuals' names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub recovered: Vec<String>,
    /// Initial guess of Stage 2.
    pub start: GuessRecord,
    /// Model that was to be used; none where the heuristic was asked for.
    pub model: Option<ModelRecord>,
    /// Stage 1.
    pub stage1: StageSolveRecord,
    /// Stage 2.
    pub stage2: StageSolveRecord,
}

/// A model, and why it was refused if it was.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the record of a model")]
pub struct ModelRecord {
    /// File name, or the name of a built-in model.
    pub name: String,
    /// CRC-32 of the file's bytes but its own: 8 hexadecimal digits.
    pub checksum: String,
    /// Reason why it cannot be used.
    pub refused: Option<String>,
}

impl EvidenceFile {
    /// The file of a plan's evidence.
    pub fn new(
        scenario: &str,
        qp: &str,
        model: Option<ModelRecord>,
        evidence: &SolveRecord,
    ) -> Self {
        let checksum = |value: u64| format!("{value:016x}");
        Self {
            format: FORMAT.into(),
            scenario: scenario.into(),
            core_version: evidence.version.into(),
            host_version: env!("CARGO_PKG_VERSION").into(),
            qp: qp.into(),
            input: checksum(evidence.input),
            settings: checksum(evidence.settings),
            output: checksum(evidence.output),
            status: evidence.status,
            is_verified: evidence.is_verified,
            verdict: Verdict::of(evidence.is_verified, evidence.status),
            recovered: recovered(evidence.recovery),
            start: evidence.start,
            model,
            stage1: evidence.translation,
            stage2: evidence.reorientation,
        }
    }

    /// Reads and validates a file.
    ///
    /// # Errors
    /// The file, the field and the reason why it is refused.
    pub fn read(file: &Path) -> Result<Self, Error> {
        let bytes = read_bytes(file, Limit::DOCUMENT)?;
        Self::from_bytes(&bytes).map_err(|error| error.at(file))
    }

    /// Parses and validates what a file holds, JSON or [a packet](EvidenceFile::to_packet).
    ///
    /// # Errors
    /// The first field that is refused; a packet that is damaged.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, FieldError> {
        match is_packet(bytes) {
            true => {
                let record = Self::from_packet(bytes)?;
                record.validate().map(|()| record)
            }
            false => Self::parse(as_text(bytes)?),
        }
    }

    /// Parses and validates a file's text.
    ///
    /// # Errors
    /// The first field that is refused.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        let record: Self = json::parse(text, FORMAT)?;
        record.validate()?;
        Ok(record)
    }

    fn validate(&self) -> Result<(), FieldError> {
        super::check_id(&self.scenario, || "scenario".into())?;
        let model = self.model.as_ref().map(|model| ("model.checksum", &model.checksum, 8));
        let sums = [
            ("input", &self.input, 16),
            ("settings", &self.settings, 16),
            ("output", &self.output, 16),
        ];
        for (field, sum, digits) in sums.into_iter().chain(model) {
            let digit = |c: char| matches!(c, '0'..='9' | 'a'..='f');
            if sum.len() != digits || !sum.chars().all(digit) {
                return Err(FieldError::new(
                    field,
                    format!("expected {digits} hexadecimal digits"),
                ));
            }
        }
        Ok(())
    }

    /// Writes the file, whole or not at all; as a packet where its name ends in `.postcard`.
    ///
    /// # Errors
    /// The file with the reason why it cannot be written.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        super::write_atomically(file, &self.bytes(file)?)
    }

    /// Writes a plan and this, its evidence, beside it: both or neither.
    ///
    /// # Errors
    /// The file that cannot be written.
    pub fn write_with(&self, plan: &super::PlanFile, file: &Path) -> Result<(), Error> {
        let own = evidence_path(file);
        super::write_together(&[(&own, self.bytes(&own)?), (file, plan.bytes(file)?)])
    }

    fn bytes(&self, file: &Path) -> Result<Vec<u8>, Error> {
        let failed = |reason: String| Error::Output { file: file.into(), reason };
        Ok(match is_named_packet(file) {
            true => self.to_packet().map_err(|error| failed(error.reason))?,
            false => json::to_text(self).map_err(|error| failed(error.to_string()))?.into_bytes(),
        })
    }
}

/// Where the evidence of a plan file stands: `a.evidence.json` beside `a.plan.json`, and a packet beside
/// a packet.
pub fn evidence_path(plan: &Path) -> PathBuf {
    let kind = if is_named_packet(plan) { "postcard" } else { "json" };
    plan.with_file_name(format!("{}.evidence.{kind}", plan_stem(plan)))
}

/// Stem of a plan file's name, for the names of files beside it.
pub fn plan_stem(plan: &Path) -> String {
    let name = plan.file_name().unwrap_or_default().to_string_lossy();
    let ends = [".plan.json", ".plan.postcard", ".json", ".postcard"];
    let stem = ends.into_iter().find_map(|end| name.strip_suffix(end));
    stem.unwrap_or(&name).to_string()
}

/// Names of the limits that a record says the plan leads back into.
pub fn recovered(code: u32) -> Vec<String> {
    let named = RECOVERY_NAMES.iter().enumerate();
    named.filter(|(bit, _)| code >> bit & 1 == 1).map(|(_, name)| name.to_string()).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use remora_core::advanced::planner::Fallback;

    pub(crate) fn record(is_refused: bool) -> EvidenceFile {
        let evidence = SolveRecord {
            version: "1.2.3",
            input: 1,
            settings: u64::MAX,
            output: 0xfeed,
            status: Status::Deadline,
            is_verified: true,
            recovery: 0b0110,
            start: GuessRecord::Worse,
            translation: Default::default(),
            reorientation: StageSolveRecord {
                fallback: Fallback::EarlierIterate,
                ..Default::default()
            },
        };
        let model = ModelRecord {
            name: "b.model".into(),
            checksum: "01234567".into(),
            refused: is_refused.then(|| "is too old".into()),
        };
        EvidenceFile::new("a", "embedded", Some(model), &evidence)
    }

    #[test]
    fn evidence_survives_a_round_trip() {
        for is_refused in [false, true] {
            let record = record(is_refused);
            let text = json::to_text(&record).unwrap();
            assert_eq!(EvidenceFile::parse(&text).unwrap(), record);
            assert!(text.contains("\"output\": \"000000000000feed\""), "{text}");
            assert!(text.contains("\"fallback\": \"earlier_iterate\""), "{text}");
            assert_eq!(record.recovered, ["joint_rate", "pointing"]);
            let packet = record.to_packet().unwrap();
            assert_eq!(EvidenceFile::from_bytes(&packet).unwrap(), record);
            assert!(packet.len() < 120, "{}", packet.len());
        }
    }

    #[test]
    fn a_record_says_its_verdict_and_nothing_unknown() {
        let mut record = serde_json::to_value(record(true)).unwrap();
        assert_eq!(record["verdict"], "verified_not_converged");
        record["gains"] = serde_json::json!([[[0.5]]]);
        assert_eq!(EvidenceFile::parse(&record.to_string()).unwrap_err().field, "gains");
        let entries = record.as_object_mut().unwrap();
        entries.remove("gains");
        entries.remove("verdict");
        let error = EvidenceFile::parse(&record.to_string()).unwrap_err();
        assert!(error.reason.contains("missing field `verdict`"), "{}", error.reason);
    }

    #[test]
    fn each_kind_of_nonsense_is_named() {
        let field = |change: fn(&mut EvidenceFile)| {
            let mut record = record(true);
            change(&mut record);
            EvidenceFile::parse(&json::to_text(&record).unwrap()).unwrap_err().field
        };
        assert_eq!(field(|r| r.format = "remora-evidence/3".into()), "format");
        assert_eq!(field(|r| r.output = "12".into()), "output");
        assert_eq!(field(|r| r.input = "000000000000FEED".into()), "input");
        let short = |r: &mut EvidenceFile| r.model.iter_mut().for_each(|m| m.checksum.truncate(7));
        assert_eq!(field(short), "model.checksum");
    }

    #[test]
    fn evidence_stands_beside_its_plan() {
        let beside = |plan: &str| evidence_path(Path::new(plan)).display().to_string();
        assert_eq!(beside("a/b.plan.json"), "a/b.evidence.json");
        assert_eq!(beside("b.json"), "b.evidence.json");
        assert_eq!(beside("b"), "b.evidence.json");
        assert_eq!(beside("a/b.plan.postcard"), "a/b.evidence.postcard");
    }
}
