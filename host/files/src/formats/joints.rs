//! Arms of one to seven joints: their number is a file's, and a type's in the planner.

use nalgebra::SVector;

/// Most joints of an arm.
pub const MAX_JOINTS: usize = 7;

/// Which arms are planned for, in messages.
pub const PLANNED_JOINTS: &str = "arms of 1 to 7 joints are planned for";

/// One number a joint, of a list whose length has been checked; zero where there is none.
pub(super) fn each<const NL: usize>(values: &[f64]) -> SVector<f64, NL> {
    SVector::from_fn(|i, _| values.get(i).copied().unwrap_or(0.0))
}

/// Evaluates an expression in which the constant `NL` is the number of joints, known at run time; the one
/// after `else` where no arm has so many.
///
/// ```
/// use remora_files::formats::MissionFile;
///
/// let file = MissionFile::default();
/// let mass = remora_files::with_joints!(file.joints(), NL => {
///     file.mission_of::<NL>().map(|mission| mission.servicer.total_mass())
/// } else { Ok(0.0) });
/// assert_eq!(mass.unwrap(), 530.0);
/// ```
#[macro_export]
macro_rules! with_joints {
    ($joints:expr, $NL:ident => $body:block else $other:block) => {
        match $joints {
            1 => $crate::with_joints!(@ 1, $NL, $body),
            2 => $crate::with_joints!(@ 2, $NL, $body),
            3 => $crate::with_joints!(@ 3, $NL, $body),
            4 => $crate::with_joints!(@ 4, $NL, $body),
            5 => $crate::with_joints!(@ 5, $NL, $body),
            6 => $crate::with_joints!(@ 6, $NL, $body),
            7 => $crate::with_joints!(@ 7, $NL, $body),
            _ => $other,
        }
    };
    (@ $joints:literal, $NL:ident, $body:block) => {{
        const $NL: usize = $joints;
        $body
    }};
}
