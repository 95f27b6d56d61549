//! Settings of guidance.

use super::Closing;
use super::tracking::Effort;
use nalgebra::Vector3;
use remora_qp::dense::{divisor, is_not_negative, is_positive, is_within};
use remora_qp::{InvalidSetting, Validate};

/// Bandwidths of the feedback, and when another plan is wanted. The defaults are for the servicer of
/// `docs/concepts/problem.md`, section 3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidanceSettings {
    /// Of the centre of mass [rad/s].
    pub translation: f64,
    /// Of the bus attitude [rad/s].
    pub attitude: f64,
    /// Of the joints [rad/s].
    pub joint: f64,
    /// Largest product of a bandwidth and the time between steps [rad].
    pub most_per_step: f64,
    /// Integral feedback, over the bandwidth's third power; zero for none.
    pub integral: f64,
    /// Largest error that an integral stands for: metres, radians.
    pub integral_limit: [f64; 2],
    /// Time over which a new plan's command and the turn to the estimated target are faded in [s].
    pub fade: [f64; 2],
    /// Of the offset that the wrist camera measures [rad/s].
    pub camera: f64,
    /// The last way along the port's axis.
    pub closing: Closing,
    /// When another plan is wanted.
    pub triggers: Triggers,
    /// When the approach is given up.
    pub abort: AbortErrors,
}

/// How far across the port's normal the end effector may be going to be off near the end, over
/// [`AbortErrors::port`].
const ACROSS: f64 = 2.0;

/// Errors from what is asked for beyond which the approach is given up: position [m], as it is going to be
/// half a minute later, bus attitude [rad], the joint farthest off [rad]; infinite: never.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AbortErrors {
    /// At first, while the plan is turned with the target and a start that is off is made good.
    pub settling: [f64; 3],
    /// Afterwards.
    pub settled: [f64; 3],
    /// Time from the first step to then [s].
    pub settles: f64,
    /// Near the target, once it is settled.
    pub near: [f64; 3],
    /// Time before capture from which these hold, and until which that of the position does [s]: later only
    /// where the end effector comes to across the port's normal is looked at.
    pub near_times: [f64; 2],
    /// Most that the end effector may be seen beside where it is to be once the plan's own motion has
    /// ended [m]. Once the position's error is no reason any more, one that is going to be twice as far off
    /// across the port's normal half a minute later is.
    pub port: f64,
}

impl AbortErrors {
    /// About twice what errors twice the typical ones lead to, near the target what typical ones do not
    /// come to.
    pub const DEFAULT: Self = Self {
        settling: [0.25; 3],
        settled: [0.06, 0.1, 0.1],
        settles: 200.0,
        near: [0.012, 0.1, 0.05],
        near_times: [400.0, 105.0],
        port: 0.012,
    };

    /// Never.
    pub const NEVER: Self = Self {
        settling: [f64::INFINITY; 3],
        settled: [f64::INFINITY; 3],
        settles: 0.0,
        near: [f64::INFINITY; 3],
        near_times: [0.0; 2],
        port: f64::INFINITY,
    };

    /// Whether errors are beyond, so long after the first step and with so much left to go [s], and then the
    /// unit vector along which force did not help; zero where it is not the position that is lost.
    pub(super) fn beyond<const NL: usize>(
        &self,
        effort: &Effort<NL>,
        since_first: f64,
        left: f64,
    ) -> Option<Vector3<f64>> {
        let [from, until] = self.near_times;
        let has_settled = since_first >= self.settles;
        let [position, attitude, joint] = if !has_settled {
            self.settling
        } else if left > from {
            self.settled
        } else {
            self.near
        };
        let across = if has_settled { ACROSS * self.port } else { position };
        let size = |v: &Vector3<f64>| libm::sqrt(v.dot(v));
        let (soon, beside) = (size(&effort.soon), size(&effort.beside));
        if left > until && soon > position {
            Some(effort.soon / divisor(soon))
        } else if beside > across {
            Some(effort.beside / divisor(beside))
        } else if effort.error.attitude > attitude || effort.error.joint > joint {
            Some(Vector3::zeros())
        } else {
            None
        }
    }
}

/// When another plan is wanted; infinite: never.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triggers {
    /// Age of the plan in force [s].
    pub age: f64,
    /// Error of the centre of mass [m].
    pub position: f64,
    /// Error of the bus attitude [rad].
    pub attitude: f64,
    /// Error of the target's attitude from what the plan expects [rad].
    pub target: f64,
    /// Time before capture from which none is wanted any more [s].
    pub last: f64,
}

impl Triggers {
    /// Never.
    pub const NEVER: Self = Self {
        age: f64::INFINITY,
        position: f64::INFINITY,
        attitude: f64::INFINITY,
        target: f64::INFINITY,
        last: 0.0,
    };
}

impl GuidanceSettings {
    /// The defaults.
    pub const DEFAULT: Self = Self {
        translation: 0.04,
        attitude: 0.06,
        joint: 0.4,
        most_per_step: 0.25,
        integral: 0.2,
        integral_limit: [0.05, 0.05],
        fade: [20.0, 120.0],
        camera: 0.05,
        closing: Closing::DEFAULT,
        triggers: Triggers::NEVER,
        abort: AbortErrors::DEFAULT,
    };
}

impl Default for GuidanceSettings {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Validate for GuidanceSettings {
    type Error = InvalidSetting;

    fn validate(&self) -> Result<(), InvalidSetting> {
        let (sound, finite) = (is_not_negative, is_positive);
        // Infinity: never.
        let never = f64::INFINITY.to_bits();
        let bound = |x: f64| x.to_bits() == never || is_within(x, 0.0_f64.next_up(), 1e30);
        let triggers = &self.triggers;
        let Closing { out, back, .. } = self.closing;
        let falling =
            |[begins, ends]: [f64; 2]| finite(begins) && is_within(ends, -0.0, begins.next_down());
        let checks = [
            (finite(self.translation), "translation", "positive"),
            (finite(self.attitude), "attitude", "positive"),
            (finite(self.joint), "joint", "positive"),
            (finite(self.most_per_step), "most_per_step", "positive"),
            (sound(self.integral), "integral", "not negative"),
            (self.integral_limit.into_iter().all(sound), "integral_limit", "not negative"),
            (self.fade.into_iter().all(finite), "fade", "positive"),
            (finite(self.camera), "camera", "positive"),
            (self.closing.distances.into_iter().all(sound), "closing.distances", "not negative"),
            (sound(self.closing.settle), "closing.settle", "not negative"),
            (falling(out), "closing.out", "falling"),
            (
                back.into_iter().all(|times| falling(times) && is_within(times[0], -0.0, out[1])),
                "closing.back",
                "falling, and after closing.out",
            ),
            (bound(triggers.age), "triggers.age", "positive"),
            (bound(triggers.position), "triggers.position", "positive"),
            (bound(triggers.attitude), "triggers.attitude", "positive"),
            (bound(triggers.target), "triggers.target", "positive"),
            (sound(triggers.last), "triggers.last", "not negative"),
            (self.abort.settling.into_iter().all(bound), "abort.settling", "positive"),
            (self.abort.settled.into_iter().all(bound), "abort.settled", "positive"),
            (self.abort.near.into_iter().all(bound), "abort.near", "positive"),
            (self.abort.near_times.into_iter().all(sound), "abort.near_times", "not negative"),
            (bound(self.abort.port), "abort.port", "positive"),
            (sound(self.abort.settles), "abort.settles", "not negative"),
        ];
        match checks.into_iter().find(|(ok, _, _)| !ok) {
            Some((_, setting, range)) => Err(InvalidSetting { setting, range }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_nonsense_is_named() {
        GuidanceSettings::DEFAULT.validate().unwrap();
        let named = |change: fn(&mut GuidanceSettings)| {
            let mut settings = GuidanceSettings::DEFAULT;
            change(&mut settings);
            settings.validate().unwrap_err().setting
        };
        assert_eq!(named(|s| s.translation = 0.0), "translation");
        assert_eq!(named(|s| s.attitude = f64::NAN), "attitude");
        assert_eq!(named(|s| s.joint = f64::INFINITY), "joint");
        assert_eq!(named(|s| s.most_per_step = -1.0), "most_per_step");
        assert_eq!(named(|s| s.integral = -0.1), "integral");
        assert_eq!(named(|s| s.integral_limit[1] = f64::NAN), "integral_limit");
        assert_eq!(named(|s| s.fade[0] = 0.0), "fade");
        assert_eq!(named(|s| s.camera = 0.0), "camera");
        assert_eq!(named(|s| s.closing.distances[0] = -1.0), "closing.distances");
        assert_eq!(named(|s| s.closing.out = [100.0, 150.0]), "closing.out");
        assert_eq!(named(|s| s.closing.back[0][1] = f64::NAN), "closing.back");
        assert_eq!(named(|s| s.closing.back[1][0] = 300.0), "closing.back");
        assert_eq!(named(|s| s.triggers.age = 0.0), "triggers.age");
        assert_eq!(named(|s| s.triggers.position = f64::NAN), "triggers.position");
        assert_eq!(named(|s| s.triggers.attitude = -1.0), "triggers.attitude");
        assert_eq!(named(|s| s.triggers.target = 0.0), "triggers.target");
        assert_eq!(named(|s| s.triggers.last = f64::INFINITY), "triggers.last");
        assert_eq!(named(|s| s.closing.settle = -1.0), "closing.settle");
        assert_eq!(named(|s| s.abort.settling[1] = f64::NAN), "abort.settling");
        assert_eq!(named(|s| s.abort.settled[2] = 0.0), "abort.settled");
        assert_eq!(named(|s| s.abort.near[0] = -1.0), "abort.near");
        assert_eq!(named(|s| s.abort.near_times[1] = f64::NAN), "abort.near_times");
        assert_eq!(named(|s| s.abort.port = f64::NAN), "abort.port");
        assert_eq!(named(|s| s.abort.settles = f64::INFINITY), "abort.settles");
    }
}
