//! One trajectory of a dataset, and its bytes.

use remora_core::advanced::stages::{LINKS, NODES, size};
use remora_host::formats::PlanFile;

/// Size of a record of an arm of so many joints [bytes].
pub(super) const fn record_bytes(joints: usize) -> usize {
    let target_and_path = 4 + 3 + 9;
    20 + 4 * NODES * (target_and_path + state_size(joints) + size::controls(joints))
}

/// Numbers of a Stage 2 state: attitude `(x, y, z, w)`, joint angles, bus rate, joint rates.
pub(super) const fn state_size(joints: usize) -> usize {
    7 + 2 * joints
}

/// The two-stage plan of one scenario, as a network learns it: SI units, in the frames of the plan
/// file, f32. About 8.4 kB for three joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory<const NL: usize = LINKS> {
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
    pub joint_angle: [[f32; NL]; NODES],
    /// Bus rate relative to RTN, in RTN [rad/s].
    pub rate: [[f32; 3]; NODES],
    /// Joint rates [rad/s].
    pub joint_rate: [[f32; NL]; NODES],
    /// Bus torque in bus axes [N m]; the last is zero.
    pub bus_torque: [[f32; 3]; NODES],
    /// Joint torques [N m]; the last are zero.
    pub joint_torque: [[f32; NL]; NODES],
}

impl<const NL: usize> Trajectory<NL> {
    /// Size of a record [bytes].
    pub const BYTES: usize = record_bytes(NL);

    /// Placeholder for storage that is filled later.
    const ZERO: Self = Self {
        scenario: 0,
        iterations: 0,
        cost: 0.0,
        target_attitude: [[0.0; 4]; NODES],
        target_rate: [[0.0; 3]; NODES],
        position: [[0.0; 3]; NODES],
        velocity: [[0.0; 3]; NODES],
        force: [[0.0; 3]; NODES],
        attitude: [[0.0; 4]; NODES],
        joint_angle: [[0.0; NL]; NODES],
        rate: [[0.0; 3]; NODES],
        joint_rate: [[0.0; NL]; NODES],
        bus_torque: [[0.0; 3]; NODES],
        joint_torque: [[0.0; NL]; NODES],
    };

    /// The trajectory of a plan for an arm of so many joints, rounded to f32.
    pub fn new(scenario: u64, plan: &PlanFile) -> Self {
        let (one, two) = (&plan.stage1, &plan.stage2);
        let iterations = u32::try_from(two.iterations).unwrap_or(u32::MAX);
        let mut t = Self { scenario, iterations, cost: two.cost, ..Self::ZERO };
        fill(&mut t.target_attitude, &plan.target.attitude);
        fill(&mut t.target_rate, &plan.target.rate);
        fill(&mut t.position, &one.position);
        fill(&mut t.velocity, &one.velocity);
        fill(&mut t.force, &one.force);
        fill(&mut t.attitude, &two.attitude);
        fill(&mut t.joint_angle, &two.joint_angle);
        fill(&mut t.rate, &two.rate);
        fill(&mut t.joint_rate, &two.joint_rate);
        fill(&mut t.bus_torque, &two.bus_torque);
        fill(&mut t.joint_torque, &two.joint_torque);
        t
    }

    /// All its numbers in the order of the record, for reading and for writing.
    fn numbers(&mut self) -> impl Iterator<Item = &mut f32> {
        let rows = [
            self.target_attitude.as_flattened_mut(),
            self.target_rate.as_flattened_mut(),
            self.position.as_flattened_mut(),
            self.velocity.as_flattened_mut(),
            self.force.as_flattened_mut(),
        ];
        let poses = self.attitude.iter_mut().zip(&mut self.joint_angle);
        let rates = self.rate.iter_mut().zip(&mut self.joint_rate);
        let states = poses.zip(rates).flat_map(|((attitude, angle), (rate, joint_rate))| {
            attitude.iter_mut().chain(angle).chain(rate).chain(joint_rate)
        });
        let torques = self.bus_torque.iter_mut().zip(&mut self.joint_torque);
        let controls = torques.flat_map(|(bus, joint)| bus.iter_mut().chain(joint));
        rows.into_iter().flatten().chain(states).chain(controls)
    }

    /// Adds the record's bytes.
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.extend(self.scenario.to_le_bytes());
        out.extend(self.iterations.to_le_bytes());
        out.extend(self.cost.to_le_bytes());
        out.extend(self.clone().numbers().flat_map(|x| x.to_le_bytes()));
    }

    /// The trajectory of a record; `None` where its size is another.
    pub(super) fn decode(record: &[u8]) -> Option<Self> {
        if record.len() != Self::BYTES {
            return None;
        }
        let (scenario, rest) = record.split_first_chunk()?;
        let (iterations, rest) = rest.split_first_chunk()?;
        let (cost, rest) = rest.split_first_chunk()?;
        let mut t = Self {
            scenario: u64::from_le_bytes(*scenario),
            iterations: u32::from_le_bytes(*iterations),
            cost: f64::from_le_bytes(*cost),
            ..Self::ZERO
        };
        let (bytes, _) = rest.as_chunks();
        for (x, bytes) in t.numbers().zip(bytes) {
            *x = f32::from_le_bytes(*bytes);
        }
        Some(t)
    }
}

/// Rounds rows.
fn fill<R: AsRef<[f64]>, const W: usize>(to: &mut [[f32; W]], from: &[R]) {
    for (to, from) in to.iter_mut().zip(from) {
        to.iter_mut().zip(from.as_ref()).for_each(|(to, from)| *to = *from as f32);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A trajectory whose numbers all differ.
    pub(crate) fn counting<const NL: usize>(scenario: u64) -> Trajectory<NL> {
        let mut bytes = Vec::new();
        let empty = Trajectory { scenario, iterations: 9, cost: 0.25, ..Trajectory::<NL>::ZERO };
        empty.encode(&mut bytes);
        let (numbers, _) = bytes[20..].as_chunks_mut();
        for (i, number) in numbers.iter_mut().enumerate() {
            *number = (scenario as f32 * 1e4 + i as f32).to_le_bytes();
        }
        Trajectory::decode(&bytes).unwrap()
    }

    #[test]
    fn a_record_holds_every_number_in_its_documented_place() {
        let t: Trajectory = counting(3);
        let mut bytes = Vec::new();
        t.encode(&mut bytes);
        assert_eq!((bytes.len(), Trajectory::<LINKS>::BYTES), (8420, 8420));
        assert_eq!(Trajectory::decode(&bytes), Some(t.clone()));
        assert_eq!(bytes[..12], [3, 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0]);
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
        assert_eq!(Trajectory::<LINKS>::decode(&bytes[1..]), None);
    }

    /// A row a joint more or less, and nothing else.
    #[test]
    fn arms_of_any_number_of_joints_have_their_record() {
        fn round_trip<const NL: usize>() {
            let t: Trajectory<NL> = counting(1);
            let mut bytes = Vec::new();
            t.encode(&mut bytes);
            assert_eq!(bytes.len(), 20 + 240 * (26 + 3 * NL));
            assert_eq!(Trajectory::decode(&bytes), Some(t.clone()));
            let state = 1e4 + 960.0;
            assert_eq!(t.joint_angle[0][0], state + 4.0);
            assert_eq!(t.joint_rate[0][NL - 1], state + (7 + 2 * NL - 1) as f32);
            assert_eq!(t.attitude[1][0], state + (7 + 2 * NL) as f32);
        }
        round_trip::<1>();
        round_trip::<2>();
        round_trip::<7>();
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
        let t: Trajectory = Trajectory::new(7, &plan);
        assert_eq!((t.attitude[59], t.rate[59]), ([0.1, 0.2, 0.3, 0.4], [20.0, 21.0, 22.0]));
        assert_eq!(t.joint_angle[59], [10.0, 11.0, 12.0]);
        assert_eq!(t.joint_rate[59], [30.0, 31.0, 32.0]);
        assert_eq!(t.bus_torque[58], [40.0, 41.0, 42.0]);
        assert_eq!(t.joint_torque[58], [50.0, 51.0, 52.0]);
        assert_eq!(
            (t.bus_torque[59], t.joint_torque[59], t.force[59]),
            ([0.0; 3], [0.0; 3], [0.0; 3])
        );
        assert_eq!((t.scenario, u64::from(t.iterations)), (7, plan.stage2.iterations));
        assert_eq!(t.cost, plan.stage2.cost);
    }
}
