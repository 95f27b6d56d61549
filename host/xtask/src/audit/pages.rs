//! The pages of the audit, from its numbers.

use super::budgets::{Budgets, Measured};
use super::emulation::Emulation;
use super::firmware::HOST;
use super::image::{PLANNER, size_tables, stack_tables};
use super::loops::Loops;
use super::memory::{ImageMemory, Memory, Part};
use super::requirements::{self, Requirement, Texts};
use super::section::{Numbers, Section};
use super::summary::{self, Bar};
use crate::audit::profile::profile_preamble;
use crate::audit::profile::{ConfigurationProfile, Profile};
use crate::inject::Injection;
use image_audit::{Kind, Verdict};
use remora_host::envelope::Map;
use remora_host::error::FieldError;
use remora_host::method::Integrator;
use remora_host::report::plot::{Bars, Distributions, Points};
use remora_host::report::{Align, Page, Table};

/// The pages of all parts that have been measured, in the order in which they are read.
///
/// # Errors
/// Findings of another form.
fn all(numbers: &Numbers) -> Result<Vec<Page>, FieldError> {
    let emulation = numbers.emulation()?;
    let mut pages = Vec::new();
    if let Some(memory) = numbers.findings::<Memory>(Section::Memory)? {
        pages.push(memory_page(&memory, emulation.as_ref()));
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
        let mut page = map.body();
        page.command(again(Section::Envelope));
        pages.push(page);
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
        add(Section::Memory, memory_tables(&memory));
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

/// Static memory, requests for it, and of each image its sizes and its stack.
fn memory_tables(memory: &Memory) -> Vec<(String, Table)> {
    let mut tables = vec![
        ("Static memory".to_string(), parts("part", &memory.parts)),
        ("Models".into(), parts("model", &memory.models)),
        ("Guidance".into(), parts("of guidance", &memory.guidance)),
        ("Requests for memory".into(), allocations(memory)),
    ];
    for image in &memory.images {
        let of_image = size_tables(&image.sizes).into_iter().chain(stack_tables(&image.stacks));
        tables.extend(of_image.map(|(name, table)| (format!("{}: {name}", image.target), table)));
    }
    tables
}

/// The whole audit: its pages, and what stands on the first of them.
pub struct Book {
    /// The first page, those of the parts, the requirements'.
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
        let mut pages = vec![summary::page(numbers, &bars, budgets, &measured)];
        pages.extend(all(numbers)?);
        let texts = texts.with_pages(&pages);
        pages.push(requirements::page(rows, &texts));
        Ok(Self { pages, bars, measured })
    }
}

/// The command that measures a part again.
fn again(section: Section) -> String {
    format!("cargo xtask audit --only {}", section.name())
}

fn parts(head: &str, parts: &[Part]) -> Table {
    let mut table = Table::new([(head, Align::Left), ("bytes", Align::Right)]);
    for part in parts {
        table.row([part.name.replace('_', " "), part.bytes.to_string()]);
    }
    let sum: u64 = parts.iter().map(|part| part.bytes).sum();
    table.row(["**sum**".into(), sum.to_string()]);
    table
}

fn memory_page(memory: &Memory, emulation: Option<&Emulation>) -> Page {
    let mut page = Page::new("memory", "Memory");
    page.text(
        "All memory of the planner is static and the caller's: nothing is allocated, nothing large \
         lies on the stack. How sizes, bounds and proofs are made, and what they do not cover, is \
         told in [stack.md](../stack.md) and [firmware.md](../firmware.md). Code by module, every \
         bound and its worst chain are rows of `record.csv`.",
    );
    page.heading("Static memory").text(
        "The planner's memory by part, on all 64-bit targets; a few bytes less on the Cortex-M7. \
         Models lie in read-only memory. Flying a plan needs its state and the plan besides.",
    );
    page.table(parts("part", &memory.parts)).table(parts("model", &memory.models));
    page.table(parts("of guidance", &memory.guidance));
    page.heading("Stack").text(
        "Bound: the compiler's frame sizes along the worst chain of the call graph. Mark: what a \
         painted stack showed under emulation over all runs, less the frames of the image's own \
         functions above the entry point. Each mark must lie below its bound. The host paints none.",
    );
    page.table(stack_overview(memory, emulation));
    page.heading("Allocations and panics").text(format!(
        "The images link without any allocator. On the host the program counts its own requests \
         for memory while it plans: {}. An image with a panic put in is refused by the same proof \
         on every run of `cargo xtask firmware`.",
        requests(memory)
    ));
    page.table(proofs(memory));
    page.heading("Code and data").text("In bytes; by crate the code that flies.");
    page.table(code_and_data(memory));
    if let Ok(svg) = split(memory).svg() {
        page.plot("memory-split", "Memory of each target by part [KiB]", svg);
    }
    page.command(again(Section::Memory));
    page
}

/// The sum over all methods, in words.
fn requests(memory: &Memory) -> String {
    let Some(rows) = &memory.allocations else { return "not counted by this program".into() };
    let requests: u64 = rows.iter().map(|row| row.requests).sum();
    let plans: u64 = rows.iter().map(|row| row.plans).sum();
    format!("{requests} in {plans} plans with {} methods", rows.len())
}

/// What the symbols of each image prove; why not, where they do not.
fn proofs(memory: &Memory) -> Table {
    let mut table = Table::new([
        ("target", Align::Left),
        ("claim", Align::Left),
        ("verdict", Align::Left),
        ("found", Align::Left),
    ]);
    for image in memory.images.iter().filter(|image| image.target != HOST) {
        for proof in [&image.proofs.panic, &image.proofs.allocation] {
            let (verdict, why) = match proof.verdict {
                Verdict::Proven => ("proven", String::new()),
                Verdict::Refuted => ("REFUTED", format!("{}: ", proof.reason)),
                Verdict::Unknown => ("unknown", format!("{}: ", proof.reason)),
                Verdict::NotApplicable => ("not applicable", format!("{}: ", proof.reason)),
            };
            let found = why + &proof.found.join(", ");
            table.row([image.target.clone(), proof.claim.clone(), verdict.into(), found]);
        }
    }
    table
}

/// Code by crate, constants, models and static memory of each image.
fn code_and_data(memory: &Memory) -> Table {
    let mut head = vec![("target".to_string(), Align::Left)];
    let numbers = PLANNER.crates.iter().copied();
    let numbers = numbers.chain(["other code", "constants", "models", "static memory"]);
    head.extend(numbers.map(|name| (name.to_string(), Align::Right)));
    let mut table = Table::with_columns(head);
    for image in memory.images.iter().filter(|image| image.target != HOST) {
        let [code, others @ ..] = areas(image);
        let by_crate = image.sizes.by_origin(0);
        let of_crate = |name: &&str| {
            by_crate.iter().find(|(of, ..)| of.as_str() == *name).map_or(0, |(_, code, _)| *code)
        };
        let crates: Vec<u64> = PLANNER.crates.iter().map(of_crate).collect();
        let other = code - crates.iter().sum::<u64>();
        let bytes = crates.into_iter().chain([other]).chain(others).map(|bytes| bytes.to_string());
        table.push([image.target.clone()].into_iter().chain(bytes).collect());
    }
    table
}

/// Bytes of code, constants, models and static memory.
fn areas(image: &ImageMemory) -> [u64; 4] {
    [
        image.sizes.total(Kind::Code),
        image.constants_bytes(),
        image.sizes.models.iter().map(|model| model.bytes).sum(),
        image.sizes.total(Kind::Zero) + image.sizes.total(Kind::Data),
    ]
}

/// Requests for memory by method.
fn allocations(memory: &Memory) -> Table {
    let mut table = Table::new([
        ("method", Align::Left),
        ("plans", Align::Right),
        ("requests for memory", Align::Right),
    ]);
    for row in memory.allocations.iter().flatten() {
        table.row([row.method.clone(), row.plans.to_string(), row.requests.to_string()]);
    }
    table
}

/// Entry points of the host's image that are shown, which has no marks.
const HOSTED: [&str; 2] = ["plan", "guidance"];

/// Bounds beside marks, a row a target and entry point that has a mark.
fn stack_overview(memory: &Memory, emulation: Option<&Emulation>) -> Table {
    let mut table = Table::new([
        ("target", Align::Left),
        ("entry point", Align::Left),
        ("bound [bytes]", Align::Right),
        ("mark [bytes]", Align::Right),
        ("not covered", Align::Left),
    ]);
    for image in &memory.images {
        let target = emulation.and_then(|e| e.targets.iter().find(|t| t.target == image.target));
        for bound in &image.stacks {
            let mark = target.and_then(|target| image.mark(target, &bound.name));
            let is_shown = image.target == HOST && HOSTED.contains(&bound.name.as_str());
            if mark.is_none() && !is_shown {
                continue;
            }
            table.row([
                image.target.clone(),
                bound.name.clone(),
                bound.bytes.map_or("none".into(), |bytes| bytes.to_string()),
                mark.map_or("-".into(), |bytes| bytes.to_string()),
                bound.not_covered.without_figure.join(", "),
            ]);
        }
    }
    table
}

/// Memory of each target: code, constants, models, static memory.
fn split(memory: &Memory) -> Bars {
    let kibibytes = |bytes: u64| bytes as f64 / 1024.0;
    let bars = memory.images.iter().filter(|image| image.target != HOST).map(|image| {
        let name = image.target.split('-').next().unwrap_or_default();
        (name.to_string(), areas(image).map(kibibytes).into())
    });
    Bars {
        title: "Memory of an image".into(),
        x_label: "KiB".into(),
        parts: ["code", "constants", "models", "static memory"].map(String::from).into(),
        bars: bars.collect(),
    }
}

fn instructions_page(emulation: &Emulation) -> Page {
    let mut page = Page::new("instructions", "Instructions");
    page.text(
        "Instructions that a plan retires under emulation over the audit's corpus: typical \
         scenarios and the hardest of a large drawn set (`fixtures/README.md`). Exact and \
         repeatable. The largest is the **observed maximum, emulated**: no scenario outside the \
         corpus is bounded by it, and an instruction is not a cycle. How it is counted: \
         [firmware.md](../firmware.md). Every plan phase by phase is a row of `record.csv`.",
    );
    page.heading("Observed maxima").text(
        "Of a whole plan in 10^6 instructions and of a slice between two pauses of planning, with \
         the scenario; of so many steps of guidance that follow another, of first ones, and their \
         stack in bytes.",
    );
    page.table(emulation.maxima());
    page.heading("Observed maxima by phase [10^6]").text("Over all integrators and starts.");
    page.table(emulation.phase_maxima()).command(again(Section::Instructions));
    page
}

fn latency_page(profile: &Profile) -> Page {
    let mut page = Page::new("latency", "Latency");
    page.text(
        "Times on the host, threads pinned, after a warm-up, all ways of planning scenario by \
         scenario in turn so that all see the same load. Definitions: [profile.md](../profile.md). \
         Every quantile of every phase is in rows of `record.csv`.",
    );
    profile_preamble(profile).lines().filter(|line| !line.is_empty()).for_each(|line| {
        page.text(line);
    });
    for (integrator, label) in [(Integrator::Euler, "Euler"), (Integrator::RK4, "RK4")] {
        let of_integrator = |c: &&ConfigurationProfile| c.configuration.integrator == integrator;
        let chosen: Vec<_> = profile.configurations.iter().filter(of_integrator).collect();
        let title = format!("Time of a whole plan on one core, {label}");
        if let Ok(svg) = distributions(&title, &chosen).svg() {
            page.plot(&format!("latency-{integrator}"), &title, svg);
        }
        let title = format!("Iterations of Stage 2 against the time of the plan, {label}");
        if let Ok(svg) = iterations(&title, &chosen).svg() {
            page.plot(&format!("iterations-{integrator}"), &title, svg);
        }
    }
    page.heading("Whole plans [ms]").text(
        "On one core; what a second core is worth, as medians of ratios plan by plan; the p99 while \
         the other core plans too.",
    );
    page.table(profile.overview());
    if let Some((name, table)) = profile.slowest() {
        page.heading(format!("Phases of a plan on one core, {name} [ms]")).table(table);
    }
    page.command(again(Section::Latency));
    page
}

/// Times of plans on one core.
fn distributions(title: &str, configurations: &[&ConfigurationProfile]) -> Distributions {
    let series = configurations
        .iter()
        .map(|c| (c.name.clone(), c.one_core.plan_samples_s.iter().map(|s| s * 1e3).collect()));
    Distributions { title: title.into(), x_label: "ms".into(), series: series.collect() }
}

/// The same over the iterations of Stage 2, of the first rounds: a plan's iterations are the same
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
        series: configurations.iter().map(|c| (c.name.clone(), points(c))).collect(),
    }
}

fn injection_page(injection: &Injection) -> Page {
    let mut page = Page::new("injection", "Injection");
    let Injection { seed, integrator, scenarios, total, .. } = injection;
    page.text(format!(
        "{} cases of seed {seed}: each one flipped bit in the plan of one of {scenarios} scenarios, \
         {integrator}, start from the built-in model. A plan is judged by the verifier with a \
         mission and a scenario that nothing has touched. Sites and classes: \
         [injection.md](../injection.md). By kind of data and site in rows of `record.csv`.",
        total.cases
    ));
    if let Some((heading, table)) = injection.tables().into_iter().next() {
        page.heading(heading).table(table);
    }
    page.heading("What faults cost where the plan is solved").table(injection.cost_of_all());
    page.text(format!(
        "Plans without a fault made after one with a fault, on the same planner, all with the bits \
         of before: {}.",
        injection.leak_checks
    ));
    page.command(again(Section::Injection));
    page
}
