//! The stage-structured program and its solvers: each against the optimality conditions, and one
//! against the other, on random, degenerate, broken and the mission's own programs.

mod again;
mod clarabel;
mod degenerate;
mod fewer;
mod limits;
mod mission;
mod programs;
mod random;
mod unsound;
