//! Why a model or one of its predictions is refused.

/// Why a model file is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[repr(u32)]
pub enum ModelError {
    /// It does not begin as a model file does.
    Magic = 1,
    /// Another version of the format.
    Version = 2,
    /// The header cannot be read.
    Header = 3,
    /// Dimensions that contradict each other or are beyond their limits.
    Shape = 4,
    /// Fewer bytes than the header asks for.
    Missing = 5,
    /// More bytes than the header asks for.
    Trailing = 6,
    /// The checksum is wrong.
    Crc = 7,
    /// Its check has not come to its end.
    Unchecked = 8,
}

impl ModelError {
    /// Stable number of the reason.
    pub const fn code(self) -> u32 {
        self as u32
    }

    /// The reason in words.
    pub const fn reason(self) -> &'static str {
        match self {
            Self::Magic => "is not a model file",
            Self::Version => "has another format version",
            Self::Header => "has a header that cannot be read",
            Self::Shape => "has dimensions beyond the limits or in contradiction",
            Self::Missing => "is shorter than its header says",
            Self::Trailing => "is longer than its header says",
            Self::Crc => "has a wrong checksum",
            Self::Unchecked => "has not been checked to its end",
        }
    }
}

/// Why a network cannot be made or gives no action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[repr(u32)]
pub enum NetworkError {
    /// The model is larger than the memory.
    Memory = 101,
    /// The memory is for the other precision.
    Precision = 102,
    /// Features or actions of the wrong length.
    Length = 103,
    /// More nodes than the model knows.
    Nodes = 104,
    /// A feature is not finite.
    Input = 105,
    /// The action is not finite.
    Output = 106,
}

impl NetworkError {
    /// Stable number of the reason; none of [`ModelError`]'s.
    pub const fn code(self) -> u32 {
        self as u32
    }

    /// The reason in words.
    pub const fn reason(self) -> &'static str {
        match self {
            Self::Memory => "the model is larger than the memory set aside for it",
            Self::Precision => "the memory is for another precision",
            Self::Length => "features or actions of the wrong length",
            Self::Nodes => "more nodes than the model knows",
            Self::Input => "a feature is not finite",
            Self::Output => "the action is not finite",
        }
    }
}

impl core::fmt::Display for ModelError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.reason())
    }
}

impl core::fmt::Display for NetworkError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.reason())
    }
}

impl core::error::Error for ModelError {}
impl core::error::Error for NetworkError {}
