//! Programs that tests share, how they are solved, and what an answer is judged by.
// Each test's binary has its own copy and uses a part of it.
#![allow(dead_code)]

pub mod edge;
pub mod kkt;
pub mod programs;
pub mod room;
pub mod unsound;
