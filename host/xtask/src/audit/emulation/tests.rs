use super::*;

/// A plan of the sample: its scenario, status, start and instructions of QP and in all.
fn plan(scenario: &str, status: u32, start: u32, qp: u64, total: u64) -> String {
    let stage = r#"{"status": 0, "iterations": 4, "corrections": 0, "qp_iterations": 28}"#;
    format!(
        r#"{{"scenario": "{scenario}", "status": {status}, "verified": true, "start": {start},
        "output": "3fb38adbb015e50d", "translation": {stage}, "reorientation": {stage},
        "instructions": {{"translation": 1, "start": 2, "inference": 0, "linearise": 3,
        "qp": {qp}, "step": 4, "verify": 5, "rest": 6, "total": {total}}}}}"#
    )
}

/// The sample as it is written since guidance flies: slices of the plans, steps along the last of a run.
fn flown() -> String {
    let slice = |text: String, (total, slice): (&str, u32)| {
        text.replace(
            &format!(r#""total": {total}}}}}"#),
            &format!(r#""total": {total}}}, "longest_slice": {slice}}}"#),
        )
    };
    let text = [("1000", 70), ("1300", 90), ("800", 60)].into_iter().fold(sample(), slice);
    let steps = |next: u32, stack: u32| {
        format!(
            r#""stack_bytes": {{"plan": 1}}, "guidance": {{"next": {{"steps": 53,
            "instructions": {next}}}, "first": {{"steps": 7, "instructions": 142680}},
            "stack_bytes": {stack}}}, "#
        )
    };
    let old = r#""stack_bytes": {"plan": 27744, "verify": 17680},
        "#;
    assert_eq!(text.matches(old).count(), 2);
    let text = text.replacen(old, &steps(51_240, 3600), 1);
    let text = text.replacen(old, &steps(51_200, 3656), 1);
    text.replace(
        r#""panic_free""#,
        r#""guidance_bytes": 720, "flight_plan_bytes": 16904, "panic_free""#,
    )
}

#[test]
fn guidance_and_slices_are_those_of_the_hardest_run() {
    let old = Emulation::parse(&sample()).unwrap();
    assert_eq!((old.targets[0].guidance(), old.targets[0].longest_slice()), (None, None));
    assert_eq!(old.targets[0].guidance_bytes, None);
    let new = Emulation::parse(&flown()).unwrap();
    let target = &new.targets[0];
    let guidance = target.guidance().unwrap();
    assert_eq!(guidance.next, Steps { steps: 106, instructions: 51_240 });
    assert_eq!(guidance.first, Steps { steps: 14, instructions: 142_680 });
    assert_eq!(guidance.stack_bytes, Some(3656));
    assert_eq!(target.longest_slice(), Some(90));
    // Of equals the first is named.
    assert_eq!(target.runs[0].longest_slice(), Some((90, "b")));
    assert_eq!((target.guidance_bytes, target.flight_plan_bytes), (Some(720), Some(16_904)));
    let tables = new.tables();
    let table = |name: &str| {
        let found = tables.iter().find(|(heading, _)| heading == name);
        found.map(|(_, table)| table.markdown()).unwrap()
    };
    let maxima = table("Observed maxima");
    for row in [
        "| generic-rv64 | Euler | heuristic | 0.001300 | b | 90 | b | 51240 of 53 | 142680 of 7 | 3600 |",
        "| generic-rv64 | Euler | model | 2500 | a | - | - | 51200 of 53 | 142680 of 7 | 3656 |",
    ] {
        assert!(maxima.contains(row), "{maxima}");
    }
    let plans = new.plan_maxima().markdown();
    assert!(plans.contains("| Euler, heuristic | 0.001300, b |"), "{plans}");
    assert!(plans.contains("| Euler, model | 2500, a |"), "{plans}");
    let cycles = new.cycle_maxima().markdown();
    assert!(cycles.contains("| generic-rv64 | 90 | 51240 | 142680 | 3656 |"), "{cycles}");
    let unflown = old.cycle_maxima().markdown();
    assert!(unflown.contains("| generic-rv64 | - | - | - | - |"), "{unflown}");
    for (heading, table) in &tables {
        let widest = table.to_string().lines().map(|line| line.chars().count()).max();
        assert!(widest <= Some(100), "{heading}: {widest:?}");
    }
}

fn run(start: &str, plans: &[String]) -> String {
    format!(
        r#"{{"integrator": "euler", "start": "{start}", "same_bits_as_host": true,
        "repeatable": null, "counter": {{"expected": 2000000, "counted": 2000000, "resolution": 40}},
        "open_model_instructions": null, "stack_bytes": {{"plan": 27744, "verify": 17680}},
        "plans": [{}]}}"#,
        plans.join(", ")
    )
}

fn report(runs: &[String]) -> String {
    format!(
        r#"{{"format": "remora-firmware/2", "targets": [
        {{"target": "thumbv7em-none-eabihf", "board": "mps2-an500", "cpu": "generic-rv64",
        "toolchain": "Debian rustc 1.96.0", "clock_hz": 300000000, "image_bytes": 359568,
        "model_bytes": 823923, "static_bytes": 1016200, "stack_size_bytes": 262144,
        "workspace_bytes": 409464, "solver_bytes": 542168, "network_bytes": 64560,
        "panic_free": true,
        "parts": [{{"name": "tumble", "calls": 1, "instructions": 376360}}],
        "runs": [{}]}}]}}"#,
        runs.join(", ")
    )
}

fn sample() -> String {
    let plans = [
        plan("a", 0, 0, 700, 1000),
        plan("b", 0, 0, 900, 1300),
        plan("c", 0, 0, 500, 800),
        plan("d", 0, 0, 600, 1300),
    ];
    report(&[run("heuristic", &plans), run("model", &[plan("a", 1, 5, 700, 2_500_000_000)])])
}

#[test]
fn phases_have_minimum_median_and_maximum() {
    let emulation = Emulation::parse(&sample()).unwrap();
    let run = emulation.targets[0].run(IntegratorName::Euler, StartName::Heuristic).unwrap();
    let qp = run.observed(Phase::Qp).unwrap();
    let found = (qp.min_instructions, qp.median_instructions, qp.max_instructions);
    assert_eq!(found, (500, 650, 900));
    assert_eq!(qp.max_scenario, "b");
    // Of equals the first is named.
    assert_eq!(run.observed(Phase::Total).unwrap().max_scenario, "b");
    assert_eq!(run.observed(Phase::Verify).unwrap().median_instructions, 5);
}

#[test]
fn plans_are_counted() {
    let emulation = Emulation::parse(&sample()).unwrap();
    let [heuristic, model] = &emulation.targets[0].runs[..] else { panic!("two runs") };
    assert_eq!((heuristic.scenarios, heuristic.solved, heuristic.fell_back), (4, 4, 0));
    assert_eq!((model.scenarios, model.solved, model.fell_back), (1, 0, 1));
    assert_eq!(model.plans[0].qp_iterations(), 56);
    assert!(!emulation.is_sound(), "a plan is not solved");
    let solved = report(&[run("heuristic", &[plan("a", 0, 0, 1, 2)])]);
    assert!(Emulation::parse(&solved).unwrap().is_sound());
    for (right, wrong) in [
        (r#""same_bits_as_host": true"#, r#""same_bits_as_host": false"#),
        (r#""repeatable": null"#, r#""repeatable": false"#),
        (r#""panic_free": true"#, r#""panic_free": false"#),
        (r#""counted": 2000000"#, r#""counted": 2000049"#),
        (r#""counted": 2000000"#, r#""counted": 1999959"#),
        (r#""verified": true"#, r#""verified": false"#),
    ] {
        let emulation = Emulation::parse(&solved.replace(right, wrong)).unwrap();
        assert!(!emulation.is_sound(), "{wrong}");
    }
}

#[test]
fn marks_are_the_largest_of_all_runs() {
    let text = sample().replacen(r#""plan": 27744"#, r#""plan": 20000"#, 1);
    let emulation = Emulation::parse(&text).unwrap();
    let target = &emulation.targets[0];
    assert_eq!(target.runs[0].stack_bytes["plan"], 20000);
    assert_eq!(target.stack_bytes["plan"], 27744);
    assert_eq!(target.stack_bytes["verify"], 17680);
}

#[test]
fn errors_name_the_place() {
    let error = |text: &str| Emulation::parse(text).unwrap_err();
    let wrong = |from: &str, to: &str| error(&sample().replacen(from, to, 1));
    assert_eq!(wrong("firmware/2", "firmware/1").field, "format");
    assert_eq!(wrong("359568", "-1").field, "targets[0].image_bytes");
    assert_eq!(
        wrong(r#""qp": 700"#, r#""qp": 0.5"#).field,
        "targets[0].runs[0].plans[0].instructions.qp"
    );
    assert_eq!(wrong("heuristic", "guess").field, "targets[0].runs[0].start");
    assert_eq!(error(&report(&[])).field, "targets[0].runs");
    assert_eq!(error(&report(&[run("model", &[])])).field, "targets[0].runs[0].plans");
    let none = error(r#"{"format": "remora-firmware/2", "targets": []}"#);
    assert_eq!(none.field, "targets");
    // Where it ends early, the line.
    let cut = error(&sample()[..900]);
    assert!(cut.reason.contains("line"), "{}", cut.reason);
    let missing = Emulation::read(Path::new("no/report.json")).unwrap_err().to_string();
    assert_eq!(missing, "no/report.json: no such file or directory");
}

#[test]
fn tables_have_a_row_for_everything() {
    let emulation = Emulation::parse(&sample()).unwrap();
    let tables = emulation.tables();
    let headings: Vec<&str> = tables.iter().map(|(heading, _)| heading.as_str()).collect();
    assert_eq!(
        headings,
        [
            "Images",
            "Runs under emulation",
            "Stack, high-water mark [bytes]",
            "Instructions [10^6]: Euler, start from the heuristic",
            "Instructions [10^6]: Euler, start from the model",
            "Observed maxima",
            "Parts of a plan, one by one",
        ]
    );
    let text = |i: usize| tables[i].1.markdown();
    assert!(
        text(1).contains("| generic-rv64 | Euler | model | 0 of 1 | 1 | yes | - | 0 of 2000000 |")
    );
    assert!(text(2).contains("| generic-rv64 | Euler | heuristic | plan | 27744 |"));
    assert!(text(4).contains("| generic-rv64 | whole plan | 2500 | 2500 | 2500 | a |"));
    assert!(!text(4).contains("warm start"), "a phase without instructions is left out");
    assert!(text(5).contains("| generic-rv64 | Euler | model | 2500 | a | - | - | - | - | - |"));
    assert!(text(6).contains("| generic-rv64 | tumble | 1 | 376360 |"));
    let phases = emulation.phase_maxima().markdown();
    assert!(phases.contains("| phase | generic-rv64 |"), "{phases}");
    assert!(phases.contains("| QP | 9.00e-4 |"), "the most of both runs: {phases}");
    assert!(phases.contains("| whole plan | 2500 |"), "{phases}");
}

#[test]
fn tables_fit_a_terminal() {
    for (heading, table) in Emulation::parse(&sample()).unwrap().tables() {
        let widest = table.to_string().lines().map(|line| line.chars().count()).max();
        assert!(widest <= Some(100), "{heading}: {widest:?}");
    }
}
