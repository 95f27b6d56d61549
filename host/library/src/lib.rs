//! The operator's library around `remora-core`: it runs on a desktop, not in flight.
//!
//! The crate `remora-files` reads and writes its files and shows its numbers; its modules stand
//! here too. Data goes down this list, imports go up it:
//!
//! - [`stopwatch`]: wall and processor time side by side;
//! - [`backend`]: Clarabel behind the core's solver trait, and solvers that are watched;
//! - [`kkt`]: optimality of a subproblem's solution, by any solver;
//! - [`qp_file`]: subproblems as files for other solvers;
//! - [`vehicle`]: what follows from a mission's numbers, and whether it can end;
//! - [`importing`]: a mission for the arm of a URDF;
//! - [`draw`]: random scenarios, the same for a seed everywhere;
//! - [`memory`]: heaps and stacks for what is too large for a usual stack;
//! - [`threads`]: a second thread for one plan;
//! - [`lineage`]: trainings of a model, and the scenarios that must not evaluate it;
//! - [`learned`]: learned models, from files or built in; [`padded`]: for a build with room for more joints;
//! - [`request`]: how plans are asked for; [`settings`]: the core's settings for it;
//! - [`planning`]: from a scenario to a plan file, by the core's planner of the arm's size ([`engine`]);
//! - [`stoppable`]: a clock by which plans are stopped;
//! - [`approach`], [`episode`]: an approach after Stage 1, as a guess sees it and as a policy flies it;
//! - [`picture`]: a plan as a picture;
//! - [`export`]: the subproblems of a plan as files for other solvers;
//! - [`optimality`]: distance of a plan from a local optimum, whatever made it;
//! - [`checking`]: plan files against the core's independent verifier;
//! - [`allocations`]: how often the program asks for memory;
//! - [`fingerprint`], [`provenance`]: commit, compiler, models and machine of a report;
//! - [`progress`]: watchers of long work;
//! - [`interrupt`]: whether the program was asked to end;
//! - [`journal`], [`pool`]: work that resumes, on several threads; [`rows_file`]: what came of it;
//! - [`campaign`]: many scenarios over several threads, resumable, with statistics;
//! - [`part`], [`parts`]: one of many parts of the same work; campaigns in parts, gathered and planned again;
//! - [`envelope`]: where the planner works: maps over tumble rate, distance and horizon.
#![forbid(unsafe_code)]

pub mod allocations;
pub mod approach;
pub mod backend;
pub mod campaign;
pub mod checking;
pub mod draw;
pub mod engine;
pub mod envelope;
pub mod episode;
pub mod export;
pub mod fingerprint;
pub mod importing;
pub mod interrupt;
pub mod journal;
pub mod kkt;
pub mod learned;
pub mod lineage;
pub mod memory;
pub mod optimality;
pub mod padded;
pub mod part;
pub mod parts;
pub mod picture;
pub mod planning;
pub mod pool;
pub mod progress;
pub mod provenance;
pub mod qp_file;
pub mod request;
pub mod rows_file;
pub mod settings;
pub mod stoppable;
pub mod stopwatch;
pub mod threads;
pub mod vehicle;

pub use remora_files::{choice, error, formats, method, notes, report, statistics};
