//! The archive and its header as a C compiler sees them: built once, installed, linked, run.
//!
//! Needs what `ci/install-c.sh` needs, and a C and a C++ compiler with their sanitizers.

mod common;
#[cfg(all(target_os = "linux", target_arch = "x86_64", target_env = "gnu"))]
mod trapping;

use common::{SANITIZED, STRICT, golden, link, output, prefix, public_scenarios, root};
use remora_capi::*;
use remora_core::prelude::*;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// A C program against the installed package, with sanitizers that end it.
fn program(source: &str, name: &str) -> PathBuf {
    let mut command = Command::new("cc");
    command.arg("-std=c99").args(STRICT).args(SANITIZED).arg(root().join(source));
    link(&mut command, prefix(), prefix().join(name))
}

/// The plan of the example by the Rust planner.
fn checksum(integrator: Integrator) -> String {
    let mission = Mission::default().validated().unwrap();
    let scenario = Scenario {
        target_rate: Vector3::new(2.0e-4, 0.0, 1.0e-3),
        position: Vector3::new(8.0, 0.0, 0.0),
        ..Scenario::default()
    };
    let options = Options::builder().integrator(integrator).build().unwrap();
    let mut planner = Box::new(Planner::new());
    let plan = planner.plan(&mission, &scenario.validated().unwrap(), &options).unwrap();
    assert!(plan.is_verified());
    format!("{:016x}", plan.record().output)
}

// Verifies REM-DOR-002.
#[test]
fn the_example_runs_clean_and_plans_what_rust_plans() {
    let program = program("docs/examples/c/plan.c", "plan");
    let flown = output(&mut Command::new(&program));
    let ends = format!("verified 1  checksum {}\n", checksum(Integrator::RK4));
    assert!(flown.ends_with(&ends), "{flown}{ends}");
    assert_eq!(flown.lines().filter(|line| line.contains(" s  x ")).count(), 60);
    assert_eq!(flown.lines().filter(|line| line.starts_with("mode 0  force ")).count(), 5);
    let euler = output(Command::new(&program).arg("euler"));
    let ends = format!("verified 1  checksum {}\n", checksum(Integrator::Euler));
    assert!(euler.ends_with(&ends), "{euler}{ends}");
}

/// Each public scenario with both integrators, from heuristic and model, in both modes: the columns of
/// `fixtures/golden/public.csv` in their order.
fn lines() -> String {
    let mut lines = String::new();
    for (_, numbers) in public_scenarios() {
        let all: Vec<String> = numbers.iter().map(|x| format!("{x:e}")).collect();
        for (integrator, mode, learned) in
            [(1, 0, 0), (1, 0, 1), (1, 1, 0), (1, 1, 1), (0, 0, 0), (0, 0, 1), (0, 1, 0), (0, 1, 1)]
        {
            writeln!(lines, "{mode} {integrator} 4 {learned} {}", all.join(" ")).unwrap();
        }
    }
    lines
}

// Verifies REM-DOR-002.
#[test]
fn every_public_scenario_has_the_golden_bits_from_c() {
    let models = ["euler", "rk4"].map(|name| root().join(format!("fixtures/models/{name}.model")));
    let mut command = Command::new(program("core/capi/tests/golden.c", "golden"));
    let command = command.args(models).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().unwrap();
    // What comes back is shorter than a pipe holds: nobody waits for the other.
    child.stdin.take().unwrap().write_all(lines().as_bytes()).unwrap();
    let ended = child.wait_with_output().unwrap();
    assert!(ended.status.success(), "{:?}", ended.status);
    let found = String::from_utf8(ended.stdout).unwrap();
    let golden = golden().concat();
    assert!(golden.len() >= 96, "{}", golden.len());
    assert_eq!(found.lines().collect::<Vec<_>>(), golden);
}

/// Runs the example and the golden plans with traps enabled: all public scenarios, and a flight.
#[test]
#[cfg(all(target_os = "linux", target_arch = "x86_64", target_env = "gnu"))]
fn the_example_and_the_public_scenarios_run_where_the_host_traps() {
    let build = |source: &str, name: &str| {
        let mut command = Command::new("cc");
        command.arg("-std=c99").args(STRICT).arg(root().join(source));
        link(&mut command, prefix(), prefix().join(name))
    };
    let program = build("docs/examples/c/plan.c", "plan-traps");
    for integrator in [Integrator::RK4, Integrator::Euler] {
        let mut command = Command::new(&program);
        command.args((integrator == Integrator::Euler).then_some("euler"));
        let text = trapping::run(&mut command);
        assert!(text.ends_with(&format!("checksum {}\n", checksum(integrator))), "{text}");
    }
    let scenarios = prefix().join("scenarios.txt");
    std::fs::write(&scenarios, lines()).unwrap();
    let models = ["euler", "rk4"].map(|name| root().join(format!("fixtures/models/{name}.model")));
    let mut command = Command::new(build("core/capi/tests/golden.c", "golden-traps"));
    command.args(models).stdin(std::fs::File::open(scenarios).unwrap());
    let text = trapping::run(&mut command);
    assert_eq!(text.lines().collect::<Vec<_>>(), golden().concat());
}

/// A task of 48 KiB, three times the default of the core Flight System, plans and plans again.
#[test]
fn planning_from_c_fits_a_small_stack() {
    let program = program("core/capi/tests/stack.c", "stack");
    let text = output(&mut Command::new(program));
    let used: Vec<u64> = text
        .lines()
        .map(|line| line.split_whitespace().nth(1).and_then(|n| n.parse().ok()).expect("bytes"))
        .collect();
    let &[plan, replan, guide] = used.as_slice() else { panic!("{text}") };
    assert!((20_000..40 << 10).contains(&plan), "{text}");
    assert!((20_000..40 << 10).contains(&replan), "{text}");
    assert!((1_000..8 << 10).contains(&guide), "{text}");
}

// Verifies REM-DOR-001.
#[test]
fn the_archive_needs_three_functions_and_knows_no_panic() {
    let archive = prefix().join("lib/libremora.a");
    let symbols = |kind: &str| -> Vec<String> {
        let text = output(Command::new("nm").args([kind, "-g"]).arg(&archive));
        let names = text.lines().filter_map(|line| line.split_whitespace().last());
        names.filter(|name| !name.ends_with(':')).map(String::from).collect()
    };
    let needed = symbols("-u");
    assert!(!needed.is_empty());
    for name in needed {
        assert!(["memcpy", "memmove", "memset"].contains(&name.as_str()), "needs {name}");
    }
    let header = std::fs::read_to_string(prefix().join("include/remora.h")).unwrap();
    let offered = symbols("--defined-only");
    assert!(offered.len() >= 14, "{offered:?}");
    for name in offered {
        assert!(header.contains(&format!("{name}(")), "the archive has {name}, the header not");
    }
    // Neither a handler nor a text of the standard library's panics: no code reaches them.
    let bytes = std::fs::read(&archive).unwrap();
    for word in ["panicked", "rust_begin_unwind", "index out of bounds"] {
        let found = bytes.windows(word.len()).any(|window| window == word.as_bytes());
        assert!(!found, "the archive holds '{word}'");
    }
}

#[test]
fn the_header_is_c99_and_cpp17_by_itself() {
    for (compiler, language, standard) in [("cc", "c", "-std=c99"), ("c++", "c++", "-std=c++17")] {
        let source = prefix().join(format!("header.{language}"));
        std::fs::write(&source, "#include <remora.h>\n#include <remora.h>\n").unwrap();
        let mut command = Command::new(compiler);
        command.args(["-x", language, standard, "-fsyntax-only"]).args(STRICT);
        output(command.arg("-I").arg(prefix().join("include")).arg(source));
    }
}

/// Compilers for bare metal make enumerations as short as they can. Structures must not change by that.
#[test]
fn codes_and_structures_have_the_sizes_of_the_archive_with_short_enums_too() {
    let codes = [
        "Status",
        "Mode",
        "Integrator",
        "Switch",
        "Verdict",
        "SolveStatus",
        "Start",
        "Fallback",
        "Refusal",
        "FlightMode",
        "Reason",
        "Request",
    ];
    let structures = [
        ("Mission", size_of::<RemoraMission>()),
        ("Scenario", size_of::<RemoraScenario>()),
        ("Options", size_of::<RemoraOptions>()),
        ("Guidance", size_of::<RemoraGuidance>()),
        ("Estimate", size_of::<RemoraEstimate>()),
        ("Limits", size_of::<RemoraLimits>()),
        ("Command", size_of::<RemoraCommand>()),
        ("Report", size_of::<RemoraReport>()),
        ("Node", size_of::<RemoraNode>()),
        ("Verification", size_of::<RemoraVerification>()),
        ("Record", size_of::<RemoraRecord>()),
    ];
    let mut text = String::from("#include <remora.h>\n");
    for (name, size) in codes.map(|name| (name, 4)).into_iter().chain(structures) {
        let check =
            format!("typedef char size_of_{name}[sizeof(Remora{name}) == {size} ? 1 : -1];");
        writeln!(text, "{check}").unwrap();
    }
    for (compiler, language) in [("cc", "c"), ("c++", "c++")] {
        let source = prefix().join(format!("sizes.{language}"));
        std::fs::write(&source, &text).unwrap();
        let mut command = Command::new(compiler);
        command.args(["-x", language, "-fshort-enums", "-fsyntax-only"]).args(STRICT);
        output(command.arg("-I").arg(prefix().join("include")).arg(source));
    }
}

/// Whether a program is there.
fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

#[test]
fn pkg_config_finds_what_was_installed() {
    let file = prefix().join("lib/pkgconfig/remora.pc");
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains(&format!("Version: {}\n", env!("CARGO_PKG_VERSION"))), "{text}");
    if !is_there("pkg-config") {
        eprintln!("no pkg-config here: only its file's version was looked at");
        return;
    }
    let mut command = Command::new("pkg-config");
    command.env("PKG_CONFIG_PATH", file.parent().unwrap());
    let flags = output(command.args(["--cflags", "--libs", "remora"]));
    let mut command = Command::new("cc");
    command.arg(root().join("docs/examples/c/plan.c")).args(flags.split_whitespace());
    output(command.arg("-o").arg(prefix().join("by-pkg-config")));
}

#[test]
fn cmake_finds_what_was_installed() {
    let folder = prefix().join("lib/cmake/Remora");
    let version = std::fs::read_to_string(folder.join("RemoraConfigVersion.cmake")).unwrap();
    assert!(version.contains(&format!("\"{}\"", env!("CARGO_PKG_VERSION"))), "{version}");
    assert!(!version.contains('@'), "{version}");
    if !is_there("cmake") {
        eprintln!("no cmake here: only its file's version was looked at");
        return;
    }
    let project = prefix().join("project");
    std::fs::create_dir_all(&project).unwrap();
    let plan = root().join("docs/examples/c/plan.c");
    let lists = format!(
        "cmake_minimum_required(VERSION 3.13)\nproject(plan C)\nfind_package(Remora 0.1 REQUIRED)\n\
         add_executable(plan {})\ntarget_link_libraries(plan Remora::remora)\n",
        plan.display()
    );
    std::fs::write(project.join("CMakeLists.txt"), lists).unwrap();
    let mut command = Command::new("cmake");
    command.arg("-S").arg(&project).arg("-B").arg(project.join("build"));
    output(command.arg(format!("-DCMAKE_PREFIX_PATH={}", prefix().display())));
    output(Command::new("cmake").arg("--build").arg(project.join("build")));
    assert!(project.join("build/plan").exists());
}
