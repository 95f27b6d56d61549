//! The page of the audit, section by section, from its numbers.

use super::budgets::{Budgets, Measured};
use super::emulation::Emulation;
use super::loops::Loops;
use super::memory::Memory;
use super::memory_page;
use super::requirements::{self, Requirement, Texts};
use super::section::{Numbers, Section};
use super::summary::{self, Bar};
use crate::audit::profile::profile_preamble;
use crate::audit::profile::{ConfigurationProfile, Profile};
use crate::inject::Injection;
use remora_host::envelope::Map;
use remora_host::error::FieldError;
use remora_host::method::Integrator;
use remora_host::report::plot::{Cloud, Distributions, Points};
use remora_host::report::{Page, Table};

/// The sections of all parts that have been measured, in the order in which they are read.
///
/// # Errors
/// Findings of another form.
fn all(numbers: &Numbers) -> Result<Vec<Page>, FieldError> {
    let emulation = numbers.emulation()?;
    let mut pages = Vec::new();
    if let Some(memory) = numbers.findings::<Memory>(Section::Memory)? {
        pages.push(memory_page::page(&memory, emulation.as_ref()));
    }
    if let Some(emulation) = &emulation {
        pages.push(instructions_page(emulation));
    }
    if let Some(loops) = numbers.findings::<Loops>(Section::Loops)? {
        pages.push(loops.page());
    }
    if let Some(profile) = numbers.findings::<Profile>(Section::Latency)? {
        pages.push(latency_page(&profile));
    }
    if let Some(injection) = numbers.findings::<Injection>(Section::Injection)? {
        pages.push(injection_page(&injection));
    }
    if let Some(map) = numbers.findings::<Map>(Section::Envelope)? {
        pages.push(map.overview());
    }
    Ok(pages)
}

/// Tables of all parts, and what measured them: the record's rows beside those that are compared.
///
/// # Errors
/// Findings of another form.
pub fn tables(numbers: &Numbers) -> Result<Vec<(Section, String, Table)>, FieldError> {
    let mut all = Vec::new();
    let mut add = |section: Section, tables: Vec<(String, Table)>| {
        all.extend(tables.into_iter().map(|(heading, table)| (section, heading, table)));
    };
    if let Some(memory) = numbers.findings::<Memory>(Section::Memory)? {
        add(Section::Memory, memory_page::tables(&memory));
    }
    if let Some(emulation) = numbers.emulation()? {
        add(Section::Instructions, emulation.tables());
    }
    if let Some(profile) = numbers.findings::<Profile>(Section::Latency)? {
        add(Section::Latency, profile.tables());
        add(Section::Latency, profile.phase_tables());
    }
    if let Some(injection) = numbers.findings::<Injection>(Section::Injection)? {
        add(Section::Injection, injection.tables());
    }
    for (section, finished) in &numbers.sections {
        add(*section, vec![("Measured by".into(), finished.provenance.table())]);
    }
    Ok(all)
}

/// The whole audit: its page, and the thresholds and numbers on it.
pub struct Book {
    /// The beginning of the page and its sections; the requirements come last.
    pub pages: Vec<Page>,
    /// Bars with what was seen.
    pub bars: Vec<Bar>,
    /// Numbers that there may be budgets for.
    pub measured: Measured,
}

impl Book {
    /// Makes it of the numbers; `texts` are pages that requirements refer to.
    ///
    /// # Errors
    /// Findings of another form.
    pub fn new(
        numbers: &Numbers,
        budgets: &Budgets,
        rows: &[Requirement],
        texts: Texts,
    ) -> Result<Self, FieldError> {
        let (bars, measured) = (summary::bars(numbers)?, summary::measured(numbers)?);
        let mut pages = Vec::from(summary::pages(numbers, &bars, budgets, &measured));
        pages.extend(all(numbers)?);
        let texts = texts.with_pages(&pages);
        pages.push(requirements::page(rows, &texts));
        Ok(Self { pages, bars, measured })
    }
}

fn instructions_page(emulation: &Emulation) -> Page {
    let mut page = Page::new("instructions", "Instructions");
    page.text(
        "[Emulation](../guides/bare-metal.md) counts exactly and repeatably, over typical scenarios and the \
         hardest of a large sample (`fixtures/README.md`). Each number is the **observed maximum, emulated**: \
         other scenarios may need more, and an instruction is not a cycle.",
    );
    page.heading("Whole plans [10^6], with the scenario").table(emulation.plan_maxima());
    page.heading("Phases [10^6]").text("Over all integrators and initial guesses.");
    page.table(emulation.phase_maxima());
    page.heading("Slices and guidance").text("A slice runs between two pauses of planning.");
    page.table(emulation.cycle_maxima());
    page
}

fn latency_page(profile: &Profile) -> Page {
    let mut page = Page::new("latency", "Latency");
    page.text(
        "Times of pinned threads on the host, after a warm-up. [Verification](verification.md#latency) \
         defines the words.",
    );
    // The rest tells of the timer, definitions and the time it took: `audit.json` has them.
    profile_preamble(profile).lines().take(3).for_each(|line| {
        page.text(line);
    });
    for (integrator, label) in [(Integrator::Euler, "Euler"), (Integrator::RK4, "RK4")] {
        let of_integrator = |c: &&ConfigurationProfile| c.configuration.integrator == integrator;
        let chosen: Vec<_> = profile.configurations.iter().filter(of_integrator).collect();
        let title = format!("Time of a whole plan on one core, {label}");
        if let Ok(svg) = distributions(&title, &chosen).svg() {
            page.plot(&format!("latency-{integrator}"), &format!("Times, {label}"), svg);
        }
        let title = format!("Iterations of Stage 2 against the time of the plan, {label}");
        if let Ok(svg) = iterations(&title, &chosen).svg() {
            page.plot(&format!("iterations-{integrator}"), &format!("Iterations, {label}"), svg);
        }
    }
    page.heading("Whole plans [ms]").text(
        "On one core. A second one speeds up *linearisation* and *throughput*; *p99 beside* is the p99 while \
         it plans too.",
    );
    page.table(profile.overview());
    if let Some((name, table)) = profile.slowest() {
        page.heading(format!("Phases, {name} [ms]")).table(table);
    }
    page
}

/// Times of plans on one core.
fn distributions(title: &str, configurations: &[&ConfigurationProfile]) -> Distributions {
    let series = configurations
        .iter()
        .map(|c| (c.name.clone(), c.one_core.plan_samples_s.iter().map(|s| s * 1e3).collect()));
    Distributions { title: title.into(), x_label: "ms".into(), series: series.collect() }
}

/// Times of plans over the iterations of Stage 2, of the first rounds: a plan's iterations are the same
/// in all.
fn iterations(title: &str, configurations: &[&ConfigurationProfile]) -> Points {
    const SHOWN: usize = 240;
    let points = |c: &ConfigurationProfile| {
        let case = &c.one_core;
        let pairs = case.iteration_samples.iter().zip(&case.plan_samples_s).take(SHOWN);
        pairs.map(|(count, time)| (*count as f64, time * 1e3)).collect()
    };
    Points {
        title: title.into(),
        x_label: "iterations".into(),
        y_label: "ms".into(),
        series: configurations
            .iter()
            .enumerate()
            .map(|(colour, c)| Cloud {
                name: c.name.clone(),
                colour,
                is_crossed: false,
                points: points(c),
            })
            .collect(),
    }
}

fn injection_page(injection: &Injection) -> Page {
    let mut page = Page::new("injection", "Injection");
    let Injection { seed, integrator, scenarios, total, .. } = injection;
    page.text(format!(
        "Each of {} cases (seed {seed}) flips one bit while the planner plans one of {scenarios} scenarios: \
         {integrator}, from the built-in model's guess. Of them {} are wrong, panicked or hung. \
         [Verification](verification.md#fault-injection) defines sites, classes and judge.",
        total.cases,
        total.classes.forbidden()
    ));
    page.table(injection.overview());
    page.heading("Cost of faults where the plan is solved").table(injection.costs_of_classes());
    page.text(format!(
        "On the same planner {} plans without a fault followed. All have the bits of before.",
        injection.leak_checks
    ));
    page
}
