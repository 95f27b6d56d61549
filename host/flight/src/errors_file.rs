//! Errors of the world: `*.errors.toml`.

use remora_host::error::{Error, FieldError};
use remora_host::formats::{Limit, read_text};
use remora_truth::Errors;
use std::path::Path;

/// What an errors file says of itself at its head.
const HEAD: &str = "\
# Errors of the world against what the planner believes: one standard deviation each, unless a key's
# documentation says otherwise (docs/flights.md). All of these values are assumed.

";

/// Reads a file. Every key must be there and none beside them.
///
/// # Errors
/// The file with the key that is wrong and why.
pub fn read(file: &Path, joints: usize) -> Result<Errors, Error> {
    parse(&read_text(file, Limit::TEXT)?, joints).map_err(|error| error.at(file))
}

/// Parses a file's text.
///
/// # Errors
/// The key that is wrong and why.
pub fn parse(text: &str, joints: usize) -> Result<Errors, FieldError> {
    let from =
        toml::Deserializer::parse(text).map_err(|error| FieldError::new("", error.message()))?;
    let errors: Errors = serde_path_to_error::deserialize(from).map_err(|error| {
        let field = Some(error.path().to_string()).filter(|field| field != ".");
        FieldError::new(field.unwrap_or_default(), error.inner().message())
    })?;
    check(&errors, joints).map(|()| errors)
}

/// Refuses numbers that make no sense for an arm of `joints` joints.
pub(crate) fn check(errors: &Errors, joints: usize) -> Result<(), FieldError> {
    errors.check(joints).map_err(|fault| {
        FieldError::new(fault.key, format!("is {}: {}", fault.value, fault.wanted))
    })
}

/// A file's text.
///
/// # Errors
/// None that a sound value could have.
pub fn text(errors: &Errors) -> Result<String, Error> {
    let body = toml::to_string(errors)
        .map_err(|error| Error::Thread { reason: format!("errors as a file: {error}") })?;
    Ok(format!("{HEAD}{body}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(change: impl Fn(String) -> String) -> (String, String) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.errors.toml");
        std::fs::write(&file, change(text(&Errors::typical()).unwrap())).unwrap();
        match read(&file, 3).unwrap_err() {
            Error::Input { field, reason, .. } => (field, reason),
            other => panic!("{other}"),
        }
    }

    #[test]
    fn errors_survive_a_round_trip() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.errors.toml");
        for errors in [Errors::typical(), Errors::none()] {
            std::fs::write(&file, text(&errors).unwrap()).unwrap();
            assert_eq!(read(&file, 3).unwrap(), errors);
        }
    }

    #[test]
    fn each_kind_of_nonsense_is_named() {
        let (field, reason) = refused(|text| text.replace("[tumble]", "[tumble]\nrat = 1.0"));
        assert!(field.contains("tumble") && reason.contains("rat"), "{field}: {reason}");
        let (field, reason) = refused(|text| text.replace("attitude_rad = ", "attitude = "));
        assert!(field.contains("tumble") && reason.contains("attitude"), "{field}: {reason}");
        let (field, _) = refused(|text| text.replace("[mass]\nmass = 0.03", "[mass]\nmass = -1.0"));
        assert_eq!(field, "mass.mass");
        let (_, reason) = refused(|text| text.replace("[mass]", "[mass"));
        assert!(!reason.is_empty());
    }
}
