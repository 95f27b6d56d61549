//! Programs behind doors: found or built, run, their checksum read.

use crate::audit::firmware::{Replayed, Target, replay_image};
use crate::doors::door::Door;
use crate::doors::input::Input;
use crate::doors::numbers::Numbers;
use remora_core::advanced::stages::LINKS;
use remora_host::choice::Choice;
use remora_host::error::Error;
use remora_host::learned::Learned;
use remora_host::method::{Qp, WarmStart};
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const PYTHON: &str = include_str!("programs/replay.py");
const C: &str = include_str!("../../../../docs/examples/c/replay.c");

/// Outcome behind a door.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Opened {
    /// The checksum of its plan.
    Planned(u64),
    /// It is not there, or not for such a plan: why, or what to install.
    Missing(String),
    /// It is there and makes no plan: why.
    Failed(String),
}

/// Checksum that a program prints, or the outcome in place of one.
type Told = Result<u64, Opened>;

/// Where programs are found, built and run.
pub struct Workshop<'a> {
    /// Inputs of the plan.
    pub input: &'a Input,
    /// The checkout of the sources; none where there is none.
    pub root: Option<PathBuf>,
    /// A folder for what is written.
    pub scratch: PathBuf,
}

impl Workshop<'_> {
    /// Plans behind a door.
    ///
    /// # Errors
    /// Faults of the plan or of this machine, but not of the door.
    pub fn open(&self, door: Door) -> Result<Opened, Error> {
        if let Some(reason) = self.unfit(door) {
            return Ok(Opened::Missing(reason.into()));
        }
        let told = match door {
            Door::Program => return self.input.planned().map(Opened::Planned),
            Door::C => self.c()?,
            Door::Python => self.python(),
            Door::Node => self.node()?,
            Door::Processor(index) => self.processor(<&Target>::ALL[index])?,
        };
        Ok(told.map_or_else(|opened| opened, Opened::Planned))
    }

    /// Why a door is not for such a plan.
    fn unfit(&self, door: Door) -> Option<&'static str> {
        let input = self.input;
        match door {
            Door::Program => None,
            _ if input.method.qp != Qp::Embedded => Some("plans with the embedded solver only"),
            _ if !door.is_general() && input.joints() != LINKS => Some("three joints only"),
            Door::Processor(_) if input.model.is_some() => Some("holds the built-in models only"),
            _ => None,
        }
    }

    fn python(&self) -> Told {
        let input = self.input;
        let guess = match (&input.model, input.method.warm_start) {
            (Some(file), _) => file.clone(),
            (None, WarmStart::Heuristic) => "heuristic".into(),
            (None, _) => "model".into(),
        };
        let mut probe = Command::new("python3");
        let found = ran(probe.args(["-c", "import remora; remora.plan"]))?;
        if !found.status.success() {
            let reason =
                "python3 has no module remora: pip install remora-gnc, or a wheel of host/python";
            return Err(Opened::Missing(reason.into()));
        }
        let mut command = Command::new("python3");
        command.args(["-c", PYTHON]).arg(&input.file).arg(input.method.mode.name()).arg(guess);
        checksum(&ran(&mut command)?)
    }

    fn c(&self) -> Result<Told, Error> {
        let (program, source) = (self.scratch.join("replay"), self.scratch.join("replay.c"));
        let model = self.model()?;
        write(&source, C)?;
        let build = || {
            let mut command = Command::new("cc");
            command.args(["-std=c99", "-O2", "-o"]).arg(&program).arg(&source);
            ended(&ran(command.args(self.c_flags()?))?)
        };
        let run = || {
            build()?;
            checksum(&self.fed(Command::new(&program).args(&model))?)
        };
        Ok(run())
    }

    /// Flags of a C compiler for the archive: that of the checkout, or an installed one.
    fn c_flags(&self) -> Result<Vec<String>, Opened> {
        let Some(root) = &self.root else {
            let mut command = Command::new("pkg-config");
            let found = ran(command.args(["--cflags", "--libs", "remora"]));
            let flags = found.ok().filter(|output| output.status.success());
            let words = |output: Output| {
                let text = String::from_utf8_lossy(&output.stdout).into_owned();
                text.split_whitespace().map(String::from).collect()
            };
            let reason =
                "no archive: pkg-config knows no remora, and there is no checkout to build it of";
            return flags.map(words).ok_or_else(|| Opened::Missing(reason.into()));
        };
        let prefix = folder(root).join("c");
        ended(&ran(Command::new(root.join("ci/install-c.sh")).arg(&prefix))?)?;
        let at = |part: &str| prefix.join(part).display().to_string();
        Ok(vec![format!("-I{}", at("include")), format!("-L{}", at("lib")), "-lremora".into()])
    }

    fn node(&self) -> Result<Told, Error> {
        let model = self.model()?;
        let run = || {
            ended(&ran(Command::new("node").arg("--version"))?)?;
            let Some(root) = &self.root else {
                let reason = "there is no checkout to build the module of";
                return Err(Opened::Missing(reason.into()));
            };
            let module = folder(root).join("remora.wasm");
            ended(&ran(Command::new(root.join("ci/wasm.sh")).arg(&module))?)?;
            let script = root.join("host/xtask/src/doors/programs/replay.mjs");
            checksum(&self.fed(Command::new("node").arg(script).arg(&module).args(&model))?)
        };
        Ok(run())
    }

    fn processor(&self, target: &'static Target) -> Result<Told, Error> {
        let Some(root) = &self.root else {
            let reason = "there is no checkout to build the image of";
            return Ok(Err(Opened::Missing(reason.into())));
        };
        let is_learned = self.input.method.warm_start != WarmStart::Heuristic;
        let lines = self.lines()?;
        let numbers = lines.iter().flat_map(Numbers::floats);
        let numbers: Vec<f64> = [f64::from(is_learned)].into_iter().chain(numbers).collect();
        Ok(match replay_image(root, target, &numbers, &self.scratch) {
            Ok(Replayed::Planned(sum)) => Ok(sum),
            Ok(Replayed::Missing(reason)) => Err(Opened::Missing(reason)),
            Err(error) => Err(Opened::Failed(error.to_string())),
        })
    }

    /// The plan's input, a line each of mission, scenario and options.
    fn lines(&self) -> Result<[Numbers; 3], Error> {
        let made = self.input.made_for()?;
        let method = &self.input.method;
        Ok([
            Numbers::mission(&made.mission.sized()),
            Numbers::scenario(&made.scenario.resized()),
            Numbers::options(method.mode, method.integrator),
        ])
    }

    /// File of the model, where one is asked for.
    fn model(&self) -> Result<Option<PathBuf>, Error> {
        let integrator = self.input.method.integrator;
        match (&self.input.model, self.input.method.warm_start) {
            (_, WarmStart::Heuristic) => Ok(None),
            (Some(file), _) => Ok(Some(file.clone())),
            (None, _) => Learned::write_built_in(integrator, &self.scratch).map(Some),
        }
    }

    /// Runs a program with the plan's input.
    fn fed(&self, command: &mut Command) -> Result<Output, Opened> {
        let lines = self.lines().map_err(|error| Opened::Failed(error.to_string()))?;
        let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let failed = |cause: std::io::Error| Opened::Failed(cause.to_string());
        let mut child = command.spawn().map_err(failed)?;
        if let Some(mut input) = child.stdin.take() {
            // A program that does not read on says why on its own.
            let _ = input.write_all(text.as_bytes());
        }
        child.wait_with_output().map_err(failed)
    }
}

/// Where programs are built, in a checkout.
fn folder(root: &Path) -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    target.unwrap_or_else(|| root.join("target")).join("doors")
}

fn write(file: &Path, text: &str) -> Result<(), Error> {
    fs::write(file, text).map_err(|cause| Error::output(file, &cause))
}

/// Runs a program to its end; one that is not there is missing.
fn ran(command: &mut Command) -> Result<Output, Opened> {
    command.stdin(Stdio::null()).output().map_err(|cause| {
        let program = command.get_program().to_string_lossy().into_owned();
        match cause.kind() {
            std::io::ErrorKind::NotFound => Opened::Missing(format!("there is no {program}")),
            _ => Opened::Failed(format!("{program}: {cause}")),
        }
    })
}

/// Checks that a program ended well; otherwise returns its reason.
fn ended(output: &Output) -> Result<(), Opened> {
    if output.status.success() {
        return Ok(());
    }
    let errors = String::from_utf8_lossy(&output.stderr);
    // Compilers print the cause first, other programs last.
    let mut lines = errors.lines().filter(|line| !line.trim().is_empty());
    let why = lines.clone().find(|line| line.starts_with("error")).or_else(|| lines.next_back());
    Err(Opened::Failed(why.map_or_else(|| output.status.to_string(), String::from)))
}

/// The checksum that a program prints.
fn checksum(output: &Output) -> Told {
    ended(output)?;
    let text = String::from_utf8_lossy(&output.stdout);
    let word = text.trim();
    match (word.len(), u64::from_str_radix(word, 16)) {
        (16, Ok(sum)) => Ok(sum),
        _ => Err(Opened::Failed(format!("printed no checksum but {word:?}"))),
    }
}
