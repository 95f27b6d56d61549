//! The links and joints of a file as a tree.

use crate::fault::{Fault, Place};
use std::collections::BTreeMap;
use urdf_rs::{Joint, Link, Robot};

/// Links and joints by their place in the file.
pub struct Tree<'a> {
    pub links: &'a [Link],
    pub joints: &'a [Joint],
    /// Joints that a link is the parent of.
    children: Vec<Vec<usize>>,
    /// The joint that a link is the child of.
    parent: Vec<Option<usize>>,
    /// A joint's parent and child.
    ends: Vec<(usize, usize)>,
    by_name: BTreeMap<&'a str, usize>,
}

impl<'a> Tree<'a> {
    /// The tree, if the file is one.
    pub fn new(robot: &'a Robot, faults: &mut Vec<Fault>) -> Option<Self> {
        let known = faults.len();
        let (links, joints) = (&robot.links[..], &robot.joints[..]);
        let by_name = names(links.iter().map(|link| &link.name[..]), Place::Link, faults);
        names(joints.iter().map(|joint| &joint.name[..]), Place::Joint, faults);
        let mut tree = Self {
            links,
            joints,
            children: vec![Vec::new(); links.len()],
            parent: vec![None; links.len()],
            ends: Vec::new(),
            by_name,
        };
        for (i, joint) in joints.iter().enumerate() {
            tree.join(i, joint, faults);
        }
        if links.is_empty() {
            faults.push(Fault::NoLinks);
        }
        if faults.len() > known {
            return None;
        }
        let mut is_reached = vec![false; links.len()];
        let roots = tree.roots();
        roots.iter().flat_map(|root| tree.below(*root)).for_each(|link| is_reached[link] = true);
        let looped: Vec<String> = (0..links.len())
            .filter(|link| !is_reached[*link])
            .map(|link| tree.name(link))
            .collect();
        if looped.is_empty() {
            return Some(tree);
        }
        faults.push(Fault::Cycle { links: looped });
        None
    }

    fn join(&mut self, i: usize, joint: &Joint, faults: &mut Vec<Fault>) {
        let mut find = |link: &str| {
            let found = self.by_name.get(link).copied();
            if found.is_none() {
                faults.push(Fault::NoSuchLink { joint: joint.name.clone(), link: link.to_owned() });
            }
            found
        };
        // Both are looked for: both may be missing.
        let (Some(parent), Some(child)) = (find(&joint.parent.link), find(&joint.child.link))
        else {
            self.ends.push((0, 0));
            return;
        };
        if let Some(first) = self.parent[child] {
            faults.push(Fault::TwoParents {
                link: joint.child.link.clone(),
                first: self.joints[first].name.clone(),
                second: joint.name.clone(),
            });
        }
        self.parent[child] = Some(i);
        self.children[parent].push(i);
        self.ends.push((parent, child));
    }

    /// Links without a parent.
    fn roots(&self) -> Vec<usize> {
        (0..self.links.len()).filter(|link| self.parent[*link].is_none()).collect()
    }

    /// The link that carries the arm.
    pub fn root(&self, asked: Option<&str>, faults: &mut Vec<Fault>) -> Option<usize> {
        if let Some(name) = asked {
            return self.find("--base-link", name, faults);
        }
        match self.roots()[..] {
            [root] => Some(root),
            ref roots => {
                let roots = roots.iter().map(|root| self.name(*root)).collect();
                faults.push(Fault::SeveralRoots { roots });
                None
            }
        }
    }

    /// The link of this name, which a flag names.
    pub fn find(&self, flag: &'static str, name: &str, faults: &mut Vec<Fault>) -> Option<usize> {
        let found = self.by_name.get(name).copied();
        if found.is_none() {
            faults.push(Fault::UnknownName { flag, name: name.to_owned(), what: "link" });
        }
        found
    }

    /// A link and all beyond it, each behind its parent.
    pub fn below(&self, link: usize) -> Vec<usize> {
        let mut found = vec![link];
        let mut next = 0;
        while let Some(link) = found.get(next).copied() {
            found.extend(self.children[link].iter().map(|joint| self.ends[*joint].1));
            next += 1;
        }
        found
    }

    /// The joints from `root` to `link`, in this order.
    pub fn path(&self, root: usize, link: usize) -> Vec<usize> {
        let mut joints = Vec::new();
        let mut at = link;
        while let Some(joint) = self.parent[at].filter(|_| at != root) {
            joints.push(joint);
            at = self.parent_link(joint);
        }
        joints.reverse();
        joints
    }

    pub fn name(&self, link: usize) -> String {
        self.links[link].name.clone()
    }

    pub fn parent_joint(&self, link: usize) -> Option<usize> {
        self.parent[link]
    }

    pub fn parent_link(&self, joint: usize) -> usize {
        self.ends[joint].0
    }

    pub fn child_link(&self, joint: usize) -> usize {
        self.ends[joint].1
    }

    /// Joints that the link is the parent of.
    pub fn joints_of(&self, link: usize) -> &[usize] {
        &self.children[link]
    }
}

/// Places by name; each name is there once.
fn names<'a>(
    all: impl Iterator<Item = &'a str>,
    place: fn(String) -> Place,
    faults: &mut Vec<Fault>,
) -> BTreeMap<&'a str, usize> {
    let mut places = BTreeMap::new();
    for (i, name) in all.enumerate() {
        if places.insert(name, i).is_some() {
            faults.push(Fault::DuplicateName { place: place(name.to_owned()) });
        }
    }
    places
}
