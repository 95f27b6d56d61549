//! Learning for the arm of a mission: from nothing to a model that the planner uses for it, and for no other.

use remora_core::advanced::planner::GuessRecord;
use remora_core::advanced::stages::NODES;
use remora_host::draw::draw_one;
use remora_host::error::Error;
use remora_host::formats::{Mission, ModelFile, read_mission};
use remora_host::learned::Learned;
use remora_host::memory::on_large_stack;
use remora_host::method::{Integrator, Method, WarmStart};
use remora_host::planning::Planner;
use remora_host::request::PlanRequest;
use remora_training::checkpoint::LossRow;
use remora_training::learning::{Hands, Learning, Learnt};
use remora_training::network::Losses;
use remora_training::{Cpu, Observer};
use std::num::NonZeroUsize;
use std::path::Path;

struct Silent;

impl Observer for Silent {
    fn begin(&mut self, _: u64, _: u64, _: usize) {}
    fn step(&mut self, _: u64, _: Losses, _: f64) {}
    fn validated(&mut self, _: &LossRow) {}
}

/// The mission of an arm of so many joints.
fn arm(name: &str, joints: usize) -> Mission {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../fixtures/arms");
    let mission = read_mission(Some(&fixtures.join(format!("{name}.mission.toml")))).unwrap();
    assert_eq!(mission.joints(), joints);
    mission
}

/// Hours so few that only the least is done.
fn learning(mission: Mission, out: &Path) -> Learning {
    Learning {
        mission,
        hours: 1e-6,
        integrator: Integrator::Euler,
        seed: 7001,
        anew: false,
        jobs: NonZeroUsize::new(2).unwrap(),
        work: out.with_extension("work"),
        out: out.into(),
    }
}

fn learn(learning: &Learning) -> Result<Learnt, Error> {
    learning.run(&mut Hands {
        tell: &|_| (),
        dataset: &mut (),
        train: &mut |run| run.train::<Cpu>(Default::default(), &mut Silent),
        test: &mut (),
    })
}

/// What a plan of a mission starts from where a model is offered to it.
fn start(mission: &Mission, model: Learned) -> GuessRecord {
    let scenario = draw_one(1, 0, mission).unwrap();
    let integrator = Integrator::Euler;
    let method = Method { integrator, warm_start: WarmStart::Model, ..Method::default() };
    let (mission, guess) = (*mission, model.into());
    let request = PlanRequest { mission, method, guess, ..Default::default() };
    let plan = || Planner::new().plan(&request, &scenario);
    on_large_stack(plan).unwrap().evidence.start
}

#[test]
fn a_model_of_two_joints_serves_two_joints() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("two.model");
    let mission = arm("two", 2);
    let learnt = learn(&learning(mission, &out)).unwrap();
    assert!(learnt.trajectories > 100, "{}", learnt.trajectories);
    assert!(learnt.test.before.is_none(), "the built-in model is for three joints");

    let file = ModelFile::read(&out).unwrap();
    let header = file.header();
    assert_eq!((header.version, header.action, usize::from(header.nodes)), (2, 5, NODES));
    assert!(file.bytes() == std::fs::read(&out).unwrap());
    let model = Learned::usable(&out).unwrap();
    let own = start(&mission, model.clone());
    assert!(
        !matches!(own, GuessRecord::Unfit | GuessRecord::Refused | GuessRecord::NotFinite),
        "{own:?}"
    );

    // Neither for fewer joints nor for more, whatever build they are planned in.
    assert_eq!(start(&Mission::default(), model.clone()), GuessRecord::Unfit);
    let one = arm("one", 1);
    assert_eq!(start(&one, model.clone()), GuessRecord::Unfit);
    assert_eq!(start(&arm("seven", 7), model), GuessRecord::Unfit);
    assert_eq!(start(&mission, Learned::built_in(Integrator::Euler)), GuessRecord::Unfit);

    // It goes on where it is, and with no other arm.
    let reason = learn(&learning(one, &out)).unwrap_err().to_string();
    assert!(reason.contains("mission: "), "{reason}");
    assert_eq!(learn(&learning(mission, &out)).unwrap().checksum, learnt.checksum);
}

#[test]
fn a_roll_that_is_given_is_not_learnt() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("a.model");
    let mut mission = Mission::default();
    let axis = nalgebra::Vector3::x();
    mission.roll = Some(remora_core::advanced::model::Roll { end_effector: axis, port: axis });
    let reason = learn(&learning(mission, &out)).unwrap_err().to_string();
    assert!(reason.contains("roll"), "{reason}");
    assert!(!out.exists() && !out.with_extension("work").exists());
}
