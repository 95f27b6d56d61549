//! Errors of the world: `*.errors.toml`.

use remora_host::error::{Error, FieldError};
use remora_host::formats::{Kind, Limit, as_text, toml_text};
use remora_truth::Errors;
use std::path::Path;

/// Comment at the head of an errors file.
const HEAD: &str = "\
# Errors of the world against what the planner believes: one standard deviation each, unless a key's
# documentation says otherwise (docs/guides/simulate.md). All of these values are assumed.

";

/// Errors by name or file: nothing given, `none`, `typical`, or a file.
///
/// # Errors
/// Errors of [`read`].
pub fn chosen(given: Option<&Path>, joints: usize) -> Result<Errors, Error> {
    let Some(given) = given else { return Ok(Errors::none()) };
    match given.to_str() {
        Some("none") => Ok(Errors::none()),
        Some("typical") => Ok(Errors::typical()),
        _ if !given.exists() => {
            let reason = "no such file or directory; the built-in names are none and typical";
            Err(Error::input(given, "", reason))
        }
        _ => read(given, joints),
    }
}

/// Reads a file. Every key must be there and none beside them.
///
/// # Errors
/// The file with the key that is wrong and why.
pub fn read(file: &Path, joints: usize) -> Result<Errors, Error> {
    Kind::Errors.read(file, Limit::TEXT, |bytes| parse(as_text(bytes)?, joints))
}

/// Parses a file's text.
///
/// # Errors
/// The key that is wrong and why.
pub fn parse(text: &str, joints: usize) -> Result<Errors, FieldError> {
    let errors: Errors = toml_text::parse(text, None)?;
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
