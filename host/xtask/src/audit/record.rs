//! The record of an audit: what can be made again anywhere, a number a row, the pages' checksums, and all tables.
//!
//! It is kept with the pages and is what a check compares with, so that the file of all numbers
//! need not be. Rows have names, no layout: a new kind of number leaves the old rows valid.

use super::budgets::Budgets;
use super::emulation::{Emulation, Phase, PlanRecord, Run, Target};
use super::loops::Loops;
use super::memory::ImageMemory;
use super::pages;
use super::section::{Numbers, Section};
use crate::inject::Injection;
use remora_core::advanced::bounds::LOOPS;
use remora_host::envelope::{Cell, Map};
use remora_host::error::{Error, FieldError};
use remora_host::formats::write_atomically;
use remora_host::formats::{Limit, read_text};
use remora_host::report::Table;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the file, beside the pages.
pub const FILE: &str = "record.csv";

/// Subject of a row: the part of the audit, the item and the number's name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key {
    /// `parts`, `pages`, `budgets`, `tables`, or the name of a section.
    pub part: String,
    /// The target, method or vehicle.
    pub of: String,
    /// The number.
    pub what: String,
}

/// A row of the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    part: String,
    of: String,
    what: String,
    value: String,
}

/// Rows by what they are about.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Record(pub BTreeMap<Key, String>);

impl Record {
    /// The record of all parts that have been measured; pages are added as they are written.
    ///
    /// # Errors
    /// Findings of another form.
    pub fn of(numbers: &Numbers, budgets: &Budgets) -> Result<Self, FieldError> {
        let mut record = Self::default();
        for (section, finished) in &numbers.sections {
            record.add("parts", section.name(), "commit", &finished.provenance.commit);
        }
        record.budgets(budgets);
        if let Some(memory) = numbers.findings::<super::memory::Memory>(Section::Memory)? {
            memory.images.iter().for_each(|image| record.image(image));
        }
        if let Some(Emulation { targets }) = numbers.emulation()? {
            targets.iter().for_each(|target| record.plans(target));
        }
        if let Some(loops) = numbers.findings::<Loops>(Section::Loops)? {
            record.loops(&loops);
        }
        if let Some(injection) = numbers.findings::<Injection>(Section::Injection)? {
            record.injection(&injection);
        }
        if let Some(map) = numbers.findings::<Map>(Section::Envelope)? {
            record.envelope(&map);
        }
        for (section, heading, table) in pages::tables(numbers)? {
            record.table(&format!("{}: {heading}", section.name()), &table);
        }
        Ok(record)
    }

    /// Reads the record beside the pages; none where there is none.
    ///
    /// # Errors
    /// A file that cannot be read or is no record.
    pub fn read(out: &Path) -> Result<Option<Self>, Error> {
        let file = out.join(FILE);
        if !file.exists() {
            return Ok(None);
        }
        let text = read_text(&file, Limit::DOCUMENT)?;
        let mut record = Self::default();
        for (i, row) in csv::Reader::from_reader(text.as_bytes()).deserialize().enumerate() {
            let field = format!("row {}", i + 1);
            let row: Row =
                row.map_err(|error| Error::input(&file, field.clone(), error.to_string()))?;
            let key = Key { part: row.part, of: row.of, what: row.what };
            if record.0.insert(key, row.value).is_some() {
                return Err(Error::input(&file, field, "is there twice"));
            }
        }
        Ok(Some(record))
    }

    /// Writes it beside the pages.
    ///
    /// # Errors
    /// Where that is not possible.
    pub fn write(&self, out: &Path) -> Result<(), Error> {
        let file = out.join(FILE);
        let failed = |error: csv::Error| Error::output(&file, &std::io::Error::other(error));
        let mut writer = csv::Writer::from_writer(Vec::new());
        for (key, value) in &self.0 {
            let Key { part, of, what } = key.clone();
            writer.serialize(Row { part, of, what, value: value.clone() }).map_err(failed)?;
        }
        let text = writer
            .into_inner()
            .map_err(|error| Error::output(&file, &std::io::Error::other(error.to_string())))?;
        write_atomically(&file, &text)
    }

    /// The rows of a part.
    pub fn part<'a>(&'a self, part: &'a str) -> impl Iterator<Item = (&'a Key, &'a String)> {
        self.0.iter().filter(move |(key, _)| key.part == part)
    }

    /// The value of a row.
    pub fn get(&self, part: &str, of: &str, what: &str) -> Option<&str> {
        let key = Key { part: part.into(), of: of.into(), what: what.into() };
        self.0.get(&key).map(String::as_str)
    }

    fn add(&mut self, part: &str, of: &str, what: &str, value: impl ToString) {
        let key = Key { part: part.into(), of: of.into(), what: what.into() };
        self.0.insert(key, value.to_string());
    }

    /// A page or a plot, as it was written.
    pub fn page(&mut self, name: &str, text: &str) {
        self.add("pages", name, "crc32", checksum(text));
    }

    /// The rows of a table, which nothing is compared with.
    fn table(&mut self, of: &str, table: &Table) {
        for (name, value) in table.named_rows() {
            let mut what = name.clone();
            for number in 2.. {
                if self.get(TABLES, of, &what).is_none() {
                    break;
                }
                what = format!("{name} ({number})");
            }
            self.add(TABLES, of, &what, value);
        }
    }

    /// Values that each quantity may have.
    pub fn budgets(&mut self, budgets: &Budgets) {
        for (quantity, limit) in budgets.limits() {
            self.add("budgets", &quantity.target, &quantity.name, limit);
        }
    }

    /// Code, constants, stack bounds and proofs of an image.
    pub fn image(&mut self, image: &ImageMemory) {
        let target = &image.target;
        let mut add = |what: &str, value: String| self.add("memory", target, what, value);
        for (name, code, _) in image.sizes.by_origin(0) {
            add(&format!("code of {name} [bytes]"), code.to_string());
        }
        // By name, and code alone: constants that two modules share go to the one or the other as the
        // linker places them, which the names' hashes decide, and so the folder that it is built in.
        let modules: BTreeMap<_, _> =
            image.sizes.by_origin(2).into_iter().map(|(name, code, _)| (name, code)).collect();
        let modules: String = modules
            .iter()
            .filter(|(_, code)| **code > 0)
            .map(|(name, code)| format!("{name} {code}\n"))
            .collect();
        add("code by module, crc32", checksum(&modules));
        add(CONSTANTS, image.constants_bytes().to_string());
        for bound in &image.stacks {
            let bytes = bound.bytes.map_or("none".into(), |bytes| bytes.to_string());
            add(&format!("stack bound of {} [bytes]", bound.name), bytes);
        }
        for proof in [&image.proofs.panic, &image.proofs.allocation] {
            add(&proof.claim, format!("{:?}", proof.verdict).to_lowercase());
        }
    }

    /// Instructions of the plans of an image.
    pub fn plans(&mut self, target: &Target) {
        self.add(INSTRUCTIONS, &target.target, TOOLCHAIN, &target.toolchain);
        for run in &target.runs {
            for plan in &run.plans {
                self.add(INSTRUCTIONS, &target.target, &plan_name(run, plan), plan_text(plan));
            }
        }
    }

    /// Bounds of loops, and the most turns observed.
    pub fn loops(&mut self, loops: &Loops) {
        let bound = |bound: Option<u64>| bound.map_or("argument".into(), |turns| turns.to_string());
        for row in &LOOPS {
            let value = format!("{}, at most {}", bound(row.default), bound(row.most));
            self.add("loops", "bounds", row.name, value);
        }
        for row in &loops.observed {
            let mut add = |what: &str, turns: u64| self.add("loops", &row.method, what, turns);
            add("plans", row.plans);
            add("Stage 1 iterations", row.stage1_iterations);
            add("Stage 2 iterations", row.stage2_iterations);
            add("corrections", row.corrections);
            add("solver iterations", row.solver_iterations);
            self.add("loops", &row.method, "hardest", &row.hardest);
        }
    }

    /// Outcomes of the first cases.
    pub fn injection(&mut self, injection: &Injection) {
        let what = format!("first {}, fingerprint", Injection::FIRST);
        self.add("injection", &injection.integrator, &what, &injection.first);
    }

    /// The coarse map but for its times.
    pub fn envelope(&mut self, map: &Map) {
        for cell in map.timeless_cells() {
            let place = &cell.place;
            let what = format!(
                "{} s, {} deg/s, {} m",
                place.horizon_s, place.rate_deg_s, place.distance_m
            );
            self.add("envelope", &place.vehicle, &what, cell_text(&cell));
        }
    }
}

/// The row whose value may differ by padding.
pub const CONSTANTS: &str = "constants [bytes]";
/// The part that holds all tables of all parts.
pub const TABLES: &str = "tables";
/// The part that counts instructions.
pub const INSTRUCTIONS: &str = "instructions";
/// The row that says which compiler made an image.
pub const TOOLCHAIN: &str = "toolchain";

/// CRC-32 of a text.
pub fn checksum(text: &str) -> String {
    format!("{:08x}", crc32fast::hash(text.as_bytes()))
}

fn plan_name(run: &Run, plan: &PlanRecord) -> String {
    format!("{}, {}, from the {}", plan.scenario, run.integrator.label(), run.start.name())
}

/// A plan's bits, iterations, and instructions phase by phase.
fn plan_text(plan: &PlanRecord) -> String {
    let phases = Phase::ALL.map(|phase| plan.instructions.of(phase).to_string()).join(" ");
    let iterations = [plan.translation.iterations, plan.reorientation.iterations];
    let [one, two] = iterations.map(|iterations| iterations.to_string());
    let outcome = if plan.is_solved() { "solved" } else { "not solved" };
    format!("{outcome} {} in {one} and {two}: {phases}", plan.output)
}

fn cell_text(cell: &Cell) -> String {
    let Some(found) = &cell.found else {
        return format!("{}: {}", cell.state.name(), cell.state.why());
    };
    let number = |value: Option<f64>| value.map_or("-".into(), |value| value.to_string());
    let reasons = found.reasons.iter().map(|(reason, count)| format!(", {reason} {count}"));
    format!(
        "{} of {} optimal, {} verified, iterations {}, cost {}, clearance {}{}",
        found.optimal,
        found.scenarios,
        found.verified,
        number(found.iterations),
        number(found.cost),
        number(found.clearance_m),
        reasons.collect::<String>()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_survives_a_round_trip() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(Record::read(dir.path()), Ok(None));
        let mut record = Record::default();
        record.page("results.md", "# Audit\n");
        record.add("memory", "m7", "a \"name\", with marks", 7);
        record.write(dir.path()).unwrap();
        let read = Record::read(dir.path()).unwrap().unwrap();
        assert_eq!(read, record);
        assert_eq!(read.get("pages", "results.md", "crc32"), Some("7094f021"));
        assert_eq!(read.part("memory").count(), 1);
    }

    #[test]
    fn rows_of_tables_are_told_apart() {
        let mut table = Table::new("phase | >n");
        for n in ["1", "2"] {
            table.row(["qp".into(), n.into()]);
        }
        let mut record = Record::default();
        record.table("latency: Phases", &table);
        assert_eq!(record.get(TABLES, "latency: Phases", "qp"), Some("n 1"));
        assert_eq!(record.get(TABLES, "latency: Phases", "qp (2)"), Some("n 2"));
    }

    #[test]
    fn what_is_no_record_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        for (text, reason) in [
            ("part,of,what\na,b,c\n", "record.csv: row 1: "),
            ("part,of,what,value\na,b,c,1\na,b,c,2\n", "record.csv: row 2: is there twice"),
        ] {
            std::fs::write(dir.path().join(FILE), text).unwrap();
            let error = Record::read(dir.path()).unwrap_err().to_string();
            assert!(error.contains(reason), "{error}");
        }
    }
}
