//! JSON text into values, with the place of what is wrong, and what a document says of itself: its `format`.

use super::strict::Strict;
use crate::error::FieldError;
use serde::Deserializer as _;
use serde::de::{Error as _, IgnoredAny, MapAccess, Visitor};
use std::borrow::Cow;
use std::fmt;

#[derive(serde::Deserialize)]
#[serde(expecting = "an object with a `format`")]
struct Header<'a> {
    #[serde(borrow)]
    format: Option<Cow<'a, str>>,
}

/// Reads an object up to its `format`: the rest may be long.
struct UpToFormat<'a>(&'a mut Option<String>);

impl<'de> Visitor<'de> for UpToFormat<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object with a `format`")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<(), A::Error> {
        while let Some(key) = entries.next_key::<Cow<'_, str>>()? {
            if key == "format" {
                *self.0 = entries.next_value()?;
                return Err(A::Error::custom("the rest is not looked at"));
            }
            entries.next_value::<IgnoredAny>()?;
        }
        Ok(())
    }
}

/// The `format` of a document, as far as it says one. What stands behind it is not looked at.
pub fn format_of(text: &str) -> Option<String> {
    let mut format = None;
    let mut reader = serde_json::Deserializer::from_str(text);
    let _ = reader.deserialize_map(UpToFormat(&mut format));
    format
}

/// Refuses a text that is no object of this `format`.
pub(super) fn check_header(text: &str, format: &str) -> Result<(), FieldError> {
    if text.trim_start().starts_with('[') {
        return Err(FieldError::new("", "expected an object, not an array"));
    }
    if let Some(found) = format_of(text) {
        return check_format(Some(&found), format);
    }
    // Parsing the header tells why no format was found.
    let header: Header<'_> = deserialize(text)?;
    check_format(header.format.as_deref(), format)
}

/// Refuses a `format` other than the one that is understood.
///
/// # Errors
/// The field, with both.
pub fn check_format(found: Option<&str>, expected: &str) -> Result<(), FieldError> {
    match found {
        Some(found) if found == expected => Ok(()),
        Some(found) => {
            let reason = format!("unknown format {found:?}: this reader understands {expected:?}");
            Err(FieldError::new("format", reason))
        }
        None => Err(FieldError::new("format", format!("missing; expected {expected:?}"))),
    }
}

/// Parses a text's outermost object, whose long arrays may be left as they are.
pub(super) fn deserialize<'a, T: serde::Deserialize<'a>>(text: &'a str) -> Result<T, FieldError> {
    deserialize_after("", text)
}

/// Parses a text that stands behind another.
pub(super) fn deserialize_after<'a, T: serde::Deserialize<'a>>(
    before: &str,
    text: &'a str,
) -> Result<T, FieldError> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let value = tracked(&mut <dyn erased_serde::Deserializer<'_>>::erase(&mut reader)).map_err(
        |error| {
            let path = error.path().to_string();
            // A syntax error leaves an unfinished path, which the line number replaces.
            let named = path != "." && !path.contains('?');
            let said = placed(error.inner().to_string(), before);
            FieldError::new(if named { path } else { String::new() }, said)
        },
    )?;
    reader.end().map_err(|error| FieldError::new("", error.to_string()))?;
    Ok(value)
}

/// Reads a value strictly; an error has its path. One reader for all formats: each type's code is compiled once.
pub(super) fn tracked<'a, T: serde::Deserialize<'a>>(
    reader: &mut dyn erased_serde::Deserializer<'a>,
) -> Result<T, serde_path_to_error::Error<erased_serde::Error>> {
    serde_path_to_error::deserialize(Strict(reader))
}

/// An error's words, with its place counted from the beginning of what stands before.
fn placed(said: String, before: &str) -> String {
    let place = said.rsplit_once(" at line ").and_then(|(words, place)| {
        let (line, column) = place.split_once(" column ")?;
        Some((words, line.parse::<usize>().ok()?, column.parse::<usize>().ok()?))
    });
    let Some((words, line, column)) = place else { return said };
    let begun = before.rfind('\n').map_or(0, |end| end + 1);
    let column = if line == 1 { column + before.len() - begun } else { column };
    format!("{words} at line {} column {column}", line + before.matches('\n').count())
}
