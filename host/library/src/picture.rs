//! A plan as a picture: the manoeuvre in the plane of approach, and all that has limits over time.

use crate::error::Error;
use crate::formats::{JointVector, Mission, PlanFile, Verdict};
use crate::report::plot::{Outline, Panel, Sheet};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3, Vector4};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Grid, signed_distance_to_box};

/// Nodes of sixty at which bus and arm are drawn; of fewer, those that are as far.
const SHOWN: [usize; 6] = [0, 20, 35, 47, 54, 59];

/// Milliradians of a radian, and newton metres in thousandths.
const MILLI: f64 = 1e3;

/// The picture of a plan as the text of an SVG file.
///
/// # Errors
/// Where it cannot be drawn.
pub fn svg(plan: &PlanFile, mission: &Mission) -> Result<String, Error> {
    let named = plan.inputs.scenario.named(&plan.scenario);
    let view = View { plan, mission, grid: mission.grid(&named.scenario()) };
    Sheet {
        title: format!("{}: {} ({})", plan.scenario, verdict(plan), plan.integrator),
        axes: ("towards the start [m]".into(), "across, in the plane of the port [m]".into()),
        outlines: view.outlines(),
        panels: view.panels(),
    }
    .svg()
}

fn verdict(plan: &PlanFile) -> String {
    plan.verdict.map_or("a plan", Verdict::words).into()
}

/// Names of axes.
fn axes() -> Vec<String> {
    ["x", "y", "z"].map(String::from).into()
}

/// Names of so many joints.
fn joint_names(count: usize) -> Vec<String> {
    (1..=count).map(|joint| format!("joint {joint}")).collect()
}

/// A line of a panel: its name and its points.
type Line = (String, Vec<(f64, f64)>);

/// A panel with lines of limits and, where something begins at one, a moment.
fn panel(title: &str, limits: Vec<f64>, lines: Vec<Line>, moment: Option<f64>) -> Panel {
    Panel { title: title.into(), lines, limits, moment }
}

/// Limits of either sign, each drawn once.
fn both(scale: f64, limits: &[f64]) -> Vec<f64> {
    let mut lines: Vec<f64> = Vec::new();
    for limit in limits.iter().map(|limit| scale * limit) {
        if !lines.contains(&limit) {
            lines.extend([-limit, limit]);
        }
    }
    lines
}

/// A plan with what it was made for.
struct View<'a> {
    plan: &'a PlanFile,
    mission: &'a Mission,
    grid: Grid,
}

impl View<'_> {
    fn time(&self, node: usize) -> f64 {
        self.grid.time(node)
    }

    fn over_nodes(&self, name: &str, value: impl Fn(usize) -> f64) -> (String, Vec<(f64, f64)>) {
        (name.into(), (0..self.grid.nodes).map(|k| (self.time(k), value(k))).collect())
    }

    /// A control, which is held over each interval.
    fn held(&self, name: &str, value: impl Fn(usize) -> f64) -> (String, Vec<(f64, f64)>) {
        let ends = |k: usize| [(self.time(k), value(k)), (self.time(k + 1), value(k))];
        (name.into(), (0..self.grid.last()).flat_map(ends).collect())
    }

    fn panels(&self) -> Vec<Panel> {
        let mut panels = self.translation_panels();
        panels.extend(self.reorientation_panels());
        panels
    }

    /// Force and distance of the centre of mass.
    fn translation_panels(&self) -> Vec<Panel> {
        let force = &self.plan.stage1.force;
        let limits = &self.mission.servicer.force_limit_n;
        vec![
            panel(
                "force [N], RTN",
                both(1.0, limits.as_slice()),
                self.held_axes(axes(), &|k, i| force[k][i]),
                None,
            ),
            panel(
                "distance to the target's box [m]",
                vec![],
                vec![
                    self.over_nodes("centre of mass", |k| self.distance(k)),
                    self.over_nodes("keep-out", |k| self.grid.keep_out(k)),
                ],
                None,
            ),
        ]
    }

    /// Torques, angles, rates and pointing.
    fn reorientation_panels(&self) -> Vec<Panel> {
        let (reorientation, s) = (&self.plan.stage2, &self.mission.servicer);
        let joints = self.mission.joints();
        let preset = Some(self.time(self.grid.preset_node()));
        let stops = s.min_joint_angle_rad.iter().zip(&s.max_joint_angle_rad).take(joints);
        let stops = stops.flat_map(|(lower, upper)| [lower.to_degrees(), upper.to_degrees()]);
        let view = self.mission.approach.field_of_view_half_angle_rad.to_degrees();
        vec![
            panel(
                "bus torque [mN m], bus axes",
                both(MILLI, s.bus_torque_limit_n_m.as_slice()),
                self.held_axes(axes(), &|k, i| MILLI * reorientation.bus_torque[k][i]),
                None,
            ),
            panel(
                "joint torque [mN m]",
                both(MILLI, &s.joint_torque_limit_n_m.as_slice()[..joints]),
                self.held_axes(joint_names(joints), &|k, i| {
                    MILLI * reorientation.joint_torque[k][i]
                }),
                preset,
            ),
            panel(
                "joint angle [deg]",
                stops.collect(),
                self.node_axes(joint_names(joints), &|k, i| {
                    reorientation.joint_angle[k][i].to_degrees()
                }),
                preset,
            ),
            panel(
                "joint rate [mrad/s]",
                both(MILLI, &s.joint_rate_limit_rad_s.as_slice()[..joints]),
                self.node_axes(joint_names(joints), &|k, i| MILLI * reorientation.joint_rate[k][i]),
                preset,
            ),
            panel(
                "bus rate [mrad/s], RTN",
                vec![],
                self.node_axes(axes(), &|k, i| MILLI * reorientation.rate[k][i]),
                None,
            ),
            panel(
                "port off the boresight [deg]",
                vec![view],
                vec![self.over_nodes("angle", |k| self.off_boresight(k))],
                None,
            ),
        ]
    }

    /// Controls of axes or joints.
    fn held_axes(&self, names: Vec<String>, value: &dyn Fn(usize, usize) -> f64) -> Vec<Line> {
        let line = |(i, name): (usize, &String)| self.held(name, |k| value(k, i));
        names.iter().enumerate().map(line).collect()
    }

    /// States of axes or joints.
    fn node_axes(&self, names: Vec<String>, value: &dyn Fn(usize, usize) -> f64) -> Vec<Line> {
        let line = |(i, name): (usize, &String)| self.over_nodes(name, |k| value(k, i));
        names.iter().enumerate().map(line).collect()
    }

    fn target(&self, node: usize) -> Matrix3<f64> {
        quaternion::rotation_matrix(&Vector4::from(self.plan.target.attitude[node]))
    }

    fn bus(&self, node: usize) -> Matrix3<f64> {
        quaternion::rotation_matrix(&Vector4::from(self.plan.stage2.attitude[node]))
    }

    fn position(&self, node: usize) -> Vector3<f64> {
        Vector3::from(self.plan.stage1.position[node])
    }

    /// Centre of mass to the target's box [m].
    fn distance(&self, node: usize) -> f64 {
        let local = self.target(node).transpose() * self.position(node);
        signed_distance_to_box(&self.mission.target.half_extents_m, &local).value
    }

    /// Angle between the boresight and the line of sight to the port [deg].
    fn off_boresight(&self, node: usize) -> f64 {
        let port = self.target(node) * self.mission.target.port_position_m;
        let sight = (port - self.position(node)).normalize();
        let boresight = self.bus(node) * self.mission.servicer.boresight;
        sight.dot(&boresight).clamp(-1.0, 1.0).acos().to_degrees()
    }

    /// The plane of the picture: through start and target, as the port looks at the end.
    fn plane(&self) -> [Vector3<f64>; 2] {
        let start = self.position(0).normalize();
        let port = self.target(self.grid.last()) * self.mission.target.port_normal;
        let across = port - start * start.dot(&port);
        let across = match across.norm() > 1e-3 {
            true => across.normalize(),
            false => quaternion::any_normal(&start),
        };
        [start, across]
    }

    fn outlines(&self) -> Vec<Outline> {
        let [x, y] = self.plane();
        let flat = |point: &Vector3<f64>| (x.dot(point), y.dot(point));
        let line = |points: &[Vector3<f64>], colour, width| Outline {
            points: points.iter().map(flat).collect(),
            colour,
            width,
        };
        let path: Vec<_> = (0..self.grid.nodes).map(|k| self.position(k)).collect();
        let mut outlines = vec![line(&path, Some(5), 2)];
        for edge in self.target_edges() {
            outlines.push(line(&edge, None, 1));
        }
        for share in SHOWN {
            let (bus, arm) = self.servicer(share * self.grid.last() / SHOWN[5]);
            bus.iter().for_each(|edge| outlines.push(line(edge, Some(0), 1)));
            outlines.push(line(&arm, Some(2), 3));
        }
        // Last, so that nothing hides it: the port and where it looks.
        let (port, normal) = (self.mission.target.port_position_m, self.mission.target.port_normal);
        let last = self.target(self.grid.last());
        outlines.push(line(&[last * port, last * (port + 0.4 * normal)], Some(1), 2));
        outlines
    }

    /// The edges of the target's box at capture.
    fn target_edges(&self) -> Vec<[Vector3<f64>; 2]> {
        let turn = self.target(self.grid.last());
        edges(&self.mission.target.half_extents_m, |corner| turn * corner)
    }

    /// Edges of the bus, and the arm from its base to the end effector.
    fn servicer(&self, node: usize) -> (Vec<[Vector3<f64>; 2]>, Vec<Vector3<f64>>) {
        let servicer = &self.mission.servicer;
        let given = &self.plan.stage2.joint_angle[node];
        let angles = JointVector::from_fn(|i, _| given.get(i).copied().unwrap_or(0.0));
        let center = servicer.center_of_mass_and_end_effector(&angles).0;
        let (turn, position) = (self.bus(node), self.position(node));
        let place = |point: Vector3<f64>| position + turn * (point - center);
        let bus = edges(&servicer.bus_half_extents_m, place);
        let (mut at, mut pose) = (servicer.arm_base_m, Rotation3::identity());
        let mut arm = vec![place(at)];
        for (link, angle) in servicer.links.iter().zip(given) {
            pose *= Rotation3::from_axis_angle(&Unit::new_normalize(link.axis), *angle);
            at += pose * link.tip_m;
            arm.push(place(at));
        }
        (bus, arm)
    }
}

/// The twelve edges of a box, its corners placed.
fn edges(
    half: &Vector3<f64>,
    place: impl Fn(Vector3<f64>) -> Vector3<f64>,
) -> Vec<[Vector3<f64>; 2]> {
    let corner = |bits: usize| {
        let sign = |i: usize| if bits >> i & 1 == 1 { 1.0 } else { -1.0 };
        place(Vector3::from_fn(|i, _| sign(i) * half[i]))
    };
    let pairs = (0..8).flat_map(|from: usize| (0..3).map(move |i| (from, from | 1 << i)));
    pairs.filter(|(from, to)| from != to).map(|(from, to)| [corner(from), corner(to)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::ScenarioSet;
    use crate::memory::on_large_stack;
    use crate::method::{Integrator, Method, Mode};
    use crate::planning::Planner;
    use crate::request::PlanRequest;

    #[test]
    fn a_plan_is_drawn_with_all_that_has_limits() {
        let mission = Mission::default();
        let scenario = ScenarioSet::built_in().unwrap().scenarios[0].clone();
        let method =
            Method { mode: Mode::Feasible, integrator: Integrator::Euler, ..Method::default() };
        let request = PlanRequest { method, ..PlanRequest::default() };
        let plan = || Planner::new().plan(&request, &scenario).file;
        let plan = on_large_stack(plan).unwrap();
        let drawn = svg(&plan, &mission).unwrap();
        for text in ["<title>pub-000", "bus torque", "joint rate", "off the boresight", "keep-out"]
        {
            assert!(drawn.contains(text), "{text}");
        }
        assert_eq!(drawn, svg(&plan, &mission).unwrap());
        // The arm's end is where the planner has it: at the port.
        let grid = mission.own_grid();
        let view = View { plan: &plan, mission: &mission, grid };
        let tip = *view.servicer(view.grid.last()).1.last().unwrap();
        let port = view.target(view.grid.last()) * mission.target.port_position_m;
        assert!((tip - port).norm() < 1e-3, "{tip} {port}");
        assert_eq!(view.target_edges().len(), 12);
    }
}
