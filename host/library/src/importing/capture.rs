//! Advice for an arm without joint angles at capture: another axis of its end effector, a longer tool, a
//! thinner link.

use super::{Request, unsearched};
use crate::formats::{Mission, MissionFile, capture_search};
use nalgebra::Vector3;
use remora_core::advanced::model::CaptureSearch;
use remora_urdf::Arm;

/// Step to which lengths are rounded, to the side that works [m].
const STEP: f64 = 1e-3;
/// Halvings of an interval of lengths.
const HALVINGS: i32 = 8;

/// An arm at a mount that was tried, and the conditions on its angles at capture.
type Trial = (Mission, CaptureSearch);

/// Advice after a search that has failed at all of these mounts.
pub(super) fn advice(request: &Request, failed: &[(MissionFile, Arm)]) -> String {
    let Some((file, arm)) = failed.first() else { return String::new() };
    let axes = axes(request, file, arm);
    if !axes.is_empty() {
        return format!("as the end effector's axis would do {}", axes.join(", "));
    }
    let tried: Vec<Trial> = failed.iter().filter_map(|(file, _)| tried(file)).collect();
    let other = "none of +-x, +-y, +-z of the end effector would do as its axis: another --mount, --boresight or \
                 --start may";
    let sizes = [thinner_links(&tried, arm), longer_tool(&tried, arm)];
    sizes.into_iter().flatten().chain([other.into()]).collect::<Vec<String>>().join("; ")
}

/// Flags of axes of the end effector's frame that would work.
fn axes(request: &Request, file: &MissionFile, arm: &Arm) -> Vec<String> {
    let asked = request.axis.and_then(|axis| axis.try_normalize(1e-9)).unwrap_or_else(Vector3::z);
    let others = [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().flat_map(|v| [v, -v]);
    let works = |own: &Vector3<f64>| {
        let mut other = file.clone();
        other.servicer.end_effector_axis =
            Some((arm.end_effector.rotation * own).normalize().into());
        own.dot(&asked) < 0.99 && other.mission().is_ok()
    };
    others.filter(works).map(|own| flag(&own)).collect()
}

fn tried(file: &MissionFile) -> Option<Trial> {
    let axis = file.servicer.capture_axis().ok().flatten()?;
    let mission = unsearched(file).ok()?;
    Some((mission, capture_search(&mission, axis)))
}

fn works((mission, search): &Trial) -> bool {
    mission.capture_configuration(search, &mission.servicer.initial_joint_angle_rad).is_ok()
}

/// The links that are in the way, and the radius at which they would not be.
fn thinner_links(tried: &[Trial], arm: &Arm) -> Option<String> {
    let thinned = |tried: &Trial, which: &[usize], most: f64| {
        let (mut mission, search) = *tried;
        let links = &mut mission.servicer.links;
        which.iter().for_each(|i| links[*i].radius_m = links[*i].radius_m.min(most));
        works(&(mission, search))
    };
    let mut links: Vec<usize> = (0..arm.joints.len()).collect();
    let place = tried.iter().find(|tried| thinned(tried, &links, 0.0))?;
    let widest = place.0.servicer.links.iter().map(|link| link.radius_m).fold(0.0, f64::max);
    let most = bisected((0.0, widest), |most| thinned(place, &links, most));
    let most = (most / STEP).floor() * STEP;
    // Links that may stay as they are, are not in the way.
    for i in 0..arm.joints.len() {
        let others: Vec<usize> = links.iter().copied().filter(|other| *other != i).collect();
        if thinned(place, &others, most) {
            links = others;
        }
    }
    let radius = |i: usize| Some(place.0.servicer.links.get(i)?.radius_m);
    let link = |i: &usize| Some((&arm.joints.get(*i)?.link, radius(*i)?));
    let named: Vec<String> = links
        .iter()
        .filter_map(link)
        .map(|(name, radius)| format!("`{name}` ({radius:.3} m)"))
        .collect();
    let does = most > 0.0 && !named.is_empty() && thinned(place, &links, most);
    does.then(|| {
        format!(
            "in the way: link {}; a capsule of radius {most:.3} m would do",
            named.join(" and link ")
        )
    })
}

/// The least length of a tool that would work, along the end effector's axis.
fn longer_tool(tried: &[Trial], arm: &Arm) -> Option<String> {
    let last = arm.joints.len().checked_sub(1)?;
    let longer = |tried: &Trial, by: f64| {
        let (mut mission, search) = *tried;
        mission.servicer.links[last].tip_m += search.axis * by;
        works(&(mission, search))
    };
    let (mission, search) = tried.first()?;
    let links = &mission.servicer.links;
    let whole: f64 = links.iter().map(|link| link.tip_m.norm()).sum();
    let found = |by: f64| tried.iter().find(|tried| longer(tried, by)).map(|place| (place, by));
    let mut lengths = (0..=HALVINGS).rev().map(|halvings| whole * 0.5_f64.powi(halvings));
    let (place, by) = lengths.find_map(found)?;
    // Bisection keeps the end of the interval that works.
    let shorter = bisected((by, 0.0), |by| longer(place, by));
    let now = links[last].tip_m.dot(&search.axis);
    let length = ((now + shorter) / STEP).ceil() * STEP;
    let joint = arm.joints.get(last)?;
    longer(place, length - now).then(|| {
        format!(
            "a longer tool would do: the end effector {length:.3} m beyond joint `{}` along its axis, not {now:.3} m",
            joint.name
        )
    })
}

/// Bisects between a value that works and one that does not; returns the last that works.
fn bisected((mut does, mut does_not): (f64, f64), works: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (does + does_not);
        if works(middle) {
            does = middle;
        } else {
            does_not = middle;
        }
    }
    does
}

fn flag(v: &Vector3<f64>) -> String {
    let [x, y, z] = [v.x, v.y, v.z].map(|x| x + 0.0);
    format!("--axis {x},{y},{z}")
}
