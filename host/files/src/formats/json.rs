//! Reading JSON with errors that name the field, and writing it a row a line.

use super::as_text;
use super::json_text::deserialize_after;
pub use super::json_text::{check_format, format_of};
pub(super) use super::json_text::{check_header, deserialize, tracked};
use super::strict::Strict;
use crate::error::FieldError;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use serde_json::ser::Formatter;
use serde_json::value::RawValue;
use std::io::{self, Write};

/// Parses a document whose `format` must be the one given.
///
/// # Errors
/// The first field that cannot be understood.
pub fn parse<T: DeserializeOwned>(text: &str, format: &str) -> Result<T, FieldError> {
    check_header(text, format)?;
    deserialize(text)
}

/// Parses a text that is one value, such as a line of a journal.
///
/// # Errors
/// The first field that cannot be understood.
pub fn parse_value<T: DeserializeOwned>(text: &[u8]) -> Result<T, FieldError> {
    let mut reader = serde_json::Deserializer::from_slice(text);
    match T::deserialize(Strict(&mut reader)).and_then(|value| reader.end().map(|()| value)) {
        Ok(value) => Ok(value),
        // Parses again for the path of the error. Tracking it takes time, and most lines are sound.
        Err(_) => deserialize(as_text(text)?),
    }
}

/// Converts a value of a document to its type.
///
/// # Errors
/// The first field that cannot be understood.
pub fn typed<T: DeserializeOwned>(value: &Value) -> Result<T, FieldError> {
    tracked(&mut <dyn erased_serde::Deserializer<'_>>::erase(value)).map_err(|error| {
        let path = Some(error.path().to_string()).filter(|path| path != ".");
        FieldError::new(path.unwrap_or_default(), error.inner().to_string())
    })
}

/// Parses one element of a long array, which is a part of `text`, so that the rest need not be held as
/// anything but text. `field` is its path.
///
/// # Errors
/// The first field that cannot be understood, with its place in the whole text.
pub(super) fn parse_element<T: DeserializeOwned>(
    text: &str,
    element: &RawValue,
    field: &str,
) -> Result<T, FieldError> {
    let part = element.get();
    let offset = (part.as_ptr() as usize).saturating_sub(text.as_ptr() as usize);
    let before = text.get(..offset).unwrap_or_default();
    let within = |error: FieldError| {
        let dot = if error.field.is_empty() || error.field.starts_with('[') { "" } else { "." };
        FieldError::new(format!("{field}{dot}{}", error.field), error.reason)
    };
    deserialize_after(before, part).map_err(within)
}

/// Serialises `value` with objects spread over lines and arrays of numbers on one line each.
///
/// Numbers are written with as many digits as it takes to read the same bits back; one that is
/// not finite becomes `null`, which readers refuse.
///
/// # Errors
/// Where a type cannot be JSON; none of this crate's is one.
pub fn to_text(value: &dyn erased_serde::Serialize) -> Result<String, serde_json::Error> {
    let mut bytes = Vec::new();
    let mut serializer = serde_json::Serializer::with_formatter(&mut bytes, Lines::default());
    value.serialize(&mut serializer)?;
    bytes.push(b'\n');
    String::from_utf8(bytes).map_err(serde::ser::Error::custom)
}

/// Objects a member a line; a container within an array begins a line; other array elements
/// follow each other.
#[derive(Default)]
struct Lines {
    open: Vec<Container>,
}

struct Container {
    is_array: bool,
    has_lines: bool,
}

impl Lines {
    fn line<W: ?Sized + Write>(&self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b"\n")?;
        self.open.iter().try_for_each(|_| writer.write_all(b"  "))
    }

    fn begin<W: ?Sized + Write>(&mut self, writer: &mut W, is_array: bool) -> io::Result<()> {
        let nested = self.open.last_mut().is_some_and(|outer| {
            outer.has_lines |= outer.is_array;
            outer.is_array
        });
        if nested {
            self.line(writer)?;
        }
        self.open.push(Container { is_array, has_lines: false });
        writer.write_all(if is_array { b"[" } else { b"{" })
    }

    fn end<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        let Some(closed) = self.open.pop() else { return Ok(()) };
        if closed.has_lines {
            self.line(writer)?;
        }
        writer.write_all(if closed.is_array { b"]" } else { b"}" })
    }
}

impl Formatter for Lines {
    fn begin_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.begin(writer, true)
    }

    fn end_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.end(writer)
    }

    fn begin_array_value<W: ?Sized + Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        writer.write_all(if first { b"" } else { b"," })
    }

    fn begin_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.begin(writer, false)
    }

    fn end_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.end(writer)
    }

    fn begin_object_key<W: ?Sized + Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        if !first {
            writer.write_all(b",")?;
        }
        if let Some(object) = self.open.last_mut() {
            object.has_lines = true;
        }
        self.line(writer)
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b": ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_lines() {
        let value = serde_json::json!({
            "a": [[1.5, 2], [3, 4]], "b": [{"c": 1}, {"c": []}], "d": "e", "f": {},
        });
        let text = to_text(&value).unwrap();
        let expected = "{\n  \"a\": [\n    [1.5,2],\n    [3,4]\n  ],\n  \"b\": [\n    {\n      \
                        \"c\": 1\n    },\n    {\n      \"c\": []\n    }\n  ],\n  \"d\": \"e\",\n  \
                        \"f\": {}\n}\n";
        assert_eq!(text, expected);
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), value);
    }

    #[test]
    fn numbers_come_back_bit_for_bit() {
        let numbers = [0.1, 1e-300, 5e-324, -0.0, 1.0 / 3.0, 6.02e23, f64::MAX];
        let text = to_text(&numbers).unwrap();
        let back: [f64; 7] = serde_json::from_str(&text).unwrap();
        assert_eq!(numbers.map(f64::to_bits), back.map(f64::to_bits));
    }

    #[test]
    fn the_format_is_judged_before_the_fields() {
        let parse = |text| parse::<Value>(text, "x/1").unwrap_err();
        assert_eq!(parse(r#"{"format": "x/2", "new": 1}"#).field, "format");
        assert!(parse(r#"{"new": 1}"#).reason.contains("missing"));
        assert!(parse(" [1]").reason.contains("expected an object"));
        assert!(parse("7").reason.contains("an object with a `format`"));
        assert!(parse("{").reason.contains("line 1"));
        assert!(parse(r#"{"format": "x/1"} 7"#).reason.contains("trailing"));
    }
}
