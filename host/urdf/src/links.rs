//! Each link by itself: its body, its shapes, and what is wrong with them.

use crate::arm::LinkRow;
use crate::body::Body;
use crate::fault::{Fault, Place};
use crate::hull::{Bounds, Hull};
use crate::note::{Findings, MAX_REACH, Note};
use crate::options::Options;
use crate::pose::Pose;
use crate::tree::Tree;
use crate::written::Written;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeSet;

/// The links of a file.
pub struct Links<'a> {
    tree: &'a Tree<'a>,
    written: &'a Written,
    options: &'a Options,
    /// Places not understood in part: their numbers are not those that the file means.
    broken: BTreeSet<Place>,
}

impl<'a> Links<'a> {
    /// `faults`: what was found so far.
    pub fn new(
        tree: &'a Tree<'a>,
        written: &'a Written,
        options: &'a Options,
        faults: &[Fault],
    ) -> Self {
        let broken = faults.iter().filter_map(place).cloned().collect();
        Self { tree, written, options, broken }
    }

    /// Whether all numbers are what the file means.
    pub fn are_understood(&self) -> bool {
        self.broken.is_empty()
    }

    /// Looks at all links, for a file of which it is not known what is part of what.
    pub fn all(&self, found: &mut Findings) -> Vec<LinkRow> {
        let row = |link| self.row(link, ("-".to_owned(), true), &self.hulls(link), found);
        (0..self.tree.links.len()).map(row).collect()
    }

    /// Collision shapes of a link, in its own axes.
    pub fn hulls(&self, link: usize) -> Vec<Hull> {
        let shapes = self.tree.links[link].collision.iter();
        let hull = |collision: &urdf_rs::Collision| {
            let pose = Pose::from_xyz_rpy(*collision.origin.xyz, *collision.origin.rpy);
            Hull::new(&collision.geometry, &pose)
        };
        shapes.filter_map(hull).collect()
    }

    /// Checks a link by itself: part of a body, with or without a joint that moves it.
    pub fn row(
        &self,
        link: usize,
        (part_of, is_moved): (String, bool),
        hulls: &[Hull],
        found: &mut Findings,
    ) -> LinkRow {
        let Findings { faults, notes } = found;
        let name = self.tree.name(link);
        let body = self.body(link, notes);
        let bounds = Bounds::of(hulls);
        let joints = self.tree.joints_of(link).iter();
        let reach = joints.map(|j| Vector3::from(*self.tree.joints[*j].origin.xyz).norm());
        let extent =
            bounds.map_or_else(|| reach.fold(0.0, f64::max), |b| (b.upper - b.lower).norm());
        if !self.written.inertial.contains(&name) {
            notes.push(Note::NoInertial { link: name.clone() });
        }
        let meshes = self.written.meshes.get(&name).copied();
        notes.extend(meshes.map(|count| Note::Meshes { link: name.clone(), count }));
        if !self.broken.contains(&Place::Link(name.clone())) {
            faults.extend(fault(&name, &body, is_moved));
        }
        if extent > MAX_REACH {
            notes.push(Note::LongLink { link: name.clone(), extent });
        }
        let has_shapes = bounds.is_some();
        let gyration = body.radii_of_gyration()[2];
        let most = if has_shapes { 0.5 * extent } else { extent };
        if extent > 0.0 && gyration > most {
            notes.push(Note::Gyration { link: name.clone(), gyration, extent });
        }
        LinkRow { name, part_of, body, extent, has_shapes }
    }

    /// The body of a link, in its own axes: as in the file, with rounding corrected, or a point.
    fn body(&self, link: usize, notes: &mut Vec<Note>) -> Body {
        let (inertial, link) = (&self.tree.links[link].inertial, self.tree.name(link));
        let i = &inertial.inertia;
        let inertia = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
        let (mass, center_of_mass) = (inertial.mass.value, Vector3::zeros());
        let mut own = Body { mass, center_of_mass, inertia };
        let decimals = self.written.decimals.get(&link).copied().unwrap_or(0);
        if self.options.point_masses.contains(&link) {
            own.inertia = Matrix3::zeros();
            notes.push(Note::PointMass { link, mass });
        } else if let Some((body, by)) = own.without_rounding(decimals) {
            own = body;
            notes.push(Note::InertiaRounded { link, by });
        }
        own.seen_from(&Pose::from_xyz_rpy(*inertial.origin.xyz, *inertial.origin.rpy))
    }
}

/// The link or joint of which something was not understood.
fn place(fault: &Fault) -> Option<&Place> {
    match fault {
        Fault::Missing { place, .. }
        | Fault::WrittenTwice { place, .. }
        | Fault::Number { place, .. } => Some(place),
        _ => None,
    }
}

/// Finds the fault in the mass or inertia of a link, if there is one.
fn fault(name: &str, body: &Body, is_moved: bool) -> Option<Fault> {
    let (link, mass) = (name.to_owned(), body.mass);
    if mass < 0.0 {
        Some(Fault::NegativeMass { link, mass })
    } else if mass == 0.0 && body.inertia != Matrix3::zeros() {
        Some(Fault::InertiaWithoutMass { link, is_moved })
    } else if !body.is_possible() {
        Some(Fault::Inertia { link, moments: body.principal_moments(), is_moved })
    } else {
        None
    }
}
