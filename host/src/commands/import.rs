//! `remora mission import`

use super::Output;
use super::options::{ForceArgs, JsonArgs, is_stdout};
use crate::report;
use remora_core::nalgebra::Vector3;
use remora_host::error::Error;
use remora_host::formats::{Kind, check_writable, read_mission_file, write_atomically};
use remora_host::importing::{ImportedMission, Request, explanation, import};
use remora_urdf::{OptionError, Options, Pose};
use std::path::{Path, PathBuf};

/// Make a mission for the arm of a URDF.
///
/// The arm is the URDF's, the bus its own or another mission's. Joint angles at capture are found: the
/// end effector's axis points into the port, on the line from the system's centre of mass.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// The arm (*.urdf)
    #[arg(value_name = "FILE.urdf")]
    urdf: PathBuf,
    /// Mission file to write, - for standard output [default: NAME.mission.toml of NAME.urdf, here]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Link that is the bus, or is fixed to it [default: the root of the tree]
    #[arg(long, value_name = "LINK")]
    base_link: Option<String>,
    /// Link whose frame is the end effector [default: the only one that ends the tree]
    #[arg(long, value_name = "LINK")]
    end_effector: Option<String>,
    /// Limits of a joint, for each that needs them [rad, rad, rad/s, N m]
    #[arg(long, value_name = "JOINT=LOWER,UPPER,RATE,TORQUE")]
    limit: Vec<String>,
    /// Hold a joint that does not belong to the arm [rad, or m]
    #[arg(long, value_name = "JOINT=ANGLE")]
    hold: Vec<String>,
    /// Take the mass of a link as a point's, without its inertia; not of one that a joint of the arm moves
    #[arg(long, value_name = "LINK")]
    point_mass: Vec<String>,
    /// Mission that gives bus, target, orbit, thrusters and all else but the arm [default: the URDF's
    /// bus, where its root has mass, and the built-in mission]
    #[arg(long, value_name = "FILE")]
    bus: Option<PathBuf>,
    /// The arm's root in bus axes, from the bus's centre of mass [m, rad; default: on the face that
    /// the boresight leaves]
    #[arg(long, value_name = "X,Y,Z[,R,P,Y]", allow_hyphen_values = true)]
    mount: Option<String>,
    /// The camera's boresight, bus axes [default: the bus mission's; towards the arm, on its own bus]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    boresight: Option<String>,
    /// Axis of the end effector that points into the port, in its own frame [default: 0,0,1]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    axis: Option<String>,
    /// Joint angles at the start [rad; default: straight, or bent as little as keeps clear of the bus]
    #[arg(long, value_name = "A,B,...", allow_hyphen_values = true)]
    start: Option<String>,
    /// Rotors' inertias seen through their gears, one for all joints or one for each [kg m^2; default: none]
    #[arg(long, value_name = "A[,B,...]", allow_hyphen_values = true)]
    armature: Option<String>,
    /// Print all that was understood of the file and what follows from it, and write nothing
    #[arg(long, conflicts_with = "out")]
    explain: bool,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora mission import arm.urdf --explain
  remora mission import servicer.urdf --out mine.mission.toml
  remora mission import arm.urdf --bus bus.mission.toml --mount 0,0,0.5
  remora mission import arm.urdf --end-effector tip --hold finger=0.02 --limit elbow=-2,2,0.05,10
  remora mission import arm.urdf --axis 0,0,1 --start -1.2,1.2 --armature 0.4,0.1 --json

What the file leaves open is refused, all of it at once, with the flag that mends it; or it is decided
and said. No xacro, no SDF, no meshes.

Exit status: 0 imported, 1 imported but infeasible (the constraint is named), or --explain of a file
that cannot be imported; 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let request = self.request()?;
        let out = self.out.clone().unwrap_or_else(|| default_out(&self.urdf));
        if !self.explain && !is_stdout(&out) {
            self.force.keep(&out)?;
        }
        let imported = import(&request);
        if imported.is_err() {
            Kind::Urdf.refuse_other(&self.urdf)?;
        }
        let imported = match imported {
            Ok(imported) => imported,
            Err(refusal) if self.explain => {
                let faults = refusal.faults();
                let text = report::refused_import(&explanation(&request), &faults);
                let told = refusal.told(&request);
                return Output::new(text, false).or_json(self.json.json, &told);
            }
            Err(refusal) => return Err(refusal.error(&request)),
        };
        self.told(&request, &imported, &out)
    }

    /// Writes the mission, unless it is only to be explained, and tells of it.
    fn told(
        &self,
        request: &Request,
        imported: &ImportedMission,
        out: &Path,
    ) -> Result<Output, Error> {
        let can_end = imported.vehicle.refused.is_none();
        if self.explain {
            let text = format!("{}\n{}", explanation(request), report::import_report(imported));
            return Output::new(text, can_end).or_json(self.json.json, imported);
        }
        let toml = imported
            .to_text()
            .map_err(|error| Error::Output { file: out.into(), reason: error.to_string() })?;
        if is_stdout(out) {
            let text = Output::new(toml, can_end).into_data();
            return text.or_json(self.json.json, imported);
        }
        check_writable(out)?;
        write_atomically(out, toml.as_bytes())?;
        let written = format!("written: {}\n", out.display());
        let text = report::import_report(imported) + &written;
        Output::new(text, can_end).or_json(self.json.json, imported)
    }

    fn request(&self) -> Result<Request, Error> {
        let bus = match &self.bus {
            Some(file) => Some((file.clone(), read_mission_file(Some(file))?)),
            None => None,
        };
        Ok(Request {
            options: self.options()?,
            bus,
            mount: self.mount.as_deref().map(mount).transpose()?,
            boresight: self
                .boresight
                .as_deref()
                .map(|text| vector(text, "--boresight"))
                .transpose()?,
            axis: self.axis.as_deref().map(|text| vector(text, "--axis")).transpose()?,
            start: self.start.as_deref().map(|text| numbers(text, "--start")).transpose()?,
            armature: self
                .armature
                .as_deref()
                .map(|text| numbers(text, "--armature"))
                .transpose()?,
            ..Request::of(&self.urdf)?
        })
    }

    fn options(&self) -> Result<Options, Error> {
        let mut options = Options {
            root: self.base_link.clone(),
            end_effector: self.end_effector.clone(),
            point_masses: self.point_mass.iter().cloned().collect(),
            ..Options::default()
        };
        for limit in &self.limit {
            options.add_limit(limit).map_err(|error| argument("--limit", &error))?;
        }
        for hold in &self.hold {
            options.add_hold(hold).map_err(|error| argument("--hold", &error))?;
        }
        Ok(options)
    }
}

fn default_out(urdf: &Path) -> PathBuf {
    let stem = urdf.file_stem().unwrap_or_default().to_string_lossy();
    format!("{stem}.mission.toml").into()
}

fn mount(text: &str) -> Result<Pose, Error> {
    let mut options = Options::default();
    options.set_mount(text).map_err(|error| argument("--mount", &error))?;
    Ok(options.mount)
}

/// The importer's errors begin with the flag themselves.
fn argument(flag: &'static str, error: &OptionError) -> Error {
    let text = error.to_string();
    let reason = text.strip_prefix(flag).unwrap_or(&text).trim_start_matches([' ', ':']);
    Error::argument(flag, reason)
}

fn vector(text: &str, flag: &'static str) -> Result<Vector3<f64>, Error> {
    match numbers(text, flag)?[..] {
        [x, y, z] => Ok(Vector3::new(x, y, z)),
        _ => Err(Error::argument(flag, format!("`{text}`: expects three numbers, x,y,z"))),
    }
}

fn numbers(text: &str, flag: &'static str) -> Result<Vec<f64>, Error> {
    let number = |part: &str| part.trim().parse().ok().filter(|x: &f64| x.is_finite());
    let all: Option<Vec<f64>> = text.split(',').map(number).collect();
    all.ok_or_else(|| {
        Error::argument(flag, format!("`{text}`: expects finite numbers with commas"))
    })
}
