//! Seeds of the fuzzer: sound files of each kind, made of the fixtures and of one plan. They are small: the fuzzer
//! runs faster on small files.

use remora_core::advanced::nn::{Decoder, Header, Layout, Precision, Provenance, synthetic_model};
use remora_core::advanced::warmstart::Encoding;
use remora_flight::errors_file;
use remora_flight::flights_file::FlightsFile;
use remora_host::draw::draw_one;
use remora_host::formats::{Mission, ScenarioSet, json};
use remora_host::memory::on_large_stack;
use remora_host::method::{Integrator, Method, Mode};
use remora_host::planning::{PlanOutcome, Planner};
use remora_host::request::PlanRequest;
use remora_learn::dataset::Manifest;
use std::fs;
use std::path::{Path, PathBuf};

/// The repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The files of a folder of fixtures that end so.
fn fixtures(folder: &str, end: &str) -> Vec<Vec<u8>> {
    let entries = fs::read_dir(root().join("fixtures").join(folder)).expect("fixtures");
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.sort();
    let ends = |file: &&PathBuf| file.to_string_lossy().ends_with(end);
    files.iter().filter(ends).map(|file| fs::read(file).expect("a fixture")).collect()
}

/// A plan that is quickly made.
fn planned() -> PlanOutcome {
    let scenario = draw_one(1, 0, &Mission::default()).expect("the built-in mission allows starts");
    let (mode, integrator) = (Mode::Feasible, Integrator::Euler);
    let method = Method { mode, integrator, ..Method::default() };
    let request = PlanRequest { method, ..PlanRequest::default() };
    on_large_stack(|| Planner::new().plan(&request, &scenario)).expect("a thread")
}

fn text(value: &impl serde::Serialize) -> Vec<u8> {
    json::to_text(value).expect("what is made can be written").into_bytes()
}

/// Sound files of a target's kind.
pub fn seeds(target: &str) -> Vec<Vec<u8>> {
    match target {
        "chief" => fixtures("chiefs", ".toml"),
        "door" => vec![program()],
        "errors" => {
            let errors = [remora_truth::Errors::typical(), remora_truth::Errors::none()];
            errors.iter().map(|e| errors_file::text(e).expect("sound").into_bytes()).collect()
        }
        "evidence" => {
            let record = planned().evidence;
            vec![text(&record), record.to_packet().expect("sound")]
        }
        "flights" => vec![text(&FlightsFile::new(
            vec!["a.plan.json".into()],
            (10, 1),
            3,
            remora_flight::options::Options::default(),
            remora_truth::Errors::typical(),
        ))],
        "import" | "urdf" => fixtures("urdf", ".urdf"),
        "journal" => vec![line(&planned().row())],
        "manifest" => fixtures("datasets/rk4", ".json"),
        "mission" => [fixtures("missions", ".toml"), fixtures("arms", ".toml")].concat(),
        "model" => models(),
        "plan" => {
            let file = planned().file;
            vec![text(&file), file.to_packet().expect("sound")]
        }
        "qp" => vec![PROGRAM.into()],
        "scenarios" => vec![scenarios(), fixtures("doors", ".scenarios.json").concat()],
        "shard" => vec![shard()],
        _ => Vec::new(),
    }
}

/// Inputs that may cost no reader much time or memory: nested without end, all zeros, all of one line.
pub fn hostile() -> Vec<Vec<u8>> {
    const DEPTH: usize = 1_000_000;
    let nested = [
        ("", "["),
        ("", "{\"format\":"),
        ("{\"format\": ", "["),
        ("{\"format\": \"remora-plan/2\", \"stage1\": ", "{\"a\":["),
        ("a = ", "["),
        ("a = ", "{b="),
        ("", "[a."),
        ("[a]\n", "a."),
        ("", "[["),
        ("", "<a>"),
        ("<robot name='a'>", "<link name='a'>"),
    ];
    let mut all: Vec<Vec<u8>> =
        nested.iter().map(|(head, open)| [head, &*open.repeat(DEPTH)].concat().into()).collect();
    all.extend([
        vec![0; 1 << 20],
        vec![0xff; 1 << 20],
        b"=\n".repeat(1 << 19),
        b"#".repeat(1 << 20),
    ]);
    all.extend([Vec::new(), b"REMORA\0P".to_vec(), b"REMORA\0E".to_vec(), b"REMORA\0D".to_vec()]);
    all
}

fn line(value: &impl serde::Serialize) -> Vec<u8> {
    let mut line = serde_json::to_vec(value).expect("what is made can be written");
    line.push(b'\n');
    line
}

fn scenarios() -> Vec<u8> {
    let set = ScenarioSet::built_in().expect("built in").scenarios;
    text(&ScenarioSet::new(set[..2].to_vec()))
}

/// Two trajectories of the checked-in dataset.
fn shard() -> Vec<u8> {
    let whole = fixtures("datasets/euler", ".bin").concat();
    let manifest = fixtures("datasets/euler", ".json").concat();
    let manifest = Manifest::parse(&String::from_utf8_lossy(&manifest)).expect("checked in");
    let all = manifest.shard(0, &whole).expect("checked in");
    manifest.shard_of(0, &all[..2]).expect("sound")
}

/// Small models of each precision, layout and decoder.
fn models() -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    for precision in [Precision::Int8, Precision::F32] {
        for (layout, decoder, inputs) in [
            (Layout::Separate, Decoder::Flow { steps: 2 }, Encoding::Paper),
            (Layout::Fused, Decoder::Linear, Encoding::Body),
            (Layout::Chunked, Decoder::Linear, Encoding::Body),
        ] {
            all.push(model(precision, layout, decoder, inputs));
        }
    }
    all
}

fn model(precision: Precision, layout: Layout, decoder: Decoder, inputs: Encoding) -> Vec<u8> {
    let features = inputs.features(3) as u16;
    let (chunk, token_types) = match layout {
        Layout::Separate => (1, [6, 1, 7, 9, features - 23].into_iter().collect()),
        Layout::Fused => (1, [features].into_iter().collect()),
        Layout::Chunked => (3, [features].into_iter().collect()),
    };
    let header = Header {
        version: Header::version_of(6),
        precision,
        layout,
        inputs: inputs.tag(),
        outputs: 0,
        decoder,
        chunk,
        nodes: 4,
        layers: 1,
        heads: 1,
        width: 8,
        token_types,
        provenance: Provenance::default(),
        action: 6,
    };
    let mut file = vec![0; 1 << 16];
    let length = synthetic_model(&header, 1, &mut file).expect("there is room");
    file.truncate(length);
    file
}

/// A program of calls for the door: opens, plans, flies, hands over, looks, guides.
fn program() -> Vec<u8> {
    let mut bytes = vec![6, 7, 200];
    bytes.extend([0; 8]);
    bytes.extend([10, 11]);
    bytes.extend([0; 8]);
    bytes.push(14);
    bytes.extend(300.0f64.to_le_bytes());
    bytes.extend([12, 13, 15, 1, 12]);
    bytes
}

const PROGRAM: &str = r#"{
  "format": "remora-qp/1", "scenario": "a", "mode": "optimal", "integrator": "rk4:4", "qp": "embedded",
  "stage": 1, "iteration": 1, "correction": 0,
  "size": {"nodes": 2, "states": 1, "controls": 1, "rows": 1},
  "constant": 0.5, "defect_weight": null, "row_weight": 2.0,
  "nodes": [
    {"hessian_xx": [[1.0]], "gradient_x": [0.5], "lower_x": [-1.0], "upper_x": [null], "row_x": [[1.0]],
     "row_offset": [0.1]},
    {"hessian_xx": [[1.0]], "gradient_x": [0.0], "lower_x": [null], "upper_x": [1.0], "row_x": [[0.0]],
     "row_offset": [0.0]}
  ],
  "intervals": [
    {"hessian_ux": [[0.0]], "hessian_uu": [[2.0]], "gradient_u": [0.1], "lower_u": [-1.0], "upper_u": [1.0],
     "a": [[1.0]], "b": [[0.5]], "c": [0.0]}
  ],
  "solution": {"status": "solved", "iterations": 5, "point": null}
}
"#;
