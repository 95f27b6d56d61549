//! Parts of datasets and of flights.

use super::{Bench, table};
use remora_learn::dataset::Manifest;
use serde_json::Value;
use std::fs;

#[test]
fn parts_of_a_dataset_are_its_files() {
    let bench = Bench::new();
    let dataset = "learn dataset --count 5 --seed 3 --integrator euler --shard 1";
    bench.solves(&format!("{dataset} --out whole"));
    let run = bench.solves(&format!("{dataset} --part 2/2 --out parts"));
    assert!(run.out.starts_with("3 scenarios: "), "{}", run.out);
    let run = bench.run("campaign gather parts");
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(run.out.contains("files: 3 of 5\nmissing: 0, 1\n"), "{}", run.out);
    bench.solves(&format!("{dataset} --part 1/2 --out parts"));
    let run = bench.solves("campaign gather parts");
    assert!(run.out.ends_with("files: 5 of 5\n"), "{}", run.out);
    assert_eq!(bench.names("parts"), bench.names("whole"));
    for name in bench.names("whole") {
        let of = |folder: &str| fs::read(bench.path(folder).join(&name)).unwrap();
        assert!(of("parts") == of("whole"), "{name}");
    }
    let run = bench.solves("campaign gather parts --recompute 3");
    assert!(run.out.ends_with("planned again: 3, of which 0 differ\n"), "{}", run.out);
    // The lowest bit of a torque, with the checksum made right.
    let shard = "parts/shard-00003.bin";
    let manifest = Manifest::read(&bench.path("parts/dataset.json")).unwrap();
    let bytes = fs::read(bench.path(shard)).unwrap();
    let mut kept = manifest.shard(3, &bytes).unwrap();
    let torque = &mut kept[0].joint_torque[7][2];
    *torque = f32::from_bits(torque.to_bits() ^ 1);
    bench.write(shard, &manifest.shard_of(3, &kept).unwrap());
    bench.solves("campaign gather parts");
    let run = bench.run("campaign gather parts --recompute 5");
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(
        run.out.ends_with("planned again: 5, of which 1 differ\n  file 4/5: s3-003: control\n"),
        "{}",
        run.out
    );
    let run = bench.run("campaign gather parts --recompute 5 --json");
    let found: Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(found["differences"][0]["column"], "control");
    bench.write(shard, "");
    bench.refuses("campaign gather parts", &format!("{shard}: "));
    bench.refuses(
        &format!("{dataset} --part 1/6 --out six"),
        "--part: is 1/6, and there are 5 files of --shard scenarios",
    );
}

#[test]
fn parts_of_flights_are_the_flights() {
    let bench = Bench::new();
    bench.solves("plan --scenarios set.scenarios.json --out a.plan.json");
    let errors = bench.solves("mission errors typical");
    bench.write("a.errors.toml", &errors.out);
    let fly = "fly a.plan.json --errors a.errors.toml --runs 4 --seed 3 --guidance-rate 1";
    bench.run(&format!("{fly} --out whole"));
    let part = |i: u64| format!("{fly} --part {i}/3 --out parts");
    bench.solves(&part(1));
    bench.solves(&part(3));
    let run = bench.run("campaign gather parts");
    assert!(run.status == 1 && run.out.contains("parts: 2 of 3\nmissing: 2\n"), "{}", run.out);
    bench.solves(&part(2));
    bench.solves("campaign gather parts --recompute 4");
    let summary = "flights.summary.json";
    assert_eq!(bench.json(&format!("parts/{summary}")), bench.json(&format!("whole/{summary}")));
    let again = bench.solves(&part(2));
    assert!(again.out.contains("rows, 0 planned now"), "{}", again.out);
    // Another series does not go into the same folder.
    let other = part(2).replace("--seed 3", "--seed 4");
    let run = bench.run(&other);
    assert!(
        run.status == 2 && run.err.contains("flights.json: these flights were begun"),
        "{}",
        run.err
    );
    let file = "parts/part-00003-of-00003.jsonl";
    table::plant(&bench, file, "/flown/arrival/miss_m", table::Sum::Stale);
    bench.refuses("campaign gather parts", &format!("{file}: checksum: does not match the rows"));
    table::plant(&bench, file, "/flown/arrival/miss_m", table::Sum::Right);
    let run = bench.run("campaign gather parts --recompute 4");
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(
        run.out.contains("flown again: 4, of which 1 differ\n  part 3/3: s1-000, run 2: miss_m\n"),
        "{}",
        run.out
    );
}

/// A dataset of a model's roll-outs needs that model again.
#[test]
fn a_dataset_is_planned_again_with_its_own_model() {
    let bench = Bench::new();
    let euler = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/models/euler.model");
    let other = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/models/rk4.model");
    let dataset = "learn dataset --count 2 --seed 3 --integrator euler";
    bench.solves(&format!("{dataset} --out plain"));
    bench.refuses(
        &format!("campaign gather plain --recompute 1 --model {euler}"),
        "--model: the dataset was made from the heuristic start",
    );
    bench.solves(&format!("{dataset} --sharp --model {euler} --out own"));
    bench.solves("campaign gather own --recompute 2");
    bench.solves(&format!("campaign gather own --recompute 2 --model {euler}"));
    let run = bench.run(&format!("campaign gather own --recompute 2 --model {other}"));
    assert!(run.status == 2 && run.err.contains("; the dataset was made with "), "{}", run.err);
    // A mission, and settings, that this program does not have.
    for (field, reason) in [
        ("mission", "is neither in the directory nor the one that is built in"),
        ("settings", "are of another version of the planner than this one"),
    ] {
        let folder = format!("other-{field}");
        bench.solves(&format!("{dataset} --out {folder}"));
        let file = format!("{folder}/dataset.json");
        let mut manifest = bench.json(&file);
        manifest[field] = "0123456789abcdef".into();
        bench.write(&file, &manifest.to_string());
        fs::remove_file(bench.path(&folder).join("shard-00000.bin")).unwrap();
        bench.refuses(
            &format!("campaign gather {folder} --recompute 1"),
            &format!("{file}: {field}: {reason}"),
        );
    }
}
