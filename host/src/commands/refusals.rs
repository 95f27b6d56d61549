//! Arguments that are refused before anything is read: a line that says why, in one process.

use super::Cli;
use crate::cli::usage_line;
use clap::Parser;

/// Message with which a command line is refused.
fn refusal(line: &str) -> String {
    let words = std::iter::once("remora").chain(line.split_whitespace());
    match Cli::try_parse_from(words) {
        Ok(_) => panic!("{line}: is taken"),
        Err(error) => {
            assert!(error.use_stderr(), "{line}");
            usage_line(&error)
        }
    }
}

fn refuses(line: &str, message: &str) {
    let found = refusal(line);
    assert!(found.starts_with(message), "{line}\n{found}\nnot: {message}");
    assert_eq!(found.lines().count(), 1, "{line}\n{found}");
}

const MISSING: &str = "the following required arguments were not provided";

#[test]
fn values() {
    for (line, message) in [
        (
            "plan --integrator rk4:3",
            "invalid value 'rk4:3' for '--integrator <NAME>': rk4 needs at least 4 substeps",
        ),
        ("plan --integrator heun", "invalid value 'heun' for '--integrator <NAME>'"),
        ("plan --mode fast", "invalid value 'fast' for '--mode <MODE>'"),
        ("plan --qp osqp", "invalid value 'osqp' for '--qp <QP>'"),
        ("plan --warm-start cold", "invalid value 'cold' for '--warm-start <WARM_START>'"),
        ("plan --jobs 0", "invalid value '0' for '--jobs <J>' [possible values: 1"),
        ("plan --jobs 3", "invalid value '3' for '--jobs <J>' [possible values: 1"),
        ("plan --jobs -1", "invalid value '-1' for '--jobs <J>' [possible values: 1"),
        ("plan --jobs two", "invalid value 'two' for '--jobs <J>' [possible values: 1"),
        ("draw --count 0 --seed 1 --out a.json", "invalid value '0' for '--count <N>'"),
        ("campaign --jobs 0 --out a", "invalid value '0' for '--jobs <J>'"),
        ("campaign --part 0/3 --out a", "invalid value '0/3' for '--part <I/N>': parts are 1/N"),
        ("campaign --part 3 --out a", "invalid value '3' for '--part <I/N>': expected a part"),
        ("campaign --write plants --out a", "invalid value 'plants' for '--write <WHAT>'"),
        ("export --format qp --qp osqp --out a", "invalid value 'osqp' for '--qp <QP>'"),
        ("fly --controller track:9 --out a", "invalid value 'track:9' for '--controller <"),
        (
            "fly --controller replan:0 --out a",
            "invalid value '0' for '--controller <CONTROLLER>': must be positive",
        ),
        (
            "fly --controller replan:soon --out a",
            "invalid value 'soon' for '--controller <CONTROLLER>': is no number",
        ),
        ("mission errors typcal", "invalid value 'typcal' for '[WHICH]'"),
    ] {
        refuses(line, message);
    }
}

#[test]
fn deadlines() {
    for command in ["plan", "campaign --scenarios set.scenarios.json --out a"] {
        let wrong = |value: &str, reason: &str| {
            let message = format!("invalid value '{value}' for '--deadline <SECONDS>': {reason}");
            refuses(&format!("{command} --deadline {value}"), &message);
        };
        for value in ["0", "-1", "-1e-6", "-inf", "nan", "inf", "1e999"] {
            wrong(value, "must be positive and finite");
        }
        wrong("soon", "expected a number of seconds");
        wrong("1s", "expected a number of seconds");
        wrong("--write", "expected a number of seconds");
        let message = "a value is required for '--deadline <SECONDS>'";
        refuses(&format!("{command} --deadline"), message);
    }
    refuses("export --format qp --deadline 1 --out a", "unexpected argument '--deadline' found");
}

#[test]
fn words() {
    for group in ["mission", "learn"] {
        refuses(group, &format!("'remora {group}' requires a subcommand"));
        refuses(&format!("{group} dance"), "unrecognized subcommand 'dance'");
    }
    let gone = ["dance", "submit", "gather a", "rerun a", "safety a", "errors", "import a"];
    for line in gone.into_iter().chain(["envelope", "dataset", "quantise a b", "qp-export"]) {
        refuses(line, "unrecognized subcommand");
    }
    refuses("plan --fast", "unexpected argument '--fast' found");
    refuses("plan --threads 2", "unexpected argument '--threads' found");
    refuses("campaign --draw 3 --seed 1 --out a", "unexpected argument '--draw' found");
}

#[test]
fn what_goes_together() {
    let with = |option: &str| format!("the argument '{option}' cannot be used with");
    for (line, message) in [
        ("draw --count 3 --out a.json", MISSING.to_string()),
        ("campaign --scenarios a.scenarios.json", format!("{MISSING}: --out <DIR>")),
        ("campaign --out a gather b", "the subcommand 'gather' cannot be used with".into()),
        ("campaign --scenarios a --count 3 --seed 1 --out a", with("--scenarios <FILE>")),
        ("fly a.plan.json", format!("{MISSING}: --out <DIR>")),
        ("fly --safety planned", format!("{MISSING}: <PLAN>")),
        ("fly --safety planned a.plan.json --out a", with("--safety <WORLD>")),
        ("fly a.plan.json --safety planned --runs 2", with("--safety <WORLD>")),
        ("fly runs --rerun 3 --errors none", with("--rerun <RUN>")),
        ("fly runs --rerun 3 --safety planned", with("--rerun <RUN>")),
        ("export --format qp", format!("{MISSING}: --out <DIR>")),
        ("export --format qp --step 1 --out a", format!("{MISSING}: <PLAN>")),
        ("export --out a", format!("{MISSING}: --format <FORMAT>")),
        ("export a.plan.json --format oem --id s1-000 --out a", with("[PLAN]")),
        ("export a.plan.json --format oem --qp clarabel --out a", with("[PLAN]")),
    ] {
        refuses(line, &message);
    }
}
