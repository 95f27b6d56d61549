//! Threads on cores of their own.

use remora_host::error::Error;
use serde::{Deserialize, Serialize};

/// Where the threads of a profile ran.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pinning {
    /// The cores of the calling thread and of its helper, where both were pinned.
    pub cores: Option<[usize; 2]>,
    /// Why they were not.
    pub refused: Option<String>,
}

impl Pinning {
    fn refused(reason: impl Into<String>) -> Self {
        Self { cores: None, refused: Some(reason.into()) }
    }
}

/// Pins the calling thread and its helper to the cores `wanted`, or to the first two that the
/// program may use. Where the system refuses, or has one core, the threads stay where they are and
/// the result says why.
///
/// # Errors
/// A wanted core that the program may not use, or one core for both.
pub fn pin_pair(wanted: Option<[usize; 2]>) -> Result<Pinning, Error> {
    let allowed = match allowed() {
        Ok(allowed) => allowed,
        Err(reason) => return Ok(Pinning::refused(reason)),
    };
    let Some([own, other]) = choose(wanted, &allowed)? else {
        return Ok(Pinning::refused("there is one core"));
    };
    // The helper first: it is started by this, and would inherit where the caller is pinned.
    match remora_host::threads::on_helper(|| pin(other)) {
        None => return Ok(Pinning::refused("the second thread did not start in time")),
        Some(Err(reason)) => return Ok(Pinning::refused(reason)),
        Some(Ok(())) => {}
    }
    Ok(match pin(own) {
        Ok(()) => Pinning { cores: Some([own, other]), refused: None },
        Err(reason) => Pinning::refused(reason),
    })
}

/// The two cores to pin to; none where there is one core and none was wanted.
fn choose(wanted: Option<[usize; 2]>, allowed: &[usize]) -> Result<Option<[usize; 2]>, Error> {
    let Some([own, other]) = wanted else {
        return Ok(allowed.first_chunk().copied());
    };
    if own == other {
        return Err(Error::argument("--cores", "needs two different cores"));
    }
    match [own, other].into_iter().find(|core| !allowed.contains(core)) {
        Some(core) => {
            let list: Vec<String> = allowed.iter().map(usize::to_string).collect();
            let reason = format!("core {core} is not one of this program's: {}", list.join(", "));
            Err(Error::argument("--cores", reason))
        }
        None => Ok(Some([own, other])),
    }
}

/// The cores that the calling thread may run on, in order.
#[cfg(target_os = "linux")]
pub(super) fn allowed() -> Result<Vec<usize>, String> {
    use rustix::thread::{CpuSet, sched_getaffinity};
    let set = sched_getaffinity(None).map_err(|error| error.to_string())?;
    Ok((0..CpuSet::MAX_CPU).filter(|core| set.is_set(*core)).collect())
}

/// Pins the calling thread to one core.
#[cfg(target_os = "linux")]
fn pin(core: usize) -> Result<(), String> {
    use rustix::thread::{CpuSet, sched_setaffinity};
    let mut set = CpuSet::new();
    if core < CpuSet::MAX_CPU {
        set.set(core);
    }
    sched_setaffinity(None, &set).map_err(|error| error.to_string())
}

#[cfg(not(target_os = "linux"))]
pub(super) fn allowed() -> Result<Vec<usize>, String> {
    Err("threads are pinned on Linux only".into())
}

#[cfg(not(target_os = "linux"))]
fn pin(_: usize) -> Result<(), String> {
    Err("threads are pinned on Linux only".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cores_are_chosen_among_those_allowed() {
        assert_eq!(choose(None, &[2, 5, 7]), Ok(Some([2, 5])));
        assert_eq!(choose(None, &[3]), Ok(None));
        assert_eq!(choose(Some([7, 2]), &[2, 5, 7]), Ok(Some([7, 2])));
        let message = |wanted| choose(Some(wanted), &[2, 5]).unwrap_err().to_string();
        assert_eq!(message([2, 2]), "--cores: needs two different cores");
        assert_eq!(message([2, 3]), "--cores: core 3 is not one of this program's: 2, 5");
    }

    /// Both threads run on the cores that were asked for, as the system says afterwards.
    #[cfg(target_os = "linux")]
    #[test]
    fn both_threads_are_where_they_were_pinned() {
        std::thread::spawn(|| {
            let before = allowed().unwrap();
            let pinning = pin_pair(None).unwrap();
            match pinning.cores {
                Some([own, other]) => {
                    assert_eq!(allowed().unwrap(), [own]);
                    let helpers = (0..100).find_map(|_| remora_host::threads::on_helper(allowed));
                    assert_eq!(helpers.unwrap().unwrap(), [other]);
                    assert_eq!(pinning.refused, None);
                }
                None => assert!(pinning.refused.is_some(), "{before:?}"),
            }
        })
        .join()
        .unwrap();
    }
}
