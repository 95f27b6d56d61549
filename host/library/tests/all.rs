//! Tests of planning, one program: the planner is compiled once for all of them.

mod any_arm;
mod arms;
mod around;
mod fine;
mod golden;
mod horizons;
mod imported;
mod moving;
mod oracle_dynamics;
mod perturbation;
mod planner;
mod scp;
mod warmstart;
