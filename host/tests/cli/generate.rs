//! `remora generate`: completions, the manual, schemas.

use super::bench::Bench;
use serde_json::Value;
use std::process::{Command, Stdio};

/// Whether this machine has a program.
fn has(program: &str) -> bool {
    let called = Command::new(program).arg("--version").stdin(Stdio::null()).output();
    called.is_ok_and(|output| output.status.success())
}

/// A bench with what is generated, as `FILE`.
fn generated(kind: &str, file: &str) -> (Bench, String) {
    let bench = Bench::empty();
    let text = bench.solves(&format!("generate {kind}")).out;
    bench.write(file, &text);
    (bench, text)
}

/// Runs a line of a shell that must succeed.
fn shell(bench: &Bench, line: &str) -> String {
    let output = bench.shell(line).output().unwrap();
    assert!(output.status.success(), "{line}\n{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn bash_completes_commands_options_and_names() {
    let (bench, text) = generated("bash", "remora.bash");
    assert!(text.contains("_remora()"), "{text}");
    if !has("bash") {
        return;
    }
    shell(&bench, "bash -n remora.bash");
    for (words, expected) in [
        ("remora ca", "campaign"),
        ("remora plan --sc", "--scrub"),
        ("remora plan --mode fe", "feasible"),
        ("remora plan --id pub-00", "pub-007"),
        ("remora campaign --write nod", "nodes"),
        ("remora mission errors ty", "typical"),
        ("remora generate mission", "mission-schema"),
        ("remora plan --mission remora.b", "remora.bash"),
    ] {
        let script = format!(
            "source ./remora.bash 2>/dev/null; COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); \
             _remora remora \"${{COMP_WORDS[-1]}}\" \"${{COMP_WORDS[-2]}}\" 2>/dev/null; echo \"${{COMPREPLY[@]}}\""
        );
        bench.write("complete.sh", &script);
        let offered = shell(&bench, "bash complete.sh");
        assert!(offered.split_whitespace().any(|word| word == expected), "{words}: {offered}");
    }
}

#[test]
fn zsh_and_fish_get_completions() {
    // Fish offers values of options, but none of a command's own argument.
    let kinds =
        [("zsh", "#compdef remora", "mission-schema"), ("fish", "complete -c remora", "generate")];
    for (kind, head, own) in kinds {
        let (bench, text) = generated(kind, "completions");
        assert!(text.contains(head), "{text}");
        for name in ["pub-007", "feasible", "campaign", own] {
            assert!(text.contains(name), "{kind} has no {name}");
        }
        if has(kind) {
            shell(&bench, &format!("{kind} --no-execute completions"));
        }
    }
}

#[test]
fn the_manual_has_a_page_for_each_command() {
    let (bench, text) = generated("man", "remora.1");
    let pages = text.lines().filter(|line| line.starts_with(".TH ")).count();
    assert_eq!(pages, 18, "{text}");
    for page in ["remora", "remora-plan", "remora-campaign-gather", "remora-mission-errors"] {
        assert!(text.contains(&format!("\n.TH {page} 1")), "no page {page}");
    }
    for section in [".SH NAME", ".SH SYNOPSIS", ".SH OPTIONS", ".SH EXTRA"] {
        assert!(text.contains(section), "no {section}");
    }
    if has("groff") {
        let shown = shell(&bench, "groff -man -Tascii -P-cbou remora.1");
        assert!(shown.contains("Plan one approach and write the plan"), "{shown}");
    }
}

#[test]
fn schemas_are_json() {
    for kind in ["mission", "scenarios", "errors"] {
        let (bench, _) = generated(&format!("{kind}-schema"), "a.schema.json");
        let schema: Value = bench.json("a.schema.json");
        assert_eq!(schema["additionalProperties"], false);
        assert!(schema["properties"].as_object().unwrap().len() > 1, "{schema}");
    }
}

#[test]
fn nothing_goes_beside_it() {
    let bench = Bench::empty();
    bench.refuses("generate man plan", "unexpected argument 'plan' found");
    bench.refuses("generate manual", "invalid value 'manual' for '<KIND>'");
}
