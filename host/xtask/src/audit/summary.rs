//! Bars, budgets, and where each part was measured.

use super::budgets::{Budgets, Measured, Quantity};
use super::emulation::{Emulation, Phase};
use super::memory::{ImageMemory, Memory};
use super::section::{Numbers, Section};
use crate::audit::profile::Profile;
use crate::inject::Injection;
use remora_host::choice::Choice;
use remora_host::error::FieldError;
use remora_host::report::{Page, Table, number, time};
use std::collections::BTreeSet;

/// Requirement with its threshold and the value seen.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Bar {
    /// Name of the value.
    pub what: String,
    /// Its threshold.
    pub bar: String,
    /// The value seen.
    pub seen: String,
    /// Whether the value meets the threshold.
    pub is_met: bool,
    /// Whether the audit fails where it is not met; times depend on the machine and fail nothing.
    pub is_hard: bool,
}

impl Bar {
    fn new(what: &str, bar: &str, seen: impl ToString, is_met: bool) -> Self {
        Self { what: what.into(), bar: bar.into(), seen: seen.to_string(), is_met, is_hard: true }
    }

    fn soft(self) -> Self {
        Self { is_hard: false, ..self }
    }
}

/// Fewest cases of an injection that count.
const LEAST_CASES: u64 = 10_000;
/// Longest audit [s].
const LONGEST_S: f64 = 900.0;

/// Bars of all parts that have been measured.
///
/// # Errors
/// Findings of another form.
pub fn bars(numbers: &Numbers) -> Result<Vec<Bar>, FieldError> {
    let mut bars = Vec::new();
    let emulation = numbers.emulation()?;
    if let Some(memory) = numbers.findings::<Memory>(Section::Memory)? {
        bars.push(allocations(&memory));
        if let Some(emulation) = &emulation {
            bars.push(stack(&memory, emulation));
        }
    }
    if let Some(emulation) = &emulation {
        bars.extend(images(emulation));
    }
    if let Some(injection) = numbers.findings::<Injection>(Section::Injection)? {
        let classes = injection.total.classes;
        let (cases, bad) = (injection.total.cases, classes.forbidden());
        bars.push(Bar::new("injected faults", ">= 10,000", cases, cases >= LEAST_CASES));
        bars.push(Bar::new("of these wrong, panicked or hung", "0", bad, bad == 0));
    }
    if let Some(profile) = numbers.findings::<Profile>(Section::Latency)? {
        bars.extend(worst(&profile).into_iter().map(Bar::soft));
    }
    if Section::ALL.iter().all(|section| numbers.sections.contains_key(section)) {
        let took: f64 = numbers.sections.values().map(|finished| finished.took_s).sum();
        bars.push(Bar::new("the whole audit", "<= 15 min", time(took), took <= LONGEST_S).soft());
    }
    Ok(bars)
}

/// Worst configuration for each bar of the profile.
fn worst(profile: &Profile) -> Vec<Bar> {
    let names: BTreeSet<&str> = profile.bars.iter().map(|bar| bar.name.as_str()).collect();
    let of_name = |name: &str| {
        let bars = || profile.bars.iter().filter(|bar| bar.name == name);
        let worst = bars().min_by(|a, b| (a.value / a.least).total_cmp(&(b.value / b.least)))?;
        let (missed, all) = (bars().filter(|bar| !bar.is_met).count(), bars().count());
        let missing =
            if missed > 0 { format!("; {missed} of {all} missed") } else { String::new() };
        let seen = format!("{:.2} x, {}{missing}", worst.value, worst.configuration);
        Some(Bar::new(name, &format!(">= {} x", worst.least), seen, missed == 0))
    };
    names.into_iter().filter_map(of_name).collect()
}

fn allocations(memory: &Memory) -> Bar {
    let what = "requests for memory while planning";
    match &memory.allocations {
        Some(rows) => {
            let (requests, plans) =
                rows.iter().fold((0, 0), |sum, row| (sum.0 + row.requests, sum.1 + row.plans));
            Bar::new(what, "0", format!("{requests} in {plans} plans"), requests == 0 && plans > 0)
        }
        None => Bar::new(what, "0", "not counted by this program", false),
    }
}

fn images(emulation: &Emulation) -> [Bar; 3] {
    let targets = &emulation.targets;
    let free = targets.iter().filter(|target| target.panic_free).count();
    let runs = || targets.iter().flat_map(|target| &target.runs);
    let same = runs().filter(|run| run.same_bits_as_host).count();
    let solved: usize = runs().map(|run| run.solved).sum();
    let plans: usize = runs().map(|run| run.scenarios).sum();
    let of = |some: usize, all: usize| format!("{some} of {all}");
    [
        Bar::new("images without a reachable panic", "all", of(free, targets.len()), {
            free == targets.len()
        }),
        Bar::new("runs with the bits of the host", "all", of(same, runs().count()), {
            same == runs().count()
        }),
        Bar::new("plans solved under emulation", "all", of(solved, plans), solved == plans),
    ]
}

/// Entry points whose stack the images paint.
pub const PAINTED: [&str; 5] = ["image", "plan", "verification", "opening a model", "guidance"];

/// Bounds against marks.
fn stack(memory: &Memory, emulation: &Emulation) -> Bar {
    let above = |target: &super::emulation::Target| {
        let image = memory.images.iter().find(|image| image.target == target.target);
        let both = |image: &ImageMemory, entry: &str| {
            Some((image.bound(entry)?, image.mark(target, entry)?))
        };
        let each = image.map(|image| PAINTED.map(|entry| both(image, entry)));
        each.is_some_and(|each| {
            each.iter().all(|both| both.is_some_and(|(bound, mark)| bound >= mark))
        })
    };
    let looked: Vec<bool> = emulation.targets.iter().map(above).collect();
    let held = looked.iter().filter(|held| **held).count();
    let seen = format!("{held} of {} targets", looked.len());
    Bar::new("stack bounds above high-water marks", "all", seen, held == looked.len())
}

/// Hard requirements that are not met, one line each.
pub fn faults(bars: &[Bar]) -> Vec<String> {
    let broken = bars.iter().filter(|bar| bar.is_hard && !bar.is_met);
    broken.map(|bar| format!("{}: {}, must be {}", bar.what, bar.seen, bar.bar)).collect()
}

/// The numbers that there may be budgets for.
///
/// # Errors
/// Findings of another form.
pub fn measured(numbers: &Numbers) -> Result<Measured, FieldError> {
    let memory: Option<Memory> = numbers.findings(Section::Memory)?;
    let mut measured = memory.map(|memory| memory.measured()).unwrap_or_default();
    if let Some(emulation) = numbers.emulation()? {
        measured.extend(of_emulation(&emulation));
    }
    Ok(measured)
}

/// Instructions of the first scenario, which every run of the images plans, marks, and what guidance takes
/// at most.
pub fn of_emulation(emulation: &Emulation) -> Measured {
    let mut measured = Measured::new();
    for target in &emulation.targets {
        let mut add = |name: String, value: u64| {
            measured.insert(Quantity::new(&target.target, &name), value);
        };
        if let Some(mark) = target.stack_bytes.values().max() {
            add("stack_mark_bytes".into(), *mark);
        }
        if let Some(flown) = target.guidance() {
            add("guidance_step_instructions".into(), flown.next.instructions);
        }
        if let Some(slice) = target.longest_slice() {
            add("longest_slice_instructions".into(), slice);
        }
        for run in &target.runs {
            let first = run.plans.iter().find(|plan| plan.scenario == FIRST);
            let Some(first) = first else { continue };
            let kind = format!("{}_{}", run.integrator.name(), run.start.name());
            add(format!("instructions_{kind}"), first.instructions.of(Phase::Total));
        }
    }
    measured
}

/// The scenario whose instructions there are budgets for.
pub const FIRST: &str = "pub-000";

/// The beginning of the page, and its sections of thresholds and budgets.
pub fn pages(numbers: &Numbers, bars: &[Bar], budgets: &Budgets, measured: &Measured) -> [Page; 3] {
    let mut first = Page::new("results", "Results");
    first.text(
        "On this page you find what the last [audit](verification.md#the-audit) measured. It writes the page: \
         do not edit it. `record.csv` holds all numbers, with the commit, compiler and machine of each part.",
    );
    first.text(format!("Its parts took: {}.", parts(numbers)));
    let mut thresholds = Page::new("thresholds", "Thresholds");
    thresholds.table(bar_table(bars));
    let mut limits = Page::new("budgets", "Budgets");
    limits.text(
        "Each cell holds the measured number and its budget. `ci/budgets.toml` gives reasons and margins. \
         Instructions and stack bound are those of a whole plan, of `pub-000`.",
    );
    limits.table(budgets.table(measured));
    [first, thresholds, limits]
}

/// Bars as a table.
pub fn bar_table(bars: &[Bar]) -> Table {
    let mut table = Table::new(" | threshold | >measured | ");
    for bar in bars {
        let verdict = match (bar.is_met, bar.is_hard) {
            (true, _) => "met",
            (false, true) => "BROKEN",
            (false, false) => "MISSED",
        };
        table.row([bar.what.clone(), bar.bar.clone(), bar.seen.clone(), verdict.into()]);
    }
    table
}

/// The section of each part, and how long it took.
fn parts(numbers: &Numbers) -> String {
    let one = |section: &Section| {
        let took = numbers.sections.get(section).map(|finished| finished.took_s.round());
        let took = took.map_or("not measured".into(), |took| format!("{} s", number(took)));
        format!("[{0}](#{0}) {took}", section.name())
    };
    Section::ALL.iter().map(one).collect::<Vec<_>>().join(", ")
}
