//! The text that tells what was understood of a file.

use crate::arm::{Arm, Joint, LinkRow};
use crate::body::Body;
use crate::note::Findings;
use nalgebra::Vector3;
use std::fmt::Display;

/// Tables of links and joints, notes, faults.
pub fn explanation(file: &str, links: &[LinkRow], arm: Option<&Arm>, found: &Findings) -> String {
    let mut text = format!("{file}\n");
    if !links.is_empty() {
        text += "\nlinks, as they are written; radii of gyration about the principal axes\n\n";
        text += &table(
            &["link", "part of", "mass [kg]", "radii of gyration [m]", "extent [m]", "inertia"],
            &links.iter().map(link_cells).collect::<Vec<_>>(),
        );
    }
    if let Some(arm) = arm {
        text += &arm_text(arm);
    }
    text += &lines("notes", &found.notes);
    text + &lines("faults", &found.faults)
}

fn arm_text(arm: &Arm) -> String {
    let mut text =
        "\njoints, from the bus outwards, in frames parallel to the bus frame\n\n".to_owned();
    let joints = || arm.joints.iter().enumerate();
    text += &table(
        &["", "joint", "axis", "to the next [m]", "range [rad]", "rate [rad/s]", "torque [N m]"],
        &joints().map(|(i, joint)| joint_cells(i, joint)).collect::<Vec<_>>(),
    );
    text += "\nbodies, with all that is fixed to them, in their own frames\n\n";
    let base = arm.base.as_ref().map(|base| body_cells("bus", &base.link, &base.body, ""));
    let bodies = joints().map(|(i, joint)| {
        body_cells(&number(i), &joint.link, &joint.body, &format!("{:.4}", joint.capsule.radius))
    });
    text += &table(
        &[
            "",
            "link",
            "mass [kg]",
            "centre of mass [m]",
            "ixx iyy izz, ixy ixz iyz [kg m^2]",
            "radius [m]",
        ],
        &base.into_iter().chain(bodies).collect::<Vec<_>>(),
    );
    let rotation = &arm.end_effector.rotation;
    let [x, y, z] = [0, 1, 2].map(|i| vector(&rotation.column(i).into_owned()));
    text + &format!(
        "\nfirst joint at ({}) m in the bus frame; end effector at ({}) m in the last link's, axes ({x}), ({y}), ({z})\n",
        vector(&arm.arm_base),
        vector(&arm.end_effector.position),
    )
}

fn link_cells(row: &LinkRow) -> Vec<String> {
    let body = &row.body;
    let [a, b, c] = body.radii_of_gyration();
    let extent = match row.extent {
        0.0 => "-".to_owned(),
        extent if row.has_shapes => format!("{extent:.4}"),
        extent => format!("{extent:.4} (to the next joint)"),
    };
    let gyration = if body.mass > 0.0 { format!("{a:.4} {b:.4} {c:.4}") } else { "-".to_owned() };
    let verdict = match (body.is_possible(), body.has_extent()) {
        (false, _) => "impossible",
        (true, _) if body.mass == 0.0 => "-",
        (true, false) => "not definite",
        (true, true) => "possible",
    };
    let (name, part_of) = (row.name.clone(), row.part_of.clone());
    vec![name, part_of, format!("{:.6}", body.mass), gyration, extent, verdict.to_owned()]
}

fn joint_cells(i: usize, joint: &Joint) -> Vec<String> {
    let limits = &joint.limits;
    vec![
        number(i),
        joint.name.clone(),
        vector(&joint.axis),
        vector(&joint.tip),
        format!("{:.4} to {:.4}", limits.lower, limits.upper),
        format!("{}", limits.rate),
        format!("{}", limits.torque),
    ]
}

fn body_cells(number: &str, link: &str, body: &Body, radius: &str) -> Vec<String> {
    let i = &body.inertia;
    let moments = [(0, 0), (1, 1), (2, 2)].map(|at| format!("{:.6}", i[at])).join(" ");
    let products =
        [(0, 1), (0, 2), (1, 2)].map(|at| format!("{:.6}", unsigned_zero(i[at], 6))).join(" ");
    vec![
        number.to_owned(),
        link.to_owned(),
        format!("{:.6}", body.mass),
        vector(&body.center_of_mass),
        format!("{moments}, {products}"),
        radius.to_owned(),
    ]
}

/// Joints are numbered from 1.
fn number(i: usize) -> String {
    format!("{}", i + 1)
}

fn vector(v: &Vector3<f64>) -> String {
    let [x, y, z] = [v.x, v.y, v.z].map(|c| format!("{:.4}", unsigned_zero(c, 4)));
    format!("{x} {y} {z}")
}

/// The number, but none that would be printed as minus zero.
fn unsigned_zero(value: f64, digits: i32) -> f64 {
    if value.abs() < 0.5 * 10.0_f64.powi(-digits) { 0.0 } else { value }
}

fn lines<T: Display>(title: &str, items: &[T]) -> String {
    if items.is_empty() {
        return String::new();
    }
    let lines: String = items.iter().map(|item| format!("- {item}\n")).collect();
    format!("\n{title}\n\n{lines}")
}

/// Columns as wide as their widest cell, two blanks between them.
fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let width = |i: usize| {
        let cells = rows.iter().filter_map(|row| row.get(i)).map(|cell| cell.chars().count());
        cells.chain(head.get(i).map(|cell| cell.chars().count())).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let padded: Vec<String> =
            cells.zip(&widths).map(|(cell, width)| format!("{cell:width$}")).collect();
        format!("{}\n", padded.join("  ").trim_end())
    };
    let mut text = line(&mut head.iter().copied());
    for row in rows {
        text += &line(&mut row.iter().map(String::as_str));
    }
    text
}
