//! Plans that tests fly.

use remora_core::advanced::guidance::FlightPlan;
use remora_core::advanced::model::Mission;
use remora_core::prelude::{Integrator, Options, Planner, Scenario, Valid, Validate};
use remora_host::draw::draw;
use remora_host::formats;

/// A scenario and its plan.
pub type FlightCase = (Valid<Scenario>, FlightPlan<3>);

/// Plans of the first drawn scenarios.
pub fn planned(mission: &Valid<Mission<3>>, count: u64) -> Vec<FlightCase> {
    let set = draw(count, 1, &formats::Mission::from(&**mission)).unwrap();
    let options = Options::builder().integrator(Integrator::RK4).build().unwrap();
    let mut planner = Box::new(Planner::new());
    let plan = |scenario: Valid<Scenario>| {
        let plan = planner.plan(mission, &scenario, &options).unwrap().flight_plan(0.0).unwrap();
        (scenario, plan)
    };
    let scenarios = set.scenarios.iter().map(|named| named.scenario().resized());
    scenarios.map(|scenario| scenario.validated().unwrap()).map(plan).collect()
}
