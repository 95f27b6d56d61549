//! Parts of datasets and of flights.

use super::{Bench, table};
use std::fs;

#[test]
fn parts_of_a_dataset_are_its_files() {
    let bench = Bench::new();
    let dataset = "dataset --count 5 --seed 3 --integrator euler --shard 1";
    bench.solves(&format!("{dataset} --out whole"));
    let run = bench.solves(&format!("{dataset} --part 2/2 --out parts"));
    assert!(run.out.starts_with("3 scenarios: "), "{}", run.out);
    let run = bench.run("gather parts");
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(run.out.contains("files: 3 of 5\nmissing: 0, 1\n"), "{}", run.out);
    bench.solves(&format!("{dataset} --part 1/2 --out parts"));
    let run = bench.solves("gather parts");
    assert!(run.out.ends_with("files: 5 of 5\n"), "{}", run.out);
    assert_eq!(bench.names("parts"), bench.names("whole"));
    for name in bench.names("whole") {
        let of = |folder: &str| fs::read(bench.path(folder).join(&name)).unwrap();
        assert!(of("parts") == of("whole"), "{name}");
    }
    let shard = "parts/shard-00003.bin";
    bench.write(shard, "");
    bench.refuses("gather parts", &format!("{shard}: "));
    bench.refuses(
        &format!("{dataset} --part 1/6 --out six"),
        "--part: is 1/6, and there are 5 files of --shard scenarios",
    );
}

#[test]
fn parts_of_flights_are_the_flights() {
    let bench = Bench::new();
    bench.solves("plan --scenarios set.scenarios.json --out a.plan.json");
    let errors = bench.solves("errors --default");
    bench.write("a.errors.toml", &errors.out);
    let fly = "fly a.plan.json --errors a.errors.toml --runs 4 --seed 3 --guidance-rate 1";
    bench.run(&format!("{fly} --out whole"));
    let part = |i: u64| format!("{fly} --part {i}/3 --out parts");
    bench.solves(&part(1));
    bench.solves(&part(3));
    let run = bench.run("gather parts");
    assert!(run.status == 1 && run.out.contains("parts: 2 of 3\nmissing: 2\n"), "{}", run.out);
    bench.solves(&part(2));
    bench.solves("gather parts --recompute 4");
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
    let file = "parts/part-00003-of-00003.parquet";
    table::plant(&bench, file, "miss_m", table::Sum::Stale);
    bench.refuses("gather parts", &format!("{file}: remora.checksum: does not match the rows"));
    table::plant(&bench, file, "miss_m", table::Sum::Right);
    let run = bench.run("gather parts --recompute 4");
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(run.out.contains("1 differ\n  part 3/3: s1-000, run 2: miss_m\n"), "{}", run.out);
}
