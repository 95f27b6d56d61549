//! Writing files whole or not at all.

mod partial;
mod together;
mod write;

pub use partial::{remove_file, remove_partials, remove_partials_among, remove_partials_of};
pub use together::write_together;
pub use write::{check_writable, make_directory, write_as_it_comes, write_atomically, write_first};
