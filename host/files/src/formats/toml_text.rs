//! TOML text into values, with the place of an error.

use super::json::{check_format, tracked};
use crate::error::FieldError;
use serde::de::DeserializeOwned;
use serde_path_to_error::{Path, Segment};
use toml::de::{DeTable, DeValue};

/// Parses a text. Its `format`, if it has one, must be the one given.
///
/// # Errors
/// A syntax error, an unknown format or key, a value of the wrong type or an array of the wrong length: key, reason
/// and line.
pub fn parse<T: DeserializeOwned>(text: &str, format: Option<&str>) -> Result<T, FieldError> {
    let table = DeTable::parse(text).map_err(|error| FieldError::new("", reason(&error, text)))?;
    let found = table.get_ref().get("format").and_then(|value| value.get_ref().as_str());
    if let (Some(found), Some(format)) = (found, format) {
        check_format(Some(found), format)?;
    }
    let reader = toml::Deserializer::from(table);
    tracked(&mut <dyn erased_serde::Deserializer<'_>>::erase(reader)).map_err(|error| {
        let path = error.path().to_string();
        let path = if path == "." { String::new() } else { path };
        let said = error.inner().to_string();
        // The lines behind the words name keys that the path has.
        let words = said.lines().take_while(|line| !line.starts_with("in `"));
        let words = words.filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ");
        FieldError::new(path, format!("{words} at line {}", line_of(error.path(), text)))
    })
}

/// Writes a value as TOML.
///
/// # Errors
/// Where a type cannot be TOML; none of this project's is one.
pub fn to_text(value: &dyn erased_serde::Serialize) -> Result<String, toml::ser::Error> {
    toml::to_string(value)
}

/// One-line text of an error.
fn reason(error: &toml::de::Error, text: &str) -> String {
    let said = error.message().trim_end().replace('\n', " ");
    let Some(span) = error.span() else { return said };
    format!("{said} at line {}", line_at(span.start, text))
}

/// Line, from one, of the last value on a path that the text has.
fn line_of(path: &Path, text: &str) -> usize {
    let Ok(table) = DeTable::parse(text) else { return 1 };
    let mut start = table.span().start;
    let value = DeValue::Table(table.into_inner());
    let mut value = &value;
    for segment in path {
        let next = match segment {
            Segment::Map { key } => value.as_table().and_then(|table| table.get(key.as_str())),
            Segment::Seq { index } => value.as_array().and_then(|array| array.get(*index)),
            _ => None,
        };
        let Some(next) = next else { break };
        (start, value) = (next.span().start, next.get_ref());
    }
    line_at(start, text)
}

fn line_at(byte: usize, text: &str) -> usize {
    1 + text.bytes().take(byte).filter(|byte| *byte == b'\n').count()
}
