//! A mission for the arm of a URDF: the arm is the file's, the bus its own or another mission's, and
//! all else what that mission says. Joint angles at capture are found from the end effector's axis.
//!
//! A value that a file leaves open is decided and noted, or refused with the flag that sets it.

mod actuators;
mod bus;
mod capture;
mod mount;
mod mounting;
mod scenarios;
mod servicer;
mod start;
mod text;

use crate::error::{Error, FieldError, in_one_line, io_reason};
use crate::formats::{Mission, MissionCapture, MissionFile, open_regular};
use crate::method::Integrator;
use crate::vehicle::Vehicle;
use bus::ArmOnBus;
use nalgebra::Vector3;
use remora_urdf::{Arm, MAX_BYTES, Options, Pose, Refusal};
use serde::Serialize;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The `format` of `remora mission import --json`.
pub const FORMAT: &str = "remora-import/1";

/// Request for an import: the URDF, and the options beside it.
#[derive(Clone, Debug)]
pub struct Request {
    /// The URDF's file, for messages.
    pub file: PathBuf,
    /// Its contents.
    pub urdf: Vec<u8>,
    /// Options for reading the arm; the mount is [`Request::mount`].
    pub options: Options,
    /// The mission that gives the bus and all else but the arm.
    pub bus: Option<(PathBuf, MissionFile)>,
    /// Pose of the arm's root link in bus axes, from the bus's centre of mass where that is given.
    pub mount: Option<Pose>,
    /// The camera's boresight, bus axes.
    pub boresight: Option<Vector3<f64>>,
    /// The end effector's axis, in its own frame, which points into the port.
    pub axis: Option<Vector3<f64>>,
    /// Joint angles at the start [rad].
    pub start: Option<Vec<f64>>,
    /// Inertias of the joints' rotors, as they are seen through their gears [kg m^2]: one for all joints, or
    /// one for each. None where a URDF's arm has none.
    pub armature: Option<Vec<f64>>,
}

/// A mission that was made of a URDF.
#[derive(Clone, Debug, Serialize)]
pub struct ImportedMission {
    /// [`FORMAT`].
    pub format: &'static str,
    /// The URDF's file.
    pub file: PathBuf,
    /// The robot's name.
    pub robot: String,
    /// The joints, from the bus outwards.
    pub joints: Vec<Joint>,
    /// Notes on what the file's reader assumed, merged or left out.
    pub notes: Vec<String>,
    /// Notes on probable mistakes in the file.
    #[serde(skip)]
    pub doubts: Vec<String>,
    /// Decisions where neither file nor flags give a value.
    pub decided: Vec<String>,
    /// The mission file.
    pub mission: MissionFile,
    /// Figures that follow from the mission.
    pub vehicle: Vehicle,
}

/// A joint of an imported arm.
#[derive(Clone, Debug, Serialize)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// Angle at the start [rad].
    pub start_rad: f64,
    /// Angle at capture [rad].
    pub capture_rad: f64,
}

/// Reasons why nothing was imported, as `remora mission import --explain --json` prints them.
#[derive(Clone, Debug, Serialize)]
pub struct ImportFaults {
    /// [`FORMAT`].
    pub format: &'static str,
    /// The URDF's file.
    pub file: PathBuf,
    /// All that is wrong.
    pub faults: Vec<String>,
}

/// Reason why a request gives no mission.
#[derive(Clone, Debug)]
pub enum NoImport {
    /// The URDF gives no arm.
    Urdf(Refusal),
    /// The arm gives no mission, or an option beside it is wrong.
    Mission(Error),
}

impl From<Error> for NoImport {
    fn from(error: Error) -> Self {
        Self::Mission(error)
    }
}

impl Request {
    /// A file's request, with nothing said beside it.
    ///
    /// # Errors
    /// Where the file cannot be read.
    pub fn of(file: &Path) -> Result<Self, Error> {
        let refused = |cause: std::io::Error| Error::input(file, "", io_reason(&cause));
        // At most what a URDF may have, and a byte that says that there is more.
        let (mut urdf, limit) = (Vec::new(), MAX_BYTES as u64 + 1);
        let opened = open_regular(file)?;
        opened.take(limit).read_to_end(&mut urdf).map_err(refused)?;
        Ok(Self::new(file.into(), urdf))
    }

    /// The request of a URDF's text, with nothing said beside it.
    pub fn new(file: PathBuf, urdf: Vec<u8>) -> Self {
        let options = Options::default();
        let (bus, mount, boresight, axis) = (None, None, None, None);
        Self { file, urdf, options, bus, mount, boresight, axis, start: None, armature: None }
    }
}

impl NoImport {
    /// All that is wrong, each in a line.
    pub fn faults(&self) -> Vec<String> {
        match self {
            Self::Urdf(refusal) => {
                refusal.faults.iter().map(|fault| in_one_line(fault.to_string())).collect()
            }
            Self::Mission(error) => vec![error.to_string()],
        }
    }

    /// The faults in the format of `--json`.
    pub fn told(&self, request: &Request) -> ImportFaults {
        ImportFaults { format: FORMAT, file: request.file.clone(), faults: self.faults() }
    }

    /// The error of a command that needs the mission: all faults at once.
    pub fn error(self, request: &Request) -> Error {
        match self {
            Self::Mission(error) => error,
            Self::Urdf(_) => Error::input(&request.file, "", self.faults().join("; ")),
        }
    }
}

/// Makes the mission.
///
/// # Errors
/// All faults of the URDF at once; a bus that is none; an arm that finds no joint angles at capture, or
/// none at the start that are clear of its own bus.
pub fn import(request: &Request) -> Result<ImportedMission, NoImport> {
    let (mut first, mut failed) = (None, Vec::new());
    for settled in bus::settle(request)? {
        match imported(request, settled, &mut failed) {
            Ok(imported) => return Ok(imported),
            Err(error) if !is_of_the_mount(&error, request) => return Err(error.into()),
            Err(error) => first = first.or(Some(error)),
        }
    }
    // At least one mount was tried.
    let error = first.unwrap_or_else(|| Error::argument("--mount", "none is left"));
    Err(advised(error, request, &failed).into())
}

/// The error of a search that has failed at all mounts, with advice.
fn advised(error: Error, request: &Request, failed: &[(MissionFile, Arm)]) -> Error {
    match error {
        Error::Input { file, field, reason } if field == "servicer.capture" => {
            let advice = capture::advice(request, failed);
            Error::input(&file, field, format!("{reason}; {advice}"))
        }
        other => other,
    }
}

/// Whether another mount may mend it: no joint angles were found, at capture or at the start.
fn is_of_the_mount(error: &Error, request: &Request) -> bool {
    match error {
        Error::Input { field, .. } => field == "servicer.capture",
        Error::Argument { argument, .. } => *argument == "--start" && request.start.is_none(),
        _ => false,
    }
}

/// The mission; one that finds no joint angles at capture is kept in `failed`.
fn imported(
    request: &Request,
    settled: ArmOnBus,
    failed: &mut Vec<(MissionFile, Arm)>,
) -> Result<ImportedMission, Error> {
    let mut file = servicer::mission_file(&settled, &axis(request, &settled.arm)?);
    if let Some(armature) = &request.armature {
        servicer::give_rotors(&mut file, armature)?;
    }
    let ArmOnBus { arm, is_own, mut decided, .. } = settled;
    let motion = file.weights.joint_motion;
    decided.push(format!("joint rates cost something: weights.joint_motion is {motion}"));
    let mission = match completed(&mut file, request, &arm, is_own, &mut decided) {
        Ok(mission) => mission,
        Err(error) => {
            let is_of_capture = error.field == "servicer.capture";
            let error = refused(error, request, &arm);
            failed.extend(is_of_capture.then_some((file, arm)));
            return Err(error);
        }
    };
    let (joints, doubts) = (joints(&arm, &mission), doubts(&arm));
    Ok(ImportedMission {
        format: FORMAT,
        file: request.file.clone(),
        robot: arm.name,
        joints,
        notes: arm.notes.iter().map(ToString::to_string).collect(),
        doubts,
        decided,
        vehicle: Vehicle::of(&mission, Integrator::RK4),
        mission: file,
    })
}

/// Tables of all that is understood of the URDF, whether it gives an arm or not.
pub fn explanation(request: &Request) -> String {
    let settled = bus::settle(request).ok().and_then(|all| all.into_iter().next());
    let options = settled.map_or(request.options.clone(), |settled| settled.options);
    remora_urdf::explain(&name(&request.file), &request.urdf, &options)
}

/// The mission with what the URDF does not say: actuators of its bus, margins that its mounting leaves,
/// angles at the start, a distance for scenarios.
fn completed(
    file: &mut MissionFile,
    request: &Request,
    arm: &Arm,
    is_own: bool,
    decided: &mut Vec<String>,
) -> Result<Mission, FieldError> {
    let links: Vec<String> = arm.joints.iter().map(|joint| joint.link.clone()).collect();
    let unsearched = unsearched(file)?;
    if is_own {
        actuators::scale(file, &unsearched, decided);
    }
    mounting::fit(file, &unsearched, &links, decided);
    let mission = start::choose(file, request.start.as_deref(), decided)?;
    scenarios::keep_off(file, (&mission.approach, &mission.scenarios), decided);
    file.mission()
}

/// The mission before joint angles at capture are searched for: they are those of the start.
fn unsearched(file: &MissionFile) -> Result<Mission, FieldError> {
    let mut given = file.clone();
    given.servicer.capture = MissionCapture::Joints;
    given.servicer.end_effector_axis = None;
    given.servicer.capture_joint_angle_rad = Some(given.servicer.initial_joint_angle_rad.clone());
    given.mission()
}

fn joints(arm: &Arm, mission: &Mission) -> Vec<Joint> {
    let s = &mission.servicer;
    let angles = s.initial_joint_angle_rad.iter().zip(s.capture_joint_angle_rad.iter());
    let joint = |(joint, (start, capture)): (&remora_urdf::Joint, (&f64, &f64))| Joint {
        name: joint.name.clone(),
        start_rad: *start,
        capture_rad: *capture,
    };
    arm.joints.iter().zip(angles).map(joint).collect()
}

/// The end effector's axis in the last link's axes.
fn axis(request: &Request, arm: &Arm) -> Result<Vector3<f64>, Error> {
    let own = unit(request.axis, "--axis")?.unwrap_or_else(Vector3::z);
    Ok((arm.end_effector.rotation * own).normalize())
}

/// A direction that a flag gives, as a unit vector.
fn unit(given: Option<Vector3<f64>>, flag: &'static str) -> Result<Option<Vector3<f64>>, Error> {
    let Some(given) = given else { return Ok(None) };
    match given.try_normalize(1e-9) {
        Some(unit) if unit.iter().all(|x| x.is_finite()) => Ok(Some(unit)),
        _ => Err(Error::argument(flag, "must be a direction: three numbers, not all zero")),
    }
}

/// The error of a field that follows from the URDF, in words of the flags.
fn refused(error: FieldError, request: &Request, arm: &Arm) -> Error {
    let FieldError { field, reason } = error;
    if let Some(joint) = field.strip_prefix("servicer.initial_joint_angle_rad") {
        return Error::argument("--start", format!("{joint} {reason}").trim().to_string());
    }
    // A wrong unit fails in many ways, so probable mistakes are added.
    let reason = std::iter::once(reason).chain(doubts(arm)).collect::<Vec<_>>().join("; ");
    Error::input(&request.file, field, reason)
}

/// Notes on probable mistakes in the file.
fn doubts(arm: &Arm) -> Vec<String> {
    arm.notes.iter().filter(|note| note.is_doubt()).map(ToString::to_string).collect()
}

/// A file's name without its folders.
fn name(file: &Path) -> String {
    file.file_name()
        .map_or_else(|| file.display().to_string(), |name| name.to_string_lossy().into())
}
