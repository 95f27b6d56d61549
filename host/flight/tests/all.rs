//! Tests of flights, one program.

mod common;

mod flights;
mod world;
