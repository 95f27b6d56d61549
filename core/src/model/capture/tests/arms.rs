//! Arms that the tests search for.

use crate::model::{Link, Servicer};
use nalgebra::{SVector, Vector3};

/// An arm on the default servicer's bus, all stops at half a turn.
pub fn servicer<const NL: usize>(base: f64, links: [Link; NL]) -> Servicer<NL> {
    let bus = Servicer::<3>::default();
    Servicer {
        bus_mass_kg: bus.bus_mass_kg,
        bus_inertia_kg_m2: bus.bus_inertia_kg_m2,
        bus_half_extents_m: bus.bus_half_extents_m,
        boresight: bus.boresight,
        arm_base_m: Vector3::new(0.0, 0.0, base),
        links,
        min_joint_angle_rad: SVector::repeat(-core::f64::consts::PI),
        max_joint_angle_rad: SVector::repeat(core::f64::consts::PI),
        joint_rate_limit_rad_s: SVector::repeat(0.005),
        initial_joint_angle_rad: SVector::from_fn(|i, _| 0.3 - 0.1 * i as f64),
        capture_joint_angle_rad: SVector::zeros(),
        force_limit_n: bus.force_limit_n,
        bus_torque_limit_n_m: bus.bus_torque_limit_n_m,
        joint_torque_limit_n_m: SVector::repeat(0.005),
    }
}

pub fn link(axis: Vector3<f64>, tip: Vector3<f64>, mass: f64) -> Link {
    let half = tip * 0.5;
    Link { axis, tip_m: tip, center_of_mass_m: half, ..Link::cylinder(0.5, mass, 0.05) }
}

/// Shoulder and wrist of three joints each at a point, an elbow between, and a twist in the wrist.
pub fn seven() -> Servicer<7> {
    let (z, none) = (Vector3::z(), Vector3::zeros());
    let twisted = Vector3::new(0.6, 0.0, 0.8);
    servicer(
        0.5,
        [
            link(z, none, 3.0),
            link(Vector3::y(), none, 3.0),
            link(z, z * 0.8, 10.0),
            link(Vector3::y(), z * 0.7, 8.0),
            link(z, none, 2.0),
            link(Vector3::x(), none, 2.0),
            link(twisted, Vector3::new(0.05, 0.0, 0.3), 4.0),
        ],
    )
}

/// Offset at shoulder and elbow, as industrial arms have.
pub fn six() -> Servicer<6> {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    servicer(
        0.5,
        [
            link(z, z * 0.2, 8.0),
            link(y, Vector3::new(0.0, 0.12, 0.9), 12.0),
            link(y, Vector3::new(0.0, -0.1, 0.7), 8.0),
            link(z, Vector3::zeros(), 2.0),
            link(x, z * 0.15, 3.0),
            link(y, z * 0.2, 3.0),
        ],
    )
}

/// Numbers from a seed (Steele's splitmix).
pub struct Draw(pub u64);

impl Draw {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, least: f64, largest: f64) -> f64 {
        least + (largest - least) * self.unit()
    }

    pub fn direction(&mut self) -> Vector3<f64> {
        let z = self.between(-1.0, 1.0);
        let turn = self.between(0.0, 2.0 * core::f64::consts::PI);
        let across = (1.0 - z * z).sqrt();
        Vector3::new(across * turn.cos(), across * turn.sin(), z)
    }
}

/// A chain with joint axes anywhere, links up to a metre that lean, some of no length.
pub fn chain<const NL: usize>(draw: &mut Draw) -> Servicer<NL> {
    let links = core::array::from_fn(|i| {
        let length = if i > 0 && draw.unit() < 0.2 { 0.0 } else { draw.between(0.2, 1.0) };
        let along = (Vector3::z() + draw.direction() * 0.3).normalize();
        link(draw.direction(), along * length, draw.between(5.0, 20.0))
    });
    let mut servicer = servicer(0.5, links);
    servicer.joint_rate_limit_rad_s = SVector::from_fn(|_, _| draw.between(2e-3, 2e-2));
    servicer.initial_joint_angle_rad = SVector::from_fn(|_, _| draw.between(-3.0, 3.0));
    servicer
}
