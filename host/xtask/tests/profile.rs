//! A profile measures plans that are the same in every case.

use remora_host::formats::{Mission, ScenarioSet};
use remora_host::progress::Progress;
use xtask::audit::profile::{
    Case, Configuration, ConfigurationProfile, Job, PHASES, Profiler, Rounds,
};

/// Counts what it is told.
#[derive(Default)]
struct Count {
    total: usize,
    done: usize,
    has_ended: bool,
}

impl Progress for Count {
    fn begin(&mut self, total: usize, _: usize) {
        self.total = total;
    }

    fn done(&mut self, is_solved: bool) {
        self.done += usize::from(is_solved);
    }

    fn end(&mut self) {
        self.has_ended = true;
    }
}

/// A profile that was cut off goes on with the measurement at which it was, and keeps those before it.
#[test]
fn what_was_measured_is_not_measured_again() {
    let profiler = Profiler {
        scenarios: ScenarioSet::built_in().unwrap().scenarios[..1].to_vec(),
        mission: Mission::default(),
        configurations: Configuration::all()[..2].to_vec(),
        rounds: Rounds::of(1),
        cores: None,
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.jsonl");
    let run = || {
        let mut count = Count::default();
        let profile = profiler.run(Some(&file), &mut count);
        profile.map(|profile| (profile, count))
    };
    let (whole, count) = run().unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    assert_eq!(text.lines().count(), 1 + count.total);
    let kept: Vec<&str> = text.split_inclusive('\n').take(1 + 3).collect();
    std::fs::write(&file, format!("{}{{\"job", kept.concat())).unwrap();
    let (again, second) = run().unwrap();
    assert_eq!((second.total, second.done), (count.total, count.total - 3));
    assert!(std::fs::read_to_string(&file).unwrap().starts_with(&kept.concat()));
    for (whole, again) in whole.configurations.iter().zip(&again.configurations) {
        assert_eq!(whole.one_core.iteration_samples, again.one_core.iteration_samples);
    }
    let first = &whole.configurations[0].one_core.plan_samples_s;
    assert_eq!(first, &again.configurations[0].one_core.plan_samples_s, "read, not measured");
    // Measurements in another order, or of another profile, are not taken.
    std::fs::write(&file, format!("{}{}{}", kept[0], kept[2], kept[1])).unwrap();
    let error = run().map(drop).unwrap_err().to_string();
    assert!(error.ends_with("line 2: is not the measurement that comes here"), "{error}");
    let other = Profiler { rounds: Rounds::of(2), ..profiler.clone() };
    let error = other.run(Some(&file), &mut Count::default()).map(drop).unwrap_err().to_string();
    assert!(error.contains("rounds: this profile was begun with other rounds"), "{error}");
}

#[test]
fn every_case_makes_the_same_plans() {
    let profiler = Profiler {
        scenarios: ScenarioSet::built_in().unwrap().scenarios[..2].to_vec(),
        mission: Mission::default(),
        configurations: Configuration::all()[..2].to_vec(),
        rounds: Rounds { euler: 2, euler_second_core: 2, rk4: 1 },
        cores: None,
    };
    let mut count = Count::default();
    let profile = profiler.run(None, &mut count).unwrap();
    let counted = if profile.no_counter.is_some() { 0 } else { 4 };
    assert_eq!((count.total, count.has_ended), (24 + counted, true));
    assert_eq!(count.done, count.total);
    assert!(profile.pinning.cores.is_some() != profile.pinning.refused.is_some());

    for configuration in &profile.configurations {
        let one = &configuration.one_core;
        assert_eq!((one.plans, one.solved), (4, 4));
        let iterations = &one.iteration_samples;
        assert_eq!(iterations[..2], iterations[2..], "rounds repeat the scenarios");
        for case in [&configuration.two_cores, &configuration.two_plans] {
            assert_eq!(&case.iteration_samples, iterations);
            assert_eq!(case.linearise_call_s.n, one.linearise_call_s.n);
        }
        let subproblems: u64 = iterations.iter().sum();
        assert_eq!(one.qp_call_s.n as u64, subproblems);
        assert!(one.linearise_call_s.n as u64 <= subproblems);
        for phase in &one.phase_s {
            let (spread, total) = (phase.spread, one.phase("whole_plan"));
            assert!(spread.min <= spread.median && spread.p99 <= spread.max);
            assert!(spread.max <= total.max, "{}", phase.phase);
        }
        assert_eq!(configuration.instructions.is_some(), profile.no_counter.is_none());
    }

    let overview = profile.overview().markdown();
    for configuration in &profile.configurations {
        assert!(overview.contains(&format!("| {} | 4 | ", configuration.name)), "{overview}");
    }
    let (name, phases) = profile.slowest().unwrap();
    let median = |c: &ConfigurationProfile| c.one_core.phase("whole_plan").median;
    let slowest = profile.configurations.iter().find(|c| c.name == name).unwrap();
    assert!(profile.configurations.iter().all(|c| median(c) <= median(slowest)));
    assert!(phases.markdown().contains("| linearisation | "));
    let heading = format!("Phases of a plan on one core, {name} [ms]");
    let tables = profile.phase_tables();
    let (_, all) = tables.iter().find(|(of, _)| *of == heading).unwrap();
    assert!(all.markdown().contains("| linearisation | 4 | "));

    for (_, table) in profile.tables().into_iter().chain(profile.phase_tables()) {
        assert!(table.to_string().lines().all(|line| line.chars().count() <= 100), "{table}");
        assert!(table.markdown().starts_with("| "));
    }
    assert_eq!(PHASES.len(), 8);
}

#[test]
fn jobs_are_told_apart() {
    let job = Job { round: 0, scenario: 1, configuration: 2, case: Case::OneCore };
    assert_ne!(job, Job { case: Case::TwoPlans, ..job });
}
