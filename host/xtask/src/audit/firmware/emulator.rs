//! Images run to their end: under QEMU, or the host's program as it is.

use super::image::Built;
use super::plans::Plans;
use super::target::Target;
use remora_host::error::{Error, io_reason};
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Longest run of an image.
const LONGEST: Duration = Duration::from_secs(1800);

/// How often it is asked whether it has ended.
const POLL: Duration = Duration::from_millis(20);

/// Has the host's program plan, and writes what it prints to `log`.
///
/// # Errors
/// A program that cannot be started or ends with an error.
pub fn on_host(program: &Path, plans: &Plans, log: &Path) -> Result<(), Error> {
    let out = File::create(log).map_err(|cause| Error::output(log, &cause))?;
    let mut command = Command::new(program);
    command.args(plans.arguments()).stdout(out);
    finish(&mut command, log)
}

/// Argument of the emulator that leaves a request for plans in an image's memory.
pub fn request(target: &Target, built: &Built, plans: &Plans) -> [String; 1] {
    let (address, word) = (built.request, target.loaded(plans.word()));
    [format!("addr=0x{address:x},data=0x{word:x},data-len=4")]
}

/// Runs an image in the emulator with `left` in its memory, and writes its output to `log`. The
/// emulator retires one instruction a tick and never sleeps, so that counts repeat.
///
/// # Errors
/// An emulator that cannot be started, ends with an error, or does not end.
pub fn emulate(target: &Target, image: &Path, left: &[String], log: &Path) -> Result<(), Error> {
    let mut command = Command::new(target.emulator.program);
    command
        .args(target.board)
        .args(["-display", "none", "-monitor", "none", "-icount", "shift=0,sleep=off"])
        .arg("-serial")
        .arg(format!("file:{}", log.display()))
        .arg("-kernel")
        .arg(image)
        .args(left.iter().flat_map(|left| ["-device".into(), format!("loader,{left}")]))
        .stdout(Stdio::null());
    finish(&mut command, log)
}

/// Waits for the end, for so long.
fn finish(command: &mut Command, log: &Path) -> Result<(), Error> {
    let failed = |reason: String| Error::input(log, "", reason);
    let mut child = command
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .map_err(|cause| failed(io_reason(&cause)))?;
    let started = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) if status.success() => return Ok(()),
            Ok(Some(status)) => return Err(failed(format!("the run ended with {status}"))),
            Ok(None) if started.elapsed() < LONGEST => sleep(POLL),
            ended => {
                let _ = child.kill();
                let _ = child.wait();
                let reason = match ended {
                    Err(cause) => io_reason(&cause),
                    _ => format!("the run did not end within {} s", LONGEST.as_secs()),
                };
                return Err(failed(reason));
            }
        }
    }
}
