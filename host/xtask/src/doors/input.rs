//! What a plan was made from, as far as its file tells.

use remora_core::advanced::planner::output_checksum;
use remora_host::error::Error;
use remora_host::formats::{MadeFor, PLANNED_JOINTS, PlanFile};
use remora_host::learned::Learned;
use remora_host::method::{Method, Qp, WarmStart};
use remora_host::planning::PlanJob;
use remora_host::threads::Threads;
use remora_host::with_joints;
use std::path::{Path, PathBuf};

/// A plan to be made again.
#[derive(Clone, Debug)]
pub struct Input {
    /// Its file.
    pub file: PathBuf,
    /// What stands there.
    pub plan: PlanFile,
    /// How it was made.
    pub method: Method,
    /// File of the model that Stage 2 started from, where it is not the built-in one.
    pub model: Option<PathBuf>,
    /// Joints of its arm.
    pub joints: usize,
}

impl Input {
    /// Reads a plan's file; where its model was not the built-in one, `model` is its file.
    ///
    /// # Errors
    /// A plan that says too little of what it was made from.
    pub fn read(file: &Path, model: Option<PathBuf>) -> Result<Self, Error> {
        let plan = PlanFile::read(file)?;
        let wrong = |field: &str, reason: String| Err(Error::input(file, field, reason));
        let joints = plan.inputs.mission.joints();
        let warm_start = match plan.warm_start.as_str() {
            "heuristic" => WarmStart::Heuristic,
            // What was asked for was a model that was then of no use.
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
        Ok(Self { file: file.into(), method, model, joints, plan })
    }

    /// Mission and scenario for an arm of `NL` joints.
    ///
    /// # Errors
    /// The first field found wrong.
    pub fn made_for<const NL: usize>(&self) -> Result<MadeFor<NL>, Error> {
        self.plan.inputs.read(&self.plan.scenario).map_err(|error| error.at(&self.file))
    }

    /// Checksum of the numbers in the file.
    ///
    /// # Errors
    /// An arm that there is no planner for.
    pub fn checksum(&self) -> Result<u64, Error> {
        checksum(&self.plan, self.joints).ok_or_else(|| self.no_planner())
    }

    /// Plans here, in this process.
    ///
    /// # Errors
    /// What makes no plan: a model that cannot be read.
    pub fn planned(&self) -> Result<u64, Error> {
        let Method { warm_start, integrator, .. } = self.method;
        let model = Learned::chosen(warm_start, self.model.as_deref(), integrator)?;
        let planned = with_joints!(self.joints, NL => {
            PlanJob::<NL> {
                scenario: self.plan.inputs.scenario.named(&self.plan.scenario),
                mission: self.made_for()?.mission,
                method: self.method,
                model,
                threads: Threads::default(),
                is_scrubbed: false,
                out: PathBuf::new(),
            }.plan()
        } else { Err(self.no_planner()) })?;
        checksum(&planned.file, self.joints).ok_or_else(|| self.no_planner())
    }

    fn no_planner(&self) -> Error {
        Error::input(&self.file, "inputs.mission.servicer.links", PLANNED_JOINTS)
    }
}

/// Checksum of a plan's rows; none where there is no planner for its arm.
fn checksum(plan: &PlanFile, joints: usize) -> Option<u64> {
    let nodes = plan.stage1.position.len();
    let path = plan.stage1.trajectory();
    Some(with_joints!(joints, NL => {
        output_checksum(nodes, &path, &plan.stage2.trajectory::<NL>())
    } else { return None }))
}
