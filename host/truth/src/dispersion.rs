//! One draw of all errors: how the true world differs from the nominal one.

use crate::errors::{Errors, Faults};
use crate::orbit::eccentricity;
use crate::random::{Source, Stream};
use crate::rotation::{about, matrix, normalized, product};
use crate::setup::Setup;
use crate::vehicle::{Body, Vehicle};
use nalgebra::{Matrix3, Vector3};

/// A draw of errors: the same for the same errors, seed and run.
#[derive(Clone, Debug, PartialEq)]
pub struct Dispersion {
    /// Deviations to draw with.
    pub errors: Errors,
    /// Seed of a campaign.
    pub seed: u64,
    /// Run of the campaign, below 2^48.
    pub run: u64,
}

impl Dispersion {
    /// Random numbers of one source of error.
    pub fn stream(&self, source: Source) -> Stream {
        Stream::new(self.seed, self.run, source)
    }

    /// Faults with their times, which are drawn where the errors say so.
    pub fn faults(&self) -> Faults {
        let mut faults = self.errors.faults;
        let Some(within) = faults.drawn_within_s else { return faults };
        let [normal] = self.stream(Source::FaultTime).normals::<1>(1.0);
        // The normal distribution's own share makes it even.
        let time = within * 0.5 * libm::erfc(-normal * core::f64::consts::FRAC_1_SQRT_2);
        if let Some(fault) = &mut faults.thruster_lost {
            fault.time_s = time;
        }
        if let Some(fault) = &mut faults.joint_stuck {
            fault.time_s = time;
        }
        if let Some(fault) = &mut faults.target_rate {
            fault.time_s = time;
        }
        faults
    }

    /// The nominal world with all errors that hold from the start on: masses, geometry, tumbling,
    /// orbit. Those of actuators and sensors are the world's to draw.
    pub fn disperse<const NL: usize>(&self, nominal: &Setup<NL>) -> Setup<NL> {
        let mut setup = nominal.clone();
        self.masses(&mut setup.vehicle);
        self.places(&mut setup);
        self.tumble(&mut setup);
        self.orbit(&mut setup);
        setup
    }

    fn masses<const NL: usize>(&self, vehicle: &mut Vehicle<NL>) {
        let e = &self.errors.mass;
        let mut bus = MassStreams {
            mass: self.stream(Source::BusMass),
            inertia: self.stream(Source::BusInertia),
            axes: self.stream(Source::BusInertiaAxes),
        };
        bus.disperse(self, &mut vehicle.bus);
        vehicle.bus.center += self.stream(Source::BusCenter).vector(e.bus_center_m);
        let mut links = MassStreams {
            mass: self.stream(Source::LinkMass),
            inertia: self.stream(Source::LinkInertia),
            axes: self.stream(Source::LinkInertiaAxes),
        };
        let mut centers = self.stream(Source::LinkCenter);
        for joint in &mut vehicle.joints {
            links.disperse(self, &mut joint.link);
            joint.link.center += centers.vector(e.link_center_m);
        }
    }

    fn places<const NL: usize>(&self, setup: &mut Setup<NL>) {
        let e = &self.errors.geometry;
        setup.target.port += self.stream(Source::Port).vector(e.port_m);
        if let Some(first) = setup.vehicle.joints.first_mut() {
            first.pivot += self.stream(Source::ArmBase).vector(e.arm_base_m);
        }
    }

    fn tumble<const NL: usize>(&self, setup: &mut Setup<NL>) {
        let (e, target) = (&self.errors.tumble, &mut setup.target);
        let [rate] = self.stream(Source::TumbleRate).normals::<1>(e.rate);
        let turn = self.stream(Source::TumbleDirection).rotation(e.rate_direction_rad);
        target.rate = matrix(&turn) * target.rate * (1.0 + rate);
        let turn = self.stream(Source::TargetAttitude).rotation(e.attitude_rad);
        target.attitude = normalized(&product(&turn, &target.attitude));
        let ratios = self.stream(Source::InertiaRatio).normals::<3>(e.inertia_ratio);
        target.inertia.component_mul_assign(&Vector3::from(ratios.map(libm::exp)));
        let o = &self.errors.orbit;
        target.disturbance +=
            self.stream(Source::TargetDisturbance).vector(o.target_disturbance_n_m);
    }

    /// Adds to the eccentricity vector, keeping where the target is on its orbit.
    fn orbit<const NL: usize>(&self, setup: &mut Setup<NL>) {
        let deviation = self.errors.orbit.eccentricity;
        if deviation == 0.0 {
            return;
        }
        let [x, y] = self.stream(Source::Eccentricity).normals::<2>(deviation);
        let (orbit, mu) = (&mut setup.orbit, setup.environment.mu);
        let node = about(&Vector3::x(), orbit.inclination);
        let (r, v) = orbit.state(mu);
        let e = node.transpose() * eccentricity(&r, &v, mu) + Vector3::new(x, y, 0.0);
        orbit.eccentricity = libm::sqrt(e.x * e.x + e.y * e.y);
        orbit.argument_of_perigee = libm::atan2(e.y, e.x);
    }
}

/// Random numbers of a row of bodies.
struct MassStreams {
    mass: Stream,
    inertia: Stream,
    axes: Stream,
}

impl MassStreams {
    fn disperse(&mut self, dispersion: &Dispersion, body: &mut Body) {
        let e = &dispersion.errors.mass;
        let [mass] = self.mass.normals::<1>(e.mass);
        body.mass *= libm::exp(mass);
        body.inertia *= libm::exp(mass);
        if e.inertia != 0.0 {
            // Two of three second moments make a moment of inertia: the root of two more each.
            let half = 0.5 * core::f64::consts::SQRT_2 * e.inertia;
            let scales = Vector3::from(self.inertia.normals::<3>(half).map(libm::exp));
            let scale = Matrix3::from_diagonal(&scales);
            let second = scale * from_trace(&body.inertia, 0.5) * scale;
            body.inertia = from_trace(&second, 1.0);
        }
        let turn = matrix(&self.axes.rotation(e.inertia_axes_rad));
        body.inertia = crate::rotation::turned(&body.inertia, &turn);
    }
}

/// `factor tr(m) 1 - m`: inertia to second moments of mass with a half, and back with one.
fn from_trace(m: &Matrix3<f64>, factor: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal_element(factor * m.trace()) - m
}
