//! Compilers, linkers and emulators: found, and what is missing named. Nothing is installed.
//!
//! A target that the user's own toolchain has is built with it. For the others Debian's compiler
//! builds `core` from its own source (`ci/toolchain.sh` makes the same choice for `ci/cross.sh`).

use super::target::{HOST, Target};
use remora_host::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Debian's compiler, its package manager, and the packages they come from.
const DEBIAN: [&str; 2] = ["/usr/bin/rustc", "/usr/bin/cargo"];
const DEBIAN_PACKAGES: &str = "rustc-web cargo-web rust-web-src";

/// Variables that would leak into the build where cargo started this program, or that hold flags
/// meant for the host.
const LEAKS: [&str; 10] = [
    "CARGO",
    "RUSTC",
    "RUSTC_WRAPPER",
    "RUSTC_WORKSPACE_WRAPPER",
    "RUSTFLAGS",
    "CARGO_ENCODED_RUSTFLAGS",
    "CARGO_BUILD_RUSTC",
    "CARGO_BUILD_RUSTFLAGS",
    "CARGO_BUILD_TARGET",
    "LD_LIBRARY_PATH",
];

/// Toolchain that the images are built with.
#[derive(Clone, Debug)]
pub struct Toolchain {
    /// Where the user's own toolchain lies.
    sysroot: PathBuf,
    /// Its version, as it says itself, and the host's target.
    version: String,
    host: String,
    /// Version of Debian's, where that is complete.
    debian: Option<String>,
}

impl Toolchain {
    /// Looks for all that these targets need.
    ///
    /// # Errors
    /// All that is missing, in one line, with the packages that have it.
    pub fn find(targets: &[&Target]) -> Result<Self, Error> {
        let own = |arguments: &[&str]| output(Command::new("rustc").args(arguments));
        let (Some(sysroot), Some(version)) = (own(&["--print", "sysroot"]), own(&["-vV"])) else {
            return Err(missing("a Rust toolchain: `rustc` and `cargo` on the path"));
        };
        let line = |key: &str| version.lines().find_map(|line| line.strip_prefix(key));
        let toolchain = Self {
            sysroot: sysroot.trim().into(),
            version: line("release: ").unwrap_or("unknown").into(),
            host: line("host: ").unwrap_or_default().into(),
            debian: debian(),
        };
        let lacking: Vec<_> = targets.iter().flat_map(|target| toolchain.lacks(target)).collect();
        match lacking.is_empty() {
            true => Ok(toolchain),
            false => Err(missing(&unique(lacking).join("; "))),
        }
    }

    /// Tools that a target needs and this machine lacks.
    fn lacks(&self, target: &Target) -> Vec<String> {
        let mut lacking = Vec::new();
        if !self.has(target.name) && self.debian.is_none() {
            let name = target.name;
            lacking.push(format!("`rustup target add {name}`, or Debian's {DEBIAN_PACKAGES}"));
        }
        if self.linker(target).is_none() {
            lacking.push(format!("{} (Debian: {})", target.linker.program, target.linker.package));
        }
        let emulator = target.emulator;
        if on_path(emulator.program).is_none() {
            lacking.push(format!("{} (Debian: {})", emulator.program, emulator.package));
        }
        lacking
    }

    /// Whether the user's own toolchain builds for this.
    fn has(&self, triple: &str) -> bool {
        self.sysroot.join("lib/rustlib").join(triple).join("lib").is_dir()
    }

    /// The linker of a target: the one that comes with the user's toolchain, or one on the path.
    pub fn linker(&self, target: &Target) -> Option<PathBuf> {
        let program = target.linker.program;
        let own = std::fs::read_dir(self.sysroot.join("lib/rustlib")).into_iter().flatten();
        let own = own.flatten().map(|entry| entry.path().join("bin/rust-lld"));
        let mut own = own.filter(|file| program == "lld" && file.is_file());
        own.next().or_else(|| on_path(program))
    }

    /// The compiler's name of a target, the host's included.
    pub fn triple<'a>(&'a self, target: &'a str) -> &'a str {
        if target == HOST { &self.host } else { target }
    }

    /// `cargo build` for a target; arguments follow.
    pub fn build(&self, target: &str) -> Command {
        let triple = self.triple(target);
        let mut command;
        if self.has(triple) {
            command = Command::new("cargo");
            clean(&mut command).args(["build", "--target", triple]);
        } else {
            command = Command::new(DEBIAN[1]);
            clean(&mut command).env("RUSTC_BOOTSTRAP", "1").env("RUSTC", DEBIAN[0]);
            command.args(["build", "--target", triple, "-Zbuild-std=core"]);
        }
        command
    }

    /// Compiler that builds for a target, with its version.
    pub fn name(&self, target: &str) -> String {
        match (&self.debian, self.has(self.triple(target))) {
            (Some(version), false) => format!("Debian {version}"),
            _ => format!("rustc {}", self.version),
        }
    }
}

/// The user's `cargo`, as if from a shell.
pub fn cargo() -> Command {
    let mut command = Command::new("cargo");
    clean(&mut command);
    command
}

fn clean(command: &mut Command) -> &mut Command {
    LEAKS.iter().for_each(|name| {
        command.env_remove(name);
    });
    command
}

/// Version of Debian's compiler, `rustc 1.96.0`, where the sources of `core` are beside it.
fn debian() -> Option<String> {
    let sysroot = output(Command::new(DEBIAN[0]).args(["--print", "sysroot"]))?;
    let sources = Path::new(sysroot.trim()).join("lib/rustlib/src/rust/library/core");
    let version = output(Command::new(DEBIAN[0]).arg("--version"))?;
    let is_complete = sources.is_dir() && Path::new(DEBIAN[1]).is_file();
    is_complete.then(|| version.split(" (").next().unwrap_or_default().trim().to_string())
}

/// Output of a program, where it ends well.
fn output(command: &mut Command) -> Option<String> {
    let output = clean(command).output().ok().filter(|output| output.status.success())?;
    String::from_utf8(output.stdout).ok()
}

fn on_path(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(program)).find(|file| file.is_file())
}

fn missing(what: &str) -> Error {
    Error::argument("firmware images", format!("missing: {what}"))
}

fn unique(mut lines: Vec<String>) -> Vec<String> {
    lines.sort();
    lines.dedup();
    lines
}
