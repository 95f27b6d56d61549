//! The journal: a header line that says what the campaign is, then one line a finished row.

use super::Campaign;
use crate::fingerprint::{self, fingerprint};
use crate::formats::Row;
use crate::journal::{Fact, Heading, first_difference};
use crate::method::{Integrator, Mode, Qp, WarmStart};
use crate::request::PlanRequest;
use crate::settings::settings_text;
use serde::{Deserialize, Serialize};

/// Name of the journal in the campaign's directory.
pub const JOURNAL: &str = "journal.jsonl";

const FORMAT: &str = "remora-journal/3";

/// A campaign's journal.
pub(super) type Journal = crate::journal::Journal<Row>;

/// The journal's first line: all that the rows depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CampaignHeader {
    /// Format of the journal.
    pub format: String,
    /// Version of the program.
    pub version: String,
    /// Fingerprint of the program.
    pub program: String,
    /// Optimality or feasibility.
    pub mode: Mode,
    /// Initial guess of Stage 2.
    pub warm_start: WarmStart,
    /// Solver of the subproblems.
    pub qp: Qp,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Whether plan files are written.
    pub plans: bool,
    /// Fingerprint of the planner's settings.
    pub settings: String,
    /// Fingerprint of the mission.
    pub mission: String,
    /// Fingerprint of the scenarios.
    pub scenarios: String,
}

impl CampaignHeader {
    /// The header of a campaign.
    pub fn new(campaign: &Campaign) -> Self {
        let scenarios = fingerprint(&campaign.scenarios);
        Self { plans: campaign.save_plans, ..Self::of(&campaign.request, scenarios) }
    }

    /// The header of plans of these scenarios, of which no plan files are written.
    pub fn of(request: &PlanRequest, scenarios: String) -> Self {
        let PlanRequest { mission, method, guess, .. } = request;
        Self {
            format: FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            program: fingerprint::program(),
            mode: method.mode,
            warm_start: method.warm_start,
            qp: method.qp,
            integrator: method.integrator,
            plans: false,
            settings: fingerprint(&(settings_text(method), guess.model())),
            mission: fingerprint(mission),
            scenarios,
        }
    }
}

impl Heading for CampaignHeader {
    const FORMAT: &'static str = FORMAT;
    const WORK: &'static str = "campaign";

    fn format(&self) -> &str {
        &self.format
    }

    fn difference(&self, begun: &Self) -> Option<(&'static str, String)> {
        let yes = |plans: bool| if plans { "--write plans" } else { "no --write plans" };
        let facts = |of: &Self| -> [Fact; 10] {
            let settings = "another --model, another --deadline or other planner settings";
            [
                ("version", of.version.clone(), ""),
                ("program", of.program.clone(), "another build of this program"),
                ("mode", of.mode.name().into(), ""),
                ("warm_start", of.warm_start.name().into(), ""),
                ("qp", of.qp.name().into(), ""),
                ("integrator", of.integrator.to_string(), ""),
                ("plans", yes(of.plans).into(), ""),
                ("settings", of.settings.clone(), settings),
                ("mission", of.mission.clone(), "another mission"),
                ("scenarios", of.scenarios.clone(), "other scenarios"),
            ]
        };
        first_difference(facts(self), facts(begun)).map(|(field, what)| {
            let reason = format!("this campaign was begun with {what}; choose another --out");
            (field, format!("{reason} to start anew"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::formats::{
        Clearances, Closest, Flight, Nearest, ScenarioSet, StageRow, Status, Verdict,
    };
    use remora_core::advanced::model::{Refusal, Tolerances};
    use std::num::NonZeroUsize;
    use std::path::{Path, PathBuf};

    fn header() -> CampaignHeader {
        CampaignHeader::new(&Campaign {
            scenarios: Vec::new(),
            seed: None,
            request: PlanRequest::default(),
            jobs: NonZeroUsize::MIN,
            save_plans: false,
            csv: false,
            out: PathBuf::new(),
        })
    }

    fn open(path: &Path) -> Result<(Journal, Vec<Row>), Error> {
        Journal::open(path, &header(), &|row: &Row| row.check(&Tolerances::default()))
    }

    fn row(scenario: &str) -> Row {
        let stage = StageRow { iterations: 1, corrections: 0, cost: 0.1, time_s: 0.2 };
        Row {
            scenario: scenario.into(),
            status: Status::Solved,
            verdict: Verdict::Optimal,
            reason: String::new(),
            warm_start: "heuristic".into(),
            stage1: stage,
            stage2: stage,
            inference_s: 0.0,
            residuals: [0.0; 12],
            clearances: Clearances::NONE,
            nearest: Nearest::NONE,
            end_effector: Closest::NONE,
            flight: Flight::default(),
            time_s: 0.3,
            cpu_time_s: 0.3,
            plan_checksum: "0123456789abcdef".into(),
        }
    }

    #[test]
    fn rows_are_kept_and_a_torn_one_is_cut_off() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(JOURNAL);
        let (mut journal, rows) = open(&path).unwrap();
        assert_eq!(rows, []);
        journal.append(&row("a")).unwrap();
        journal.append(&row("b")).unwrap();
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        for torn in ["{\"scenario\":\"c", "{\"scenario\":\"c\n", "\0\0\0\n", "\n"] {
            std::fs::write(&path, [&whole, torn.as_bytes()].concat()).unwrap();
            let (mut journal, rows) = open(&path).unwrap();
            assert_eq!(rows, [row("a"), row("b")], "{torn:?}");
            assert_eq!(std::fs::read(&path).unwrap(), whole, "{torn:?}");
            journal.append(&row("c")).unwrap();
            drop(journal);
            let (_, rows) = open(&path).unwrap();
            assert_eq!(rows.len(), 3, "{torn:?}");
        }
        // Anything else that is not a row is not the work of a kill.
        let broken = String::from_utf8(whole).unwrap().replacen("\"a\"", "7", 1);
        std::fs::write(&path, broken).unwrap();
        let error = open(&path).err().unwrap().to_string();
        assert!(error.contains("line 2: scenario: invalid type"), "{error}");
    }

    #[test]
    fn a_torn_header_is_no_header() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(JOURNAL);
        std::fs::write(&path, "{\"format\":").unwrap();
        let (journal, rows) = open(&path).unwrap();
        drop(journal);
        assert_eq!(rows, []);
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 1);
        open(&path).unwrap();
    }

    /// Reason why a journal with a forged row is refused; empty where it is taken.
    fn refused(change: &dyn Fn(&mut Row)) -> String {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(JOURNAL);
        let mut forged = row("a");
        change(&mut forged);
        let (mut journal, _) = open(&path).unwrap();
        journal.append(&row("b")).unwrap();
        journal.append(&forged).unwrap();
        journal.append(&row("c")).unwrap();
        drop(journal);
        open(&path).err().map(|error| error.to_string()).unwrap_or_default()
    }

    /// A row that says of itself what no plan can be is not taken for one.
    #[test]
    fn forged_rows_are_refused() {
        assert_eq!(refused(&|_| ()), "");
        for (change, reason) in [
            (
                &(|row: &mut Row| row.residuals[1] = 1e9) as &dyn Fn(&mut Row),
                "residuals.keep_out: ",
            ),
            (&|row| row.residuals[0] = f64::NAN, "residuals.dynamics1: "),
            (&|row| row.residuals[11] = -1.0, "residuals.clearance: "),
            (&|row| row.verdict = Verdict::Verified, "verdict: "),
            (&|row| row.status = Status::IterationLimit, "verdict: "),
            (&|row| row.stage2.cost = f64::NAN, "stage2.cost: "),
            (&|row| row.flight.delta_v_m_s = f64::NAN, "flight.delta_v_m_s: "),
            (&|row| row.status = Status::Infeasible, "verdict: "),
            (&|row| row.stage2.cost = -1.0, "stage2.cost: "),
            (&|row| row.stage2.cost = 1e308, "stage2.cost: "),
            (&|row| row.reason = "keep_out".into(), "reason: "),
            (&|row| row.warm_start = "warm".into(), "warm_start: "),
            (&|row| row.warm_start = "none".into(), "warm_start: "),
            (&|row| row.plan_checksum = "zz".into(), "plan_checksum: "),
            (&|row| row.plan_checksum = String::new(), "plan_checksum: "),
            (&|row| row.plan_checksum = "0123456789ABCDEF".into(), "plan_checksum: "),
            (&|row| row.stage1.iterations = 1 << 40, "stage1.iterations: "),
            (&|row| row.stage2.corrections = 1 << 40, "stage2.corrections: "),
            (&|row| row.time_s = f64::NAN, "time_s: "),
            (&|row| row.cpu_time_s = -1.0, "cpu_time_s: "),
            (&|row| row.inference_s = -1.0, "inference_s: "),
        ] {
            let found = refused(change);
            assert!(found.contains(&format!("journal.jsonl: line 3: {reason}")), "{found}");
        }
    }

    /// Rows of plans that could not be flown may have any number, but for their times.
    #[test]
    fn rows_without_a_flyable_plan_are_taken() {
        let failed = |row: &mut Row| {
            (row.status, row.verdict) = (Status::IterationLimit, Verdict::NotFlyable);
            row.residuals[3] = f64::INFINITY;
        };
        assert_eq!(refused(&failed), "");
        let late = |row: &mut Row| {
            failed(row);
            row.stage1.time_s = f64::NAN;
        };
        assert!(refused(&late).contains("line 3: stage1.time_s: "));
        // Where the system does not tell a time, there is none.
        assert_eq!(refused(&|row| row.cpu_time_s = f64::NAN), "");
        let scenario = ScenarioSet::built_in().unwrap().scenarios[0].clone();
        let gone = Row::refused(&scenario, &Refusal::KeepOut { distance: 1.0, limit: 2.0 });
        assert_eq!(refused(&|row| *row = gone.clone()), "");
        let planned = |row: &mut Row| {
            *row = gone.clone();
            row.stage1.iterations = 1;
        };
        assert!(refused(&planned).contains("line 3: stage1.iterations: "));
    }

    #[test]
    fn a_line_without_end_is_not_read_to_its_end() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(JOURNAL);
        std::fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
        let error = open(&path).err().unwrap().to_string();
        assert!(error.ends_with("line 1: has more than 1048576 bytes"), "{error}");
    }

    #[test]
    fn two_campaigns_do_not_share_a_directory() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(JOURNAL);
        let (_journal, _) = open(&path).unwrap();
        let error = open(&path).err().unwrap().to_string();
        assert!(error.ends_with("another campaign is running in this directory"), "{error}");
    }
}
