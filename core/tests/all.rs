//! Tests of the core, one program: the planner is compiled once for all of them.

mod dynamics_physics;
mod guidance;
mod retraction;
mod scp;
