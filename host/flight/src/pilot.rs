//! Flights of arms of any number of joints, by the code of the two sizes that this program is built for.

use crate::flight::{Flight, FlightOutcome, Moment, Settings};
use crate::history::Sample;
use crate::nominal;
use crate::options::Options;
use remora_core::advanced::guidance::{FlightPlan, Limits, Safety};
use remora_core::advanced::model::{Mission, Scenario};
use remora_core::advanced::stages::LINKS;
use remora_core::advanced::time::Clock;
use remora_core::prelude::{Valid, Validate};
use remora_host::engine::{AnyArmEngine, Build, DefaultArmEngine, Engine};
use remora_host::error::{Error, FieldError};
use remora_host::formats::{MAX_JOINTS, MadeFor, PlanFile, resized_motion};
use remora_host::memory::on_heap;
use remora_truth::{Dispersion, Quantity, World, WorldError};
use std::path::Path;
use std::sync::Arc;

/// A plan that can be flown.
pub struct Sortie(Size);

/// Limits of a mission, for pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// Lower and upper stops of the joints [rad].
    pub joint_angle: [Vec<f64>; 2],
    /// Largest joint rates [rad/s].
    pub joint_rate: Vec<f64>,
    /// Largest joint torques [N m].
    pub joint_torque: Vec<f64>,
    /// Largest bus torque about an axis [N m].
    pub bus_torque: f64,
}

enum Size {
    Default(Box<Parts<LINKS>>),
    Any(Box<Parts<MAX_JOINTS>>, usize),
}

struct Parts<const M: usize> {
    mission: Valid<Mission<M>>,
    scenario: Scenario<M>,
    plan: FlightPlan<M>,
}

impl<const M: usize> Parts<M> {
    fn new(made: &MadeFor, file: &PlanFile) -> Result<Self, String> {
        let mission: Mission<M> = made.mission.sized();
        let scenario = made.scenario.resized();
        let motion = resized_motion(&file.stage2.trajectory());
        let path = file.stage1.trajectory();
        let plan = FlightPlan::new(&mission, &scenario, file.integrator, &path, &motion)
            .map_err(|error| error.to_string())?;
        let mission = mission.validated().map_err(|error| error.to_string())?;
        Ok(Self { mission, scenario, plan })
    }

    fn bounds(&self, joints: usize) -> Bounds {
        let servicer = &self.mission.servicer;
        let of = |values: &[f64]| values.iter().take(joints).copied().collect::<Vec<_>>();
        Bounds {
            joint_angle: [
                of(servicer.min_joint_angle_rad.as_slice()),
                of(servicer.max_joint_angle_rad.as_slice()),
            ],
            joint_rate: of(servicer.joint_rate_limit_rad_s.as_slice()),
            joint_torque: of(servicer.joint_torque_limit_n_m.as_slice()),
            bus_torque: servicer.bus_torque_limit_n_m.max(),
        }
    }

    /// Computes the abort and the drift from each node.
    fn safety(&self) -> Vec<Safety> {
        let limits = Limits::of(&self.mission.servicer);
        let nodes = 0..self.plan.grid().nodes;
        nodes.filter_map(|k| self.plan.safety(&self.mission, &limits, k)).collect()
    }

    fn drawn(
        &self,
        settings: &Settings,
        dispersion: &Dispersion,
    ) -> Result<Vec<Quantity>, WorldError> {
        let setup = nominal::setup(&self.mission, &self.scenario, &settings.surroundings);
        Ok(World::new(&setup, dispersion)?.read_back())
    }

    /// Flies an arm of so many joints; `history` gets a sample a second.
    fn fly<const NX: usize, const NU: usize>(
        &self,
        engine: &mut Engine<M, NX, NU>,
        settings: &Settings,
        dispersion: &Dispersion,
        mut history: Option<&mut Vec<Sample>>,
        joints: usize,
    ) -> Result<FlightOutcome, WorldError>
    where
        Engine<M, NX, NU>: Build<M, NX, NU>,
    {
        let Self { mission, scenario, plan } = self;
        let mut watch = |moment: &Moment<'_, M>| {
            if let Some(history) = &mut history {
                history.push(Sample::of(moment, joints));
            }
        };
        Flight { mission, scenario, plan, settings }.fly(dispersion, engine, &mut watch)
    }
}

impl Sortie {
    /// The plan of a file.
    ///
    /// # Errors
    /// A plan that cannot be flown, or whose inputs are not sound.
    pub fn of(file: &Path, plan: &PlanFile) -> Result<Self, Error> {
        let made = plan.inputs.read(&plan.scenario).map_err(|error| error.at(file))?;
        let wrong = |reason: String| Error::input(file, "integrator", reason);
        Ok(Self(match made.mission.joints() {
            LINKS => Size::Default(Box::new(Parts::new(&made, plan).map_err(wrong)?)),
            joints => Size::Any(Box::new(Parts::new(&made, plan).map_err(wrong)?), joints),
        }))
    }

    /// Refuses effects that the mission's body does not have.
    ///
    /// # Errors
    /// The field of the options, and why.
    pub fn check(&self, options: &Options) -> Result<(), FieldError> {
        let orbit = match &self.0 {
            Size::Default(parts) => &parts.mission.orbit,
            Size::Any(parts, _) => &parts.mission.orbit,
        };
        options.check_orbit(orbit)
    }

    /// The mission's limits.
    pub fn bounds(&self) -> Bounds {
        match &self.0 {
            Size::Default(parts) => parts.bounds(LINKS),
            Size::Any(parts, joints) => parts.bounds(*joints),
        }
    }

    /// Computes the abort and the free drift from each node, in the planner's world.
    pub fn safety(&self) -> Vec<Safety> {
        match &self.0 {
            Size::Default(parts) => parts.safety(),
            Size::Any(parts, _) => parts.safety(),
        }
    }

    /// Draws the world of this plan and reads its quantities, without flying.
    ///
    /// # Errors
    /// Errors that make no sense.
    pub fn drawn(
        &self,
        settings: &Settings,
        dispersion: &Dispersion,
    ) -> Result<Vec<Quantity>, WorldError> {
        match &self.0 {
            Size::Default(parts) => parts.drawn(settings, dispersion),
            Size::Any(parts, joints) => {
                let mut drawn = parts.drawn(settings, dispersion)?;
                drawn.retain(|drawn| is_of_arm(&drawn.name, *joints));
                Ok(drawn)
            }
        }
    }
}

/// Flies; the planner that plans again is its own.
#[derive(Default)]
pub struct Pilot {
    usual: Option<Box<DefaultArmEngine>>,
    roomy: Option<Box<AnyArmEngine>>,
    clock: Option<Arc<dyn Clock + Send>>,
}

impl Pilot {
    /// A pilot whose flights end, unfinished, once the clock was stopped.
    pub fn stopped_by(clock: Arc<dyn Clock + Send>) -> Self {
        Self { clock: Some(clock), ..Self::default() }
    }

    /// Flies a plan with a draw of errors; `history` gets a sample a second.
    ///
    /// # Errors
    /// Errors that make no sense; a truth that cannot be integrated.
    pub fn fly(
        &mut self,
        sortie: &Sortie,
        settings: &Settings,
        dispersion: &Dispersion,
        history: Option<&mut Vec<Sample>>,
    ) -> Result<FlightOutcome, WorldError> {
        match &sortie.0 {
            Size::Default(parts) => {
                let engine = self.usual.get_or_insert_with(|| on_heap(DefaultArmEngine::default));
                engine.clock = self.clock.clone();
                parts.fly(engine, settings, dispersion, history, LINKS)
            }
            Size::Any(parts, joints) => {
                let engine = self.roomy.get_or_insert_with(|| on_heap(AnyArmEngine::default));
                engine.clock = self.clock.clone();
                let mut flown = parts.fly(engine, settings, dispersion, history, *joints)?;
                flown.drawn.retain(|drawn| is_of_arm(&drawn.name, *joints));
                Ok(flown)
            }
        }
    }
}

/// Whether something drawn belongs to an arm of so many joints: names end in the joint's number.
fn is_of_arm(name: &str, joints: usize) -> bool {
    let number = name.split('[').nth(1).and_then(|rest| rest.split(']').next());
    let belongs = name.starts_with("joints.") || name.contains("link[");
    !belongs || number.and_then(|i| i.parse::<usize>().ok()).is_none_or(|i| i < joints)
}
