#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

pub mod dop853;
pub mod rotation;

mod gravity;
mod orbit;
mod vehicle;

pub mod multibody;

mod target;

mod joints;
mod servicer;

mod errors;
mod random;
mod ticker;

mod setup;

mod dispersion;

mod view;

mod actuators;
mod sensors;

mod world;

mod conserved;
mod read_back;

pub use actuators::{Command, JointCommand};
pub use dispersion::Dispersion;
pub use errors::*;
pub use gravity::{EARTH_MU, Environment, Field, Oblateness};
pub use joints::{JointDrive, JointMode};
pub use orbit::{Orbit, Rtn, eccentricity};
pub use random::{Drift, Source, Stream};
pub use read_back::Quantity;
pub use sensors::{Measurement, Sample};
pub use servicer::{Axes, Held, Instant, ServicerState};
pub use setup::{Setup, Start};
pub use target::{Target, TargetState, Track};
pub use vehicle::{Body, Joint, Limits, Servo, Vehicle};
pub use view::View;
pub use world::{Contact, World, WorldError};
