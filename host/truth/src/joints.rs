//! Motor of a joint: torque or servo mode, friction.

/// A joint's motor while its command is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointDrive {
    /// Mode of the motor, with its command.
    pub mode: JointMode,
    /// Largest torque of the motor [N m].
    pub limit: f64,
    /// Given torque over asked torque.
    pub gain: f64,
    /// Torque given where none is asked [N m].
    pub bias: f64,
    /// Coulomb friction [N m].
    pub friction: f64,
    /// Joint rate below which friction goes down to zero [rad/s].
    pub friction_rate: f64,
}

/// Mode of a joint's motor, with its command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointMode {
    /// A torque [N m].
    Torque(f64),
    /// To follow an angle that moves at a constant rate.
    Servo {
        /// When the reference has its angle [s].
        time: f64,
        /// The reference [rad], with the encoder's bias in it.
        angle: f64,
        /// Its rate [rad/s].
        rate: f64,
        /// Feed-forward [N m].
        torque: f64,
        /// Torque by angle [N m/rad].
        stiffness: f64,
        /// Torque by rate [N m s/rad].
        damping: f64,
    },
}

impl JointDrive {
    /// Torque on the outer body [N m].
    ///
    /// Coulomb friction would jump where the rate changes its sign, which no integrator of high
    /// order can pass. It goes as `rate / sqrt(rate^2 + friction_rate^2)` instead: within 1 % of
    /// Coulomb's beyond seven times the friction rate, viscous below. A joint does not stick, it
    /// creeps.
    #[inline]
    pub fn torque(&self, time: f64, angle: f64, rate: f64) -> f64 {
        let asked = match self.mode {
            JointMode::Torque(torque) => torque,
            JointMode::Servo { time: start, angle: a, rate: r, torque, stiffness, damping } => {
                torque + stiffness * (a + r * (time - start) - angle) + damping * (r - rate)
            }
        };
        let given = asked.clamp(-self.limit, self.limit) * self.gain + self.bias;
        if self.friction == 0.0 {
            return given;
        }
        let speed = libm::sqrt(rate * rate + self.friction_rate * self.friction_rate);
        given - self.friction * rate / speed
    }
}
