//! Tests of the world, one program.

mod common;

mod actuators;
mod errors;
mod flight;
mod integrator;
mod multibody;
mod random;
mod target;
