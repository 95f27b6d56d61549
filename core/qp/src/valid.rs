//! Validated values: a type says that a value was checked.

use core::fmt;
use core::ops::Deref;

/// A type whose values can be out of range.
pub trait Validate: Sized {
    /// Names what is wrong with a value.
    type Error;

    /// Checks every field against its range.
    ///
    /// # Errors
    /// The first field that is out of range.
    fn validate(&self) -> Result<(), Self::Error>;

    /// The value as a [`Valid`] one, where it is.
    ///
    /// # Errors
    /// As [`Validate::validate`].
    fn validated(self) -> Result<Valid<Self>, Self::Error> {
        self.validate().map(|()| Valid(self))
    }
}

/// A value that passed [`Validate::validated`]. It is read-only: to change it, copy it out and validate
/// the copy.
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

    /// Wraps a constant; a test validates it.
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

/// A setting that is out of its range.
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
