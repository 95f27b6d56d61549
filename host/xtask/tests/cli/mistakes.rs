//! Mistakes of users: a mistyped word, a file of another kind, a file that nobody should have given.

use super::bench::Bench;
use super::remora;
use remora_flight::errors_file;
use remora_truth::Errors;
use std::path::Path;

#[test]
fn a_mistyped_word_is_answered_with_the_one_that_was_meant() {
    let bench = Bench::new();
    for (line, meant) in [
        ("audti", "'audit'"),
        ("firmware --twcie", "'--twice'"),
        ("replay a.plan.json --door pyhton", "'python'"),
    ] {
        let run = bench.run(line);
        assert_eq!(run.status, 2, "{line}\n{}", run.err);
        assert_eq!(run.err.lines().count(), 1, "{line}\n{}", run.err);
        assert!(run.err.contains("; tip: ") && run.err.contains(meant), "{line}\n{}", run.err);
        assert!(!run.err.contains("Usage"), "{line}\n{}", run.err);
    }
}

#[test]
fn a_command_is_needed_and_help_is_none_that_fails() {
    let bench = Bench::new();
    let run = bench.solves("--help");
    for text in ["Usage: cargo xtask", "Examples:\n  cargo xtask", "reproduce"] {
        assert!(run.out.contains(text), "{text}\n{}", run.out);
    }
    assert!(bench.solves("--version").out.starts_with("xtask "));
    bench.refuses("", "'cargo xtask' requires a subcommand");
    bench.refuses("dance", "unrecognized subcommand 'dance'");
}

/// Each way to name a file, with the file in the place of `{}`, and what it takes.
const TAKES: [(&str, &str, &str); 2] = [
    ("replay {} --everywhere", "replay", "a plan"),
    ("replay a.plan.json --model {}", "replay --model", "a model"),
];

/// A file of each kind, and the name of the kind.
fn kinds(bench: &Bench) -> Vec<(&'static str, &'static str)> {
    remora(bench, "plan --id pub-000 --out @/a.plan.json");
    remora(bench, "plan --id pub-000 --out @/a.plan.postcard");
    remora(bench, "view @/a.plan.json --out @/a.html");
    remora(bench, "fly @/a.plan.json --keep all --out @/flown");
    bench.write("a.errors.toml", &errors_file::text(&Errors::typical()).unwrap());
    bench.write("a.vehicle.json", "{\"format\": \"remora-vehicle/1\"}");
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    for (name, from) in [
        ("default.mission.toml", "missions/default.mission.toml"),
        ("small.mission.toml", "missions/small.mission.toml"),
        ("dawn.chief.toml", "chiefs/dawn.chief.toml"),
        ("rk4.model", "models/rk4.model"),
        ("rk4.toml", "models/rk4.toml"),
        ("rk4.lineage.toml", "models/rk4.lineage.toml"),
        ("planar.urdf", "urdf/planar.urdf"),
        ("public.csv", "golden/public.csv"),
    ] {
        std::fs::copy(fixtures.join(from), bench.path(name)).unwrap();
    }
    vec![
        ("a.plan.json", "a plan"),
        ("a.plan.postcard", "a plan"),
        ("set.scenarios.json", "a scenario set"),
        ("default.mission.toml", "a mission file"),
        ("small.mission.toml", "a mission file"),
        ("a.errors.toml", "an errors file"),
        ("dawn.chief.toml", "a chief file"),
        ("rk4.model", "a model"),
        ("rk4.toml", "a training's configuration"),
        ("rk4.lineage.toml", "a model's lineage"),
        ("planar.urdf", "a URDF file"),
        ("flown/flights.parquet", "a Parquet table"),
        ("flown/flights.json", "the settings of a folder of flights"),
        ("a.html", "a page"),
        ("a.vehicle.json", "the output of mission show"),
        ("public.csv", "a CSV table"),
    ]
}

#[test]
fn a_file_of_another_kind_is_told_with_its_kind_and_what_is_taken() {
    let bench = Bench::new();
    let kinds = kinds(&bench);
    for (line, what, takes) in TAKES {
        for (file, kind) in kinds.iter().filter(|(_, kind)| *kind != takes) {
            let line = line.replace("{}", file);
            bench.refuses(&line, &format!("{file}: this is {kind}; {what} takes {takes}\n"));
        }
    }
}

#[test]
fn a_mission_of_fewer_nodes_is_refused_where_all_are_needed() {
    let bench = Bench::new();
    bench.write("few.mission.toml", "[horizon]\nnodes = 46\n");
    let refused = "few.mission.toml: horizon.nodes: is 46; this command needs 60";
    bench.refuses("inject --cases 1 --mission few.mission.toml", refused);
}

#[cfg(unix)]
mod hostile {
    use super::super::bench::Bench;
    use std::fs::{self, File};
    use std::process::Command;

    /// A bench with a folder beside it, which holds what must not be read to its end.
    fn hostile() -> (Bench, tempfile::TempDir) {
        (Bench::new(), tempfile::tempdir().unwrap())
    }

    /// Replays a file that is refused with this reason.
    fn refused(bench: &Bench, file: &str, reason: &str) {
        let run = bench.run(&format!("replay {file} --everywhere"));
        assert_eq!(run.status, 2, "{file}\n{}{}", run.out, run.err);
        assert_eq!(run.err.lines().count(), 1, "{file}\n{}", run.err);
        assert!(run.err.contains(reason), "{file}\n{}not: {reason}", run.err);
    }

    #[test]
    fn what_never_ends_is_not_read() {
        let (bench, beside) = hostile();
        let pipe = beside.path().join("pipe");
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for file in [pipe.to_str().unwrap(), "/dev/zero"] {
            refused(&bench, file, &format!("{file}: is not a regular file"));
        }
    }

    #[test]
    fn what_is_far_too_large_or_nested_without_end_is_refused() {
        let (bench, beside) = hostile();
        let large = beside.path().join("large");
        File::create(&large).unwrap().set_len((1 << 30) + 1).unwrap();
        refused(&bench, large.to_str().unwrap(), "large: has 1073741825 bytes; ");
        let zeros = beside.path().join("zeros");
        File::create(&zeros).unwrap().set_len(8 << 20).unwrap();
        refused(&bench, zeros.to_str().unwrap(), "zeros: ");
        let nested = "[".repeat(1_000_000);
        let brackets = beside.path().join("brackets");
        for text in [nested.clone(), format!("{{\"format\": {nested}"), format!("a = {nested}")] {
            fs::write(&brackets, text).unwrap();
            refused(&bench, brackets.to_str().unwrap(), "brackets: ");
        }
    }

    /// Work that resumes does not wait for a pipe in the place of what it left.
    #[test]
    fn what_work_left_is_a_file_or_refused() {
        let (bench, _) = hostile();
        for (line, left) in [
            ("inject --cases 1 --out runs", "inject.journal.jsonl"),
            ("profile --quick --out runs", "profile.journal.jsonl"),
        ] {
            drop(fs::remove_dir_all(bench.path("runs")));
            fs::create_dir(bench.path("runs")).unwrap();
            let pipe = bench.path("runs").join(left);
            assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
            let run = bench.run(line);
            assert_eq!(run.status, 2, "{line}\n{}", run.err);
            assert_eq!(run.err, format!("error: runs/{left}: is not a regular file\n"), "{line}");
        }
    }
}
