//! The learned models that are built in, as files: once in a program, whoever uses them.

use crate::method::Integrator;

static EULER: &[u8] = include_bytes!("../../../fixtures/models/euler.model");
static RK4: &[u8] = include_bytes!("../../../fixtures/models/rk4.model");

/// The file of an integrator's model; every number of substeps has the same.
pub fn built_in(integrator: Integrator) -> &'static [u8] {
    match integrator {
        Integrator::Euler => EULER,
        Integrator::Rk4 { .. } => RK4,
    }
}
