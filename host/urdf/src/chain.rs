//! From the selected part of the tree to bodies and joints in parallel frames.

use crate::arm::{Arm, Base, Joint, LinkRow};
use crate::body::Body;
use crate::fault::{Fault, Place};
use crate::hull::{Bounds, Capsule, Hull};
use crate::limits::{limits, near_pi};
use crate::links::Links;
use crate::note::{Findings, MAX_REACH, Note};
use crate::options::Options;
use crate::pose::Pose;
use crate::selection::Selection;
use crate::tree::Tree;
use crate::written::Written;
use nalgebra::{Matrix3, Vector3};
use urdf_rs::JointType;

/// Ratio of the joint-to-joint capsule to the one that the shapes need, above which it is where they are.
const WIDE: f64 = 1.5;

/// All that an arm is made of.
pub struct Chain<'a> {
    pub tree: &'a Tree<'a>,
    pub selection: &'a Selection,
    pub written: &'a Written,
    pub options: &'a Options,
}

/// One body of the arm, at zero angles: the base, or what a joint moves.
struct Carrier {
    /// The link that the joint moves.
    link: usize,
    /// In the bus frame.
    body: Body,
    hulls: Vec<Hull>,
    /// Whether some shapes are not known.
    has_meshes: bool,
    /// Where its joint is, in the bus frame.
    joint: Vector3<f64>,
}

impl Chain<'_> {
    /// The arm, if nothing was found wrong, and the links that were looked at.
    pub fn assemble(&self, name: &str, found: &mut Findings) -> (Option<Arm>, Vec<LinkRow>) {
        // A body that was not understood makes others look wrong.
        let links = Links::new(self.tree, self.written, self.options, &found.faults);
        let poses = self.poses(&mut found.notes);
        let (carriers, rows) = self.carriers(&poses, &links, found);
        if links.are_understood() {
            self.bodies(&carriers, &mut found.faults);
        }
        let base = self.base(&carriers[0], &mut found.notes);
        let end = poses[self.selection.end_effector];
        let mut joints = Vec::new();
        for (i, joint) in self.selection.free.iter().enumerate() {
            let next = carriers.get(i + 2).map_or(end.position, |carrier| carrier.joint);
            let rotation = &poses[carriers[i + 1].link].rotation;
            joints.extend(self.joint(*joint, &carriers[i + 1], (next, rotation), found));
        }
        let Some(last) = joints.last().filter(|_| found.faults.is_empty()) else {
            return (None, rows);
        };
        let reach: f64 = joints.iter().map(|joint| joint.tip.norm()).sum();
        if reach > MAX_REACH {
            found.notes.push(Note::LongArm { reach });
        }
        let end_effector = Pose { position: last.tip, rotation: end.rotation };
        let arm_base = carriers[1].joint;
        let (name, notes) = (name.to_owned(), Vec::new());
        (Some(Arm { name, base, arm_base, joints, end_effector, notes }), rows)
    }

    /// Where each link's frame is in the bus frame, by its number, at zero angles.
    fn poses(&self, notes: &mut Vec<Note>) -> Vec<Pose> {
        let mut poses = vec![Pose::identity(); self.tree.links.len()];
        poses[self.selection.root] = self.options.mount;
        for link in self.selection.links.iter().skip(1) {
            let Some(number) = self.tree.parent_joint(*link) else { continue };
            let joint = &self.tree.joints[number];
            for value in joint.origin.rpy.iter() {
                near_pi(&Place::Joint(joint.name.clone()), "origin/rpy", *value, notes);
            }
            let origin = Pose::from_xyz_rpy(*joint.origin.xyz, *joint.origin.rpy);
            let value = self.selection.held.get(&number).copied().unwrap_or(0.0);
            let motion = match joint.joint_type {
                JointType::Revolute | JointType::Continuous => {
                    Pose::turn(&unit(&joint.axis.xyz), value)
                }
                JointType::Prismatic => Pose::shift(unit(&joint.axis.xyz) * value),
                _ => Pose::identity(),
            };
            poses[*link] = poses[self.tree.parent_link(number)].then(&origin).then(&motion);
        }
        poses
    }

    /// The base and what each joint moves, links merged into what they are fixed to.
    fn carriers(
        &self,
        poses: &[Pose],
        links: &Links,
        found: &mut Findings,
    ) -> (Vec<Carrier>, Vec<LinkRow>) {
        let carrier = |link: usize| Carrier {
            link,
            body: Body::none(),
            hulls: Vec::new(),
            has_meshes: false,
            joint: poses[link].position,
        };
        let moved = self.selection.free.iter().map(|joint| self.tree.child_link(*joint));
        let mut carriers: Vec<Carrier> =
            std::iter::once(self.selection.root).chain(moved).map(carrier).collect();
        let mut of_link = vec![0; self.tree.links.len()];
        let mut rows = Vec::new();
        for link in self.selection.links.iter().copied() {
            if let Some(own) = carriers.iter().position(|carrier| carrier.link == link) {
                of_link[link] = own;
            } else if let Some(joint) = self.tree.parent_joint(link) {
                of_link[link] = of_link[self.tree.parent_link(joint)];
            }
            let into = &mut carriers[of_link[link]];
            let hulls = links.hulls(link);
            let is_moved = into.link == link && of_link[link] > 0;
            if is_moved && self.options.point_masses.contains(&self.tree.name(link)) {
                found.faults.push(Fault::MovingPoint { link: self.tree.name(link) });
            }
            let part_of = self.tree.name(into.link);
            let row = links.row(link, (part_of, is_moved), &hulls, found);
            into.body = into.body.merged(&row.body.seen_from(&poses[link]));
            into.hulls.extend(hulls.iter().map(|hull| hull.seen_from(&poses[link])));
            into.has_meshes |= self.written.meshes.contains_key(&row.name);
            if into.link != link && row.body.mass > 0.0 {
                let (link, into) = (row.name.clone(), row.part_of.clone());
                found.notes.push(Note::Merged { link, into, mass: row.body.mass });
            }
            rows.push(row);
        }
        (carriers, rows)
    }

    /// Looks at each body that moves, or is the bus, as a whole.
    fn bodies(&self, carriers: &[Carrier], faults: &mut Vec<Fault>) {
        for (i, carrier) in carriers.iter().enumerate() {
            let link = self.tree.name(carrier.link);
            // A given bus carries a root that is a point.
            let is_point = i == 0 && self.options.point_masses.contains(&link);
            if carrier.body.mass > 0.0 {
                if !is_point && carrier.body.is_possible() && !carrier.body.has_extent() {
                    faults
                        .push(Fault::NoExtent { link, moments: carrier.body.principal_moments() });
                }
            } else if i > 0 {
                let joint = self.tree.joints[self.selection.free[i - 1]].name.clone();
                faults.push(Fault::Massless { joint, link });
            }
        }
    }

    fn base(&self, carrier: &Carrier, notes: &mut Vec<Note>) -> Option<Base> {
        let (link, mass) = (self.tree.name(carrier.link), carrier.body.mass);
        if !(mass > 0.0) {
            notes.push(Note::BareArm { link });
            return None;
        }
        notes.push(Note::Bus { link: link.clone(), mass });
        Some(Base { link, body: carrier.body, bounds: Bounds::of(&carrier.hulls) })
    }

    /// The capsule that holds the carrier, in its axes from its joint. It runs from there to the next joint, or
    /// where the shapes are. Where not all shapes are known it holds the centre of mass at least.
    fn capsule(
        &self,
        carrier: &Carrier,
        link: &str,
        next: &Vector3<f64>,
        notes: &mut Vec<Note>,
    ) -> Capsule {
        let tip = next - carrier.joint;
        let between = |radius| Capsule { start: Vector3::zeros(), end: tip, radius };
        let own = |hull: &Hull| hull.capsule_radius(&carrier.joint, next);
        let known = carrier.hulls.iter().map(own).fold(0.0, f64::max);
        if !carrier.hulls.is_empty() && !carrier.has_meshes {
            let fitted = Hull::fitted_capsule(&carrier.hulls);
            // A link whose joints' axes meet has no body.
            if known <= WIDE * fitted.radius || tip.amax() == 0.0 {
                return between(known);
            }
            let (link, own) = (link.to_owned(), fitted.radius);
            notes.push(Note::CapsuleAside { link, radius: known, own });
            let ends = [fitted.start - carrier.joint, fitted.end - carrier.joint];
            let is_turned = (ends[1] - ends[0]).dot(&tip) < 0.0;
            let [start, end] = if is_turned { [ends[1], ends[0]] } else { ends };
            return Capsule { start, end, radius: own };
        }
        let center = own(&Hull::point(carrier.body.center_of_mass));
        let radius = known.max(center).max(self.options.default_radius);
        notes.push(Note::RadiusAssumed { link: link.to_owned(), radius });
        between(radius)
    }

    fn joint(
        &self,
        number: usize,
        carrier: &Carrier,
        (next, rotation): (Vector3<f64>, &Matrix3<f64>),
        found: &mut Findings,
    ) -> Option<Joint> {
        let joint = &self.tree.joints[number];
        let name = joint.name.clone();
        let length = Vector3::from(*joint.axis.xyz).norm();
        if !self.written.axis.contains(&name) {
            found.notes.push(Note::AxisAssumed { joint: name.clone() });
        } else if (length - 1.0).abs() > 1e-9 {
            found.notes.push(Note::AxisScaled { joint: name.clone(), length });
        }
        if let Some((damping, friction)) = self.written.dynamics.get(&name).copied() {
            found.notes.push(Note::Dynamics { joint: name.clone(), damping, friction });
        }
        let limits = limits(joint, self.written, self.options, found)?;
        let link = self.tree.name(carrier.link);
        let capsule = self.capsule(carrier, &link, &next, &mut found.notes);
        let body =
            Body { center_of_mass: carrier.body.center_of_mass - carrier.joint, ..carrier.body };
        let axis = (rotation * unit(&joint.axis.xyz)).normalize();
        let tip = next - carrier.joint;
        Some(Joint { name, link, axis, tip, body, limits, armature: 0.0, capsule })
    }
}

/// A joint's unit axis, in the link's axes; x for a zero vector, which is a fault already.
fn unit(axis: &[f64; 3]) -> Vector3<f64> {
    let axis = Vector3::from(*axis);
    // Squares of a tiny vector would vanish.
    let largest = axis.amax();
    if largest > 0.0 { (axis / largest).normalize() } else { Vector3::x() }
}
