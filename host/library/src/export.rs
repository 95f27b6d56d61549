//! The subproblems of a plan as files, for solvers of any kind to be tried on.

use crate::error::{Error, FieldError, io_reason};
use crate::formats::{NamedScenario, check_writable};
use crate::kkt::Kkt;
use crate::memory::on_large_stack;
use crate::planning::{PlanOutcome, Planner, Subproblem, WallClock};
use crate::qp_file::{QpFile, QpPlace};
use crate::request::PlanRequest;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};

/// One plan whose subproblems are to be written: the input of `remora export --format qp`.
#[derive(Clone, Debug)]
pub struct ExportJob {
    /// The scenario.
    pub scenario: NamedScenario,
    /// How to plan; the mission's arm is like the built-in mission's.
    pub request: PlanRequest,
    /// The directory to write to.
    pub out: PathBuf,
    /// Whether the directory may hold other files.
    pub force: bool,
}

/// Result of an export.
#[derive(Clone, Debug)]
pub struct QpExport {
    /// The plan.
    pub planned: PlanOutcome,
    /// The subproblems of stages 1 and 2.
    pub stages: [StageExport; 2],
}

/// The subproblems of one stage.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct StageExport {
    /// Subproblems, corrections included.
    pub programs: usize,
    /// Second-order corrections among them.
    pub corrections: usize,
    /// Subproblems without a solution.
    pub unsolved: usize,
    /// Optimality of the solutions, the worst of each condition.
    pub kkt: Kkt,
}

/// Collects the subproblems of one stage as they come.
struct Collector<'a> {
    job: &'a ExportJob,
    place: QpPlace<'a>,
    summary: StageExport,
    files: Vec<QpFile>,
    failed: Option<FieldError>,
}

impl ExportJob {
    /// Plans, then writes the subproblems, whatever the plan's status.
    ///
    /// # Errors
    /// A directory that cannot be written to or holds something else (found out before planning);
    /// a subproblem with numbers that are not, which no file could hold.
    pub fn run(&self) -> Result<QpExport, Error> {
        self.prepare()?;
        let _alone = self.lock()?;
        let (planned, [one, two]) = on_large_stack(|| {
            let [mut one, mut two] = [1, 2].map(|stage| Collector::new(self, stage));
            let mut watch = |solve: Subproblem<'_>| match solve.stage {
                1 => one.add(&solve),
                _ => two.add(&solve),
            };
            let clock = WallClock::start();
            let planned =
                Planner::new().plan_watched(&clock, &self.request, &self.scenario, &mut watch);
            (planned, [one.end(), two.end()])
        })?;
        let (one, two) = (one?, two?);
        let files: Vec<&QpFile> = one.1.iter().chain(&two.1).collect();
        self.write(&files)?;
        Ok(QpExport { planned, stages: [one.0, two.0] })
    }

    /// Makes sure that the files can be written, and that nothing else is in the way.
    fn prepare(&self) -> Result<(), Error> {
        let refuse = |reason: String| Err(Error::Output { file: self.out.clone(), reason });
        match fs::read_dir(&self.out) {
            Ok(entries) => {
                let is_other = |name: &str| !QpFile::is_name(name) && !name.starts_with(STAGING);
                let names = entries.flatten().map(|entry| entry.file_name());
                let other =
                    names.map(|name| name.to_string_lossy().into_owned()).find(|n| is_other(n));
                if let Some(name) = other.filter(|_| !self.force) {
                    return refuse(format!("holds {name:?}, which is no subproblem; see --force"));
                }
            }
            Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => {
                if let Err(cause) = fs::create_dir_all(&self.out) {
                    return refuse(io_reason(&cause));
                }
            }
            Err(_) if self.out.is_file() => return refuse("is not a directory".into()),
            Err(cause) => return refuse(io_reason(&cause)),
        }
        check_writable(&self.out.join("a.qp.json"))
    }

    /// Locks the directory against other exports, which would sweep away what this one writes. A system that
    /// cannot lock a directory lets them run.
    fn lock(&self) -> Result<Option<File>, Error> {
        let Ok(directory) = File::open(&self.out) else { return Ok(None) };
        match directory.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let reason = "another export is running in this directory".into();
                Err(Error::Output { file: self.out.clone(), reason })
            }
            _ => Ok(Some(directory)),
        }
    }

    /// Writes all files beside their places, then moves them there, so that a kill leaves the old
    /// set or the new one. (Between two of those moves it would leave a part of the new one.)
    fn write(&self, files: &[&QpFile]) -> Result<(), Error> {
        let staging = self.out.join(format!("{STAGING}new"));
        let written = (|| {
            fs::create_dir_all(&staging).map_err(|cause| Error::output(&staging, &cause))?;
            files.iter().try_for_each(|file| file.write(&staging.join(file.name())))?;
            remove_programs(&self.out)?;
            files.iter().try_for_each(|file| {
                let to = self.out.join(file.name());
                fs::rename(staging.join(file.name()), &to)
                    .map_err(|cause| Error::output(&to, &cause))
            })
        })();
        remove_staging(&self.out);
        written
    }
}

/// Beginning of the name of the hidden directory beside the files.
const STAGING: &str = ".qp-export.";

/// Removes what an export, or one that was killed, left of its staging.
fn remove_staging(directory: &Path) {
    let Ok(entries) = fs::read_dir(directory) else { return };
    for entry in entries.flatten() {
        if entry.file_name().to_string_lossy().starts_with(STAGING) {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

/// Removes the subproblems of an earlier export.
fn remove_programs(directory: &Path) -> Result<(), Error> {
    let entries = fs::read_dir(directory).map_err(|cause| Error::output(directory, &cause))?;
    for entry in entries.flatten() {
        let path = entry.path();
        if entry.file_name().to_str().is_some_and(QpFile::is_name) && path.is_file() {
            fs::remove_file(&path).map_err(|cause| Error::output(&path, &cause))?;
        }
    }
    Ok(())
}

impl<'a> Collector<'a> {
    fn new(job: &'a ExportJob, stage: u64) -> Self {
        let place = QpPlace { scenario: &job.scenario.id, stage, iteration: 0, correction: 0 };
        let summary = StageExport::default();
        Self { job, place, summary, files: Vec::new(), failed: None }
    }

    fn add(&mut self, solve: &Subproblem<'_>) {
        if solve.is_correction {
            self.place.correction += 1;
            self.summary.corrections += 1;
        } else {
            self.place.iteration += 1;
            self.place.correction = 0;
        }
        self.summary.programs += 1;
        if solve.outcome.status.is_usable() {
            self.summary.kkt = self.summary.kkt.max(Kkt::of(solve.qp, solve.solution));
        } else {
            self.summary.unsolved += 1;
        }
        match QpFile::new(&self.place, &self.job.request.method, solve) {
            Ok(file) => self.files.push(file),
            Err(error) => self.failed = self.failed.take().or(Some(error)),
        }
    }

    fn end(self) -> Result<(StageExport, Vec<QpFile>), Error> {
        match self.failed {
            Some(error) => Err(error.at(&self.job.out)),
            None => Ok((self.summary, self.files)),
        }
    }
}
