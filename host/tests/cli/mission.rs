//! `remora mission show`

use super::bench::Bench;

#[test]
fn the_built_in_mission_is_told_and_can_end() {
    let bench = Bench::new();
    let run = bench.solves("mission show");
    for text in [
        "\nreach               ",
        "\nextension           ",
        "\nkeep-out, far                         1.8500",
        "\nkeep-out, near                        1.4600",
        "\nmass of system                           530",
        "\ninertia at capture",
        "\ntorques of bus and joints",
        "\n2      50.3 deg  195 s            1119 s\n",
        "\nspin-up of the bus",
        "\nforce, at least",
        "\nturn of target a node",
        "\nnothing forbids an approach to end\n",
    ] {
        assert!(run.out.contains(text), "{text:?} in\n{}", run.out);
    }
    assert!(run.out.lines().all(|line| line.len() <= 100), "{}", run.out);
}

/// Missions at the ends of the accepted ranges, with their report and the imported arms.
#[test]
fn no_report_has_what_is_no_number() {
    let bench = Bench::new();
    let texts = [
        "",
        "[scenarios]\nrate_rad_s = 0\n",
        "[scenarios]\nrate_norm_deg_s = 3.0\n",
        "[scenarios]\nrate_norm_deg_s = 1e-300\n",
        "[scenarios]\nstandoff_m = 1e-3\n",
        "[servicer]\njoint_rate_limit_rad_s = 1e-300\n",
        "[servicer]\nbus_torque_limit_n_m = [1e-9, 1.0, 1.0]\n",
        "[servicer]\nforce_limit_n = 1e-300\n",
        "[servicer]\nbus_mass_kg = 1e6\n",
        "[margins]\njoint_rate = 0.999999999\n",
        "[horizon]\nduration_s = 60.0\n",
        "[horizon]\nduration_s = 24000.0\n",
        "[horizon]\nnodes = 10\n",
    ];
    let mut told = 0;
    let mut looked_at = |line: &str| {
        let run = bench.run(line);
        // A refused mission has no report.
        if run.status == 2 {
            return;
        }
        told += 1;
        let words = || run.out.split(|c: char| !c.is_ascii_alphanumeric());
        let is_no_number = |word: &str| ["nan", "inf"].contains(&word.to_lowercase().as_str());
        assert!(!words().any(is_no_number), "{line}\n{}", run.out);
        // Every dash comes with its reason.
        let margins = run.out.lines().skip_while(|line| !line.starts_with("fastest scenario"));
        for line in margins.filter(|line| line.contains("  -  ")) {
            let name = line.split("  ").next().unwrap();
            assert!(run.out.contains(&format!("\n{name}: ")), "{line}\n{}", run.out);
        }
    };
    for text in texts {
        bench.write("a.mission.toml", text);
        looked_at("mission show a.mission.toml");
    }
    for urdf in ["planar", "spatial", "gripper"] {
        let fixtures = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/urdf");
        let file = format!("{urdf}.urdf");
        std::fs::copy(fixtures.join(&file), bench.path(&file)).unwrap();
        looked_at(&format!("mission import {file} --explain"));
        for text in texts {
            bench.write("bus.mission.toml", text);
            looked_at(&format!("mission import {file} --bus bus.mission.toml --explain"));
        }
    }
    assert!(told > 20, "{told}");
    let run = bench.solves("mission show");
    assert!(!run.out.contains("3118"), "{}", run.out);
    assert!(run.out.contains("\nmomentum of the bus: a mission does not say "), "{}", run.out);
}

#[test]
fn another_servicers_radii_follow_from_it() {
    let bench = Bench::new();
    bench.write("light.mission.toml", "[servicer]\nbus_mass_kg = 60\n");
    let run = bench.solves("mission show light.mission.toml --json --integrator euler");
    let vehicle: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(vehicle["format"], "remora-vehicle/1");
    assert_eq!((&vehicle["integrator"], &vehicle["refused"]), (&"euler".into(), &().into()));
    assert_eq!(vehicle["keep_out_near_m"], vehicle["reach_m"]);
    assert_eq!(vehicle["keep_out_far_m"], vehicle["extension_m"]);
    assert_eq!(vehicle["system_mass_kg"], 90.0);
    assert_eq!(vehicle["joints"].as_array().map(Vec::len), Some(3));
    // A number that is given stays.
    bench.write(
        "light.mission.toml",
        "[servicer]\nbus_mass_kg = 60\n[approach]\nkeep_out_far_m = 2\n",
    );
    let run = bench.solves("mission show light.mission.toml --json");
    let vehicle: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(vehicle["keep_out_far_m"], 2.0);
}

#[test]
fn what_cannot_end_is_refused_by_name() {
    let bench = Bench::new();
    let mission = |text: &str, json: bool| {
        bench.write("bad.mission.toml", text);
        let run = bench
            .run(&format!("mission show bad.mission.toml{}", if json { " --json" } else { "" }));
        assert_eq!((run.status, run.err.as_str()), (1, ""), "{}", run.out);
        run.out
    };
    let out = mission("[servicer]\njoint_rate_limit_rad_s = 5e-4\n", false);
    assert!(out.contains("\ninfeasible\njoint_rate: joint 2 has to turn 50.3 deg"), "{out}");
    let out = mission("[scenarios]\nrate_norm_deg_s = 3.0\n", true);
    let vehicle: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(vehicle["refused"]["constraint"], "tumble");
    bench.refuses("mission show none.toml", "none.toml: no such file or directory");
    bench.write("bad.mission.toml", "[servicer]\nbus_mass_kg = -1\n");
    bench.refuses(
        "mission show bad.mission.toml",
        "bad.mission.toml: servicer.bus_mass_kg: must be",
    );
}
