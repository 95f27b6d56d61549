//! Guidance with a flipped bit in its state, flown in the truth.

use super::case::Course;
use super::ended::{Ended, Ran};
use super::fields::flip;
use remora_core::advanced::guidance::{FlightPlan, Guidance, GuidancePart};
use remora_core::advanced::model::{Integrator, Mission, Scenario};
use remora_core::advanced::qp::{Checksum, Valid};
use remora_core::advanced::scp::Status;
use remora_core::advanced::stages::LINKS;
use remora_core::prelude::Validate;
use remora_flight::flight::{Controller, Ending, Flight, FlightOutcome, Settings};
use remora_host::engine::DefaultArmEngine;
use remora_host::memory::on_heap;
use remora_truth::{Dispersion, Errors, ThrusterLost};

/// Substeps of plans that are flown where the injection's own cannot be.
pub(super) const SUBSTEPS: usize = 4;

/// Steps of guidance a second [Hz]: as few as leave feedback its bandwidth, for flights take their time.
const RATE_HZ: f64 = 2.0;

/// Seed of the errors of the world, which are typical ones; a scenario has its own draw.
const SEED: u64 = 1;

/// A plan to be flown, and its flights without a fault.
pub(super) struct Sortie {
    mission: Valid<Mission<LINKS>>,
    scenario: Scenario,
    plan: FlightPlan,
    /// Integrator that the plan was made with.
    integrator: Integrator,
    run: u64,
    flown: [Sound; Course::ALL.len()],
}

/// A flight without a fault.
#[derive(Clone, Copy)]
struct Sound {
    ended: Ended,
    /// The steps of guidance before which it can be struck: from, up to; none where it does not end without a
    /// fault as it has to.
    steps: [u32; 2],
}

impl Sortie {
    /// Range of guidance's steps in which a flight on each course can be hit.
    pub fn steps(&self) -> [[u32; 2]; Course::ALL.len()] {
        self.flown.map(|sound| sound.steps)
    }
}

/// A flipped bit of guidance's state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strike {
    pub step: u32,
    pub field: usize,
    pub element: usize,
    pub bit: u32,
}

/// Simulator of flights. It makes the planner that flights may need with the first.
#[derive(Default)]
pub(super) struct Flights(Option<Box<DefaultArmEngine>>);

impl Flights {
    /// A plan that is flown without a fault on each course.
    ///
    /// # Errors
    /// An approach that does not end in a capture: nothing could be told from a fault in it.
    pub fn sortie(
        &mut self,
        mission: &Mission<LINKS>,
        scenario: &Scenario,
        (plan, integrator): (FlightPlan, Integrator),
        run: u64,
    ) -> Result<Sortie, String> {
        let mission = mission.validated().map_err(|error| error.to_string())?;
        let flown = [Sound { ended: Ended::NOTHING, steps: [0; 2] }; Course::ALL.len()];
        let mut sortie = Sortie { mission, scenario: *scenario, plan, integrator, run, flown };
        for course in Course::ALL {
            let (flown, steps) = self.fly(&sortie, course, None)?;
            if flown.ending == course.aim() {
                sortie.flown[course as usize] = Sound { ended: ended(&flown, course), steps };
            } else if course == Course::Approach {
                return Err(format!("is not captured without a fault: {:?}", flown.ending));
            }
        }
        Ok(sortie)
    }

    /// Flies with a flipped bit; where nothing flies, the plan ends as it does `without` a fault.
    pub fn run(
        &mut self,
        sortie: Option<&Sortie>,
        without: Ended,
        course: Course,
        strike: Strike,
    ) -> Ran {
        let Some(sortie) = sortie else {
            let baseline = without;
            return Ran { ended: baseline, baseline, is_refused: false, ending: None };
        };
        let baseline = sortie.flown[course as usize].ended;
        let (ended, ending) = match self.fly(sortie, course, Some(strike)) {
            Ok((flown, _)) => (ended(&flown, course), flown.ending),
            // A world that cannot be integrated is none that anything comes back from.
            Err(_) => (Ended { is_wrong: true, ..baseline }, Ending::Collided),
        };
        Ran { ended, baseline, is_refused: false, ending: Some(ending) }
    }

    /// The flight, and from which of guidance's steps up to which the course is what it is called, from the step
    /// before on, which leads to it.
    fn fly(
        &mut self,
        sortie: &Sortie,
        course: Course,
        strike: Option<Strike>,
    ) -> Result<(FlightOutcome, [u32; 2]), String> {
        let Sortie { mission, scenario, plan, run, .. } = sortie;
        let engine = self.0.get_or_insert_with(|| on_heap(DefaultArmEngine::default));
        let settings = &course.settings(plan, sortie.integrator);
        let dispersion = Dispersion { errors: course.errors(plan, *run), seed: SEED, run: *run };
        let (mut from, mut to) = (None, 0);
        let mut hit = |step: u64, guidance: &mut Guidance| {
            if course.part().is_none_or(|part| guidance.number(part, 0).is_some()) {
                from.get_or_insert((step as u32).saturating_sub(1));
                to = step as u32 + 1;
            }
            if let Some(strike) = strike.filter(|strike| u64::from(strike.step) == step) {
                strike.hit(guidance);
            }
        };
        let flight = Flight { mission, scenario, plan, settings };
        let flown = flight.fly_struck(&dispersion, engine, &mut |_| (), &mut hit);
        flown.map(|flown| (flown, [from.unwrap_or(to), to])).map_err(|error| error.to_string())
    }
}

impl Course {
    /// How it ends without a fault.
    fn aim(self) -> Ending {
        match self {
            Self::Escape => Ending::Aborted,
            _ => Ending::Captured,
        }
    }

    /// Part of guidance's state that exists once the course has begun; none where it begins at once.
    fn part(self) -> Option<GuidancePart> {
        match self {
            Self::Approach => None,
            Self::Escape => Some(GuidancePart::Leaving),
            Self::Handover => Some(GuidancePart::Jump),
        }
    }

    fn settings(self, plan: &FlightPlan, integrator: Integrator) -> Settings {
        let mut settings = Settings { rate_hz: RATE_HZ, integrator, ..Settings::default() };
        if self == Self::Handover {
            settings.controller = Controller::Replan;
            settings.guidance.triggers.age = plan.duration() / 2.0;
        }
        settings
    }

    /// Typical errors; on the way out of an escape an axis of the thrusters, one after the other, is lost at a time
    /// that is drawn.
    fn errors(self, plan: &FlightPlan, run: u64) -> Errors {
        let mut errors = Errors::typical();
        if self == Self::Escape {
            let axis = (run % 3) as usize;
            errors.faults.thruster_lost = Some(ThrusterLost { axis, time_s: 0.0 });
            errors.faults.drawn_within_s = Some(plan.duration());
        }
        errors
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

/// A flight as a plan's end: what its course aims at is solved, and what collides is wrong. Its cost is its impulse,
/// its checksum is of all that came of it.
fn ended(flown: &FlightOutcome, course: Course) -> Ended {
    let mut sum = Checksum::new();
    let arrival = &flown.arrival;
    sum.numbers(&arrival.miss_target_m);
    sum.numbers([&flown.time_s, &arrival.miss_m, &arrival.angle_rad, &arrival.speed_m_s]);
    sum.numbers([&flown.impulse_n_s, &flown.nearest_m, &flown.room.arm_m, &flown.room.bus_m]);
    Ended {
        status: if flown.ending == course.aim() { Status::Solved } else { Status::Infeasible },
        is_verified: flown.ending != Ending::Collided,
        costs: [flown.impulse_n_s, 0.0],
        output: sum.value(),
        is_wrong: flown.ending == Ending::Collided,
        ..Ended::NOTHING
    }
}

#[cfg(test)]
mod tests {
    use super::super::fields::GUIDANCE_FIELDS;
    use super::*;
    use remora_core::advanced::guidance::{Estimate, GuidanceSettings, Limits};
    use remora_core::prelude::{Mode, Options, Planner};

    /// The tables of names and sizes are those of guidance's state, where another plan took over and the target is
    /// left.
    #[test]
    fn every_field_has_as_many_numbers_as_the_table_says() {
        let mission = Mission::default().validated().unwrap();
        let scenario = Scenario::default().validated().unwrap();
        let options = Options::builder().mode(Mode::Feasible).build().unwrap();
        let mut planner = on_heap(Planner::new);
        let plan = planner.plan(&mission, &scenario, &options).unwrap().flight_plan(0.0).unwrap();
        let settings = GuidanceSettings::DEFAULT.validated().unwrap();
        let mut guidance: Guidance = Guidance::new(settings);
        let step = |guidance: &mut Guidance, begins: f64| {
            let estimate = Estimate::as_planned(&mission, begins, &plan.at(&mission, begins));
            let plan = plan.beginning_at(begins);
            guidance.step(&mission, &plan, &estimate, &Limits::of(&mission.servicer));
        };
        step(&mut guidance, 0.0);
        step(&mut guidance, 1.0);
        guidance.abort();
        step(&mut guidance, 1.0);
        for (part, (name, count)) in GuidancePart::ALL.iter().zip(GUIDANCE_FIELDS) {
            assert!(guidance.number(*part, count - 1).is_some(), "{name}");
            assert!(guidance.number(*part, count).is_none(), "{name}");
        }
    }
}
