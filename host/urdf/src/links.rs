//! Each link by itself: its body, its shapes, and what is wrong with them.

use crate::arm::LinkRow;
use crate::body::Body;
use crate::fault::{Fault, Place};
use crate::hull::{Bounds, Hull};
use crate::note::{Findings, Note};
use crate::pose::Pose;
use crate::tree::Tree;
use crate::written::Written;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeSet;
use urdf_rs::Inertial;

/// The links of a file.
pub struct Links<'a> {
    tree: &'a Tree<'a>,
    written: &'a Written,
    /// Of which something was not understood: their numbers are not what the file means.
    broken: BTreeSet<Place>,
}

impl<'a> Links<'a> {
    /// `faults`: what was found so far.
    pub fn new(tree: &'a Tree<'a>, written: &'a Written, faults: &[Fault]) -> Self {
        let broken = faults.iter().filter_map(place).cloned().collect();
        Self { tree, written, broken }
    }

    /// Whether all numbers are what the file means.
    pub fn are_understood(&self) -> bool {
        self.broken.is_empty()
    }

    /// Looks at all links, for a file of which it is not known what is part of what.
    pub fn all(&self, found: &mut Findings) -> Vec<LinkRow> {
        let row = |link| self.row(link, "-".to_owned(), &self.hulls(link), found);
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

    /// Looks at a link by itself.
    pub fn row(
        &self,
        link: usize,
        part_of: String,
        hulls: &[Hull],
        found: &mut Findings,
    ) -> LinkRow {
        let Findings { faults, notes } = found;
        let name = self.tree.name(link);
        let body = body(&self.tree.links[link].inertial);
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
            faults.extend(fault(&name, &body));
        }
        let has_shapes = bounds.is_some();
        let gyration = body.radii_of_gyration()[2];
        let most = if has_shapes { 0.5 * extent } else { extent };
        if extent > 0.0 && gyration > most {
            notes.push(Note::Gyration { link: name.clone(), gyration, extent });
        }
        LinkRow { name, part_of, body, extent, has_shapes }
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

/// What is wrong with the mass or inertia of a link, if something is.
fn fault(name: &str, body: &Body) -> Option<Fault> {
    let (link, mass) = (name.to_owned(), body.mass);
    if mass < 0.0 {
        Some(Fault::NegativeMass { link, mass })
    } else if mass == 0.0 && body.inertia != Matrix3::zeros() {
        Some(Fault::InertiaWithoutMass { link })
    } else if !body.is_possible() {
        Some(Fault::Inertia { link, moments: body.principal_moments() })
    } else {
        None
    }
}

/// The body of a link, in its own axes.
fn body(inertial: &Inertial) -> Body {
    let i = &inertial.inertia;
    let inertia = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
    let own = Body { mass: inertial.mass.value, center_of_mass: Vector3::zeros(), inertia };
    own.seen_from(&Pose::from_xyz_rpy(*inertial.origin.xyz, *inertial.origin.rpy))
}
