//! One trajectory of a dataset, and its bytes.

use remora_core::advanced::stages::{NODES, size};
use remora_host::formats::PlanFile;
use serde::{Deserialize, Serialize};
use std::ops::{Index, IndexMut};

/// Numbers of a record of an arm of so many joints.
const fn numbers_of(joints: usize) -> usize {
    let target_and_path = 4 + 3 + 9;
    NODES * (target_and_path + state_size(joints) + size::controls(joints))
}

/// A trajectory as it stands in a shard, in postcard.
#[derive(Serialize, Deserialize)]
struct Record {
    scenario: u64,
    iterations: u32,
    cost: f64,
    /// All rows, one quantity after the other.
    numbers: Vec<f32>,
}

/// Numbers of a Stage 2 state: attitude `(x, y, z, w)`, joint angles, bus rate, joint rates.
pub(super) const fn state_size(joints: usize) -> usize {
    7 + 2 * joints
}

/// The two-stage plan of one scenario, as a network learns it: SI units, in the frames of the plan
/// file, f32. About 8.4 kB for three joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// Index of the scenario in its seed.
    pub scenario: u64,
    /// Iterations that Stage 2 took from the heuristic start.
    pub iterations: u32,
    /// Cost of Stage 2.
    pub cost: f64,
    /// Target attitude, body to RTN, `(x, y, z, w)`.
    pub target_attitude: [[f32; 4]; NODES],
    /// Target angular velocity relative to RTN, in RTN [rad/s].
    pub target_rate: [[f32; 3]; NODES],
    /// Position of the system's centre of mass in RTN [m].
    pub position: [[f32; 3]; NODES],
    /// Its velocity relative to RTN, in RTN [m/s].
    pub velocity: [[f32; 3]; NODES],
    /// Force in RTN [N]; the last is zero.
    pub force: [[f32; 3]; NODES],
    /// Bus attitude, `(x, y, z, w)`.
    pub attitude: [[f32; 4]; NODES],
    /// Joint angles [rad].
    pub joint_angle: JointRows,
    /// Bus rate relative to RTN, in RTN [rad/s].
    pub rate: [[f32; 3]; NODES],
    /// Joint rates [rad/s].
    pub joint_rate: JointRows,
    /// Bus torque in bus axes [N m]; the last is zero.
    pub bus_torque: [[f32; 3]; NODES],
    /// Joint torques [N m]; the last are zero.
    pub joint_torque: JointRows,
}

impl Trajectory {
    /// Most bytes of a record of an arm of so many joints, by some bytes.
    pub const fn bytes(joints: usize) -> usize {
        20 + Self::least_bytes(joints) as usize
    }

    /// Fewest bytes of such a record: those of its numbers.
    pub(super) const fn least_bytes(joints: usize) -> u64 {
        4 * numbers_of(joints) as u64
    }

    /// Storage for an arm of so many joints, to be filled.
    fn zero(joints: usize) -> Self {
        Self {
            scenario: 0,
            iterations: 0,
            cost: 0.0,
            target_attitude: [[0.0; 4]; NODES],
            target_rate: [[0.0; 3]; NODES],
            position: [[0.0; 3]; NODES],
            velocity: [[0.0; 3]; NODES],
            force: [[0.0; 3]; NODES],
            attitude: [[0.0; 4]; NODES],
            joint_angle: JointRows::zero(joints),
            rate: [[0.0; 3]; NODES],
            joint_rate: JointRows::zero(joints),
            bus_torque: [[0.0; 3]; NODES],
            joint_torque: JointRows::zero(joints),
        }
    }

    /// The trajectory of a plan, rounded to f32.
    pub fn new(scenario: u64, plan: &PlanFile) -> Self {
        let (one, two) = (&plan.stage1, &plan.stage2);
        let iterations = u32::try_from(two.iterations).unwrap_or(u32::MAX);
        let cost = two.cost;
        let mut t = Self { scenario, iterations, cost, ..Self::zero(plan.inputs.mission.joints()) };
        Field::of(&mut t.target_attitude).fill(&plan.target.attitude);
        Field::of(&mut t.target_rate).fill(&plan.target.rate);
        Field::of(&mut t.position).fill(&one.position);
        Field::of(&mut t.velocity).fill(&one.velocity);
        Field::of(&mut t.force).fill(&one.force);
        Field::of(&mut t.attitude).fill(&two.attitude);
        t.joint_angle.field().fill(&two.joint_angle);
        Field::of(&mut t.rate).fill(&two.rate);
        t.joint_rate.field().fill(&two.joint_rate);
        Field::of(&mut t.bus_torque).fill(&two.bus_torque);
        t.joint_torque.field().fill(&two.joint_torque);
        t
    }

    /// Joints of its arm.
    pub fn joints(&self) -> usize {
        self.joint_angle.joints
    }

    /// The first quantity in which another differs, bit by bit.
    pub(super) fn differs(&self, other: &Self) -> Option<&'static str> {
        let bits = |trajectory: &Self| {
            let groups = trajectory.clone().groups().map(|group| gathered([group]));
            groups.map(|numbers| numbers.into_iter().map(f32::to_bits).collect::<Vec<_>>())
        };
        let counted = [
            ("scenario", self.scenario != other.scenario),
            ("iterations", self.iterations != other.iterations),
            ("cost", self.cost.to_bits() != other.cost.to_bits()),
        ];
        let named =
            ["target_attitude", "target_rate", "position", "velocity", "force", "state", "control"];
        let numbers = named.into_iter().zip(bits(self).into_iter().zip(bits(other)));
        let numbers = numbers.map(|(name, (one, other))| (name, one != other));
        counted.into_iter().chain(numbers).find(|(_, is_other)| *is_other).map(|(name, _)| name)
    }

    /// All its numbers in the order of the record: groups one after the other, a row of each field of a
    /// group in turn.
    fn groups(&mut self) -> [Vec<Field<'_>>; 7] {
        let states = vec![
            Field::of(&mut self.attitude),
            self.joint_angle.field(),
            Field::of(&mut self.rate),
            self.joint_rate.field(),
        ];
        [
            vec![Field::of(&mut self.target_attitude)],
            vec![Field::of(&mut self.target_rate)],
            vec![Field::of(&mut self.position)],
            vec![Field::of(&mut self.velocity)],
            vec![Field::of(&mut self.force)],
            states,
            vec![Field::of(&mut self.bus_torque), self.joint_torque.field()],
        ]
    }

    /// Adds the record's bytes: see [`Record`].
    pub(super) fn encode(&self, out: Vec<u8>) -> Result<Vec<u8>, postcard::Error> {
        let &Self { scenario, iterations, cost, .. } = self;
        let numbers = gathered(self.clone().groups());
        Record { scenario, iterations, cost, numbers }.encode(out)
    }

    /// The trajectory of an arm of so many joints that bytes begin with, and what is behind it.
    pub(super) fn decode(bytes: &[u8], joints: usize) -> Result<(Self, &[u8]), String> {
        let (record, rest) = Record::decode(bytes, numbers_of(joints))?;
        let Record { scenario, iterations, cost, numbers } = record;
        let mut t = Self { scenario, iterations, cost, ..Self::zero(joints) };
        deal(t.groups(), &numbers);
        Ok((t, rest))
    }
}

/// A number a joint, for each node.
#[derive(Clone, Debug, PartialEq)]
pub struct JointRows {
    numbers: Vec<f32>,
    joints: usize,
}

impl JointRows {
    fn zero(joints: usize) -> Self {
        Self { numbers: vec![0.0; NODES * joints], joints }
    }

    fn field(&mut self) -> Field<'_> {
        Field { numbers: &mut self.numbers, width: self.joints }
    }
}

impl Index<usize> for JointRows {
    type Output = [f32];

    fn index(&self, node: usize) -> &[f32] {
        &self.numbers[node * self.joints..][..self.joints]
    }
}

impl IndexMut<usize> for JointRows {
    fn index_mut(&mut self, node: usize) -> &mut [f32] {
        &mut self.numbers[node * self.joints..][..self.joints]
    }
}

/// The rows of one quantity.
struct Field<'a> {
    numbers: &'a mut [f32],
    width: usize,
}

impl<'a> Field<'a> {
    fn of<const W: usize>(rows: &'a mut [[f32; W]]) -> Self {
        Self { numbers: rows.as_flattened_mut(), width: W }
    }

    fn row(&mut self, node: usize) -> &mut [f32] {
        &mut self.numbers[node * self.width..][..self.width]
    }

    /// Takes over rows, rounded.
    fn fill<R: AsRef<[f64]>>(self, from: &[R]) {
        for (to, from) in self.numbers.chunks_exact_mut(self.width).zip(from) {
            to.iter_mut().zip(from.as_ref()).for_each(|(to, from)| *to = *from as f32);
        }
    }
}

/// All numbers of the groups.
fn gathered<'a>(groups: impl IntoIterator<Item = Vec<Field<'a>>>) -> Vec<f32> {
    let mut numbers = Vec::new();
    for mut group in groups {
        for node in 0..NODES {
            group.iter_mut().for_each(|field| numbers.extend_from_slice(field.row(node)));
        }
    }
    numbers
}

/// Gives the groups their numbers, of which there are as many.
fn deal(groups: [Vec<Field<'_>>; 7], mut numbers: &[f32]) {
    for mut group in groups {
        for node in 0..NODES {
            for field in &mut group {
                let (row, rest) = numbers.split_at(field.width);
                field.row(node).copy_from_slice(row);
                numbers = rest;
            }
        }
    }
}

impl Record {
    fn encode(&self, out: Vec<u8>) -> Result<Vec<u8>, postcard::Error> {
        postcard::to_extend(self, out)
    }

    /// The record of so many numbers that bytes begin with, and what is behind it.
    fn decode(bytes: &[u8], expected: usize) -> Result<(Self, &[u8]), String> {
        let (record, rest) = postcard::take_from_bytes::<Self>(bytes)
            .map_err(|error| format!("holds a record that is none: {error}"))?;
        record.checked(expected).map(|record| (record, rest))
    }

    /// Refuses another number of numbers, and what is none: a network would learn nothing any more.
    fn checked(self, expected: usize) -> Result<Self, String> {
        let found = self.numbers.len();
        if found != expected {
            return Err(format!("has records of {found} numbers; a trajectory has {expected}"));
        }
        match self.cost.is_finite() && self.numbers.iter().all(|x| x.is_finite()) {
            true => Ok(self),
            false => Err(format!("scenario {} holds what is no number", self.scenario)),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A trajectory whose numbers all differ.
    pub(crate) fn counting(scenario: u64, joints: usize) -> Trajectory {
        let zero = Trajectory::zero(joints);
        let mut t = Trajectory { scenario, iterations: 9, cost: 0.25, ..zero };
        let number = |i| scenario as f32 * 1e4 + i as f32;
        deal(t.groups(), &(0..numbers_of(joints)).map(number).collect::<Vec<_>>());
        t
    }

    #[test]
    fn a_record_holds_every_number_in_its_documented_place() {
        let t = counting(3, 3);
        let bytes = t.encode(vec![7]).unwrap();
        // Scenario, iterations, cost, number of numbers; then they.
        assert_eq!((bytes.len(), Trajectory::bytes(3)), (1 + 12 + 8400, 8420));
        assert_eq!(bytes[..3], [7, 3, 9]);
        assert_eq!(bytes[3..11], 0.25f64.to_le_bytes());
        assert_eq!(bytes[11..13], [0b1011_0100, 0b1_0000], "2100");
        assert_eq!(bytes[13..17], 3e4f32.to_le_bytes());
        assert_eq!(Trajectory::decode(&bytes[1..], 3), Ok((t.clone(), &[][..])));
        let first = [0, 240, 420, 600, 780, 960, 1740].map(|i| 3e4 + i as f32);
        let found = [
            t.target_attitude[0][0],
            t.target_rate[0][0],
            t.position[0][0],
            t.velocity[0][0],
            t.force[0][0],
            t.attitude[0][0],
            t.bus_torque[0][0],
        ];
        assert_eq!(found, first);
        assert_eq!(t.joint_torque[59][2], 3e4 + 2099.0);
        assert!(Trajectory::decode(&bytes[1..100], 3).is_err());
    }

    #[test]
    fn what_is_no_number_is_refused() {
        let reason = |change: &dyn Fn(&mut Trajectory)| {
            let mut t = counting(3, 3);
            change(&mut t);
            let now = Trajectory::decode(&t.encode(Vec::new()).unwrap(), 3).map(drop);
            now.err().unwrap_or_default()
        };
        assert_eq!(reason(&|_| ()), "");
        assert_eq!(reason(&|t| t.rate[7][1] = f32::NAN), "scenario 3 holds what is no number");
        assert_eq!(reason(&|t| t.cost = f64::INFINITY), "scenario 3 holds what is no number");
    }

    /// A row a joint more or less, and nothing else.
    #[test]
    fn arms_of_any_number_of_joints_have_their_record() {
        for joints in [1, 2, 7] {
            let t = counting(1, joints);
            assert_eq!(t.joints(), joints);
            let bytes = t.encode(Vec::new()).unwrap();
            assert_eq!(bytes.len(), 12 + 240 * (26 + 3 * joints));
            assert_eq!(Trajectory::decode(&bytes, joints), Ok((t.clone(), &[][..])));
            let state = 1e4 + 960.0;
            assert_eq!(t.joint_angle[0][0], state + 4.0);
            assert_eq!(t.joint_rate[0][joints - 1], state + (7 + 2 * joints - 1) as f32);
            assert_eq!(t.attitude[1][0], state + (7 + 2 * joints) as f32);
        }
        let bytes = counting(1, 2).encode(Vec::new()).unwrap();
        let reason = Trajectory::decode(&bytes, 3).unwrap_err();
        assert_eq!(reason, "has records of 1920 numbers; a trajectory has 2100");
    }

    #[test]
    fn a_plan_becomes_states_and_controls_in_the_order_of_the_core() {
        let rows = |n: usize, at: f64| vec![[at, at + 1.0, at + 2.0]; n];
        let joints = |n: usize, at: f64| vec![vec![at, at + 1.0, at + 2.0]; n];
        let mut plan = crate::dataset::tests::plan();
        plan.stage2.attitude = vec![[0.1, 0.2, 0.3, 0.4]; 60];
        plan.stage2.joint_angle = joints(60, 10.0);
        plan.stage2.rate = rows(60, 20.0);
        plan.stage2.joint_rate = joints(60, 30.0);
        plan.stage2.bus_torque = rows(59, 40.0);
        plan.stage2.joint_torque = joints(59, 50.0);
        let t = Trajectory::new(7, &plan);
        assert_eq!((t.attitude[59], t.rate[59]), ([0.1, 0.2, 0.3, 0.4], [20.0, 21.0, 22.0]));
        assert_eq!(t.joint_angle[59], [10.0, 11.0, 12.0]);
        assert_eq!(t.joint_rate[59], [30.0, 31.0, 32.0]);
        assert_eq!(t.bus_torque[58], [40.0, 41.0, 42.0]);
        assert_eq!(t.joint_torque[58], [50.0, 51.0, 52.0]);
        assert_eq!(
            (t.bus_torque[59], &t.joint_torque[59], t.force[59]),
            ([0.0; 3], &[0.0; 3][..], [0.0; 3])
        );
        assert_eq!((t.scenario, u64::from(t.iterations)), (7, plan.stage2.iterations));
        assert_eq!(t.cost, plan.stage2.cost);
    }
}
