//! `cargo xtask audit`, in checkouts of little more than what it asks for.

use super::bench::Bench;

/// A checkout around a test and its folder of requirements.
fn checkout() -> Bench {
    let bench = Bench::new();
    for folder in ["ci/firmware", "docs", "core", "host/tests"] {
        std::fs::create_dir_all(bench.path(folder)).unwrap();
    }
    std::fs::create_dir_all(bench.path("fixtures/scenarios")).unwrap();
    bench.write("fixtures/scenarios/audit.scenarios.json", &bench.read("set.scenarios.json"));
    bench.write("ci/firmware/Cargo.toml", "[package]\nname = \"remora-firmware\"\n");
    bench.write(
        "ci/budgets.toml",
        "format = \"remora-budgets/1\"\n[[budget]]\ntarget = \"m7\"\nquantity = \"code_bytes\"\n\
         budget = 1000\nmargin_percent = 1\nwhy = \"a test\"\n",
    );
    bench.write(
        "docs/requirements.csv",
        "id,text,rationale,method,verified_by\n\
         REM-A-001,It works.,It must.,Test,host/tests/a.rs#works\n",
    );
    bench.write("host/tests/a.rs", "// Verifies REM-A-001.\n#[test]\nfn works() {}\n");
    bench
}

#[test]
fn help_shows_how_to_use_it() {
    let run = Bench::new().solves("audit --help");
    assert!(run.out.contains("Examples:\n  cargo xtask audit"), "{}", run.out);
}

#[test]
fn one_part_is_measured_and_written_as_a_page() {
    let bench = checkout();
    let run = bench.run("audit --only loops --out pages --root .");
    assert_eq!(run.status, 0, "{}{}", run.out, run.err);
    assert!(run.err.contains("1/1  loops"), "{}", run.err);
    let mut names = bench.names("pages");
    names.sort();
    assert_eq!(names, ["audit.html", "audit.json", "record.csv", "results.md"]);
    assert!(bench.read("pages/record.csv").contains("\nloops,\"rk4, model\",plans,63\n"));
    let page = bench.read("pages/results.md");
    for part in [
        "\n## Loops\n",
        "| solver_iterations |",
        "[memory](#memory) not measured",
        "\n## Requirements\n\n1 requirements, 0 of them missed.",
    ] {
        assert!(page.contains(part), "{part}\n{page}");
    }
    let html = bench.read("pages/audit.html");
    assert!(html.contains("<section id=\"loops\">") && !html.contains("src="));
    let numbers = bench.json("pages/audit.json");
    assert_eq!(numbers["format"], "remora-audit/1");
    let loops = &numbers["sections"]["loops"];
    assert_eq!(loops["findings"]["observed"][0]["plans"], 63);
    assert!(loops["provenance"]["compiler"].as_str().unwrap().starts_with("rustc"));

    // A requirement that nothing verifies any more is a fault, a page that was edited is stale.
    bench.write("host/tests/a.rs", "fn works() {}\n");
    bench.write("pages/results.md", "# Loops\n");
    // It ends where it would build images: nothing to build them with is on the path.
    for arguments in ["audit --check --out pages --root .", "firmware --root ."] {
        let output = bench.command(arguments).env("PATH", bench.path("pages")).output().unwrap();
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{err}");
        assert!(err.contains("error: firmware images: missing: a Rust toolchain"), "{err}");
    }
}

#[test]
fn what_an_audit_cannot_be_made_of_is_refused() {
    let bench = checkout();
    bench.refuses("audit --root docs", "docs: is no checkout");
    bench.refuses("audit --check --out none --root .", "none/record.csv: no such file: run");
    bench.refuses("firmware --root docs", "docs: is no checkout");
    bench.refuses("firmware --target z80", "invalid value 'z80'");
    bench.refuses("firmware --extent many", "invalid value 'many'");
    bench.refuses("audit --only everything", "invalid value 'everything'");
    bench.refuses("audit --check --only loops", "the argument '--check' cannot be used with");
    bench.write("ci/budgets.toml", "format = \"remora-budgets/1\"\nbudget = 3\n");
    bench.refuses("audit --only loops --root .", "./ci/budgets.toml: budget: invalid type");
    let other = Bench::new();
    other.refuses("audit --only loops", "--root: the working folder is in no checkout");
}
