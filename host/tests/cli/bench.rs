//! A directory to run a program in, and what came of a run. Tests of several programs use this file.

use super::PROGRAM;
use remora_host::formats::Mission;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A temporary directory with a set of three drawn scenarios, `set.scenarios.json`.
pub struct Bench(tempfile::TempDir);

/// Status and output of a run.
pub struct Run {
    pub status: i32,
    pub out: String,
    pub err: String,
}

/// The ids in `set.scenarios.json`.
pub const IDS: [&str; 3] = ["s1-000", "s1-001", "s1-002"];

/// Arguments that plan the scenarios of [`Bench::takes_too_many_iterations`].
pub const SLOW: &str = "--mission strong.mission.toml --scenarios slow.scenarios.json \
                        --integrator euler --warm-start heuristic";

impl Bench {
    /// A bench with nothing on it.
    pub fn empty() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn new() -> Self {
        let bench = Self::empty();
        bench.draw(3, 1, "set.scenarios.json");
        bench
    }

    /// Writes drawn scenarios of the built-in mission.
    pub fn draw(&self, count: u64, seed: u64, name: &str) {
        let set = remora_host::draw::draw(count, seed, &Mission::default()).unwrap();
        set.write(&self.path(name)).unwrap();
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }

    pub fn write(&self, name: &str, text: &(impl AsRef<[u8]> + ?Sized)) {
        fs::write(self.path(name), text).unwrap();
    }

    /// Writes a mission and three scenarios for which Stage 2 does not converge within its iterations.
    pub fn takes_too_many_iterations(&self) {
        let mission = include_str!("../../../fixtures/missions/strong.mission.toml");
        self.write("strong.mission.toml", mission);
        let draw = "draw --mission strong.mission.toml --count 21 --seed 1";
        self.solves(&format!("{draw} --out slow.scenarios.json"));
        let mut set = self.json("slow.scenarios.json");
        let scenarios = set["scenarios"].as_array_mut().unwrap();
        scenarios
            .retain(|one| ["s1-000", "s1-004", "s1-020"].map(Some).contains(&one["id"].as_str()));
        assert_eq!(scenarios.len(), 3);
        self.write("slow.scenarios.json", &set.to_string());
    }

    /// The program with arguments that hold no spaces.
    pub fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(PROGRAM);
        command.args(arguments.split_whitespace()).current_dir(self.0.path());
        // What a build around the test has left is not the bench's.
        command.stdin(Stdio::null()).env_remove("CARGO_TARGET_DIR");
        command
    }

    /// A line of a shell.
    pub fn shell(&self, line: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", line]).current_dir(self.0.path());
        command.stdin(Stdio::null()).env_remove("CARGO_TARGET_DIR");
        command
    }

    pub fn run(&self, arguments: &str) -> Run {
        let output = self.command(arguments).output().unwrap();
        Run {
            status: output.status.code().unwrap(),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Runs what must succeed.
    pub fn solves(&self, arguments: &str) -> Run {
        let run = self.run(arguments);
        assert_eq!(run.status, 0, "{arguments}\n{}{}", run.out, run.err);
        run
    }

    /// Runs what must be refused: status 2, one line on standard error that begins as given,
    /// nothing written.
    pub fn refuses(&self, arguments: &str, message: &str) {
        let before = self.files();
        let run = self.run(arguments);
        assert_eq!(run.status, 2, "{arguments}\n{}{}", run.out, run.err);
        let expected = format!("error: {message}");
        assert!(run.err.starts_with(&expected), "{arguments}\n{}not: {expected}", run.err);
        assert_eq!(run.err.lines().count(), 1, "{arguments}\n{}", run.err);
        assert_eq!(run.out, "", "{arguments}");
        // Not `assert_eq`: the difference would fill the screen.
        assert!(self.files() == before, "{arguments} changed files");
    }

    /// All files and directories, hidden ones too, with their contents.
    fn files(&self) -> Vec<(PathBuf, Vec<u8>)> {
        fn walk(directory: &Path, out: &mut Vec<(PathBuf, Vec<u8>)>) {
            for entry in fs::read_dir(directory).unwrap() {
                let path = entry.unwrap().path();
                out.push((path.clone(), fs::read(&path).unwrap_or_default()));
                if path.is_dir() {
                    walk(&path, out);
                }
            }
        }
        let mut out = Vec::new();
        walk(self.0.path(), &mut out);
        out.sort();
        out
    }

    /// Names in a directory.
    pub fn names(&self, directory: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(directory)).unwrap();
        let name = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name();
        let mut names: Vec<String> =
            entries.map(|entry| name(entry).into_string().unwrap()).collect();
        names.sort();
        names
    }
}

/// A plan or a summary without its times: all that must be the same in every run.
pub fn timeless(mut value: Value) -> Value {
    fn strip(value: &mut Value) {
        if let Value::Object(members) = value {
            members.retain(|key, _| !key.ends_with("_s"));
            members.values_mut().for_each(strip);
        }
    }
    strip(&mut value);
    value
}
