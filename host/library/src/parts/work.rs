//! What parts are made of: work that comes to a row of columns for each of its numbers.

use crate::error::{Error, FieldError};
use crate::formats::Column;
use crate::journal::{Heading, Journal};
use crate::part::Part;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// Work that is shared out: numbers `0..count`, each of which comes to a row whoever does it, and on which thread.
pub trait Work: Sync {
    /// What a thread works with.
    type Worker: Default;
    /// What a part says of itself: all that its rows depend on, and which it is.
    type Header: Heading;
    /// What comes of a number, as a part's journal keeps it.
    type Kept: Serialize + DeserializeOwned + Send;
    /// What is counted, in the plural.
    const COUNTED: &'static str;

    /// How many there are.
    fn count(&self) -> u64;

    /// What a part says of itself.
    fn header(&self, part: Part) -> Self::Header;

    /// What rows and table of a part say besides, by its keys.
    fn entries(&self) -> Vec<(&'static str, String)>;

    /// Does a number.
    ///
    /// # Errors
    /// What ends all of the work.
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

    /// What stays of it in the part's rows, once its tables are written.
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

    /// Writes them, of what stands in the journal at `places`; `entries` are those of the table of rows.
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
