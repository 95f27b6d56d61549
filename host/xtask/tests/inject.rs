//! Fault injection: what becomes of faults of each kind, and that the injector would see a plan that
//! is not what it is said to be.

use remora_core::advanced::model::{Mission, Scenario};
use remora_core::advanced::nn::{BitFlip, Part};
use remora_core::advanced::planner::{
    EmbeddedSolver, InitialGuess, Options, PlanSettings, Platform, Report, Workspace, plan,
};
use remora_core::advanced::qp::kept::Part as Kept;
use remora_core::advanced::scp::Status;
use remora_core::advanced::stages::{Mode, NODES, verify};
use remora_core::advanced::time::Deadline;
use remora_host::choice::Choice;
use remora_host::formats::{self, GuessRecord, ScenarioSet};
use remora_host::learned::Learned;
use remora_host::memory::on_heap;
use remora_host::method::Integrator;
use std::num::NonZeroUsize;
use xtask::inject::{
    Case, Claim, Class, Course, Fault, GUIDANCE_FIELDS, Injection, Injector, Judge, LoopFault,
    PROGRAM_FIELDS, Plan, Record, SOLUTION_FIELDS, START_FIELDS, Site,
};

/// Faults in the first of the built-in scenarios.
fn injector(scenarios: usize) -> Injector {
    let mut set = ScenarioSet::built_in().unwrap();
    set.scenarios.truncate(scenarios);
    Injector {
        seed: 1,
        sites: Site::ALL.to_vec(),
        scenarios: set.scenarios,
        mission: formats::Mission::default(),
        integrator: Integrator::Euler,
    }
}

fn run(injector: &Injector, count: u64, jobs: usize) -> Injection {
    let jobs = NonZeroUsize::new(jobs).unwrap();
    injector.run(count, jobs, None, &mut (), &|case| panic!("case {case} hangs")).unwrap()
}

/// The help's first example plans all public scenarios with the default integrator, from the heuristic too;
/// this one takes the most iterations.
#[test]
fn the_default_integrator_solves_the_slowest_public_scenario_without_a_fault() {
    let mut set = ScenarioSet::built_in().unwrap();
    set.scenarios.retain(|scenario| scenario.id == "pub-006");
    run(&Injector { scenarios: set.scenarios, integrator: Integrator::RK4, ..injector(1) }, 2, 1);
}

/// What becomes of a fault in the first scenario.
fn inject(fault: Fault) -> Record {
    let case = Case { number: 0, scenario: 0, fault };
    injector(1).inject(&case).unwrap().record
}

/// The place of a name in a table of fields.
fn field(table: &[(&str, usize)], name: &str) -> usize {
    table.iter().position(|(field, _)| *field == name).unwrap()
}

fn program(name: &str, call: u32, node: usize, element: usize, bit: u32) -> Fault {
    let field = field(&PROGRAM_FIELDS, name);
    Fault::Program { solution: false, call, field, node, element, bit }
}

fn file(checked: bool, byte: usize, bit: u32) -> Fault {
    Fault::File { checked, part: "by.hand".into(), element: 0, byte, bit }
}

#[test]
fn cases_at_all_sites_do_no_harm() {
    do_no_harm(10);
}

#[test]
#[ignore = "nightly: half a minute"]
fn hundreds_of_cases_at_all_sites_do_no_harm() {
    do_no_harm(40);
}

/// Runs so many cases a site.
fn do_no_harm(each: u64) {
    let count = each * Site::COUNT;
    let injection = run(&injector(6), count, 2);
    assert!(injection.is_sound(), "{:?}", injection.forbidden);
    assert_eq!((injection.total.cases, injection.records.len() as u64), (count, count));
    assert_eq!(injection.sites.len(), Site::ALL.len());
    assert!(injection.sites.iter().all(|share| share.cases == each));
    // Every bit that flips in a file before it is opened is found.
    assert_eq!(injection.sites[0].classes.detected, each);
    let total = injection.total.classes;
    assert!(total.no_effect > 0 && total.tolerated > 0, "{total:?}");
    assert!(injection.leak_checks >= count / 16);
    let kinds: u64 = injection.kinds.iter().map(|share| share.cases).sum();
    assert_eq!(kinds, count);
}

#[test]
fn results_do_not_depend_on_the_number_of_threads_and_any_case_can_be_run_again() {
    let injector = injector(2);
    let (one, two) = (run(&injector, 60, 1), run(&injector, 60, 2));
    assert!(one == two);
    assert_eq!(one.csv(), two.csv());
    for record in one.records.iter().step_by(5) {
        assert_eq!(injector.replay(record.case).unwrap().record, *record);
    }
    // Fewer cases are the beginning of more, and those of one site are those of all.
    assert!(run(&injector, 24, 2).records == one.records[..24]);
    let sites = vec![Site::QpData, Site::KvCache];
    let some = run(&Injector { sites, ..injector.clone() }, 8, 2).records;
    let among = |record: &&Record| matches!(record.site, Site::QpData | Site::KvCache);
    assert!(some.iter().eq(one.records.iter().filter(among).take(8)));
    // Another seed has other cases.
    assert!(run(&Injector { seed: 2, ..injector }, 8, 2).records != one.records[..8]);
}

#[test]
fn what_is_refused_is_detected() {
    let length = Learned::built_in_file(Integrator::Euler).len();
    for (fault, start) in [
        (file(false, length - 1, 7), GuessRecord::Refused),
        (file(false, 0, 0), GuessRecord::Refused),
        (file(false, length / 2, 3), GuessRecord::Refused),
        // The checksum is right, but it is no model any more.
        (file(true, 0, 0), GuessRecord::Refused),
        // The last number of the decoder: a rate of 1e38 times its scale.
        (file(true, length - 5, 6), GuessRecord::NotFinite),
    ] {
        let record = inject(fault);
        assert_eq!((record.class, record.start), (Class::Detected, start), "{record:?}");
        assert_eq!(record.status, Status::Solved);
    }
    let rate = Fault::Start {
        accepted: false,
        field: field(&START_FIELDS, "rate"),
        node: 20,
        element: 1,
        bit: 62,
    };
    let record = inject(rate);
    assert_eq!((record.class, record.start), (Class::Detected, GuessRecord::NotFinite));
    // A bound that is lower than the one below it: the solver refuses, and the loop goes on.
    let record = inject(program("upper_u", 5, 12, 1, 63));
    assert_eq!((record.class, record.start), (Class::Detected, GuessRecord::Learned), "{record:?}");
}

#[test]
fn what_is_used_is_tolerated_or_does_nothing() {
    // The seventh token is of node 30.
    let residual = |bit| Fault::Memory {
        cached: false,
        within: false,
        node: 30,
        bit_flip: BitFlip { call: 6 * 15 + 5, part: Part::Residual, element: 7, bit },
    };
    assert_eq!(inject(residual(20)).class, Class::Tolerated);
    // Beyond the model's width nothing is read.
    let beyond = BitFlip { call: 6 * 15 + 5, part: Part::Residual, element: 96, bit: 30 };
    let beyond = Fault::Memory { cached: false, within: false, node: 30, bit_flip: beyond };
    assert_eq!(inject(beyond).class, Class::NoEffect);
    let torque = |accepted| Fault::Start {
        accepted,
        field: field(&START_FIELDS, "bus_torque"),
        node: 10,
        element: 0,
        bit: 50,
    };
    for accepted in [false, true] {
        let record = inject(torque(accepted));
        assert_eq!(record.class, Class::Tolerated);
        assert_ne!(record.extra_cost, 0.0);
    }
    let record = inject(program("constant", 5, 0, 0, 3));
    assert_eq!((record.class, record.extra_iterations), (Class::NoEffect, 0));
    assert_eq!(record.extra_cost, 0.0);
}

/// Stage 1's first program has no other to fall back on: it is solved again, from sound data. Here a bound that
/// contradicts another, a program that is solved and leads elsewhere, and a solution that does.
#[test]
fn stage_1s_first_program_gets_a_second_try() {
    let u = field(&SOLUTION_FIELDS, "u");
    let solution =
        Fault::Program { solution: true, call: 0, field: u, node: 20, element: 0, bit: 62 };
    for fault in [program("lower_u", 0, 43, 5, 56), program("b", 0, 20, 0, 62), solution] {
        let record = inject(fault);
        assert_eq!((record.class, record.start), (Class::Detected, GuessRecord::Learned));
        assert_eq!((record.extra_iterations, record.extra_cost), (1, 0.0), "{record:?}");
    }
}

fn kept(part: Kept, stage: usize, moment: u32, name: &str, node: usize, bit: u32) -> Record {
    let field = field(LoopFault::fields(part, stage), name);
    inject(Fault::Loop(LoopFault { part, stage, moment, field, node, element: 0, bit }))
}

/// Forces from which Stage 1's loop finds no way back: no plan, but the next one is sound.
#[test]
fn what_fails_says_so_and_leaves_nothing_behind() {
    let record = injector(60).replay(414).unwrap().record;
    assert_eq!((record.class, record.site), (Class::FailedCleanly, Site::LoopIterate));
    assert!(record.status != Status::Solved && !record.is_verified);
}

/// A path that is not what its forces lead to is planned again.
#[test]
fn a_struck_path_is_planned_again() {
    let record = kept(Kept::Path, 0, 4, "velocity", 30, 50);
    assert_eq!((record.site, record.status), (Site::Path, Status::Solved), "{record:?}");
    assert!(record.is_verified && record.class == Class::Tolerated, "{record:?}");
    assert!(record.extra_iterations > 0, "{record:?}");
}

/// What the loop keeps is made anew with each step that it takes.
#[test]
fn what_a_loop_keeps_is_healed_by_its_next_step() {
    for (part, name) in [
        (Kept::Iterate, "joint_angle"),
        (Kept::Residuals, "defect"),
        (Kept::Scalars, "radius"),
        (Kept::Scalars, "violation"),
    ] {
        let record = kept(part, 1, 4, name, if part == Kept::Scalars { 0 } else { 30 }, 40);
        assert!(matches!(record.class, Class::Tolerated | Class::NoEffect), "{record:?}");
    }
    let record = kept(Kept::Iterate, 0, 1, "force", 20, 62);
    assert_eq!((record.site, record.status), (Site::LoopIterate, Status::Solved), "{record:?}");
    // The iterate was struck, and is not what it was.
    assert_ne!(record.class, Class::NoEffect);
}

/// Guidance goes on, gives up or misses; a flight is compared with the one without the fault.
#[test]
fn a_strike_in_guidance_is_flown() {
    let strike = |name: &str, step, element, bit| {
        let field = field(&GUIDANCE_FIELDS, name);
        inject(Fault::Guidance { course: Course::Approach, step, field, element, bit })
    };
    let record = strike("commanded", 100, 0, 0);
    assert_eq!((record.class, record.site), (Class::NoEffect, Site::Guidance), "{record:?}");
    assert_eq!((record.ending.unwrap().name(), record.extra_cost), ("captured", 0.0));
    // What lies in memory for the whole flight is made good: an integral, a bandwidth of next to nothing.
    for (name, step, bit) in [("integrals", 1000, 61), ("feedback", 600, 62)] {
        let record = strike(name, step, 0, bit);
        assert_eq!((record.class, record.extra_cost), (Class::NoEffect, 0.0), "{record:?}");
    }
    // When the last step was is not: the next one takes another time for gone by.
    let record = strike("times", 1000, 2, 56);
    assert_eq!(
        (record.class, record.ending.unwrap().name()),
        (Class::Tolerated, "captured"),
        "{record:?}"
    );
    assert_ne!(record.extra_cost, 0.0, "{record:?}");
}

/// Where the target is left, and where another plan takes over, guidance keeps more, and makes that good, too: what it
/// goes by is a whole flight's.
#[test]
fn a_strike_on_the_way_out_and_at_a_handover_is_made_good() {
    let of = |course, name: &str, step, element| {
        let field = field(&GUIDANCE_FIELDS, name);
        inject(Fault::Guidance { course, step, field, element, bit: 62 })
    };
    let end = |record: &Record| (record.class, record.ending.unwrap().name());
    // Of the first scenario an axis is lost so late that its flight is longer than any approach.
    let escape = |name, element| of(Course::Escape, name, 2500, element);
    for (name, element) in [("leaving", 0), ("leaving", 4), ("leaving", 7), ("integrals", 3)] {
        let record = escape(name, element);
        assert_eq!(end(&record), (Class::NoEffect, "aborted"), "{record:?}");
    }
    assert_eq!(escape("leaving", 4).part, "escape.leaving");
    for (name, element) in [("jump", 0), ("jump", 4), ("jump", 9), ("offset", 0)] {
        let record = of(Course::Handover, name, 1220, element);
        assert_eq!(end(&record), (Class::NoEffect, "captured"), "{record:?}");
    }
}

/// Multipliers are bounded by the weights. One that is not must not become curvature: the program
/// could not be solved with any radius, and the plan would be given up.
#[test]
fn a_multiplier_beyond_its_bounds_is_not_used() {
    for (kind, node, element) in [("row_multiplier", 25, 0), ("defect_multiplier", 25, 1)] {
        let field = field(&SOLUTION_FIELDS, kind);
        let fault = Fault::Program { solution: true, call: 5, field, node, element, bit: 62 };
        let record = inject(fault);
        assert_eq!((record.site, record.kind.as_str()), (Site::QpSolution, kind));
        assert_eq!((record.class, record.start), (Class::Tolerated, GuessRecord::Learned));
        assert!(record.extra_iterations <= 3, "{record:?}");
    }
}

/// A built-in scenario, for the core.
fn scenario(index: usize) -> Scenario {
    ScenarioSet::built_in().unwrap().scenarios[index].scenario().resized()
}

fn planned() -> (Box<Workspace>, Report) {
    let (mut workspace, mut solver) = (on_heap(Workspace::new), on_heap(EmbeddedSolver::new));
    let report = plan(
        &Mission::default(),
        &scenario(0),
        &Options::from_parts(
            PlanSettings::new(Mode::Optimal, Integrator::Euler),
            InitialGuess::Heuristic,
            Platform::BARE,
        ),
        &mut *solver,
        &mut workspace,
    );
    (workspace, report)
}

/// A plan that is not what it is said to be is seen, whatever is wrong with it.
#[test]
fn the_judge_sees_a_wrong_plan() {
    let (workspace, report) = planned();
    let (mission, scenario) = (Mission::default(), scenario(0));
    let integrator = Integrator::Euler;
    let judge = Judge { mission: &mission, scenario: &scenario, integrator };
    let honest = Claim {
        status: report.status,
        is_verified: true,
        residuals: report.residuals,
        output: report.record.output,
    };
    let plan = Plan { path: workspace.translation(), motion: workspace.reorientation() };
    assert!(!judge.is_wrong(&honest, plan));
    // A bit of the plan flips once it has been verified: the lowest, one that breaks a constraint,
    // one that the verifier does not look at.
    for (node, bit) in [(30, 0), (30, 51), (NODES - 1, 62)] {
        let mut motion = *workspace.reorientation();
        let torque = &mut motion.controls[node].bus_torque.x;
        *torque = f64::from_bits(torque.to_bits() ^ (1 << bit));
        let plan = Plan { motion: &motion, ..plan };
        assert_eq!(judge.is_wrong(&honest, plan), node < NODES - 1, "node {node} bit {bit}");
    }
    let mut motion = *workspace.reorientation();
    motion.controls[NODES - 1].bus_torque.x = f64::NAN;
    assert!(judge.is_wrong(&honest, Plan { motion: &motion, ..plan }));
    // Claims that are not those of the plan.
    let residuals = remora_core::advanced::stages::Residuals { pointing: 1e-9, ..honest.residuals };
    assert!(judge.is_wrong(&Claim { residuals, ..honest }, plan));
    assert!(judge.is_wrong(&Claim { output: honest.output ^ 1, ..honest }, plan));
    // To claim less is no lie.
    let less = Claim { status: Status::IterationLimit, is_verified: false, ..honest };
    assert!(!judge.is_wrong(&less, plan));
}

/// The same path, honestly judged, in a scenario that is another: solved is then a lie.
#[test]
fn the_judge_knows_the_scenario() {
    let (workspace, report) = planned();
    let (mission, scenario) = (Mission::default(), scenario(1));
    let judge = Judge { mission: &mission, scenario: &scenario, integrator: Integrator::Euler };
    let plan = Plan { path: workspace.translation(), motion: workspace.reorientation() };
    let (path, motion) = (plan.path, plan.motion);
    let (integrator, deadline) = (Integrator::Euler, Deadline::never());
    let residuals = verify(&mission, &scenario, integrator, path, motion, &deadline).residuals;
    let claim = Claim {
        status: Status::Solved,
        is_verified: false,
        residuals,
        output: report.record.output,
    };
    assert!(judge.is_wrong(&claim, plan));
    let verified = Claim { status: Status::IterationLimit, is_verified: true, ..claim };
    assert!(judge.is_wrong(&verified, plan));
    let neither = Claim { status: Status::IterationLimit, ..claim };
    assert!(!judge.is_wrong(&neither, plan));
}

#[test]
fn scenarios_that_are_not_solved_without_a_fault_are_refused() {
    let mut injector = injector(1);
    injector.mission.approach.duration_s = 60.0;
    let id = injector.scenarios[0].id.clone();
    let error = injector.replay(0).unwrap_err().to_string();
    assert_eq!(error, format!("--scenarios: scenario {id} is not solved without a fault"));
    injector.scenarios.clear();
    let jobs = NonZeroUsize::MIN;
    let error = injector.run(1, jobs, None, &mut (), &|_| ()).unwrap_err().to_string();
    assert_eq!(error, "--scenarios: there is none");
}

/// What the solver hands back is injected, too: a step that leads nowhere is not taken.
#[test]
fn a_struck_solution_is_not_taken() {
    let field = field(&SOLUTION_FIELDS, "u");
    let fault = Fault::Program { solution: true, call: 5, field, node: 20, element: 0, bit: 62 };
    let record = inject(fault);
    assert_eq!((record.class, record.site), (Class::Detected, Site::QpSolution), "{record:?}");
}
