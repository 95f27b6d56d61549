//! The pages of the audit, from its numbers.

use super::budgets::{Budgets, Measured};
use super::emulation::Emulation;
use super::image::{proof_tables, size_tables, stack_tables};
use super::loops::Loops;
use super::memory::{Memory, Part};
use super::requirements::{self, Requirement, Texts};
use super::section::{Numbers, Section};
use super::summary::{self, Bar};
use crate::audit::profile::profile_preamble;
use crate::audit::profile::{ConfigurationProfile, Profile};
use crate::inject::Injection;
use image_audit::Kind;
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
        pages.push((Section::Memory, memory_page(&memory, emulation.as_ref())));
    }
    if let Some(emulation) = &emulation {
        pages.push((Section::Instructions, instructions_page(emulation)));
    }
    if let Some(loops) = numbers.findings::<Loops>(Section::Loops)? {
        pages.push((Section::Loops, loops.page()));
    }
    if let Some(profile) = numbers.findings::<Profile>(Section::Latency)? {
        pages.push((Section::Latency, latency_page(&profile)));
    }
    if let Some(injection) = numbers.findings::<Injection>(Section::Injection)? {
        pages.push((Section::Injection, injection_page(&injection)));
    }
    if let Some(map) = numbers.findings::<Map>(Section::Envelope)? {
        let mut page = map.body();
        page.command(again(Section::Envelope));
        pages.push((Section::Envelope, page));
    }
    let finished = pages.into_iter().map(|(section, mut page)| {
        if let Some(finished) = numbers.sections.get(&section) {
            page.heading("Measured by").table(finished.provenance.table());
        }
        page
    });
    Ok(finished.collect())
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

fn tables(page: &mut Page, tables: Vec<(String, Table)>) {
    for (heading, table) in tables {
        page.heading(heading).table(table);
    }
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
         told in [stack.md](../stack.md) and [firmware.md](../firmware.md).",
    );
    page.heading("Static memory").text(
        "The planner's memory by part, from the types of the code (`planner::memory`); the same on \
         all 64-bit targets, a few bytes less on the Cortex-M7. Models lie in read-only memory.",
    );
    page.table(parts("part", &memory.parts)).table(parts("model", &memory.models));
    if !memory.guidance.is_empty() {
        page.text("Flying a plan needs its state and the plan besides, on a 64-bit target:");
        page.table(parts("of guidance", &memory.guidance));
    }
    if let Ok(svg) = split(memory).svg() {
        page.plot("memory-split", "Memory of each target by part [KiB]", svg);
    }
    page.command(again(Section::Memory));

    page.heading("Stack").text(
        "Bound: the compiler's frame sizes along the worst chain of the call graph. Mark: what a \
         painted stack showed under emulation over all runs, less the frames of the image's own \
         functions above the entry point. Each mark must lie below its bound; where an entry point \
         was not painted by itself there is none.",
    );
    page.table(stack_overview(memory, emulation)).command(again(Section::Memory));

    page.heading("Allocations and panics").text(
        "On bare metal the images link without any allocator, and the compiler refuses the crate \
         `alloc` (`ci/cross.sh`). On the host the program counts its own requests for memory while \
         plans are made one after the other, whatever thread makes them:",
    );
    page.table(allocations(memory));
    page.text(
        "Panics: the panic handler refers to a symbol in a section of its own; the linker keeps \
         that section where any code that is kept can reach the handler. An image with a panic put \
         in is refused by the same proof on every run of `cargo xtask firmware`.",
    );
    for image in memory.images.iter().filter(|image| image.target != "host") {
        page.text(format!("`{}`", image.target));
        proof_tables(&image.proofs).into_iter().for_each(|(_, table)| {
            page.table(table);
        });
    }
    page.command(again(Section::Memory));

    for image in &memory.images {
        page.heading(format!("Code and data: {}", image.target));
        for (heading, table) in size_tables(&image.sizes) {
            page.text(format!("**{heading}**")).table(table);
        }
        page.command(again(Section::Memory));
        page.heading(format!("Stack bounds: {}", image.target));
        for (heading, table) in stack_tables(&image.stacks) {
            page.text(format!("**{heading}**")).table(table);
        }
        page.command(again(Section::Memory));
    }
    page
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

/// Bounds beside marks, a row a target and entry point that has both or is the plan.
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
            if bound.bytes.is_none() && mark.is_none() {
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
    let bars = memory.images.iter().filter(|image| image.target != "host").map(|image| {
        let models = image.sizes.models.iter().map(|model| model.bytes).sum::<u64>();
        let bytes = [
            image.sizes.total(Kind::Code),
            image.constants_bytes(),
            models,
            image.sizes.total(Kind::Zero) + image.sizes.total(Kind::Data),
        ];
        let name = image.target.split('-').next().unwrap_or_default();
        (name.to_string(), bytes.map(kibibytes).into())
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
        "Instructions that a plan retires under emulation, phase by phase, over the audit's corpus: \
         typical scenarios and the hardest of a large drawn set (`fixtures/README.md`). Exact and \
         repeatable. The largest is the **observed maximum, emulated**: no scenario outside the \
         corpus is bounded by it, and an instruction is not a cycle. How it is counted: \
         [firmware.md](../firmware.md).",
    );
    tables(&mut page, emulation.tables());
    page.command(again(Section::Instructions));
    page
}

fn latency_page(profile: &Profile) -> Page {
    let mut page = Page::new("latency", "Latency");
    page.text(
        "Times on the host, threads pinned, after a warm-up, all ways of planning scenario by \
         scenario in turn so that all see the same load. Definitions: [profile.md](../profile.md).",
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
    tables(&mut page, profile.tables());
    page.command(again(Section::Latency));
    tables(&mut page, profile.phase_tables());
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
         [injection.md](../injection.md).",
        total.cases
    ));
    tables(&mut page, injection.tables());
    page.text(format!(
        "Plans without a fault made after one with a fault, on the same planner, all with the bits \
         of before: {}.",
        injection.leak_checks
    ));
    page.command(again(Section::Injection));
    page
}
