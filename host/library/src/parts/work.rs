//! Work that parts share out: it gives a row of columns for each of its numbers.

use crate::error::{Error, FieldError};
use crate::formats::{Column, Row};
use crate::journal::{Heading, Journal};
use crate::part::Part;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A plan as a part's journal keeps it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    /// Index of the scenario.
    pub(super) index: u64,
    /// The row.
    pub(super) row: Row,
    /// Values at each node, time first. None stands for a value that is not finite; only a plan that
    /// cannot be flown has one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) nodes: Vec<Vec<Option<f64>>>,
}

/// Work that is shared out: numbers `0..count`. Each gives one row on any machine and thread.
pub trait Work: Sync {
    /// State of a worker thread, such as a planner.
    type Worker: Default;
    /// Header of a part: all that its rows depend on, and which part it is.
    type Header: Heading;
    /// Result of a number, as a part's journal keeps it.
    type Kept: Serialize + DeserializeOwned + Send;
    /// Name of the numbers, in the plural.
    const COUNTED: &'static str;

    /// How many there are.
    fn count(&self) -> u64;

    /// The header of a part.
    fn header(&self, part: Part) -> Self::Header;

    /// Further entries of a part's rows and table, by key.
    fn entries(&self) -> Vec<(&'static str, String)>;

    /// Does a number.
    ///
    /// # Errors
    /// An error that ends all of the work.
    fn run(&self, worker: &mut Self::Worker, number: u64) -> Result<Self::Kept, Error>;

    /// The number that came to this.
    fn number(kept: &Self::Kept) -> u64;

    /// Whether it went well, as progress tells.
    fn is_well(kept: &Self::Kept) -> bool;

    /// Refuses what no number of a part can have come to.
    ///
    /// # Errors
    /// The field and what is wrong with it.
    fn check(&self, part: Part, kept: &Self::Kept) -> Result<(), FieldError>;

    /// The result that the part's rows keep, once its tables are written.
    fn lasting(kept: Self::Kept) -> Self::Kept {
        kept
    }

    /// The row.
    fn columns(&self, kept: &Self::Kept) -> Vec<Column>;

    /// Tables of a part beside that of its rows.
    fn beside(&self, table: &Path) -> Vec<PathBuf> {
        let _ = table;
        Vec::new()
    }

    /// Writes them from the journal's results at `places`; `entries` are those of the table of rows.
    ///
    /// # Errors
    /// A file that cannot be written.
    fn write_beside(
        &self,
        table: &Path,
        entries: &[(&'static str, String)],
        journal: &Journal<Self::Kept>,
        places: &[u64],
    ) -> Result<(), Error> {
        let _ = (table, entries, journal, places);
        Ok(())
    }
}
