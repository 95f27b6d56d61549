//! Measures one part of the audit after the other.

use super::budgets::Budgets;
use super::emulation::ReportFile;
use super::firmware::{self, Extent, Firmware};
use super::loops::Loops;
use super::memory::Memory;
use super::pages::Book;
use super::record::{self, Record};
use super::requirements;
use super::section::{Finished, Numbers, Section};
use super::summary::{self, Bar};
use crate::audit::profile::{Configuration, Profiler, Rounds};
use crate::inject::{Injector, Site};
use remora_host::choice::Choice;
use remora_host::envelope::{Envelope, Map};
use remora_host::error::Error;
use remora_host::formats::{
    Mission, NamedScenario, ScenarioSet, check_writable, make_directory, write_atomically,
};
use remora_host::method::Integrator;
use remora_host::progress::Progress;
use remora_host::provenance::{Provenance, commit_and_day};
use remora_host::report::page;
use serde::Serialize;
use serde_json::Value;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// An audit to be made: the input of `cargo xtask audit`.
#[derive(Clone, Debug)]
pub struct Audit {
    /// The checkout.
    pub root: PathBuf,
    /// Folder of the page. Parts that are not asked for stay what they are there.
    pub out: PathBuf,
    /// Folder of all numbers, `audit.json`, and of the one document, `audit.html`: artefacts.
    pub numbers: PathBuf,
    /// The parts to measure.
    pub sections: Vec<Section>,
    /// Worker threads where times are not measured.
    pub jobs: NonZeroUsize,
    /// Receiver of an injected case that does not come to its end.
    pub alarm: fn(seed: u64, integrator: Integrator, case: u64),
}

/// Outcome of an audit.
#[derive(Debug, Serialize)]
pub struct Audited {
    /// Bars with what was seen.
    pub bars: Vec<Bar>,
    /// Faults, a line each.
    pub faults: Vec<String>,
    /// The files written.
    pub files: Vec<PathBuf>,
}

/// Observer of an audit.
pub trait Watcher: Progress {
    /// A part begins: its number of so many.
    fn section(&mut self, section: Section, number: usize, of: usize);
    /// A part is there already, from an audit that was interrupted.
    fn resumed(&mut self, section: Section);
    /// Something another program said.
    fn line(&mut self, text: &str);
    /// The watcher as one of plans.
    fn progress(&mut self) -> &mut (dyn Progress + Send);
}

/// Cases of the injection, and their seed.
const CASES: u64 = 10_000;
const SEED: u64 = 1;

/// Where parts are kept until all are there, below the target folder.
const PARTIAL: &str = "audit/partial.json";

/// The corpus of hard scenarios, from the root of the checkout.
const CORPUS: &str = "fixtures/scenarios/audit.scenarios.json";

impl Audit {
    /// Measures the parts and writes all pages.
    ///
    /// # Errors
    /// A root that is no checkout; images that cannot be built or break their own bars; outputs
    /// that cannot be written; budgets or requirements that are not well formed. What has been
    /// measured by then is kept, and the next run of the same program goes on from there.
    pub fn run(&self, watcher: &mut dyn Watcher) -> Result<Audited, Error> {
        // Checks that need no measurement fail first.
        let budgets = Budgets::read(&self.root)?;
        let requirements = requirements::read(&self.root)?;
        make_directory(&self.out)?;
        make_directory(&self.numbers)?;
        let file = self.numbers.join("audit.json");
        let mut numbers = Numbers::read(&file)?.unwrap_or_default();
        self.refuse_to_lose(&numbers)?;
        check_writable(&file)?;

        let provenance = Provenance::gather(&self.root);
        let partial = self.target().join(PARTIAL);
        let mut kept = self.resume(&partial, &provenance)?;
        let wanted = || Section::ALL.iter().copied().filter(|s| self.sections.contains(s));
        for (i, section) in wanted().enumerate() {
            if kept.sections.contains_key(&section) {
                watcher.resumed(section);
                continue;
            }
            watcher.section(section, i + 1, wanted().count());
            let started = Instant::now();
            let findings = self.measure(section, watcher)?;
            let took_s = started.elapsed().as_secs_f64();
            let finished = Finished { provenance: provenance.clone(), took_s, findings };
            kept.sections.insert(section, finished);
            kept.write(&partial)?;
        }
        numbers.sections.append(&mut kept.sections);
        let audited = self.write(&numbers, &budgets, &requirements)?;
        // From here on an audit begins anew.
        let _ = std::fs::remove_file(&partial);
        Ok(audited)
    }

    /// Pages are made of the numbers of all parts: those that are not measured now must be of the
    /// audit whose pages are there.
    fn refuse_to_lose(&self, numbers: &Numbers) -> Result<(), Error> {
        let record = Record::read(&self.out)?.unwrap_or_default();
        let others = Section::ALL.iter().filter(|section| !self.sections.contains(section));
        for section in others {
            let known = numbers.sections.get(section).map(|part| part.provenance.commit.as_str());
            if record.get("parts", section.name(), "commit").is_some_and(|of| known != Some(of)) {
                let (name, folder) = (section.name(), self.numbers.display());
                let reason = format!(
                    "{folder}/audit.json has no numbers of {name} as the pages have them: \
                     measure all parts, or write to another --out"
                );
                return Err(Error::argument("--only", reason));
            }
        }
        Ok(())
    }

    fn target(&self) -> PathBuf {
        let target = firmware::folder(&self.root);
        target.parent().map(Path::to_path_buf).unwrap_or_default()
    }

    /// Rows that an interrupted audit left, if program and tree are the same.
    fn resume(&self, partial: &Path, provenance: &Provenance) -> Result<Numbers, Error> {
        if let Some(parent) = partial.parent() {
            make_directory(parent)?;
        }
        // A row that cannot be read was left by another program.
        let mut left = Numbers::read(partial).ok().flatten().unwrap_or_default();
        left.sections.retain(|section, finished| {
            finished.provenance == *provenance && self.sections.contains(section)
        });
        Ok(left)
    }

    fn measure(&self, section: Section, watcher: &mut dyn Watcher) -> Result<Value, Error> {
        match section {
            Section::Instructions => to_value(section, &self.images(Extent::Corpus, watcher)?),
            Section::Memory => {
                if !self.sections.contains(&Section::Instructions) {
                    self.images(Extent::One, watcher)?;
                }
                to_value(section, &Memory::measure(&firmware::folder(&self.root))?)
            }
            Section::Loops => {
                let scenarios = observed_scenarios(&self.root)?;
                let (mission, progress) = (Mission::default(), watcher.progress());
                to_value(section, &Loops::observe(&scenarios, &mission, self.jobs, progress)?)
            }
            Section::Latency => to_value(section, &profiler()?.run(None, watcher.progress())?),
            Section::Injection => {
                let found = inject(CASES, self.jobs, self.alarm, watcher.progress())?;
                to_value(section, &found)
            }
            Section::Envelope => {
                to_value(section, &envelope(&self.root, self.jobs, watcher.progress())?)
            }
        }
    }

    /// Makes the images and has them plan.
    fn images(&self, extent: Extent, watcher: &mut dyn Watcher) -> Result<ReportFile, Error> {
        let images = Firmware::audited(&self.root, extent);
        let measured = images.run(&mut |line| watcher.line(line))?;
        match &measured.broken[..] {
            [] => Ok(measured.report),
            broken => Err(Error::argument("firmware images", broken.join("; "))),
        }
    }

    /// Makes and writes all pages of the numbers.
    fn write(
        &self,
        numbers: &Numbers,
        budgets: &Budgets,
        requirements: &[requirements::Requirement],
    ) -> Result<Audited, Error> {
        let file = self.numbers.join("audit.json");
        let texts = requirements::texts(&self.root, requirements);
        let book =
            Book::new(numbers, budgets, requirements, texts).map_err(|error| error.at(&file))?;
        let mut record = Record::of(numbers, budgets).map_err(|error| error.at(&file))?;
        let Book { pages, bars, measured } = book;

        let mut files = Vec::new();
        let mut write = |name: String, text: &str| {
            let file = self.out.join(&name);
            // The section of requirements has no checksum: it follows from the requirements alone.
            record.page(&name, requirements::split(text).0);
            files.push(file.clone());
            write_atomically(&file, text.as_bytes())
        };
        write(requirements::RESULTS.into(), &page::document(&pages))?;
        let mut plots = pages.iter().flat_map(|page| page.plots());
        plots.try_for_each(|(name, svg)| write(format!("{name}.svg"), svg))?;
        record.write(&self.out)?;
        files.push(self.out.join(record::FILE));
        let html = self.numbers.join("audit.html");
        let met = bars.iter().filter(|bar| bar.is_met).count();
        let made = format!(
            "{met} of {} thresholds kept; put together at {}",
            bars.len(),
            commit_and_day(&self.root)
        );
        write_atomically(&html, page::html("Remora: audit", &made, &pages).as_bytes())?;
        numbers.write(&file)?;
        files.extend([html, file]);

        let mut faults = budgets.faults(&measured);
        faults.extend(summary::faults(&bars));
        faults.extend(requirements::faults(&self.root, requirements)?);
        Ok(Audited { bars, faults, files })
    }
}

/// The profile as `cargo xtask profile` makes it.
fn profiler() -> Result<Profiler, Error> {
    Ok(Profiler {
        scenarios: ScenarioSet::built_in()?.scenarios,
        mission: Mission::default(),
        configurations: Configuration::all(),
        rounds: Rounds::DEFAULT,
        cores: None,
    })
}

/// The public scenarios and those of the corpus that are not among them.
pub(super) fn observed_scenarios(root: &Path) -> Result<Vec<NamedScenario>, Error> {
    let mut scenarios = ScenarioSet::built_in()?.scenarios;
    let hard = ScenarioSet::read(&root.join(CORPUS))?.scenarios;
    let known: Vec<String> = scenarios.iter().map(|scenario| scenario.id.clone()).collect();
    scenarios.extend(hard.into_iter().filter(|scenario| !known.contains(&scenario.id)));
    Ok(scenarios)
}

/// The first `count` cases of the audit's injection.
pub(super) fn inject(
    count: u64,
    jobs: NonZeroUsize,
    alarm: fn(u64, Integrator, u64),
    progress: &mut dyn Progress,
) -> Result<crate::inject::Injection, Error> {
    let injector = Injector {
        seed: SEED,
        sites: Site::ALL.to_vec(),
        scenarios: ScenarioSet::built_in()?.scenarios,
        mission: Mission::default(),
        integrator: Integrator::Euler,
    };
    injector.run(count, jobs, None, progress, &|case| alarm(SEED, Integrator::Euler, case))
}

/// The coarse map.
pub(super) fn envelope(
    root: &Path,
    jobs: NonZeroUsize,
    progress: &mut dyn Progress,
) -> Result<Map, Error> {
    Envelope::coarse(jobs)?.map(root, progress)
}

fn to_value(section: Section, findings: &impl Serialize) -> Result<Value, Error> {
    serde_json::to_value(findings)
        .map_err(|error| Error::argument("--only", format!("{}: {error}", section.name())))
}
