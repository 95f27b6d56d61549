//! The core's settings for a method.

use crate::method::{Deadline, Method};
use remora_core::advanced::planner::PlanSettings;
use remora_core::advanced::scp::{MAX_ITERATIONS, Settings};
use remora_core::prelude::{Valid, Validate};

/// The core's settings for a method.
pub(crate) fn plan_settings(method: &Method) -> PlanSettings {
    let deadline_s = method.deadline.map_or(f64::INFINITY, Deadline::seconds);
    let settings = PlanSettings { deadline_s, ..PlanSettings::new(method.mode, method.integrator) };
    if !method.sharp {
        return settings;
    }
    let [reorientation, learned] = [settings.reorientation, settings.learned].map(sharp);
    PlanSettings { reorientation, learned, ..settings }
}

/// Settings of Stage 2 for plans to learn from: they end where the cost does, not somewhere in the flat
/// valley before it, and take as many iterations as there is room for.
fn sharp(settings: Valid<Settings>) -> Valid<Settings> {
    let sharper = Settings {
        cost_tolerance: 1e-5,
        absolute_cost_tolerance: 0.0,
        max_iterations: MAX_ITERATIONS,
        ..*settings
    };
    sharper.validated().unwrap_or(settings)
}

/// All settings that a method stands for, as text: two runs with the same text plan the same,
/// as far as no deadline passes.
pub fn settings_text(method: &Method) -> String {
    format!("{:?}", plan_settings(method))
}
