//! Work in parts, for many machines: each part is made by a program of its own, whole or not at all, and says
//! what it was made from; gathered, they are one. Campaigns are such work ([`Job`]), and flights elsewhere.
//!
//! ```text
//! DIR/part-00017-of-01000.journal.jsonl    what was asked for, then a line a finished row, until all are there
//! DIR/part-00017-of-01000.jsonl            from then on: rows of its scenarios, in their order, with checksums
//! DIR/part-00017-of-01000.parquet          the same as a table, for other programs
//! DIR/nodes-part-00017-of-01000.parquet    with nodes: a row a node
//! DIR/summary.json                         statistics over all rows, by whoever gathers
//! ```
//!
//! Memory holds a few thousand rows at a time, whatever the size of a part.

mod again;
mod gather;
mod header;
mod job;
mod make;
mod scenarios;
mod work;
mod write;

pub use again::{Difference, Sample, Then, again, differing, recompute};
pub use gather::{GatheredParts, gather};
pub use header::{KEY, PartHeader};
pub use job::Job;
pub use make::{PartSummary, make};
pub use scenarios::Scenarios;
pub use work::Work;
pub use write::Checksum;

/// Key of the arguments that a part was made with, an array in JSON.
pub const COMMAND: &str = "remora.command";
/// Key of the limits of a part's residuals, an array in JSON.
const TOLERANCES: &str = "remora.tolerances";
/// Key of a table's format.
const FORMAT: &str = "remora.format";
/// Folder-free start of the names of tables of nodes.
const NODES: &str = "nodes-";
/// Format of tables of nodes.
const NODES_FORMAT: &str = "remora-nodes/1";
