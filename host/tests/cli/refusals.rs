//! Bad input: one line, status 2, nothing written.

use super::bench::Bench;

/// The set with one piece of its text replaced, as `bad.scenarios.json`.
fn bad_set(bench: &Bench, from: &str, to: &str) {
    let text = bench.read("set.scenarios.json");
    assert!(text.contains(from), "{from} in\n{text}");
    bench.write("bad.scenarios.json", &text.replacen(from, to, 1));
}

// Verifies REM-IO-001.
#[test]
fn scenario_sets() {
    let bench = Bench::new();
    let refuses = |from: &str, to: &str, message: &str| {
        bad_set(&bench, from, to);
        for command in [
            "plan --scenarios bad.scenarios.json",
            "campaign --scenarios bad.scenarios.json --out runs",
            "check --scenarios bad.scenarios.json a.plan.json",
        ] {
            bench.refuses(command, &format!("bad.scenarios.json: {message}"));
        }
    };
    refuses("remora-scenarios/1", "remora-scenarios/7", "format: unknown format");
    refuses("\"format\"", "\"form\"", "format: missing");
    refuses("\"rate\"", "\"spin\"", "scenarios[0].target.spin: unknown field `spin`");
    refuses("\"s1-001\"", "\"s1-000\"", "scenarios[1].id: \"s1-000\" is used twice");
    refuses("\"s1-002\"", "\"../s1\"", "scenarios[2].id: \"../s1\": an id is");
    refuses("\"s1-002\"", "\"a/b\"", "scenarios[2].id: \"a/b\": an id is");
    refuses("\"s1-002\"", "\"a\\\\b\"", "scenarios[2].id: \"a\\\\b\": an id is");
    refuses("\"s1-002\"", "\"\"", "scenarios[2].id: \"\": an id is");
    refuses("\"s1-002\"", "17", "scenarios[2].id: invalid type: integer `17`");
    refuses("[0.", "[0.9,0.", "scenarios[");
    refuses("\"position\": [", "\"position\": [NaN,", "scenarios[0]: expected value at line");
    refuses(
        "\"position\": [",
        "\"position\": [null,",
        "scenarios[0].servicer.position[0]: invalid",
    );
    refuses(
        "\"position\": [",
        "\"position\": [1e999,",
        "scenarios[0].servicer.position[0]: number out of range",
    );
    refuses("\"position\": [", "\"position\": [1e99,", "scenarios[0].servicer.position: ");
}

#[test]
fn quaternions_and_lengths() {
    let bench = Bench::new();
    let mut set = bench.json("set.scenarios.json");
    set["scenarios"][2]["target"]["attitude"][0] = serde_json::json!(0.9999);
    bench.write("bad.scenarios.json", &set.to_string());
    let plan = "plan --scenarios bad.scenarios.json";
    bench.refuses(plan, "bad.scenarios.json: scenarios[2].target.attitude: not a unit quaternion");
    set["scenarios"][2]["target"]["attitude"] = serde_json::json!([0, 0, 1]);
    bench.write("bad.scenarios.json", &set.to_string());
    bench.refuses(plan, "bad.scenarios.json: scenarios[2].target.attitude: invalid length 3");
    set["scenarios"] = serde_json::json!([]);
    bench.write("bad.scenarios.json", &set.to_string());
    bench.refuses(plan, "bad.scenarios.json: scenarios: holds no scenario");
}

#[test]
fn files_that_are_not_json_or_not_there() {
    let bench = Bench::new();
    let plan = "plan --scenarios bad.scenarios.json";
    bench.refuses(plan, "bad.scenarios.json: no such file or directory");
    bench.write("bad.scenarios.json", "");
    bench.refuses(plan, "bad.scenarios.json: EOF while parsing a value at line 1");
    bench.write("bad.scenarios.json", "scenarios = []");
    bench.refuses(plan, "bad.scenarios.json: expected value at line 1 column 1");
    bench.write("bad.scenarios.json", &bench.read("set.scenarios.json")[..400]);
    bench.refuses(plan, "bad.scenarios.json: scenarios[0]: EOF while parsing");
    std::fs::write(bench.path("bad.scenarios.json"), [0xff, 0xfe, 0x00]).unwrap();
    bench.refuses(plan, "bad.scenarios.json: is not valid UTF-8");
    std::fs::remove_file(bench.path("bad.scenarios.json")).unwrap();
    std::fs::create_dir(bench.path("bad.scenarios.json")).unwrap();
    bench.refuses(plan, "bad.scenarios.json: is a directory");
    std::fs::remove_dir(bench.path("bad.scenarios.json")).unwrap();
    // What is quoted of a file may be as long as the file.
    bench.write("bad.scenarios.json", &format!("{{\"format\": \"{}\"}}", "a".repeat(1_000_000)));
    let run = bench.run("plan --scenarios bad.scenarios.json");
    assert_eq!((run.status, run.err.lines().count()), (2, 1));
    let head = "error: bad.scenarios.json: format: unknown format \"aaa";
    assert!(run.err.starts_with(head) && run.err.len() < 1200, "{}", run.err);
}

// Verifies REM-IO-001.
#[test]
fn missions() {
    let bench = Bench::new();
    let refuses = |text: &str, message: &str| {
        bench.write("bad.mission.toml", text);
        for command in [
            "plan --mission bad.mission.toml",
            "campaign --scenarios set.scenarios.json --mission bad.mission.toml --out runs",
            "draw --count 1 --seed 1 --mission bad.mission.toml --out new.scenarios.json",
        ] {
            bench.refuses(command, &format!("bad.mission.toml: {message}"));
        }
    };
    refuses("[servicer]\nbus_mass_kg = -1.0", "servicer.bus_mass_kg: must be positive and finite");
    refuses("[target]\nmass_kg = nan", "target.mass_kg: must be positive and finite");
    refuses("[target]\nport_normal = [0, 0, 2]", "target.port_normal: must be a unit vector");
    refuses(
        "[horizon]\nnodes = 61",
        "horizon.nodes: must lie in [4, 60], what this program is built for",
    );
    refuses(
        "[servicer]\nlinks = []",
        "servicer.links: has 0 entries; arms of 1 to 7 joints are planned for",
    );
    refuses("[servicer]\njoint_angle_limit_rad = [1, 1]", "servicer.joint_angle_limit_rad: ");
    refuses("[servicer]\nwheels = 4", "servicer.wheels: unknown field `wheels`");
    refuses("[limits]\nforce = 4", "limits: unknown field `limits`");
    refuses(
        "[approach]\nkeep_out_far_m = 'wide'",
        "approach.keep_out_far_m: invalid value: string",
    );
    refuses("[approach]\nkeep_out_near_m = -1", "approach.keep_out_near_m: must be finite and not");
    refuses("[orbit\neccentricity = 0", "");
    refuses("[orbit]\neccentricity = 'low'", "orbit.eccentricity: invalid type: string \"low\"");
    refuses("format = 'remora-mission/2'", "format: unknown format");
    bench.refuses("plan --mission none.toml", "none.toml: no such file or directory");
}

#[test]
fn servicers_of_a_mission() {
    let bench = Bench::new();
    let bad = |line: &str, message: &str| {
        bench.write("bad.mission.toml", &format!("[servicer]\n{line}\n"));
        bench.refuses(
            "plan --mission bad.mission.toml",
            &format!("bad.mission.toml: servicer.{message}"),
        );
    };
    let count = "3 principal moments or 6 elements, [xx, yy, zz, xy, xz, yz], not 4 numbers";
    bad("bus_inertia_kg_m2 = [1, 2, 3, 4]", &format!("bus_inertia_kg_m2: {count}"));
    bad(
        "bus_inertia_kg_m2 = [10, 10, 10, 11, 0, 0]",
        "bus_inertia_kg_m2: must be positive definite",
    );
    let no_body = "no body has such moments: each must be at most the sum of the other two";
    bad("bus_inertia_kg_m2 = [10, 10, 10, 6, 6, 6]", &format!("bus_inertia_kg_m2: {no_body}"));
    bad(
        "joint_angle_limit_rad = [3.1, [0.5, 0.2], 1.75]",
        "joint_angle_limit_rad[1]: the lower stop, 0.5, must be below the upper, 0.2",
    );
    bad(
        "joint_angle_limit_rad = [3.1, [0.7, 1.57], 1.75]",
        "initial_joint_angle_rad[1]: must lie within the joint's stops",
    );
    bad("force_limit_n = [1, 2]", "force_limit_n: one number or 3, not 2");
    bad(
        "joint_rate_limit_rad_s = [5e-3, nan, 5e-3]",
        "joint_rate_limit_rad_s: must be positive and finite",
    );
}

#[test]
fn arguments() {
    let bench = Bench::new();
    let set = "--scenarios set.scenarios.json";
    bench.refuses(
        "plan --id s1-000",
        "built-in scenarios: scenarios: there is no scenario with id \"s1-000\"",
    );
    bench.refuses(
        &format!("plan {set} --id s9-000"),
        "set.scenarios.json: scenarios: there is no scenario with id \"s9-000\"",
    );
    // Most of what parsing refuses is a table beside the commands.
    bench.refuses("plan --integrator heun", "invalid value 'heun' for '--integrator <NAME>'");
    bench.refuses("dance", "unrecognized subcommand 'dance'");
    bench.refuses("mission", "'remora mission' requires a subcommand");
    bench.refuses("campaign --count 3 --out a", "--count: needs --seed S");
    bench.refuses("campaign --seed 3 --out a", "--seed: needs --count N");
    bench.refuses(&format!("campaign {set}"), "the following required arguments were not");
}

/// What somebody would miss is replaced with --force alone; what the same command wrote is not missed.
#[test]
fn files_that_are_there_are_kept() {
    let bench = Bench::new();
    let plan = "plan --mode feasible --integrator euler --out";
    bench.solves(&format!("{plan} a.plan.json"));
    bench.solves(&format!("{plan} a.plan.json"));
    let kept = "a.plan.json: exists; --force replaces it";
    bench.refuses(&format!("{plan} a.plan.json --id pub-001"), kept);
    bench.solves(&format!("{plan} a.plan.json --id pub-001 --force"));
    bench.write("notes.txt", "mine");
    bench.refuses(&format!("{plan} notes.txt"), "notes.txt: exists; --force replaces it");
    bench.refuses(
        "draw --count 1 --seed 1 --out notes.txt",
        "notes.txt: exists; --force replaces it",
    );
    let own = bench.read("set.scenarios.json").replace("s1-00", "own-");
    bench.write("own.scenarios.json", &own);
    let kept = "own.scenarios.json: exists; --force replaces it";
    bench.refuses("draw --count 1 --seed 1 --out own.scenarios.json", kept);
    bench.solves("draw --count 1 --seed 1 --out own.scenarios.json --force");
    bench.solves("draw --count 2 --seed 1 --out own.scenarios.json");
}

#[test]
fn outputs_are_tried_before_planning() {
    let bench = Bench::new();
    bench.write("file", "");
    bench.refuses("plan --out none/a.plan.json", "none/a.plan.json: no such file or directory");
    bench.refuses("plan --out .", ".: is not a file name");
    bench.refuses("plan --out file/a.plan.json", "file/a.plan.json: a part of the path is not");
    bench.refuses("draw --count 1 --seed 1 --out none/a.json", "none/a.json: no such file");
    let campaign = "campaign --scenarios set.scenarios.json --out";
    bench.refuses(&format!("{campaign} file"), "file: is not a directory");
    bench.refuses(&format!("{campaign} file/runs"), "file/runs: a part of the path is not");
    std::fs::create_dir_all(bench.path("runs/summary.json")).unwrap();
    bench.refuses(&format!("{campaign} runs"), "runs/summary.json: is a directory");
    #[cfg(unix)]
    bench.refuses("plan --out /dev/null", "/dev/null: is not a regular file");
}

/// An orbit that is too eccentric for plans, or that leads underground, is refused.
#[test]
fn an_orbit_that_is_no_circle_or_leads_underground_is_refused_by_key() {
    let bench = Bench::new();
    let plan = "plan --scenarios set.scenarios.json --mission a.mission.toml --out a.plan.json";
    bench.write("a.mission.toml", "[orbit]\nsemi_major_axis_m = 2.4e7\neccentricity = 0.6\n");
    let run = bench.run(plan);
    assert_eq!(run.status, 2, "{}{}", run.out, run.err);
    let said = "eccentricity: orbit.eccentricity is 0.6: plans take the orbit for a circle (HCW), \
                which after 1200 s is wrong by up to ";
    assert!(run.err.contains(said), "{}", run.err);
    for (orbit, said) in [
        ("eccentricity = 0.1", "orbit.eccentricity: the perigee is 6120000 m from the body's"),
        ("semi_major_axis_m = 6.3e6", "orbit.semi_major_axis_m: the perigee is 6293700 m from"),
        ("body = \"MOON\"", "orbit.gravitational_parameter_m3_s2: is the Earth's, and orbit.body"),
        (
            "body = \"EARTH\"\ngravitational_parameter_m3_s2 = 4.9028e12",
            "orbit.gravitational_parameter_m3_s2: is not the Earth's, and orbit.body is EARTH",
        ),
        (
            "body = \"MOON\"\ngravitational_parameter_m3_s2 = 4.9028e12",
            "orbit.body_radius_m: is missing",
        ),
        ("body = \"\"", "orbit.body: expected 1 to 16 printable characters"),
    ] {
        bench.write("a.mission.toml", &format!("[orbit]\n{orbit}\n"));
        bench.refuses(plan, &format!("a.mission.toml: {said}"));
    }
}
