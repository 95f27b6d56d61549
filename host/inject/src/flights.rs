//! Guidance with a flipped bit in its state, flown in the truth.

use super::fields::flip;
use super::reference::Ended;
use super::reference::Reference;
use super::worker::Ran;
use remora_core::advanced::guidance::{FlightPlan, Guidance, GuidancePart};
use remora_core::advanced::model::{Mission, Scenario};
use remora_core::advanced::planner::GuessRecord;
use remora_core::advanced::qp::{Checksum, Valid};
use remora_core::advanced::scp::Status;
use remora_core::advanced::stages::LINKS;
use remora_core::prelude::Validate;
use remora_flight::flight::{Ending, Flight, Flown, Settings};
use remora_host::engine::Usual;
use remora_host::memory::on_heap;
use remora_truth::{Dispersion, Errors};

/// Substeps of plans that are flown where the injection's own cannot be.
pub(super) const SUBSTEPS: usize = 4;

/// Steps of guidance a second [Hz]: as few as leave feedback its bandwidth, for flights take their time.
const RATE_HZ: f64 = 2.0;

/// Seed of the errors of the world, which are typical ones; a scenario has its own draw.
const SEED: u64 = 1;

/// A plan to be flown, and its flight without a fault.
pub(super) struct Sortie {
    mission: Valid<Mission<LINKS>>,
    scenario: Scenario,
    plan: FlightPlan,
    run: u64,
    /// Steps of guidance.
    pub steps: u32,
    flown: Ended,
}

/// A flipped bit of guidance's state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strike {
    pub step: u32,
    pub field: usize,
    pub element: usize,
    pub bit: u32,
}

/// Who flies; the planner that flights may have is made with the first.
#[derive(Default)]
pub(super) struct Flights(Option<Box<Usual>>);

impl Flights {
    /// A plan that is flown without a fault once.
    ///
    /// # Errors
    /// A flight that does not end in a capture: nothing could be told from a fault in it.
    pub fn sortie(
        &mut self,
        mission: &Mission<LINKS>,
        scenario: &Scenario,
        plan: FlightPlan,
        run: u64,
    ) -> Result<Sortie, String> {
        let mission = mission.validated().map_err(|error| error.to_string())?;
        let flown = Ended::NOTHING;
        let mut sortie = Sortie { mission, scenario: *scenario, plan, run, steps: 0, flown };
        let (flown, steps) = self.fly(&sortie, None)?;
        if flown.ending != Ending::Captured {
            return Err(format!("is not captured without a fault: {:?}", flown.ending));
        }
        (sortie.flown, sortie.steps) = (ended(&flown), steps);
        Ok(sortie)
    }

    /// Flies with a flipped bit.
    pub fn run(&mut self, reference: &Reference, strike: Strike) -> Ran {
        let Some(sortie) = &reference.sortie else {
            let baseline = reference.learned;
            return Ran { ended: baseline, baseline, is_refused: false, ending: None };
        };
        let (ended, ending) = match self.fly(sortie, Some(strike)) {
            Ok((flown, _)) => (ended(&flown), flown.ending),
            // A world that cannot be integrated is none that anything comes back from.
            Err(_) => (Ended { is_wrong: true, ..sortie.flown }, Ending::Collided),
        };
        let is_refused = ending == Ending::Aborted;
        Ran { ended, baseline: sortie.flown, is_refused, ending: Some(ending) }
    }

    fn fly(&mut self, sortie: &Sortie, strike: Option<Strike>) -> Result<(Flown, u32), String> {
        let Sortie { mission, scenario, plan, run, .. } = sortie;
        let engine = self.0.get_or_insert_with(|| on_heap(Usual::default));
        let settings = &Settings { rate_hz: RATE_HZ, ..Settings::default() };
        let dispersion = Dispersion { errors: Errors::typical(), seed: SEED, run: *run };
        let mut steps = 0;
        let mut hit = |step: u64, guidance: &mut Guidance| {
            steps += 1;
            if let Some(strike) = strike.filter(|strike| u64::from(strike.step) == step) {
                strike.hit(guidance);
            }
        };
        let flight = Flight { mission, scenario, plan, settings };
        let flown = flight.fly_struck(&dispersion, engine, &mut |_| (), &mut hit);
        flown.map(|flown| (flown, steps)).map_err(|error| error.to_string())
    }
}

impl Strike {
    fn hit(&self, guidance: &mut Guidance) {
        let Some(part) = GuidancePart::ALL.get(self.field) else { return };
        if let Some(number) = guidance.number(*part, self.element) {
            flip(Some(std::slice::from_mut(number)), 0, self.bit);
        }
    }
}

/// A flight as a plan's end: captured is solved, and what collides is wrong. Its cost is its impulse, its checksum
/// is of all that came of it.
fn ended(flown: &Flown) -> Ended {
    let mut sum = Checksum::new();
    let arrival = &flown.arrival;
    sum.numbers(&arrival.miss_target_m);
    sum.numbers([&flown.time_s, &arrival.miss_m, &arrival.angle_rad, &arrival.speed_m_s]);
    sum.numbers([&flown.impulse_n_s, &flown.nearest_m, &flown.room.arm_m, &flown.room.bus_m]);
    Ended {
        status: match flown.ending {
            Ending::Captured => Status::Solved,
            _ => Status::Infeasible,
        },
        is_verified: flown.ending != Ending::Collided,
        costs: [flown.impulse_n_s, 0.0],
        output: sum.value(),
        is_wrong: flown.ending == Ending::Collided,
        ..Ended::NOTHING
    }
}

impl Ended {
    /// Nothing to tell of.
    const NOTHING: Self = Self {
        status: Status::Solved,
        is_verified: true,
        start: GuessRecord::Heuristic,
        iterations: [0; 2],
        costs: [0.0; 2],
        output: 0,
        is_wrong: false,
        is_bounded: true,
    };
}

#[cfg(test)]
mod tests {
    use super::super::fields::GUIDANCE_FIELDS;
    use super::*;
    use remora_core::advanced::guidance::GuidanceSettings;

    /// The tables of names and sizes are those of guidance's state.
    #[test]
    fn every_field_has_as_many_numbers_as_the_table_says() {
        let settings = GuidanceSettings::DEFAULT.validated().unwrap();
        let mut guidance: Guidance = Guidance::new(settings);
        for (part, (name, count)) in GuidancePart::ALL.iter().zip(GUIDANCE_FIELDS) {
            // Of times only the last is there before the first step.
            assert!(guidance.number(*part, count - 1).is_some(), "{name}");
            assert!(guidance.number(*part, count).is_none(), "{name}");
        }
    }
}
