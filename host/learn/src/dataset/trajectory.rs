//! One trajectory of a dataset, and its bytes.

use remora_core::advanced::stages::{LINKS, NODES, size};
use remora_host::formats::PlanFile;

/// Numbers of a Stage 2 state: attitude `(x, y, z, w)`, joint angles, bus rate, joint rates.
pub const STATE: usize = 7 + 2 * LINKS;

/// Numbers of a Stage 2 control: bus torque, joint torques.
pub const CONTROL: usize = size::NU;

/// The two-stage plan of one scenario, as a network learns it: SI units, in the frames of the plan
/// file, f32. About 8.4 kB.
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
    /// Bus attitude, joint angles [rad], bus rate relative to RTN in RTN [rad/s], joint rates
    /// [rad/s].
    pub states: [[f32; STATE]; NODES],
    /// Bus torque in bus axes and joint torques [N m]; the last is zero.
    pub controls: [[f32; CONTROL]; NODES],
}

impl Trajectory {
    /// Size of a record [bytes].
    pub const BYTES: usize = 20 + 4 * NODES * (4 + 3 + 9 + STATE + CONTROL);

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
        states: [[0.0; STATE]; NODES],
        controls: [[0.0; CONTROL]; NODES],
    };

    /// The trajectory of a plan, rounded to f32.
    pub fn new(scenario: u64, plan: &PlanFile) -> Self {
        let (one, two) = (&plan.stage1, &plan.stage2);
        let iterations = u32::try_from(two.iterations).unwrap_or(u32::MAX);
        let mut t = Self { scenario, iterations, cost: two.cost, ..Self::ZERO };
        fill(&mut t.target_attitude, 0, &plan.target.attitude);
        fill(&mut t.target_rate, 0, &plan.target.rate);
        fill(&mut t.position, 0, &one.position);
        fill(&mut t.velocity, 0, &one.velocity);
        fill(&mut t.force, 0, &one.force);
        fill(&mut t.states, 0, &two.attitude);
        fill(&mut t.states, 4, &two.joint_angle);
        fill(&mut t.states, 4 + LINKS, &two.rate);
        fill(&mut t.states, 7 + LINKS, &two.joint_rate);
        fill(&mut t.controls, 0, &two.bus_torque);
        fill(&mut t.controls, 3, &two.joint_torque);
        t
    }

    /// Adds the record's bytes.
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.extend(self.scenario.to_le_bytes());
        out.extend(self.iterations.to_le_bytes());
        out.extend(self.cost.to_le_bytes());
        let numbers: [&[f32]; 7] = [
            self.target_attitude.as_flattened(),
            self.target_rate.as_flattened(),
            self.position.as_flattened(),
            self.velocity.as_flattened(),
            self.force.as_flattened(),
            self.states.as_flattened(),
            self.controls.as_flattened(),
        ];
        out.extend(numbers.into_iter().flatten().flat_map(|x| x.to_le_bytes()));
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
        let numbers: [&mut [f32]; 7] = [
            t.target_attitude.as_flattened_mut(),
            t.target_rate.as_flattened_mut(),
            t.position.as_flattened_mut(),
            t.velocity.as_flattened_mut(),
            t.force.as_flattened_mut(),
            t.states.as_flattened_mut(),
            t.controls.as_flattened_mut(),
        ];
        let (bytes, _) = rest.as_chunks();
        for (x, bytes) in numbers.into_iter().flatten().zip(bytes) {
            *x = f32::from_le_bytes(*bytes);
        }
        Some(t)
    }
}

/// Rounds `from` into the columns of `to` that begin at `column`.
fn fill<R: AsRef<[f64]>, const W: usize>(to: &mut [[f32; W]], column: usize, from: &[R]) {
    for (to, from) in to.iter_mut().zip(from) {
        to.iter_mut().skip(column).zip(from.as_ref()).for_each(|(to, from)| *to = *from as f32);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A trajectory whose numbers all differ.
    pub(crate) fn counting(scenario: u64) -> Trajectory {
        let mut bytes = Vec::new();
        Trajectory { scenario, iterations: 9, cost: 0.25, ..Trajectory::ZERO }.encode(&mut bytes);
        let (numbers, _) = bytes[20..].as_chunks_mut();
        for (i, number) in numbers.iter_mut().enumerate() {
            *number = (scenario as f32 * 1e4 + i as f32).to_le_bytes();
        }
        Trajectory::decode(&bytes).unwrap()
    }

    #[test]
    fn a_record_holds_every_number_in_its_documented_place() {
        let t = counting(3);
        let mut bytes = Vec::new();
        t.encode(&mut bytes);
        assert_eq!((bytes.len(), Trajectory::BYTES), (8420, 8420));
        assert_eq!(Trajectory::decode(&bytes), Some(t.clone()));
        assert_eq!(bytes[..12], [3, 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0]);
        let first = [0, 240, 420, 600, 780, 960, 1740].map(|i| 3e4 + i as f32);
        let found = [
            t.target_attitude[0][0],
            t.target_rate[0][0],
            t.position[0][0],
            t.velocity[0][0],
            t.force[0][0],
            t.states[0][0],
            t.controls[0][0],
        ];
        assert_eq!(found, first);
        assert_eq!(t.controls[59][5], 3e4 + 2099.0);
        assert_eq!(Trajectory::decode(&bytes[1..]), None);
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
        let state = [0.1, 0.2, 0.3, 0.4, 10.0, 11.0, 12.0, 20.0, 21.0, 22.0, 30.0, 31.0, 32.0];
        assert_eq!(t.states[59], state);
        assert_eq!(t.controls[58], [40.0, 41.0, 42.0, 50.0, 51.0, 52.0]);
        assert_eq!((t.controls[59], t.force[59]), ([0.0; 6], [0.0; 3]));
        assert_eq!((t.scenario, u64::from(t.iterations)), (7, plan.stage2.iterations));
        assert_eq!(t.cost, plan.stage2.cost);
    }
}
