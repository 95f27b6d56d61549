//! `remora submit`

use super::Bench;
use serde_json::Value;
use std::process::Command;

const WORDS: [&str; 6] = [
    "campaign",
    "--count=3",
    "--seed=1",
    "--mission",
    "a b'$HOME`c`\".mission.toml",
    "--out=o u t",
];

fn submit(bench: &Bench, engine: &str, words: &[&str]) -> String {
    let mut command = bench.command(&format!("submit {engine} --parts 3 --program ./told --"));
    let output = command.args(words).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// A program that writes its arguments down, a line each.
fn told(bench: &Bench) {
    bench.write("told", "#!/bin/sh\nprintf '%s\\n' \"$@\" > told.txt\n");
    Command::new("chmod").args(["+x", "told"]).current_dir(bench.path("")).status().unwrap();
}

/// Every word reaches the program as it was given, whatever a shell would make of it.
#[test]
#[cfg(unix)]
fn words_are_quoted() {
    let bench = Bench::new();
    told(&bench);
    let script = submit(&bench, "--slurm", &WORDS);
    assert!(script.contains("\n#SBATCH --array=1-3\n"), "{script}");
    let mut shell = Command::new("sh");
    let shell =
        shell.args(["-c", &script]).env("SLURM_ARRAY_TASK_ID", "2").current_dir(bench.path(""));
    assert!(shell.status().unwrap().success());
    let expected = format!("{}\n--part\n2/3\n--jobs\n1\n", WORDS.join("\n"));
    assert_eq!(bench.read("told.txt"), expected);

    let job = submit(&bench, "--kubernetes", &WORDS);
    assert!(job.contains("completions: 3\n") && job.contains("completionMode: Indexed"), "{job}");
    let words = job.lines().filter_map(|line| line.strip_prefix("        - "));
    let words: Vec<String> = words
        .map(|word| serde_json::from_str::<Value>(word).unwrap().as_str().unwrap().into())
        .collect();
    let mut pod = Command::new(&words[0]);
    let pod = pod.args(&words[1..]).env("JOB_COMPLETION_INDEX", "0").current_dir(bench.path(""));
    assert!(pod.status().unwrap().success());
    assert_eq!(bench.read("told.txt"), expected.replace("2/3", "1/3"));

    let line = submit(&bench, "--parallel", &WORDS);
    assert!(
        line.starts_with("seq 3 | parallel --quote ./told campaign --count=3 --seed=1"),
        "{line}"
    );
    assert!(line.ends_with(" --part {}/3 --jobs 1\n"), "{line}");
}

#[test]
fn what_is_no_command_of_parts_is_refused() {
    let bench = Bench::new();
    let refuses = |arguments: &str, message: &str| {
        bench.refuses(&format!("submit {arguments}"), message);
    };
    let campaign = "-- campaign --count 3000 --seed 1 --out a";
    refuses(&format!("--parts 3 {campaign}"), "the following required arguments were not provided");
    refuses(&format!("--slurm --parts 0 {campaign}"), "invalid value '0' for '--parts <N>'");
    refuses(
        &format!("--slurm --parts 1001 {campaign}"),
        "--parts: is 1001, and arrays of Slurm end at 1000",
    );
    refuses("--slurm --parts 3 -- plan", "COMMAND: ");
    refuses(
        "--slurm --parts 3 -- campaign --seeds 1",
        "COMMAND: unexpected argument '--seeds' found",
    );
    refuses(
        &format!("--slurm --parts 3 {campaign} --part 1/3"),
        "COMMAND: the argument '--part <I/N>'",
    );
    // What would fail in every task, or in some.
    refuses(
        &format!("--slurm --parts 3 {campaign} --jobs 2"),
        "COMMAND: the argument '--jobs <J>' cannot be used multiple times",
    );
    refuses("--slurm --parts 3 -- campaign --help", "COMMAND: asks for help");
    refuses("--slurm --parts 3 -- campaign --seed 1 --out a", "--seed: needs --count N");
    refuses("--slurm --parts 3 -- fly --list --out a", "COMMAND: lists scenarios");
    let few = "--parts: is 10, and of this there can be 5 at most";
    for command in [
        "campaign --count 5 --seed 1 --out a",
        "dataset --count 9 --shard 2 --seed 1 --out a",
        "fly --runs 5 --out a",
    ] {
        refuses(&format!("--kubernetes --parts 10 -- {command}"), few);
    }
    let braces = "--parallel --parts 3 -- campaign --count 5 --seed 1 --out runs/{}";
    refuses(
        braces,
        "COMMAND: \"runs/{}\" holds a brace, by which GNU parallel puts in what it reads",
    );
}
