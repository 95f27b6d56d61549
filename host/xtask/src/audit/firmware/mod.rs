//! The images: built for each processor, run under QEMU, held against the host bit for bit.
//!
//! Data goes down this list: `target` (what is particular to a processor), `toolchain` (compilers,
//! linkers, emulators; what is missing is named, nothing is installed), `plans` (what is asked of an
//! image), `image` (build it, read it), `emulator` (run it), `log` (what it printed), `bars`; `replay` (an image
//! that plans what is handed to it).
//! `docs/guides/bare-metal.md` tells what is measured, and how.

mod bars;
mod emulator;
mod image;
mod log;
mod plans;
mod replay;
mod tables;
mod target;
mod toolchain;

pub use plans::{Extent, Plans};
pub use replay::{Replayed, replay_image};
pub use tables::{parts_tables, report_tables};
pub use target::{HOST, Target};

use crate::audit::emulation::{FORMAT, ReportFile, RunRecord, TargetRecord};
use image::{Built, Folders, Kit, write};
use log::Log;
use remora_host::error::{Error, io_reason};
use remora_host::formats::{json, make_directory, write_atomically};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::Instant;
use toolchain::Toolchain;

/// Where images, remarks, logs and report lie.
pub fn folder(root: &Path) -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    let folder = target.unwrap_or_else(|| root.join("target")).join("firmware");
    std::path::absolute(&folder).unwrap_or(folder)
}

/// Images to be built and run: the input of `cargo xtask firmware`.
#[derive(Clone, Debug)]
pub struct Firmware {
    /// The checkout.
    pub root: PathBuf,
    /// The processors.
    pub targets: Vec<&'static Target>,
    /// Plans of each image.
    pub plans: Vec<Plans>,
    /// Whether each run is made again and must print the same, instruction counts included.
    pub is_repeated: bool,
}

/// Findings of the images.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Measurements, written to `report.json` too.
    pub report: ReportFile,
    /// Faults of the images, one line each.
    pub broken: Vec<String>,
}

/// One thing to do; as many are done at a time as there are processors.
#[derive(Clone, Copy, Debug)]
enum Job<'a> {
    /// Both images of a target.
    Build(&'a str),
    /// The test image.
    Test(Option<&'static Target>),
    /// Plans.
    Plan(Option<&'static Target>, &'a Plans),
}

impl Firmware {
    /// The images that the audit has pages of.
    pub fn audited(root: &Path, extent: Extent) -> Self {
        let targets = Target::audited().collect();
        Self { root: root.into(), targets, plans: extent.plans(), is_repeated: false }
    }

    /// Builds the images, runs them and writes the report. `watch` is told of each step.
    ///
    /// # Errors
    /// All that is missing; a build or a run that fails; logs that cannot be understood.
    pub fn run(&self, watch: &mut dyn FnMut(&str)) -> Result<Measured, Error> {
        let toolchain = Toolchain::find(&self.targets)?;
        let folders = Folders::of(&self.root);
        make_directory(&folders.out)?;
        resolve(&self.root, &folders)?;
        let work = Work { firmware: self, folders, toolchain };

        let builds: Vec<_> = image::with_host(&self.targets).map(Job::Build).collect();
        work.all(&builds, watch)?;
        let plans = |on| self.plans.iter().map(move |plans| Job::Plan(on, plans));
        let host: Vec<_> = [Job::Test(None)].into_iter().chain(plans(None)).collect();
        work.all(&host, watch)?;
        // The last plans take longest, and begin first, so that all end together.
        let on_targets = self.plans.iter().rev();
        let on_targets = on_targets.flat_map(|plans| {
            self.targets.iter().map(move |target| Job::Plan(Some(target), plans))
        });
        let tests = self.targets.iter().map(|target| Job::Test(Some(target)));
        work.all(&on_targets.chain(tests).collect::<Vec<_>>(), watch)?;

        let mut broken = Vec::new();
        let targets = self.targets.iter().map(|target| work.measure(target, &mut broken));
        let targets = targets.collect::<Result<_, _>>()?;
        let report = ReportFile { format: FORMAT.into(), targets };
        let file = work.folders.out.join("report.json");
        let text = json::to_text(&report).map_err(|cause| Error::output(&file, &cause.into()))?;
        write_atomically(&file, text.as_bytes())?;
        Ok(Measured { report, broken })
    }
}

/// The images' dependencies are those of the workspace's lock file; cargo drops what they do not need, here
/// once for all builds.
fn resolve(root: &Path, folders: &Folders) -> Result<(), Error> {
    let lock = folders.manifest.with_file_name("Cargo.lock");
    std::fs::copy(root.join("Cargo.lock"), &lock).map_err(|cause| Error::output(&lock, &cause))?;
    let mut command = toolchain::cargo();
    command.args(["metadata", "--format-version", "1", "--manifest-path"]);
    let status = command.arg(&folders.manifest).stdout(Stdio::null()).status();
    let reason = match status {
        Ok(status) if status.success() => return Ok(()),
        Ok(status) => format!("cargo metadata: {status}"),
        Err(cause) => io_reason(&cause),
    };
    Err(Error::input(&folders.manifest, "", reason))
}

/// Images in work.
struct Work<'a> {
    firmware: &'a Firmware,
    folders: Folders,
    toolchain: Toolchain,
}

impl Work<'_> {
    /// Does all jobs and tells of each; the first error ends those that have not begun.
    fn all(&self, jobs: &[Job<'_>], watch: &mut dyn FnMut(&str)) -> Result<(), Error> {
        let next = AtomicUsize::new(0);
        let (sender, receiver) = mpsc::channel();
        let work = |sender: mpsc::Sender<_>| {
            while let Some(job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
                let started = Instant::now();
                let done = self.job(job);
                if done.is_err() {
                    next.store(jobs.len(), Ordering::Relaxed);
                }
                let line = format!("{}: {} s", job.name(), started.elapsed().as_secs());
                // The receiver outlives all senders.
                let _ = sender.send((line, done));
            }
        };
        let threads = thread::available_parallelism().map_or(1, usize::from).min(jobs.len());
        thread::scope(|scope| {
            for _ in 0..threads {
                let sender = sender.clone();
                scope.spawn(|| work(sender));
            }
            drop(sender);
            let mut outcome = Ok(());
            for (line, done) in receiver {
                watch(&line);
                outcome = outcome.and(done);
            }
            outcome
        })
    }

    fn job(&self, job: &Job<'_>) -> Result<(), Error> {
        match *job {
            Job::Build(target) => {
                image::build(&self.folders, &self.toolchain, target, Kit::Flight)?;
                image::build(&self.folders, &self.toolchain, target, Kit::Tests)
            }
            Job::Test(target) => {
                let log = self.folders.out.join(test_log(target));
                self.execute(target, Kit::Tests, &TESTED, &log)
            }
            Job::Plan(target, plans) => {
                let log = self.folders.out.join(plans.log(name(target)));
                self.execute(target, Kit::Flight, plans, &log)?;
                match target.is_some() && self.firmware.is_repeated {
                    true => self.execute(target, Kit::Flight, plans, &again(&log)),
                    false => Ok(()),
                }
            }
        }
    }

    /// Runs an image to its end.
    fn execute(
        &self,
        target: Option<&Target>,
        kit: Kit,
        plans: &Plans,
        log: &Path,
    ) -> Result<(), Error> {
        let image = self.folders.image(name(target), kit);
        match target {
            None => emulator::on_host(&image, plans, log),
            Some(target) => {
                // A log that is there would be taken for this run's.
                write(log, "")?;
                let left = emulator::request(target, &Built::read(&image)?, plans);
                emulator::emulate(target, &image, &left, log)?;
                Log::read(log).map(|_| ())
            }
        }
    }

    /// Reads what a target's images printed, and holds it against the host and the bars.
    fn measure(
        &self,
        target: &'static Target,
        broken: &mut Vec<String>,
    ) -> Result<TargetRecord, Error> {
        let built = Built::read(&self.folders.image(target.name, Kit::Flight))?;
        let tests = Built::read(&self.folders.image(target.name, Kit::Tests))?;
        let mut found = bars::of_image(target, &built);
        if tests.panics.is_empty() {
            found.push("the proof does not see the panic of the test image".into());
        }
        let tested = Log::read(&self.folders.out.join(test_log(Some(target))))?;
        let host = Log::read(&self.folders.out.join(test_log(None)))?;
        found.extend(difference("tests", &host, &tested));

        let (mut runs, mut last) = (Vec::new(), Log::default());
        for plans in &self.firmware.plans {
            let file = self.folders.out.join(plans.log(target.name));
            let log = Log::read(&file)?;
            let host = Log::read(&self.folders.out.join(plans.log(HOST)))?;
            let what = format!("{} start, {}", plans.start.name(), plans.integrator.name());
            let differs = difference(&what, &host, &log);
            let is_equal = differs.is_none();
            found.extend(differs);
            found
                .extend(bars::of_run(target, &log).into_iter().map(|bar| format!("{what}: {bar}")));
            let repeatable = match self.firmware.is_repeated {
                true => Some(is_same(&file, &again(&file))),
                false => None,
            };
            if repeatable == Some(false) {
                found.push(format!("{what}: two runs differ"));
            }
            runs.push(run_record(plans, &log, is_equal, repeatable)?);
            last = log;
        }
        broken.extend(found.into_iter().map(|line| format!("{}: {line}", target.name)));
        Ok(TargetRecord {
            target: target.name.into(),
            board: last.board,
            cpu: target.cpu.into(),
            toolchain: self.toolchain.name(target.name),
            clock_hz: target.clock_hz,
            image_bytes: built.image_bytes,
            model_bytes: built.model_bytes,
            static_bytes: built.static_bytes,
            stack_size_bytes: last.stack_size_bytes,
            workspace_bytes: last.workspace_bytes,
            solver_bytes: last.solver_bytes,
            network_bytes: last.network_bytes,
            guidance_bytes: Some(last.guidance_bytes),
            flight_plan_bytes: Some(last.flight_plan_bytes),
            panic_free: built.panics.is_empty(),
            parts: tested.parts,
            runs,
        })
    }
}

impl Job<'_> {
    fn name(&self) -> String {
        match self {
            Self::Build(target) => format!("build {target}"),
            Self::Test(target) => format!("test {}", name(*target)),
            Self::Plan(target, plans) => {
                let (start, integrator) = (plans.start.name(), plans.integrator.name());
                format!("plan {}, {integrator}, {start}", name(*target))
            }
        }
    }
}

/// Plan of the test image besides its parts: one scenario.
const TESTED: Plans = {
    use crate::audit::emulation::{IntegratorName, StartName};
    Plans { integrator: IntegratorName::Euler, start: StartName::Heuristic, scenarios: 1 }
};

fn name(target: Option<&Target>) -> &'static str {
    target.map_or(HOST, |target| target.name)
}

fn test_log(target: Option<&Target>) -> String {
    format!("{}.tests.log", name(target))
}

/// Log of a second run.
fn again(log: &Path) -> PathBuf {
    let mut name = log.as_os_str().to_os_string();
    name.push(".again");
    name.into()
}

fn is_same(one: &Path, other: &Path) -> bool {
    matches!((std::fs::read(one), std::fs::read(other)), (Ok(one), Ok(other)) if one == other)
}

/// The first result that is not the host's, bit for bit.
fn difference(what: &str, host: &Log, log: &Log) -> Option<String> {
    let (here, there) = (&log.results, &host.results);
    let at = (0..here.len().max(there.len())).find(|i| here.get(*i) != there.get(*i))?;
    let line =
        |lines: &[String]| lines.get(at).map_or("nothing".into(), |line| format!("'{line}'"));
    Some(format!("{what}: {} where the host has {}", line(here), line(there)))
}

fn run_record(
    plans: &Plans,
    log: &Log,
    same_bits_as_host: bool,
    repeatable: Option<bool>,
) -> Result<RunRecord, Error> {
    let counter = log.counter.ok_or_else(|| {
        Error::argument("firmware images", format!("{}: no calibration", log.board))
    })?;
    Ok(RunRecord {
        integrator: plans.integrator,
        start: plans.start,
        same_bits_as_host,
        repeatable,
        counter,
        open_model_instructions: log.open_model_instructions,
        stack_bytes: log.stack_bytes.clone(),
        guidance: log.guidance,
        plans: log.plans.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_result_that_differs_is_named() {
        let log = |lines: &[&str]| Log {
            results: lines.iter().map(|line| line.to_string()).collect(),
            ..Log::default()
        };
        let host = log(&["plan output=1", "verified residuals=2"]);
        assert_eq!(difference("tests", &host, &host), None);
        let other = log(&["plan output=1", "verified residuals=3"]);
        let expected =
            "tests: 'verified residuals=3' where the host has 'verified residuals=2'".to_string();
        assert_eq!(difference("tests", &host, &other), Some(expected));
        let short = difference("tests", &host, &log(&["plan output=1"])).unwrap();
        assert!(short.contains("nothing where the host has 'verified"), "{short}");
    }

    #[test]
    fn what_is_missing_is_named_with_where_to_get_it() {
        let unknown =
            Target { name: "none-at-all", linker: NONE, emulator: NONE, ..target::TARGETS[0] };
        let unknown: &'static Target = Box::leak(Box::new(unknown));
        match Toolchain::find(&[unknown]) {
            Ok(toolchain) => panic!("{toolchain:?}"),
            Err(error) => {
                let text = error.to_string();
                assert!(text.contains("no-such-program (Debian: no-such-package)"), "{text}");
            }
        }
    }

    const NONE: target::Package =
        target::Package { program: "no-such-program", package: "no-such-package" };
}
