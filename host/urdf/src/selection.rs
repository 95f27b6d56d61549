//! Selection of the joints that move, and of the links that belong to the arm.

use crate::fault::Fault;
use crate::limits::held_beyond;
use crate::note::{Findings, Note};
use crate::options::Options;
use crate::tree::Tree;
use crate::written::{TWO_TURNS, Written};
use std::collections::{BTreeMap, BTreeSet};
use urdf_rs::{Joint, JointType};

/// Most joints of an arm.
pub const MAX_JOINTS: usize = 7;

/// The part of the tree that becomes the arm.
pub struct Selection {
    pub root: usize,
    pub end_effector: usize,
    /// Joints that move, from the root outwards.
    pub free: Vec<usize>,
    /// Joints that are held, with angle [rad] or position [m].
    pub held: BTreeMap<usize, f64>,
    /// The root and all links beyond it, each behind its parent.
    pub links: Vec<usize>,
}

/// Names a joint's type.
pub fn kind(joint_type: &JointType) -> &'static str {
    match joint_type {
        JointType::Revolute => "revolute",
        JointType::Continuous => "continuous",
        JointType::Prismatic => "prismatic",
        JointType::Fixed => "fixed",
        JointType::Floating => "floating",
        JointType::Planar => "planar",
        JointType::Spherical => "spherical",
    }
}

fn is_revolute(joint_type: &JointType) -> bool {
    matches!(joint_type, JointType::Revolute | JointType::Continuous)
}

/// Chooses root, end effector and the joints between them.
pub fn select(
    tree: &Tree,
    written: &Written,
    options: &Options,
    found: &mut Findings,
) -> Option<Selection> {
    names_of_flags(tree, options, &mut found.faults);
    let held = held(tree, written, options, found);
    let asked = tree.root(options.root.as_deref(), &mut found.faults)?;
    let root = without_floating(tree, written, &held, asked, &mut found.notes);
    left_out(tree, asked, &mut found.notes);
    let faults = &mut found.faults;
    let links = tree.below(root);
    let end_effector = end_effector(tree, root, &links, options, faults)?;
    let path = tree.path(root, end_effector);
    let moving = |joint: &&usize| {
        tree.joints[**joint].joint_type != JointType::Fixed && !held.contains_key(*joint)
    };
    let free: Vec<usize> = path.iter().filter(moving).copied().collect();
    on_the_way(tree, written, &free, faults);
    let path: BTreeSet<usize> = path.into_iter().collect();
    for link in &links {
        for joint in tree.joints_of(*link).iter().filter(moving).filter(|j| !path.contains(j)) {
            faults.push(Fault::SideBranch {
                joint: tree.joints[*joint].name.clone(),
                kind: kind(&tree.joints[*joint].joint_type),
                link: tree.name(tree.child_link(*joint)),
            });
        }
    }
    if free.is_empty() {
        faults.push(Fault::NoJoints { link: tree.name(end_effector) });
    }
    if free.len() > MAX_JOINTS {
        let joints = free.iter().map(|joint| tree.joints[*joint].name.clone()).collect();
        faults.push(Fault::TooManyJoints { joints });
        return None;
    }
    Some(Selection { root, end_effector, free, held, links })
}

/// Checks that joints and links named by flags exist, and that the joints can move.
fn names_of_flags(tree: &Tree, options: &Options, faults: &mut Vec<Fault>) {
    for link in &options.point_masses {
        tree.find("--point-mass", link, faults);
    }
    let limits = options.limits.keys().map(|name| ("--limit", name));
    for (flag, name) in limits.chain(options.held.keys().map(|name| ("--hold", name))) {
        match tree.joints.iter().find(|joint| joint.name == *name) {
            None => faults.push(Fault::UnknownName { flag, name: name.clone(), what: "joint" }),
            Some(joint) if joint.joint_type == JointType::Fixed => {
                faults.push(Fault::FixedJoint { flag, joint: name.clone() });
            }
            Some(_) => {}
        }
    }
}

/// Joints that are held by the options, and those that follow them.
fn held(
    tree: &Tree,
    written: &Written,
    options: &Options,
    found: &mut Findings,
) -> BTreeMap<usize, f64> {
    let mut held = BTreeMap::new();
    let can_move = |(_, joint): &(usize, &Joint)| joint.joint_type != JointType::Fixed;
    for (i, joint) in tree.joints.iter().enumerate().filter(can_move) {
        let name = &joint.name;
        let mimic = written.mimics.get(name);
        let leader = mimic.and_then(|m| options.held.get(&m.leader).map(|value| (m, *value)));
        if let Some(value) = options.held.get(name) {
            found.notes.push(Note::Held { joint: name.clone(), value: *value });
            held.insert(i, *value);
        } else if let Some((mimic, value)) = leader {
            let value = mimic.multiplier * value + mimic.offset;
            let leader = mimic.leader.clone();
            found.notes.push(Note::Followed { joint: name.clone(), leader, value });
            held.insert(i, value);
        }
        let is_line = is_revolute(&joint.joint_type) || joint.joint_type == JointType::Prismatic;
        if let Some(value) = held.get(&i).copied().filter(|value| !is_line && *value != 0.0) {
            let kind = kind(&joint.joint_type);
            found.faults.push(Fault::HeldAt { joint: name.clone(), kind, value });
        }
        if let Some(value) = held.get(&i).copied().filter(|_| is_line) {
            found.faults.extend(held_beyond(joint, value, written, options));
            if is_revolute(&joint.joint_type) && value.abs() > TWO_TURNS {
                found.notes.push(Note::HeldTurned { joint: name.clone(), value });
            }
        }
    }
    held
}

/// The link that floats free of a root without mass, or else the root.
fn without_floating(
    tree: &Tree,
    written: &Written,
    held: &BTreeMap<usize, f64>,
    root: usize,
    notes: &mut Vec<Note>,
) -> usize {
    let &[joint] = tree.joints_of(root) else { return root };
    let floats = tree.joints[joint].joint_type == JointType::Floating && !held.contains_key(&joint);
    if !floats || written.inertial.contains(&tree.links[root].name) {
        return root;
    }
    let link = tree.child_link(joint);
    notes.push(Note::FloatingRoot { root: tree.name(root), link: tree.name(link) });
    link
}

fn left_out(tree: &Tree, root: usize, notes: &mut Vec<Note>) {
    let kept = tree.below(root);
    if kept.len() < tree.links.len() {
        let total = |links: &mut dyn Iterator<Item = usize>| -> f64 {
            links.map(|link| tree.links[link].inertial.mass.value).sum()
        };
        let mass = total(&mut (0..tree.links.len())) - total(&mut kept.into_iter());
        notes.push(Note::LeftOut { root: tree.name(root), mass });
    }
}

fn end_effector(
    tree: &Tree,
    root: usize,
    links: &[usize],
    options: &Options,
    faults: &mut Vec<Fault>,
) -> Option<usize> {
    if let Some(name) = &options.end_effector {
        let found = tree.find("--end-effector", name, faults)?;
        if found == root || !links.contains(&found) {
            faults.push(Fault::NotBeyondRoot { link: name.clone(), root: tree.name(root) });
            return None;
        }
        return Some(found);
    }
    let is_leaf = |link: &&usize| tree.joints_of(**link).is_empty();
    let leaves: Vec<usize> = links.iter().filter(is_leaf).copied().collect();
    if let [leaf] = leaves[..] {
        return Some(leaf);
    }
    let leaves = leaves.iter().map(|leaf| tree.name(*leaf)).collect();
    faults.push(Fault::SeveralLeaves { leaves });
    None
}

fn on_the_way(tree: &Tree, written: &Written, free: &[usize], faults: &mut Vec<Fault>) {
    for joint in free.iter().map(|joint| &tree.joints[*joint]) {
        if let Some(mimic) = written.mimics.get(&joint.name) {
            let leader = mimic.leader.clone();
            faults.push(Fault::MimicOnTheWay { joint: joint.name.clone(), leader });
        } else if !is_revolute(&joint.joint_type) {
            let kind = kind(&joint.joint_type);
            faults.push(Fault::OnTheWay { joint: joint.name.clone(), kind });
        }
    }
}
