//! Making a part: doing what is not in its journal yet, then writing its tables and its rows.

use super::KEY;
use super::work::Work;
use super::write::write_rows;
use crate::error::Error;
use crate::formats::{check_writable, make_directory, remove_file, remove_partials_of};
use crate::journal::{Heading, Journal};
use crate::part::Part;
use crate::pool;
use crate::progress::Progress;
use crate::rows_file::{self, RowsFile};
use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A part that is complete.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct PartSummary {
    /// The part that was made.
    pub part: Part,
    /// Its rows.
    pub rows: u64,
    /// Rows that this run made.
    pub planned: u64,
    /// Files of it.
    pub files: Vec<PathBuf>,
}

/// Makes a part of the work in a directory that other programs may share; what an earlier run came to is
/// taken from it. Memory holds a place of eight bytes a row, and a few thousand rows.
///
/// # Errors
/// A directory or file that cannot be written; a part or journal of other work; another program that makes the
/// same part; [`Error::Interrupted`], which leaves a journal to go on with.
pub fn make<W: Work>(
    work: &W,
    part: Part,
    jobs: NonZeroUsize,
    out: &Path,
    progress: &mut dyn Progress,
) -> Result<PartSummary, Error> {
    part.check(work.count(), W::COUNTED)?;
    let making = PartMaker::new(work, part, out);
    if let Some(made) = making.there()? {
        making.sweep();
        return Ok(made);
    }
    make_directory(out)?;
    making.files.iter().try_for_each(|file| check_writable(file))?;
    making.go_on(jobs, progress)
}

/// Where in the journal each row of a part stands, if it is there.
type Places = Vec<Option<u64>>;

/// A part that is made.
struct PartMaker<'a, W: Work> {
    work: &'a W,
    part: Part,
    header: W::Header,
    range: Range<u64>,
    /// The rows, which are there when all files are.
    rows: PathBuf,
    table: PathBuf,
    /// The rows, their table and those beside it.
    files: Vec<PathBuf>,
    log: PathBuf,
}

impl<'a, W: Work> PartMaker<'a, W> {
    fn new(work: &'a W, part: Part, out: &Path) -> Self {
        let (header, range) = (work.header(part), part.range(work.count()));
        let (rows, table) = (part.rows(out), part.table(out));
        let files = [rows.clone(), table.clone()].into_iter().chain(work.beside(&table)).collect();
        let log = out.join(format!("{}.journal.jsonl", part.stem()));
        Self { work, part, header, range, rows, table, files, log }
    }

    /// The part, if it is there already.
    fn there(&self) -> Result<Option<PartSummary>, Error> {
        if !self.rows.exists() {
            return Ok(None);
        }
        check_same(&self.rows, &self.header)?;
        if let Some(gone) = self.files.iter().find(|file| !file.exists()) {
            let name = self.rows.file_name().unwrap_or_default().to_string_lossy();
            let reason = format!("no such file: remove {name} to make the part again");
            return Err(Error::input(gone, "", reason));
        }
        Ok(Some(self.made(0)))
    }

    fn made(&self, planned: u64) -> PartSummary {
        let rows = self.range.end - self.range.start;
        PartSummary { part: self.part, rows, planned, files: self.files.clone() }
    }

    /// Does what is not in the journal, whose lock keeps other programs from it, and writes the files.
    fn go_on(&self, jobs: NonZeroUsize, progress: &mut dyn Progress) -> Result<PartSummary, Error> {
        let (mut journal, mut places) = self.open()?;
        // Another program may have ended the part before this one had the lock.
        let there = self.there();
        if !matches!(there, Ok(None)) {
            let has_rows = places.iter().any(Option::is_some);
            if there.is_ok() || !has_rows {
                self.remove_journal()?;
            }
            return there.map(|made| made.unwrap_or_else(|| self.made(0)));
        }
        self.files.iter().for_each(|file| remove_partials_of(file));

        let planned = self.finish(jobs, &mut journal, &mut places, progress)?;
        let places: Vec<u64> = places.into_iter().flatten().collect();
        self.write(&journal, &places)?;
        // The rows say it all from now on.
        self.remove_journal()?;
        Ok(self.made(planned))
    }

    /// Writes the tables of what stands in the journal at `places`, then the rows.
    fn write(&self, journal: &Journal<W::Kept>, places: &[u64]) -> Result<(), Error> {
        let entries = self.work.entries();
        let said = serde_json::to_string(&self.header);
        let said = (KEY, said.map_err(|error| Error::output(&self.table, &error.into()))?);
        let of_table = entries.iter().cloned().chain([said]).collect::<Vec<_>>();
        self.work.write_beside(&self.table, &of_table, journal, places)?;
        write_rows(self.work, &self.table, of_table, journal, places)?;
        let entries = entries.into_iter().map(|(key, value)| (key.to_string(), value)).collect();
        let rows = places.iter().map(|place| journal.read(*place).map(W::lasting));
        rows_file::write(&self.rows, &self.header, &entries, &self.files[1..], rows)
    }

    /// Opens the journal and finds the places of its rows.
    fn open(&self) -> Result<(Journal<W::Kept>, Places), Error> {
        let rows = self.range.end - self.range.start;
        let mut places = vec![None; usize::try_from(rows).unwrap_or(usize::MAX)];
        let journal = Journal::open_each(&self.log, &self.header, &mut |place, kept: W::Kept| {
            self.work.check(self.part, &kept)?;
            places[self.at(W::number(&kept))] = Some(place);
            Ok(())
        })?;
        Ok((journal, places))
    }

    fn at(&self, number: u64) -> usize {
        usize::try_from(number - self.range.start).unwrap_or(usize::MAX)
    }

    /// Does the numbers that have no place yet; how many those are.
    fn finish(
        &self,
        jobs: NonZeroUsize,
        journal: &mut Journal<W::Kept>,
        places: &mut [Option<u64>],
        progress: &mut dyn Progress,
    ) -> Result<u64, Error> {
        let is_pending = |number: &u64| places[self.at(*number)].is_none();
        let pending: Vec<u64> = self.range.clone().filter(is_pending).collect();
        progress.begin(places.len(), places.len() - pending.len());
        let run = |worker: &mut W::Worker, number: u64| self.work.run(worker, number);
        let finish = |number: u64, kept: W::Kept| {
            progress.done(W::is_well(&kept));
            places[self.at(number)] = Some(journal.append_at(&kept)?);
            Ok(())
        };
        let outcome = pool::plan_all_with(jobs, &pending, |_| W::Worker::default(), run, finish);
        progress.end();
        if outcome.is_err() {
            journal.sync()?;
        }
        outcome.map(|()| pending.len() as u64)
    }

    /// Removes the journal of a part that is there: a program that was killed between the two has left it. One
    /// that another program holds, or of other work, stays.
    fn sweep(&self) {
        let opened = || Journal::<W::Kept>::open_each(&self.log, &self.header, &mut |_, _| Ok(()));
        if self.log.exists()
            && let Ok(_locked) = opened()
        {
            // A directory that cannot be written keeps it; the part is there all the same.
            let _ = self.remove_journal();
        }
    }

    fn remove_journal(&self) -> Result<(), Error> {
        remove_file(&self.log).map_err(|cause| Error::output(&self.log, &cause))
    }
}

/// Refuses a part that is there and is another's.
fn check_same<H: Heading>(rows: &Path, header: &H) -> Result<(), Error> {
    match header.difference(&RowsFile::<H>::open(rows)?.header) {
        Some((field, reason)) => Err(Error::input(rows, field, reason)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::FieldError;
    use crate::formats::{Cell, Column};
    use serde::{Deserialize, Serialize};

    /// Numbers with a word, as work.
    struct Words(&'static str);

    #[derive(Serialize, Deserialize)]
    struct Word(String);

    impl Heading for Word {
        const FORMAT: &'static str = "";
        const WORK: &'static str = "test";

        fn format(&self) -> &str {
            ""
        }

        fn difference(&self, begun: &Self) -> Option<(&'static str, String)> {
            (self.0 != begun.0).then(|| ("word", "another".into()))
        }
    }

    impl Work for Words {
        type Worker = ();
        type Header = Word;
        type Kept = u64;
        const COUNTED: &'static str = "numbers";

        fn count(&self) -> u64 {
            3
        }

        fn header(&self, _: Part) -> Word {
            Word(self.0.into())
        }

        fn entries(&self) -> Vec<(&'static str, String)> {
            Vec::new()
        }

        fn run(&self, _: &mut (), number: u64) -> Result<u64, Error> {
            Ok(number)
        }

        fn number(kept: &u64) -> u64 {
            *kept
        }

        fn is_well(_: &u64) -> bool {
            true
        }

        fn check(&self, _: Part, _: &u64) -> Result<(), FieldError> {
            Ok(())
        }

        fn columns(&self, kept: &u64) -> Vec<Column> {
            let cell = |text: &str| Cell::Text(text.into());
            let column = |name: &str, cell| Column { name: name.into(), unit: "", cell };
            vec![column("n", Cell::Integer(*kept as i64)), column("word", cell(self.0))]
        }
    }

    const PART: &str = "1/1";

    fn made(word: &'static str, out: &Path) -> Result<PartSummary, Error> {
        make(&Words(word), PART.parse().unwrap(), NonZeroUsize::MIN, out, &mut ())
    }

    /// A program that saw no part, and then had to wait for the journal.
    fn late(word: &'static str, out: &Path) -> Result<PartSummary, Error> {
        let words = Words(word);
        PartMaker::new(&words, PART.parse().unwrap(), out).go_on(NonZeroUsize::MIN, &mut ())
    }

    fn names(out: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(out).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<_> = names.collect();
        names.sort();
        names
    }

    // Verifies REM-CMP-001.
    #[test]
    fn a_part_that_another_program_ended_meanwhile_is_left_as_it_is() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(made("a", dir.path()).unwrap().planned, 3);
        let rows = Part::all(1).next().unwrap().rows(dir.path());
        let whole = std::fs::read(&rows).unwrap();
        let reason = late("b", dir.path()).unwrap_err().to_string();
        assert!(reason.ends_with("part-00001-of-00001.jsonl: word: another"), "{reason}");
        assert_eq!(late("a", dir.path()).unwrap().planned, 0);
        assert_eq!(std::fs::read(&rows).unwrap(), whole);
        let there = ["part-00001-of-00001.jsonl", "part-00001-of-00001.parquet"];
        assert_eq!(names(dir.path()), there);
    }

    /// A program that is killed after it wrote the rows leaves a journal.
    #[test]
    fn a_journal_beside_its_part_is_removed_and_no_others() {
        let dir = tempfile::tempdir().unwrap();
        made("a", dir.path()).unwrap();
        let log = dir.path().join("part-00001-of-00001.journal.jsonl");
        for line in ["", "\"a\"\n", "\"a\"\n0\n1\n2\n", "\"a\"\n0\n{"] {
            std::fs::write(&log, line).unwrap();
            assert_eq!(made("a", dir.path()).unwrap().planned, 0);
            assert!(!log.exists(), "{line}");
        }
        std::fs::write(&log, "\"b\"\n0\n").unwrap();
        made("a", dir.path()).unwrap();
        assert!(log.exists());
        // A journal that another program holds stays too.
        std::fs::write(&log, "\"a\"\n").unwrap();
        let held = std::fs::File::open(&log).unwrap();
        held.try_lock().unwrap();
        made("a", dir.path()).unwrap();
        assert!(log.exists());
    }
}
