//! The audit: evidence of memory, time, robustness and requirements for a review board.
//!
//! [`Audit::run`] measures one [`Section`] after the other and keeps what each found, typed, in one
//! file of numbers; the page is made of that file, so that one part can be measured again without
//! the others. The file is an artefact: kept with the sources are the page, and the [`record`] with
//! what [`check`] makes again and compares.
//!
//! [`profile`] measures times phase by phase on pinned cores and has a command of its own, as has the
//! fault injection, [`inject`](crate::inject).
//!
//! ```text
//! OUT/results.md            the page, with its plots beside it
//! OUT/record.csv            all numbers, a row each; what a check compares, checksums of page and plots
//! NUMBERS/audit.json        all numbers, each part with what it was measured by
//! NUMBERS/audit.html        the page in one document that loads nothing
//! ```

pub mod budgets;
mod check;
pub mod emulation;
pub mod firmware;
pub mod image;
pub mod loops;
pub mod memory;
mod memory_page;
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
