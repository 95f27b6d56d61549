//! Elements and numbers that a file really holds: `urdf-rs` answers zeros for missing ones, and ends at the
//! first fault. This looks at every element and number that is read, and collects what is wrong.

use crate::fault::{Fault, Place};
use crate::text::number;
use roxmltree::{Document, Node};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

/// Angles beyond this are probably degrees [rad].
pub const TWO_TURNS: f64 = 2.0 * TAU;

/// Kinds of joints, as URDF spells them.
const JOINT_TYPES: [&str; 7] =
    ["revolute", "continuous", "fixed", "prismatic", "planar", "floating", "spherical"];

const MOMENTS: [&str; 6] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];

/// The attributes of a `<limit>`, where they are written.
#[derive(Debug, Default)]
pub struct LimitText {
    pub lower: Option<String>,
    pub upper: Option<String>,
    pub velocity: Option<String>,
    pub effort: Option<String>,
}

/// The soft limits of a `<safety_controller>`, if given [rad, or m].
#[derive(Clone, Copy, Debug, Default)]
pub struct SoftLimits {
    pub lower: Option<f64>,
    pub upper: Option<f64>,
}

/// A `<mimic>`: this joint's angle is `multiplier` times the leader's, plus `offset`.
#[derive(Debug)]
pub struct Mimic {
    pub leader: String,
    pub multiplier: f64,
    pub offset: f64,
}

/// Contents that `urdf-rs` does not tell of.
#[derive(Debug, Default)]
pub struct Written {
    /// Links with an `<inertial>`.
    pub inertial: BTreeSet<String>,
    /// Most digits behind the point of a link's moments and products of inertia.
    pub decimals: BTreeMap<String, i32>,
    /// Angles of an origin that are more than two turns [rad].
    pub turned: Vec<(Place, f64)>,
    /// Collision meshes by link.
    pub meshes: BTreeMap<String, usize>,
    /// Joints with an `<axis>`.
    pub axis: BTreeSet<String>,
    /// Joints with a `<limit>`.
    pub limits: BTreeMap<String, LimitText>,
    /// Joints with soft limits.
    pub soft_limits: BTreeMap<String, SoftLimits>,
    /// Joints with a `<mimic>`.
    pub mimics: BTreeMap<String, Mimic>,
    /// Joints with damping or friction.
    pub dynamics: BTreeMap<String, (f64, f64)>,
}

/// Walks over the document.
pub fn look(document: &Document, faults: &mut Vec<Fault>) -> Written {
    let mut written = Written::default();
    for node in document.root_element().children().filter(Node::is_element) {
        let (element, place): (_, fn(String) -> Place) = match node.tag_name().name() {
            "link" => ("link", Place::Link),
            "joint" => ("joint", Place::Joint),
            _ => continue,
        };
        let Some(name) = node.attribute("name") else {
            faults.push(Fault::NoName { element });
            continue;
        };
        let look = Look { node, place: place(name.to_owned()) };
        if element == "link" {
            look.link(name, &mut written, faults);
        } else {
            look.joint(name, &mut written, faults);
        }
    }
    written
}

/// An element, and what it belongs to.
struct Look<'a, 'input> {
    node: Node<'a, 'input>,
    place: Place,
}

impl<'a, 'input> Look<'a, 'input> {
    fn link(&self, name: &str, written: &mut Written, faults: &mut Vec<Fault>) {
        if let Some(inertial) = self.child("inertial", faults) {
            written.inertial.insert(name.to_owned());
            inertial.origin(written, faults);
            if let Some(mass) = inertial.needed("mass", faults) {
                mass.number("value", faults);
            }
            if let Some(inertia) = inertial.needed("inertia", faults) {
                MOMENTS.iter().for_each(|moment| inertia.number(moment, faults));
                let texts = MOMENTS.iter().filter_map(|moment| inertia.node.attribute(*moment));
                let decimals = texts.map(decimals).max().unwrap_or(0);
                written.decimals.insert(name.to_owned(), decimals);
            }
        }
        for node in self.children("collision") {
            let collision = Look { node, place: self.place.clone() };
            collision.origin(written, faults);
            let Some(geometry) = collision.needed("geometry", faults) else { continue };
            match geometry.node.children().find(Node::is_element) {
                Some(node) if node.tag_name().name() == "mesh" => {
                    *written.meshes.entry(name.to_owned()).or_default() += 1;
                }
                Some(node) => Look { node, place: self.place.clone() }.shape(faults),
                None => faults.push(geometry.missing("box, cylinder, sphere, capsule or mesh")),
            }
        }
    }

    fn joint(&self, name: &str, written: &mut Written, faults: &mut Vec<Fault>) {
        match self.node.attribute("type") {
            None => faults.push(self.missing("type")),
            Some(kind) if JOINT_TYPES.contains(&kind) => {}
            Some(kind) => faults
                .push(Fault::JointType { place: self.place.clone(), written: kind.to_owned() }),
        }
        self.origin(written, faults);
        for end in ["parent", "child"] {
            let link = self.needed(end, faults);
            faults.extend(
                link.filter(|l| l.node.attribute("link").is_none()).map(|l| l.missing("link")),
            );
        }
        // A fixed joint has no other data in use, and programs write anything there.
        if self.node.attribute("type") != Some("fixed") {
            self.motion(name, written, faults);
        }
    }

    /// The elements of a joint that can move.
    fn motion(&self, name: &str, written: &mut Written, faults: &mut Vec<Fault>) {
        let kind = self.node.attribute("type");
        let axis = if kind == Some("floating") { None } else { self.child("axis", faults) };
        if let Some(axis) = axis {
            written.axis.insert(name.to_owned());
            let xyz = axis.numbers("xyz", 3, true, faults);
            let needs_axis = ["revolute", "continuous", "prismatic"];
            let is_needed = kind.is_some_and(|t| needs_axis.contains(&t));
            if is_needed && xyz.is_some_and(|xyz| xyz.iter().all(|x| *x == 0.0)) {
                faults.push(Fault::ZeroAxis { place: self.place.clone() });
            }
        }
        if let Some(limit) = self.child("limit", faults) {
            let text = |field: &str| limit.node.attribute(field).map(str::to_owned);
            let [lower, upper] = ["lower", "upper"].map(text);
            let [velocity, effort] = ["velocity", "effort"].map(text);
            written.limits.insert(name.to_owned(), LimitText { lower, upper, velocity, effort });
        }
        if let Some(safety) = self.child("safety_controller", faults) {
            let lower = safety.optional("soft_lower_limit", faults);
            let upper = safety.optional("soft_upper_limit", faults);
            written.soft_limits.insert(name.to_owned(), SoftLimits { lower, upper });
        }
        if let Some(mimic) = self.child("mimic", faults) {
            let multiplier = mimic.optional("multiplier", faults).unwrap_or(1.0);
            let offset = mimic.optional("offset", faults).unwrap_or(0.0);
            let leader = mimic.node.attribute("joint").unwrap_or_default().to_owned();
            written.mimics.insert(name.to_owned(), Mimic { leader, multiplier, offset });
        }
        if let Some(dynamics) = self.child("dynamics", faults) {
            let value = |field, faults: &mut _| dynamics.optional(field, faults).unwrap_or(0.0);
            let both = (value("damping", faults), value("friction", faults));
            if both != (0.0, 0.0) {
                written.dynamics.insert(name.to_owned(), both);
            }
        }
    }

    fn origin(&self, written: &mut Written, faults: &mut Vec<Fault>) {
        if let Some(origin) = self.child("origin", faults) {
            origin.numbers("xyz", 3, false, faults);
            let angles = origin.numbers("rpy", 3, false, faults).unwrap_or_default();
            let turned = angles.into_iter().filter(|angle| angle.abs() > TWO_TURNS);
            written.turned.extend(turned.map(|angle| (self.place.clone(), angle)));
            origin.numbers("quat_xyzw", 4, false, faults);
        }
    }

    fn shape(&self, faults: &mut Vec<Fault>) {
        let fields: &[(&str, usize)] = match self.node.tag_name().name() {
            "box" => &[("size", 3)],
            "sphere" => &[("radius", 1)],
            "cylinder" | "capsule" => &[("radius", 1), ("length", 1)],
            _ => return,
        };
        for (field, count) in fields {
            let values = self.numbers(field, *count, true, faults).unwrap_or_default();
            let negative = values.into_iter().find(|value| *value < 0.0);
            faults.extend(negative.map(|value| Fault::Negative {
                place: self.place.clone(),
                field: format!("{}/{field}", self.node.tag_name().name()),
                value,
            }));
        }
    }

    fn children(
        &self,
        name: &'static str,
    ) -> impl Iterator<Item = Node<'a, 'input>> + use<'a, 'input> {
        self.node.children().filter(move |child| child.tag_name().name() == name)
    }

    /// The one element of this name inside, if there is one.
    fn child(&self, name: &'static str, faults: &mut Vec<Fault>) -> Option<Self> {
        let mut found = self.children(name);
        let first = found.next();
        if found.next().is_some() {
            faults
                .push(Fault::WrittenTwice { place: self.place.clone(), element: name.to_owned() });
        }
        first.map(|node| Look { node, place: self.place.clone() })
    }

    fn needed(&self, name: &'static str, faults: &mut Vec<Fault>) -> Option<Self> {
        let found = self.child(name, faults);
        if found.is_none() {
            faults.push(self.missing(name));
        }
        found
    }

    fn missing(&self, field: &str) -> Fault {
        Fault::Missing { place: self.place.clone(), field: self.path(field) }
    }

    /// The name of a field, behind that of its element if that is inside a link or joint.
    fn path(&self, field: &str) -> String {
        match self.node.tag_name().name() {
            "link" | "joint" => field.to_owned(),
            element => format!("{element}/{field}"),
        }
    }

    fn number(&self, field: &str, faults: &mut Vec<Fault>) {
        self.numbers(field, 1, true, faults);
    }

    fn optional(&self, field: &str, faults: &mut Vec<Fault>) -> Option<f64> {
        self.numbers(field, 1, false, faults).and_then(|values| values.first().copied())
    }

    /// The numbers of an attribute; a fault if they are not as many, or none where one is needed.
    fn numbers(
        &self,
        field: &str,
        count: usize,
        is_needed: bool,
        faults: &mut Vec<Fault>,
    ) -> Option<Vec<f64>> {
        let Some(text) = self.node.attribute(field) else {
            faults.extend(is_needed.then(|| self.missing(field)));
            return None;
        };
        let values: Option<Vec<f64>> = text.split_whitespace().map(number).collect();
        let values = values.filter(|values| values.len() == count);
        if values.is_none() {
            faults.push(Fault::Number {
                place: self.place.clone(),
                field: self.path(field),
                written: text.chars().take(80).collect(),
                expects: ["", "one number", "", "three numbers", "four numbers"][count],
            });
        }
        values
    }
}

/// Digits behind the point of a number as it is written, its exponent counted in.
fn decimals(text: &str) -> i32 {
    let (mantissa, exponent) = text.trim().split_once(['e', 'E']).unwrap_or((text.trim(), "0"));
    let behind = mantissa.split_once('.').map_or(0, |(_, digits)| digits.len());
    i32::try_from(behind).unwrap_or(i32::MAX).saturating_sub(exponent.parse().unwrap_or(0))
}
