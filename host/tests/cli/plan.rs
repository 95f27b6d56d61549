//! `remora plan`

use super::bench::{Bench, SLOW, timeless};
use remora_host::formats::{EvidenceFile, PlanFile};

#[test]
fn without_arguments_it_plans_a_built_in_scenario() {
    let bench = Bench::new();
    let run = bench.solves("");
    let plan = bench.json("runs/pub-000.plan.json");
    assert_eq!(plan["format"], "remora-plan/2");
    assert_eq!((&plan["status"], &plan["mode"]), (&"solved".into(), &"optimal".into()));
    assert_eq!((&plan["integrator"], &plan["qp"]), (&"rk4".into(), &"embedded".into()));
    assert_eq!(plan["warm_start"], "model");
    for text in
        ["scenario pub-000: solved", "reorientation", "ee_angle", "written: runs/pub-000.plan"]
    {
        assert!(run.out.contains(text), "{text} in\n{}", run.out);
    }
    assert!(run.out.lines().all(|line| line.len() <= 100), "{}", run.out);
    // The eleven of the paper's problem, and clearance.
    assert_eq!(run.out.matches(" ok ").count(), 12, "{}", run.out);
    assert!(run.out.contains("\nverdict: optimal\n"), "{}", run.out);
    assert!(run.out.contains("\narm to target"), "{}", run.out);
    assert_eq!(plan["verdict"], "optimal");
    assert_eq!(bench.json("runs/pub-000.evidence.json")["verdict"], "optimal");
    for pair in ["arm", "bus", "own"] {
        let closest = plan["clearances"][pair].as_object().unwrap();
        assert_eq!(closest.keys().collect::<Vec<_>>(), ["body", "distance_m", "time_s"]);
    }
}

// Verifies REM-PLN-005.
#[test]
fn twice_the_same_is_the_same_but_for_times() {
    let bench = Bench::new();
    let plan = "plan --scenarios set.scenarios.json --id s1-001 --integrator euler --out";
    bench.solves(&format!("{plan} a.plan.json"));
    bench.solves(&format!("{plan} b.plan.json"));
    let plan = bench.json("a.plan.json");
    assert_eq!(plan["scenario"], "s1-001");
    assert_eq!(timeless(plan.clone()), timeless(bench.json("b.plan.json")));
    let lines = |name: &str| -> Vec<String> {
        let text = bench.read(name);
        text.lines().filter(|line| !line.contains("_s\":")).map(String::from).collect()
    };
    assert_eq!(lines("a.plan.json"), lines("b.plan.json"));
    assert_eq!(bench.read("a.evidence.json"), bench.read("b.evidence.json"));
    let evidence = bench.json("a.evidence.json");
    assert_eq!(evidence["format"], "remora-evidence/2");
    assert_eq!((&evidence["scenario"], &evidence["status"]), (&plan["scenario"], &plan["status"]));
    assert_eq!(evidence["is_verified"], true);
}

#[test]
fn scrubbed_it_is_the_same_but_for_times() {
    let bench = Bench::new();
    for deadline in ["", "--deadline 1000"] {
        let plan = format!("plan --integrator euler {deadline} --force --out");
        bench.solves(&format!("{plan} a.plan.json"));
        bench.solves(&format!("{plan} b.plan.json --scrub"));
        let [a, b] = ["a", "b"].map(|name| timeless(bench.json(&format!("{name}.plan.json"))));
        assert_eq!(a, b);
        assert_eq!(bench.read("a.evidence.json"), bench.read("b.evidence.json"));
    }
}

// Verifies REM-PLN-006.
#[test]
fn two_threads_write_the_same_plan_but_for_times() {
    let bench = Bench::new();
    for integrator in ["euler", "rk4:4"] {
        for threads in ["1", "2"] {
            let plan = format!("plan --mode feasible --integrator {integrator}");
            bench.solves(&format!("{plan} --jobs {threads} --out {threads}.plan.json"));
        }
        assert_eq!(timeless(bench.json("1.plan.json")), timeless(bench.json("2.plan.json")));
        assert_eq!(bench.read("1.evidence.json"), bench.read("2.evidence.json"));
    }
}

#[test]
fn a_deadline_that_is_not_reached_changes_nothing() {
    let bench = Bench::new();
    let plan = "plan --mode feasible --integrator euler --out";
    bench.solves(&format!("{plan} a.plan.json"));
    bench.solves(&format!("{plan} b.plan.json --deadline 1e6"));
    assert_eq!(timeless(bench.json("a.plan.json")), timeless(bench.json("b.plan.json")));
}

#[test]
fn out_of_time_it_writes_what_it_has() {
    let bench = Bench::new();
    let set = "--scenarios set.scenarios.json";
    for qp in ["embedded", "clarabel"] {
        let run = bench.run(&format!("plan {set} --deadline 1e-6 --qp {qp}"));
        assert_eq!(run.status, 1, "{}", run.err);
        assert!(run.out.contains("scenario s1-000: deadline\n"), "{}", run.out);
        assert_eq!(bench.json("runs/s1-000.plan.json")["status"], "deadline");
        let check = bench.run("check runs/s1-000.plan.json");
        assert_eq!(check.status, 1, "{}", check.err);
        assert!(check.out.contains("\nverdict: not flyable, "), "{}", check.out);
    }
}

/// What a spacecraft would send down is read by whatever reads plans.
#[test]
fn a_plan_may_be_a_packet() {
    let bench = Bench::new();
    let plan = "plan --integrator euler --scenarios set.scenarios.json --mission a.mission.toml";
    bench.write("a.mission.toml", "[servicer]\nbus_mass_kg = 450.0\n");
    let postcard = "--out runs/s1-000.plan.postcard";
    std::fs::create_dir(bench.path("runs")).unwrap();
    let run = bench.solves(&format!("{plan} {postcard}"));
    assert!(run.out.contains("\nwritten: runs/s1-000.plan.postcard\nsizes: plan 1"), "{}", run.out);
    assert_eq!(bench.names("runs"), ["s1-000.evidence.postcard", "s1-000.plan.postcard"]);
    let check = bench.solves("check --strict runs/s1-000.plan.postcard");
    assert!(check.out.contains("\nverdict: verified and locally optimal"), "{}", check.out);
    bench.solves("view runs/s1-000.plan.postcard");
    assert!(bench.path("runs/s1-000.html").is_file());
    // It is the plan that JSON would hold.
    bench.solves(&format!("{plan} --out a.plan.json"));
    let numbers = |file: &str| {
        let plan = PlanFile::read(&bench.path(file)).unwrap();
        let stages = (plan.stage1.position, plan.stage2.joint_torque, plan.residuals);
        (plan.inputs, plan.grid, plan.target, plan.clearances, stages)
    };
    assert!(numbers("a.plan.json") == numbers("runs/s1-000.plan.postcard"));
    let evidence = |file: &str| EvidenceFile::read(&bench.path(file)).unwrap();
    assert_eq!(evidence("a.evidence.json"), evidence("runs/s1-000.evidence.postcard"));

    let size = |file: &str| std::fs::metadata(bench.path(file)).unwrap().len();
    assert!(3 * size("runs/s1-000.plan.postcard") < size("a.plan.json") + 10_000);
    let mut damaged = std::fs::read(bench.path("runs/s1-000.plan.postcard")).unwrap();
    damaged[999] ^= 1;
    bench.write("b.plan.postcard", &damaged);
    bench
        .refuses("check b.plan.postcard", "b.plan.postcard: is damaged: its CRC-32 does not match");
}

#[test]
fn verbose_shows_the_iterations() {
    let bench = Bench::new();
    let run = bench.solves("plan -v --mode feasible --integrator euler");
    for text in [
        "Stage 1, translation",
        "Stage 2, reorientation",
        "QP status",
        "feasible mode",
        "time: start",
    ] {
        assert!(run.out.contains(text), "{text} in\n{}", run.out);
    }
    assert_eq!(bench.json("runs/pub-000.plan.json")["mode"], "feasible");
}

/// A mission alone is enough: its scenario is the first that `draw` makes for it.
#[test]
fn a_mission_of_ones_own_gets_a_scenario_of_its_own() {
    let bench = Bench::new();
    let far = "[approach]\nkeep_out_far_m = 9.0\n[scenarios]\nstandoff_m = 14.0\n";
    bench.write("far.mission.toml", far);
    let plan = "plan --mission far.mission.toml --mode feasible --integrator euler";
    let run = bench.solves(plan);
    assert!(run.out.starts_with("scenario s1-000: solved\n"), "{}", run.out);
    assert!(run.out.contains("written: runs/s1-000.plan.json\n"), "{}", run.out);
    bench.solves("draw --count 1 --seed 1 --mission far.mission.toml --out far.scenarios.json");
    bench.solves(&format!("{plan} --scenarios far.scenarios.json --out a.plan.json"));
    let inputs = |file: &str| bench.json(file)["inputs"].clone();
    assert_eq!(inputs("runs/s1-000.plan.json"), inputs("a.plan.json"));
    // A named scenario is taken as it is, and may be refused.
    let run = bench.run(&format!("{plan} --id pub-000"));
    assert_eq!(run.status, 1, "{}", run.out);
    assert!(run.out.contains("keep_out: the start is "), "{}", run.out);
    // A mission without any possible start is refused with that reason.
    bench.write("wide.mission.toml", "[approach]\nkeep_out_far_m = 50\n");
    let reason = "--mission: its geometry lets no start satisfy keep-out and pointing";
    bench.refuses("plan --mission wide.mission.toml", reason);
}

#[test]
fn what_is_not_solved_is_written_all_the_same() {
    let bench = Bench::new();
    bench.write("weak.mission.toml", "[servicer]\nbus_torque_limit_n_m = 1e-6\n");
    let run = bench.run("plan --mission weak.mission.toml --id pub-000 --integrator euler");
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(run.out.contains("TOO LARGE"), "{}", run.out);
    let failed = "\nverdict: not flyable, dynamics2 is farthest beyond its tolerance\n";
    assert!(run.out.contains(failed), "{}", run.out);
    assert_eq!(bench.json("runs/pub-000.plan.json")["verdict"], "not_flyable");
    assert_ne!(bench.json("runs/pub-000.plan.json")["status"], "solved");
    let check = bench.run("check runs/pub-000.plan.json");
    assert_eq!(check.status, 1, "{}", check.err);
    assert!(check.out.contains("\nverdict: not flyable, "), "{}", check.out);
}

// Verifies REM-PLN-014.
#[test]
fn what_no_plan_can_end_well_is_refused_by_name_before_planning() {
    let bench = Bench::new();
    let refused = |mission: &str, text: &str| {
        bench.write("bad.mission.toml", mission);
        let run = bench.run("plan --mission bad.mission.toml --id pub-000");
        assert_eq!((run.status, run.err.as_str()), (1, ""), "{}", run.out);
        assert!(run.out.starts_with("scenario pub-000: infeasible\n"), "{}", run.out);
        assert!(run.out.contains(&format!("\nverdict: not flyable, {text}")), "{}", run.out);
        assert!(run.out.ends_with("\nno plan was made\n"), "{}", run.out);
    };
    refused("[horizon]\nduration_s = 60\n", "joint_rate: joint 2 has to turn 50.3 deg");
    refused("[servicer]\nforce_limit_n = 1e-4\n", "force: to be in front of the port in time");
    refused("[approach]\nkeep_out_far_m = 20\n", "keep_out: the start is ");
    refused("[servicer]\nboresight = [1, 0, 0]\n", "capture_view: in the capture configuration");
    refused("[target]\nport_position_m = [9, 0, 0.2]\n", "field_of_view: at the start the port");
    assert_eq!(bench.names("."), ["bad.mission.toml", "set.scenarios.json"]);
    let mut set = bench.json("set.scenarios.json");
    set["scenarios"][0]["target"]["rate"] = serde_json::json!([0.0, 0.05, 0.0]);
    bench.write("fast.scenarios.json", &set.to_string());
    let run = bench.run("plan --scenarios fast.scenarios.json");
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(run.out.contains("tumble: the target turns "), "{}", run.out);
    assert!(run.out.contains("can be followed: shorten the horizon to "), "{}", run.out);
}

/// Some scenarios of a strong vehicle need more than 50 iterations with Euler.
#[test]
fn verified_but_not_converged_has_a_status_of_its_own() {
    let bench = Bench::new();
    bench.takes_too_many_iterations();
    let run = bench.run(&format!("plan {SLOW} --id s1-000"));
    assert_eq!(run.status, 3, "{}{}", run.out, run.err);
    assert!(run.out.contains("\nverdict: verified but not converged\n"), "{}", run.out);
    let plan = bench.json("runs/s1-000.plan.json");
    assert_eq!((&plan["status"], &plan["verdict"]), (&"iteration_limit".into(), &VERIFIED.into()));
    assert_eq!(bench.json("runs/s1-000.evidence.json")["verdict"], VERIFIED);
    let run = bench.run(&format!("campaign {SLOW} --write csv --out runs"));
    assert_eq!(run.status, 3, "{}{}", run.out, run.err);
    assert!(run.out.contains("  verified but not converged       3\n"), "{}", run.out);
    let counts = serde_json::json!({ "optimal": 0, VERIFIED: 3, "not_flyable": 0 });
    assert_eq!(bench.json("runs/summary.json")["by_verdict"], counts);
    assert_eq!(bench.read("runs/results.csv").matches(VERIFIED).count(), 3);
}

const VERIFIED: &str = "verified_not_converged";

#[test]
fn every_command_has_help_with_an_example() {
    let bench = Bench::new();
    let commands = ["", "plan", "campaign", "check", "draw", "export", "mission", "mission show"];
    for command in commands.into_iter().chain(["learn", "learn dataset", "campaign gather"]) {
        let run = bench.solves(&format!("{command} --help"));
        assert!(run.out.contains("Examples:\n  remora"), "{}", run.out);
        assert!(run.out.contains(&format!("remora {command}")), "{}", run.out);
    }
    let version = bench.solves("--version").out;
    assert!(version.starts_with("remora ") && version.contains(" ("), "{version}");
}

#[test]
fn headings_of_help_stand_over_what_they_name() {
    let bench = Bench::new();
    let below = |command: &str, heading: &str, options: &[&str], own: &str| {
        let help = bench.solves(&format!("{command} --help")).out;
        let (before, below) = help.split_once(&format!("\n{heading}:\n")).unwrap();
        for option in options {
            assert!(before.contains(option) && !below.contains(option), "{option}\n{help}");
        }
        assert!(below.contains(own), "{help}");
    };
    let options = ["--out <DIR>", "--json", "--jobs <J>", "--part <I/N>"];
    below("fly", "Flights", &options, "--controller <CONTROLLER>");
    let options = ["--out <DIR>", "--json", "--format <FORMAT>", "--chief <FILE>"];
    below("export", "Subproblems, with --format qp", &options, "--qp <QP>");
}

#[test]
fn a_plan_is_drawn_where_that_is_asked_for() {
    let bench = Bench::new();
    let plan = "plan --mode feasible --integrator euler --write svg --out";
    let run = bench.solves(&format!("{plan} a.plan.json"));
    assert!(run.out.contains("\nwritten: a.svg\nlook at it: "), "{}", run.out);
    assert!(bench.read("a.svg").starts_with("<svg"));
    bench.refuses(&format!("{plan} none/a.plan.json"), "none/a.svg: no such file or directory");
    bench.refuses(&format!("{plan} -"), "--write: svg goes beside the plan's file, and --out -");
}

/// Results as data: on standard output, and nothing else there.
#[test]
fn data_goes_to_standard_output_where_that_is_asked_for() {
    let bench = Bench::new();
    let json = |arguments: &str| -> serde_json::Value {
        let run = bench.solves(arguments);
        serde_json::from_str(&run.out).unwrap_or_else(|error| panic!("{arguments}: {error}"))
    };
    let plan = "plan --mode feasible --integrator euler";
    let piped = json(&format!("{plan} --out -"));
    assert_eq!(bench.names("."), ["set.scenarios.json"]);
    let printed = json(&format!("{plan} --json --out a.plan.json"));
    assert_eq!(timeless(piped), timeless(printed));
    assert_eq!(bench.names("."), ["a.evidence.json", "a.plan.json", "set.scenarios.json"]);
    let checked = json("check --json a.plan.json");
    assert_eq!(checked["format"], "remora-check/1");
    assert_eq!(checked["plans"][0]["verdict"], "optimal");
    assert_eq!(json("draw --count 3 --seed 1 --out -"), bench.json("set.scenarios.json"));
    assert_eq!(json("mission show --json")["format"], "remora-vehicle/1");
    let campaign = "campaign --scenarios set.scenarios.json --integrator euler --out runs";
    assert_eq!(json(&format!("{campaign} --json")), bench.json("runs/summary.json"));
}

#[test]
fn quiet_prints_nothing_and_lists_list() {
    let bench = Bench::new();
    let run = bench.solves("plan --quiet --mode feasible --integrator euler --out a.plan.json");
    assert_eq!((run.out.as_str(), run.err.as_str()), ("", ""));
    let run = bench.solves("campaign -q --scenarios set.scenarios.json --integrator euler --out a");
    assert_eq!((run.out.as_str(), run.err.as_str()), ("", ""));
    let run = bench.solves("plan --list --scenarios set.scenarios.json");
    assert_eq!(run.out.lines().collect::<Vec<_>>(), super::bench::IDS);
    let run = bench.solves("export --list");
    assert_eq!((run.out.lines().count(), run.out.lines().next()), (60, Some("pub-000")));
    let plan = "plan --id pub-007 --mode feasible --integrator euler";
    assert!(bench.solves(plan).out.contains("written: runs/pub-007.plan.json\n"));
}
