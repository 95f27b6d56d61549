//! The section on the memory of planner, guidance and images.

use super::emulation::Emulation;
use super::firmware::HOST;
use super::image::{PLANNER, size_tables, stack_tables};
use super::memory::{ImageMemory, Memory, Part};
use super::summary::PAINTED;
use image_audit::{Kind, Proof, Verdict};
use remora_host::report::plot::Bars;
use remora_host::report::{Align, Page, Table};

/// Static memory, requests for it, and of each image its sizes and its stack.
pub(super) fn tables(memory: &Memory) -> Vec<(String, Table)> {
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

fn parts(head: &str, parts: &[Part]) -> Table {
    let mut table = Table::new([(head, Align::Left), ("bytes", Align::Right)]);
    for part in parts {
        table.row([part.name.replace('_', " "), part.bytes.to_string()]);
    }
    let sum: u64 = parts.iter().map(|part| part.bytes).sum();
    table.row(["**sum**".into(), sum.to_string()]);
    table
}

/// The section on memory.
pub(super) fn page(memory: &Memory, emulation: Option<&Emulation>) -> Page {
    let mut page = Page::new("memory", "Memory");
    page.text(
        "The caller provides all memory, and no large object lies on the stack. \
         [Verification](verification.md#stack-bounds-sizes-and-proofs) tells how sizes, bounds and proofs \
         are made.",
    );
    page.text(format!(
        "Bytes on 64-bit targets: {}. The Cortex-M7 needs a few less. Models lie in read-only memory.",
        held(memory)
    ));
    page.heading("Stack").text("Bound and high-water mark in bytes. The host paints no stack.");
    page.table(stack_overview(memory, emulation));
    if let Some(text) = without_figure(memory, emulation) {
        page.text(text);
    }
    let proven = images(memory).filter(|image| open_proofs(image).next().is_none()).count();
    page.heading("Allocations and panics").text(format!(
        "Symbols prove for {proven} of {} images that nothing can panic or allocate. On the host the program \
         counts its requests for memory while it plans: {}.",
        images(memory).count(),
        requests(memory)
    ));
    if proven < images(memory).count() {
        page.table(unproven(memory));
    }
    page.heading("Code and data").text("In bytes, with the flight code by crate.");
    page.table(code_and_data(memory));
    if let Ok(svg) = split(memory).svg() {
        page.plot("memory-split", "Memory by part [KiB]", svg);
    }
    page
}

/// The planner as a whole, guidance and models, with their bytes.
fn held(memory: &Memory) -> String {
    let planner = memory.parts.iter().map(|part| part.bytes).sum();
    let planner = Part { name: "planner".into(), bytes: planner };
    let all = std::iter::once(&planner).chain(&memory.guidance).chain(&memory.models);
    let one = |part: &Part| format!("{} {}", part.name.replace('_', " "), part.bytes);
    all.map(one).collect::<Vec<_>>().join(", ")
}

/// The sum over all methods, in words.
fn requests(memory: &Memory) -> String {
    let Some(rows) = &memory.allocations else { return "not counted by this program".into() };
    let requests: u64 = rows.iter().map(|row| row.requests).sum();
    let plans: u64 = rows.iter().map(|row| row.plans).sum();
    format!("{requests} in {plans} plans with {} methods", rows.len())
}

/// The images of flight processors.
fn images(memory: &Memory) -> impl Iterator<Item = &ImageMemory> {
    memory.images.iter().filter(|image| image.target != HOST)
}

/// Claims that the symbols of an image do not prove.
fn open_proofs(image: &ImageMemory) -> impl Iterator<Item = &Proof> {
    let both = [&image.proofs.panic, &image.proofs.allocation];
    both.into_iter().filter(|proof| proof.verdict != Verdict::Proven)
}

/// Claims that are not proven, with the symbols found.
fn unproven(memory: &Memory) -> Table {
    let mut table = Table::new("target | claim | verdict | found");
    for image in images(memory) {
        for proof in open_proofs(image) {
            let verdict = match proof.verdict {
                Verdict::Proven => "proven",
                Verdict::Refuted => "REFUTED",
                Verdict::Unknown => "unknown",
                Verdict::NotApplicable => "not applicable",
            };
            let found = format!("{}: {}", proof.reason, proof.found.join(", "));
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
    for image in images(memory) {
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
    let mut table = Table::new("method | >plans | >requests for memory");
    for row in memory.allocations.iter().flatten() {
        table.row([row.method.clone(), row.plans.to_string(), row.requests.to_string()]);
    }
    table
}

/// Entry points of the host's image that are shown, which has no marks.
const HOSTED: [&str; 2] = ["plan", "guidance"];

/// Bounds beside high-water marks: a row an entry point that has a mark, a column a target.
fn stack_overview(memory: &Memory, emulation: Option<&Emulation>) -> Table {
    let targets = memory.images.iter().map(|image| (image.target.clone(), Align::Right));
    let head = [("entry point".to_string(), Align::Left)].into_iter().chain(targets);
    let mut table = Table::with_columns(head.collect());
    for entry in PAINTED {
        let bytes = |bytes: Option<u64>| bytes.map_or("-".into(), |bytes| bytes.to_string());
        let cells = memory.images.iter().map(|image| {
            let (bound, mark) = bound_and_mark(image, emulation, entry);
            match mark {
                None if image.target != HOST || !HOSTED.contains(&entry) => "-".into(),
                None => bytes(bound),
                Some(_) => format!("{}, {}", bytes(bound), bytes(mark)),
            }
        });
        table.push([entry.to_string()].into_iter().chain(cells).collect());
    }
    table
}

/// Stack bound and high-water mark of an entry point.
fn bound_and_mark(
    image: &ImageMemory,
    emulation: Option<&Emulation>,
    entry: &str,
) -> (Option<u64>, Option<u64>) {
    let target = emulation.and_then(|e| e.targets.iter().find(|t| t.target == image.target));
    (image.bound(entry), target.and_then(|target| image.mark(target, entry)))
}

/// Functions without a known frame, which bounds that are shown count as nothing.
fn without_figure(memory: &Memory, emulation: Option<&Emulation>) -> Option<String> {
    let mut lists = Vec::new();
    for image in &memory.images {
        for bound in image.stacks.iter().filter(|bound| PAINTED.contains(&bound.name.as_str())) {
            let names = &bound.not_covered.without_figure;
            let is_shown = bound_and_mark(image, emulation, &bound.name).1.is_some();
            if is_shown && !names.is_empty() {
                lists.push(format!("{} {}: `{}`", image.target, bound.name, names.join("`, `")));
            }
        }
    }
    let list = lists.join("; ");
    (!list.is_empty()).then(|| format!("Functions without a known frame, not counted: {list}."))
}

/// Memory of each target: code, constants, models, static memory.
fn split(memory: &Memory) -> Bars {
    let kibibytes = |bytes: u64| bytes as f64 / 1024.0;
    let bars = images(memory).map(|image| {
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
