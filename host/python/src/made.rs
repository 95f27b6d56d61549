//! Sources of plans: made here, read from files, or sent from elsewhere.

use crate::mission::Mission;
use crate::plan::Plan;
use crate::raised::argument;
use crate::start::Start;
use pyo3::prelude::*;
use remora_core::advanced::planner::Nominal;
use remora_core::advanced::stages::Clearances;
use remora_host::engine::verified;
use remora_host::error::{Error, FieldError};
use remora_host::formats::{
    EvidenceFile, MAX_JOINTS, MadeFor, NamedScenario, PlanFile, PlanGrid, Verdict, evidence_path,
};
use remora_host::method::{Method, Qp, WarmStart};
use remora_host::planning::PlanOutcome;
use std::path::Path;

impl Plan {
    /// A plan that was just made.
    pub(crate) fn made(
        mission: Mission,
        scenario: NamedScenario,
        planned: PlanOutcome,
        recipe: (Method, Start),
    ) -> PyResult<Self> {
        let PlanOutcome { file, evidence, .. } = planned;
        Ok(Self {
            mission,
            scenario,
            grid: file.grid,
            verdict: file.verdict.unwrap_or_default(),
            residuals: file.residuals,
            clearances: file.clearances.unwrap_or(Clearances::NONE),
            is_judged: false,
            file,
            evidence: Some(evidence),
            recipe: Some(recipe),
        })
    }

    /// The plan of a file.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let file = PlanFile::read(path)?;
        let evidence = evidence_path(path);
        let evidence = evidence.is_file().then(|| EvidenceFile::read(&evidence)).transpose()?;
        Self::said(file, evidence, path)?.judged(path)
    }

    /// A plan that was made elsewhere, with what its file says of it.
    pub(crate) fn said(
        file: PlanFile,
        evidence: Option<EvidenceFile>,
        path: &Path,
    ) -> Result<Self, Error> {
        let mission = Mission::new(file.inputs.mission.clone(), path)?;
        Ok(Self {
            mission,
            scenario: file.inputs.scenario.named(&file.scenario),
            grid: file.grid,
            verdict: file.verdict.unwrap_or_default(),
            residuals: file.residuals,
            clearances: file.clearances.unwrap_or(Clearances::NONE),
            is_judged: false,
            evidence,
            recipe: None,
            file,
        })
    }

    /// The plan with the verifier's findings of now.
    pub(crate) fn judged(self, path: &Path) -> Result<Self, Error> {
        let file = &self.file;
        let made = file.inputs.read(&file.scenario).map_err(|error| error.at(path))?;
        let (translation, motion) = (file.stage1.trajectory(), file.stage2.trajectory());
        let MadeFor { mission, scenario } = &made;
        let found = verified(mission, scenario, file.integrator, &translation, &motion);
        let is_verified = found.residuals.are_within(&mission.tolerances);
        Ok(Self {
            verdict: Verdict::of(is_verified, file.status),
            residuals: found.residuals,
            clearances: found.clearances,
            is_judged: true,
            ..self
        })
    }

    /// The plan in force as the guess of another.
    pub(crate) fn nominal(&self) -> Nominal<MAX_JOINTS> {
        let reorientation = self.file.stage2.trajectory();
        let PlanGrid { nodes, dt_s, .. } = self.grid;
        let duration = self.scenario.duration_s.unwrap_or(dt_s * (nodes - 1) as f64);
        Nominal { reorientation, nodes, duration }
    }

    /// Inputs that make it again from such a start.
    pub(crate) fn method(&self, warm_start: WarmStart) -> Method {
        let PlanFile { mode, integrator, .. } = self.file;
        Method { mode, warm_start, qp: Qp::Embedded, integrator, ..Method::default() }
    }

    /// All that its file and its record hold, as packets.
    pub(crate) fn packets(&self) -> PyResult<(Vec<u8>, Option<Vec<u8>>)> {
        let failed = |error: FieldError| argument("plan", error.reason);
        let file = self.file.to_packet().map_err(failed)?;
        let evidence = self.evidence.as_ref().map(EvidenceFile::to_packet).transpose();
        Ok((file, evidence.map_err(failed)?))
    }

    /// Checksum of its numbers.
    pub(crate) fn output(&self) -> u64 {
        let (translation, motion) = (self.file.stage1.trajectory(), self.file.stage2.trajectory());
        self.mission.judged().output_checksum(self.grid.nodes, &translation, &motion)
    }
}
