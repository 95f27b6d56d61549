//! The tools themselves, run as a user runs them.

/// The program that a bench runs.
const PROGRAM: &str = env!("CARGO_BIN_EXE_xtask");

mod audit;
#[allow(dead_code, reason = "tests of the operator's program use the rest")]
#[path = "../../../tests/cli/bench.rs"]
mod bench;
mod inject;
mod mistakes;
mod profile;
mod replay;
mod reproduce;

use bench::Bench;
use std::ffi::OsString;
use std::thread::Builder;

/// Stack of a program's first thread.
const STACK: usize = 8 << 20;

/// Has the operator's program do what a tool needs done before; `@` stands for the bench's folder.
fn remora(bench: &Bench, arguments: &str) {
    let folder = bench.path("").to_str().unwrap().trim_end_matches('/').to_string();
    let words = ["remora", "--quiet"].into_iter().chain(arguments.split_whitespace());
    let words: Vec<OsString> = words.map(|word| word.replace('@', &folder).into()).collect();
    let program = Builder::new().stack_size(STACK).spawn(|| remora_cli::run(words)).unwrap();
    assert_eq!(program.join().unwrap(), 0, "{arguments}");
}
