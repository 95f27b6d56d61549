//! The files the program reads and writes, one module a format, and how files are written.
//!
//! A reader refuses what it does not understand with the file, the field and the reason: an
//! unknown `format`, an unknown field, a number that is not one, a quaternion that is not of unit
//! length. A writer writes beside the file and renames, so that no file is ever half written.

mod evidence_file;
mod input;
pub mod json;
mod json_text;
mod kind;
mod lock;
mod mission;
mod mission_capture;
mod mission_file;
mod mission_sections;
mod mission_servicer;
#[cfg(test)]
mod mission_tests;
mod model_file;
mod nearest;
mod nodes;
mod output;
mod packet;
mod plan_convert;
mod plan_file;
mod plan_inputs;
mod plan_read;
mod quantities;
mod radius;
mod results;
mod results_about;
mod row;
mod scenario_set;
mod strict;
mod table;
pub mod toml_text;
mod unit;

pub use evidence_file::{
    EvidenceFile, FORMAT as EVIDENCE_FORMAT, ModelRecord, evidence_path, plan_stem, recovered,
};
pub use input::{Limit, as_text, open_regular, open_to_write, read_bytes, read_text};
pub use kind::{Kind, is_named_packet};
pub use lock::{lock, lock_shared};
use mission::each;
pub use mission::{
    JointVector, MAX_JOINTS, Mission, Motion, PLANNED_JOINTS, Scenario, check_arm, resized_control,
    resized_motion, resized_state,
};
pub use mission_capture::capture_search;
pub use mission_file::{FORMAT as MISSION_FORMAT, MissionFile, read_mission, read_mission_file};
pub use mission_sections::{
    Approach as MissionApproach, Horizon as MissionHorizon, Orbit as MissionOrbit,
    name_of as body_name,
};
pub use mission_servicer::{Capture as MissionCapture, Servicer as MissionServicer};
pub use model_file::{ModelBuilder, ModelFile, NamedTensor, Values, model_layout};
pub use nearest::Nearest;
pub use nodes::{ABOUT_NODES, node_columns, node_numbers, node_row};
pub use output::{
    check_writable, make_directory, remove_file, remove_partials, remove_partials_among,
    remove_partials_of, write_as_it_comes, write_atomically, write_first, write_together,
};
pub use plan_convert::StageEnd;
pub use plan_file::{FORMAT as PLAN_FORMAT, PlanFile, PlanStage1, PlanStage2, PlanTarget};
pub use plan_inputs::{
    InForce, MadeFor, PlanGrid, PlanInputs, PlanScenario, Program, VERSION, checksum_of_mission,
    checksum_of_scenario, frames,
};
pub use quantities::{Limits, Stops};
pub use radius::Radius;
/// The core's own types stand in files.
pub use remora_core::advanced::{
    planner::{Fallback, GuessRecord, StageSolveRecord, Verdict},
    scp::Status,
    stages::{ArmClearances, Clearances, Closest, Residuals},
};
pub use results::{COLUMNS, TableOrigin, columns, csv, csv_metadata, parquet_bytes};
pub use results_about::{TIMES, about};
pub use row::{Flight, Row, StageRow, residual_limits};
pub use scenario_set::{
    FORMAT as SCENARIO_FORMAT, NamedScenario, ScenarioSet, ServicerStart, TargetStart,
};
pub use table::{Cell, Column, TableWriter, parquet as parquet_table};
pub use unit::QUATERNION_TOLERANCE;

use crate::error::FieldError;

/// Refuses an id that could not be part of a file name everywhere.
pub fn check_id(id: &str, field: impl FnOnce() -> String) -> Result<(), FieldError> {
    let safe = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let starts = id.starts_with(|c: char| c.is_ascii_alphanumeric());
    if starts && id.len() <= 64 && id.chars().all(safe) {
        return Ok(());
    }
    let reason = "an id is 1 to 64 letters, digits, '-', '_' or '.', the first a letter or digit";
    Err(FieldError::new(field(), format!("{id:?}: {reason}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn damaged(text: &str, at: prop::sample::Index, with: char) -> String {
        let at = at.index(text.len());
        text.char_indices().map(|(i, c)| if i == at { with } else { c }).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        /// Whatever a file holds, its reader answers: never a panic, never a value unchecked.
        // Verifies REM-IO-001.
        #[test]
        fn readers_survive_damage(at: prop::sample::Index, with: char) {
            let set = ScenarioSet::built_in().unwrap();
            let set = json::to_text(&ScenarioSet::new(set.scenarios[..2].to_vec())).unwrap();
            if let Ok(set) = ScenarioSet::parse(&damaged(&set, at, with)) {
                prop_assert!(set.scenarios.iter().all(|s| s.scenario().position.amax() <= 1e6));
            }
            let mission = include_str!("../../../../fixtures/missions/default.mission.toml");
            let mission = damaged(mission, at, with);
            if let Ok(mission) = MissionFile::parse(&mission).and_then(|file| file.mission()) {
                prop_assert!(mission.validate().is_ok());
            }
            let evidence = json::to_text(&evidence_file::tests::record(true)).unwrap();
            if let Ok(record) = EvidenceFile::parse(&damaged(&evidence, at, with)) {
                prop_assert_eq!(record.output.len(), 16);
            }
            let plan = json::to_text(&plan_read::tests::plan()).unwrap();
            if let Ok(plan) = PlanFile::parse(&damaged(&plan, at, with)) {
                prop_assert!(plan.stage1.position.as_flattened().iter().all(|x| x.is_finite()));
            }
        }

        /// Packets too, whose checksum somebody has made right.
        // Verifies REM-IO-001.
        #[test]
        fn packets_survive_damage(at: prop::sample::Index, with: u8, cut: prop::sample::Index) {
            let forged = |mut bytes: Vec<u8>| {
                bytes.truncate(bytes.len() - 4);
                let at = at.index(bytes.len());
                bytes[at] ^= with;
                if with == 0 {
                    bytes.truncate(cut.index(bytes.len()));
                }
                let crc = remora_core::advanced::nn::Crc32::of(&bytes);
                bytes.extend(crc.to_le_bytes());
                bytes
            };
            if let Ok(plan) = PlanFile::from_bytes(&forged(plan_read::tests::plan().to_packet().unwrap())) {
                prop_assert!(plan.stage1.position.as_flattened().iter().all(|x| x.is_finite()));
            }
            let record = evidence_file::tests::record(true).to_packet().unwrap();
            if let Ok(record) = EvidenceFile::from_bytes(&forged(record)) {
                prop_assert_eq!(record.output.len(), 16);
            }
        }
    }
}
