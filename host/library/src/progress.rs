//! Watchers of long work.

/// A watcher of scenarios being planned. `()` does not watch.
pub trait Progress {
    /// Work begins, with so many scenarios in all and so many of them done already.
    fn begin(&mut self, total: usize, done: usize);
    /// One more is done: solved or not.
    fn done(&mut self, is_solved: bool);
    /// No more come.
    fn end(&mut self);
}

impl Progress for () {
    fn begin(&mut self, _: usize, _: usize) {}
    fn done(&mut self, _: bool) {}
    fn end(&mut self) {}
}
