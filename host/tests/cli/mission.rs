//! `remora mission`

use super::bench::Bench;

#[test]
fn the_built_in_mission_is_told_and_can_end() {
    let bench = Bench::new();
    let run = bench.solves("mission");
    for text in [
        "\nreach               ",
        "\nextension           ",
        "\nkeep-out, far                         1.8500",
        "\nkeep-out, near                        1.4600",
        "\nmass of system                         530.0",
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

#[test]
fn another_servicers_radii_follow_from_it() {
    let bench = Bench::new();
    bench.write("light.mission.toml", "[servicer]\nbus_mass_kg = 60\n");
    let run = bench.solves("mission light.mission.toml --json --integrator euler");
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
    let run = bench.solves("mission light.mission.toml --json");
    let vehicle: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(vehicle["keep_out_far_m"], 2.0);
}

#[test]
fn what_cannot_end_is_refused_by_name() {
    let bench = Bench::new();
    let mission = |text: &str, json: bool| {
        bench.write("bad.mission.toml", text);
        let run =
            bench.run(&format!("mission bad.mission.toml{}", if json { " --json" } else { "" }));
        assert_eq!((run.status, run.err.as_str()), (1, ""), "{}", run.out);
        run.out
    };
    let out = mission("[servicer]\njoint_rate_limit_rad_s = 5e-4\n", false);
    assert!(out.contains("\ninfeasible\njoint_rate: joint 2 has to turn 50.3 deg"), "{out}");
    let out = mission("[scenarios]\nrate_norm_deg_s = 3.0\n", true);
    let vehicle: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(vehicle["refused"]["constraint"], "tumble");
    bench.refuses("mission none.toml", "none.toml: no such file or directory");
    bench.write("bad.mission.toml", "[servicer]\nbus_mass_kg = -1\n");
    bench.refuses("mission bad.mission.toml", "bad.mission.toml: servicer.bus_mass_kg: must be");
}
