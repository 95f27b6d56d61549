//! An image that plans what is handed to it: `ci/firmware/src/replay.rs`.

use super::emulator;
use super::image::{self, Folders, Kit, write};
use super::resolve;
use super::target::{ByteOrder, Target};
use super::toolchain::Toolchain;
use image_audit::Outline;
use remora_host::error::{Error, io_reason};
use remora_host::formats::make_directory;
use std::path::Path;

/// The symbol of the numbers that say what to plan.
const INPUT: &str = "REMORA_INPUT";

/// What became of a plan on another processor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Replayed {
    /// The checksum of the plan.
    Planned(u64),
    /// What is missing to build or run its image.
    Missing(String),
}

/// Builds the image of a processor in a checkout, where that is not done yet, and has it plan what the numbers
/// say. Files go to `scratch`.
///
/// # Errors
/// A build or a run that fails; an image that prints no checksum.
pub fn replay_image(
    root: &Path,
    target: &'static Target,
    numbers: &[f64],
    scratch: &Path,
) -> Result<Replayed, Error> {
    let toolchain = match Toolchain::find(&[target]) {
        Ok(toolchain) => toolchain,
        Err(Error::Argument { reason, .. }) => return Ok(Replayed::Missing(reason)),
        Err(other) => return Err(other),
    };
    let folders = Folders::of(root);
    make_directory(&folders.out)?;
    resolve(root, &folders)?;
    image::build(&folders, &toolchain, target.name, Kit::Replay)?;
    let image = folders.image(target.name, Kit::Replay);

    let outline =
        Outline::read(&image).map_err(|error| Error::input(&error.file, "", error.reason))?;
    let address = outline.address(INPUT);
    let address = address.ok_or_else(|| Error::input(&image, INPUT, "no such symbol"))?;
    let (input, log) = (scratch.join("input.bin"), scratch.join("replay.log"));
    std::fs::write(&input, target.bytes(numbers)).map_err(|cause| Error::output(&input, &cause))?;
    write(&log, "")?;
    let left = format!("file={},addr=0x{address:x},force-raw=on", input.display());
    emulator::emulate(target, &image, &left, &log)?;

    let text =
        std::fs::read_to_string(&log).map_err(|cause| Error::input(&log, "", io_reason(&cause)))?;
    let printed = text.lines().find_map(|line| line.strip_prefix("replay output="));
    let sum = printed.and_then(|word| u64::from_str_radix(word.trim(), 16).ok());
    let reason = "printed no checksum";
    sum.map(Replayed::Planned).ok_or_else(|| Error::input(&image, "", reason))
}

impl Target {
    /// Numbers as the board's memory holds them.
    fn bytes(&self, numbers: &[f64]) -> Vec<u8> {
        let bytes = |number: &f64| match self.byte_order {
            ByteOrder::Little => number.to_le_bytes(),
            ByteOrder::Big => number.to_be_bytes(),
        };
        numbers.iter().flat_map(bytes).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::target::TARGETS;
    use super::*;

    #[test]
    fn numbers_lie_as_the_processor_reads_them() {
        let bytes = |i: usize| TARGETS[i].bytes(&[1.0, -2.0]);
        assert_eq!(bytes(0)[6..8], [0xf0, 0x3f]);
        assert_eq!(bytes(3)[..2], [0x3f, 0xf0]);
        assert_eq!((bytes(3).len(), bytes(3)[8]), (16, 0xc0));
    }
}
