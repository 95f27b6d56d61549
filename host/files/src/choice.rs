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

/// Defines choices: each variant with its help as documentation, its name, and `default` behind the default.
#[doc(hidden)]
#[macro_export]
macro_rules! choices {
    (
        $(#[$about:meta])*
        $visibility:vis enum $type:ident {
            $($(#[doc = $help:literal])+ $variant:ident = $name:literal $($default:ident)?,)+
        }
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $visibility enum $type {
            $($(#[doc = $help])+ $(#[$default])? $variant,)+
        }

        impl $type {
            /// Its name, on the command line and in files.
            $visibility fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                }
            }
        }

        impl $crate::choice::Choice for $type {
            const ALL: &'static [Self] = &[$(Self::$variant,)+];

            fn name(self) -> &'static str {
                Self::name(self)
            }

            fn help(self) -> &'static str {
                match self {
                    $(Self::$variant => concat!($($help),+).trim().trim_end_matches('.'),)+
                }
            }
        }
    };
}
pub use choices;
