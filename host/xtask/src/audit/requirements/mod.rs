//! Requirements and what verifies them: `docs/requirements.csv` against tests and report pages.
//!
//! A reference is `FILE#TEST`, a test in Rust, JavaScript or Python whose comment says `Verifies ID`, or
//! `PAGE#HEADING/ROW`: rows of a table below a heading of a Markdown page, which say whether a
//! threshold was kept. Both ends are looked at: a requirement without a living reference is a
//! fault, and so is a test that names an id which does not exist. A requirement that is missed is
//! no fault where `docs/evidence/limitations.md` names it: it is shown as missed.

mod outcome;

pub use outcome::{RESULTS, Texts, page, split};

use outcome::{MISSES, is_page};
use remora_host::error::{Error, io_reason};
use remora_host::formats::{Limit, read_text};
use remora_host::report::Page;
use remora_host::report::page::document;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Where the requirements are kept, from the root of the checkout.
pub const FILE: &str = "docs/requirements.csv";

/// A row of the file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Requirement {
    /// `REM-AREA-NUMBER`, unique, never used again.
    pub id: String,
    /// The requirement, in words.
    pub text: String,
    /// Why.
    pub rationale: String,
    /// How it is verified.
    pub method: Method,
    /// References to what verifies it, separated by `;`.
    pub verified_by: String,
}

/// How a requirement is verified.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Method {
    /// By a test that can fail.
    Test,
    /// By an argument from measured or computed evidence.
    Analysis,
    /// By looking at the source.
    Inspection,
}

impl Requirement {
    /// `REM-AREA` and its number there.
    fn area_and_number(&self) -> (&str, &str) {
        self.id.rsplit_once('-').unwrap_or((&self.id, ""))
    }

    /// Files and names of what verifies it.
    pub fn references(&self) -> impl Iterator<Item = (&str, &str)> {
        let each = self.verified_by.split(';').map(str::trim);
        each.filter(|text| !text.is_empty()).map(|text| text.split_once('#').unwrap_or((text, "")))
    }
}

/// Reads the requirements of the checkout in `root`.
///
/// # Errors
/// A file that cannot be read; a row that is not one; an id used twice or of another form.
pub fn read(root: &Path) -> Result<Vec<Requirement>, Error> {
    let file = root.join(FILE);
    let text = read_text(&file, Limit::TEXT)?;
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let (mut rows, mut ids) = (Vec::new(), BTreeSet::new());
    for (number, row) in reader.deserialize().enumerate() {
        let field = format!("row {}", number + 1);
        let row: Requirement =
            row.map_err(|error| Error::input(&file, field.clone(), error.to_string()))?;
        if !is_id(&row.id) {
            let reason = format!("{:?} is not REM-AREA-NUMBER", row.id);
            return Err(Error::input(&file, field, reason));
        }
        if row.text.is_empty() || row.rationale.is_empty() {
            return Err(Error::input(&file, row.id, "needs a text and a rationale"));
        }
        if !ids.insert(row.id.clone()) {
            return Err(Error::input(&file, row.id, "used twice"));
        }
        rows.push(row);
    }
    Ok(rows)
}

fn is_id(text: &str) -> bool {
    let mut parts = text.split('-');
    let (tag, area, number) = (parts.next(), parts.next(), parts.next());
    let letters = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_uppercase());
    let digits = |text: &str| text.len() == 3 && text.bytes().all(|b| b.is_ascii_digit());
    tag == Some("REM")
        && area.is_some_and(letters)
        && number.is_some_and(digits)
        && parts.next().is_none()
}

/// Faults of the references of `requirements`, a line each.
///
/// # Errors
/// A folder of sources that cannot be read.
pub fn faults(root: &Path, requirements: &[Requirement]) -> Result<Vec<String>, Error> {
    let (sources, texts) = (Sources::read(root)?, texts(root, requirements));
    let mut faults = Vec::new();
    for requirement in requirements {
        let id = &requirement.id;
        if requirement.references().next().is_none() {
            faults.push(format!("{id}: nothing verifies it"));
        }
        for (file, name) in requirement.references() {
            let fault = match is_page(file) {
                true => texts.fault(file, name),
                false => sources.test_fault(file, name, id),
            };
            faults.extend(fault.map(|reason| format!("{id}: {file}#{name}: {reason}")));
        }
        faults.extend(texts.disagreement(requirement).map(|reason| format!("{id}: {reason}")));
    }
    let known = |id: &str| requirements.iter().any(|requirement| requirement.id == id);
    for (file, text) in &sources.files {
        for id in mentions(text).filter(|id| !known(id)) {
            faults.push(format!("{file}: names {id}, which is no requirement"));
        }
        for (test, id) in claims(text) {
            let back = |requirement: &Requirement| {
                requirement.id == id
                    && requirement.references().any(|reference| reference == (file, test))
            };
            if known(id) && !requirements.iter().any(back) {
                faults.push(format!("{id}: does not refer to {file}#{test}, which verifies it"));
            }
        }
    }
    Ok(faults)
}

/// The sources in which tests stand, by their path from the root.
struct Sources {
    files: BTreeMap<String, String>,
}

impl Sources {
    fn read(root: &Path) -> Result<Self, Error> {
        let mut files = BTreeMap::new();
        for folder in ["core", "host"] {
            gather(root, &root.join(folder), &mut files)?;
        }
        Ok(Self { files })
    }

    /// Why a test does not verify an id.
    fn test_fault(&self, file: &str, test: &str, id: &str) -> Option<String> {
        let Some(text) = self.files.get(file) else { return Some("no such source".into()) };
        let found = claims(text).any(|(name, claimed)| name == test && claimed == id);
        match found {
            true => None,
            false => Some("no such test, or its comment does not say that it verifies this".into()),
        }
    }
}

/// Extensions of sources in which tests stand.
const SOURCES: [&str; 3] = ["rs", "mjs", "py"];

fn gather(root: &Path, folder: &Path, files: &mut BTreeMap<String, String>) -> Result<(), Error> {
    let failed = |cause: std::io::Error| Error::input(folder, "", io_reason(&cause));
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.is_dir() && !path.ends_with("node_modules") {
            gather(root, &path, files)?;
        } else if path.extension().is_some_and(|of| SOURCES.iter().any(|source| of == *source)) {
            let name = path.strip_prefix(root).unwrap_or(&path).to_string_lossy();
            let name = name.replace('\\', "/");
            files.insert(name, std::fs::read_to_string(&path).map_err(failed)?);
        }
    }
    Ok(())
}

/// The pages that requirements refer to, as they are in the checkout; those that cannot be read are
/// not there.
pub fn texts(root: &Path, requirements: &[Requirement]) -> Texts {
    let referred = requirements.iter().flat_map(Requirement::references).map(|(file, _)| file);
    let pages = referred.filter(|file| is_page(file)).chain([MISSES]);
    let read = |page: &str| {
        let text = std::fs::read_to_string(root.join(page)).ok()?;
        Some((page.to_string(), text))
    };
    Texts(pages.filter_map(read).collect())
}

impl Texts {
    /// Puts sections of the audit's page that have just been made in the place of that page.
    pub fn with_pages(mut self, pages: &[Page]) -> Self {
        self.0.insert(PAGE.into(), document(pages));
        self
    }
}

/// The audit's page, from the root.
const PAGE: &str = "docs/evidence/results.md";

/// The ids in a line that is the comment by which a test claims to verify something.
fn claimed(line: &str) -> Option<impl Iterator<Item = &str>> {
    let marks = ["// Verifies ", "# Verifies "];
    let list = marks.iter().find_map(|mark| line.trim().strip_prefix(mark))?;
    Some(list.split([',', '.', ' ']).filter(|word| word.starts_with("REM-")))
}

/// All such ids.
fn mentions(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(claimed).flatten()
}

/// Tests and the ids that they claim to verify.
fn claims(text: &str) -> impl Iterator<Item = (&str, &str)> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let mut claims = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let Some(ids) = claimed(line) else { continue };
        // Attributes and comments may stand between the claim and the function.
        let found = lines[i..].iter().enumerate();
        let found = found.filter_map(|(at, line)| Some((at, function(line)?))).next();
        let Some((at, (name, is_test))) = found else { continue };
        if is_test || lines[i..i + at].contains(&"#[test]") {
            claims.extend(ids.map(|id| (name, id)));
        }
    }
    claims.into_iter()
}

/// The function that begins on a line, and whether it is a test without an attribute that says so.
fn function(line: &str) -> Option<(&str, bool)> {
    if let Some(script) = line.strip_prefix("test(\"") {
        return Some((script.split('"').next()?, true));
    }
    if let Some(python) = line.strip_prefix("def ") {
        let name = python.split('(').next()?;
        return Some((name, name.starts_with("test_")));
    }
    let name = line.strip_prefix("fn ")?.split(['(', '<']).next()?;
    // A program of its own without the harness is a test as a whole.
    Some((name, name == "main"))
}

#[cfg(test)]
mod tests {
    use super::outcome::Outcome;
    use super::*;
    use remora_host::report::Table;
    use std::fs;

    const HEAD: &str = "id,text,rationale,method,verified_by\n";

    /// A checkout with these requirements and a test source.
    fn checkout(rows: &str, source: &str) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        for folder in ["core", "host/tests", "docs/evidence"] {
            fs::create_dir_all(dir.path().join(folder)).unwrap();
        }
        fs::write(dir.path().join(FILE), format!("{HEAD}{rows}")).unwrap();
        fs::write(dir.path().join("host/tests/a.rs"), source).unwrap();
        let page = "# Results\n\n## Stack\n\n| a | 1 | met |\n| b | 2 | MISSED |\n";
        fs::write(dir.path().join(PAGE), page).unwrap();
        fs::write(dir.path().join(MISSES), "| of REM-F-006 | 3 | 4 |\n").unwrap();
        dir
    }

    fn faults_of(rows: &str, source: &str) -> Vec<String> {
        let dir = checkout(rows, source);
        faults(dir.path(), &read(dir.path()).unwrap()).unwrap()
    }

    const SOUND: &str = "// Verifies REM-A-001, REM-B-002.\n#[test]\nfn works() {}\n";

    #[test]
    fn living_references_are_no_fault() {
        let rows = "REM-A-001,t,r,Test,host/tests/a.rs#works; docs/evidence/results.md#Stack/a\n\
            REM-B-002,t,r,Analysis,host/tests/a.rs#works\n";
        assert_eq!(faults_of(rows, SOUND), [""; 0]);
        let dir = checkout(rows, SOUND);
        let rows = read(dir.path()).unwrap();
        let page = page(&rows, &texts(dir.path(), &rows)).markdown();
        assert!(page.contains("2 requirements, 0 of them missed."), "{page}");
        assert!(page.contains("| REM-A | 001 |  |  |"), "{page}");
        assert!(page.contains("| REM-B |  | 002 |  |"), "{page}");
    }

    #[test]
    fn what_is_missed_is_said_in_both_places() {
        let rows = "REM-D-004,t,r,Test,docs/evidence/results.md#Stack\n\
            REM-E-005,t,r,Test,docs/evidence/results.md#Stack/a\n\
            REM-F-006,t,r,Test,docs/evidence/results.md#Stack/b\n\
            REM-G-007,t,r,Test,docs/evidence/results.md#Stack/none\n";
        let found = faults_of(rows, "");
        let expected = [
            "REM-D-004: is missed, and docs/evidence/limitations.md does not say so",
            "REM-G-007: docs/evidence/results.md#Stack/none: no row there says its outcome",
        ];
        assert_eq!(found, expected);
        let dir = checkout(rows, "");
        let rows = read(dir.path()).unwrap();
        let outcomes = texts(dir.path(), &rows);
        let page = page(&rows, &outcomes).markdown();
        let row = "| REM-F-006 | t | [Stack: b](#stack) |";
        assert!(page.contains(row) && page.contains("| REM-F |  |  | 006 |"), "{page}");
        let outcomes: Vec<_> = rows.iter().map(|row| outcomes.outcome(row)).collect();
        assert_eq!(outcomes[..3], [Outcome::Missed, Outcome::Met, Outcome::Missed]);
        let met = faults_of("REM-F-006,t,r,Test,docs/evidence/results.md#Stack/a\n", "");
        assert_eq!(met, ["REM-F-006: is met, and docs/evidence/limitations.md says otherwise"]);
        // Pages that have just been made count, not those of before.
        let mut page = Page::new("results", "Results");
        let mut table = Table::new(" | ");
        table.row(["b".into(), "met".into()]);
        page.heading("Stack").table(table);
        let made = texts(dir.path(), &rows).with_pages(&[page]);
        assert_eq!(made.disagreement(&rows[2]).unwrap(), met[0]["REM-F-006: ".len()..]);
    }

    #[test]
    fn each_dead_reference_is_named() {
        let rows = "REM-A-001,t,r,Test,host/tests/a.rs#gone\nREM-B-002,t,r,Test,\n\
            REM-C-003,t,r,Test,docs/evidence/results.md#Heap; docs/none.md#x; host/tests/b.rs#y\n";
        let found = faults_of(rows, SOUND).join("\n");
        for part in [
            "REM-A-001: host/tests/a.rs#gone: no such test",
            "REM-A-001: does not refer to host/tests/a.rs#works",
            "REM-B-002: nothing verifies it",
            "results.md#Heap: no such heading",
            "docs/none.md#x: no such page",
            "host/tests/b.rs#y: no such source",
        ] {
            assert!(found.contains(part), "{part}\n{found}");
        }
    }

    #[test]
    fn tests_in_other_languages_verify() {
        let dir = checkout(
            "REM-A-001,t,r,Test,host/tests/a.mjs#it works; host/tests/a.py#test_it\n\
             REM-B-002,t,r,Test,host/tests/a.py#helper\n",
            "",
        );
        let script = "// Verifies REM-A-001.\ntest(\"it works\", async () => {});\n";
        fs::write(dir.path().join("host/tests/a.mjs"), script).unwrap();
        let python = "# Verifies REM-A-001.\n@pytest.mark.parametrize(\"n\", [1])\ndef test_it(n: int):\n    \
                      pass\n\n\n# Verifies REM-B-002.\ndef helper() -> None:\n    pass\n";
        fs::write(dir.path().join("host/tests/a.py"), python).unwrap();
        let found = faults(dir.path(), &read(dir.path()).unwrap()).unwrap();
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].starts_with("REM-B-002: host/tests/a.py#helper: no such test"),
            "{found:?}"
        );
    }

    #[test]
    fn only_tests_verify() {
        let helper = "// Verifies REM-A-001.\nfn works() {}\n";
        let found = faults_of("REM-A-001,t,r,Test,host/tests/a.rs#works\n", helper);
        assert!(found[0].contains("no such test"), "{found:?}");
    }

    #[test]
    fn a_test_may_not_name_what_does_not_exist() {
        let rows = "REM-A-001,t,r,Test,host/tests/a.rs#works\n";
        let found = faults_of(rows, SOUND);
        assert_eq!(found, ["host/tests/a.rs: names REM-B-002, which is no requirement"]);
    }

    #[test]
    fn bad_rows_are_refused() {
        for (rows, reason) in [
            ("REM-A-001,t,r,Test,x#y\nREM-A-001,t,r,Test,x#y\n", "REM-A-001: used twice"),
            ("REM-A-1,t,r,Test,x#y\n", "row 1: \"REM-A-1\" is not REM-AREA-NUMBER"),
            ("REM-A-001,,r,Test,x#y\n", "REM-A-001: needs a text and a rationale"),
            ("REM-A-001,t,r,Belief,x#y\n", "row 1: "),
            ("REM-A-001,t,r\n", "row 1: "),
        ] {
            let error = read(checkout(rows, "").path()).unwrap_err().to_string();
            assert!(error.contains(reason), "{error}");
        }
    }
}
