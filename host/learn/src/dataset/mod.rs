//! Datasets: the trajectories that a warm start is learned from.
//!
//! Scenarios `0..count` of a seed, planned in optimal mode from the heuristic start with the
//! embedded solver; those that are solved, and therefore verified, are kept. What comes out is a
//! function of the manifest alone, whatever the number of threads and of interruptions.
//!
//! ```text
//! DIR/dataset.json      what was asked for
//! DIR/mission.toml      the mission, where it is not the built-in one
//! DIR/shard-00000.bin   scenarios 0..500
//! DIR/shard-00001.bin   scenarios 500..1000, and so on
//! ```
//!
//! The bytes of a shard are described in `docs/reference/model-file.md`.

mod gather;
mod make;
mod manifest;
mod recompute;
mod shard;
mod split;
mod trajectory;

pub use gather::{Gathered, gather};
pub use make::{Made, Recipe};
pub use manifest::{FORMAT, MANIFEST, Manifest, SHARD};
pub use recompute::recompute;
pub use split::Split;
pub use trajectory::{JointRows, Trajectory};

use remora_host::error::Error;
use remora_host::fingerprint::fingerprint;
use remora_host::formats::{Mission, read_mission};
use remora_host::lineage::Source;
use std::path::{Path, PathBuf};

/// Name of a mission's file in the directory of its dataset.
pub const MISSION: &str = "mission.toml";

/// A dataset to read. One that is still being made can be read up to where it is complete.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// Manifest that it was begun with.
    pub manifest: Manifest,
    directory: PathBuf,
    /// The scenarios that have been tried without a gap, and how many were kept of them.
    tried: u64,
    kept: u64,
}

impl Dataset {
    /// Reads the manifest, for an arm of so many joints, and looks at the shards that are there.
    ///
    /// # Errors
    /// A file that cannot be read or understood; another number of joints; a shard whose size is wrong.
    pub fn open(directory: &Path, joints: usize) -> Result<Self, Error> {
        let file = directory.join(MANIFEST);
        let manifest = Manifest::read(&file)?.of_joints(joints).map_err(|error| error.at(&file))?;
        let (mut all, mut kept) = (0, 0);
        let dataset = manifest.dataset();
        for (number, shard) in (0..).zip(manifest.shards()) {
            let place = manifest.place(&dataset, shard);
            let found = shard::look(&shard_path(directory, number), place)?;
            let Some(found) = found else { break };
            all += u64::from(place.tried);
            kept += u64::from(found);
        }
        Ok(Self { manifest, directory: directory.to_path_buf(), tried: all, kept })
    }

    /// The mission that it was made for: that beside the shards, `otherwise` where there is none.
    ///
    /// # Errors
    /// A file that cannot be read; a mission of other numbers than the dataset's.
    pub fn mission(&self, otherwise: &Mission) -> Result<Mission, Error> {
        let mission = self.beside()?.unwrap_or(*otherwise);
        self.check_for(mission, "was made for another mission; --mission names it")
    }

    /// Finds its mission likewise, the built-in one where there is none beside the shards.
    ///
    /// # Errors
    /// Errors of [`Dataset::mission`].
    pub fn own_mission(&self) -> Result<Mission, Error> {
        let mission = self.beside()?.map_or_else(|| read_mission(None), Ok)?;
        self.check_for(mission, "is neither in the directory nor the one that is built in")
    }

    fn beside(&self) -> Result<Option<Mission>, Error> {
        let own = self.directory.join(MISSION);
        own.exists().then(|| read_mission(Some(&own))).transpose()
    }

    fn check_for(&self, mission: Mission, reason: &str) -> Result<Mission, Error> {
        let Manifest { links, mission: made_for, .. } = &self.manifest;
        match *links == mission.joints() && *made_for == fingerprint(&mission) {
            true => Ok(mission),
            false => Err(Error::input(&self.directory.join(MANIFEST), "mission", reason)),
        }
    }

    /// Number of trajectories, up to the first shard that is missing.
    pub fn len(&self) -> usize {
        self.kept as usize
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.kept == 0
    }

    /// Number of scenarios that have been tried, up to the first shard that is missing.
    pub fn tried(&self) -> u64 {
        self.tried
    }

    /// The trajectories of the first `limit` scenarios, of all where there is none, in the order
    /// of the scenarios. 750 MB for 90,000.
    ///
    /// # Errors
    /// A shard that is damaged, or that has not been made yet.
    pub fn read(&self, limit: Option<usize>) -> Result<Vec<Trajectory>, Error> {
        let end = limit.map_or(self.manifest.count, |limit| limit as u64);
        let capacity = end.min(self.kept) as usize;
        let mut out = Vec::with_capacity(capacity);
        let dataset = self.manifest.dataset();
        for (number, shard) in (0..).zip(self.manifest.shards()) {
            let place = self.manifest.place(&dataset, shard);
            if place.first >= end {
                break;
            }
            shard::read(&shard_path(&self.directory, number), place, end, &mut out)?;
        }
        Ok(out)
    }

    /// Source of the trajectories that [`Dataset::read`] reads, for the provenance of a model.
    pub fn source(&self, limit: Option<usize>) -> Source {
        let Manifest { seed, count, .. } = self.manifest;
        Source { seed, count: limit.map_or(count, |limit| count.min(limit as u64)) }
    }

    /// The part that a trajectory of this dataset belongs to.
    pub fn split(&self, trajectory: &Trajectory) -> Split {
        Split::of(self.manifest.seed, trajectory.scenario)
    }
}

fn shard_path(directory: &Path, number: u64) -> PathBuf {
    directory.join(format!("shard-{number:05}.bin"))
}

#[cfg(test)]
mod tests {
    use super::trajectory::tests::counting;
    use super::*;
    use remora_host::draw::draw_one;
    use remora_host::formats::PlanFile;
    use remora_host::memory::on_large_stack;
    use remora_host::method::{Integrator, Method};
    use remora_host::planning::Planner;
    use remora_host::request::PlanRequest;
    use std::num::{NonZeroU32, NonZeroUsize};

    fn request() -> PlanRequest {
        let method = Method { integrator: Integrator::Euler, ..Method::default() };
        PlanRequest { method, ..PlanRequest::default() }
    }

    fn recipe(out: &Path) -> Recipe {
        Recipe {
            count: 4,
            seed: 3,
            request: request(),
            mission_file: None,
            shard: SHARD,
            jobs: NonZeroUsize::new(2).unwrap(),
            part: None,
            out: out.into(),
        }
    }

    /// The plan of the first scenario of [`recipe`].
    pub(super) fn plan() -> PlanFile {
        let scenario = draw_one(3, 0, &Mission::default()).unwrap();
        on_large_stack(|| Planner::new().plan(&request(), &scenario).file).unwrap()
    }

    #[test]
    fn what_is_made_is_what_the_planner_plans() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("set");
        assert_eq!(recipe(&out).make(&mut ()), Ok(Made { tried: 4, kept: 4, now: 4 }));
        assert_eq!(recipe(&out).make(&mut ()), Ok(Made { tried: 4, kept: 4, now: 0 }));
        let dataset = Dataset::open(&out, 3).unwrap();
        assert_eq!((dataset.len(), dataset.tried(), dataset.is_empty()), (4, 4, false));
        let all = dataset.read(None).unwrap();
        assert_eq!(all.iter().map(|t| t.scenario).collect::<Vec<_>>(), [0, 1, 2, 3]);
        assert_eq!(all[0], Trajectory::new(0, &plan()));
        assert_eq!(dataset.read(Some(2)).unwrap(), all[..2]);
        assert_eq!(dataset.read(Some(100)).unwrap().len(), 4);
        assert_eq!(dataset.source(Some(2)).to_string(), "s3:2");
        assert_eq!(dataset.source(None), dataset.source(Some(9)));
        assert_eq!(dataset.split(&all[1]), Split::of(3, 1));
    }

    /// Sharper plans of the same scenarios make another dataset, and cost less where they differ.
    #[test]
    fn plans_to_learn_from_may_be_sharper() {
        let dir = tempfile::tempdir().unwrap();
        let made = |name: &str, sharp: bool| {
            let out = dir.path().join(name);
            let mut recipe = recipe(&out);
            recipe.request.method.sharp = sharp;
            recipe.make(&mut ()).unwrap();
            Dataset::open(&out, 3).unwrap()
        };
        let (plain, sharp) = (made("plain", false), made("sharp", true));
        assert_ne!(plain.manifest.settings, sharp.manifest.settings);
        let (plain, sharp) = (plain.read(None).unwrap(), sharp.read(None).unwrap());
        for (plain, sharp) in plain.iter().zip(&sharp) {
            assert!(sharp.iterations >= plain.iterations && sharp.cost <= plain.cost);
        }
        let spent = |all: &[Trajectory]| all.iter().map(|t| t.iterations).sum::<u32>();
        assert!(spent(&sharp) > spent(&plain));
    }

    #[test]
    fn a_dataset_grows_by_shards() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("set");
        let shard = NonZeroU32::new(2).unwrap();
        let of = |count| Recipe { count, shard, ..recipe(&out) };
        of(2).make(&mut ()).unwrap();
        Manifest::grow(&out, 3).unwrap();
        assert_eq!(of(3).make(&mut ()), Ok(Made { tried: 3, kept: 3, now: 1 }));
        let whole = dir.path().join("whole");
        Recipe { out: whole.clone(), ..of(3) }.make(&mut ()).unwrap();
        let all = |directory: &Path| Dataset::open(directory, 3).unwrap().read(None).unwrap();
        assert_eq!(all(&out), all(&whole));
        for (count, reason) in [(4, "is 3, which cannot grow to 4"), (2, "is 3, which cannot")] {
            let error = Manifest::grow(&out, count).unwrap_err().to_string();
            assert!(error.contains(reason), "{error}");
        }
    }

    #[test]
    fn a_dataset_without_its_shards_is_read_up_to_the_gap() {
        let dir = tempfile::tempdir().unwrap();
        let manifest = Manifest::new(&Recipe { count: 1100, ..recipe(dir.path()) });
        manifest.write(&dir.path().join(MANIFEST)).unwrap();
        let shards: Vec<_> = manifest.shards().collect();
        let dataset = manifest.dataset();
        assert_eq!(shards, [(0, 500), (500, 500), (1000, 100)]);
        let write = |number, trajectories: &[Trajectory]| {
            let path = shard_path(dir.path(), number as u64);
            let place = manifest.place(&dataset, shards[number]);
            shard::write(&path, place, trajectories).unwrap();
        };
        write(0, &[counting(4, 3), counting(400, 3)]);
        write(2, &[counting(1001, 3)]);
        let dataset = Dataset::open(dir.path(), 3).unwrap();
        assert_eq!((dataset.len(), dataset.tried()), (2, 500));
        assert_eq!(dataset.read(Some(500)).unwrap().len(), 2);
        let missing = dataset.read(None).unwrap_err().to_string();
        assert!(missing.ends_with("shard-00001.bin: no such file or directory"), "{missing}");
        write(1, &[]);
        assert_eq!(Dataset::open(dir.path(), 3).unwrap().read(None).unwrap().len(), 3);
    }

    /// Arms of other numbers of joints have their own size of records, and are not taken for each other.
    #[test]
    fn a_dataset_is_of_an_arm() {
        let dir = tempfile::tempdir().unwrap();
        let mission = Mission::from(Mission::default().sized::<2>());
        let request = PlanRequest { mission, ..request() };
        let manifest = Manifest::new(&Recipe { request, ..recipe(dir.path()) });
        assert_eq!((manifest.links, manifest.state, manifest.control), (2, 11, 5));
        manifest.write(&dir.path().join(MANIFEST)).unwrap();
        let file = shard_path(dir.path(), 0);
        let kept = [counting(1, 2), counting(3, 2)];
        shard::write(&file, manifest.place(&manifest.dataset(), (0, 4)), &kept).unwrap();
        assert_eq!(Dataset::open(dir.path(), 2).unwrap().read(None).unwrap(), kept);
        let reason = Dataset::open(dir.path(), 3).unwrap_err().to_string();
        assert!(reason.ends_with("dataset.json: links: is 2; the mission's arm has 3"), "{reason}");
        for (field, change) in [
            ("links: is 8; arms of 1 to 7", Manifest { links: 8, ..manifest.clone() }),
            ("links: is 0; arms", Manifest { links: 0, ..manifest.clone() }),
            ("state: is 13; this", Manifest { state: 13, ..manifest.clone() }),
        ] {
            change.write(&dir.path().join(MANIFEST)).unwrap();
            let reason = Dataset::open(dir.path(), 2).unwrap_err().to_string();
            assert!(reason.contains(field), "{reason}");
        }
    }
}
