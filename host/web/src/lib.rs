#![doc = include_str!("../README.md")]
//!
//! Data goes down this list, imports go up it:
//!
//! - `flown`: a flight as the page shows it;
//! - `page`: plans and flights as one page.
#![forbid(unsafe_code)]

mod flown;
mod page;

pub use flown::{FlightTrack, Instant};
pub use page::{MARK, PageError, Shown, page};
