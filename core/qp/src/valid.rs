//! Values that have been looked at: what must be valid is a type.

use core::fmt;
use core::ops::Deref;

/// What can be in or out of its range.
pub trait Validate: Sized {
    /// What is wrong with it.
    type Error;

    /// Refuses what is out of its range.
    ///
    /// # Errors
    /// The first thing found wrong.
    fn validate(&self) -> Result<(), Self::Error>;

    /// The value as one that has been looked at.
    ///
    /// # Errors
    /// As [`Validate::validate`].
    fn validated(self) -> Result<Valid<Self>, Self::Error> {
        self.validate().map(|()| Valid(self))
    }
}

/// A value that [`Validate::validated`] has found in its range. It can be read, not changed: take a
/// copy out, change that and have it validated again.
///
/// ```
/// use remora_qp::{InteriorPointSettings, Validate};
///
/// let settings = InteriorPointSettings { max_iterations: 40, ..Default::default() }.validated()?;
/// assert_eq!(settings.max_iterations, 40);
/// let error = InteriorPointSettings { tolerance: -1.0, ..*settings }.validated().unwrap_err();
/// assert_eq!(error.to_string(), "tolerance must be positive");
/// # Ok::<(), remora_qp::InvalidSetting>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Valid<T>(T);

impl<T> Valid<T> {
    /// The value itself.
    pub fn into_inner(self) -> T {
        self.0
    }

    /// A constant that a test validates.
    #[doc(hidden)]
    pub const fn of_constant(value: T) -> Self {
        Self(value)
    }
}

impl<T> Deref for Valid<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

/// A setting out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InvalidSetting {
    /// Name of the setting.
    pub setting: &'static str,
    /// The range it must lie in.
    pub range: &'static str,
}

impl fmt::Display for InvalidSetting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} must be {}", self.setting, self.range)
    }
}

impl core::error::Error for InvalidSetting {}
