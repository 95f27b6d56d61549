//! Limits of a joint: the caller's, or the file's as far as they are written.

use crate::fault::{Fault, Place};
use crate::note::{Findings, Note};
use crate::options::{Limits, MAX_ANGLE, Options};
use crate::text::number;
use crate::written::{LimitText, TWO_TURNS, Written};
use std::f64::consts::{FRAC_PI_2, PI};
use urdf_rs::{Joint, JointType};

/// How far from a multiple of pi/2 a value is told about [rad]: what is nearer is only rounding, what
/// is farther is meant.
const ROUNDED: std::ops::Range<f64> = 1e-9..1e-3;

/// Share of a range by which rounding may exceed it.
const ROUNDING: f64 = 1e-9;

/// The limits of a joint that moves.
pub fn limits(
    joint: &Joint,
    written: &Written,
    options: &Options,
    found: &mut Findings,
) -> Option<Limits> {
    let limits = chosen(joint, written, options, found)?;
    let Limits { lower, upper, .. } = limits;
    // Ends of two turns together may be rounded.
    let most = TWO_TURNS * (1.0 + ROUNDED.end);
    if lower.abs().max(upper.abs()).max(upper - lower) > most {
        found.notes.push(Note::WideRange { joint: joint.name.clone(), lower, upper });
    }
    Some(limits)
}

/// The caller's limits, or the file's.
fn chosen(
    joint: &Joint,
    written: &Written,
    options: &Options,
    found: &mut Findings,
) -> Option<Limits> {
    let name = || joint.name.clone();
    let Findings { faults, notes } = found;
    let text = written.limits.get(&joint.name);
    if let Some(limits) = options.limits.get(&joint.name) {
        notes.extend(text.map(|_| Note::LimitGiven { joint: name() }));
        return Some(*limits);
    }
    let Some(text) = text else {
        let found = ", without which it cannot be planned for".to_owned();
        faults.push(Fault::NoLimit { joint: name(), what: "has no", found });
        return None;
    };
    let mut refuse = |found: String| {
        faults.push(Fault::NoLimit { joint: name(), what: "unusable", found });
    };
    let rate = positive("velocity", text.velocity.as_deref()).map_err(&mut refuse).ok();
    let torque = positive("effort", text.effort.as_deref()).map_err(&mut refuse).ok();
    let range = if joint.joint_type == JointType::Continuous {
        notes.push(Note::ContinuousAssumed { joint: name() });
        Some((-PI, PI))
    } else {
        range(joint, text, notes).map_err(&mut refuse).ok()
    };
    let (lower, upper) = range?;
    let is_ordered = -MAX_ANGLE <= lower && lower < upper && upper <= MAX_ANGLE;
    if !is_ordered {
        faults.push(Fault::LimitOrder { joint: name(), lower, upper });
    }
    if is_ordered && !(lower <= 0.0 && 0.0 <= upper) {
        notes.push(Note::ZeroOutside { joint: name(), lower, upper });
    }
    let (lower, upper) = narrowed(&joint.name, (lower, upper), written, notes);
    let place = Place::Joint(name());
    near_pi(&place, "lower", lower, notes);
    near_pi(&place, "upper", upper, notes);
    Some(Limits { lower, upper, rate: rate?, torque: torque? }).filter(|_| is_ordered)
}

/// The range within the soft limits, if they are given and leave one.
fn narrowed(
    joint: &str,
    (lower, upper): (f64, f64),
    written: &Written,
    notes: &mut Vec<Note>,
) -> (f64, f64) {
    let Some(soft) = written.soft_limits.get(joint).copied() else { return (lower, upper) };
    let within = (
        lower.max(soft.lower.unwrap_or(f64::NEG_INFINITY)),
        upper.min(soft.upper.unwrap_or(f64::INFINITY)),
    );
    let (joint, is_range) = (joint.to_owned(), within.0 < within.1);
    if is_range && within != (lower, upper) {
        notes.push(Note::SoftLimits { joint, lower: within.0, upper: within.1 });
    } else if !is_range && lower < upper {
        notes.push(Note::SoftLimitsEmpty { joint });
    }
    if is_range { within } else { (lower, upper) }
}

/// A fault if a held joint is beyond its known range.
pub fn held_beyond(
    joint: &Joint,
    value: f64,
    written: &Written,
    options: &Options,
) -> Option<Fault> {
    let (lower, upper) = match (options.limits.get(&joint.name), written.limits.get(&joint.name)) {
        (Some(limits), _) => (limits.lower, limits.upper),
        (None, Some(text)) if joint.joint_type != JointType::Continuous => {
            let range = range(joint, text, &mut Vec::new()).ok()?;
            narrowed(&joint.name, range, written, &mut Vec::new())
        }
        _ => return None,
    };
    let slack = ROUNDING * lower.abs().max(upper.abs());
    if lower - slack <= value && value <= upper + slack {
        return None;
    }
    let unit = if joint.joint_type == JointType::Prismatic { "m" } else { "rad" };
    let joint = joint.name.clone();
    Some(Fault::HeldBeyond { joint, value, lower, upper, unit })
}

/// A positive number, or what is there instead.
fn positive(field: &str, text: Option<&str>) -> Result<f64, String> {
    let text = text.ok_or_else(|| format!(": `{field}` is not written"))?;
    number(text).filter(|value| *value > 0.0).ok_or_else(|| {
        let shown: String = text.chars().take(80).collect();
        format!(": `{field}` is \"{shown}\", not a positive number")
    })
}

/// Both ends; one that is not written is 0 in URDF.
fn range(joint: &Joint, text: &LimitText, notes: &mut Vec<Note>) -> Result<(f64, f64), String> {
    let end = |field: &str, text: &Option<String>| match text {
        None => Ok(0.0),
        Some(text) => number(text).ok_or_else(|| {
            let shown: String = text.chars().take(80).collect();
            format!(": `{field}` is \"{shown}\", not a finite number")
        }),
    };
    match (&text.lower, &text.upper) {
        (None, None) => return Err(": neither `lower` nor `upper` is written".to_owned()),
        (Some(_), Some(_)) => {}
        _ => notes.push(Note::OneEnd { joint: joint.name.clone() }),
    }
    Ok((end("lower", &text.lower)?, end("upper", &text.upper)?))
}

/// Tells of a value that was probably meant to be a multiple of pi/2.
pub fn near_pi(place: &Place, field: &str, value: f64, notes: &mut Vec<Note>) {
    let quarters = (value / FRAC_PI_2).round();
    if quarters != 0.0 && ROUNDED.contains(&(value - quarters * FRAC_PI_2).abs()) {
        let (place, field) = (place.clone(), field.to_owned());
        notes.push(Note::NearPi { place, field, value, nearest: quarters / 2.0 });
    }
}
