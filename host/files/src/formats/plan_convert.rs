//! Between the rows of plan files and the core's trajectories.

use super::plan_file::{PlanStage1, PlanStage2, PlanTarget};
use super::{JointVector, Motion, Status, each};
use nalgebra::{Vector3, Vector4};
use remora_core::advanced::model::TargetState;
use remora_core::advanced::stages::{NODES, TranslationTrajectory};

fn rows<T, const M: usize>(items: &[T], row: impl Fn(&T) -> [f64; M]) -> Vec<[f64; M]> {
    items.iter().map(row).collect()
}

fn joint_rows<T>(items: &[T], joints: usize, row: impl Fn(&T) -> &JointVector) -> Vec<Vec<f64>> {
    items.iter().map(|item| row(item).iter().take(joints).copied().collect()).collect()
}

/// The first of them; all where there are no more.
fn first<T>(items: &[T], count: usize) -> &[T] {
    items.get(..count).unwrap_or(items)
}

/// How a stage ended, for either stage's section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageEnd {
    /// The status.
    pub status: Status,
    /// Iterations.
    pub iterations: u64,
    /// Cost.
    pub cost: f64,
    /// Time of the whole stage [s].
    pub time_s: f64,
}

impl PlanStage1 {
    /// The section of the first `nodes` nodes of a trajectory.
    pub fn new(end: StageEnd, nodes: usize, t: &TranslationTrajectory<NODES>) -> Self {
        let StageEnd { status, iterations, cost, time_s } = end;
        Self {
            status,
            iterations,
            cost,
            time_s,
            position: rows(first(&t.position, nodes), |v| (*v).into()),
            velocity: rows(first(&t.velocity, nodes), |v| (*v).into()),
            force: rows(first(&t.force, nodes - 1), |v| (*v).into()),
        }
    }

    /// The trajectory of the file's rows, whose number has been checked.
    pub fn trajectory(&self) -> TranslationTrajectory<NODES> {
        let mut t = TranslationTrajectory::ZERO;
        fill(&mut t.position, &self.position, |at, row| *at = Vector3::from(*row));
        fill(&mut t.velocity, &self.velocity, |at, row| *at = Vector3::from(*row));
        fill(&mut t.force, &self.force, |at, row| *at = Vector3::from(*row));
        t
    }
}

impl PlanStage2 {
    /// The section of the first `nodes` nodes of a trajectory of an arm of so many joints.
    pub fn new(end: StageEnd, inference_s: f64, nodes: usize, joints: usize, t: &Motion) -> Self {
        let StageEnd { status, iterations, cost, time_s } = end;
        let (states, controls) = (first(&t.states, nodes), first(&t.controls, nodes - 1));
        Self {
            status,
            iterations,
            cost,
            time_s,
            inference_s,
            attitude: rows(states, |x| x.attitude.into()),
            joint_angle: joint_rows(states, joints, |x| &x.joint_angle),
            rate: rows(states, |x| x.rate.into()),
            joint_rate: joint_rows(states, joints, |x| &x.joint_rate),
            bus_torque: rows(controls, |u| u.bus_torque.into()),
            joint_torque: joint_rows(controls, joints, |u| &u.joint_torque),
        }
    }

    /// The trajectory of the file's rows, whose number has been checked.
    pub fn trajectory(&self) -> Motion {
        let mut t = Motion::ZERO;
        let states: &mut [_] = &mut t.states;
        fill(states, &self.attitude, |x, row| x.attitude = Vector4::from(*row));
        fill(states, &self.joint_angle, |x, row| x.joint_angle = each(row));
        fill(states, &self.rate, |x, row| x.rate = Vector3::from(*row));
        fill(states, &self.joint_rate, |x, row| x.joint_rate = each(row));
        let controls: &mut [_] = &mut t.controls;
        fill(controls, &self.bus_torque, |u, row| u.bus_torque = Vector3::from(*row));
        fill(controls, &self.joint_torque, |u, row| u.joint_torque = each(row));
        t
    }
}

fn fill<T, R>(items: &mut [T], rows: &[R], set: impl Fn(&mut T, &R)) {
    items.iter_mut().zip(rows).for_each(|(item, row)| set(item, row));
}

impl PlanTarget {
    /// The nodes of the file's rows, whose number has been checked.
    pub fn nodes(&self) -> [TargetState; NODES] {
        let mut nodes = [TargetState::ZERO; NODES];
        fill(&mut nodes, &self.attitude, |x, row| x.attitude = Vector4::from(*row));
        fill(&mut nodes, &self.rate, |x, row| x.rate = Vector3::from(*row));
        nodes
    }
}

impl From<&[TargetState]> for PlanTarget {
    fn from(nodes: &[TargetState]) -> Self {
        Self { attitude: rows(nodes, |x| x.attitude.into()), rate: rows(nodes, |x| x.rate.into()) }
    }
}
