//! Whether budgets are kept and pages are what the code of today would make.

use super::budgets::{Budgets, Measured};
use super::emulation::{Emulation, FORMAT, PlanRecord, ReportFile, Run};
use super::firmware::{self, Plans};
use super::loops::Loops;
use super::memory::{ImageMemory, Memory};
use super::pages::Book;
use super::requirements::{self, Requirement};
use super::run::{Watcher, envelope, inject, observed_scenarios};
use super::section::{Numbers, Section};
use super::summary;
use crate::inject::Injection;
use image_audit::{Kind, Share};
use remora_core::advanced::model::Mission;
use remora_host::envelope::Map;
use remora_host::error::Error;
use remora_host::formats::json;
use remora_host::method::Integrator;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Bytes by which constants may differ: the linker orders them by names that depend on the folder
/// of the checkout, and aligns each.
const MOST_PADDING: u64 = 64;

/// What a check found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Checked {
    /// What was looked at, a line each.
    pub looked_at: Vec<String>,
    /// What must not be, a line each.
    pub faults: Vec<String>,
}

impl Checked {
    fn fault(&mut self, text: impl Into<String>) {
        self.faults.push(text.into());
    }

    fn compare<T: PartialEq>(&mut self, what: &str, now: &T, page: &T) {
        self.looked_at.push(what.into());
        if now != page {
            self.fault(format!("{what}: not what the pages say; run `remora audit` again"));
        }
    }
}

/// What a check looks at.
struct Check<'a> {
    root: &'a Path,
    /// Where the numbers are from.
    file: PathBuf,
    numbers: Numbers,
    jobs: NonZeroUsize,
    alarm: fn(u64, Integrator, u64),
    checked: Checked,
}

/// Holds the checkout in `root` against its budgets and the pages in `out`.
///
/// Images and their plans are those that `ci/firmware.sh` left last; where it left none it is run
/// for one scenario.
///
/// # Errors
/// Files that cannot be read or understood; images that cannot be built.
pub fn check(
    root: &Path,
    out: &Path,
    jobs: NonZeroUsize,
    alarm: fn(u64, Integrator, u64),
    watcher: &mut dyn Watcher,
) -> Result<Checked, Error> {
    let file = out.join("audit.json");
    let numbers = Numbers::read(&file)?
        .ok_or_else(|| Error::input(&file, "", "no such file: run `remora audit` first"))?;
    let budgets = Budgets::read(root)?;
    let rows = requirements::read(root)?;
    let mut check = Check { root, file, numbers, jobs, alarm, checked: Checked::default() };
    check.pages(out, &budgets, &rows)?;
    let measured = check.images(watcher)?;
    check.checked.faults.extend(budgets.faults(&measured));
    check.checked.looked_at.push(format!("{} numbers against budgets", measured.len()));
    check.loops(watcher)?;
    check.injection(watcher)?;
    check.envelope(watcher)?;
    check.checked.faults.extend(requirements::faults(root, &rows)?);
    check.checked.looked_at.push(format!("{} requirements", rows.len()));
    Ok(check.checked)
}

impl Check<'_> {
    /// Pages, against the numbers that they are made of, with today's constants, budgets and
    /// requirements.
    fn pages(&mut self, out: &Path, budgets: &Budgets, rows: &[Requirement]) -> Result<(), Error> {
        let book = Book::new(&self.numbers, budgets, rows).map_err(|e| e.at(&self.file))?;
        for page in book.pages {
            let file = out.join(format!("{}.md", page.name));
            let there = std::fs::read_to_string(&file).unwrap_or_default();
            self.checked.compare(&format!("page {}", page.name), &page.markdown(), &there);
        }
        Ok(())
    }

    /// Images and their plans; what there may be budgets for.
    fn images(&mut self, watcher: &mut dyn Watcher) -> Result<Measured, Error> {
        let folder = firmware::folder(self.root);
        let report = folder.join("report.json");
        if !report.exists() {
            let log = folder.join("audit.log");
            firmware::run(self.root, Plans::One, &log, &mut |line| watcher.line(line))?;
        }
        let text = json::read_text(&report)?;
        let report_file: ReportFile =
            json::parse(&text, FORMAT).map_err(|error| error.at(&report))?;
        let emulation = Emulation::new(report_file).map_err(|error| error.at(&report))?;
        let mut measured = summary::of_emulation(&emulation);
        let known = self.numbers.emulation().map_err(|error| error.at(&self.file))?;
        let memory: Option<Memory> =
            self.numbers.findings(Section::Memory).map_err(|error| error.at(&self.file))?;
        for target in &emulation.targets {
            let then = known.iter().flat_map(|known| &known.targets);
            let Some(then) = then.into_iter().find(|then| then.target == target.target) else {
                continue;
            };
            let image = ImageMemory::read(&folder, &target.target)?;
            measured.extend(image.measured());
            if then.toolchain != target.toolchain {
                let (now, then) = (&target.toolchain, &then.toolchain);
                let name = &target.target;
                let line = format!("{name}: {now}, the pages have {then}: budgets alone");
                self.checked.looked_at.push(line);
                continue;
            }
            let name = &target.target;
            let then_images = memory.iter().flat_map(|memory| &memory.images);
            if let Some(then_image) = then_images.into_iter().find(|image| image.target == *name) {
                self.image(&image, then_image);
            }
            for run in &target.runs {
                let then_run = then.run(run.integrator, run.start);
                self.plans(name, run, then_run);
            }
        }
        Ok(measured)
    }

    /// An image of today and the pages'.
    fn image(&mut self, now: &ImageMemory, then: &ImageMemory) {
        let name = &now.target;
        let code = |image: &ImageMemory| -> Vec<Share> {
            let shares = image.sizes.shares.iter().filter(|share| share.kind == Kind::Code);
            shares.cloned().collect()
        };
        self.checked.compare(&format!("{name}: code"), &code(now), &code(then));
        self.checked.compare(&format!("{name}: stack bounds"), &now.stacks, &then.stacks);
        self.checked.compare(&format!("{name}: proofs"), &now.proofs, &then.proofs);
        let moved = now.constants_bytes().abs_diff(then.constants_bytes());
        let what = format!("{name}: constants, but for {MOST_PADDING} bytes of alignment");
        self.checked.compare(&what, &(moved <= MOST_PADDING), &true);
    }

    /// Plans that both have made.
    fn plans(&mut self, target: &str, run: &Run, then: Option<&Run>) {
        for plan in &run.plans {
            let same = |other: &&PlanRecord| other.scenario == plan.scenario;
            let Some(then) = then.and_then(|then| then.plans.iter().find(same)) else { continue };
            let (integrator, start) = (run.integrator.label(), run.start.label());
            let what =
                format!("{target}: instructions of {}, {integrator}, {start}", plan.scenario);
            self.checked.compare(&what, plan, then);
        }
    }

    fn loops(&mut self, watcher: &mut dyn Watcher) -> Result<(), Error> {
        let scenarios = observed_scenarios(self.root)?;
        let mission = Mission::default();
        let now = Loops::observe(&scenarios, &mission, self.jobs, watcher.progress())?;
        let then = self.numbers.findings::<Loops>(Section::Loops).map_err(|e| e.at(&self.file))?;
        self.checked.compare("turns of loops", &Some(now), &then);
        Ok(())
    }

    /// The coarse map, but for its times.
    fn envelope(&mut self, watcher: &mut dyn Watcher) -> Result<(), Error> {
        let then: Option<Map> =
            self.numbers.findings(Section::Envelope).map_err(|error| error.at(&self.file))?;
        let now = envelope(self.root, self.jobs, watcher.progress())?;
        let (now, then) = (Some(now.timeless_cells()), then.map(|then| then.timeless_cells()));
        self.checked.compare("coarse map of where the planner works", &now, &then);
        Ok(())
    }

    /// The first cases of the injection.
    fn injection(&mut self, watcher: &mut dyn Watcher) -> Result<(), Error> {
        let then: Option<Injection> =
            self.numbers.findings(Section::Injection).map_err(|error| error.at(&self.file))?;
        let now = inject(Injection::FIRST as u64, self.jobs, self.alarm, watcher.progress())?;
        let (first, known) = (Some(&now.first), then.as_ref().map(|then| &then.first));
        self.checked.compare("first injections", &first, &known);
        if !now.is_sound() {
            self.checked.fault("first injections: some are wrong, panicked or hung");
        }
        Ok(())
    }
}
