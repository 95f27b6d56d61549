//! Whether budgets are kept and the record is what the code of today would make.

use super::budgets::{Budgets, Measured};
use super::emulation::Emulation;
use super::firmware::{self, Firmware};
use super::loops::Loops;
use super::memory::{self, ImageMemory};
use super::record::{self, CONSTANTS, INSTRUCTIONS, Key, Record, TOOLCHAIN};
use super::requirements::{self, Requirement, Texts};
use super::run::{Watcher, envelope, inject, observed_scenarios};
use super::summary;
use crate::inject::Injection;
use remora_host::error::Error;
use remora_host::formats::Mission;
use remora_host::method::Integrator;
use std::num::NonZeroUsize;
use std::path::Path;

/// Bytes by which constants may differ: the linker orders them by names that depend on the folder
/// of the checkout, and aligns each.
const MOST_PADDING: u64 = 64;

/// Findings of a check.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Checked {
    /// Things looked at, a line each.
    pub looked_at: Vec<String>,
    /// Faults, a line each.
    pub faults: Vec<String>,
}

/// Whether today's numbers are all that a part of the record should have.
#[derive(Clone, Copy, PartialEq)]
enum Extent {
    /// All of them: a row too many or too few is a fault.
    All,
    /// Some of them, at least one.
    Some,
}

/// Subject of a check.
struct Check<'a> {
    root: &'a Path,
    /// Findings of the pages' audit.
    then: Record,
    jobs: NonZeroUsize,
    alarm: fn(u64, Integrator, u64),
    checked: Checked,
}

/// Holds the checkout in `root` against its budgets, and against the pages and the record in `out`.
///
/// Images and their plans are those that `cargo xtask firmware` left last; where it left none they are made
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
    let budgets = Budgets::read(root)?;
    let rows = requirements::read(root)?;
    let mut checked = kept(out, &budgets, &rows, &requirements::texts(root, &rows))?;
    let then = Record::read(out)?.unwrap_or_default();
    checked.faults.extend(requirements::faults(root, &rows)?);
    checked.looked_at.push(format!("{} requirements", rows.len()));

    let mut check = Check { root, then, jobs, alarm, checked };
    let measured = check.images(watcher)?;
    check.checked.faults.extend(budgets.faults(&measured));
    check.checked.looked_at.push(format!("{} numbers against budgets", measured.len()));
    check.loops(watcher)?;
    check.injection(watcher)?;
    check.envelope(watcher)?;
    Ok(check.checked)
}

/// Holds the pages in `out` against the record beside them, today's budgets and requirements;
/// `texts` are pages that requirements refer to.
///
/// # Errors
/// A record that is not there or cannot be understood.
pub fn kept(
    out: &Path,
    budgets: &Budgets,
    rows: &[Requirement],
    texts: &Texts,
) -> Result<Checked, Error> {
    let file = out.join(record::FILE);
    let then = Record::read(out)?
        .ok_or_else(|| Error::input(&file, "", "no such file: run `cargo xtask audit` first"))?;
    let mut checked = Checked::default();
    for (key, crc) in then.part("pages") {
        let text = std::fs::read_to_string(out.join(&key.of)).unwrap_or_default();
        checked.looked_at.push(format!("page {}", key.of));
        if record::checksum(requirements::split(&text).0) != *crc {
            checked.faults.push(format!("page {}: not as the audit wrote it", key.of));
        }
    }
    let there = std::fs::read_to_string(out.join(requirements::RESULTS)).unwrap_or_default();
    checked.looked_at.push("page requirements".into());
    if requirements::page(rows, texts).section() != requirements::split(&there).1 {
        checked.faults.push(format!(
            "page requirements: not what {} says; write it again with \
             `REMORA_WRITE_REQUIREMENTS=1 cargo test -p xtask --test pages`",
            requirements::FILE
        ));
    }
    let mut now = Record::default();
    now.budgets(budgets);
    checked.compare(&now, &then, "budgets", None, Extent::All);
    Ok(checked)
}

impl Checked {
    fn fault(&mut self, text: impl Into<String>) {
        self.faults.push(text.into());
    }

    /// Holds what was found today against the record, for one part, of one thing or of all.
    fn compare(
        &mut self,
        now: &Record,
        then: &Record,
        part: &str,
        of: Option<&str>,
        extent: Extent,
    ) {
        let is_meant = |key: &&Key| key.part == part && of.is_none_or(|of| key.of == of);
        let name = of.map_or(part.to_string(), |of| format!("{part} of {of}"));
        let mut common = 0;
        for key in now.0.keys().filter(is_meant) {
            let value = &now.0[key];
            match then.0.get(key) {
                Some(known) if is_same(key, value, known) => common += 1,
                Some(known) => {
                    common += 1;
                    self.differs(key, value, known);
                }
                None if extent == Extent::All => self.differs(key, value, "nothing"),
                None => {}
            }
        }
        if extent == Extent::All {
            for key in then.0.keys().filter(is_meant).filter(|key| !now.0.contains_key(key)) {
                self.differs(key, "nothing", &then.0[key]);
            }
        }
        self.looked_at.push(format!("{name}: {common} numbers"));
        if common == 0 {
            self.fault(format!("{name}: the record has none of it; run `cargo xtask audit` again"));
        }
    }

    fn differs(&mut self, key: &Key, now: &str, then: &str) {
        let Key { part, of, what } = key;
        self.fault(format!(
            "{part} of {of}, {what}: {now}, the record says {then}; run `cargo xtask audit` again"
        ));
    }
}

fn is_same(key: &Key, now: &str, then: &str) -> bool {
    let bytes = |text: &str| text.parse::<u64>().ok();
    match (key.what == CONSTANTS, bytes(now), bytes(then)) {
        (true, Some(now), Some(then)) => now.abs_diff(then) <= MOST_PADDING,
        _ => now == then,
    }
}

impl Check<'_> {
    /// Images and their plans; what there may be budgets for.
    fn images(&mut self, watcher: &mut dyn Watcher) -> Result<Measured, Error> {
        let folder = firmware::folder(self.root);
        let report = folder.join("report.json");
        if !report.exists() {
            let images = Firmware::audited(self.root, firmware::Extent::One);
            let broken = images.run(&mut |line| watcher.line(line))?.broken;
            self.checked.faults.extend(broken);
        }
        let emulation = Emulation::read(&report)?;
        let mut measured = summary::of_emulation(&emulation);
        // Others have no pages: LEON3, for one.
        for target in emulation.targets.iter().filter(|t| memory::images().any(|of| of == t.target))
        {
            let name = &target.target;
            let image = ImageMemory::read(&folder, name)?;
            measured.extend(image.measured());
            let known = self.then.get(INSTRUCTIONS, name, TOOLCHAIN).unwrap_or("none");
            if known != target.toolchain {
                let line =
                    format!("{name}: {}, the record has {known}: budgets alone", target.toolchain);
                self.checked.looked_at.push(line);
                continue;
            }
            let mut now = Record::default();
            now.image(&image);
            now.plans(target);
            self.checked.compare(&now, &self.then, "memory", Some(name), Extent::All);
            self.checked.compare(&now, &self.then, INSTRUCTIONS, Some(name), Extent::Some);
        }
        Ok(measured)
    }

    fn loops(&mut self, watcher: &mut dyn Watcher) -> Result<(), Error> {
        let scenarios = observed_scenarios(self.root)?;
        let mut now = Record::default();
        now.loops(&Loops::observe(&scenarios, &Mission::default(), self.jobs, watcher.progress())?);
        self.checked.compare(&now, &self.then, "loops", None, Extent::All);
        Ok(())
    }

    /// The coarse map, but for its times.
    fn envelope(&mut self, watcher: &mut dyn Watcher) -> Result<(), Error> {
        let mut now = Record::default();
        now.envelope(&envelope(self.root, self.jobs, watcher.progress())?);
        self.checked.compare(&now, &self.then, "envelope", None, Extent::All);
        Ok(())
    }

    /// The first cases of the injection.
    fn injection(&mut self, watcher: &mut dyn Watcher) -> Result<(), Error> {
        let found = inject(Injection::FIRST as u64, self.jobs, self.alarm, watcher.progress())?;
        let mut now = Record::default();
        now.injection(&found);
        self.checked.compare(&now, &self.then, "injection", None, Extent::All);
        if !found.is_sound() {
            self.checked.fault("first injections: some are wrong, panicked or hung");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(rows: &[(&str, &str, &str)]) -> Record {
        let row = |(of, what, value): &(&str, &str, &str)| {
            let key = Key { part: "memory".into(), of: of.to_string(), what: what.to_string() };
            (key, value.to_string())
        };
        Record(rows.iter().map(row).collect())
    }

    fn faults(now: &Record, then: &Record, extent: Extent) -> Vec<String> {
        let mut checked = Checked::default();
        checked.compare(now, then, "memory", Some("m7"), extent);
        checked.faults
    }

    #[test]
    fn what_differs_is_named_with_both_values() {
        let now = record(&[("m7", "code", "12"), ("m7", CONSTANTS, "100"), ("a53", "code", "1")]);
        let then = record(&[("m7", "code", "10"), ("m7", CONSTANTS, "164"), ("a53", "code", "2")]);
        let found = faults(&now, &then, Extent::All);
        let expected =
            "memory of m7, code: 12, the record says 10; run `cargo xtask audit` again".to_string();
        assert_eq!(found, [expected]);
        let far = record(&[("m7", "code", "12"), ("m7", CONSTANTS, "165")]);
        assert!(faults(&now, &far, Extent::All)[0].contains("constants [bytes]: 100"));
    }

    #[test]
    fn rows_on_one_side_count_where_all_are_compared() {
        let now = record(&[("m7", "code", "1"), ("m7", "new", "2")]);
        let then = record(&[("m7", "code", "1"), ("m7", "old", "3")]);
        assert_eq!(faults(&now, &then, Extent::All).len(), 2);
        assert_eq!(faults(&now, &then, Extent::Some), [""; 0]);
        let none = faults(&now, &record(&[]), Extent::Some);
        assert!(none[0].contains("the record has none of it"), "{none:?}");
    }
}
