//! Parts of a campaign: `--part`, `remora campaign gather`

mod kills;
mod others;
mod table;

use super::bench::Bench;
use serde_json::{Value, json};
use std::fs;

const CAMPAIGN: &str = "campaign --count 6 --seed 3 --integrator euler";

/// Makes all parts.
fn make(bench: &Bench, campaign: &str, of: u64, out: &str) {
    for number in 1..=of {
        bench.solves(&format!("{campaign} --part {number}/{of} --out {out}"));
    }
}

fn gathered(bench: &Bench, out: &str) -> Value {
    serde_json::from_str(&bench.run(&format!("campaign gather {out} --json")).out).unwrap()
}

// Verifies REM-CMP-001.
#[test]
fn parts_together_are_the_campaign() {
    let bench = Bench::new();
    bench.solves(&format!("{CAMPAIGN} --out whole"));
    for of in [1, 4] {
        let out = format!("parts/{of}");
        make(&bench, CAMPAIGN, of, &out);
        let run = bench.solves(&format!("campaign gather {out} --recompute 3"));
        assert!(run.out.starts_with("6 scenarios: 6 solved (100.00 %)"), "{}", run.out);
        assert!(run.out.contains(&format!("parts: {of} of {of}\n")), "{}", run.out);
        assert!(run.out.contains("planned again: 3, of which 0 differ"), "{}", run.out);
        let timeless = |name: &str| super::bench::timeless(bench.json(name));
        let mut summary = timeless(&format!("{out}/summary.json"));
        summary["run"] = timeless("whole/summary.json")["run"].clone();
        assert_eq!(summary, timeless("whole/summary.json"));
        // A part that is there is left as it is.
        let again = bench.solves(&format!("{CAMPAIGN} --part 1/{of} --out {out}"));
        assert!(again.out.contains("rows, 0 planned now"), "{}", again.out);
    }
    let files = |i| ["jsonl", "parquet"].map(|end| format!("part-0000{i}-of-00004.{end}"));
    let expected: Vec<String> =
        (1..=4).flat_map(files).chain(["summary.json".to_string()]).collect();
    assert_eq!(bench.names("parts/4"), expected);
    let (one, four) = (gathered(&bench, "parts/1"), gathered(&bench, "parts/4"));
    assert_eq!(one["checksum"], four["checksum"]);
    assert_eq!(table::rows(&bench, "parts/1"), table::rows(&bench, "parts/4"));
    assert_eq!(table::rows(&bench, "parts/1").len(), 6);
    // The table says the same as the rows.
    let rows = table::rows_of(&bench, "parts/1/part-00001-of-00001.jsonl");
    let (columns, entries) = table::columns(&bench, "parts/1/part-00001-of-00001.parquet");
    for (column, path) in
        [("stage2_cost", "/row/stage2/cost"), ("residual_pointing", "/row/residuals/6")]
    {
        let said: Vec<f64> =
            rows.iter().map(|row| row.pointer(path).unwrap().as_f64().unwrap()).collect();
        assert_eq!(columns[column], said, "{column}");
    }
    let header = table::header(&bench, "parts/1/part-00001-of-00001.jsonl");
    assert_eq!(entries["remora.part"], header);
    // A set of a file is made in parts too.
    let listed = "campaign --scenarios set.scenarios.json --integrator euler";
    make(&bench, listed, 2, "listed");
    bench.solves("campaign gather listed --recompute 9");
}

// Verifies REM-CMP-001.
#[test]
fn what_is_missing_is_named() {
    let bench = Bench::new();
    for number in [1, 4] {
        bench.solves(&format!("{CAMPAIGN} --part {number}/5 --out parts"));
    }
    let run = bench.run("campaign gather parts");
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(run.out.contains("parts: 2 of 5\nmissing: 2, 3, 5\n"), "{}", run.out);
    assert_eq!(gathered(&bench, "parts")["missing"], serde_json::json!(["2/5", "3/5", "5/5"]));
    assert!(!bench.path("parts/summary.json").exists());
    bench.refuses("campaign gather nowhere", "nowhere: no such file or directory");
    fs::create_dir(bench.path("empty")).unwrap();
    bench.refuses("campaign gather empty", "empty: holds no part");
}

// Verifies REM-CMP-001.
#[test]
fn parts_of_another_kind_are_refused() {
    let bench = Bench::new();
    bench.write("heavy.mission.toml", "[servicer]\nbus_mass_kg = 501\n");
    let second = "parts/part-00002-of-00002.jsonl";
    for (other, field) in [
        (CAMPAIGN.replace("--seed 3", "--seed 4"), "seed"),
        (CAMPAIGN.replace("--count 6", "--count 7"), "count"),
        (format!("{CAMPAIGN} --mode feasible"), "mode"),
        (format!("{CAMPAIGN} --warm-start heuristic"), "warm_start"),
        (format!("{CAMPAIGN} --mission heavy.mission.toml"), "mission"),
        (format!("{CAMPAIGN} --write nodes"), "nodes"),
        (format!("{CAMPAIGN} --deadline 1000"), "settings"),
    ] {
        bench.solves(&format!("{CAMPAIGN} --part 1/2 --out parts"));
        bench.solves(&format!("{other} --part 2/2 --out parts"));
        let message = format!("{second}: {field}: is of another kind than the first part: ");
        bench.refuses("campaign gather parts", &message);
        // Nor is it taken for this one's.
        let what = match field {
            "settings" => "another --model, another --deadline or other planner settings",
            field => &format!("another {field}"),
        };
        let message = format!("{second}: {field}: this part was begun with {what}; choose");
        bench.refuses(&format!("{CAMPAIGN} --part 2/2 --out parts"), &message);
        fs::remove_file(bench.path(second)).unwrap();
    }
    bench.solves(&format!("{CAMPAIGN} --part 2/3 --out parts"));
    let run = bench.run("campaign gather parts");
    assert!(
        run.status == 2 && run.err.contains("is one of 3 parts, others are of 2"),
        "{}",
        run.err
    );
}

// Verifies REM-CMP-001.
#[test]
fn a_damaged_part_is_named() {
    let bench = Bench::new();
    make(&bench, CAMPAIGN, 2, "parts");
    let file = "parts/part-00002-of-00002.jsonl";
    let whole = fs::read(bench.path(file)).unwrap();
    bench.write(file, &whole[..whole.len() - 9]);
    bench.refuses("campaign gather parts", &format!("{file}: line 6: is cut off"));
    bench.write(file, "PAR1 is no part");
    bench.refuses("campaign gather parts", &format!("{file}: line 1: is cut off"));
    let first = fs::read(bench.path("parts/part-00001-of-00002.jsonl")).unwrap();
    bench.write(file, &first);
    bench.refuses("campaign gather parts", &format!("{file}: part: is 1/2"));
    bench.write(file, &whole);
    // A cost that somebody has made better.
    table::plant(&bench, file, "/row/stage1/cost", table::Sum::Stale);
    bench.refuses("campaign gather parts", &format!("{file}: checksum: does not match the rows"));
    bench.write(file, &whole);
    let table = "parts/part-00002-of-00002.parquet";
    let mut damaged = fs::read(bench.path(table)).unwrap();
    damaged[99] ^= 1;
    bench.write(table, &damaged);
    bench.refuses("campaign gather parts", &format!("{table}: is not as it was written"));
    fs::remove_file(bench.path(table)).unwrap();
    bench.refuses("campaign gather parts", &format!("{table}: no such file"));
}

/// A machine that computes wrongly writes a part that is sound in itself.
// Verifies REM-CMP-003.
#[test]
fn a_wrong_row_is_found_by_planning_again() {
    let bench = Bench::new();
    for (column, path) in
        [("plan_checksum", "/row/plan_checksum"), ("stage2_cost", "/row/stage2/cost")]
    {
        make(&bench, CAMPAIGN, 3, column);
        let file = format!("{column}/part-00002-of-00003.jsonl");
        table::plant(&bench, &file, path, table::Sum::Right);
        bench.solves(&format!("campaign gather {column}"));
        let run = bench.run(&format!("campaign gather {column} --recompute 6"));
        assert_eq!(run.status, 1, "{}", run.err);
        let told = format!("planned again: 6, of which 1 differ\n  part 2/3: s3-002: {column}\n");
        assert!(run.out.contains(&told), "{}", run.out);
    }
}

/// A sum that is right does not make a row of what no plan has.
// Verifies REM-CMP-001.
#[test]
fn a_forged_row_is_refused() {
    let bench = Bench::new();
    make(&bench, CAMPAIGN, 2, "parts");
    let file = "parts/part-00002-of-00002.jsonl";
    let whole = fs::read(bench.path(file)).unwrap();
    // JSON has no other word for what is no number.
    for (path, value, field) in [
        ("/row/residuals/0", json!(1e9), "residuals.dynamics1"),
        ("/row/residuals/0", Value::Null, "residuals.dynamics1"),
        ("/row/residuals/0", json!(-1.0), "residuals.dynamics1"),
        ("/row/stage2/cost", Value::Null, "stage2.cost"),
        ("/row/stage2/cost", json!(-1.0), "stage2.cost"),
        ("/row/stage2/cost", json!(1e308), "stage2.cost"),
        ("/row/status", json!("infeasible"), "verdict"),
        ("/row/reason", json!("keep_out"), "reason"),
        ("/row/time_s", json!(-1.0), "time_s"),
        ("/row/stage1/time_s", Value::Null, "stage1.time_s"),
        ("/row/plan_checksum", json!("zz"), "plan_checksum"),
        ("/row/warm_start", json!("warm"), "warm_start"),
        ("/row/stage1/iterations", json!(1_u64 << 40), "stage1.iterations"),
        ("/row/status", json!("fine"), "row.status"),
        ("/row/scenario", json!("s3-009"), "scenario"),
        ("/index", json!(5), "scenario"),
    ] {
        bench.write(file, &whole);
        table::put(&bench, file, path, &value);
        bench.refuses("campaign gather parts", &format!("{file}: line 3: {field}: "));
    }
    // A scenario of a list that has two rows.
    make(&bench, "campaign --scenarios set.scenarios.json --integrator euler", 2, "listed");
    let file = "listed/part-00002-of-00002.jsonl";
    table::put(&bench, file, "/row/scenario", &json!("s1-000"));
    bench.refuses(
        "campaign gather listed",
        &format!("{file}: line 3: scenario: \"s1-000\" has a row already"),
    );
}

/// Who gathers a directory does not write over other work's files.
// Verifies REM-CMP-001.
#[test]
fn a_directory_of_two_kinds_is_refused() {
    let bench = Bench::new();
    let whole = "campaign --count 1 --seed 3 --integrator euler --out both";
    bench.solves(whole);
    bench.solves(&format!("{whole} --part 1/1"));
    let beside = "and there are parts of a campaign beside it: move either elsewhere";
    for name in ["journal.jsonl", "results.parquet"] {
        let told = format!("both/{name}: is of a campaign in one piece, {beside}");
        bench.refuses("campaign gather both", &told);
        fs::remove_file(bench.path(&format!("both/{name}"))).unwrap();
    }
    bench.write("both/dataset.json", "{}");
    bench.refuses("campaign gather both", &format!("both/dataset.json: is of a dataset, {beside}"));
    fs::remove_file(bench.path("both/dataset.json")).unwrap();
    bench.solves("campaign gather both");
}

/// A journal that a kill has left beside its part goes when the part is asked for again.
// Verifies REM-CMP-002.
#[test]
fn a_journal_beside_its_part_goes() {
    let bench = Bench::new();
    let line = format!("{CAMPAIGN} --part 1/6 --out parts");
    bench.solves(&line);
    let (rows, log) =
        ("parts/part-00001-of-00006.jsonl", "parts/part-00001-of-00006.journal.jsonl");
    bench.write(log, &format!("{}\n", table::header(&bench, rows)));
    bench.solves(&line);
    let there = ["part-00001-of-00006.jsonl", "part-00001-of-00006.parquet"];
    assert_eq!(bench.names("parts"), there);
}

#[test]
fn nodes_are_a_table_of_their_own() {
    let bench = Bench::new();
    make(&bench, &format!("{CAMPAIGN} --write nodes"), 2, "parts");
    bench.solves("campaign gather parts --recompute 1");
    let names = bench.names("parts");
    let nodes = "nodes-part-00001-of-00002.parquet";
    assert!(names.contains(&nodes.to_string()), "{names:?}");
    let (columns, entries) = table::columns(&bench, &format!("parts/{nodes}"));
    let column = |name: &str| &columns[name];
    assert_eq!(column("node").len(), 3 * 60);
    assert_eq!((column("node")[59], column("node")[60]), (59.0, 0.0));
    bench.solves(
        "plan --integrator euler --scenarios s.scenarios.json --out a.plan.json"
            .replace("--scenarios s.scenarios.json", {
                bench.solves("draw --count 1 --seed 3 --out s.scenarios.json");
                "--scenarios s.scenarios.json"
            })
            .as_str(),
    );
    let plan = bench.json("a.plan.json");
    assert_eq!(plan["stage1"]["position_rtn_m"][7][0], column("position_r_m")[7]);
    assert_eq!(plan["stage2"]["joint_angle_rad"][59][2], column("joint_angle_2_rad")[59]);
    assert_eq!(plan["target"]["rate_rtn_rad_s"][1][1], column("target_rate_t_rad_s")[1]);
    assert_eq!(column("force_r_n")[59], 0.0);
    let units: Value = serde_json::from_str(&entries["remora.units"]).unwrap();
    assert_eq!(units["joint_torque_0_n_m"], "N m");
    let about: Value = serde_json::from_str(&entries["remora.about"]).unwrap();
    assert_eq!(about["bus_attitude_*"], "quaternion, body to RTN");
    fs::remove_file(bench.path(&format!("parts/{nodes}"))).unwrap();
    bench.refuses("campaign gather parts", &format!("parts/{nodes}: no such file"));
    // Nor is the part taken for whole: its rows alone say nothing of the nodes.
    let again = format!("{CAMPAIGN} --write nodes --part 1/2 --out parts");
    let told = "no such file: remove part-00001-of-00002.jsonl to make the part again";
    bench.refuses(&again, &format!("parts/{nodes}: {told}"));
    fs::remove_file(bench.path("parts/part-00001-of-00002.jsonl")).unwrap();
    bench.solves(&again);
    bench.solves("campaign gather parts");
}

/// Tables of nodes are the parts' own, and as they were written.
// Verifies REM-CMP-001, REM-CMP-003.
#[test]
fn a_damaged_table_of_nodes_is_named() {
    let bench = Bench::new();
    make(&bench, &format!("{CAMPAIGN} --write nodes"), 2, "parts");
    let run = bench.solves("campaign gather parts --recompute 6");
    assert!(run.out.contains("planned again: 6, of which 0 differ"), "{}", run.out);
    let file = "parts/nodes-part-00002-of-00002.parquet";
    let whole = fs::read(bench.path(file)).unwrap();
    // The same part with another mission's nodes.
    bench.write("heavy.mission.toml", "[servicer]\nbus_mass_kg = 501\n");
    let heavy =
        format!("{CAMPAIGN} --mission heavy.mission.toml --write nodes --part 2/2 --out heavy");
    bench.solves(&heavy);
    let read = |name: &str| fs::read(bench.path(name)).unwrap();
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    for bytes in [
        vec![],
        whole[..whole.len() - 9].to_vec(),
        flipped,
        read("parts/part-00002-of-00002.parquet"),
        read("parts/nodes-part-00001-of-00002.parquet"),
        read("heavy/nodes-part-00002-of-00002.parquet"),
    ] {
        bench.write(file, &bytes);
        bench.refuses("campaign gather parts", &format!("{file}: is not as it was written"));
    }
    bench.write(file, &whole);
    bench.solves("campaign gather parts");
}

#[test]
fn arguments() {
    let bench = Bench::new();
    let refuses = |arguments: &str, message: &str| {
        bench.refuses(&format!("campaign {arguments} --out runs"), message);
    };
    let six = "--count 6 --seed 3";
    refuses(&format!("{six} --part 0/3"), "invalid value '0/3' for '--part <I/N>': parts are 1/N");
    refuses(&format!("{six} --part 3"), "invalid value '3' for '--part <I/N>': expected a part");
    refuses(
        &format!("{six} --part 7/7"),
        "--part: is 7/7, and there are 6 scenarios: ask for 6 parts at most",
    );
    for other in ["plans", "csv", "report"] {
        let message = format!("--write: {other} cannot be used with --part");
        refuses(&format!("{six} --part 1/2 --write {other}"), &message);
        refuses(&format!("{six} --part 1/2 --write nodes,{other}"), &message);
    }
    refuses(&format!("{six} --write nodes"), "--write: nodes needs --part I/N");
    refuses(&format!("{six} --write csv,plants"), "invalid value 'plants' for '--write <WHAT>'");
    refuses(
        "--count 10001 --seed 1 --write plans",
        "--write: 10001 plan files are too many for a directory: --part I/N --write nodes writes",
    );
    refuses(
        "--count 50001 --seed 1",
        "--count: 50001 scenarios are too many in one piece: --part I/N keeps none of them",
    );
}

/// A directory may be called anything; what a part keeps of its command is text.
#[test]
#[cfg(unix)]
fn arguments_that_are_no_text_are_kept_or_refused() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let bench = Bench::new();
    let run = |arguments: &str, last: &[u8]| {
        let output = bench.command(arguments).arg(OsStr::from_bytes(last)).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let campaign = "campaign --count 2 --seed 1 --integrator euler --part 1/1";
    let (status, err) = run(&format!("--quiet {campaign} --out"), b"part\xff");
    assert_eq!((status, err.as_str()), (Some(0), ""));
    let (status, err) = run(&format!("{campaign} --out a --mission"), b"none\xff");
    assert_eq!((status, err.lines().count()), (Some(2), 1), "{err}");

    // A directory whose name begins as an option does.
    bench.solves(&format!("{CAMPAIGN} --part 1/1 --out=-dash"));
    assert_eq!(bench.run("campaign gather --recompute 2 -- -dash").status, 0);
}
