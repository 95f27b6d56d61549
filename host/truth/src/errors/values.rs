use super::{
    Class, Errors, Faults, Geometry, Joints, Mass, Navigation, OrbitErrors, Sampling, Sensors,
    Thrusters, Tumble, Wheels,
};

/// A number of an errors file that makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} is {value}: {wanted}")]
pub struct ErrorsFault {
    /// Its key.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// Requirement on the value.
    pub wanted: &'static str,
}

/// Fields of a section with their keys.
macro_rules! named {
    ($errors:ident . $section:ident : $($field:ident),*) => {
        vec![$((
            concat!(stringify!($section), ".", stringify!($field)),
            &mut $errors.$section.$field,
        )),*]
    };
}

const DEGREE: f64 = core::f64::consts::PI / 180.0;

impl Errors {
    /// The world is as the planner believes: all deviations zero, sensors at 10 Hz without delay.
    pub fn none() -> Self {
        let mut errors = Self::typical();
        for class in Class::ALL {
            errors = errors.scaled(class, 0.0);
        }
        errors.sensors = Sensors::all(Sampling { rate_hz: 10.0, delay_s: 0.0 });
        errors
    }

    /// Typical errors. All values are assumed.
    pub fn typical() -> Self {
        Self {
            navigation: Navigation {
                position_drift_m: 3e-3,
                position_drift_time_s: 200.0,
                position_drift_range_m: 2.5,
                position_noise_m: 5e-3,
                velocity_noise_m_s: 5e-4,
                attitude_drift_rad: 0.05 * DEGREE,
                attitude_drift_time_s: 100.0,
                target_attitude_drift_rad: 0.3 * DEGREE,
                target_attitude_drift_time_s: 200.0,
                bus_rate_noise_rad_s: 1e-5,
                target_rate_noise_rad_s: 5e-6,
                wrist_camera_noise_m: 0.0,
            },
            thrusters: Thrusters {
                scale: 0.03,
                direction_rad: DEGREE,
                noise: 0.05,
                impulse_bit_n_s: 0.02,
                period_s: 1.0,
            },
            wheels: Wheels { scale: 0.02, bias_n_m: 5e-5, noise_n_m: 1e-5, noise_period_s: 0.1 },
            joints: Joints {
                scale: 0.03,
                bias_n_m: 5e-5,
                friction_n_m: 2e-4,
                friction_rate_rad_s: 1e-4,
                angle_bias_rad: 5e-4,
                angle_noise_rad: 1e-4,
                rate_noise_rad_s: 2e-5,
            },
            mass: Mass {
                mass: 0.03,
                inertia: 0.07,
                inertia_axes_rad: 2.0 * DEGREE,
                bus_center_m: 5e-3,
                link_center_m: 2e-3,
            },
            tumble: Tumble {
                rate: 0.03,
                rate_direction_rad: 3.0 * DEGREE,
                attitude_rad: DEGREE,
                inertia_ratio: 0.02,
            },
            geometry: Geometry { port_m: 5e-3, arm_base_m: 2e-3, wrist_camera_m: 1e-3 },
            orbit: OrbitErrors {
                eccentricity: 1e-3,
                drag_m_s2: 2e-6,
                disturbance_n_m: 2e-5,
                target_disturbance_n_m: 0.0,
            },
            sensors: Sensors::all(Sampling { rate_hz: 10.0, delay_s: 0.0 }),
            faults: Faults::default(),
        }
    }

    /// One class's deviations and impulse bit times a factor; times, ranges and faults stay.
    #[must_use]
    pub fn scaled(mut self, class: Class, factor: f64) -> Self {
        for (_, value) in self.deviations(class) {
            *value *= factor;
        }
        self
    }

    /// One class's errors alone: deviations of all others zero, nothing fails.
    #[must_use]
    pub fn only(mut self, class: Class) -> Self {
        for other in Class::ALL.into_iter().filter(|other| *other != class) {
            self = self.scaled(other, 0.0);
        }
        Self { faults: Faults::default(), ..self }
    }

    /// The numbers that scale with a class, with their keys.
    fn deviations(&mut self, class: Class) -> Vec<(&'static str, &mut f64)> {
        match class {
            Class::Navigation => named!(self.navigation: position_drift_m, position_noise_m,
                velocity_noise_m_s, attitude_drift_rad, target_attitude_drift_rad,
                bus_rate_noise_rad_s, target_rate_noise_rad_s, wrist_camera_noise_m),
            Class::Thrusters => {
                named!(self.thrusters: scale, direction_rad, noise, impulse_bit_n_s)
            }
            Class::Torques => {
                let mut all = named!(self.wheels: scale, bias_n_m, noise_n_m);
                all.extend(named!(self.joints: scale, bias_n_m, friction_n_m, angle_bias_rad,
                    angle_noise_rad, rate_noise_rad_s));
                all
            }
            Class::Mass => {
                named!(self.mass: mass, inertia, inertia_axes_rad, bus_center_m, link_center_m)
            }
            Class::Tumble => {
                named!(self.tumble: rate, rate_direction_rad, attitude_rad, inertia_ratio)
            }
            Class::Geometry => named!(self.geometry: port_m, arm_base_m, wrist_camera_m),
            Class::Orbit => {
                named!(self.orbit: eccentricity, drag_m_s2, disturbance_n_m, target_disturbance_n_m)
            }
        }
    }

    /// Whether every number makes sense for an arm of `joints` joints.
    ///
    /// # Errors
    ///
    /// The first that does not.
    pub fn check(&self, joints: usize) -> Result<(), ErrorsFault> {
        let mut copy = self.clone();
        for class in Class::ALL {
            for (key, value) in copy.deviations(class) {
                let good = *value >= 0.0 && value.is_finite();
                fits(key, *value, good, "must be finite and not negative")?;
            }
        }
        self.check_times()?;
        self.check_faults(joints)
    }

    fn check_times(&self) -> Result<(), ErrorsFault> {
        let (n, s) = (&self.navigation, &self.sensors);
        let samplings = [
            ("sensors.position", s.position),
            ("sensors.velocity", s.velocity),
            ("sensors.attitude", s.attitude),
            ("sensors.target_attitude", s.target_attitude),
            ("sensors.bus_rate", s.bus_rate),
            ("sensors.target_rate", s.target_rate),
            ("sensors.joint_angle", s.joint_angle),
            ("sensors.joint_rate", s.joint_rate),
            ("sensors.wrist_camera", s.wrist_camera),
        ];
        for (key, sampling) in samplings {
            let (rate, delay) = (sampling.rate_hz, sampling.delay_s);
            fits(key, rate, rate > 0.0 && rate <= 1e3, "a rate is above 0, up to 1000 Hz")?;
            fits(key, delay, (0.0..=1e3).contains(&delay), "a delay is 0 to 1000 s")?;
        }
        let times = [
            ("navigation.position_drift_time_s", n.position_drift_time_s),
            ("navigation.position_drift_range_m", n.position_drift_range_m),
            ("navigation.attitude_drift_time_s", n.attitude_drift_time_s),
            ("navigation.target_attitude_drift_time_s", n.target_attitude_drift_time_s),
            ("joints.friction_rate_rad_s", self.joints.friction_rate_rad_s),
        ];
        for (key, value) in times {
            fits(key, value, value > 0.0 && value.is_finite(), "must be finite and above 0")?;
        }
        let periods = [
            ("thrusters.period_s", self.thrusters.period_s),
            ("wheels.noise_period_s", self.wheels.noise_period_s),
        ];
        for (key, value) in periods {
            fits(key, value, (1e-3..=1e6).contains(&value), "a period is 0.001 to 1e6 s")?;
        }
        let range = s.wrist_camera_range_m;
        fits("sensors.wrist_camera_range_m", range, range >= 0.0, "a range is not negative")
    }

    fn check_faults(&self, joints: usize) -> Result<(), ErrorsFault> {
        let time = |key, time: f64| {
            fits(key, time, time >= 0.0 && time.is_finite(), "a time is finite, 0 or later")
        };
        if let Some(within) = self.faults.drawn_within_s {
            time("faults.drawn_within_s", within)?;
        }
        if let Some(lost) = self.faults.thruster_lost {
            let key = "faults.thruster_lost";
            fits(key, lost.axis as f64, lost.axis < 3, "axes are 0, 1 and 2")?;
            time(key, lost.time_s)?;
        }
        if let Some(stuck) = self.faults.joint_stuck {
            let key = "faults.joint_stuck";
            fits(key, stuck.joint as f64, stuck.joint < joints, "the arm has no such joint")?;
            time(key, stuck.time_s)?;
        }
        if let Some(change) = self.faults.target_rate {
            let key = "faults.target_rate";
            fits(key, change.factor, change.factor.is_finite(), "a factor is finite")?;
            time(key, change.time_s)?;
        }
        Ok(())
    }
}

fn fits(
    key: &'static str,
    value: f64,
    good: bool,
    wanted: &'static str,
) -> Result<(), ErrorsFault> {
    if good { Ok(()) } else { Err(ErrorsFault { key, value, wanted }) }
}
