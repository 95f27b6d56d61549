//! `remora draw`

use super::bench::{Bench, IDS};

#[test]
fn a_seed_is_a_set_and_a_smaller_count_its_beginning() {
    let bench = Bench::new();
    bench.solves("draw --count 8 --seed 1 --out long.scenarios.json");
    bench.solves("draw --count 8 --seed 1 --out again.scenarios.json");
    bench.solves("draw --count 8 --seed 2 --out other.scenarios.json");
    let (short, long) = (bench.json("set.scenarios.json"), bench.json("long.scenarios.json"));
    assert_eq!(bench.read("long.scenarios.json"), bench.read("again.scenarios.json"));
    assert_eq!(long["format"], "remora-scenarios/1");
    let scenarios = |set: &serde_json::Value| set["scenarios"].as_array().unwrap().clone();
    assert_eq!(scenarios(&long)[..3], scenarios(&short)[..]);
    let ids: Vec<_> = scenarios(&short).iter().map(|s| s["id"].clone()).collect();
    assert_eq!(ids, IDS);
    assert_ne!(
        scenarios(&bench.json("other.scenarios.json"))[0]["target"],
        scenarios(&long)[0]["target"]
    );
}

#[test]
fn some_of_a_draw_are_those_of_the_whole() {
    let bench = Bench::new();
    bench.solves("draw --count 8 --seed 1 --out all.scenarios.json");
    bench.solves("draw --count 1000000 --seed 1 --indices 5,2,5 --out two.scenarios.json");
    let (all, two) = (bench.json("all.scenarios.json"), bench.json("two.scenarios.json"));
    assert_eq!(two["scenarios"], serde_json::json!([all["scenarios"][2], all["scenarios"][5]]));
    let message = "--indices: 8 is none of 8 scenarios";
    bench.refuses("draw --count 8 --seed 1 --indices 8 --out a.scenarios.json", message);
}
