//! Plans and evidence in postcard: what a spacecraft sends down. The same numbers as in JSON, bit by bit,
//! in a third of the bytes; every command that reads the one reads the other.
//!
//! Magic bytes, then the fields below in their order, then a CRC-32 of all that precedes. What a packet
//! holds is put into the words of the JSON file and judged as that is.

use super::evidence_file::{EvidenceFile, ModelRecord};
use super::kind::{EVIDENCE_MAGIC, PLAN_MAGIC};
use super::plan_file::{PlanFile, PlanStage1, PlanStage2, PlanTarget};
use super::plan_inputs::{InForce, PlanGrid, PlanInputs, PlanScenario, Program, frames};
use super::{
    Clearances, Closest, EVIDENCE_FORMAT, GuessRecord, MissionFile, PLAN_FORMAT, Residuals,
    StageSolveRecord, Status, Verdict,
};
use crate::error::FieldError;
use crate::method::{Integrator, Mode};
use remora_core::advanced::nn::Crc32;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Version of both packets.
const VERSION: u16 = 1;

fn encode(magic: &[u8; 8], fields: &impl Serialize) -> Result<Vec<u8>, FieldError> {
    let failed = |error: postcard::Error| FieldError::new("", error.to_string());
    let head = postcard::to_extend(&VERSION, magic.to_vec()).map_err(failed)?;
    let mut bytes = postcard::to_extend(fields, head).map_err(failed)?;
    bytes.extend(Crc32::of(&bytes).to_le_bytes());
    Ok(bytes)
}

fn decode<T: DeserializeOwned>(magic: &[u8; 8], what: &str, bytes: &[u8]) -> Result<T, FieldError> {
    let refused = |reason: String| FieldError::new("", reason);
    let (body, crc) = bytes.split_last_chunk().ok_or_else(|| refused("is truncated".into()))?;
    let fields = body.strip_prefix(magic).ok_or_else(|| refused(format!("is not {what}")))?;
    if Crc32::of(body) != u32::from_le_bytes(*crc) {
        return Err(refused("is damaged: its CRC-32 does not match".into()));
    }
    let broken = |error: postcard::Error| refused(format!("is not {what}: {error}"));
    let (version, fields) = postcard::take_from_bytes::<u16>(fields).map_err(broken)?;
    if version != VERSION {
        let reason = format!("is of version {version}; this reader understands {VERSION}");
        return Err(refused(reason));
    }
    match postcard::take_from_bytes(fields).map_err(broken)? {
        (found, []) => Ok(found),
        (_, rest) => Err(refused(format!("has {} bytes behind {what}", rest.len()))),
    }
}

/// A plan.
#[derive(Serialize, Deserialize)]
struct PlanPacket {
    program: Option<Program>,
    scenario: String,
    status: Status,
    verdict: Option<Verdict>,
    mode: Mode,
    warm_start: String,
    qp: String,
    integrator: Integrator,
    time_s: Option<f64>,
    cpu_time_s: Option<f64>,
    inputs: Option<InputsPacket>,
    grid: Option<PlanGrid>,
    stage1: PlanStage1,
    stage2: PlanStage2,
    target: PlanTarget,
    residuals: [f64; Residuals::COUNT],
    /// Distance, time, body: of arm, bus and own.
    clearances: Option<[(f64, f64, u32); 3]>,
}

/// Inputs of a plan: scenario and mission, with their checksums.
#[derive(Serialize, Deserialize)]
struct InputsPacket {
    #[serde(with = "ScenarioPacket")]
    scenario: PlanScenario,
    scenario_checksum: String,
    /// TOML of what differs from the built-in mission.
    mission: String,
    mission_checksum: String,
    in_force: InForce,
}

/// [`PlanScenario`], whose own names leave out what is not given; postcard has no names.
#[derive(Serialize, Deserialize)]
#[serde(remote = "PlanScenario")]
struct ScenarioPacket {
    target_attitude_body_to_rtn: [f64; 4],
    target_rate_body_rad_s: [f64; 3],
    servicer_position_rtn_m: [f64; 3],
    servicer_velocity_rtn_m_s: [f64; 3],
    bus_attitude_body_to_rtn: Option<[f64; 4]>,
    bus_rate_rtn_rad_s: Option<[f64; 3]>,
    joint_angle_rad: Option<Vec<f64>>,
    joint_rate_rad_s: Option<Vec<f64>>,
    duration_s: Option<f64>,
    nodes: Option<usize>,
}

/// A record of evidence.
#[derive(Serialize, Deserialize)]
struct EvidencePacket {
    scenario: String,
    core_version: String,
    host_version: String,
    qp: String,
    /// Checksums of inputs, settings and output.
    checksums: [u64; 3],
    status: Status,
    is_verified: bool,
    verdict: Option<Verdict>,
    recovered: Vec<String>,
    start: GuessRecord,
    model: Option<ModelRecord>,
    stages: [StageSolveRecord; 2],
}

impl PlanFile {
    /// The plan as a packet: about 18 kB for 60 nodes, three joints and the built-in mission.
    ///
    /// # Errors
    /// None, as long as the tests pass.
    pub fn to_packet(&self) -> Result<Vec<u8>, FieldError> {
        let clearances = self.clearances.map(|clearances| {
            clearances.named().map(|(_, pair)| (pair.distance, pair.time_s, pair.body))
        });
        let plan = self.clone();
        let packet = PlanPacket {
            program: plan.program,
            scenario: plan.scenario,
            status: plan.status,
            verdict: plan.verdict,
            mode: plan.mode,
            warm_start: plan.warm_start,
            qp: plan.qp,
            integrator: plan.integrator,
            time_s: plan.time_s,
            cpu_time_s: plan.cpu_time_s,
            inputs: Some(InputsPacket::new(plan.inputs)?),
            grid: Some(plan.grid),
            stage1: plan.stage1,
            stage2: plan.stage2,
            target: plan.target,
            residuals: plan.residuals.against(&Default::default()).map(|(_, value, _)| value),
            clearances,
        };
        encode(PLAN_MAGIC, &packet)
    }

    /// The plan of a packet, not validated yet.
    pub(super) fn from_packet(bytes: &[u8]) -> Result<Self, FieldError> {
        let packet: PlanPacket = decode(PLAN_MAGIC, "a plan", bytes)?;
        let missing = |field: &str| FieldError::new(field, "is missing");
        let inputs = packet.inputs.ok_or_else(|| missing("inputs"))?.read()?;
        let grid = packet.grid.ok_or_else(|| missing("grid"))?;
        let pair = |(distance, time_s, body)| Closest { distance, time_s, body };
        let clearances = packet.clearances.map(|pairs| pairs.map(pair));
        Ok(Self {
            format: PLAN_FORMAT.into(),
            program: packet.program,
            scenario: packet.scenario,
            status: packet.status,
            verdict: packet.verdict,
            mode: packet.mode,
            warm_start: packet.warm_start,
            qp: packet.qp,
            integrator: packet.integrator,
            time_s: packet.time_s,
            cpu_time_s: packet.cpu_time_s,
            inputs,
            grid,
            frames: Some(frames()),
            stage1: packet.stage1,
            stage2: packet.stage2,
            target: packet.target,
            residuals: residuals(packet.residuals),
            clearances: clearances.map(|[arm, bus, own]| Clearances { arm, bus, own }),
        })
    }
}

/// Residuals of their values in the order of the plan file.
fn residuals(values: [f64; Residuals::COUNT]) -> Residuals {
    let [dynamics1, keep_out, dynamics2, control, joint, joint_rate, values @ ..] = values;
    let [pointing, preset, terminal_rate, ee_position, ee_angle, clearance] = values;
    Residuals {
        dynamics1,
        keep_out,
        dynamics2,
        control,
        joint,
        joint_rate,
        pointing,
        preset,
        terminal_rate,
        ee_position,
        ee_angle,
        clearance,
    }
}

impl InputsPacket {
    fn new(inputs: PlanInputs) -> Result<Self, FieldError> {
        let PlanInputs { scenario, scenario_checksum, mission, mission_checksum, in_force } =
            inputs;
        let mission = changes(&mission)?;
        Ok(Self { scenario, scenario_checksum, mission, mission_checksum, in_force })
    }

    fn read(self) -> Result<PlanInputs, FieldError> {
        let Self { scenario, scenario_checksum, mission, mission_checksum, in_force } = self;
        let mission = MissionFile::parse(&mission).map_err(|error| {
            FieldError::new(format!("inputs.mission.{}", error.field), error.reason)
        })?;
        Ok(PlanInputs { scenario, scenario_checksum, mission, mission_checksum, in_force })
    }
}

/// A mission as the TOML of what differs from the built-in one; all of it where that does not say it.
fn changes(mission: &MissionFile) -> Result<String, FieldError> {
    let text = |mission: &MissionFile| {
        let failed = |error: toml::ser::Error| FieldError::new("inputs.mission", error.to_string());
        crate::formats::toml_text::to_text(mission).map_err(failed)
    };
    let table = |text: &str| text.parse::<toml::Table>().unwrap_or_default();
    let (whole, built_in) = (text(mission)?, text(&MissionFile::default())?);
    let changed = differing(table(&whole), &table(&built_in)).to_string();
    match MissionFile::parse(&changed) {
        Ok(read) if read == *mission => Ok(changed),
        _ => Ok(whole),
    }
}

/// The entries of a table that are others in `base`, or not there.
fn differing(table: toml::Table, base: &toml::Table) -> toml::Table {
    let differs = |(key, value): (String, toml::Value)| match (value, base.get(&key)) {
        (toml::Value::Table(table), Some(toml::Value::Table(base))) => {
            let inner = differing(table, base);
            (!inner.is_empty()).then(|| (key, inner.into()))
        }
        (value, there) => (there != Some(&value)).then_some((key, value)),
    };
    table.into_iter().filter_map(differs).collect()
}

impl EvidenceFile {
    /// The record as a packet: some hundred bytes.
    ///
    /// # Errors
    /// A checksum that is none.
    pub fn to_packet(&self) -> Result<Vec<u8>, FieldError> {
        let sum = |field: &str, digits: &str| {
            u64::from_str_radix(digits, 16)
                .map_err(|_| FieldError::new(field, "expected 16 hexadecimal digits"))
        };
        let record = self.clone();
        let packet = EvidencePacket {
            checksums: [
                sum("input", &record.input)?,
                sum("settings", &record.settings)?,
                sum("output", &record.output)?,
            ],
            scenario: record.scenario,
            core_version: record.core_version,
            host_version: record.host_version,
            qp: record.qp,
            status: record.status,
            is_verified: record.is_verified,
            verdict: Some(record.verdict),
            recovered: record.recovered,
            start: record.start,
            model: record.model,
            stages: [record.stage1, record.stage2],
        };
        encode(EVIDENCE_MAGIC, &packet)
    }

    /// The record of a packet, not validated yet.
    pub(super) fn from_packet(bytes: &[u8]) -> Result<Self, FieldError> {
        let packet: EvidencePacket = decode(EVIDENCE_MAGIC, "a record of evidence", bytes)?;
        let [input, settings, output] = packet.checksums.map(|sum| format!("{sum:016x}"));
        let [stage1, stage2] = packet.stages;
        let missing = || FieldError::new("verdict", "is missing");
        let verdict = packet.verdict.ok_or_else(missing)?;
        Ok(Self {
            format: EVIDENCE_FORMAT.into(),
            scenario: packet.scenario,
            core_version: packet.core_version,
            host_version: packet.host_version,
            qp: packet.qp,
            input,
            settings,
            output,
            status: packet.status,
            is_verified: packet.is_verified,
            verdict,
            recovered: packet.recovered,
            start: packet.start,
            model: packet.model,
            stage1,
            stage2,
        })
    }
}
