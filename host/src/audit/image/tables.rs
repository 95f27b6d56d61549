//! The same as tables, for terminal and pages.

use super::{Kind, NotCovered, Proofs, Sizes, StackBound, Verdict};
use crate::report::{Align, Table};

/// Modules of more bytes are shown with those inside them.
const LARGE_BYTES: u64 = 16 << 10;
/// Rows at most of a table of objects.
const MOST_OBJECTS: usize = 12;

/// The bounds side by side, and the chain of each.
pub fn stack_tables(bounds: &[StackBound]) -> Vec<(String, Table)> {
    let mut all = Table::new([
        ("entry point", Align::Left),
        ("function", Align::Left),
        ("bound [bytes]", Align::Right),
        ("narrowed [bytes]", Align::Right),
        ("functions", Align::Right),
        ("indirect calls", Align::Right),
        ("not covered", Align::Left),
    ]);
    for bound in bounds {
        let bytes = match (bound.bytes, bound.instances) {
            (Some(bytes), _) => bytes.to_string(),
            (None, 0) => "no function of its own".into(),
            (None, _) => "none: recursion".into(),
        };
        let places = bound.indirect.places;
        all.row([
            bound.name.clone(),
            bound.path.clone(),
            bytes,
            bound.narrow_bytes.map_or(String::new(), |bytes| bytes.to_string()),
            bound.functions.to_string(),
            format!("{places} to {}", bound.indirect.callees.len()),
            not_covered(&bound.not_covered),
        ]);
    }
    let mut tables = vec![("Stack bounds".to_string(), all)];
    for bound in bounds.iter().filter(|bound| !bound.chain.is_empty()) {
        let mut chain = Table::new([
            ("function", Align::Left),
            ("frame [bytes]", Align::Right),
            ("sum [bytes]", Align::Right),
        ]);
        for frame in &bound.chain {
            let bytes = frame.frame_bytes.map_or("unknown".into(), |bytes| bytes.to_string());
            chain.row([frame.function.clone(), bytes, frame.sum_bytes.to_string()]);
        }
        tables.push((format!("Worst chain of {} (`{}`)", bound.name, bound.path), chain));
    }
    tables
}

fn not_covered(not: &NotCovered) -> String {
    let group = |what: &str, names: &[String]| match names {
        [] => None,
        names => Some(format!("{what} {}", names.join(", "))),
    };
    let circles = not.cycles.iter().filter_map(|circle| group("circle of", circle));
    let libraries = match not.library_callers.len() {
        0 => None,
        count => Some(format!("libraries that {count} functions call")),
    };
    let mut parts: Vec<String> = group("no figure of", &not.without_figure).into_iter().collect();
    parts.extend(libraries);
    parts.extend(group("stray branches in", &not.astray));
    parts.extend(circles);
    parts.join("; ")
}

impl Sizes {
    /// Sections, crates, modules of the core, models, memory.
    pub fn tables(&self) -> Vec<(String, Table)> {
        let mut crates = head("crate");
        let mut sum = (0, 0);
        for (name, code, data) in self.by_origin(0) {
            row(&mut crates, &name, code, data);
            sum = (sum.0 + code, sum.1 + data);
        }
        row(&mut crates, "sum", sum.0, sum.1);
        let mut modules = head("module of remora_core");
        let inner = self.by_origin(2);
        let of_core = |name: &str| name.strip_prefix("remora_core").map(str::to_string);
        for (name, code, data) in self.by_origin(1) {
            let Some(short) = of_core(&name) else { continue };
            let short = short.trim_start_matches("::");
            row(&mut modules, if short.is_empty() { "(several)" } else { short }, code, data);
            let inside =
                || inner.iter().filter(|(path, ..)| path.starts_with(&format!("{name}::")));
            if !short.is_empty() && code + data > LARGE_BYTES && inside().count() > 1 {
                let sum = |sum: (u64, u64), (_, code, data): &(String, u64, u64)| {
                    (sum.0 + code, sum.1 + data)
                };
                let (inner_code, inner_data) = inside().fold((0, 0), sum);
                row(&mut modules, "- (itself)", code - inner_code, data - inner_data);
                for (path, code, data) in inside() {
                    let last = path.rsplit("::").next().unwrap_or_default();
                    row(&mut modules, &format!("- {last}"), *code, *data);
                }
            }
        }
        let mut tables = vec![
            ("Sections".into(), objects("section", &self.sections)),
            ("Code and read-only data by crate".into(), crates),
            ("Code and read-only data of the core by module".into(), modules),
        ];
        if !self.models.is_empty() {
            tables.push(("Learned models built in".into(), objects("model", &self.models)));
        }
        let most = self.memory.len().min(MOST_OBJECTS);
        tables.push(("Memory that is written".into(), objects("object", &self.memory[..most])));
        tables
    }
}

impl Proofs {
    /// Claims and verdicts.
    pub fn tables(&self) -> Vec<(String, Table)> {
        let mut table = Table::new([
            ("claim", Align::Left),
            ("verdict", Align::Left),
            ("why", Align::Left),
            ("found", Align::Left),
        ]);
        for proof in [&self.panic, &self.allocation] {
            let verdict = match proof.verdict {
                Verdict::Proven => "proven",
                Verdict::Refuted => "REFUTED",
                Verdict::Unknown => "unknown",
                Verdict::NotApplicable => "not applicable",
            };
            let found = proof.found.join(", ");
            table.row([proof.claim.clone(), verdict.into(), proof.reason.clone(), found]);
        }
        vec![("Proofs from the image".into(), table)]
    }
}

fn head(first: &str) -> Table {
    Table::new([
        (first, Align::Left),
        ("code [bytes]", Align::Right),
        ("read-only data [bytes]", Align::Right),
    ])
}

fn row(table: &mut Table, name: &str, code: u64, data: u64) {
    table.row([name.into(), code.to_string(), data.to_string()]);
}

fn objects(what: &str, objects: &[super::Named]) -> Table {
    let mut table =
        Table::new([(what, Align::Left), ("kind", Align::Left), ("bytes", Align::Right)]);
    for object in objects {
        let kind = match object.kind {
            Kind::Code => "code",
            Kind::ReadOnly => "read-only data",
            Kind::Data => "data",
            Kind::Zero => "zero at the start",
        };
        table.row([object.name.clone(), kind.into(), object.bytes.to_string()]);
    }
    table
}
