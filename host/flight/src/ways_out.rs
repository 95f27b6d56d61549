//! Ways out of an approach that must end at a node: computed with the plan, and flown in the truth.

use crate::flight::{FlightOutcome, Settings, Way};
use crate::pilot::{Pilot, Sortie};
use remora_core::advanced::guidance::Safety;
use remora_host::error::Error;
use remora_host::pool;
use remora_host::progress::Progress;
use remora_truth::Dispersion;
use serde::Serialize;
use std::num::NonZeroUsize;

/// The ways out of one plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WaysOut {
    /// Version of this form.
    pub format: &'static str,
    /// Id of the plan's scenario.
    pub scenario: String,
    /// The first node from which the abort does not leave the target clear; none: every abort does.
    pub point_of_no_return: Option<usize>,
    /// A row a node.
    pub nodes: Vec<NodeWays>,
}

/// The ways out from one node.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NodeWays {
    /// In the planner's world.
    #[serde(flatten)]
    pub planned: Safety,
    /// In the truth, where that was flown.
    pub flown: Option<FlownWays>,
}

/// Both ways out from a node, as flown.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FlownWays {
    /// Whether no bodies touch in the abort, and it ends beyond the far keep-out distance.
    pub escape_clears: bool,
    /// Least distance of bodies in it, arm and own bus included [m].
    pub escape_clearance_m: f64,
    /// Least distance of the centre of mass from the target's box in the drift [m].
    pub drift_distance_m: f64,
    /// Least distance of bodies in the drift [m].
    pub drift_clearance_m: f64,
}

impl WaysOut {
    /// Computes the ways out with the plan.
    pub fn planned(scenario: &str, sortie: &Sortie) -> Self {
        let row = |planned| NodeWays { planned, flown: None };
        let nodes: Vec<NodeWays> = sortie.safety().into_iter().map(row).collect();
        let lost = nodes.iter().position(|node| !node.planned.escape.clears);
        let format = "remora-ways-out/1";
        Self { format, scenario: scenario.into(), point_of_no_return: lost, nodes }
    }

    /// Flies both ways out from each node.
    ///
    /// # Errors
    /// Errors that make no sense; a truth that cannot be integrated.
    pub fn fly(
        &mut self,
        sortie: &Sortie,
        dispersion: &Dispersion,
        jobs: NonZeroUsize,
        progress: &mut dyn Progress,
    ) -> Result<(), Error> {
        let nodes: Vec<usize> = (0..self.nodes.len()).collect();
        let times: Vec<f64> = self.nodes.iter().map(|node| node.planned.time).collect();
        progress.begin(nodes.len(), 0);
        let fly = |pilot: &mut Pilot, k: usize| {
            let mut flown = |way| {
                let settings = Settings { leaving: Some((times[k], way)), ..Settings::default() };
                let flown = pilot.fly(sortie, &settings, dispersion, None);
                flown.map_err(|error| Error::Thread { reason: error.to_string() })
            };
            Ok(FlownWays::of(&flown(Way::Escape)?, &flown(Way::Drift)?))
        };
        let finish = |k: usize, flown: FlownWays| {
            progress.done(flown.escape_clears);
            self.nodes[k].flown = Some(flown);
            Ok(())
        };
        pool::plan_all_with(jobs, &nodes, |_| Pilot::default(), fly, finish)?;
        progress.end();
        Ok(())
    }

    /// Whether every abort leaves the target clear, computed and flown.
    pub fn all_escape(&self) -> bool {
        let flown = |node: &NodeWays| node.flown.is_none_or(|flown| flown.escape_clears);
        self.point_of_no_return.is_none() && self.nodes.iter().all(flown)
    }
}

impl FlownWays {
    fn of(escape: &FlightOutcome, drift: &FlightOutcome) -> Self {
        let least = |flown: &FlightOutcome| {
            let room = &flown.room;
            room.arm_m.min(room.bus_m).min(room.own_m)
        };
        Self {
            escape_clears: escape.ending == crate::flight::Ending::Aborted,
            escape_clearance_m: least(escape),
            drift_distance_m: drift.nearest_m,
            drift_clearance_m: least(drift),
        }
    }
}
