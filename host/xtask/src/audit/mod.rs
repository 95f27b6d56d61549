//! The audit: evidence of memory, time, robustness and requirements for a review board.
//!
//! [`Audit::run`] measures one [`Section`] after the other and keeps what each found, typed, in one
//! file of numbers; all pages are made of that file, so that one part can be measured again without
//! the others. The file is an artefact: kept with the sources are the pages, and the [`record`] with
//! what [`check`] makes again and compares.
//!
//! [`profile`] measures times phase by phase on pinned cores and has a command of its own, as has the
//! fault injection, [`inject`](crate::inject).
//!
//! ```text
//! OUT/README.md, PAGE.md    pages, with their plots beside them
//! OUT/record.csv            all numbers, a row each; what a check compares, checksums of the pages
//! NUMBERS/audit.json        all numbers, each part with what it was measured by
//! NUMBERS/audit.html        the pages in one document that loads nothing
//! ```

pub mod budgets;
mod check;
pub mod emulation;
pub mod firmware;
pub mod image;
pub mod loops;
pub mod memory;
mod pages;
pub mod profile;
pub mod record;
pub mod requirements;
mod run;
pub mod section;
mod summary;

pub use check::{Checked, check, kept};
pub use run::{Audit, Audited, Watcher};
pub use section::Section;
pub use summary::{Bar, bar_table as summary_table};
