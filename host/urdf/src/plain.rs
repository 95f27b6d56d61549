//! The tags of a text as `urdfdom` reads them: comments, text, declarations and prefixes mean nothing.
//!
//! A URDF holds all its data in elements and attributes without prefix. A strict parser fails on faults in other
//! parts, so it gets only the tags. Blanks replace the rest, so that places in messages stay.

use crate::fault::{Fault, MAX_ATTRIBUTES, MAX_DEPTH};

/// Begin and end of the parts that are dropped, and their names in messages.
const DROPPED: [(&str, &str, &str); 3] = [
    ("<!--", "-->", "a comment"),
    ("<![CDATA[", "]]>", "a CDATA section"),
    ("<?", "?>", "a processing instruction"),
];

/// References to characters that each parser knows.
const REFERENCES: [&str; 5] = ["&lt;", "&gt;", "&amp;", "&quot;", "&apos;"];

/// The tags of a text. Linear and without recursion: depth and attributes are limited before a parser sees them.
pub fn plain(text: &str) -> Result<String, Fault> {
    let (mut out, mut rest, mut depth) = (String::with_capacity(text.len()), text, 0_usize);
    while let Some(start) = rest.find('<') {
        blank(&rest[..start], &mut out);
        rest = &rest[start..];
        let length = if let Some(length) = dropped(rest)? {
            blank(&rest[..length], &mut out);
            length
        } else {
            let (length, attributes) = tag(rest);
            let whole = &rest[..length];
            if attributes > MAX_ATTRIBUTES {
                return Err(Fault::TooMany);
            }
            if whole.starts_with("</") {
                depth = depth.saturating_sub(1);
            } else if !whole.ends_with("/>") {
                depth += 1;
            }
            if depth > MAX_DEPTH {
                return Err(Fault::TooDeep);
            }
            write_tag(whole, &mut out);
            length
        };
        rest = &rest[length..];
    }
    Ok(out)
}

/// Blanks as long as the part left out.
fn blank(text: &str, out: &mut String) {
    out.extend(text.chars().map(|c| if c == '\n' { c } else { ' ' }));
}

/// Length of the part at the head of `text` that is not a tag.
fn dropped(text: &str) -> Result<Option<usize>, Fault> {
    let open = |what: &str| Fault::NotXml { reason: format!("{what} is not closed") };
    for (opening, end, what) in DROPPED {
        if let Some(inner) = text.strip_prefix(opening) {
            let at = inner.find(end).ok_or_else(|| open(what))?;
            return Ok(Some(opening.len() + at + end.len()));
        }
    }
    if text.starts_with("<!") {
        return declaration(text).map(Some);
    }
    Ok(None)
}

/// Length of a declaration, or of a whole DTD. Entities are refused: they could stand for anything.
fn declaration(text: &str) -> Result<usize, Fault> {
    let refused = |reason: &str| Fault::NotXml { reason: reason.to_owned() };
    let (mut at, mut depth, mut quote) = (0, 0_usize, None);
    let bytes = text.as_bytes();
    while let Some(byte) = bytes.get(at).copied() {
        let here = &bytes[at..];
        match (quote, byte) {
            (Some(open), _) => quote = Some(open).filter(|open| *open != byte),
            (None, b'"' | b'\'') => quote = Some(byte),
            (None, b'<') if here.starts_with(b"<!--") => {
                let end = text.get(at + 4..).and_then(|rest| rest.find("-->"));
                at += 4 + end.ok_or_else(|| refused("a comment is not closed"))? + 2;
            }
            (None, b'<') => {
                if here.get(..8).is_some_and(|head| head.eq_ignore_ascii_case(b"<!ENTITY")) {
                    return Err(refused("its DTD declares entities, which no URDF needs"));
                }
                depth += 1;
            }
            (None, b'>') => {
                depth = depth.saturating_sub(1);
                if depth == 0 {
                    return Ok(at + 1);
                }
            }
            _ => {}
        }
        at += 1;
    }
    Err(refused("a declaration is not closed"))
}

/// Length of the tag at the head of `text`, and how many values in quotes it has.
fn tag(text: &str) -> (usize, usize) {
    let (mut quote, mut values) = (None, 0);
    for (at, byte) in text.bytes().enumerate() {
        match (quote, byte) {
            (None, b'>') => return (at + 1, values),
            (None, b'"' | b'\'') => (quote, values) = (Some(byte), values + 1),
            (Some(open), _) if open == byte => quote = None,
            _ => {}
        }
    }
    (text.len(), values)
}

/// Writes a tag. A name with a prefix is another name, and a value may hold any character.
fn write_tag(tag: &str, out: &mut String) {
    let mut quote = None;
    for (at, c) in tag.char_indices() {
        match (quote, c) {
            (None, '"' | '\'') => {
                quote = Some(c);
                out.push(c);
            }
            (None, ':') if out.ends_with(char::is_alphanumeric) => out.push('.'),
            (None, ':') => out.push('_'),
            (None, _) => out.push(c),
            (Some(open), _) if c == open => {
                quote = None;
                out.push(c);
                let follows = tag[at + 1..].chars().next();
                if follows.is_some_and(|next| next.is_alphanumeric() || next == '_') {
                    out.push(' ');
                }
            }
            (Some(_), '<') => out.push_str("&lt;"),
            (Some(_), '&') if !is_reference(&tag[at..]) => out.push_str("&amp;"),
            (Some(_), _) => out.push(if is_character(c) { c } else { ' ' }),
        }
    }
}

/// Whether `text` begins with a reference to a character.
fn is_reference(text: &str) -> bool {
    if REFERENCES.iter().any(|known| text.starts_with(known)) {
        return true;
    }
    let Some(rest) = text.strip_prefix("&#") else { return false };
    // Searches no farther than the number: otherwise each search could run to the end of the text.
    let end = rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(rest.len());
    let (number, end) = rest.split_at(end);
    if !end.starts_with(';') {
        return false;
    }
    let code = match number.strip_prefix('x') {
        Some(digits) if digits.starts_with(|c: char| c.is_ascii_hexdigit()) => {
            u32::from_str_radix(digits, 16).ok()
        }
        None if number.starts_with(|c: char| c.is_ascii_digit()) => number.parse().ok(),
        _ => None,
    };
    code.and_then(char::from_u32).is_some_and(is_character)
}

/// Whether XML has this character.
fn is_character(c: char) -> bool {
    matches!(c, '\t' | '\n' | '\r' | ' '..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_tags_are_left_and_stay_in_their_lines() {
        let text = "<?xml?>\n<!-- a -- b --><a:b c:d='<&x;&amp;'e=''>text<![CDATA[<]]></a:b>\n<c/>";
        let tags = plain(text).unwrap();
        assert_eq!(
            tags.split_whitespace().collect::<Vec<_>>().join(" "),
            "<a.b c.d='&lt;&amp;x;&amp;' e=''> </a.b> <c/>"
        );
        assert_eq!(tags.find("\n<c/>").map(|at| tags[..at].matches('\n').count()), Some(1));
    }

    #[test]
    fn declarations_end_where_they_do_and_declare_no_entities() {
        let dtd = "<!DOCTYPE a [<!-- ' > <!ENTITY --><!ELEMENT a (b)*><!ATTLIST a c CDATA '>'>]>";
        assert_eq!(plain(&format!("{dtd}<a/>")).unwrap().trim(), "<a/>");
        for entity in ["<!ENTITY b 'c'>", "<!entity % b SYSTEM 'c'>"] {
            assert!(plain(&format!("<!DOCTYPE a [{entity}]><a/>")).is_err());
        }
        for open in ["<!DOCTYPE a [", "<!DOCTYPE a '>", "<!--->", "<![CDATA[", "<?x>"] {
            assert!(matches!(plain(open), Err(Fault::NotXml { .. })), "{open}");
        }
    }
}
