//! An image that plans what is handed to it: `ci/firmware/src/replay.rs`.

use super::emulator;
use super::image::{self, Folders, Kit, write};
use super::resolve;
use super::target::{ByteOrder, Target};
use super::toolchain::Toolchain;
use image_audit::Outline;
use remora_host::error::Error;
use remora_host::formats::{Limit, make_directory, read_text};
use std::path::Path;

/// The symbol of the numbers that say what to plan.
const INPUT: &str = "REMORA_INPUT";

/// Outcome of a plan on another processor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Replayed {
    /// The checksum of the plan.
    Planned(u64),
    /// Tools that are missing to build or run its image.
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
    let log = scratch.join("replay.log");
    write(&log, "")?;
    emulator::emulate(target, &image, &target.left(address, numbers), &log)?;

    let text = read_text(&log, Limit::BINARY)?;
    let printed = text.lines().find_map(|line| line.strip_prefix("replay output="));
    let sum = printed.and_then(|word| u64::from_str_radix(word.trim(), 16).ok());
    let reason = "printed no checksum";
    sum.map(Replayed::Planned).ok_or_else(|| Error::input(&image, "", reason))
}

impl Target {
    /// Arguments of the emulator that leave the numbers in the board's memory, one each. The image already holds
    /// the place where a file would go.
    fn left(&self, address: u64, numbers: &[f64]) -> Vec<String> {
        let is_big = if self.byte_order == ByteOrder::Big { "on" } else { "off" };
        let at = (address..).step_by(size_of::<f64>());
        let entry = |(at, number): (u64, &f64)| {
            format!("addr=0x{at:x},data=0x{:x},data-len=8,data-be={is_big}", number.to_bits())
        };
        at.zip(numbers).map(entry).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::audit::firmware::target::TARGETS;

    #[test]
    fn numbers_lie_as_the_processor_reads_them() {
        let left = |i: usize| TARGETS[i].left(0x2000_0008, &[1.0, -2.0]).join(" ");
        let first = "addr=0x20000008,data=0x3ff0000000000000,data-len=8";
        let second = "addr=0x20000010,data=0xc000000000000000,data-len=8";
        assert_eq!(left(0), format!("{first},data-be=off {second},data-be=off"));
        assert_eq!(left(3), format!("{first},data-be=on {second},data-be=on"));
    }
}
