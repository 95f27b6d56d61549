//! Making a dataset: scenarios planned over a few threads, shard by shard.

use super::manifest::{MANIFEST, Manifest};
use super::shard::{self, Place};
use super::{MISSION, Trajectory, shard_path};
use remora_host::draw::draw_one;
use remora_host::error::Error;
use remora_host::fingerprint::fingerprint;
use remora_host::formats::{
    Limit, NamedScenario, Status, lock, lock_shared, make_directory, open_regular, open_to_write,
    read_bytes, read_mission, remove_partials, remove_partials_among, write_first,
};
use remora_host::part::Part;
use remora_host::planning::Planner;
use remora_host::pool;
use remora_host::progress::Progress;
use remora_host::request::PlanRequest;
use std::collections::BTreeMap;
use std::fs::File;
use std::num::{NonZeroU32, NonZeroUsize};
use std::path::PathBuf;

/// A dataset to be made: the input of `remora learn dataset`.
#[derive(Clone, Debug)]
pub struct Recipe {
    /// Scenarios `0..count` are tried.
    pub count: u64,
    /// Seed of the draw.
    pub seed: u64,
    /// How to plan. What a network is taught by a model's guess is where the optimiser takes its own
    /// rollouts.
    pub request: PlanRequest,
    /// The file of the mission, where it is not the built-in one: it is kept beside the shards.
    pub mission_file: Option<PathBuf>,
    /// Scenarios a shard; an interruption loses the shards that are not complete.
    pub shard: NonZeroU32,
    /// Number of worker threads.
    pub jobs: NonZeroUsize,
    /// Part whose shards are made; none: all shards.
    pub part: Option<Part>,
    /// The directory of the shards.
    pub out: PathBuf,
}

/// A dataset that is complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Made {
    /// Scenarios that were tried, in all runs.
    pub tried: u64,
    /// Trajectories in the dataset.
    pub kept: u64,
    /// Scenarios that this run tried.
    pub now: u64,
}

/// A shard that is being made, with the results of its scenarios so far.
#[derive(Default)]
struct Open {
    done: u32,
    kept: BTreeMap<u64, Trajectory>,
}

impl Recipe {
    /// Plans the scenarios of all shards that are not there yet.
    ///
    /// # Errors
    /// A directory or file that cannot be written; a dataset begun with something else; a shard
    /// that is damaged; another program that makes the same dataset; a mission that allows no
    /// start.
    pub fn make(&self, progress: &mut dyn Progress) -> Result<Made, Error> {
        self.draw(0)?;
        let manifest = Manifest::new(self);
        let shards: Vec<(u64, u32)> = manifest.shards().collect();
        let shards = match self.part {
            Some(part) => {
                part.check(shards.len() as u64, "files of --shard scenarios")?;
                let range = part.range(shards.len() as u64);
                &shards[range.start as usize..range.end as usize]
            }
            None => &shards,
        };
        self.look(&manifest)?;
        let _lock = self.begin(&manifest)?;
        match self.part {
            // Others may be beginning theirs.
            Some(_) => {
                let files = shards.iter().map(|(first, _)| self.shard_path(*first));
                let name = |file: PathBuf| Some(file.file_name()?.to_string_lossy().into_owned());
                remove_partials_among(&self.out, files.filter_map(name));
            }
            None => remove_partials(&self.out),
        }
        let dataset = manifest.dataset();

        let mut made = Made { tried: 0, kept: 0, now: 0 };
        let mut pending = Vec::new();
        for (first, tried) in shards.iter().copied() {
            let file = self.shard_path(first);
            match shard::verify(&file, manifest.place(&dataset, (first, tried)))? {
                Some(kept) => {
                    made.tried += u64::from(tried);
                    made.kept += u64::from(kept);
                }
                None => pending.extend(first..first + u64::from(tried)),
            }
        }
        progress.begin(made.tried as usize + pending.len(), made.tried as usize);
        let mut open = BTreeMap::new();
        let finish = |index, trajectory: Option<Box<Trajectory>>| {
            progress.done(trajectory.is_some());
            made.now += 1;
            made.tried += 1;
            made.kept += u64::from(trajectory.is_some());
            self.file_away(&dataset, &mut open, index, trajectory)
        };
        let plan = |planner: &mut Planner, index| self.plan(planner, index);
        let outcome = pool::plan_all(self.jobs, &pending, plan, finish);
        progress.end();
        outcome.map(|()| made)
    }

    /// Refuses a directory of another dataset, without changing anything: another manifest; where it is gone
    /// shards that are not this dataset's; another mission beside them.
    fn look(&self, manifest: &Manifest) -> Result<(), Error> {
        let file = self.out.join(MANIFEST);
        if file.exists() {
            manifest.agree(&Manifest::read(&file)?).map_err(|error| error.at(&file))?;
            return self.look_at_mission(manifest);
        }
        let dataset = manifest.dataset();
        for (first, tried) in manifest.shards() {
            let place = manifest.place(&dataset, (first, tried));
            shard::verify(&self.shard_path(first), place)?;
        }
        self.look_at_mission(manifest)
    }

    /// Refuses a mission beside the shards that is another: who reads the dataset would take it for theirs.
    fn look_at_mission(&self, manifest: &Manifest) -> Result<(), Error> {
        let file = self.out.join(MISSION);
        if !file.exists() {
            return Ok(());
        }
        match fingerprint(&read_mission(Some(&file))?) == manifest.mission {
            true => Ok(()),
            false => {
                let reason = "is another mission than this dataset's; choose another --out";
                Err(Error::input(&file, "", reason))
            }
        }
    }

    /// Makes the directory and its manifest, or compares with what is there, where another program was first;
    /// returns the manifest locked against other programs that would make the same dataset, parts of it against
    /// those that would make it all.
    fn begin(&self, manifest: &Manifest) -> Result<File, Error> {
        let file = self.out.join(MANIFEST);
        make_directory(&self.out)?;
        if !manifest.begin(&file)? {
            manifest.agree(&Manifest::read(&file)?).map_err(|error| error.at(&file))?;
        }
        if let Some(mission) = &self.mission_file
            && !write_first(&self.out.join(MISSION), &read_bytes(mission, Limit::TEXT)?)?
        {
            self.look_at_mission(manifest)?;
        }
        let busy = "another program is making this dataset";
        if self.part.is_some() {
            let handle = open_regular(&file)?;
            lock_shared(&file, &handle, busy)?;
            return Ok(handle);
        }
        // A network's file system locks for one alone only what was opened to write.
        let handle = open_to_write(&file)?;
        lock(&file, &handle, busy)?;
        Ok(handle)
    }

    /// Plans one scenario; `None` where it was not solved or the verifier refused the plan, which
    /// is no solved one either.
    pub(super) fn plan(
        &self,
        planner: &mut Planner,
        index: u64,
    ) -> Result<Option<Box<Trajectory>>, Error> {
        let plan = planner.plan(&self.request, &self.draw(index)?).file;
        let is_solved = plan.status == Status::Solved;
        Ok(is_solved.then(|| Box::new(Trajectory::new(index, &plan))))
    }

    fn draw(&self, index: u64) -> Result<NamedScenario, Error> {
        draw_one(self.seed, index, &self.request.mission).ok_or_else(|| {
            let reason = "its geometry lets no start satisfy keep-out and pointing";
            Error::argument("--mission", reason)
        })
    }

    /// Adds what came of a scenario to its shard, and writes the shard once it has all.
    fn file_away(
        &self,
        dataset: &str,
        open: &mut BTreeMap<u64, Open>,
        index: u64,
        trajectory: Option<Box<Trajectory>>,
    ) -> Result<(), Error> {
        let size = u64::from(self.shard.get());
        let first = index / size * size;
        let tried = (self.count - first).min(size) as u32;
        let shard = open.entry(first).or_default();
        shard.done += 1;
        shard.kept.extend(trajectory.map(|trajectory| (index, *trajectory)));
        if shard.done < tried {
            return Ok(());
        }
        let kept: Vec<Trajectory> = std::mem::take(&mut shard.kept).into_values().collect();
        open.remove(&first);
        let place = Place { dataset, joints: self.request.mission.joints(), first, tried };
        shard::write(&self.shard_path(first), place, &kept)
    }

    fn shard_path(&self, first: u64) -> PathBuf {
        shard_path(&self.out, first / u64::from(self.shard.get()))
    }
}
