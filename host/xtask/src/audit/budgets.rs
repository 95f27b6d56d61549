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

/// Quantity of a target. Names carry their unit: `code_bytes`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Quantity {
    /// The target's triple, or `host`.
    pub target: String,
    /// Name of the quantity.
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

/// Measured values by quantity.
pub type Measured = BTreeMap<Quantity, u64>;

/// A budget of the file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Budget {
    target: String,
    quantity: String,
    /// Budgeted value.
    budget: u64,
    /// Margin above the budget that is no fault yet [% of the budget].
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

/// Verdict on a budget; the worst is the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Its target was not measured.
    NotLookedAt,
    /// Measured, and not above it by more than its margin.
    Kept,
    /// Kept, and below it by more than its margin: it could be lowered.
    Loose,
    /// Its target was measured, and this was not.
    Missing,
    /// Above it by more than its margin.
    Exceeded,
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

    /// Limits of the quantities, in words.
    pub fn limits(&self) -> impl Iterator<Item = (Quantity, String)> {
        self.0.iter().map(|budget| {
            let limit = format!("{} + {} %", budget.budget, budget.margin_percent);
            (Quantity::new(&budget.target, &budget.quantity), limit)
        })
    }

    /// Verdicts on the budgets, in the file's order.
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

    /// Measured values and budgets: a row a quantity, a column a target, and the worst verdict.
    pub fn table(&self, measured: &Measured) -> Table {
        let (mut targets, mut names) = (Vec::new(), Vec::new());
        for budget in &self.0 {
            if !targets.contains(&&budget.target) {
                targets.push(&budget.target);
            }
            if !names.contains(&&budget.quantity) {
                names.push(&budget.quantity);
            }
        }
        let mut head = vec![("quantity".to_string(), Align::Left)];
        head.extend(targets.iter().map(|target| (target.to_string(), Align::Right)));
        head.push((String::new(), Align::Left));
        let mut table = Table::with_columns(head);
        let verdicts = self.judge(measured);
        for name in names {
            let judged =
                self.0.iter().zip(&verdicts).filter(|(budget, _)| budget.quantity == *name);
            let of_target = |target: &&String| {
                let budget = judged.clone().find(|(budget, _)| budget.target == **target);
                budget.map_or("-".into(), |(budget, _)| budget.beside(measured))
            };
            let cells: Vec<String> = targets.iter().map(of_target).collect();
            let worst = judged.clone().map(|(_, verdict)| *verdict).max();
            let word = worst.map_or("-", Verdict::word).to_string();
            table.push([name.clone()].into_iter().chain(cells).chain([word]).collect());
        }
        table
    }
}

impl Budget {
    /// The measured value and the budget.
    fn beside(&self, measured: &Measured) -> String {
        let seen = measured.get(&Quantity::new(&self.target, &self.quantity));
        format!("{}, {}", seen.map_or("-".into(), u64::to_string), self.budget)
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
    fn the_worst_verdict_of_all_targets_is_shown() {
        let second = ONE.replace("m7", "a53");
        let budgets = budgets(&format!("{ONE}{second}")).unwrap();
        let table = |m7: u64, a53: u64| {
            let value = |target: &str, value| (Quantity::new(target, "code_bytes"), value);
            budgets.table(&Measured::from([value("m7", m7), value("a53", a53)])).markdown()
        };
        let kept = table(1001, 1002);
        assert!(kept.starts_with("| quantity | m7 | a53 |  |\n"), "{kept}");
        assert!(kept.contains("| code_bytes | 1001, 1000 | 1002, 1000 | kept |"), "{kept}");
        assert!(table(1000, 9).contains("| kept; could be lowered |"));
        assert!(table(1021, 9).contains("| code_bytes | 1021, 1000 | 9, 1000 | EXCEEDED |"));
        let one = Measured::from([(Quantity::new("m7", "code_bytes"), 1000)]);
        assert!(
            budgets.table(&one).markdown().contains("| code_bytes | 1000, 1000 | -, 1000 | kept |")
        );
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
