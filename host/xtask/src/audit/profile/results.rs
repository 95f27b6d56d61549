//! Results of a profile.

use super::machine::Machine;
use super::order::{Case, Configuration, Rounds};
use super::pin::Pinning;
use super::sample::{Sample, WARM_UP_PLANS};
use super::spread::{Spread, median_ratio};
use remora_core::advanced::planner::PhaseTimes;
use serde::{Deserialize, Serialize};

/// Least ratio of the linearisation's time on one core to that on two.
const LINEARISATION_BAR: f64 = 1.6;

/// Least ratio of the throughput of two plans at once to that of one at a time.
const THROUGHPUT_BAR: f64 = 1.8;

/// Value of a phase.
type Phase = fn(&PhaseTimes) -> f64;

/// The phases of a plan, in their order. Inference is a part of the warm start; the phases before
/// the whole plan are all of it but the checksums.
pub const PHASES: [(&str, Phase); 8] = [
    ("stage_1", |times| times.translation_s),
    ("warm_start", |times| times.start_s),
    ("inference", |times| times.inference_s),
    ("linearisation", |times| times.linearise_s),
    ("qp", |times| times.qp_s),
    ("steps", |times| times.step_s),
    ("verification", |times| times.verify_s),
    ("whole_plan", |times| times.total_s),
];

/// A profile; `profile.json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Profile {
    /// Format of the file.
    pub format: String,
    /// The machine and its load.
    pub machine: Machine,
    /// Where the threads ran.
    pub pinning: Pinning,
    /// Number of scenarios.
    pub scenarios: usize,
    /// How often each was planned.
    pub rounds: Rounds,
    /// Scenarios that every configuration planned in every case before; not in the profile.
    pub warm_up_plans: usize,
    /// Why no instructions were counted.
    pub no_counter: Option<String>,
    /// The configurations.
    pub configurations: Vec<ConfigurationProfile>,
    /// Ratios with their thresholds and values.
    pub bars: Vec<Bar>,
    /// How long the profile took [s].
    pub wall_s: f64,
}

/// One configuration in all cases.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ConfigurationProfile {
    /// Its name, such as `euler-optimal-model`.
    pub name: String,
    /// Integrator, start and mode.
    pub configuration: Configuration,
    /// One plan on one core.
    pub one_core: CaseProfile,
    /// One plan on two cores.
    pub two_cores: CaseProfile,
    /// First core's plan of two at once.
    pub two_plans: CaseProfile,
    /// Instructions of each phase on one core, where they are counted.
    pub instructions: Option<Vec<PhaseSpread>>,
    /// Linearisation of a plan on one core over the same on two: median over plans.
    pub linearisation_ratio: f64,
    /// Whole plan on one core over the same on two: median over plans.
    pub plan_ratio: f64,
    /// Twice the time of a plan over that of two at once: median over plans.
    pub throughput_ratio: f64,
    /// 99th percentile of the first core's plan while the second is busy, over the same alone.
    pub interference_p99_ratio: f64,
}

/// One case of a configuration.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CaseProfile {
    /// Number of plans.
    pub plans: usize,
    /// Number of them that were solved.
    pub solved: usize,
    /// Times that the system took the first core from its thread.
    pub involuntary_switches: u64,
    /// Time of each phase, summed over a plan [s].
    pub phase_s: Vec<PhaseSpread>,
    /// Time of a single linearisation of Stage 2 [s].
    pub linearise_call_s: Spread,
    /// Time of a single iteration's subproblem of Stage 2, corrections included [s].
    pub qp_call_s: Spread,
    /// Time of every plan, in the order in which they were made [s].
    pub plan_samples_s: Vec<f64>,
    /// Iterations of Stage 2 of the same plans.
    pub iteration_samples: Vec<u64>,
}

/// One phase over all plans.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PhaseSpread {
    /// Name, one of [`PHASES`].
    pub phase: String,
    /// Its spread.
    #[serde(flatten)]
    pub spread: Spread,
}

/// Threshold of a ratio. Whether it is met depends on the machine and its load.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bar {
    /// Name of the ratio.
    pub name: String,
    /// Name of the configuration.
    pub configuration: String,
    /// Least value.
    pub least: f64,
    /// The value.
    pub value: f64,
    /// Whether it is reached.
    pub is_met: bool,
}

/// All that was measured.
pub(super) struct Run<'a> {
    pub configurations: &'a [Configuration],
    pub scenarios: usize,
    pub rounds: Rounds,
    pub pinning: Pinning,
    pub machine: Machine,
    pub no_counter: Option<String>,
    pub samples: Vec<Sample>,
    pub wall_s: f64,
}

impl Run<'_> {
    /// The samples of a configuration in one case, in order.
    fn of(&self, configuration: usize, case: Case) -> Vec<&Sample> {
        let wanted =
            |sample: &&Sample| sample.job.configuration == configuration && sample.job.case == case;
        self.samples.iter().filter(wanted).collect()
    }
}

impl Profile {
    pub(super) fn of(run: Run<'_>) -> Self {
        let numbers = 0..run.configurations.len();
        let configurations: Vec<ConfigurationProfile> =
            numbers.map(|number| ConfigurationProfile::of(&run, number)).collect();
        Self {
            format: "remora-profile/1".into(),
            bars: configurations.iter().flat_map(ConfigurationProfile::bars).collect(),
            configurations,
            scenarios: run.scenarios,
            rounds: run.rounds,
            warm_up_plans: WARM_UP_PLANS,
            no_counter: run.no_counter,
            machine: run.machine,
            pinning: run.pinning,
            wall_s: run.wall_s,
        }
    }
}

impl ConfigurationProfile {
    fn of(run: &Run<'_>, number: usize) -> Self {
        let configuration = run.configurations[number];
        let cases = [Case::OneCore, Case::TwoCores, Case::TwoPlans];
        let [one, two, both] = cases.map(|case| run.of(number, case));
        let counted = run.of(number, Case::Counted);
        let ratio = |of: Phase| {
            let pairs = paired(&one, &two).map(|(one, two)| (of(&one.times), of(&two.times)));
            median_ratio(pairs)
        };
        let twice = paired(&one, &both).map(|(one, both)| (2.0 * one.wall_s, both.wall_s));
        let p99 =
            |samples: &[&Sample]| Spread::of(samples.iter().map(|sample| sample.times.total_s)).p99;
        let beside: Vec<&Sample> = paired(&one, &both).map(|(one, _)| one).collect();
        Self {
            name: configuration.name(),
            configuration,
            one_core: CaseProfile::of(&one),
            two_cores: CaseProfile::of(&two),
            two_plans: CaseProfile::of(&both),
            instructions: (!counted.is_empty()).then(|| phases(&counted)),
            linearisation_ratio: ratio(|times| times.linearise_s),
            plan_ratio: ratio(|times| times.total_s),
            throughput_ratio: median_ratio(twice),
            interference_p99_ratio: p99(&both) / p99(&beside).max(f64::MIN_POSITIVE),
        }
    }

    fn bars(&self) -> [Bar; 2] {
        let bar = |name: &str, least, value| Bar {
            name: name.into(),
            configuration: self.name.clone(),
            least,
            value,
            is_met: value >= least,
        };
        [
            bar("two-core linearisation", LINEARISATION_BAR, self.linearisation_ratio),
            bar("throughput of two plans at once", THROUGHPUT_BAR, self.throughput_ratio),
        ]
    }
}

/// Plans of the same scenario and round, which were made next to each other. Both are in order.
fn paired<'a>(
    a: &'a [&'a Sample],
    b: &'a [&'a Sample],
) -> impl Iterator<Item = (&'a Sample, &'a Sample)> {
    let key = |sample: &Sample| (sample.job.round, sample.job.scenario);
    b.iter().filter_map(move |b| {
        let at = a.binary_search_by_key(&key(b), |a| key(a)).ok()?;
        Some((a[at], *b))
    })
}

/// The spread of every phase.
fn phases(samples: &[&Sample]) -> Vec<PhaseSpread> {
    let spread = |(phase, value): (&'static str, Phase)| PhaseSpread {
        phase: phase.into(),
        spread: Spread::of(samples.iter().map(|sample| value(&sample.times))),
    };
    PHASES.into_iter().map(spread).collect()
}

impl CaseProfile {
    fn of(samples: &[&Sample]) -> Self {
        let calls = |of: fn(&Sample) -> &Vec<f64>| {
            Spread::of(samples.iter().flat_map(|sample| of(sample).iter().copied()))
        };
        Self {
            plans: samples.len(),
            solved: samples.iter().filter(|sample| sample.is_solved).count(),
            involuntary_switches: samples.iter().map(|sample| sample.switches).sum(),
            phase_s: phases(samples),
            linearise_call_s: calls(|sample| &sample.linearise_s),
            qp_call_s: calls(|sample| &sample.qp_s),
            plan_samples_s: samples.iter().map(|sample| rounded(sample.times.total_s)).collect(),
            iteration_samples: samples.iter().map(|sample| sample.iterations).collect(),
        }
    }

    /// The spread of a phase by its name.
    pub fn phase(&self, name: &str) -> Spread {
        let found = self.phase_s.iter().find(|phase| phase.phase == name);
        found.map(|phase| phase.spread).unwrap_or_default()
    }
}

/// To a tenth of a microsecond: what is written of a sample.
fn rounded(seconds: f64) -> f64 {
    (seconds * 1e7).round() / 1e7
}

#[cfg(test)]
mod tests {
    use super::super::order::{Job, order};
    use super::*;

    fn sample(job: Job) -> Sample {
        let slow = match job.case {
            Case::OneCore => 8.0,
            Case::TwoCores => 4.0,
            Case::TwoPlans => 10.0,
            _ => 1e6,
        };
        let times = PhaseTimes { linearise_s: slow, total_s: 2.0 * slow, ..Default::default() };
        Sample {
            job,
            wall_s: 2.0 * slow + job.scenario as f64,
            times,
            linearise_s: vec![slow / 2.0; 2],
            qp_s: vec![1.0],
            iterations: 2,
            is_solved: job.scenario != 1,
            switches: 3,
        }
    }

    fn profile() -> Profile {
        let configurations = &Configuration::all()[..2];
        let rounds = Rounds { euler: 2, euler_second_core: 1, rk4: 1 };
        let jobs = order(configurations, 3, rounds, true);
        Profile::of(Run {
            configurations,
            scenarios: 3,
            rounds,
            pinning: Pinning { cores: Some([0, 1]), refused: None },
            machine: Machine::default(),
            no_counter: None,
            samples: jobs.into_iter().map(sample).collect(),
            wall_s: 1.0,
        })
    }

    #[test]
    fn ratios_and_bars_by_hand() {
        let profile = profile();
        let first = &profile.configurations[0];
        assert_eq!((first.linearisation_ratio, first.plan_ratio), (2.0, 2.0));
        // Median scenario: 2 (16 + 1) / (20 + 1).
        assert!((first.throughput_ratio - 34.0 / 21.0).abs() < 1e-12);
        assert_eq!(first.interference_p99_ratio, 1.25);
        assert_eq!((first.one_core.plans, first.one_core.solved), (6, 4));
        assert_eq!((first.two_cores.plans, first.two_plans.plans), (3, 3));
        assert_eq!(first.one_core.involuntary_switches, 18);
        assert_eq!(first.one_core.linearise_call_s.n, 12);
        assert_eq!(first.one_core.phase("whole_plan").median, 16.0);
        assert_eq!(first.instructions.as_ref().unwrap()[3].spread.median, 1e6);
        let met: Vec<bool> = profile.bars.iter().map(|bar| bar.is_met).collect();
        assert_eq!(met, [true, false, true, false]);
    }

    #[test]
    fn the_file_has_units_in_its_names() {
        let json = serde_json::to_value(profile()).unwrap();
        assert_eq!(json["format"], "remora-profile/1");
        let case = &json["configurations"][0]["one_core"];
        assert_eq!(case["phase_s"][7]["phase"], "whole_plan");
        assert_eq!(case["phase_s"][7]["median"], 16.0);
        assert_eq!(case["phase_s"][7]["p999"], serde_json::Value::Null);
        assert_eq!(case["plan_samples_s"].as_array().unwrap().len(), 6);
        assert_eq!(json["configurations"][1]["configuration"]["warm_start"], "model");
        assert_eq!(rounded(0.01234567891), 0.0123457);
    }
}
