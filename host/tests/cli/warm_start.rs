//! `--warm-start` and `--model`: a good model shortens the plan, a bad one costs nothing but time.

use super::bench::{Bench, timeless};

const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/models/euler.model");

const PLAN: &str = "plan --scenarios set.scenarios.json --id s1-001 --integrator euler";

#[test]
fn the_built_in_model_is_the_one_among_the_fixtures() {
    let bench = Bench::new();
    bench.solves(&format!("{PLAN} --out a.plan.json"));
    bench.solves(&format!("{PLAN} --warm-start model --model {MODEL} --out b.plan.json"));
    let (a, b) = (bench.json("a.plan.json"), bench.json("b.plan.json"));
    assert_eq!(a["warm_start"], "model");
    assert!(a["stage2"]["inference_s"].as_f64() > Some(0.0));
    assert!(a["stage2"]["inference_s"].as_f64() < a["stage2"]["time_s"].as_f64());
    assert_eq!(timeless(a), timeless(b));
    let (a, b) = (bench.json("a.evidence.json"), bench.json("b.evidence.json"));
    assert_eq!((&a["start"], &b["start"]), (&"model".into(), &"model".into()));
    assert_eq!(a["model"]["checksum"], b["model"]["checksum"]);
    assert_eq!(a["output"], b["output"]);
}

#[test]
fn a_model_shortens_the_second_stage() {
    let bench = Bench::new();
    let iterations = |start: &str| {
        let options = "--count 12 --seed 11 --integrator euler --write csv";
        bench.solves(&format!("campaign {options} --warm-start {start} --out {start}"));
        let summary = bench.json(&format!("{start}/summary.json"));
        assert_eq!(summary["fallbacks"], 0);
        assert!(bench.read(&format!("{start}/results.csv")).contains(&format!(",{start},")));
        summary["stage2"]["iterations"]["mean"].as_f64().unwrap()
    };
    let (model, heuristic) = (iterations("model"), iterations("heuristic"));
    assert!(model < 0.8 * heuristic, "{model} after {heuristic}");
}

#[test]
fn the_heuristic_takes_no_model() {
    let bench = Bench::new();
    bench.refuses(
        &format!("{PLAN} --warm-start heuristic --model {MODEL}"),
        "--model: has no use with --warm-start heuristic",
    );
    bench.refuses(&format!("{PLAN} --model none.model"), "none.model: no such file or directory");
}

/// What is not a model is the same as no model, but for what is said of it.
// Verifies REM-LRN-003.
#[test]
fn a_corrupt_model_gives_way_to_the_heuristic() {
    let bench = Bench::new();
    bench.solves(&format!("{PLAN} --warm-start heuristic --out a.plan.json"));
    let mut flipped = std::fs::read(MODEL).unwrap();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    let cases: [(&str, &[u8], &str); 3] = [
        ("flipped", &flipped, "has a wrong checksum"),
        ("short", &flipped[..middle], "is shorter than its header says"),
        ("text", b"remora", "is not a model file"),
    ];
    for (name, bytes, reason) in cases {
        bench.write(&format!("{name}.model"), bytes);
        let run = bench.solves(&format!("{PLAN} --model {name}.model --out {name}.plan.json"));
        let said = format!("heuristic start instead of {name}.model: {reason}");
        assert!(run.out.contains(&said), "{said} in\n{}", run.out);
        let plan = bench.json(&format!("{name}.plan.json"));
        assert_eq!(plan["warm_start"], "fallback");
        let [record, heuristic] =
            [format!("{name}.evidence.json"), "a.evidence.json".into()].map(|f| bench.json(&f));
        assert_eq!(record["start"], "refused");
        assert_eq!(record["model"]["refused"], reason);
        assert_eq!(record["output"], heuristic["output"]);
    }
}

/// A campaign says it even where it is to be quiet, in one piece and in parts.
#[test]
fn a_campaign_whose_model_is_none_warns() {
    let bench = Bench::new();
    bench.write("empty.model", b"");
    let campaign = "campaign --count 1 --seed 3 --integrator euler -q --warm-start model";
    for out in ["--out whole", "--part 1/1 --out part"] {
        let run = bench.solves(&format!("{campaign} --model empty.model {out}"));
        let said = "warning: heuristic start instead of empty.model: ";
        assert!(run.err.starts_with(said) && run.err.lines().count() == 1, "{}", run.err);
        let run = bench.solves(&format!("{campaign} {}", out.replace("--out ", "--out good/")));
        assert_eq!(run.err, "");
    }
}

#[test]
fn a_campaign_is_not_resumed_with_another_model() {
    let bench = Bench::new();
    let campaign = "campaign --count 2 --seed 3 --integrator euler --out runs";
    bench.solves(campaign);
    bench.write("text.model", b"remora");
    bench.refuses(
        &format!("{campaign} --model text.model"),
        "runs/journal.jsonl: settings: this campaign was begun",
    );
}
