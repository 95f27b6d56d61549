//! All that stands behind the front door, for those who build on the parts: tools, other stages, other
//! solvers. It may change from version to version more than the [prelude](crate::prelude) does.

#[doc(no_inline)]
pub use remora_nn as nn;
#[doc(no_inline)]
pub use remora_qp as qp;
pub use remora_qp::time;

/// How often each loop may turn whose length depends on data.
pub mod bounds {
    pub use crate::bounds::*;
}

/// Bus and arm: their discrete steps, exact first and second derivatives.
pub mod dynamics {
    pub use crate::dynamics::*;
}

/// Quaternions and numbers side by side, the same bits on every target.
pub mod math {
    pub use crate::math::*;
}

/// The world as data, with the target's motion and the orbit's transition.
pub mod model {
    pub use crate::model::*;
}

/// The second core, given by the caller.
pub mod executor {
    pub use crate::executor::*;
}

/// Flies a plan: feedback, modes, when to plan again.
pub mod guidance {
    pub use crate::guidance::*;
}

/// Scenario in, plan out, with memory and solver of the caller.
pub mod planner {
    pub use crate::planner::*;
}

/// The solver by sequential convex programming, its settings and log, the problem trait.
pub mod scp {
    pub use crate::scp::*;
}

/// Translation and reorientation as problems, the heuristic guess, the independent verifier.
pub mod stages {
    pub use crate::stages::*;
}

/// Features, rollout and actions of the learned guess.
pub mod warmstart {
    pub use crate::warmstart::*;
}
