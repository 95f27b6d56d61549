//! A plan as a picture: the manoeuvre in the plane of approach, and all that has limits over time.

mod drawing;
mod scene;

use crate::error::Error;
use crate::formats::{MAX_JOINTS, Mission, PlanFile, Verdict};
use crate::report::plot::{Panel, Sheet};
use drawing::Drawing;
use remora_core::advanced::model::signed_distance_to_box;
use scene::Scene;

/// Milliradians of a radian, and newton metres in thousandths.
const MILLI: f64 = 1e3;

/// The picture of a plan as the text of an SVG file.
///
/// # Errors
/// Where it cannot be drawn.
pub fn svg(plan: &PlanFile, mission: &Mission) -> Result<String, Error> {
    let named = plan.inputs.scenario.named(&plan.scenario);
    let scene = Scene { plan, mission, grid: mission.grid(&named.scenario()) };
    let title = format!("{}: {} ({})", plan.scenario, verdict(plan), plan.integrator);
    let (picture, height) = Drawing::new(&scene).elements(&title);
    Sheet { title, picture, height, panels: scene.panels() }.svg()
}

fn verdict(plan: &PlanFile) -> String {
    plan.verdict.map_or("a plan", Verdict::words).into()
}

const RTN: [&str; 3] = ["R", "T", "N"];
const AXES: [&str; 3] = ["x", "y", "z"];
const JOINTS: [&str; MAX_JOINTS] = ["1", "2", "3", "4", "5", "6", "7"];

/// A line of a panel: its name and its points.
type Line = (String, Vec<(f64, f64)>);

/// A panel with lines of limits and, where something begins at one, a moment.
fn panel(title: &str, limits: Vec<f64>, lines: Vec<Line>, moment: Option<f64>) -> Panel {
    Panel { title: title.into(), lines, limits, moment }
}

/// Limits of either sign.
fn both(scale: f64, limits: &[f64]) -> Vec<f64> {
    limits.iter().flat_map(|limit| [-scale * limit, scale * limit]).collect()
}

impl Scene<'_> {
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
                "force [N]",
                both(1.0, limits.as_slice()),
                self.held_axes(&RTN, &|k, i| force[k][i]),
                None,
            ),
            panel(
                "distance to the target [m]",
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
                "bus torque [mN m]",
                both(MILLI, s.bus_torque_limit_n_m.as_slice()),
                self.held_axes(&AXES, &|k, i| MILLI * reorientation.bus_torque[k][i]),
                None,
            ),
            panel(
                "joint torque [mN m]",
                both(MILLI, &s.joint_torque_limit_n_m.as_slice()[..joints]),
                self.held_axes(&JOINTS[..joints], &|k, i| MILLI * reorientation.joint_torque[k][i]),
                preset,
            ),
            panel(
                "joint angle [deg]",
                stops.collect(),
                self.node_axes(&JOINTS[..joints], &|k, i| {
                    reorientation.joint_angle[k][i].to_degrees()
                }),
                preset,
            ),
            panel(
                "joint rate [mrad/s]",
                both(MILLI, &s.joint_rate_limit_rad_s.as_slice()[..joints]),
                self.node_axes(&JOINTS[..joints], &|k, i| MILLI * reorientation.joint_rate[k][i]),
                preset,
            ),
            panel(
                "bus rate [mrad/s]",
                vec![],
                self.node_axes(&RTN, &|k, i| MILLI * reorientation.rate[k][i]),
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
    fn held_axes(&self, names: &[&str], value: &dyn Fn(usize, usize) -> f64) -> Vec<Line> {
        let line = |(i, name): (usize, &&str)| self.held(name, |k| value(k, i));
        names.iter().enumerate().map(line).collect()
    }

    /// States of axes or joints.
    fn node_axes(&self, names: &[&str], value: &dyn Fn(usize, usize) -> f64) -> Vec<Line> {
        let line = |(i, name): (usize, &&str)| self.over_nodes(name, |k| value(k, i));
        names.iter().enumerate().map(line).collect()
    }

    /// Centre of mass to the target's box [m].
    fn distance(&self, node: usize) -> f64 {
        let local = self.target_turn(node).transpose() * self.position(node);
        signed_distance_to_box(&self.mission.target.half_extents_m, &local).value
    }

    /// Angle between the boresight and the line of sight to the port [deg].
    fn off_boresight(&self, node: usize) -> f64 {
        let port = self.target_turn(node) * self.mission.target.port_position_m;
        let sight = (port - self.position(node)).normalize();
        let boresight = self.bus_turn(node) * self.mission.servicer.boresight;
        sight.dot(&boresight).clamp(-1.0, 1.0).acos().to_degrees()
    }
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
        for text in [
            "<title>pub-000",
            "bus torque [mN m]",
            "joint rate [mrad/s]",
            "off the boresight [deg]",
            "keep-out",
            "towards the start [m]",
            "time [s]",
            ">0 s</text>",
            ">1200 s</text>",
            "limit 2.5 not shown",
            "prefers-color-scheme:dark",
        ] {
            assert!(drawn.contains(text), "{text}");
        }
        assert!(!drawn.contains(">-0<") && !drawn.contains("-0.0\n") && !drawn.contains("NaN"));
        assert_eq!(drawn, svg(&plan, &mission).unwrap());
        // The arm's end is where the planner has it: at the port.
        let scene = Scene { plan: &plan, mission: &mission, grid: mission.own_grid() };
        let poses = scene.poses();
        let (first, pose) = (&poses[0], &poses[poses.len() - 1]);
        assert_eq!((first.time_s, pose.time_s), (0.0, 1200.0));
        let [port, _] = scene.port();
        let end = pose.links[2].ends[1];
        assert!((end - port).norm() < 1e-3, "{end} {port}");
        assert_eq!(pose.links.len(), 3);
    }
}
