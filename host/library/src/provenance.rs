//! Provenance of a report: commit, compiler, models and machine.

use crate::fingerprint;
use crate::formats::Program;
use crate::learned::Learned;
use crate::method::Integrator;
use crate::report::Table;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::process::Command;

/// Commit, compiler, flags, target, models and machine of a report.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Commit of the source tree. Outside a checkout it is the commit of the build, which only a release build
    /// knows; else `unknown`.
    pub commit: String,
    /// Whether tracked files, reports apart, differed from it.
    pub is_modified: bool,
    /// Fingerprint of the running program's file.
    pub program: String,
    /// Its compiler.
    pub compiler: String,
    /// The compiler's flags beside the profile's.
    pub flags: String,
    /// Cargo's profile.
    pub profile: String,
    /// The target it was built for.
    pub target: String,
    /// Names and checksums of the built-in models.
    pub models: Vec<(String, String)>,
    /// The machine.
    pub machine: Machine,
}

/// A machine, as far as it matters to times.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// Its processor's name; `unknown` where the system does not tell.
    pub processor: String,
    /// Processors that this program may use.
    pub cores: usize,
    /// Memory [bytes]; zero where the system does not tell.
    pub memory_bytes: u64,
    /// Operating system and its version.
    pub system: String,
}

/// File by which a checkout of this program is recognised.
const MARK: &str = "ci/firmware/Cargo.toml";

/// Places of reports, which are not part of the measured program.
const REPORTS: [&str; 2] = [":(exclude)docs/evidence", ":(exclude)docs/lab"];

impl Provenance {
    /// Gathers it for this program, built from the checkout in `root`, on this machine.
    pub fn gather(root: &Path) -> Self {
        let built = Program::this().commit;
        let (built, has_changes) = match built.strip_suffix("+changes") {
            Some(commit) => (commit.to_string(), true),
            None => (built, false),
        };
        // The commit of another project's checkout is not this program's.
        let top = git(root, &["rev-parse", "--show-toplevel"]);
        let is_checkout = top.is_some_and(|top| Path::new(&top).join(MARK).is_file());
        let status = ["status", "--porcelain", "--untracked-files=no", "--", "."];
        let changes = git(root, &[&status[..], &REPORTS[..]].concat());
        let models = [Integrator::Euler, Integrator::RK4].map(|integrator| {
            let record = Learned::built_in(integrator).record();
            (record.name, record.checksum)
        });
        Self {
            commit: git(root, &["rev-parse", "HEAD"]).filter(|_| is_checkout).unwrap_or(built),
            is_modified: match is_checkout {
                true => changes.is_some_and(|changes| !changes.is_empty()),
                false => has_changes,
            },
            program: fingerprint::program(),
            compiler: env!("REMORA_COMPILER").into(),
            flags: env!("REMORA_FLAGS").into(),
            profile: env!("REMORA_PROFILE").into(),
            target: env!("REMORA_TARGET").into(),
            models: models.into(),
            machine: Machine::this(),
        }
    }

    /// Table of the provenance for a report's readers.
    pub fn table(&self) -> Table {
        let Self { commit, program, compiler, flags, profile, target, machine, .. } = self;
        let gibibytes = machine.memory_bytes as f64 / (1u64 << 30) as f64;
        let modified = if self.is_modified { ", with changes" } else { "" };
        let told = match commit.as_str() {
            "unknown" => format!("not a release build; its file's fingerprint is `{program}`"),
            commit => format!("`{commit}`{modified}"),
        };
        let models = self.models.iter().map(|(name, checksum)| format!("{name} {checksum}"));
        let mut table = Table::new(" | ");
        for (name, value) in [
            ("commit", told),
            ("compiler", format!("{compiler}, {target}")),
            ("profile, flags", format!("{profile}; `{flags}`")),
            ("models", models.collect::<Vec<_>>().join(", ")),
            ("machine", format!("{}, {} cores", machine.processor, machine.cores)),
            ("memory, system", format!("{gibibytes:.1} GiB, {}", machine.system)),
        ] {
            table.row([name.into(), value]);
        }
        table
    }
}

impl Machine {
    /// The one this runs on.
    fn this() -> Self {
        let read = |file: &str| std::fs::read_to_string(file).unwrap_or_default();
        let field = |file: &str, name: &str| {
            let text = read(file);
            let line = text.lines().find(|line| line.starts_with(name));
            line.and_then(|line| line.split_once(':')).map(|(_, value)| value.trim().to_string())
        };
        let memory = field("/proc/meminfo", "MemTotal");
        let kibibytes = memory.and_then(|text| text.split(' ').next()?.parse::<u64>().ok());
        let release = read("/proc/sys/kernel/osrelease");
        Self {
            processor: field("/proc/cpuinfo", "model name").unwrap_or_else(|| "unknown".into()),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            memory_bytes: kibibytes.unwrap_or(0) * 1024,
            system: format!("{} {}", std::env::consts::OS, release.trim()).trim().into(),
        }
    }
}

/// Commit of the checkout in `root` and its day, for people; unknown outside of one.
pub fn commit_and_day(root: &Path) -> String {
    let asked = git(root, &["log", "-1", "--format=`%h` of %cs"]);
    asked.unwrap_or_else(|| "an unknown commit".into())
}

/// Output of `git` in `root`; none where it fails.
fn git(root: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").arg("-C").arg(root).args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_build_knows_its_compiler_and_models() {
        let dir = tempfile::tempdir().unwrap();
        let made = Provenance::gather(dir.path());
        assert_eq!(made.commit, Program::this().commit.trim_end_matches("+changes"));
        assert!(made.compiler.starts_with("rustc "), "{}", made.compiler);
        assert!(made.target.contains('-') && made.machine.cores > 0);
        assert_eq!(made.models.len(), 2);
        assert!(made.models.iter().all(|(_, checksum)| checksum.len() == 8), "{:?}", made.models);
        assert!(made.table().markdown().contains(&made.compiler));
    }

    /// A release build knows its commit anywhere; it does not take that of another project's checkout.
    #[test]
    fn a_map_names_the_commit_of_the_program_and_not_of_the_folder() {
        let dir = tempfile::tempdir().unwrap();
        let run = |arguments: &[&str]| git(dir.path(), arguments).is_some();
        let author = ["-c", "user.name=a", "-c", "user.email=a@b.c"];
        let commit = ["commit", "--quiet", "--allow-empty", "-m", "a"];
        assert!(run(&["init", "--quiet"]) && run(&[&author[..], &commit[..]].concat()));
        let head = git(dir.path(), &["rev-parse", "HEAD"]).unwrap();
        let made = Provenance::gather(dir.path());
        assert_ne!(made.commit, head);
        let text = |commit: &str| {
            let made = Provenance { commit: commit.into(), ..made.clone() };
            made.table().markdown()
        };
        assert!(text("0123abc").contains("`0123abc`"));
        assert!(!text("unknown").contains("`unknown`"), "{}", text("unknown"));
    }
}
