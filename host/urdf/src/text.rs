//! From bytes to an XML document that is safe to walk over, and the part of it that URDF defines.

use crate::fault::{Fault, MAX_BYTES, MAX_NODES, MAX_NUMBER};
use crate::plain::plain;
use roxmltree::{Document, Node, ParsingOptions};

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

/// The tags of a text, if parsers can read it.
pub fn checked(bytes: &[u8]) -> Result<String, Fault> {
    if bytes.len() > MAX_BYTES {
        return Err(Fault::TooLarge { bytes: bytes.len() });
    }
    let error = match std::str::from_utf8(bytes) {
        Ok(text) => return plain(text.strip_prefix('\u{feff}').unwrap_or(text)),
        Err(error) => error,
    };
    // Comments may be in any encoding.
    let tags = plain(&String::from_utf8_lossy(bytes))?;
    match tags.trim().is_empty() || tags.contains(char::REPLACEMENT_CHARACTER) {
        true => Err(Fault::NotUtf8 { at: error.valid_up_to() }),
        false => Ok(tags),
    }
}

/// The document of a URDF.
pub fn document(text: &str) -> Result<Document<'_>, Fault> {
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| match error {
        _ if text.contains("<xacro.") => Fault::Xacro,
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
    let prefix = |node: Node| -> Vec<String> {
        let declared = node.attributes().filter(|attribute| attribute.value().contains("xacro"));
        let prefix = |name: &str| name.strip_prefix("xmlns.").map(|prefix| format!("{prefix}."));
        declared.filter_map(|attribute| prefix(attribute.name())).collect()
    };
    let mut prefixes = prefix(root);
    prefixes.push("xacro.".to_owned());
    let is_element =
        |node: &Node| prefixes.iter().any(|prefix| node.tag_name().name().starts_with(prefix));
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

/// Reduces the robot to the elements and attributes that are read. Additions of other programs, and
/// what is there only to be looked at, then cannot make a parser stumble.
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
    let has_axis = !matches!(node.attribute("type"), Some("fixed" | "floating"));
    let is_read = |child: &Node| {
        let name = child.tag_name().name();
        inner.contains(&name) && (has_axis || name != "axis")
    };
    node.children().filter(is_read).for_each(|child| write(child, text));
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
