//! Approaches flown by policies, many at once: what `remora.gym` steps.

use crate::argument::Argument;
use crate::bench::with_planner;
use crate::mission::Mission;
use crate::raised::{Failure, argument, raised};
use crate::request;
use crate::scenario::Scenario;
use crate::scene;
use crate::waiting::{Caller, waited};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use remora_core::advanced::stages::size;
use remora_host::approach::Approach;
use remora_host::episode::{Episode, Step, Terms};
use remora_host::error::Error;
use remora_host::method::{Integrator, Method};
use remora_host::request::PlanRequest;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// Episodes, each on one of the same approaches. A policy's action is torques as shares of their limits.
#[pyclass(frozen, module = "remora")]
pub(crate) struct Episodes {
    courses: Mutex<Vec<Episode>>,
    /// Threads that step.
    pool: ThreadPool,
    approaches: usize,
    count: usize,
    /// Substeps of a step.
    step_size: usize,
    features: usize,
    actions: usize,
}

/// Most episodes at once: 0.3 GB.
const MOST: usize = 1_000_000;

/// Most substeps of all episodes together between two looks for signals: 50 ms.
const MANY: usize = 10_000;

/// Fewest episodes a thread steps: for less no other is woken.
const LEAST: usize = 8;

/// Plans Stage 1 of all scenarios; episodes that begin on the first.
fn courses(
    caller: &Caller,
    mission: &Mission,
    cases: &[Scenario],
    integrator: Integrator,
    (terms, count): (Terms, usize),
) -> Result<Vec<Episode>, Failure> {
    let method = Method { integrator, ..Method::default() };
    let request = PlanRequest { mission: *mission.judged(), method, ..Default::default() };
    let plan = |case: &Scenario| {
        with_planner(caller, |bench| {
            bench.look(&request, &case.named)?;
            bench.approach(&request, &case.named)
        })
    };
    let approaches: Vec<Approach> = cases.iter().map(plan).collect::<Result<_, _>>()?;
    let approaches = Arc::new(approaches);
    Ok((0..count).map(|_| Episode::new(approaches.clone(), terms)).collect())
}

impl Episodes {
    fn courses(&self) -> std::sync::MutexGuard<'_, Vec<Episode>> {
        self.courses.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Works on all of them. Long work can be interrupted, which sets the flag.
    fn together<T: Send + 'static>(
        slf: &Bound<'_, Self>,
        work: impl FnOnce(&Self, &AtomicBool) -> T + Send + 'static,
    ) -> PyResult<T> {
        let all = slf.get();
        if all.count * all.step_size <= MANY {
            return Ok(slf.py().detach(|| work(all, &AtomicBool::new(false))));
        }
        let shared = slf.clone().unbind();
        waited(slf.py(), move |caller| Ok(work(shared.get(), caller.flag())))
    }

    /// Observes all of them, a row an episode.
    fn seen(&self, courses: &[Episode], is_over: &AtomicBool) -> Vec<f32> {
        let mut seen = vec![0.0; courses.len() * self.features];
        let rows = seen.par_chunks_mut(self.features).with_min_len(LEAST);
        self.pool.install(|| {
            rows.zip(courses).for_each(|(row, course)| {
                if !is_over.load(Ordering::Relaxed) {
                    course.observe(row);
                }
            });
        });
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

    /// Approaches on which episodes begin, negative where they do not.
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
type StepResult<'py> =
    (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<bool>>);

#[pymethods]
impl Episodes {
    #[new]
    #[pyo3(signature = (cases, mission, *, count, integrator, encoding, miss_weight, jobs))]
    #[expect(clippy::too_many_arguments, reason = "keywords")]
    fn new(
        py: Python<'_>,
        cases: Argument<Vec<Scenario>>,
        mission: Option<Argument<Mission>>,
        count: Argument<usize>,
        integrator: Argument<&str>,
        encoding: Argument<&str>,
        miss_weight: Argument<f64>,
        jobs: Option<Argument<usize>>,
    ) -> PyResult<Self> {
        let (cases, count) = (cases.named("cases")?, count.named("count")?);
        let miss_weight = miss_weight.named("miss_weight")?;
        if cases.is_empty() || count == 0 {
            return Err(argument("cases, count", "there must be at least one of each"));
        }
        if count > MOST {
            return Err(argument("count", format!("must be {MOST} at most")));
        }
        if !(miss_weight >= 0.0 && miss_weight.is_finite()) {
            return Err(argument("miss_weight", "must be finite and not negative"));
        }
        let (integrator, encoding) = (request::integrator(integrator)?, scene::encoding(encoding)?);
        let terms = (Terms { encoding, miss_weight }, count);
        let mission = Mission::or_default(Argument::optional(mission, "mission")?)?;
        let (arm, approaches, jobs) = (mission.joints(), cases.len(), request::jobs(jobs)?);
        let courses =
            waited(py, move |caller| courses(caller, &mission, &cases, integrator, terms))?;
        let pool = ThreadPoolBuilder::new().num_threads(jobs.get()).build();
        let failed = |error: rayon::ThreadPoolBuildError| {
            raised(Error::Thread { reason: error.to_string() })
        };
        Ok(Self {
            courses: Mutex::new(courses),
            pool: pool.map_err(failed)?,
            approaches,
            count,
            step_size: match integrator {
                Integrator::Euler => 1,
                Integrator::Rk4 { substeps } => substeps,
            },
            features: encoding.features(arm),
            actions: size::controls(arm),
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
        self.count
    }

    /// Begins one of them again, on an approach.
    fn begin(&self, episode: Argument<usize>, approach: Argument<usize>) -> PyResult<()> {
        let (episode, approach) = (episode.named("episode")?, approach.named("approach")?);
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

    /// Observes all of them.
    fn observe<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let all = Self::together(slf, |all, is_over| all.seen(&all.courses(), is_over))?;
        slf.get().array(slf.py(), &all)
    }

    /// Steps all of them, a row of actions an episode. One that has ended stays where it is; one of which
    /// `begins` names an approach, which is not negative, begins there instead.
    #[pyo3(signature = (actions, begins=None))]
    fn step<'py>(
        slf: &Bound<'py, Self>,
        actions: Argument<PyReadonlyArray2<'py, f32>>,
        begins: Option<Argument<PyReadonlyArray1<'py, i64>>>,
    ) -> PyResult<StepResult<'py>> {
        let (py, all) = (slf.py(), slf.get());
        let begins = Argument::optional(begins, "begins")?;
        let actions = all.actions_of(&actions.named("actions")?)?;
        let begins = all.begins(begins.as_ref())?;
        let (steps, seen) = Self::together(slf, move |all, is_over| {
            let courses = &mut *all.courses();
            let rows = actions.par_chunks(all.actions).with_min_len(LEAST);
            let step = |((row, begins), course): ((&[f32], &i64), &mut Episode)| {
                let approach = usize::try_from(*begins);
                match approach {
                    _ if is_over.load(Ordering::Relaxed) => Step { reward: 0.0, is_last: false },
                    Ok(approach) => {
                        course.begin(approach);
                        Step { reward: 0.0, is_last: false }
                    }
                    Err(_) => course.step(row),
                }
            };
            let each = rows.zip(&begins).zip(courses.par_iter_mut());
            let steps: Vec<Step> = all.pool.install(|| each.map(step).collect());
            (steps, all.seen(courses, is_over))
        })?;
        let rewards = steps.iter().map(|step| step.reward).collect();
        let ended = steps.iter().map(|step| step.is_last).collect();
        let seen = all.array(py, &seen)?;
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
