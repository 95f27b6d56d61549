//! The crate from outside: against Pinocchio, against the tree evaluated directly, and with files
//! that are wrong.

mod chains;
mod hostile;
mod reference;
mod refusals;
mod scene;
mod traps;

use remora_urdf::{Arm, Options, Refusal, import};
use std::fs;
use std::path::{Path, PathBuf};

/// A file of `fixtures/urdf`.
fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/urdf").join(name)
}

fn text(name: &str) -> String {
    fs::read_to_string(fixture(name)).unwrap()
}

/// Options from flags as a command line has them, `--flag value`.
fn options(flags: &str) -> Options {
    let mut options = Options::default();
    let words: Vec<&str> = flags.split_whitespace().collect();
    for flag in words.chunks(2) {
        match flag[0] {
            "--end-effector" => options.end_effector = Some(flag[1].to_owned()),
            "--base-link" => options.root = Some(flag[1].to_owned()),
            "--limit" => options.add_limit(flag[1]).unwrap(),
            "--hold" => options.add_hold(flag[1]).unwrap(),
            "--point-mass" => assert!(options.point_masses.insert(flag[1].to_owned())),
            "--mount" => options.set_mount(flag[1]).unwrap(),
            other => panic!("{other}"),
        }
    }
    options
}

fn read(text: &str, flags: &str) -> Result<Arm, Refusal> {
    import("arm.urdf", text.as_bytes(), &options(flags))
}

/// Flags that `gripper.urdf` needs.
const GRIPPER: &str =
    "--end-effector tool --hold left=0.02 --hold head_turn=0.7 --limit forearm_pitch=-2,2,0.2,8";
