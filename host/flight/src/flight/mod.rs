//! One flight: a plan, a draw of errors, and what comes of it.

mod closed_loop;
mod outcome;
mod settings;

pub use closed_loop::Flight;
pub use outcome::{Ending, FlightOutcome, Moment};
pub use settings::{Controller, JointControl, Settings, Way};
