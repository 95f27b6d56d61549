//! Vehicles: missions that a map is made for.

use super::cell::{CellPlace, State};
use crate::error::{Error, FieldError};
use crate::formats::{Mission, MissionFile, check_arm, read_mission_file};
use remora_core::advanced::model::forms::degrees::radians;
use remora_core::advanced::stages::LINKS;
use std::path::{Path, PathBuf};

/// A vehicle with its mission.
#[derive(Clone, Debug, PartialEq)]
pub struct Vehicle {
    /// Its name: that of its file, without `.mission.toml`.
    pub name: String,
    /// The file; none is built in.
    pub file: Option<PathBuf>,
    mission: MissionFile,
}

/// The vehicles that a map is made for where none is named.
const BUILT_IN: [(&str, &str); 3] = [
    ("default", ""),
    ("strong", include_str!("../../../../fixtures/missions/strong.mission.toml")),
    ("small", include_str!("../../../../fixtures/missions/small.mission.toml")),
];

impl Vehicle {
    /// The vehicles of a map where none is named: the default one, a strong and a small one.
    ///
    /// # Errors
    /// None, as long as the built-in missions are sound.
    pub fn built_in() -> Result<Vec<Self>, Error> {
        let parse = |(name, text): (&str, &str)| {
            let mission = MissionFile::parse(text)?;
            Ok(Self { name: name.into(), file: None, mission })
        };
        let vehicles = BUILT_IN.into_iter().map(parse).collect::<Result<_, FieldError>>();
        vehicles.map_err(|error| error.at(Path::new("built-in mission")))
    }

    /// The vehicles of some mission files.
    ///
    /// # Errors
    /// A file that is no mission; two of one name, which files of results could not tell apart.
    pub fn read(files: &[PathBuf]) -> Result<Vec<Self>, Error> {
        let mut vehicles: Vec<Self> = Vec::new();
        for file in files {
            let mission = read_mission_file(Some(file))?;
            let judged = mission.mission().and_then(|m| check_arm(m.joints(), LINKS));
            judged.map_err(|error| error.at(file))?;
            let name = name_of(file);
            if vehicles.iter().any(|other| other.name == name) {
                let reason = format!("there is another vehicle called {name:?}: rename the file");
                return Err(Error::input(file, "", reason));
            }
            vehicles.push(Self { name, file: Some(file.clone()), mission });
        }
        Ok(vehicles)
    }

    /// Its mission, as in its file.
    pub fn mission(&self) -> &MissionFile {
        &self.mission
    }

    /// Keep-out distances, far and near [m]; not numbers where the file says none that are any.
    pub(super) fn keep_out(&self) -> [f64; 2] {
        let radii = |m: Mission| [m.approach.keep_out_far_m, m.approach.keep_out_near_m];
        self.mission.mission().map_or([f64::NAN; 2], radii)
    }

    /// Its mission at a place of the map, or why nothing can be planned there.
    pub(super) fn at(&self, place: &CellPlace) -> Result<Box<Mission>, State> {
        let mut file = self.mission.clone();
        file.horizon.duration_s = place.horizon_s;
        file.scenarios.standoff_m = place.distance_m;
        file.scenarios.rate_norm_rad_s = Some(radians(place.rate_deg_s));
        let refused = |e: FieldError| State::Refused { why: format!("{}: {}", e.field, e.reason) };
        let mission = file.mission().map_err(refused)?;
        match too_slow(&mission) {
            Some(why) => Err(State::Impossible { why }),
            None => Ok(Box::new(mission)),
        }
    }
}

/// Reason why the arm cannot be in its capture configuration in time, where it cannot.
fn too_slow(mission: &Mission) -> Option<String> {
    let (s, grid) = (&mission.servicer, mission.own_grid());
    let time = grid.time(grid.preset_node());
    let needed = (s.capture_joint_angle_rad - s.initial_joint_angle_rad).abs() / time;
    let joint = needed.component_div(&s.joint_rate_limit_rad_s).imax();
    let (needed, limit) = (needed[joint], s.joint_rate_limit_rad_s[joint]);
    (needed > limit).then(|| {
        let joint = joint + 1;
        format!(
            "joint {joint} would have to turn with {needed:.2e} rad/s, its limit is {limit:.0e}"
        )
    })
}

/// A name that can be part of a file's.
fn name_of(file: &Path) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let name = name.strip_suffix(".toml").unwrap_or(&name);
    let name = name.strip_suffix(".mission").unwrap_or(name);
    let safe = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' };
    let name: String = name.trim_start_matches('.').chars().map(safe).collect();
    if name.is_empty() { "mission".into() } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(horizon_s: f64) -> CellPlace {
        CellPlace { vehicle: "default".into(), horizon_s, rate_deg_s: 1.0, distance_m: 30.0 }
    }

    #[test]
    fn a_place_replaces_three_numbers() {
        let vehicles = Vehicle::built_in().unwrap();
        let names: Vec<&str> = vehicles.iter().map(|vehicle| vehicle.name.as_str()).collect();
        assert_eq!(names, ["default", "strong", "small"]);
        let mut expected = Mission::default();
        expected.approach.duration_s = 600.0;
        // Phases that the vehicle leaves open shrink with its horizon.
        expected.approach.keep_out_near_s /= 2.0;
        expected.approach.preset_s /= 2.0;
        expected.approach.recovery_s /= 2.0;
        expected.scenarios.standoff_m = 30.0;
        expected.scenarios.rate_norm_rad_s = Some(1.0 * std::f64::consts::PI / 180.0);
        assert_eq!(*vehicles[0].at(&place(600.0)).unwrap(), expected);
    }

    #[test]
    fn what_cannot_be_is_told_from_what_is_no_mission() {
        let default = &Vehicle::built_in().unwrap()[0];
        // Joint 2 turns by 0.877 rad: in 55 of 59 intervals of 120 s that is 7.8e-3 rad/s.
        let why = "joint 2 would have to turn with 7.84e-3 rad/s, its limit is 5e-3";
        let state = default.at(&place(120.0)).unwrap_err();
        assert_eq!(state, State::Impossible { why: why.into() });
        let state = default.at(&place(1e5)).unwrap_err();
        assert!(matches!(state, State::Refused { why } if why.starts_with("horizon.duration_s: ")));
    }

    #[test]
    fn names_are_those_of_files() {
        let name = |file: &str| name_of(Path::new(file));
        assert_eq!(name("a/strong.mission.toml"), "strong");
        assert_eq!(name("tumble-0.06.mission.toml"), "tumble-0.06");
        assert_eq!(name("my vehicle.toml"), "my-vehicle");
        assert_eq!(name(".mission.toml"), "mission");
    }

    #[test]
    fn two_files_of_one_name_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let files = ["a.toml", "a.mission.toml"].map(|name| dir.path().join(name));
        files.iter().for_each(|file| std::fs::write(file, "").unwrap());
        assert_eq!(Vehicle::read(&files[..1]).unwrap()[0].name, "a");
        let error = Vehicle::read(&files).unwrap_err().to_string();
        assert!(error.ends_with("there is another vehicle called \"a\": rename the file"));
    }
}
