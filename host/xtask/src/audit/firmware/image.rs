//! How an image is built, and what its file tells.

use super::target::{HOST, Target};
use super::toolchain::Toolchain;
use crate::audit::image::PLANNER;
use image_audit::{ImageError, Kind, Outline, Verdict};
use remora_host::choice::Choice;
use remora_host::error::{Error, io_reason};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Kind of a target's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kit {
    /// The image that would fly.
    Flight,
    /// Parts of a plan one by one, and a panic, so that the proof of its absence can be seen to fail.
    Tests,
    /// Plans what is handed to it.
    Replay,
}

/// Folders that images are made from and in.
#[derive(Clone, Debug)]
pub struct Folders {
    /// `Cargo.toml` of the images.
    pub manifest: PathBuf,
    /// Where images, logs and report go.
    pub out: PathBuf,
}

impl Folders {
    /// Folders of a checkout.
    pub fn of(root: &Path) -> Self {
        Self { manifest: root.join("ci/firmware/Cargo.toml"), out: super::folder(root) }
    }

    /// The image of a target.
    pub fn image(&self, target: &str, kit: Kit) -> PathBuf {
        self.out.join(match kit {
            Kit::Flight => format!("{target}.elf"),
            Kit::Tests => format!("{target}.tests.elf"),
            Kit::Replay => format!("{target}.replay.elf"),
        })
    }
}

/// Builds one image of a target, and for the one that flies writes the compiler's remarks beside it.
///
/// Relocations (who refers to whom) and remarks on stack frames are for whoever bounds the stack;
/// neither changes a byte that is loaded. Told everything (`-vv`), cargo repeats remarks on what it
/// had not to build again, too.
///
/// # Errors
/// A build that fails, with the compiler's own errors.
pub fn build(
    folders: &Folders,
    toolchain: &Toolchain,
    target: &str,
    kit: Kit,
) -> Result<(), Error> {
    let triple = toolchain.triple(target).to_string();
    // A folder each: cargo lets one build at a time into one.
    let folder = folders.out.join(target);
    let variable = format!("CARGO_TARGET_{}", triple.to_uppercase().replace('-', "_"));
    let mut command = toolchain.build(target);
    command
        .args(["-vv", "--release", "--manifest-path"])
        .arg(&folders.manifest)
        .env("CARGO_TARGET_DIR", &folder)
        .env(format!("{variable}_RUSTFLAGS"), flags(target));
    match kit {
        Kit::Flight => {}
        Kit::Tests => drop(command.args(["--features", "kernels,with-panic"])),
        Kit::Replay => drop(command.args(["--features", "replay"])),
    }
    if let Some(linker) = <&Target>::of_name(target).and_then(|target| toolchain.linker(target)) {
        command.env(format!("{variable}_LINKER"), linker);
    }
    let image = folders.image(target, kit);
    let said = said(&mut command, &image)?;
    // The next build puts another image in this one's place.
    let built = folder.join(&triple).join("release/remora-firmware");
    std::fs::copy(built, &image).map_err(|cause| Error::output(&image, &cause))?;
    if kit == Kit::Flight {
        let remarks = said.lines().filter(|line| line.contains("stack bytes in function"));
        let remarks: BTreeSet<&str> = remarks.collect();
        let text: String = remarks.iter().map(|line| format!("{line}\n")).collect();
        write(&folders.out.join(format!("{target}.remarks")), &text)?;
    }
    Ok(())
}

/// The compiler's flags.
fn flags(target: &str) -> String {
    let remarks = "-C remark=prologepilog";
    match <&Target>::of_name(target) {
        // Names that tell the modules of generic code, as the other compiler's do.
        None => format!("{remarks} -C symbol-mangling-version=v0 -C link-arg=-Wl,--emit-relocs"),
        Some(target) => {
            let gnu = match target.linker.program {
                "lld" => "",
                _ => " -C linker-flavor=ld -C link-arg=-melf32_sparc",
            };
            format!("{remarks} -C target-cpu={} -C link-arg=--emit-relocs{gnu}", target.cpu)
        }
    }
}

/// Runs a build and keeps its output beside its image.
fn said(command: &mut Command, image: &Path) -> Result<String, Error> {
    let failed = |reason: String| Error::input(image, "", reason);
    let output = command.output().map_err(|cause| failed(io_reason(&cause)))?;
    let text = String::from_utf8_lossy(&[output.stderr, output.stdout].concat()).into_owned();
    let name = image.file_name().unwrap_or_default().to_string_lossy();
    write(&image.with_file_name(format!("{name}.build")), &text)?;
    if output.status.success() {
        return Ok(text);
    }
    let errors = text.lines().filter(|line| line.starts_with("error")).take(3);
    let errors: Vec<&str> = errors.collect();
    Err(failed(format!("is not built: {}", errors.join(" / "))))
}

/// Sizes and symbols of an image's file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Built {
    /// Code, constants and initial data, without models [bytes].
    pub image_bytes: u64,
    /// Models [bytes].
    pub model_bytes: u64,
    /// Memory that is zero at the start, without the stack [bytes].
    pub static_bytes: u64,
    /// Address where the request is left.
    pub request: u64,
    /// Symbols by which a panic can be reached; none is the proof that none can.
    pub panics: Vec<String>,
}

/// The symbol of the word that says what to plan.
const REQUEST: &str = "REMORA_REQUEST";

impl Built {
    /// Reads an image.
    ///
    /// # Errors
    /// A file that is no image, or has no symbols to judge by.
    pub fn read(file: &Path) -> Result<Self, Error> {
        let broken = |error: ImageError| Error::input(&error.file, "", error.reason);
        let outline = Outline::read(file).map_err(broken)?;
        let proof = outline.proofs(&PLANNER).panic;
        let panics = match proof.verdict {
            Verdict::Proven | Verdict::Refuted => proof.found,
            Verdict::Unknown | Verdict::NotApplicable => {
                return Err(Error::input(file, "", proof.reason));
            }
        };
        let request = outline.address(REQUEST);
        let request = request.ok_or_else(|| Error::input(file, REQUEST, "no such symbol"))?;
        let sum = |is_meant: &dyn Fn(&str, Kind) -> bool| {
            let sections = outline.sections.iter();
            sections.filter(|s| is_meant(&s.name, s.kind)).map(|s| s.bytes).sum()
        };
        let is_own = |name: &str| ![".stack", ".model"].contains(&name);
        Ok(Self {
            image_bytes: sum(&|name, kind| is_own(name) && kind != Kind::Zero),
            model_bytes: sum(&|name, _| name == ".model"),
            static_bytes: sum(&|name, kind| is_own(name) && kind == Kind::Zero),
            request,
            panics,
        })
    }
}

/// Writes a file of text, made again by every build.
pub fn write(file: &Path, text: &str) -> Result<(), Error> {
    std::fs::write(file, text).map_err(|cause| Error::output(file, &cause))
}

/// All targets that are built: the host's program first.
pub fn with_host<'a>(targets: &'a [&Target]) -> impl Iterator<Item = &'a str> {
    std::iter::once(HOST).chain(targets.iter().map(|target| target.name))
}
