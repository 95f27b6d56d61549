//! TOML text into values, with the place of an error.

use super::json::check_format;
use super::strict::Strict;
use crate::error::FieldError;
use serde::de::DeserializeOwned;

/// Parses a text. Its `format`, if it has one, must be the one given.
///
/// # Errors
/// A syntax error, an unknown format or key, a value of the wrong type or an array of the wrong length: key, reason
/// and line.
pub fn parse<T: DeserializeOwned>(text: &str, format: Option<&str>) -> Result<T, FieldError> {
    let table: toml::Table =
        toml::from_str(text).map_err(|error| FieldError::new("", reason(&error, text)))?;
    if let (Some(found), Some(format)) = (table.get("format").and_then(toml::Value::as_str), format)
    {
        check_format(Some(found), format)?;
    }
    let reader = toml::Deserializer::parse(text)
        .map_err(|error| FieldError::new("", reason(&error, text)))?;
    serde_path_to_error::deserialize(Strict(reader)).map_err(|error| {
        let path = error.path().to_string();
        let path = if path == "." { String::new() } else { path };
        FieldError::new(path, reason(error.inner(), text))
    })
}

/// One-line text of an error.
fn reason(error: &toml::de::Error, text: &str) -> String {
    let said = error.message().trim_end().replace('\n', " ");
    let Some(span) = error.span() else { return said };
    let before = &text.as_bytes()[..span.start.min(text.len())];
    format!("{said} at line {}", 1 + before.iter().filter(|byte| **byte == b'\n').count())
}
