//! From a plan's file to the files that are asked for.

use crate::ccsds::{self, Heading};
use crate::chief::Chief;
use crate::epoch::Epoch;
use crate::inertial::{self, Spacecraft};
use crate::motion::Motion;
use crate::recording;
use remora_core::advanced::dynamics::Integrator;
use remora_host::choice::choices;
use remora_host::error::Error;
use remora_host::formats::{
    PlanFile, Program, body_name, check_writable, make_directory, write_atomically,
};
use serde::Serialize;
use std::path::{Path, PathBuf};

choices! {
    /// A kind of file.
    #[derive(Hash, Serialize)]
    #[serde(rename_all = "lowercase")]
    pub enum Format {
        /// CCSDS orbit ephemerides of servicer and target, inertial axes.
        Oem = "oem",
        /// CCSDS attitude ephemerides of the servicer's bus and of the target.
        Aem = "aem",
        /// One recording in RTN axes for Foxglove and Rerun.
        Mcap = "mcap",
    }
}

impl Format {
    /// Whether it is in inertial axes.
    pub fn is_inertial(self) -> bool {
        self != Self::Mcap
    }
}

/// Files to be made of a plan: the input of `remora export`.
#[derive(Clone, Debug)]
pub struct Export {
    /// The plan's file.
    pub plan: PathBuf,
    /// Formats to make.
    pub formats: Vec<Format>,
    /// When the plan begins.
    pub epoch: Option<Epoch>,
    /// File of the chief's orbit.
    pub chief: Option<PathBuf>,
    /// From row to row between nodes [s].
    pub step: Option<f64>,
    /// The folder of the results.
    pub out: PathBuf,
}

/// A file that was made.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ExportFile {
    /// The file.
    pub file: PathBuf,
    /// Its kind.
    pub format: Format,
    /// Instants in it.
    pub rows: usize,
    /// Its size.
    pub bytes: usize,
}

/// All files, as `remora export --json` prints them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExportSummary {
    /// `remora-export/1`.
    pub format: &'static str,
    /// Id of the plan's scenario.
    pub scenario: String,
    /// Time that the plan spans [s].
    pub duration_s: f64,
    /// One a file.
    pub files: Vec<ExportFile>,
}

impl Export {
    /// The files that it makes of a plan of this scenario.
    fn names(&self, scenario: &str) -> Vec<(Format, Option<Spacecraft>, PathBuf)> {
        let named = |format: Format, of: Option<Spacecraft>| {
            let part = of.map_or(String::new(), |of| format!(".{}", of.name()));
            (format, of, self.out.join(format!("{scenario}{part}.{}", format.name())))
        };
        let each = |format: &Format| match format.is_inertial() {
            true => Spacecraft::BOTH.map(|of| named(*format, Some(of))).to_vec(),
            false => vec![named(*format, None)],
        };
        self.formats.iter().flat_map(each).collect()
    }

    /// Makes all files. `keep` may refuse to replace one that is there.
    ///
    /// # Errors
    /// A plan, chief or step that cannot be used; files that may not be replaced or cannot be written, which is
    /// found out before any is.
    pub fn run(&self, keep: impl Fn(&Path) -> Result<(), Error>) -> Result<ExportSummary, Error> {
        let plan = PlanFile::read(&self.plan)?;
        let motion = Motion::of(&self.plan, &plan, self.step)?;
        let chief = self.chief.as_ref().map(|file| chief(file, &motion)).transpose()?;
        let fill = |(format, of, file)| {
            self.contents(&plan, &motion, chief.as_ref(), (format, of))
                .map(|bytes| (format, file, bytes))
        };
        let filled = self.names(&plan.scenario).into_iter().map(fill);
        let filled = filled.collect::<Result<Vec<_>, Error>>()?;
        make_directory(&self.out)?;
        filled.iter().try_for_each(|(_, file, _)| {
            keep(file)?;
            check_writable(file)
        })?;
        let rows = motion.moments.len();
        let mut files = Vec::new();
        for (format, file, bytes) in filled {
            write_atomically(&file, &bytes)?;
            files.push(ExportFile { file, format, rows, bytes: bytes.len() });
        }
        let duration_s = motion.duration();
        Ok(ExportSummary { format: "remora-export/1", scenario: plan.scenario, duration_s, files })
    }

    /// Makes the contents of one file.
    fn contents(
        &self,
        plan: &PlanFile,
        motion: &Motion,
        chief: Option<&Chief>,
        (format, of): (Format, Option<Spacecraft>),
    ) -> Result<Vec<u8>, Error> {
        let Some(of) = of else {
            let recorded = recording::recorded(motion, &plan.residuals, self.epoch);
            return recorded.map_err(|error| Error::Output {
                file: self.out.clone(),
                reason: error.to_string(),
            });
        };
        let Some(chief) = chief else {
            let reason = "is needed for inertial axes: a plan is in axes that turn with the target's orbit, \
                          and does not say where on its orbit the target is";
            return Err(Error::argument("--chief", reason));
        };
        let Some(epoch) = self.epoch else {
            let reason = "is needed for inertial axes: a plan does not say when it begins";
            return Err(Error::argument("--epoch", reason));
        };
        let Some(center) = body_name(&motion.orbit.body) else {
            let reason = "is missing: the gravity is not the Earth's, and the file must name the body; \
                          give orbit.body and orbit.body_radius_m in the mission and plan again";
            return Err(Error::input(&self.plan, "inputs.mission.orbit.body", reason));
        };
        let comments = comments(plan, of);
        let heading = Heading {
            of,
            chief,
            center: &center,
            epoch,
            created: Epoch::now(),
            comments: &comments,
        };
        let rows = inertial::rows(motion, chief, of);
        Ok(match format {
            Format::Aem => ccsds::aem(&heading, &rows),
            _ => ccsds::oem(&heading, &rows),
        }
        .into_bytes())
    }
}

/// The chief of a file, which the plan must fit.
fn chief(file: &Path, motion: &Motion) -> Result<Chief, Error> {
    let chief = Chief::read(file, &motion.orbit)?;
    chief.check(motion).map_err(|error| error.at(file)).map(|()| chief)
}

/// Where the numbers of a file come from.
fn comments(plan: &PlanFile, of: Spacecraft) -> Vec<String> {
    let Program { version, commit } = plan.program.clone().unwrap_or_else(Program::this);
    let body = match of {
        Spacecraft::Target => {
            "the target, on a two-body orbit; its attitude as the plan expects it"
        }
        Spacecraft::Servicer => "the servicer: centre of mass of bus and arm; attitude of the bus",
    };
    let between = match plan.integrator {
        Integrator::Euler => "Rows at the nodes alone: Euler's step says nothing between them",
        Integrator::Rk4 { .. } => {
            "Rows at the nodes, and between them along the plan's own dynamics"
        }
    };
    vec![
        format!("Remora {version}, commit {commit}: plan of scenario {}", plan.scenario),
        format!("Of {body}"),
        "R, T, N: outward, normal x outward, orbit normal of the target's orbit at each row".into(),
        between.into(),
    ]
}
