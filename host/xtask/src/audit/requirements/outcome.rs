//! Outcomes of requirements: verdicts in the tables of pages, and the section that shows them.
//!
//! A heading proves nothing. A reference to a page names rows of a table below a heading, and each
//! of them must say in a cell whether a threshold was kept.

use super::{FILE, PAGE, Requirement};
use remora_host::report::{Page, Table};
use std::collections::{BTreeMap, BTreeSet};

/// The page on which every missed requirement stands.
pub(super) const MISSES: &str = "docs/evidence/limitations.md";

/// Name of the audit's page, beside the record.
pub const RESULTS: &str = "results.md";

/// Title of its last section.
const TITLE: &str = "Requirements";

/// Splits the audit's page before its section of requirements, which follows from them alone.
pub fn split(page: &str) -> (&str, &str) {
    page.split_at(page.find(&format!("\n## {TITLE}\n")).unwrap_or(page.len()))
}

/// The name by which a heading is linked to.
fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect()
}

/// Content of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    Kept,
    Missed,
}

impl Verdict {
    /// The verdict that a cell is, where it is one.
    fn of(cell: &str) -> Option<Self> {
        let cell = cell.trim_matches('*').to_lowercase();
        match cell.split(';').next().unwrap_or_default() {
            "met" | "kept" | "proven" => Some(Self::Kept),
            "missed" | "broken" | "exceeded" | "not measured" => Some(Self::Missed),
            _ => None,
        }
    }
}

/// Texts of the pages that requirements refer to, by their paths.
#[derive(Clone, Debug, Default)]
pub struct Texts(pub(super) BTreeMap<String, String>);

/// Outcome of a requirement, as its page says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Every threshold that it refers to is kept.
    Met,
    /// It stands on the page of what was missed, or a threshold that it refers to is missed.
    Missed,
    /// Only tests verify it, which fail where it does not hold.
    Tested,
}

/// Whether a reference is to a page.
pub(super) fn is_page(file: &str) -> bool {
    file.ends_with(".md")
}

/// Heading and beginning of the rows that a reference to a page names.
fn place(name: &str) -> (&str, &str) {
    name.split_once('/').unwrap_or((name, ""))
}

/// The verdicts of rows below `heading` that begin with `row`; none where there is no heading.
fn verdicts(text: &str, name: &str) -> Option<Vec<Verdict>> {
    let (heading, row) = place(name);
    let title = |line: &str| line.trim_start_matches('#').trim().to_string();
    let mut lines = text.lines();
    lines.find(|line| line.starts_with('#') && title(line) == heading)?;
    let cells = |line: &str| -> Vec<String> {
        line.trim().trim_matches('|').split('|').map(|cell| cell.trim().to_string()).collect()
    };
    let rows = lines.take_while(|line| !line.starts_with('#')).filter(|line| line.starts_with('|'));
    let named = rows.map(cells).filter(|cells| cells.join(" ").starts_with(row));
    Some(named.filter_map(|cells| cells.iter().find_map(|cell| Verdict::of(cell))).collect())
}

impl Texts {
    /// Why a page does not verify what refers to it.
    pub(super) fn fault(&self, page: &str, name: &str) -> Option<String> {
        let Some(text) = self.0.get(page) else { return Some("no such page".into()) };
        match verdicts(text, name) {
            None => Some("no such heading".into()),
            Some(verdicts) if verdicts.is_empty() => Some("no row there says its outcome".into()),
            Some(_) => None,
        }
    }

    /// Whether a threshold that a requirement refers to is missed.
    fn misses(&self, requirement: &Requirement) -> bool {
        let verdicts = |(page, name)| self.0.get(page).and_then(|text| verdicts(text, name));
        let pages = requirement.references().filter(|(file, _)| is_page(file));
        pages.filter_map(verdicts).flatten().any(|verdict| verdict == Verdict::Missed)
    }

    /// Whether the page of what was missed names a requirement.
    fn is_told(&self, id: &str) -> bool {
        let text = self.0.get(MISSES).map_or("", String::as_str);
        text.lines().any(|line| line.starts_with('|') && line.contains(id))
    }

    /// Why the page of what was missed and the thresholds disagree on a requirement.
    pub(super) fn disagreement(&self, requirement: &Requirement) -> Option<String> {
        let by_pages = requirement.references().all(|(file, _)| is_page(file));
        match (self.misses(requirement), self.is_told(&requirement.id)) {
            (true, false) => Some(format!("is missed, and {MISSES} does not say so")),
            (false, true) if by_pages => Some(format!("is met, and {MISSES} says otherwise")),
            _ => None,
        }
    }

    pub(super) fn outcome(&self, requirement: &Requirement) -> Outcome {
        if self.misses(requirement) || self.is_told(&requirement.id) {
            return Outcome::Missed;
        }
        match requirement.references().any(|(file, _)| is_page(file)) {
            true => Outcome::Met,
            false => Outcome::Tested,
        }
    }
}

/// The section with the outcome of every requirement, by area, and those that are missed in full.
pub fn page(requirements: &[Requirement], texts: &Texts) -> Page {
    let mut page = Page::new("requirements", TITLE);
    let of =
        |outcome: Outcome| requirements.iter().filter(move |row| texts.outcome(row) == outcome);
    page.text(format!(
        "{} requirements, {} of them missed. `{FILE}` gives the reason for each and what verifies it. *Met* \
         means by rows of this page, *tested* by tests.",
        requirements.len(),
        of(Outcome::Missed).count()
    ));
    let outcomes = [Outcome::Met, Outcome::Tested, Outcome::Missed];
    let mut table = Table::new("area | met | tested | missed");
    let areas: BTreeSet<&str> = requirements.iter().map(|row| row.area_and_number().0).collect();
    for area in areas {
        let numbers = outcomes.map(|outcome| {
            let ids = of(outcome).map(Requirement::area_and_number);
            let numbers = ids.filter(|(of, _)| *of == area).map(|(_, number)| number);
            numbers.collect::<Vec<_>>().join(" ")
        });
        let [met, tested, missed] = numbers;
        table.row([area.into(), met, tested, missed]);
    }
    page.table(table);
    let mut missed = Table::new("id | requirement | verified by");
    for row in of(Outcome::Missed) {
        let by = row.references().map(|(file, name)| match file == PAGE {
            true => format!("[{}](#{})", name.replace('/', ": "), anchor(place(name).0)),
            false => format!("`{file}` {name}"),
        });
        let by = by.collect::<Vec<_>>().join("; ");
        missed.row([row.id.clone(), row.text.clone(), by]);
    }
    page.heading("Missed requirements").table(missed);
    page.text("[Limitations](limitations.md#missed-targets) tells what was measured instead.");
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "# Audit\n\n## Bars\n\n| | bar | seen | |\n| --- | --- | --- | --- |\n\
        | speed, a | >= 1.6 x | 1.5 x | MISSED |\n| speed, b | >= 1.6 x | 1.9 x | met |\n\
        | panics | 0 | 0 | met |\n\n## Budgets\n\n| host | code | kept; could be lowered | met |\n\
        ## None\n\n| a | b |\n";

    #[test]
    fn the_section_of_requirements_is_split_off() {
        let (above, section) = split("# Results\n\n## Loops\n\n## Requirements\n\n75.\n");
        assert_eq!((above, section), ("# Results\n\n## Loops\n", "\n## Requirements\n\n75.\n"));
        assert_eq!(split("# Results\n"), ("# Results\n", ""));
        assert_eq!(page(&[], &Texts::default()).section().find("\n## Requirements\n"), Some(0));
    }

    #[test]
    fn anchors_are_those_of_markdown() {
        assert_eq!(anchor("Whole plans [10^6], p99.9"), "whole-plans-106-p999");
    }

    #[test]
    fn rows_are_read_not_headings() {
        use Verdict::{Kept, Missed};
        let found = |name| verdicts(PAGE, name);
        assert_eq!(found("Bars/speed"), Some(vec![Missed, Kept]));
        assert_eq!(found("Bars/speed, b"), Some(vec![Kept]));
        assert_eq!(found("Budgets/host code"), Some(vec![Kept]));
        assert_eq!(found("Bars"), Some(vec![Missed, Kept, Kept]));
        assert_eq!(found("Bars/gone"), Some(vec![]));
        assert_eq!(found("None"), Some(vec![]));
        assert_eq!(found("Gone"), None);
    }
}
