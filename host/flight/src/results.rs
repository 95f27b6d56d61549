//! Flights that were flown.

use crate::row::{ErrorColumn, Row};
use crate::statistics::Summary;
use std::path::PathBuf;

/// Flights that were flown.
pub struct Results {
    /// A row a run, in their order.
    pub rows: Vec<Row>,
    /// Columns of the drawn quantities, in the order of the rows' numbers.
    pub drawn: Vec<ErrorColumn>,
    /// Statistics over them.
    pub summary: Summary,
    /// The files written at the end.
    pub files: Vec<PathBuf>,
}
