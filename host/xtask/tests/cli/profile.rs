//! `cargo xtask profile`. Nothing here looks at how long anything took.

use super::bench::Bench;

#[test]
fn a_quick_run_reports_and_writes() {
    let bench = Bench::new();
    bench.draw(2, 3, "two.scenarios.json");
    let run = bench.run(
        "profile --quick --scenarios two.scenarios.json --configurations euler-feasible --out runs/profile",
    );
    assert_eq!(run.status, 0, "{}", run.err);
    for heading in [
        "Whole plan on one core [ms]",
        "Whole plan on two cores [ms]",
        "Phases of a plan on one core, euler-feasible-model [ms]",
        "bars: ",
        "written: runs/profile/profile.json",
    ] {
        assert!(run.out.contains(heading), "{heading} in\n{}", run.out);
    }
    assert!(run.out.lines().all(|line| line.chars().count() <= 110), "{}", run.out);
    let json = bench.json("runs/profile/profile.json");
    assert_eq!(json["format"], "remora-profile/1");
    assert_eq!((&json["scenarios"], &json["rounds"]["euler"]), (&2.into(), &1.into()));
    let configurations = json["configurations"].as_array().unwrap();
    let names: Vec<_> = configurations.iter().map(|c| c["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["euler-feasible-heuristic", "euler-feasible-model"]);
    for configuration in configurations {
        for case in ["one_core", "two_cores", "two_plans"] {
            assert_eq!(configuration[case]["plans"], 2);
            assert_eq!(configuration[case]["solved"], 2);
            assert_eq!(configuration[case]["phase_s"].as_array().unwrap().len(), 8);
        }
        assert!(configuration["linearisation_ratio"].as_f64().is_some_and(f64::is_finite));
    }
    assert_eq!(json["bars"].as_array().unwrap().len(), 4);
}

#[test]
fn without_an_output_folder_nothing_is_written() {
    let bench = Bench::new();
    bench.draw(1, 3, "one.scenarios.json");
    let run = bench.run(
        "profile --quick --scenarios one.scenarios.json --configurations euler-feasible-heuristic",
    );
    assert_eq!(run.status, 0, "{}", run.err);
    assert!(!run.out.contains("written"));
}

#[test]
fn bad_arguments_are_named() {
    let bench = Bench::new();
    bench.refuses("profile --cores 0", "--cores: needs two cores, A,B");
    bench.refuses("profile --cores 0,1,2", "--cores: needs two cores, A,B");
    bench.refuses(
        "profile --configurations rk5",
        "--configurations: none of euler-optimal-heuristic, ",
    );
    bench.refuses("profile --count 3", "--count: needs --seed S");
    bench.refuses("profile --seed 3", "--seed: needs --count N");
    for (arguments, named) in [
        ("--cores x,1", "--cores"),
        ("--rounds 0", "--rounds"),
        ("--rounds 3 --quick", "--quick"),
        ("--scenarios a.json --count 3 --seed 1", "--count"),
    ] {
        let run = bench.run(&format!("profile {arguments}"));
        assert_eq!(run.status, 2, "{arguments}");
        assert!(run.err.contains(named) && run.out.is_empty(), "{arguments}: {}", run.err);
    }
    bench.refuses("profile --scenarios none.json", "none.json: no such file or directory");
    bench.write("taken", "a file");
    let run = bench.run("profile --quick --out taken");
    assert_eq!(run.status, 2);
    assert!(run.err.contains("taken"), "{}", run.err);
}

/// Which cores there are depends on the machine: that there is no core 1000000 does not.
#[cfg(target_os = "linux")]
#[test]
fn cores_that_are_not_there_are_refused() {
    let bench = Bench::new();
    bench.refuses("profile --cores 0,0 --quick", "--cores: needs two different cores");
    bench.refuses("profile --cores 0,1000000 --quick", "--cores: core 1000000 is not one of");
}
