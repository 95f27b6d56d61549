//! `remora learn dataset`

use super::bench::Bench;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

const DATASET: &str = "learn dataset --count 6 --seed 3 --integrator euler --shard 2";
const FILES: [&str; 4] = ["dataset.json", "shard-00000.bin", "shard-00001.bin", "shard-00002.bin"];

/// A directory's files with their contents.
fn contents(bench: &Bench, directory: &str) -> Vec<(String, Vec<u8>)> {
    let names = bench.names(directory).into_iter();
    names.map(|name| (name.clone(), fs::read(bench.path(directory).join(name)).unwrap())).collect()
}

#[test]
fn help_shows_how_to_use_it() {
    let run = Bench::new().solves("learn dataset --help");
    assert!(run.out.contains("Examples:\n  remora learn dataset"), "{}", run.out);
}

#[test]
fn one_thread_or_two_write_the_same_bytes() {
    let bench = Bench::new();
    for jobs in ["1", "2"] {
        let run = bench.solves(&format!("{DATASET} --jobs {jobs} --out sets/{jobs}"));
        let head = "6 scenarios: 6 trajectories kept (100.00 %), 0.1 MB\n6 planned in";
        assert!(run.out.starts_with(head), "{}", run.out);
    }
    let one = contents(&bench, "sets/1");
    assert_eq!(bench.names("sets/1"), FILES);
    assert!(one == contents(&bench, "sets/2"));
    // What is complete is not planned again.
    let run = bench.solves(&format!("{DATASET} --out sets/1"));
    assert!(run.out.contains("\n0 planned in"), "{}", run.out);
    let run = bench.solves(&format!("{DATASET} --json --out sets/1"));
    let made: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!((&made["tried"], &made["kept"], &made["now"]), (&6.into(), &6.into(), &0.into()));
    assert!(one == contents(&bench, "sets/1"));
    let manifest = bench.json("sets/1/dataset.json");
    assert_eq!((&manifest["seed"], &manifest["integrator"]), (&3.into(), &"euler".into()));
}

#[test]
fn a_killed_one_resumes_to_the_same_bytes() {
    let bench = Bench::new();
    bench.solves(&format!("{DATASET} --jobs 1 --out whole"));
    let killed = format!("{DATASET} --jobs 1 --out killed");
    let mut child = bench.command(&killed).stderr(Stdio::null()).spawn().unwrap();
    let first = bench.path("killed/shard-00000.bin");
    while !first.exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    bench.write("killed/.shard-00001.bin.1.partial", "half");
    let before = fs::metadata(&first).unwrap().modified().unwrap();
    let run = bench.solves(&killed);
    assert!(run.err.contains("resuming: "), "{}", run.err);
    assert_eq!(fs::metadata(&first).unwrap().modified().unwrap(), before);
    assert!(contents(&bench, "killed") == contents(&bench, "whole"));
}

#[test]
fn damaged_shards_are_refused() {
    let bench = Bench::new();
    bench.solves(&format!("{DATASET} --out set"));
    let shard = bench.path("set/shard-00001.bin");
    let whole = fs::read(&shard).unwrap();
    let refuses = |bytes: &[u8], reason: &str| {
        fs::write(&shard, bytes).unwrap();
        bench.refuses(&format!("{DATASET} --out set"), &format!("set/shard-00001.bin: {reason}"));
    };
    refuses(b"", "is not a shard of a dataset");
    refuses(&whole[..100], "has 100 bytes instead of 16863");
    refuses(&fs::read(bench.path("set/shard-00000.bin")).unwrap(), "holds 2 of 2 scenarios from 0");
    let mut flipped = whole.clone();
    flipped[5000] ^= 1;
    refuses(&flipped, "is damaged: its CRC-32 does not match");
    // Without it, it is made again.
    fs::remove_file(&shard).unwrap();
    let run = bench.solves(&format!("{DATASET} --out set"));
    assert!(run.out.contains("\n2 planned in"), "{}", run.out);
    assert!(fs::read(&shard).unwrap() == whole);
}

#[test]
fn another_dataset_is_not_resumed() {
    let bench = Bench::new();
    let begun = "learn dataset --count 2 --seed 3 --integrator euler";
    bench.solves(&format!("{begun} --out set"));
    let refuses = |arguments: &str, field: &str| {
        let message = format!("set/dataset.json: {field}: this dataset was begun with");
        bench.refuses(&format!("{arguments} --out set"), &message);
    };
    refuses("learn dataset --count 3 --seed 3 --integrator euler", "count");
    refuses("learn dataset --count 2 --seed 4 --integrator euler", "seed");
    refuses("learn dataset --count 2 --seed 3", "integrator");
    refuses(&format!("{begun} --shard 1"), "shard");
    bench.write("heavy.mission.toml", "[servicer]\nbus_mass_kg = 501\n");
    refuses(&format!("{begun} --mission heavy.mission.toml"), "mission");
    let text = bench.read("set/dataset.json");
    bench.write("set/dataset.json", &text.replace("\"nodes\": 60", "\"nodes\": 61"));
    bench.refuses(&format!("{begun} --out set"), "set/dataset.json: nodes: is 61; this program");
    for count in ["0", "1000000000000000"] {
        bench.write(
            "set/dataset.json",
            &text.replace("\"count\": 2", &format!("\"count\": {count}")),
        );
        let reason = "set/dataset.json: count: must be from 1 to 1000000";
        bench.refuses(&format!("{begun} --out set"), reason);
        bench.refuses("campaign gather set", reason);
    }
}

/// Shards whose manifest is gone are taken by the same dataset, and by no other.
#[test]
fn shards_are_not_adopted_by_another_dataset() {
    let bench = Bench::new();
    let begun = "learn dataset --count 2 --seed 3 --integrator euler";
    bench.solves(&format!("{begun} --out set"));
    bench.write("heavy.mission.toml", "[servicer]\nbus_mass_kg = 501\n");
    for other in [
        "learn dataset --count 2 --seed 4 --integrator euler",
        "learn dataset --count 2 --seed 3 --integrator rk4:4",
        "learn dataset --count 2 --seed 3 --integrator euler --mission heavy.mission.toml",
    ] {
        fs::remove_file(bench.path("set/dataset.json")).unwrap();
        let message = "set/shard-00000.bin: is of another dataset";
        bench.refuses(&format!("{other} --out set"), message);
        // What was refused has left nothing that the right one would be refused for.
        bench.solves(&format!("{begun} --out set"));
    }
    fs::remove_file(bench.path("set/dataset.json")).unwrap();
    let run = bench.solves(&format!("{begun} --out set"));
    assert!(run.out.contains("\n0 planned in"), "{}", run.out);
}

/// The mission beside the shards is that which they were made for, and no other is taken for it.
#[test]
fn another_mission_is_not_kept_beside_the_shards() {
    let bench = Bench::new();
    let own =
        "learn dataset --count 1 --seed 3 --integrator euler --mission own.mission.toml --out set";
    bench.write("own.mission.toml", "[servicer]\nbus_mass_kg = 501\n");
    bench.write("set.mission.toml", "[servicer]\nbus_mass_kg = 502\n");
    fs::create_dir(bench.path("set")).unwrap();
    fs::rename(bench.path("set.mission.toml"), bench.path("set/mission.toml")).unwrap();
    let another = "set/mission.toml: is another mission than this dataset's";
    bench.refuses(own, another);
    bench.refuses("learn dataset --count 1 --seed 3 --integrator euler --out set", another);
    // The same one in other words is the same.
    bench.write("set/mission.toml", "# mine\n[servicer]\nbus_mass_kg = 501.0\n");
    bench.solves(own);
    bench.write("set/mission.toml", "[servicer]\nbus_mass_kg = 502\n");
    bench.refuses(own, another);
    assert_eq!(bench.names("set"), ["dataset.json", "mission.toml", "shard-00000.bin"]);
}

/// Two programs that make the same part: the second leaves what the first is writing, and sweeps up what a kill left.
#[test]
fn a_part_that_is_made_twice_at_once_is_not_swept_away() {
    let bench = Bench::new();
    let part = "learn dataset --count 2 --seed 3 --integrator euler --shard 1 --part 1/2 --out set";
    fs::create_dir(bench.path("set")).unwrap();
    let partial = bench.path("set/.shard-00000.bin.1.partial");
    let writing = fs::File::create(&partial).unwrap();
    writing.lock().unwrap();
    bench.solves(part);
    assert!(partial.exists());
    drop(writing);
    bench.solves(part);
    assert_eq!(bench.names("set"), ["dataset.json", "shard-00000.bin"]);
}

/// Several programs that begin at once: one makes it, the others say so or find it made.
#[test]
fn one_of_several_makes_it() {
    let bench = Bench::new();
    let begun = "learn dataset --count 4 --seed 3 --integrator euler --shard 1 --jobs 1";
    bench.solves(&format!("{begun} --out whole"));
    for round in 0..4 {
        let line = format!("{begun} --out {round}");
        let start = |_| {
            let mut command = bench.command(&line);
            command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap()
        };
        let children: Vec<_> = (0..4).map(start).collect();
        let mut made = 0;
        for child in children {
            let output = child.wait_with_output().unwrap();
            let told = String::from_utf8(output.stderr).unwrap();
            match output.status.code() {
                Some(0) => made += 1,
                _ => assert!(told.contains("another program is making this dataset"), "{told}"),
            }
        }
        assert!(made >= 1);
        assert!(contents(&bench, &round.to_string()) == contents(&bench, "whole"));
    }
}

/// The second phase of a training: what the optimiser makes of a model's own roll-outs.
#[test]
fn plans_may_start_from_a_model() {
    let bench = Bench::new();
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/models/euler.model");
    let set = "learn dataset --count 2 --seed 3 --integrator euler";
    bench.solves(&format!("{set} --out heuristic"));
    bench.solves(&format!("{set} --model {model} --out own"));
    let [heuristic, own] = ["heuristic", "own"]
        .map(|directory| fs::read(bench.path(directory).join("shard-00000.bin")).unwrap());
    assert_eq!(heuristic.len(), own.len());
    assert!(heuristic != own);
    bench.refuses(
        &format!("{set} --out own"),
        "own/dataset.json: model: this dataset was begun with another model",
    );
    bench.write("text.model", "remora");
    bench.refuses(&format!("{set} --model text.model --out b"), "text.model: is not a model file");
}

#[test]
fn arguments() {
    let bench = Bench::new();
    let refuses = |arguments: &str, message: &str| {
        bench.refuses(&format!("learn dataset {arguments} --out set"), message);
    };
    refuses("--seed 1", "the following required arguments were not provided: --count <N>");
    refuses("--count 1", "the following required arguments were not provided: --seed <S>");
    refuses("--count 0 --seed 1", "invalid value '0' for '--count <N>'");
    refuses("--count 1 --seed -1", "");
    refuses("--count 1 --seed 1 --jobs 0", "invalid value '0' for '--jobs <J>'");
    refuses("--count 1 --seed 1 --shard 0", "invalid value '0' for '--shard <N>'");
    refuses("--count 1 --seed 1 --integrator rk4:1", "invalid value 'rk4:1'");
    bench.write("wide.mission.toml", "[approach]\nkeep_out_far_m = 50\n");
    refuses("--count 1 --seed 1 --mission wide.mission.toml", "--mission: its geometry lets no");
    bench.write("file", "");
    bench.refuses("learn dataset --count 1 --seed 1 --out file", "file: is not a directory");
}

/// The records of another arm have another size, and are not taken for its neighbour's.
#[test]
fn an_arm_of_two_joints_has_a_dataset() {
    let bench = Bench::new();
    let arms = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/arms");
    let two = arms.join("two.mission.toml");
    let line = "learn dataset --count 2 --seed 3 --integrator euler --out two";
    let run = bench.solves(&format!("{line} --mission {}", two.display()));
    assert!(run.out.starts_with("2 scenarios: 2 trajectories kept"), "{}", run.out);
    let manifest = bench.json("two/dataset.json");
    assert_eq!((&manifest["links"], &manifest["state"]), (&2.into(), &11.into()));
    let shard = fs::metadata(bench.path("two/shard-00000.bin")).unwrap();
    assert_eq!(shard.len(), 12 + 17 + 5 + 2 * (12 + 7680) + 4);
    let other = "two/dataset.json: mission: this dataset was begun with another mission";
    bench.refuses(line, other);
}
