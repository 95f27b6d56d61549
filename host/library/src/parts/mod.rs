//! Campaigns in parts, for many machines: each part is made by a program of its own, whole or not at all, and
//! says what it was made from; gathered, they are one campaign.
//!
//! ```text
//! DIR/part-00017-of-01000.parquet          rows of its scenarios, in their order, when all are there
//! DIR/part-00017-of-01000.journal.jsonl    until then: what was asked for, then a line a finished row
//! DIR/nodes-part-00017-of-01000.parquet    with nodes: a row a node
//! DIR/summary.json                         statistics over all rows, by whoever gathers
//! ```
//!
//! Memory holds a few thousand rows at a time, whatever the size of a part.

mod gather;
mod header;
mod job;
mod make;
mod recompute;
mod scenarios;
mod write;

pub use gather::{Gathered, gather};
pub use header::{Header, KEY};
pub use job::Job;
pub use make::{Made, make};
pub use recompute::{Difference, recompute};
pub use scenarios::Scenarios;

/// What a part keeps the arguments under that it was made with, as an array in JSON.
pub const COMMAND: &str = "remora.command";
/// What a part keeps the checksum of all its rows under.
const CHECKSUM: &str = "remora.checksum";
/// Folder-free start of the names of tables of nodes.
const NODES: &str = "nodes-";
