//! Approaches flown by policies, many at once: what `remora.gym` steps.

use crate::asked;
use crate::mission::Mission;
use crate::planning::with_planner;
use crate::raised::{Failure, argument, raised};
use crate::scenario::Scenario;
use crate::scene;
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use remora_core::advanced::stages::size;
use remora_host::approach::Approach;
use remora_host::episode::{self, Course, Episode, Step, Terms};
use remora_host::error::Error;
use remora_host::method::Integrator;
use remora_host::{planning, with_joints};
use std::any::Any;
use std::sync::{Arc, Mutex};

/// Episodes, each on one of the same approaches. A policy's action is torques as shares of their limits.
#[pyclass(frozen, module = "remora")]
pub(crate) struct Episodes {
    courses: Mutex<Vec<Box<dyn Course>>>,
    /// Threads that step.
    pool: ThreadPool,
    approaches: usize,
    features: usize,
    actions: usize,
}

/// Most episodes at once: 0.3 GB.
const MOST: usize = 1_000_000;

/// Fewest episodes a thread steps: for less no other is woken.
const LEAST: usize = 8;

/// Plans Stage 1 of all scenarios; episodes that begin on the first.
fn courses<const NL: usize>(
    mission: &Mission,
    cases: &[Scenario],
    integrator: Integrator,
    (terms, count): (Terms, usize),
) -> Result<Vec<Box<dyn Course>>, Failure> {
    let mission = mission.of::<NL>()?;
    let plan = |case: &Scenario| {
        with_planner(|planner| {
            let method = remora_host::method::Method { integrator, ..Default::default() };
            crate::raised::look(planning::refusal(mission, &case.named, &method), &case.named)?;
            let refused = |refusal| Failure::Refused(case.named.id.clone(), refusal);
            planner.approach(mission, &case.named, integrator).map_err(refused)
        })
    };
    let approaches: Vec<Approach<NL>> = cases.iter().map(plan).collect::<Result<_, _>>()?;
    let approaches = Arc::new(approaches);
    Ok((0..count).map(|_| course(&approaches, terms)).collect())
}

/// An episode; that of the built-in mission's arm is compiled in the library, where it is optimised.
fn course<const NL: usize>(approaches: &Arc<Vec<Approach<NL>>>, terms: Terms) -> Box<dyn Course> {
    let any: &dyn Any = approaches;
    match any.downcast_ref::<Arc<Vec<Approach>>>() {
        Some(usual) => episode::usual(usual.clone(), terms),
        None => Box::new(Episode::new(approaches.clone(), terms)),
    }
}

impl Episodes {
    fn courses(&self) -> std::sync::MutexGuard<'_, Vec<Box<dyn Course>>> {
        self.courses.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// What all of them see, a row an episode.
    fn seen(&self, courses: &[Box<dyn Course>]) -> Vec<f32> {
        let mut seen = vec![0.0; courses.len() * self.features];
        let rows = seen.par_chunks_mut(self.features).with_min_len(LEAST);
        self.pool.install(|| rows.zip(courses).for_each(|(row, course)| course.observe(row)));
        seen
    }

    fn array<'py>(&self, py: Python<'py>, seen: &[f32]) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let rows: Vec<Vec<f32>> = seen.chunks(self.features).map(<[f32]>::to_vec).collect();
        Ok(PyArray2::from_vec2(py, &rows)?)
    }

    /// Actions, a row an episode.
    fn actions_of(&self, actions: &PyReadonlyArray2<'_, f32>) -> PyResult<Vec<f32>> {
        let (actions, expected) = (actions.as_array(), [self.count(), self.actions]);
        if actions.shape() != expected {
            let reason = format!("have shape {:?}, expected {expected:?}", actions.shape());
            return Err(argument("actions", reason));
        }
        match actions.iter().all(|x| x.is_finite()) {
            true => Ok(actions.iter().copied().collect()),
            false => Err(argument("actions", "hold a number that is not finite")),
        }
    }

    /// On which approaches episodes begin, negative where they do not.
    fn begins(&self, begins: Option<&PyReadonlyArray1<'_, i64>>) -> PyResult<Vec<i64>> {
        let count = self.count();
        let begins = begins.map_or_else(|| vec![-1; count], |begins| begins.as_array().to_vec());
        let is_known = |approach: &i64| *approach < self.approaches as i64;
        match begins.len() == count && begins.iter().all(is_known) {
            true => Ok(begins),
            false => {
                let reason = format!("expects {count} numbers below {}", self.approaches);
                Err(argument("begins", reason))
            }
        }
    }
}

/// Features, rewards, and whether an episode has ended, one entry an episode.
type Stepped<'py> =
    (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<bool>>);

#[pymethods]
impl Episodes {
    #[new]
    #[pyo3(signature = (cases, mission=None, *, count=1, integrator="rk4", encoding="body",
                        miss_weight=1.0, jobs=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords, each of them optional")]
    fn new(
        py: Python<'_>,
        cases: Vec<Scenario>,
        mission: Option<Mission>,
        count: usize,
        integrator: &str,
        encoding: &str,
        miss_weight: f64,
        jobs: Option<usize>,
    ) -> PyResult<Self> {
        if cases.is_empty() || count == 0 {
            return Err(argument("cases, count", "there must be at least one of each"));
        }
        if count > MOST {
            return Err(argument("count", format!("must be {MOST} at most")));
        }
        if !(miss_weight >= 0.0 && miss_weight.is_finite()) {
            return Err(argument("miss_weight", "must be finite and not negative"));
        }
        let (integrator, encoding) = (asked::integrator(integrator)?, scene::encoding(encoding)?);
        let terms = (Terms { encoding, miss_weight }, count);
        let mission = Mission::or_default(mission)?;
        let courses = py.detach(|| {
            with_joints!(mission.joints(), NL => {
                courses::<NL>(&mission, &cases, integrator, terms)
            } else {
                Err(Error::Thread { reason: "no arm has so many joints".into() }.into())
            })
        })?;
        let pool = ThreadPoolBuilder::new().num_threads(asked::jobs(jobs)?.get()).build();
        let failed = |error: rayon::ThreadPoolBuildError| {
            raised(Error::Thread { reason: error.to_string() })
        };
        Ok(Self {
            courses: Mutex::new(courses),
            pool: pool.map_err(failed)?,
            approaches: cases.len(),
            features: encoding.features(mission.joints()),
            actions: size::controls(mission.joints()),
        })
    }

    /// Numbers that a policy sees.
    #[getter]
    fn features(&self) -> usize {
        self.features
    }

    /// Numbers of an action.
    #[getter]
    fn actions(&self) -> usize {
        self.actions
    }

    /// Number of episodes.
    #[getter]
    fn count(&self) -> usize {
        self.courses().len()
    }

    /// Begins one of them again, on an approach.
    fn begin(&self, episode: usize, approach: usize) -> PyResult<()> {
        if approach >= self.approaches {
            return Err(argument("approach", format!("{approach} is none of {}", self.approaches)));
        }
        let mut courses = self.courses();
        let count = courses.len();
        match courses.get_mut(episode) {
            Some(course) => course.begin(approach),
            None => return Err(argument("episode", format!("{episode} is none of {count}"))),
        }
        Ok(())
    }

    /// What all of them see.
    fn observe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let seen = py.detach(|| self.seen(&self.courses()));
        self.array(py, &seen)
    }

    /// Steps all of them, a row of actions an episode. One that has ended stays where it is; one of which
    /// `begins` names an approach, which is not negative, begins there instead.
    #[pyo3(signature = (actions, begins=None))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        actions: PyReadonlyArray2<'py, f32>,
        begins: Option<PyReadonlyArray1<'py, i64>>,
    ) -> PyResult<Stepped<'py>> {
        let (actions, begins) = (self.actions_of(&actions)?, self.begins(begins.as_ref())?);
        let (steps, seen) = py.detach(|| {
            let courses = &mut *self.courses();
            let rows = actions.par_chunks(self.actions).with_min_len(LEAST);
            let step = |((row, begins), course): ((&[f32], &i64), &mut Box<dyn Course>)| {
                match usize::try_from(*begins) {
                    Ok(approach) => {
                        course.begin(approach);
                        Step { reward: 0.0, is_last: false }
                    }
                    Err(_) => course.step(row),
                }
            };
            let all = rows.zip(&begins).zip(courses.par_iter_mut());
            let steps: Vec<Step> = self.pool.install(|| all.map(step).collect());
            (steps, self.seen(courses))
        });
        let rewards = steps.iter().map(|step| step.reward).collect();
        let ended = steps.iter().map(|step| step.is_last).collect();
        let seen = self.array(py, &seen)?;
        Ok((seen, PyArray1::from_vec(py, rewards), PyArray1::from_vec(py, ended)))
    }

    /// Distance of the end effectors from their ports, were each at its last node [m].
    fn misses<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let misses = self.courses().iter().map(|course| course.miss()).collect();
        PyArray1::from_vec(py, misses)
    }

    /// Costs of the torques so far.
    fn costs<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let costs = self.courses().iter().map(|course| course.cost()).collect();
        PyArray1::from_vec(py, costs)
    }
}
