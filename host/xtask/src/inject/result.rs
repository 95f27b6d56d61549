//! Findings of an injection.

use super::case::Case;
use super::class::Class;
use super::ended::Ran;
use super::site::Site;
use remora_flight::flight::Ending;
use remora_host::campaign::Statistics;
use remora_host::fingerprint::fingerprint;
use remora_host::formats::{GuessRecord, ModelRecord, Status};
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write;

/// The `format` of the file.
pub const FORMAT: &str = "remora-injection/2";

/// One case and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Its number: with the seed, the integrator and the scenarios all that is needed to run it
    /// again.
    pub case: u64,
    /// Where the fault was injected.
    pub site: Site,
    /// Id of the scenario.
    pub scenario: String,
    /// Name of the data that was hit.
    pub part: String,
    /// Kind of this data.
    pub kind: String,
    /// Which use of the memory, of the plan's programs or iterations, or of guidance's steps.
    pub moment: u32,
    /// The node.
    pub node: usize,
    /// Which number.
    pub element: usize,
    /// Which bit of it.
    pub bit: u32,
    /// Class of its outcome.
    pub class: Class,
    /// How the plan ended.
    pub status: Status,
    /// Whether the plan can be flown.
    pub is_verified: bool,
    /// Initial guess of Stage 2.
    pub start: GuessRecord,
    /// Iterations of Stage 1.
    pub stage1_iterations: usize,
    /// Iterations of Stage 2.
    pub stage2_iterations: usize,
    /// How many more iterations than without the fault, both stages together.
    pub extra_iterations: i64,
    /// Relative cost of the plan above that without the fault, both stages together.
    #[serde(deserialize_with = "number_or_nan")]
    pub extra_cost: f64,
    /// Checksum of the plan, or of what came of its flight, 16 hexadecimal digits.
    pub output: String,
    /// How the plan's flight ended, where guidance was hit.
    pub ending: Option<Ending>,
}

/// JSON has no NaN: it is written as null.
fn number_or_nan<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

impl Record {
    pub(super) fn new(case: &Case, scenario: &str, class: Class, ran: &Ran) -> Self {
        let Ran { ended, baseline, .. } = ran;
        let place = case.fault.place();
        let sum = |counts: [usize; 2]| counts.iter().sum::<usize>() as i64;
        let cost = |costs: [f64; 2]| costs.iter().sum::<f64>();
        Self {
            case: case.number,
            site: case.fault.site(),
            scenario: scenario.into(),
            part: place.part,
            kind: place.kind,
            moment: place.moment,
            node: place.node,
            element: place.element,
            bit: place.bit,
            class,
            status: ended.status,
            is_verified: ended.is_verified,
            start: ended.start,
            stage1_iterations: ended.iterations[0],
            stage2_iterations: ended.iterations[1],
            extra_iterations: sum(ended.iterations) - sum(baseline.iterations),
            extra_cost: cost(ended.costs) / cost(baseline.costs) - 1.0,
            output: format!("{:016x}", ended.output),
            ending: ran.ending,
        }
    }
}

/// Numbers of cases by class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// [`Class::NoEffect`].
    pub no_effect: u64,
    /// [`Class::Tolerated`].
    pub tolerated: u64,
    /// [`Class::FellBack`].
    pub fell_back: u64,
    /// [`Class::Detected`].
    pub detected: u64,
    /// [`Class::FailedCleanly`].
    pub failed_cleanly: u64,
    /// [`Class::Wrong`].
    pub wrong: u64,
    /// [`Class::Panicked`].
    pub panicked: u64,
    /// [`Class::Hung`].
    pub hung: u64,
}

impl Counts {
    fn place(&mut self, class: Class) -> &mut u64 {
        match class {
            Class::NoEffect => &mut self.no_effect,
            Class::Tolerated => &mut self.tolerated,
            Class::FellBack => &mut self.fell_back,
            Class::Detected => &mut self.detected,
            Class::FailedCleanly => &mut self.failed_cleanly,
            Class::Wrong => &mut self.wrong,
            Class::Panicked => &mut self.panicked,
            Class::Hung => &mut self.hung,
        }
    }

    fn over<'a>(records: impl IntoIterator<Item = &'a Record>) -> Self {
        let mut counts = Self::default();
        records.into_iter().for_each(|record| *counts.place(record.class) += 1);
        counts
    }

    /// Cases of a class.
    pub fn of(mut self, class: Class) -> u64 {
        *self.place(class)
    }

    /// All cases.
    pub fn all(self) -> u64 {
        Class::ALL.iter().map(|class| self.of(*class)).sum()
    }

    /// Cases of classes that must have none.
    pub fn forbidden(self) -> u64 {
        Class::ALL.iter().filter(|class| class.is_forbidden()).map(|class| self.of(*class)).sum()
    }
}

/// Cost of a fault where the plan is solved all the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Extra {
    /// Iterations more than without the fault, both stages together.
    pub iterations: Statistics,
    /// Cost above that without the fault, relative, both stages together.
    pub cost: Statistics,
}

impl Extra {
    fn over<'a>(records: impl IntoIterator<Item = &'a Record>) -> Self {
        let records: Vec<&Record> = records.into_iter().collect();
        Self {
            iterations: Statistics::of(records.iter().map(|r| r.extra_iterations as f64)),
            cost: Statistics::of(records.iter().map(|r| r.extra_cost)),
        }
    }
}

/// Cases of one site, or of all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// The site, or `all`.
    pub site: String,
    /// The kind of data; none for all of the site.
    pub kind: Option<String>,
    /// How many there were.
    pub cases: u64,
    /// Their classes.
    pub classes: Counts,
    /// Verified plans among those that failed cleanly: they can be flown, though they may
    /// cost more than they would have to.
    pub failed_but_verified: u64,
    /// Cost of the tolerated ones.
    pub tolerated: Extra,
    /// Cost of those that fell back.
    pub fell_back: Extra,
    /// Cost of those that were detected.
    pub detected: Extra,
}

impl Share {
    fn of(site: &str, kind: Option<&str>, records: &[&Record]) -> Self {
        let records = || records.iter().copied();
        let classes = Counts::over(records());
        let of = |class: Class| records().filter(move |record| record.class == class);
        let failed = of(Class::FailedCleanly).filter(|record| record.is_verified);
        Self {
            site: site.into(),
            kind: kind.map(String::from),
            cases: classes.all(),
            classes,
            failed_but_verified: failed.count() as u64,
            tolerated: Extra::over(of(Class::Tolerated)),
            fell_back: Extra::over(of(Class::FellBack)),
            detected: Extra::over(of(Class::Detected)),
        }
    }
}

/// Findings of an injection. They hold no times: equal cases have equal results on every
/// machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Injection {
    /// [`FORMAT`].
    pub format: String,
    /// Seed of the cases.
    pub seed: u64,
    /// Discretisation of Stage 2.
    pub integrator: String,
    /// How many scenarios there were to draw from.
    pub scenarios: usize,
    /// The model.
    pub model: ModelRecord,
    /// All cases together.
    pub total: Share,
    /// Cases by site.
    pub sites: Vec<Share>,
    /// Cases by site and kind of data.
    pub kinds: Vec<Share>,
    /// After how many cases a plan without a fault was held against the one from before.
    pub leak_checks: u64,
    /// The cases that must not be.
    pub forbidden: Vec<Record>,
    /// Fingerprint of what became of the first [`Injection::FIRST`] cases, number by number: fewer
    /// cases of the same seed have the same.
    pub first: String,
    /// All cases by number; in the table of cases alone.
    #[serde(skip)]
    pub records: Vec<Record>,
}

impl Injection {
    /// Cases that are held against earlier results.
    pub const FIRST: usize = 1000;

    pub(super) fn new(
        (seed, integrator, scenarios): (u64, String, usize),
        model: ModelRecord,
        records: Vec<Record>,
        leak_checks: u64,
    ) -> Self {
        let mut sites: BTreeMap<Site, Vec<&Record>> = BTreeMap::new();
        let mut kinds: BTreeMap<(Site, &str), Vec<&Record>> = BTreeMap::new();
        for record in &records {
            sites.entry(record.site).or_default().push(record);
            kinds.entry((record.site, &record.kind)).or_default().push(record);
        }
        let all: Vec<&Record> = records.iter().collect();
        let bad = |record: &&Record| record.class.is_forbidden();
        let first: Vec<&Record> = records.iter().take(Self::FIRST).collect();
        Self {
            first: fingerprint(&first),
            format: FORMAT.into(),
            seed,
            integrator,
            scenarios,
            model,
            total: Share::of("all", None, &all),
            sites: sites.iter().map(|(site, r)| Share::of(site.name(), None, r)).collect(),
            kinds: kinds
                .iter()
                .map(|((site, kind), r)| Share::of(site.name(), Some(kind), r))
                .collect(),
            leak_checks,
            forbidden: records.iter().filter(bad).cloned().collect(),
            records,
        }
    }

    /// Whether nothing was wrong, hung or panicked.
    pub fn is_sound(&self) -> bool {
        self.total.classes.forbidden() == 0
    }

    /// The cases as CSV, with a header line.
    pub fn csv(&self) -> String {
        let mut out = String::from(
            "case,site,scenario,part,moment,node,element,bit,class,status,is_verified,start,\
             stage1_iterations,stage2_iterations,extra_iterations,extra_cost,output,ending\n",
        );
        for r in &self.records {
            let (site, class) = (r.site.name(), r.class.name());
            // Writing into text cannot fail. No cell needs quotes.
            let _ = write!(out, "{},{site},{},{},{},", r.case, r.scenario, r.part, r.moment);
            let _ = write!(out, "{},{},{},{class},{},", r.node, r.element, r.bit, r.status);
            let _ = write!(out, "{},{},", r.is_verified, r.start.name());
            let _ = write!(out, "{},{},", r.stage1_iterations, r.stage2_iterations);
            let ending = r.ending.map_or("", Ending::name);
            let _ = write!(out, "{},{:?},", r.extra_iterations, r.extra_cost);
            let _ = writeln!(out, "{},{ending}", r.output);
        }
        out
    }
}
