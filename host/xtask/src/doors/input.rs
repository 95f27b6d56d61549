//! Inputs of a plan, as far as its file tells.

use remora_host::error::Error;
use remora_host::formats::{MadeFor, Mission, PlanFile};
use remora_host::memory::on_large_stack;
use remora_host::method::{Method, Qp, WarmStart};
use remora_host::planning::Planner;
use remora_host::request::PlanRequest;
use std::path::{Path, PathBuf};

/// A plan to be made again.
#[derive(Clone, Debug)]
pub struct Input {
    /// Its file.
    pub file: PathBuf,
    /// Its contents.
    pub plan: PlanFile,
    /// How it was made.
    pub method: Method,
    /// File of the model that Stage 2 started from, where it is not the built-in one.
    pub model: Option<PathBuf>,
}

impl Input {
    /// Reads a plan's file; where its model was not the built-in one, `model` is its file.
    ///
    /// # Errors
    /// A plan that says too little of what it was made from.
    pub fn read(file: &Path, model: Option<PathBuf>) -> Result<Self, Error> {
        let plan = PlanFile::read(file)?;
        let wrong = |field: &str, reason: String| Err(Error::input(file, field, reason));
        let warm_start = match plan.warm_start.as_str() {
            "heuristic" => WarmStart::Heuristic,
            // Fallbacks were asked for a model too, which was then of no use.
            "model" | "fallback" => WarmStart::Model,
            other => {
                return wrong("warm_start", format!("is {other:?}: the guess is not in the file"));
            }
        };
        let Some(qp) = [Qp::Embedded, Qp::Clarabel].into_iter().find(|qp| qp.name() == plan.qp)
        else {
            return wrong("qp", format!("is {:?}: no solver of this program", plan.qp));
        };
        if warm_start == WarmStart::Heuristic && model.is_some() {
            return Err(Error::argument(
                "--model",
                "has no use: the plan started from the heuristic",
            ));
        }
        let (mode, integrator) = (plan.mode, plan.integrator);
        let method = Method { mode, warm_start, qp, integrator, ..Method::default() };
        Ok(Self { file: file.into(), method, model, plan })
    }

    /// Joints of its arm.
    pub fn joints(&self) -> usize {
        self.plan.inputs.mission.joints()
    }

    /// Mission and scenario.
    ///
    /// # Errors
    /// The first field found wrong.
    pub fn made_for(&self) -> Result<MadeFor, Error> {
        self.plan.inputs.read(&self.plan.scenario).map_err(|error| error.at(&self.file))
    }

    /// Checksum of the numbers in the file.
    ///
    /// # Errors
    /// Inputs that are not sound.
    pub fn checksum(&self) -> Result<u64, Error> {
        self.made_for().map(|made| checksum(&made.mission, &self.plan))
    }

    /// Plans here, in this process.
    ///
    /// # Errors
    /// Inputs that make no plan: a model that cannot be read.
    pub fn planned(&self) -> Result<u64, Error> {
        let mission = self.made_for()?.mission;
        let request = PlanRequest::new(mission, self.method, self.model.as_deref())?;
        let scenario = self.plan.inputs.scenario.named(&self.plan.scenario);
        let planned = on_large_stack(|| Planner::new().plan(&request, &scenario))?;
        Ok(checksum(&mission, &planned.file))
    }
}

/// Checksum of a plan's rows.
fn checksum(mission: &Mission, plan: &PlanFile) -> u64 {
    let nodes = plan.stage1.position.len();
    mission.output_checksum(nodes, &plan.stage1.trajectory(), &plan.stage2.trajectory())
}
