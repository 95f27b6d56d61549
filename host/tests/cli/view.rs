//! `remora view`, and the pages that `remora campaign --write report` and `remora fly` make.

use super::bench::Bench;
use serde_json::Value;
use std::path::Path;

const PLAN: &str = "plan --scenarios set.scenarios.json --out a.plan.json";

/// The data that stands in a page.
fn data(page: &str) -> Value {
    let begin = page.find("id=\"remora-data\">").expect("a page") + "id=\"remora-data\">".len();
    let end = begin + page[begin..].find('<').expect("an end");
    serde_json::from_str(&page[begin..end]).expect("JSON")
}

/// What a page refers to beside itself.
fn links(page: &str) -> Vec<&str> {
    page.split("href=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn a_page_holds_its_plan_and_loads_nothing() {
    let bench = Bench::new();
    bench.solves(PLAN);
    let said = bench.solves("view a.plan.json");
    assert_eq!(said.out, "written: a.html\n");
    let page = bench.read("a.html");
    assert!(page.len() < 1_500_000, "{}", page.len());
    assert!(
        !page.contains("src=") && !page.contains("http://") && !page.contains("<link rel=\"style")
    );
    let data = data(&page);
    let plan: Value = serde_json::from_str(&bench.read("a.plan.json")).unwrap();
    assert_eq!(data["plans"][0]["file"], plan);
    let evidence: Value = serde_json::from_str(&bench.read("a.evidence.json")).unwrap();
    assert_eq!(data["plans"][0]["input"], evidence["input"]);
    assert_eq!(bench.solves("view a.plan.json --out -").out, page);
}

#[test]
fn only_pages_are_replaced_and_nonsense_is_named() {
    let bench = Bench::new();
    bench.solves(PLAN);
    bench.solves("view a.plan.json");
    bench.solves("view a.plan.json");
    bench.write("mine.html", "<p>mine</p>");
    let refused = bench.run("view a.plan.json --out mine.html");
    assert_eq!(refused.status, 2);
    assert_eq!(refused.err, "error: mine.html: exists; --force replaces it\n");
    assert_eq!(bench.read("mine.html"), "<p>mine</p>");
    bench.solves("view a.plan.json --out mine.html --force");
    bench.write("a.parquet", "PAR1");
    bench
        .write("cut.jsonl", "{\"format\":\"remora-history/2\",\"run\":0,\"scenario\":\"a\"}\n{}\n");
    bench
        .write("old.jsonl", "{\"format\":\"remora-history/1\",\"run\":0,\"scenario\":\"a\"}\n{}\n");
    for (line, reason) in [
        (
            "view a.plan.json a.plan.json",
            "error: --out: several plans need a name for their page\n",
        ),
        ("view none.plan.json", "error: none.plan.json: no such file or directory\n"),
        (
            "view a.plan.json --flight a.plan.json",
            "error: a.plan.json: this is a plan; view --flight takes the history of a flight\n",
        ),
        (
            "view a.plan.json --flight a.parquet",
            "error: a.parquet: this is a Parquet table; view --flight takes the history of a flight\n",
        ),
        (
            "view a.plan.json --flight cut.jsonl",
            "error: cut.jsonl: ends before its last line: the file is damaged\n",
        ),
        (
            "view a.plan.json --flight old.jsonl",
            "error: old.jsonl: format: unknown format \"remora-history/1\"",
        ),
    ] {
        let refused = bench.run(line);
        assert_eq!(refused.status, 2, "{line}");
        assert!(refused.err.starts_with(reason), "{line}: {}", refused.err);
        assert_eq!(refused.err.lines().count(), 1, "{line}: {}", refused.err);
    }
    let mut bare = bench.json("a.plan.json");
    bare.as_object_mut().unwrap().remove("inputs").unwrap();
    bench.write("bare.plan.json", &bare.to_string());
    let refused = bench.run("view bare.plan.json");
    assert!(
        refused.err.starts_with("error: bare.plan.json: missing field `inputs`"),
        "{}",
        refused.err
    );
    assert!(!bench.path("bare.html").exists());
}

#[test]
fn flights_are_shown_against_their_plan() {
    let bench = Bench::new();
    bench.solves(PLAN);
    bench.solves("fly a.plan.json --guidance-rate 1 --keep all --out flown");
    bench.solves("view a.plan.json --flight flown/history/0.jsonl");
    let flights = &data(&bench.read("a.html"))["flights"];
    assert_eq!((&flights[0]["name"], &flights[0]["plan"]), (&"run 0".into(), &0.into()));
    let rows = &flights[0]["rows"];
    let count = rows["time_s"].as_array().unwrap().len();
    assert!((500..=601).contains(&count), "{count}");
    for column in ["bus_m", "bus_attitude", "target_attitude", "joint_angle", "force_n"] {
        assert_eq!(rows[column].as_array().unwrap().len(), count, "{column}");
    }
    // The page that the flights link to shows the same.
    let page = bench.read("flown/flights.html");
    assert!(links(&page).contains(&"pages/0.html"), "{:?}", links(&page));
    assert_eq!(data(&bench.read("flown/pages/0.html"))["flights"], *flights);
    // A flight of another scenario has no place on the page.
    bench.write(
        "b.plan.json",
        &bench.read("a.plan.json").replace("\"scenario\": \"", "\"scenario\": \"b"),
    );
    let refused = bench.run("view b.plan.json --flight flown/history/0.jsonl");
    assert_eq!(refused.status, 2);
    assert!(refused.err.contains("none of the plans is for that"), "{}", refused.err);
}

#[test]
fn a_campaign_links_its_notable_plans() {
    let bench = Bench::new();
    let said =
        bench.solves("campaign --count 3 --seed 1 --mode feasible --write report --out runs/a");
    assert!(said.out.contains("report.html"), "{}", said.out);
    let page = bench.read("runs/a/report.html");
    let pages: Vec<&str> = links(&page).into_iter().filter(|to| to.starts_with("pages/")).collect();
    assert!(!pages.is_empty(), "{:?}", links(&page));
    for to in pages {
        let id = Path::new(to).file_stem().unwrap().to_str().unwrap();
        let shown = data(&bench.read(&format!("runs/a/{to}")));
        assert_eq!(shown["plans"][0]["file"]["scenario"], id);
    }
}
