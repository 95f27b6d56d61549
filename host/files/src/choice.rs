//! Choices by their names, as files spell them and a command line may.

/// One of a few things that have names.
pub trait Choice: Copy + Send + Sync + 'static {
    /// All of them, in the order in which a help text lists them.
    const ALL: &'static [Self];

    /// Its name.
    fn name(self) -> &'static str;

    /// Its description, in a line without a full stop.
    fn help(self) -> &'static str;

    /// The one of this name.
    fn of_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|choice| choice.name() == name)
    }
}
