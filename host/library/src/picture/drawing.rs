//! The manoeuvre in the plane of approach, to scale, as elements of an SVG file.

use super::scene::{Cuboid, Pose, Scene};
use crate::report::page::escaped;
use crate::report::plot::tick_label;
use nalgebra::Vector3;
use std::fmt::Write;

/// Width of the whole sheet, and space around the drawing [pixels].
const WIDTH: f64 = 980.0;
const LEFT: f64 = 72.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 76.0;
const BELOW: f64 = 50.0;
/// Least and largest height of the drawing, and free space at its edges [pixels].
const HEIGHT: (f64, f64) = (220.0, 520.0);
const ROOM: f64 = 34.0;
/// Bus radius below which the capture is drawn again, larger [pixels].
const SMALL: f64 = 40.0;
/// Height of that second drawing [pixels].
const DETAIL: f64 = 320.0;

/// Colours on light and on dark pages.
const STYLE: &str = "<style>\
.sheet text{font:13px system-ui,'DejaVu Sans',sans-serif;fill:#17212c}\
.sheet .title{font-size:19px;font-weight:600}.sheet .mute{fill:#566371}\
.sheet .mid{text-anchor:middle}.sheet .end{text-anchor:end}\
.sheet .time{text-anchor:middle;paint-order:stroke;stroke:#ffffff;stroke-width:4px;stroke-linejoin:round}\
.sheet path{stroke-linejoin:round;stroke-linecap:round;fill:none}\
.sheet .grid{stroke:#e3e8ee}.sheet .frame{stroke:#8e9aa6}\
.sheet .bus{fill:#dbe9f7;stroke:#2f6fab;stroke-width:1.2}.sheet .target{fill:#e6e9ed;stroke:#5b6978;stroke-width:1.2}\
.sheet .edge{stroke:#2b6e3d}.sheet .arm{stroke:#9dd3ac}.sheet .joint{fill:#2b6e3d}\
.sheet .port{stroke:#c06a12;stroke-width:3}.sheet .way{stroke:#6f4fb0;stroke-width:1.5}.sheet .node{fill:#6f4fb0}\
.sheet .dash{stroke:#17212c;stroke-dasharray:6 4}.sheet .dots{stroke:#566371;stroke-dasharray:2 4}\
@media (prefers-color-scheme:dark){\
.sheet text{fill:#e3eaf2}.sheet .mute{fill:#a9b6c3}.sheet .time{stroke:#121920}\
.sheet .grid{stroke:#243040}.sheet .frame{stroke:#76838f}\
.sheet .bus{fill:#14283b;stroke:#6aa9e0}.sheet .target{fill:#232c36;stroke:#93a3b4}\
.sheet .edge{stroke:#6cbf82}.sheet .arm{stroke:#1f5a33}.sheet .joint{fill:#6cbf82}\
.sheet .port{stroke:#e8a255}.sheet .way{stroke:#b79af0}.sheet .node{fill:#b79af0}\
.sheet .dash{stroke:#e3eaf2}.sheet .dots{stroke:#a9b6c3}}</style>\n";

/// Names of the legend with the elements that stand before them, at the origin.
const LEGEND: [(&str, &str); 7] = [
    ("bus", "<path class='bus' d='M1 -6h12v12h-12z'/>"),
    (
        "arm",
        "<path class='edge' d='M3 0H11' stroke-width='8'/><path class='arm' d='M3 0H11' stroke-width='6'/>",
    ),
    ("target at capture", "<path class='target' d='M1 -6h12v12h-12z'/>"),
    ("port", "<path class='port' d='M0 0H14'/>"),
    (
        "path of the centre of mass",
        "<path class='way' d='M0 0H14'/><circle class='node' cx='7' r='3'/>",
    ),
    ("limit", "<path class='dash' d='M0 0H16'/>"),
    ("arm set for capture", "<path class='dots' d='M0 0H16'/>"),
];

/// A point of the sheet [pixels].
type Point = (f64, f64);

/// A rectangle of the sheet: its least and its largest corner.
type Area = (Point, Point);

/// Mapping from metres of the plane to pixels.
#[derive(Clone, Copy)]
struct Frame {
    axes: [Vector3<f64>; 3],
    /// Pixels of a metre.
    scale: f64,
    /// Pixels of the target's centre.
    origin: Point,
    area: Area,
}

impl Frame {
    /// Places points with their radii in an area of this width, and of a height within `heights`, at `top`.
    fn around(
        axes: [Vector3<f64>; 3],
        reach: &[(Vector3<f64>, f64)],
        heights: Point,
        top: f64,
    ) -> Self {
        let span = |axis: &Vector3<f64>| {
            reach.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (at, radius)| {
                (low.min(axis.dot(at) - radius), high.max(axis.dot(at) + radius))
            })
        };
        let (x, y) = (span(&axes[0]), span(&axes[1]));
        let width = WIDTH - LEFT - RIGHT;
        let scale =
            ((width - 2.0 * ROOM) / (x.1 - x.0)).min((heights.1 - 2.0 * ROOM) / (y.1 - y.0));
        let height = (scale * (y.1 - y.0) + 2.0 * ROOM).max(heights.0);
        let area = ((LEFT, top), (LEFT + width, top + height));
        let middle = |low: f64, high: f64| 0.5 * (low + high);
        let origin = (
            middle(area.0.0, area.1.0) - scale * middle(x.0, x.1),
            middle(area.0.1, area.1.1) + scale * middle(y.0, y.1),
        );
        Self { axes, scale, origin, area }
    }

    fn at(&self, point: &Vector3<f64>) -> Point {
        let along = |i: usize| self.scale * self.axes[i].dot(point);
        (self.origin.0 + along(0), self.origin.1 - along(1))
    }

    fn depth(&self, point: &Vector3<f64>) -> f64 {
        self.axes[2].dot(point)
    }

    /// Path data through points.
    fn path(&self, points: &[Vector3<f64>]) -> String {
        let mut data = String::new();
        for (i, point) in points.iter().enumerate() {
            let (x, y) = self.at(point);
            let _ = write!(data, "{}{x:.1} {y:.1}", if i == 0 { "M" } else { "L" });
        }
        data
    }

    /// Grid, labels and frame.
    fn draw_axes(&self, out: &mut String) {
        let ((left, top), (right, bottom)) = self.area;
        let step = tick_step((bottom - top).max(right - left) / 12.0 / self.scale);
        let ticks = |low: f64, high: f64| {
            let (from, to) = ((low / step).ceil() as i64, (high / step).floor() as i64);
            (from..=to).map(|tick| tick as f64 * step)
        };
        let metres = |pixels: f64, origin: f64| (pixels - origin) / self.scale;
        for x in ticks(metres(left, self.origin.0), metres(right, self.origin.0)) {
            let (at, label) = (self.origin.0 + self.scale * x, tick_label(x));
            let _ = writeln!(
                out,
                "<path class='grid' d='M{at:.1} {top}V{bottom:.1}'/>\
                <text class='mid' x='{at:.1}' y='{:.1}'>{label}</text>",
                bottom + 18.0
            );
        }
        for y in ticks(-metres(bottom, self.origin.1), -metres(top, self.origin.1)) {
            let (at, label) = (self.origin.1 - self.scale * y, tick_label(y));
            let _ = writeln!(
                out,
                "<path class='grid' d='M{left} {at:.1}H{right}'/>\
                <text class='end' x='{}' y='{:.1}'>{label}</text>",
                left - 8.0,
                at + 4.5
            );
        }
        let (x, y) = (0.5 * (left + right), 0.5 * (top + bottom));
        let _ = writeln!(
            out,
            "<path class='frame' d='M{left} {top:.1}V{bottom:.1}H{right}'/>\
            <text class='mid' x='{x:.1}' y='{:.1}'>towards the start [m]</text>\
            <text class='mid' transform='translate(20 {y:.1}) rotate(-90)'>across, in the port's plane [m]</text>",
            bottom + 38.0
        );
    }

    fn draw_box(&self, cuboid: &Cuboid, class: &str, out: &mut String) {
        for (_, corners) in cuboid.faces().filter(|(outward, _)| self.depth(outward) > 0.0) {
            let _ = write!(out, "<path class='{class}' d='{}z'/>", self.path(&corners));
        }
    }

    /// Bus and arm, the farther first.
    fn draw_pose(&self, pose: &Pose, out: &mut String) {
        let mut bus = String::new();
        self.draw_box(&pose.bus, "bus", &mut bus);
        let mut parts = vec![(self.depth(&pose.bus.center), bus)];
        let mut before = f64::NEG_INFINITY;
        for link in &pose.links {
            let width = (2.0 * link.radius * self.scale).max(2.0);
            let (path, wide, (x, y)) = (self.path(&link.ends), width + 2.0, self.at(&link.joint));
            let body = format!(
                "<path class='edge' d='{path}' stroke-width='{wide:.1}'/>\
                 <path class='arm' d='{path}' stroke-width='{width:.1}'/>"
            );
            let depth = 0.5 * self.depth(&(link.ends[0] + link.ends[1]));
            parts.push((depth, body));
            // The joint is seen on both links that it connects.
            let mark = format!("<circle class='joint' cx='{x:.1}' cy='{y:.1}' r='2'/>");
            parts.push((depth.max(before), mark));
            before = depth;
        }
        parts.sort_by(|a, b| a.0.total_cmp(&b.0));
        parts.iter().for_each(|(_, part)| out.push_str(part));
    }
}

/// The bodies of a plan, ready to be drawn.
pub(super) struct Drawing {
    axes: [Vector3<f64>; 3],
    target: Cuboid,
    port: [Vector3<f64>; 2],
    way: Vec<Vector3<f64>>,
    poses: Vec<Pose>,
}

impl Drawing {
    pub fn new(scene: &Scene<'_>) -> Self {
        let way = (0..scene.grid.nodes).map(|node| scene.position(node)).collect();
        let (axes, target, port) = (scene.axes(), scene.target(), scene.port());
        Self { axes, target, port, way, poses: scene.poses() }
    }

    /// Title, legend and drawing, with their height [pixels].
    pub fn elements(&self, title: &str) -> (String, u32) {
        let mut out = format!(
            "{STYLE}<g class='sheet'><text class='title' x='16' y='30'>{}</text>\n",
            escaped(title)
        );
        let mut x = 16.0;
        for (name, mark) in LEGEND {
            let _ = writeln!(
                out,
                "<g transform='translate({x} 52)'>{mark}<text x='22' y='4.5'>{name}</text></g>"
            );
            x += 50.0 + 6.6 * name.len() as f64;
        }
        let all: Vec<_> = self.poses.iter().flat_map(reach).collect();
        let fixed =
            corners(&self.target).chain(self.port.iter().chain(&self.way).map(|at| (*at, 0.0)));
        let frame = Frame::around(
            self.axes,
            &all.into_iter().chain(fixed).collect::<Vec<_>>(),
            HEIGHT,
            TOP,
        );
        self.draw(&frame, &self.poses, &mut out);
        let mut bottom = frame.area.1.1 + BELOW;
        if let Some(last) = self.poses.last().filter(|last| frame.scale * last.bus.radius() < SMALL)
        {
            let near: Vec<_> = reach(last).chain(corners(&self.target)).collect();
            let detail = Frame::around(self.axes, &near, (DETAIL, DETAIL), bottom);
            let (x, y) = detail.area.0;
            let _ = writeln!(
                out,
                "<text x='{:.1}' y='{:.1}'>at capture, enlarged</text>",
                x + 12.0,
                y + 20.0
            );
            self.draw(&detail, std::slice::from_ref(last), &mut out);
            bottom = detail.area.1.1 + BELOW;
        }
        out.push_str("</g>\n");
        (out, (bottom + 10.0) as u32)
    }

    fn draw(&self, frame: &Frame, poses: &[Pose], out: &mut String) {
        frame.draw_axes(out);
        let ((left, top), (right, bottom)) = frame.area;
        let (width, height) = (right - left, bottom - top);
        // Elements beyond the area are cut off: of a second drawing, the path to it.
        let _ = writeln!(
            out,
            "<svg x='{left}' y='{top:.1}' width='{width}' height='{height:.1}' \
            viewBox='{left} {top:.1} {width} {height:.1}'>"
        );
        frame.draw_box(&self.target, "target", out);
        for (i, pose) in poses.iter().enumerate() {
            let _ = write!(
                out,
                "<g opacity='{:.2}'>",
                1.0 - 0.5 * (poses.len() - 1 - i) as f64 / poses.len() as f64
            );
            frame.draw_pose(pose, out);
            out.push_str("</g>\n");
        }
        let _ = writeln!(out, "<path class='way' d='{}'/>", frame.path(&self.way));
        let _ = writeln!(out, "<path class='port' d='{}'/>", frame.path(&self.port));
        let mut labels = Labels::new(frame, self, poses);
        for pose in poses {
            let (x, y) = frame.at(&pose.center_of_mass);
            let _ = writeln!(out, "<circle class='node' cx='{x:.1}' cy='{y:.1}' r='3'/>");
            labels.place(frame, pose, out);
        }
        out.push_str("</svg>\n");
    }
}

/// Points of the servicer with the radii about them.
fn reach(pose: &Pose) -> impl Iterator<Item = (Vector3<f64>, f64)> {
    let arm = pose.links.iter().flat_map(|link| link.ends.map(|end| (end, link.radius)));
    corners(&pose.bus).chain(arm)
}

fn corners(cuboid: &Cuboid) -> impl Iterator<Item = (Vector3<f64>, f64)> {
    cuboid.faces().flat_map(|(_, corners)| corners.map(|corner| (corner, 0.0)))
}

/// Places of the poses' times: beside the bus, where they hide little.
struct Labels {
    /// Points that are better not hidden.
    drawn: Vec<Point>,
    placed: Vec<Area>,
}

impl Labels {
    /// Half height of a label, half width of a character, and its distance from the bus [pixels].
    const HALF: f64 = 9.0;
    const CHARACTER: f64 = 4.0;
    const GAP: f64 = 3.0;

    fn new(frame: &Frame, drawing: &Drawing, poses: &[Pose]) -> Self {
        let mut drawn: Vec<Point> = drawing.way.iter().map(|at| frame.at(at)).collect();
        let mut line = |from: &Vector3<f64>, to: &Vector3<f64>| {
            drawn.extend((0..=12).map(|i| frame.at(&from.lerp(to, f64::from(i) / 12.0))));
        };
        for cuboid in poses.iter().map(|pose| &pose.bus).chain([&drawing.target]) {
            for (_, corners) in cuboid.faces() {
                (0..4).for_each(|i| line(&corners[i], &corners[(i + 1) % 4]));
            }
        }
        let links = poses.iter().flat_map(|pose| &pose.links);
        links.for_each(|link| line(&link.ends[0], &link.ends[1]));
        Self { drawn, placed: Vec::new() }
    }

    fn place(&mut self, frame: &Frame, pose: &Pose, out: &mut String) {
        let text = match pose.time_s {
            time if time.fract() == 0.0 || time >= 100.0 => format!("{time:.0} s"),
            time => format!("{time:.1} s"),
        };
        let half = (Self::CHARACTER * text.len() as f64, Self::HALF);
        let center = frame.at(&pose.bus.center);
        let candidates = (0..16).map(|i| {
            let angle = f64::from((i + 1) / 2 * if i % 2 == 0 { 1 } else { -1 })
                * core::f64::consts::PI
                / 8.0;
            let (x, y) = (angle.sin(), -angle.cos());
            let extent = corners(&pose.bus).map(|(at, _)| {
                let at = frame.at(&at);
                x * (at.0 - center.0) + y * (at.1 - center.1)
            });
            let away = extent.fold(0.0, f64::max) + Self::GAP + half.0 * x.abs() + half.1 * y.abs();
            let (x, y) = (center.0 + away * x, center.1 + away * y);
            ((x - half.0, y - half.1), (x + half.0, y + half.1))
        });
        let cost = |area: &Area| {
            let hidden = self.drawn.iter().filter(|at| overlap(area, &(**at, **at))).count();
            let taken = self.placed.iter().filter(|other| overlap(area, other)).count();
            let (inner, outer) = (area, frame.area);
            let is_outside = inner.0.0 < outer.0.0
                || inner.0.1 < outer.0.1
                || inner.1.0 > outer.1.0
                || inner.1.1 > outer.1.1;
            hidden + 100 * taken + 1000 * usize::from(is_outside)
        };
        let Some(best) = candidates.min_by_key(cost) else { return };
        let (x, y) = (0.5 * (best.0.0 + best.1.0), best.1.1 - 4.5);
        let _ = writeln!(out, "<text class='time' x='{x:.1}' y='{y:.1}'>{text}</text>");
        self.placed.push(best);
    }
}

fn overlap(a: &Area, b: &Area) -> bool {
    a.0.0 <= b.1.0 && b.0.0 <= a.1.0 && a.0.1 <= b.1.1 && b.0.1 <= a.1.1
}

/// One, two or five times a power of ten, at least `least`.
fn tick_step(least: f64) -> f64 {
    let power = 10_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0]
        .map(|digit| digit * power)
        .into_iter()
        .find(|step| *step >= least)
        .unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_cut_off_however_long_or_high() {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        for far in [Vector3::x() * 50.0, Vector3::y() * 50.0, Vector3::new(3.0, 2.0, 9.0)] {
            let reach = [(Vector3::zeros(), 0.4), (far, 3.0)];
            let frame = Frame::around(axes, &reach, HEIGHT, TOP);
            let (left, top) = frame.area.0;
            let (right, bottom) = frame.area.1;
            for (point, radius) in reach {
                let ((x, y), radius) = (frame.at(&point), frame.scale * radius + ROOM - 1e-9);
                assert!(x - radius >= left && x + radius <= right, "{far}");
                assert!(y - radius >= top && y + radius <= bottom, "{far}");
            }
            assert!(bottom - top <= HEIGHT.1 + 1e-9);
        }
    }

    #[test]
    fn steps_between_labels_are_round() {
        assert_eq!([0.3, 0.9, 1.0, 3.0, 7.0].map(tick_step), [0.5, 1.0, 1.0, 5.0, 10.0]);
    }
}
