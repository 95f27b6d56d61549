//! A plan's input as numbers in the order of `remora.h`, for doors that read no JSON: the members of
//! `RemoraMission` and `RemoraScenario` after their sizes, then mode, integrator and substeps.

use nalgebra::SVector;
use remora_core::advanced::dynamics::Integrator;
use remora_core::advanced::model::{Field, FieldVisitor, Mission, Scenario, Start};
use remora_core::advanced::stages::{LINKS, Mode};
use std::fmt;

/// A number as C has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// 32 bits.
    Integer(u32),
    /// A double.
    Float(f64),
}

/// Numbers in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Numbers(pub Vec<Number>);

impl fmt::Display for Numbers {
    /// In one line; doubles have a point or an exponent, and the shortest text that means their bits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, number) in self.0.iter().enumerate() {
            f.write_str(if i == 0 { "" } else { " " })?;
            match number {
                Number::Integer(value) => write!(f, "{value}")?,
                Number::Float(value) => write!(f, "{value:?}")?,
            }
        }
        Ok(())
    }
}

impl FieldVisitor for Numbers {
    fn numbers(&mut self, _: Field, values: &mut [f64]) {
        self.0.extend(values.iter().map(|value| Number::Float(*value)));
    }

    fn word(&mut self, _: Field, value: &mut u32) {
        self.0.push(Number::Integer(*value));
    }
}

impl Numbers {
    /// All as doubles, for images.
    pub fn floats(&self) -> impl Iterator<Item = f64> {
        self.0.iter().map(|number| match number {
            Number::Integer(value) => f64::from(*value),
            Number::Float(value) => *value,
        })
    }

    fn count(mut self, value: u32) -> Self {
        self.0.push(Number::Integer(value));
        self
    }

    fn add<'a>(mut self, values: impl IntoIterator<Item = &'a f64>) -> Self {
        self.0.extend(values.into_iter().map(|value| Number::Float(*value)));
        self
    }

    /// Numbers of a mission.
    pub fn mission(mission: &Mission<LINKS>) -> Self {
        let (mut numbers, mut mission) = (Self::default(), *mission);
        mission.visit(&mut numbers);
        // A member of the structure that is not read.
        numbers.count(0)
    }

    /// Numbers of a scenario.
    pub fn scenario(scenario: &Scenario<LINKS>) -> Self {
        let Scenario { target_attitude, target_rate, position, velocity, start, duration, nodes } =
            scenario;
        let Start { bus_attitude, bus_rate, joint_angle, joint_rate } = start;
        Self::default()
            .count(nodes.unwrap_or(0) as u32)
            .add(target_attitude)
            .add(target_rate)
            .add(position)
            .add(velocity)
            .add(&[duration.unwrap_or(0.0)])
            .count(u32::from(bus_attitude.is_some()))
            .count(u32::from(joint_angle.is_some()))
            .add(&bus_attitude.unwrap_or_default())
            .add(bus_rate)
            .add(&joint_angle.unwrap_or_else(SVector::zeros))
            .add(joint_rate)
    }

    /// Numbers of options.
    pub fn options(mode: Mode, integrator: Integrator) -> Self {
        let (code, substeps) = match integrator {
            Integrator::Rk4 { substeps } => (0, substeps),
            // Euler has no substeps; the number must still be in range.
            Integrator::Euler => (1, Integrator::DEFAULT_SUBSTEPS),
        };
        let mode = match mode {
            Mode::Optimal => 0,
            Mode::Feasible => 1,
        };
        Self::default().count(mode).count(code).count(substeps as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_capi::{RemoraMission, RemoraScenario};

    /// Bytes of a structure of these numbers, its size first; C leaves no gap between them.
    fn bytes(numbers: &Numbers) -> usize {
        let of = |number: &Number| match number {
            Number::Integer(_) => 4,
            Number::Float(_) => 8,
        };
        4 + numbers.0.iter().map(of).sum::<usize>()
    }

    #[test]
    fn numbers_fill_the_structures_of_the_header() {
        let mission = Mission::default();
        assert_eq!(bytes(&Numbers::mission(&mission)), size_of::<RemoraMission>());
        let scenario = Numbers::scenario(&Scenario::default());
        assert_eq!(bytes(&scenario), size_of::<RemoraScenario>());
    }

    #[test]
    fn text_tells_integers_from_doubles() {
        let numbers = Numbers::default().count(60).add(&[8.0, 1e-9, -0.5, 1e300]);
        assert_eq!(numbers.to_string(), "60 8.0 1e-9 -0.5 1e300");
        assert_eq!(numbers.floats().next(), Some(60.0));
    }
}
