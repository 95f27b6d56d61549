//! Budgets: what code, memory, stack and instructions may be, and whether they are.

use remora_host::error::Error;
use remora_host::formats::{Limit, read_text, toml_text};
use remora_host::report::{Align, Table};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

/// Where the budgets are kept, from the root of the checkout.
pub const FILE: &str = "ci/budgets.toml";

/// The format of the file.
const FORMAT: &str = "remora-budgets/1";

/// Of which target, and what. Quantities carry their unit: `code_bytes`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Quantity {
    /// The target's triple, or `host`.
    pub target: String,
    /// What is measured.
    pub name: String,
}

impl Quantity {
    /// A quantity of a target.
    pub fn new(target: &str, name: &str) -> Self {
        Self { target: target.into(), name: name.into() }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.target, self.name)
    }
}

/// What was measured.
pub type Measured = BTreeMap<Quantity, u64>;

/// A budget of the file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Budget {
    target: String,
    quantity: String,
    /// What it may be.
    budget: u64,
    /// By how much it may be more before that is a fault [% of the budget].
    margin_percent: f64,
    /// Why the budget is what it is: whoever changes it says so.
    why: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// Checked first.
    #[serde(rename = "format")]
    _format: String,
    #[serde(rename = "budget")]
    budgets: Vec<Budget>,
}

/// The budgets of a checkout.
#[derive(Clone, Debug, PartialEq)]
pub struct Budgets(Vec<Budget>);

/// What became of a budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Measured, and not above it by more than its margin.
    Kept,
    /// The same, but below it by more than its margin: it could be lowered.
    Loose,
    /// Above it by more than its margin.
    Exceeded,
    /// Its target was measured, and this was not.
    Missing,
    /// Its target was not measured.
    NotLookedAt,
}

impl Verdict {
    /// Whether the audit fails for it.
    pub fn is_fault(self) -> bool {
        matches!(self, Self::Exceeded | Self::Missing)
    }

    fn word(self) -> &'static str {
        match self {
            Self::Kept => "kept",
            Self::Loose => "kept; could be lowered",
            Self::Exceeded => "EXCEEDED",
            Self::Missing => "NOT MEASURED",
            Self::NotLookedAt => "-",
        }
    }
}

impl Budgets {
    /// Reads the budgets of the checkout in `root`.
    ///
    /// # Errors
    /// A file that cannot be read or is not one; a budget of zero, without a reason, given twice.
    pub fn read(root: &Path) -> Result<Self, Error> {
        let file = root.join(FILE);
        let text = read_text(&file, Limit::TEXT)?;
        let wrong = |field: String, reason: &str| Error::input(&file, field, reason);
        let parsed: File =
            toml_text::parse(&text, Some(FORMAT)).map_err(|error| error.at(&file))?;
        for (i, budget) in parsed.budgets.iter().enumerate() {
            let at = |field: &str| format!("budget[{i}].{field}");
            if budget.budget == 0 {
                return Err(wrong(at("budget"), "must be positive"));
            }
            // Written so that NaN fails.
            if !(budget.margin_percent >= 0.0 && budget.margin_percent <= 100.0) {
                return Err(wrong(at("margin_percent"), "must be from 0 to 100"));
            }
            if budget.why.trim().is_empty() {
                return Err(wrong(at("why"), "must say why the budget is what it is"));
            }
            let same = |other: &&Budget| {
                other.target == budget.target && other.quantity == budget.quantity
            };
            if parsed.budgets.iter().filter(same).count() > 1 {
                return Err(wrong(at("quantity"), "is budgeted twice"));
            }
        }
        Ok(Self(parsed.budgets))
    }

    /// What each quantity may be, in words.
    pub fn limits(&self) -> impl Iterator<Item = (Quantity, String)> {
        self.0.iter().map(|budget| {
            let limit = format!("{} + {} %", budget.budget, budget.margin_percent);
            (Quantity::new(&budget.target, &budget.quantity), limit)
        })
    }

    /// What became of each, in the file's order.
    pub fn judge(&self, measured: &Measured) -> Vec<Verdict> {
        let verdict = |budget: &Budget| {
            let quantity = Quantity::new(&budget.target, &budget.quantity);
            let margin = budget.budget as f64 * budget.margin_percent / 100.0;
            match measured.get(&quantity) {
                Some(value) if *value as f64 > budget.budget as f64 + margin => Verdict::Exceeded,
                // Without a margin it is a limit from elsewhere, and no measurement.
                Some(value) if margin > 0.0 && (*value as f64) < budget.budget as f64 - margin => {
                    Verdict::Loose
                }
                Some(_) => Verdict::Kept,
                None if measured.keys().any(|known| known.target == budget.target) => {
                    Verdict::Missing
                }
                None => Verdict::NotLookedAt,
            }
        };
        self.0.iter().map(verdict).collect()
    }

    /// The faults, a line each.
    pub fn faults(&self, measured: &Measured) -> Vec<String> {
        let judged = self.0.iter().zip(self.judge(measured));
        let fault = |(budget, verdict): (&Budget, Verdict)| {
            let quantity = Quantity::new(&budget.target, &budget.quantity);
            let seen = measured.get(&quantity).map_or("not measured".into(), u64::to_string);
            let Budget { budget, margin_percent, .. } = budget;
            verdict
                .is_fault()
                .then(|| format!("{quantity}: {seen}, budget {budget} + {margin_percent} %"))
        };
        judged.filter_map(fault).collect()
    }

    /// Budgets beside what was measured.
    pub fn table(&self, measured: &Measured) -> Table {
        let mut table = Table::new([
            ("target", Align::Left),
            ("quantity", Align::Left),
            ("measured", Align::Right),
            ("budget", Align::Right),
            ("margin", Align::Right),
            ("", Align::Left),
        ]);
        for (budget, verdict) in self.0.iter().zip(self.judge(measured)) {
            let seen = measured.get(&Quantity::new(&budget.target, &budget.quantity));
            table.row([
                budget.target.clone(),
                budget.quantity.clone(),
                seen.map_or("-".into(), u64::to_string),
                budget.budget.to_string(),
                format!("{} %", budget.margin_percent),
                verdict.word().into(),
            ]);
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: &str = "[[budget]]\ntarget = \"m7\"\nquantity = \"code_bytes\"\nbudget = 1000\n\
        margin_percent = 2\nwhy = \"measured\"\n";

    fn read(text: &str) -> Result<Budgets, Error> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("ci")).unwrap();
        std::fs::write(dir.path().join(FILE), text).unwrap();
        Budgets::read(dir.path())
    }

    fn budgets(rows: &str) -> Result<Budgets, Error> {
        read(&format!("format = \"remora-budgets/1\"\n{rows}"))
    }

    #[test]
    fn a_budget_is_kept_up_to_its_margin() {
        let budgets = budgets(ONE).unwrap();
        let judge = |value: u64| {
            let measured = Measured::from([(Quantity::new("m7", "code_bytes"), value)]);
            let verdict = budgets.judge(&measured)[0];
            assert_eq!(budgets.faults(&measured).is_empty(), !verdict.is_fault());
            verdict
        };
        assert_eq!(judge(1000), Verdict::Kept);
        assert_eq!(judge(1020), Verdict::Kept);
        assert_eq!(judge(1021), Verdict::Exceeded);
        assert_eq!(judge(980), Verdict::Kept);
        assert_eq!(judge(979), Verdict::Loose);
        let other = Measured::from([(Quantity::new("m7", "stack_bytes"), 1)]);
        assert_eq!(budgets.judge(&other), [Verdict::Missing]);
        assert_eq!(budgets.faults(&other), ["m7 code_bytes: not measured, budget 1000 + 2 %"]);
        assert_eq!(budgets.judge(&Measured::new()), [Verdict::NotLookedAt]);
        assert!(budgets.table(&other).to_string().contains("NOT MEASURED"));
    }

    #[test]
    fn bad_files_are_refused_by_field() {
        for (from, to, reason) in [
            ("budget = 1000", "budget = 0", "budget[0].budget: must be positive"),
            ("budget = 1000", "budget = -1", "invalid value"),
            ("\"measured\"", "\" \"", "budget[0].why: must say why"),
            ("margin_percent = 2", "margin_percent = nan", "margin_percent: must be from 0 to 100"),
            ("margin_percent", "margin", "unknown field"),
        ] {
            let error = budgets(&ONE.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(reason) && error.contains("budgets.toml"), "{error}");
        }
        let twice = budgets(&format!("{ONE}{ONE}")).unwrap_err().to_string();
        assert!(twice.contains("budget[0].quantity: is budgeted twice"), "{twice}");
        let format = read(&format!("format = \"remora-budgets/9\"\n{ONE}")).unwrap_err();
        assert!(format.to_string().contains("format: unknown format"), "{format}");
    }

    #[test]
    fn the_files_own_budgets_are_sound() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        assert!(!Budgets::read(&root).unwrap().0.is_empty());
    }
}
