//! `remora campaign envelope`

use super::bench::Bench;
use serde_json::Value;

/// Two cells: one that is planned, one in which the arm is too slow.
const TWO: &str = "campaign envelope --mission default.mission.toml --rate 0 --distance 5 \
                   --horizon 60,1200 --count 2 --integrator euler --jobs 1";

/// The cells without their times.
fn cells(bench: &Bench) -> Value {
    let mut cells = bench.json("map/envelope.json")["cells"].take();
    for cell in cells.as_array_mut().unwrap() {
        if let Some(found) = cell["found"].as_object_mut() {
            found.remove("time_s");
        }
    }
    cells
}

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("default.mission.toml", "");
    bench
}

#[test]
fn a_map_is_written_with_its_page_and_figures() {
    let bench = bench();
    let run = bench.solves(&format!("{TWO} --out map"));
    assert!(run.out.contains("2 cells of 2 scenarios: 2 of 2 plans verified"), "{}", run.out);
    assert!(run.out.lines().all(|line| line.len() <= 100), "{}", run.out);
    let expected = [
        "envelope-default-1200.svg",
        "envelope.csv",
        "envelope.json",
        "envelope.md",
        "journal.jsonl",
    ];
    assert_eq!(bench.names("map"), expected);
    let map = bench.json("map/envelope.json");
    assert_eq!(map["format"], "remora-envelope/1");
    assert_eq!(map["cells"][0]["state"], "impossible");
    assert_eq!(map["cells"][1]["state"], "planned");
    assert_eq!(map["cells"][1]["found"]["optimal"], 2);
    let page = bench.read("map/envelope.md");
    assert!(page.contains("**60 s**: impossible, joint 2 would have to turn"), "{page}");
    assert!(page.contains("| 0 deg/s | **100 %** (16 to 100 %); "), "{page}");
    for file in ["map/envelope.md", "map/envelope-default-1200.svg"] {
        let command =
            "remora campaign envelope --mission default.mission.toml --rate 0 --distance 5";
        assert!(bench.read(file).contains(command), "{file}");
    }
    let rows = bench.read("map/envelope.csv");
    assert_eq!(rows.lines().count(), 3);
}

#[test]
fn finished_cells_are_not_planned_again() {
    let bench = bench();
    let more = TWO.replace("--rate 0", "--rate 0,0.05");
    bench.solves(&format!("{more} --out map"));
    let before = cells(&bench);
    // As a kill in the middle of writing the second cell leaves it.
    let journal = bench.read("map/journal.jsonl");
    let lines: Vec<&str> = journal.lines().collect();
    assert_eq!(lines.len(), 3);
    bench.write("map/journal.jsonl", &format!("{}\n{}\n{}", lines[0], lines[1], &lines[2][..30]));
    let run = bench.solves(&format!("{more} --out map"));
    assert!(run.out.contains("; 2 planned in"), "{}", run.out);
    assert!(run.out.contains(" 2 taken from the journal"), "{}", run.out);
    assert!(run.err.contains("resuming: 2 of 4"), "{}", run.err);
    assert_eq!(cells(&bench), before);
    // A map may grow; what is there stays.
    let run = bench.solves(&format!("{} --out map", more.replace("60,1200", "60,600,1200")));
    assert!(run.out.contains("; 4 planned in"), "{}", run.out);
    assert!(run.out.contains(" 4 taken from the journal"), "{}", run.out);
}

#[test]
fn bad_input_is_refused() {
    let bench = bench();
    let refuses = |arguments: &str, message: &str| {
        bench.refuses(&format!("campaign envelope {arguments} --out map"), message);
    };
    refuses("--mission none.toml", "none.toml: no such file or directory");
    bench.write("light.mission.toml", "[servicer]\nbus_mass_kg = -1\n");
    refuses("--mission light.mission.toml", "light.mission.toml: servicer.bus_mass_kg: must be");
    bench.write("light.toml", "");
    bench.write("light.mission.toml", "");
    let both = "--mission light.toml --mission light.mission.toml";
    refuses(both, "light.mission.toml: there is another vehicle called \"light\"");
    refuses("--rate -1", "invalid value '-1' for '--rate <R,..>': must be finite");
    refuses("--rate 1,x", "invalid value 'x' for '--rate <R,..>': expected a number");
    refuses("--distance 5,5", "--distance: 5 is given twice");
    refuses("--count 0", "invalid value '0' for '--count <N>'");
    refuses("--integrator rk4:2", "invalid value 'rk4:2' for '--integrator <NAME>'");
    refuses("--coarse --rate 1", "the argument '--coarse' cannot be used with");
    bench.write("file", "");
    bench.refuses("campaign envelope --coarse --out file", "file");
}

#[test]
fn another_map_is_not_resumed() {
    let bench = bench();
    bench.solves(&format!("{TWO} --out map"));
    let refuses = |arguments: &str, field: &str| {
        let message = format!("map/journal.jsonl: {field}: this map was begun with");
        bench.refuses(&format!("{arguments} --out map"), &message);
    };
    refuses(&format!("{TWO} --seed 2"), "seed");
    refuses(&TWO.replace("--count 2", "--count 3"), "count");
    refuses(&TWO.replace("euler", "rk4"), "integrator");
    bench.write("default.mission.toml", "[servicer]\nbus_mass_kg = 501\n");
    refuses(TWO, "vehicles");
}

#[test]
fn what_is_no_mission_or_has_no_start_is_no_failure() {
    let bench = bench();
    bench.write("default.mission.toml", "[approach]\nkeep_out_far_m = 50\n");
    let run = bench.solves(
        "campaign envelope --mission default.mission.toml --rate 0 --distance 5 --horizon 1200,100000 \
         --count 1 --out map",
    );
    assert!(run.out.contains("2 cells of 1 scenarios: 0 of 0 plans"), "{}", run.out);
    let rows = bench.read("map/envelope.csv");
    assert!(rows.contains("default,1200,0,5,no_start,,"), "{rows}");
    assert!(rows.contains("default,100000,0,5,refused,,"), "{rows}");
    assert!(bench.read("map/envelope.md").contains("**1200 s**: no start in any cell."));
}
