//! A plan flown in closed loop: navigation, guidance and truth, step by step.

use super::outcome::{Ending, FlightOutcome, Moment};
use super::settings::{Controller, JointControl, Settings, Way};
use crate::judge::{Arrival, Judge};
use crate::navigation::Navigation;
use crate::nominal;
use nalgebra::Vector3;
use remora_core::advanced::guidance::{
    Command, Estimate, FlightMode, FlightPlan, Guidance, GuidanceSettings, Limits, Triggers,
};
use remora_core::advanced::model::{Mission, Scenario};
use remora_core::prelude::Valid;
use remora_host::engine::{Build, Engine};
use remora_truth::{
    Axes, Command as Act, Dispersion, JointCommand, Quantity, Setup, World, WorldError,
};

/// A plan to be flown.
pub struct Flight<'a, const NL: usize> {
    /// Its mission.
    pub mission: &'a Valid<Mission<NL>>,
    /// Scenario that the plan was made for.
    pub scenario: &'a Scenario<NL>,
    /// The plan.
    pub plan: &'a FlightPlan<NL>,
    /// How it is flown.
    pub settings: &'a Settings,
}

impl<const NL: usize> Flight<'_, NL> {
    /// Flies with one draw of errors. The engine plans where the controller plans again.
    ///
    /// # Errors
    /// Errors that make no sense; a truth that cannot be integrated.
    pub fn fly<const NX: usize, const NU: usize>(
        &self,
        dispersion: &Dispersion,
        engine: &mut Engine<NL, NX, NU>,
        watch: &mut dyn FnMut(&Moment<'_, NL>),
    ) -> Result<FlightOutcome, WorldError>
    where
        Engine<NL, NX, NU>: Build<NL, NX, NU>,
    {
        self.fly_struck(dispersion, engine, watch, &mut |_, _| ())
    }

    /// Flies likewise, but `strike` may change guidance's state before each of its steps and is told the step's
    /// number: for fault injection.
    ///
    /// # Errors
    /// Errors of [`Flight::fly`].
    pub fn fly_struck<const NX: usize, const NU: usize>(
        &self,
        dispersion: &Dispersion,
        engine: &mut Engine<NL, NX, NU>,
        watch: &mut dyn FnMut(&Moment<'_, NL>),
        strike: &mut dyn FnMut(u64, &mut Guidance<NL>),
    ) -> Result<FlightOutcome, WorldError>
    where
        Engine<NL, NX, NU>: Build<NL, NX, NU>,
    {
        let setup = nominal::setup(self.mission, self.scenario, &self.settings.surroundings);
        let world = World::new(&setup, dispersion)?;
        let real = dispersion.disperse(&setup);
        let known = with_true_geometry(self.mission, &real);
        let mut loop_ = Loop::new(self, world, &known);
        loop {
            loop_.leave();
            // The engine's clock was stopped: nothing uses the flight.
            if loop_.is_over() || engine.is_stopped() {
                return Ok(loop_.ended());
            }
            strike(loop_.turns, &mut loop_.guidance);
            loop_.turn(engine, watch)?;
        }
    }
}

/// The mission with the port and the arm's base where they really are.
fn with_true_geometry<const NL: usize>(mission: &Mission<NL>, real: &Setup<NL>) -> Mission<NL> {
    let mut known = *mission;
    known.target.port_position_m = real.target.port;
    if let Some(first) = real.vehicle.joints.first() {
        known.servicer.arm_base_m = first.pivot;
    }
    known
}

/// The control loop of a flight.
struct Loop<'a, const NL: usize> {
    flight: &'a Flight<'a, NL>,
    world: World<NL>,
    navigation: Navigation<NL>,
    guidance: Guidance<NL>,
    limits: Limits<NL>,
    judge: Judge<'a, NL>,
    plan: FlightPlan<NL>,
    /// A plan that takes over later.
    next: Option<FlightPlan<NL>>,
    drawn: Vec<Quantity>,
    /// Force commanded last, RTN.
    force: Vector3<f64>,
    turns: u64,
    touched: bool,
    flown: Tally,
}

/// Counts of a flight.
#[derive(Default)]
struct Tally {
    replans: [u32; 2],
    tracking: [f64; 2],
    impulse: f64,
    /// When the approach was given up [s].
    aborted: Option<f64>,
}

/// How long an approach that was given up is watched [s].
const LEAVES_WITHIN_S: f64 = 600.0;

/// Time between looks at a servicer that drifts [s].
const DRIFT_LOOK_S: f64 = 10.0;

/// Turns between looks at distances: a second's.
fn look_every(rate: f64) -> u64 {
    (rate as u64).max(1)
}

impl<'a, const NL: usize> Loop<'a, NL> {
    fn new(flight: &'a Flight<'a, NL>, world: World<NL>, known: &'a Mission<NL>) -> Self {
        let settings = flight.settings;
        let triggers = match settings.controller {
            Controller::Track => Triggers::NEVER,
            Controller::Replan => settings.guidance.triggers,
        };
        let guidance = GuidanceSettings { triggers, ..settings.guidance };
        let drawn = world.read_back();
        Self {
            flight,
            world,
            navigation: Navigation::new(settings.filters),
            guidance: Guidance::new(Valid::of_constant(guidance)),
            limits: Limits::of(&flight.mission.servicer),
            judge: Judge::new(known, &flight.mission.target.port_position_m, flight.plan.grid()),
            plan: *flight.plan,
            next: None,
            drawn,
            force: Vector3::zeros(),
            turns: 0,
            touched: false,
            flown: Tally::default(),
        }
    }

    /// When the plan ends; where the approach was given up, when the target must be clear [s].
    fn end(&self) -> f64 {
        match self.flown.aborted {
            Some(at) if self.is_adrift(at) => {
                at + 2.0 * std::f64::consts::PI / self.flight.mission.mean_motion()
            }
            Some(at) => at + LEAVES_WITHIN_S,
            None => self.flight.plan.begins + self.flight.plan.duration(),
        }
    }

    fn is_over(&self) -> bool {
        self.touched || self.world.time() >= self.end() - 1e-9
    }

    /// Whether nothing is done any more at a time [s].
    fn is_adrift(&self, time: f64) -> bool {
        let left = |(at, way): (f64, Way)| way == Way::Drift && time >= at - 1e-9;
        self.flight.settings.leaving.is_some_and(left)
    }

    /// Leaves the approach where that is due.
    fn leave(&mut self) {
        let Some((at, way)) = self.flight.settings.leaving else { return };
        let time = self.world.time();
        if time < at - 1e-9 || self.flown.aborted.is_some() {
            return;
        }
        self.judge.begin();
        self.flown.aborted = Some(time);
        if way == Way::Escape {
            self.guidance.abort();
        }
    }

    /// Goes on without any control.
    fn drift(&mut self, time: f64) -> Result<(), WorldError> {
        self.judge.look(&self.world.view());
        let until = f64::min(time + DRIFT_LOOK_S, self.end());
        // Passing the port's plane does not end a drift.
        self.world.advance(until, &Act::default())?;
        Ok(())
    }

    /// One turn: measure, estimate, guide, act.
    fn turn<const NX: usize, const NU: usize>(
        &mut self,
        engine: &mut Engine<NL, NX, NU>,
        watch: &mut dyn FnMut(&Moment<'_, NL>),
    ) -> Result<(), WorldError>
    where
        Engine<NL, NX, NU>: Build<NL, NX, NU>,
    {
        let settings = self.flight.settings;
        let time = self.world.time();
        if self.is_adrift(time) {
            return self.drift(time);
        }
        if let Some(next) = self.next.take_if(|next| time >= next.begins - 1e-9) {
            self.plan = next;
        }
        let looks = self.turns.is_multiple_of(look_every(settings.rate_hz));
        let estimate = self.estimate(time);
        let mut act = Act::default();
        if let Some(estimate) = estimate {
            let command =
                self.guidance.step(self.flight.mission, &self.plan, &estimate, &self.limits);
            self.count(time, &command);
            if command.mode == FlightMode::ReplanWanted && self.next.is_none() {
                self.next = self.plan_again(&estimate, engine);
            }
            self.force = command.force;
            act = self.act(&command);
            if looks || settings.every_step {
                let view = self.world.view();
                if looks {
                    self.judge.look(&view);
                }
                let frame = &self.world.rtn();
                watch(&Moment { view: &view, frame, estimate: &estimate, command: &command });
            }
        }
        self.turns += 1;
        let until = f64::min(self.turns as f64 / settings.rate_hz, self.end());
        let touched = self.world.advance(until, &act)?.is_some();
        // Leaving may take the tip through the port's plane.
        let leaves = self.flown.aborted.is_some() || settings.leaving.is_some();
        self.touched = touched && !leaves;
        Ok(())
    }

    fn estimate(&mut self, time: f64) -> Option<Estimate<NL>> {
        let (frame, measured) = (self.world.rtn(), self.world.measure());
        let mission = self.flight.mission;
        let mut estimate =
            self.navigation.estimate(mission, (time, &frame), &measured, &self.force)?;
        if self.end() - time > self.flight.settings.camera_s {
            estimate.wrist = None;
        }
        Some(estimate)
    }

    fn act(&self, command: &Command<NL>) -> Act<NL> {
        let torque = command.control.joint_torque.data.0[0];
        let joints = match self.flight.settings.joints {
            JointControl::Torque => JointCommand::Torque(torque),
            JointControl::Servo => JointCommand::Servo {
                angle: command.joint_angle.data.0[0],
                rate: command.joint_rate.data.0[0],
                torque,
            },
        };
        Act {
            force: command.force,
            axes: Axes::Rtn,
            bus_torque: command.control.bus_torque,
            joints,
        }
    }

    fn count(&mut self, time: f64, command: &Command<NL>) {
        self.judge.look_at_command(command, &self.limits);
        let flown = &mut self.flown;
        let size = libm::sqrt(command.force.dot(&command.force));
        flown.impulse += size / self.flight.settings.rate_hz;
        if command.mode == FlightMode::Abort {
            flown.aborted.get_or_insert(time);
        }
        if time >= 60.0 {
            flown.tracking[0] = flown.tracking[0].max(command.error.position);
            flown.tracking[1] = flown.tracking[1].max(command.error.attitude);
        }
    }

    /// Plans again; the plan in force stays where nothing verified comes of it.
    fn plan_again<const NX: usize, const NU: usize>(
        &mut self,
        estimate: &Estimate<NL>,
        engine: &mut Engine<NL, NX, NU>,
    ) -> Option<FlightPlan<NL>>
    where
        Engine<NL, NX, NU>: Build<NL, NX, NU>,
    {
        let Flight { mission, settings, .. } = self.flight;
        let replan = self.guidance.replan(mission, &self.plan, estimate, settings.lead_s)?;
        let (scenario, integrator) = (&replan.scenario, settings.integrator);
        self.flown.replans[0] += 1;
        let guess = (&replan.nominal, replan.elapsed);
        let report = engine.replan(mission, scenario, integrator, guess).ok()?;
        if !report.is_verified() {
            return None;
        }
        self.flown.replans[1] += 1;
        let (path, motion) = (engine.workspace.translation(), engine.workspace.reorientation());
        let plan = FlightPlan::new(mission, scenario, integrator, path, motion).ok()?;
        Some(plan.beginning_at(replan.begins))
    }

    fn ended(mut self) -> FlightOutcome {
        let view = self.world.view();
        self.judge.look(&view);
        let arrival = Arrival::of(&view);
        let mut flown = FlightOutcome {
            ending: Ending::Missed,
            time_s: view.time,
            arrival,
            room: self.judge.room,
            replans: self.flown.replans,
            tracking: self.flown.tracking,
            impulse_n_s: self.flown.impulse,
            nearest_m: self.judge.nearest_m,
            drawn: self.drawn,
        };
        flown.ending = if flown.room.collided() {
            Ending::Collided
        } else if self.flown.aborted.is_some() {
            // Left clear only where it is beyond the far keep-out distance by now.
            let far = self.flight.mission.approach.keep_out_far_m;
            if arrival.miss_m >= far { Ending::Aborted } else { Ending::Missed }
        } else if arrival.is_captured(&self.flight.settings.criteria) {
            Ending::Captured
        } else {
            Ending::Missed
        };
        flown
    }
}
