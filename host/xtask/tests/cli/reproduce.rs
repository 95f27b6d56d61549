//! `cargo xtask reproduce`, with models whose weights are random: they are no good, but are there.

use super::bench::Bench;
use remora_core::advanced::nn::{
    Decoder, Header, Layout, Precision, Provenance, VERSION, synthetic_model,
};
use remora_core::advanced::warmstart::{Action, Encoding};
use std::fs;

/// Writes a model that was trained on the first scenarios of seed 1000.
fn write_model(bench: &Bench, name: &str, decoder: Decoder, chunk: u16, size: u64) {
    let header = Header {
        version: VERSION,
        precision: Precision::Int8,
        layout: Layout::Fused,
        inputs: Encoding::Body.tag(),
        outputs: Action::Rate.tag(),
        decoder,
        chunk,
        nodes: 60,
        layers: 1,
        heads: 2,
        width: 16,
        token_types: [Encoding::Body.features(3) as u16].into_iter().collect(),
        provenance: Provenance {
            integrator: "euler".parse().unwrap(),
            dataset: format!("s1000:{size}").as_str().parse().unwrap(),
            ..Provenance::default()
        },
        action: 6,
    };
    let mut bytes = vec![0; 1 << 20];
    let length = synthetic_model(&header, 1, &mut bytes).unwrap();
    fs::create_dir_all(bench.path("models")).unwrap();
    fs::write(bench.path("models").join(name), &bytes[..length]).unwrap();
}

/// A bench with models of both decoders.
fn with_models() -> Bench {
    let bench = Bench::new();
    let flow = Decoder::Flow { steps: 1 };
    write_model(&bench, "linear.model", Decoder::Linear, 1, 90_000);
    write_model(&bench, "linear-5.model", Decoder::Linear, 5, 90_000);
    write_model(&bench, "flow.model", flow, 1, 90_000);
    write_model(&bench, "flow-5k.model", flow, 1, 5_000);
    bench
}

const COMMON: &str =
    "--models models --scenarios set.scenarios.json --integrator euler --out paper";

#[test]
fn every_table_is_made_once_and_plans_are_shared() {
    let bench = with_models();
    for (table, planned, files) in [
        // The heuristic, and five numbers of steps.
        ("flow-steps", 18, "flow-steps flow-steps-error"),
        // Three models; the heuristic is there.
        ("decoders", 9, "decoders-iterations decoders-time"),
        // The smaller model.
        ("sample-efficiency", 3, "sample-efficiency-iterations sample-efficiency-time"),
        // The feasible mode, heuristic and model.
        ("feasibility", 6, "feasibility-cost"),
    ] {
        let run = bench.solves(&format!("reproduce {table} {COMMON}"));
        assert!(run.out.contains("paper"), "{}", run.out);
        assert!(run.out.contains("3 scenarios, euler, 1 at a time."), "{}", run.out);
        assert!(run.out.lines().all(|line| line.chars().count() <= 100), "{}", run.out);
        let last = run.err.lines().last().unwrap_or_default();
        let counts = last.split_whitespace().nth(1).unwrap_or_default();
        let done: usize = counts.split('/').next().unwrap().parse().unwrap();
        let before = run.err.lines().find_map(|line| line.strip_prefix("resuming: "));
        let before = before.and_then(|line| line.split(' ').next()?.parse().ok()).unwrap_or(0);
        assert_eq!(done - before, planned, "{table}: {}", run.err);
        for name in files.split(' ') {
            assert!(bench.read(&format!("paper/{name}.svg")).starts_with("<svg"), "{name}");
        }
        assert!(bench.read(&format!("paper/{table}.md")).contains("| ---"));
        assert_eq!(bench.json(&format!("paper/{table}.json"))["format"], "remora-reproduction/1");
        // Again: nothing is planned, and the same numbers come out.
        let numbers = bench.read(&format!("paper/{table}.json"));
        let run = bench.solves(&format!("reproduce {table} {COMMON}"));
        assert!(run.err.lines().all(|line| line.starts_with("resuming: ")), "{}", run.err);
        assert_eq!(bench.read(&format!("paper/{table}.json")), numbers);
        let run = bench.solves(&format!("reproduce {table} {COMMON} --json"));
        let printed: serde_json::Value = serde_json::from_str(&run.out).unwrap();
        assert_eq!(printed, bench.json(&format!("paper/{table}.json"))["numbers"]);
    }
}

#[test]
fn help_shows_how_to_use_it() {
    let run = Bench::new().solves("reproduce --help");
    assert!(run.out.contains("Examples:\n  cargo xtask reproduce"), "{}", run.out);
    for table in ["flow-steps", "decoders", "sample-efficiency", "feasibility"] {
        assert!(run.out.contains(table), "{table}\n{}", run.out);
    }
}

#[test]
fn what_cannot_be_reproduced_is_refused() {
    let bench = with_models();
    bench.refuses(&format!("reproduce table-5 {COMMON}"), "invalid value 'table-5'");
    bench
        .refuses("reproduce decoders --models none --out paper", "none: no such file or directory");
    bench.refuses(
        "reproduce decoders --models models --scenarios set.scenarios.json --out paper",
        "--models: no model there has the integrator",
    );
    bench.refuses(
        "reproduce decoders --models models --count 3 --seed 1000 --integrator euler --out paper",
        "models/flow-5k.model: was trained on s1000-000, itself or an ancestor: choose scenarios of",
    );
    bench.write("models/flow.lineage.toml", "format = \"remora-lineage/1\"\nmodel = \"0\"\n");
    bench.refuses(
        &format!("reproduce decoders {COMMON}"),
        "models/flow.lineage.toml: missing field `training`",
    );
    fs::remove_file(bench.path("models/flow.model")).unwrap();
    fs::remove_file(bench.path("models/flow-5k.model")).unwrap();
    bench.refuses(
        &format!("reproduce flow-steps {COMMON}"),
        "--models: no model there has a flow decoder and H = 1",
    );
    fs::write(bench.path("models/broken.model"), "RMRN").unwrap();
    bench.refuses(&format!("reproduce decoders {COMMON}"), "models/broken.model: ");
}

/// The model that the program ships with, on scenarios that it has not met: its plans take fewer
/// iterations than the heuristic's, and the tables say so.
#[test]
#[ignore = "nightly: 60 plans"]
fn tables_of_the_built_in_model_on_twenty_scenarios() {
    let bench = Bench::new();
    fs::create_dir_all(bench.path("models")).unwrap();
    let fixtures = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/models");
    for name in ["euler.model", "euler.lineage.toml"] {
        fs::copy(format!("{fixtures}/{name}"), bench.path("models").join(name)).unwrap();
    }
    let common = "--models models --count 20 --seed 7 --integrator euler --out paper";
    for table in ["decoders", "feasibility"] {
        let run = bench.solves(&format!("reproduce {table} {common}"));
        assert!(run.out.contains("20 scenarios, euler, 1 at a time."), "{}", run.out);
        let found = bench.json(&format!("paper/{table}.json"));
        let rows = found["numbers"].as_array().unwrap();
        assert!(rows.iter().all(|row| row["measured"]["success"]["count"] == 20), "{table}");
        // The whole of the paired interval.
        let most = rows[1]["against_heuristic"]["iterations"]["high"].as_f64().unwrap();
        assert!(rows[1]["model"].is_object() && most < -0.2, "{table}: {most}");
    }
}
