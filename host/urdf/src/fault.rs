//! Why a file is refused: each fault names the place, the numbers and what mends it.

use crate::options::MAX_ANGLE;
use std::fmt;
use thiserror::Error;

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

/// Where in a file.
#[derive(Clone, Debug, Eq, Ord, PartialEq, PartialOrd)]
pub enum Place {
    /// A link, by name.
    Link(String),
    /// A joint, by name.
    Joint(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Link(name) => write!(f, "link `{name}`"),
            Self::Joint(name) => write!(f, "joint `{name}`"),
        }
    }
}

/// Names in a message: at most so many are written out.
const MOST_NAMES: usize = 12;

fn list(names: &[String]) -> String {
    let shown: Vec<String> =
        names.iter().take(MOST_NAMES).map(|name| format!("`{name}`")).collect();
    let more = names.len().saturating_sub(MOST_NAMES);
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{rest}", shown.join(", "))
}

/// Flag that takes a link as a point; a link that a joint moves cannot be one.
fn or_point(link: &str, is_moved: bool) -> String {
    let flag = || format!("; or take it as a point with `--point-mass {link}`");
    if is_moved { String::new() } else { flag() }
}

/// One reason why a file gives no arm.
#[derive(Clone, Debug, Error, PartialEq)]
#[allow(missing_docs, reason = "the messages tell what the fields are")]
pub enum Fault {
    #[error("{bytes} bytes, more than {MAX_BYTES}: no URDF of an arm is that large")]
    TooLarge { bytes: usize },
    #[error("not UTF-8 from byte {at} on: a URDF is an XML text")]
    NotUtf8 { at: usize },
    #[error("elements are nested deeper than {MAX_DEPTH}: no URDF is")]
    TooDeep,
    #[error(
        "an element has more than {MAX_ATTRIBUTES} attributes, or the text more than {MAX_NODES} nodes: no URDF has"
    )]
    TooMany,
    #[error("not XML: {reason}")]
    NotXml { reason: String },
    #[error("a xacro, not yet a URDF: run `xacro FILE.xacro > arm.urdf` first")]
    Xacro,
    #[error(
        "an SDF, which is not read: convert it to a URDF first (ROS 2's sdformat_urdf does; `gz sdf -p` only prints SDF)"
    )]
    Sdf,
    #[error("the outermost element is <{name}>, that of a URDF is <robot>")]
    NotRobot { name: String },
    #[error("urdf-rs refuses it: {reason}")]
    Parser { reason: String },

    #[error("a <{element}> has no name")]
    NoName { element: &'static str },
    #[error("{place}: no `{field}` is written")]
    Missing { place: Place, field: String },
    #[error("{place}: <{element}> is written twice")]
    WrittenTwice { place: Place, element: String },
    #[error(
        "{place}: `{field}` is \"{written}\": expects {expects}, finite and within {MAX_NUMBER:e}"
    )]
    Number { place: Place, field: String, written: String, expects: &'static str },
    #[error("{place}: `{field}` is {value}: must not be negative")]
    Negative { place: Place, field: String, value: f64 },
    #[error(
        "{place}: type is \"{written}\": expects revolute, continuous, fixed, prismatic, planar or floating"
    )]
    JointType { place: Place, written: String },
    #[error("{place}: the axis is a zero vector")]
    ZeroAxis { place: Place },

    #[error("there is no link")]
    NoLinks,
    #[error("{place} is there twice")]
    DuplicateName { place: Place },
    #[error("joint `{joint}`: there is no link `{link}`")]
    NoSuchLink { joint: String, link: String },
    #[error("link `{link}` is the child of joints `{first}` and `{second}`: a tree has one")]
    TwoParents { link: String, first: String, second: String },
    #[error("links {} are in or behind a loop: a URDF is a tree", list(links))]
    Cycle { links: Vec<String> },
    #[error("{} links have no parent: {}; name the one that carries the arm with `--base-link LINK`", roots.len(), list(roots))]
    SeveralRoots { roots: Vec<String> },

    #[error("`{flag} {name}`: the file has no such {what}")]
    UnknownName { flag: &'static str, name: String, what: &'static str },
    #[error("`--end-effector {link}`: is not beyond the root `{root}`")]
    NotBeyondRoot { link: String, root: String },
    #[error("`{flag} {joint}`: is a fixed joint")]
    FixedJoint { flag: &'static str, joint: String },
    #[error("`--hold {joint}={value}`: a {kind} joint can only be held at 0")]
    HeldAt { joint: String, kind: &'static str, value: f64 },
    #[error(
        "joint `{joint}`: held at {value} {unit}, beyond its range {lower} to {upper} {unit}; give `--hold \
         {joint}=VALUE` within it, or another range with `--limit {joint}=lower,upper,rate,torque`"
    )]
    HeldBeyond { joint: String, value: f64, lower: f64, upper: f64, unit: &'static str },
    #[error("`--point-mass {link}`: moves by a joint of its own, so that its inertia is needed")]
    MovingPoint { link: String },
    #[error(
        "several links end the tree: {}; name the end effector with `--end-effector LINK`",
        list(leaves)
    )]
    SeveralLeaves { leaves: Vec<String> },
    #[error(
        "joint `{joint}`: is {kind}, on the way to the end effector, where only revolute joints may move; hold it with `--hold {joint}=VALUE`"
    )]
    OnTheWay { joint: String, kind: &'static str },
    #[error(
        "joint `{joint}`: mimics `{leader}`, on the way to the end effector; hold it with `--hold {joint}=ANGLE`"
    )]
    MimicOnTheWay { joint: String, leader: String },
    #[error(
        "joint `{joint}`: is {kind} and moves `{link}`, beside the way to the end effector; hold it with `--hold {joint}=VALUE`"
    )]
    SideBranch { joint: String, kind: &'static str, link: String },
    #[error("no revolute joint moves the end effector `{link}`")]
    NoJoints { link: String },
    #[error("{} revolute joints move the end effector, at most 7 can be planned: {}; hold some with `--hold JOINT=ANGLE`", joints.len(), list(joints))]
    TooManyJoints { joints: Vec<String> },

    #[error(
        "joint `{joint}`: {what} `<limit>`{found}; give `--limit {joint}=lower,upper,rate,torque` [rad, rad, rad/s, N m]"
    )]
    NoLimit { joint: String, what: &'static str, found: String },
    #[error(
        "joint `{joint}`: limits {lower} to {upper} rad: the lower must be below the upper, both within {MAX_ANGLE} rad; \
         give `--limit {joint}=lower,upper,rate,torque`"
    )]
    LimitOrder { joint: String, lower: f64, upper: f64 },

    #[error("link `{link}`: mass is {mass} kg: must not be negative")]
    NegativeMass { link: String, mass: f64 },
    #[error("link `{link}`: has an inertia but no mass{}", or_point(link, *is_moved))]
    InertiaWithoutMass { link: String, is_moved: bool },
    #[error(
        "link `{link}`: no body has this inertia: principal moments {:.6e}, {:.6e}, {:.6e} kg m^2, of which each must \
         be positive and at most the sum of the others; mend the file{}", moments[0], moments[1], moments[2],
        or_point(link, *is_moved)
    )]
    Inertia { link: String, moments: [f64; 3], is_moved: bool },
    #[error(
        "joint `{joint}`: moves no mass: link `{link}` and what is fixed to it have none; hold it with `--hold {joint}=ANGLE` or give the link its mass"
    )]
    Massless { joint: String, link: String },
    #[error(
        "link `{link}`: with what is fixed to it, its inertia is not positive definite: principal moments {:.6e}, \
         {:.6e}, {:.6e} kg m^2; mend the file", moments[0], moments[1], moments[2]
    )]
    NoExtent { link: String, moments: [f64; 3] },
}

/// A file that gives no arm, and all that is wrong with it.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{}", faults.iter().map(|fault| format!("{file}: {fault}")).collect::<Vec<_>>().join("\n"))]
pub struct Refusal {
    /// Name of the file, as the caller gave it.
    pub file: String,
    /// At least one.
    pub faults: Vec<Fault>,
}
