//! From bytes to an XML document that is safe to walk over, and the part of it that URDF defines.

use crate::fault::Fault;
use roxmltree::{Document, Node, ParsingOptions};

/// Largest text [bytes].
pub const MAX_BYTES: usize = 4 << 20;
/// Deepest nesting of elements.
pub const MAX_DEPTH: usize = 64;
/// Most attributes of an element: what reads them compares each with all others.
pub const MAX_ATTRIBUTES: usize = 64;
/// Most nodes of the document.
pub const MAX_NODES: u32 = 50_000;
/// Largest magnitude of a number, in SI units.
pub const MAX_NUMBER: f64 = 1e9;

/// Elements that are read, and those inside each.
const ELEMENTS: [(&str, &[&str]); 6] = [
    ("robot", &["link", "joint"]),
    ("link", &["inertial", "collision"]),
    ("inertial", &["origin", "mass", "inertia"]),
    ("collision", &["origin", "geometry"]),
    ("geometry", &["box", "cylinder", "sphere", "capsule"]),
    ("joint", &["origin", "parent", "child", "axis"]),
];

/// Attributes that are read.
const ATTRIBUTES: [&str; 17] = [
    "name",
    "version",
    "type",
    "xyz",
    "rpy",
    "quat_xyzw",
    "value",
    "ixx",
    "ixy",
    "ixz",
    "iyy",
    "iyz",
    "izz",
    "link",
    "size",
    "radius",
    "length",
];

/// The text, if it is one that parsers can be given.
pub fn checked(bytes: &[u8]) -> Result<&str, Fault> {
    if bytes.len() > MAX_BYTES {
        return Err(Fault::TooLarge { bytes: bytes.len() });
    }
    let text = std::str::from_utf8(bytes).map_err(|e| Fault::NotUtf8 { at: e.valid_up_to() })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    scan(text)?;
    Ok(text)
}

/// Looks at depth and attributes without recursion and in linear time, before any parser does.
fn scan(text: &str) -> Result<(), Fault> {
    let mut depth = 0_usize;
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        let skipped = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>"), ("<!", ">")];
        if let Some((_, end)) = skipped.iter().find(|(opening, _)| rest.starts_with(opening)) {
            rest = after(rest, end);
            continue;
        }
        let (length, attributes) = tag(rest);
        if attributes > MAX_ATTRIBUTES {
            return Err(Fault::TooMany);
        }
        let whole = &rest[..length];
        if whole.starts_with("</") {
            depth = depth.saturating_sub(1);
        } else if !whole.ends_with("/>") {
            depth += 1;
        }
        if depth > MAX_DEPTH {
            return Err(Fault::TooDeep);
        }
        rest = &rest[length..];
    }
    Ok(())
}

/// What follows `end`.
fn after<'a>(text: &'a str, end: &str) -> &'a str {
    text.find(end).map_or("", |at| &text[at + end.len()..])
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

/// The document of a URDF.
pub fn document(text: &str) -> Result<Document<'_>, Fault> {
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| match error {
        _ if text.contains("<xacro:") => Fault::Xacro,
        roxmltree::Error::NodesLimitReached => Fault::TooMany,
        error => Fault::NotXml { reason: error.to_string() },
    })?;
    let root = document.root_element();
    match root.tag_name().name() {
        "robot" if is_xacro(root) => Err(Fault::Xacro),
        "robot" => Ok(document),
        "sdf" => Err(Fault::Sdf),
        name => Err(Fault::NotRobot { name: name.to_owned() }),
    }
}

/// Whether an element is one of xacro's, or an attribute one of its expressions.
fn is_xacro(root: Node) -> bool {
    let is_element = |node: &Node| {
        node.tag_name().namespace().is_some_and(|namespace| namespace.contains("xacro"))
    };
    let is_expression = |node: &Node| {
        node.attributes().any(|attribute| {
            let value = attribute.value();
            value.contains("${") || value.contains("$(")
        })
    };
    root.descendants().any(|node| is_element(&node) || (is_known(node) && is_expression(&node)))
}

/// Whether the node is an element that is read, by its own name.
fn is_known(node: Node) -> bool {
    ELEMENTS.iter().any(|(_, inner)| inner.contains(&node.tag_name().name()))
}

/// The same robot with only the elements and attributes that are read: what other programs add to
/// a URDF, and what is there only to be looked at, cannot make a parser stumble.
pub fn reduced(document: &Document) -> String {
    let mut text = String::new();
    write(document.root_element(), &mut text);
    text
}

/// Writes an element. It calls itself no deeper than `ELEMENTS` are nested.
fn write(node: Node, text: &mut String) {
    let name = node.tag_name().name();
    let inner =
        ELEMENTS.iter().find(|(outer, _)| *outer == name).map_or(&[][..], |(_, inner)| inner);
    // A collision shape of which nothing is read, a mesh, has no place here.
    if name == "collision" && !has_shape(node) {
        return;
    }
    *text += &format!("<{name}");
    for attribute in node.attributes().filter(|a| ATTRIBUTES.contains(&a.name())) {
        let value = sound(attribute.name(), attribute.value());
        *text += &format!(" {}=\"{}\"", attribute.name(), escaped(value));
    }
    for field in needed(name).iter().filter(|field| node.attribute(**field).is_none()) {
        *text += &format!(" {field}=\"{}\"", sound(field, ""));
    }
    *text += ">";
    for child in node.children().filter(|child| inner.contains(&child.tag_name().name())) {
        write(child, text);
    }
    *text += &format!("</{name}>");
}

/// Attributes that `urdf-rs` ends at if they are missing. That they are is a fault already, behind
/// which others shall be found.
fn needed(element: &str) -> &[&'static str] {
    match element {
        "mass" => &["value"],
        "inertia" => &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"],
        "axis" => &["xyz"],
        "box" => &["size"],
        "sphere" => &["radius"],
        "cylinder" | "capsule" => &["radius", "length"],
        _ => &[],
    }
}

/// The value of an attribute, or zeros if its numbers are a fault.
fn sound<'a>(attribute: &str, value: &'a str) -> &'a str {
    let (count, zeros) = match attribute {
        "name" | "version" | "type" | "link" => return value,
        "xyz" | "rpy" | "size" => (3, "0 0 0"),
        "quat_xyzw" => (4, "0 0 0 1"),
        _ => (1, "0"),
    };
    let numbers: Option<Vec<f64>> = value.split_whitespace().map(number).collect();
    if numbers.is_some_and(|numbers| numbers.len() == count) { value } else { zeros }
}

/// A finite number that is not huge.
pub fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|value: &f64| value.abs() <= MAX_NUMBER)
}

fn has_shape(collision: Node) -> bool {
    let shapes = ELEMENTS[4].1;
    let geometry = collision.children().find(|child| child.tag_name().name() == "geometry");
    geometry.is_some_and(|g| g.children().any(|child| shapes.contains(&child.tag_name().name())))
}

fn escaped(value: &str) -> String {
    let value = value.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    value.replace('"', "&quot;").replace('\'', "&apos;")
}
