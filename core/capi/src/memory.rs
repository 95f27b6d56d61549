//! The caller's memory as a workspace or a flight.
#![allow(unsafe_code, reason = "makes values of the caller's memory")]

use crate::RemoraStatus;
use crate::abi::{REMORA_ALIGNMENT, REMORA_FLIGHT_BYTES, REMORA_WORKSPACE_BYTES};
use crate::pointers::look_at_memory;
use core::cell::UnsafeCell;
use core::ffi::c_void;
use core::ops::{Deref, DerefMut};
use core::sync::atomic::{AtomicU32, Ordering};
use remora_core::advanced::planner::{Nominal, Report};
use remora_core::advanced::qp::Valid;
use remora_core::prelude::{
    FlightPlan, Guidance, Integrator, Mission, NetworkMemory, Planner, Scenario,
};

/// Contents of a workspace.
pub(crate) struct Workspace {
    pub mission: Valid<Mission>,
    pub planner: Planner,
    pub network: NetworkMemory,
    /// The flight's plan while it is planned again: on a stack it would be a third of that.
    pub nominal: Nominal,
    /// Last request to the planner, where it holds a plan of that.
    pub last: Option<Last>,
}

/// Inputs of the plan in a workspace, and its report.
#[derive(Clone, Copy)]
pub(crate) struct Last {
    pub scenario: Valid<Scenario>,
    pub integrator: Integrator,
    pub report: Report,
}

/// Contents of a flight: plain data, which may be copied.
pub(crate) struct Flight {
    pub guidance: Guidance,
    pub mission: Valid<Mission>,
    pub plan: FlightPlan,
    pub has_plan: bool,
    /// Time of the last step's estimate [s]; none before the first.
    pub last_s: Option<f64>,
}

/// Contents that the caller's memory may hold.
pub(crate) trait Kind {
    /// First number of memory that holds it.
    const MARK: u32;
    /// Bytes that the header says.
    const BYTES: usize;
    /// Memory that does not hold it.
    const NOT_OPEN: RemoraStatus;
}

impl Kind for Workspace {
    const MARK: u32 = 0x5b1f_2e60;
    const BYTES: usize = REMORA_WORKSPACE_BYTES;
    const NOT_OPEN: RemoraStatus = RemoraStatus::NotOpen;
}

impl Kind for Flight {
    const MARK: u32 = 0x3ac9_74d2;
    const BYTES: usize = REMORA_FLIGHT_BYTES;
    const NOT_OPEN: RemoraStatus = RemoraStatus::NoFlight;
}

/// Memory of the caller's: a mark, and what it holds.
#[repr(C, align(64))]
struct Place<T> {
    mark: AtomicU32,
    contents: UnsafeCell<T>,
}

/// Added to the mark while a call works in the memory.
const BUSY: u32 = 1;

/// Most bytes that the header may ask for in vain.
const SPARE: usize = 4096;

const _: () = {
    assert!(align_of::<Place<Workspace>>() == REMORA_ALIGNMENT);
    assert!(align_of::<Place<Flight>>() == REMORA_ALIGNMENT);
    let (workspace, flight) = (size_of::<Place<Workspace>>(), size_of::<Place<Flight>>());
    assert!(workspace <= REMORA_WORKSPACE_BYTES && flight <= REMORA_FLIGHT_BYTES);
    // Words of 32 bits need less.
    assert!(size_of::<usize>() < 8 || workspace + SPARE > REMORA_WORKSPACE_BYTES);
    assert!(size_of::<usize>() < 8 || flight + SPARE > REMORA_FLIGHT_BYTES);
};

/// Makes a workspace of memory that was looked at. All bits of a planner that has planned nothing are zero,
/// so that none of it goes over the stack.
///
/// # Safety
/// `memory` is aligned, `REMORA_WORKSPACE_BYTES` long and nobody else's.
pub(crate) unsafe fn make_workspace(memory: *mut c_void, mission: Valid<Mission>) {
    let place = memory.cast::<Place<Workspace>>();
    // SAFETY: the caller's word; zero bits are a blank planner and network (by their documentation, and a
    // test) and a nominal plan of zeros, the rest is written before the mark says that all is there.
    unsafe {
        place.write_bytes(0, 1);
        let contents = UnsafeCell::raw_get(&raw const (*place).contents);
        (&raw mut (*contents).mission).write(mission);
        (&raw mut (*contents).last).write(None);
        (&raw mut (*place).mark).write(AtomicU32::new(Workspace::MARK));
    }
}

/// Makes a flight of memory that was looked at.
///
/// # Safety
/// `memory` is aligned, `REMORA_FLIGHT_BYTES` long and nobody else's.
pub(crate) unsafe fn make_flight(memory: *mut c_void, guidance: Guidance, mission: Valid<Mission>) {
    let place = memory.cast::<Place<Flight>>();
    let plan = FlightPlan::BLANK;
    let flight = Flight { guidance, mission, plan, has_plan: false, last_s: None };
    // SAFETY: the caller's word.
    unsafe {
        place.write_bytes(0, 1);
        UnsafeCell::raw_get(&raw const (*place).contents).write(flight);
        (&raw mut (*place).mark).write(AtomicU32::new(Flight::MARK));
    }
}

/// The mark of memory that holds a `T` which nobody works in.
///
/// # Safety
/// `memory` is NULL, misaligned, or as long as a `T` takes.
unsafe fn free<T: Kind>(memory: *const c_void) -> Result<*const Place<T>, RemoraStatus> {
    look_at_memory(memory, T::BYTES, T::BYTES)?;
    let place = memory.cast::<Place<T>>();
    // SAFETY: aligned and there; every bit pattern is a mark.
    let mark = unsafe { &(*place).mark }.load(Ordering::Acquire);
    if mark == T::MARK {
        Ok(place)
    } else if mark == T::MARK + BUSY {
        Err(RemoraStatus::Busy)
    } else {
        Err(T::NOT_OPEN)
    }
}

/// Borrows the contents of memory, to look at.
///
/// # Safety
/// As [`free`]; nobody writes to it meanwhile.
pub(crate) unsafe fn look<'a, T: Kind>(memory: *const c_void) -> Result<&'a T, RemoraStatus> {
    // SAFETY: the caller's word; the mark is set once the contents are there.
    unsafe { free::<T>(memory).map(|place| &*UnsafeCell::raw_get(&raw const (*place).contents)) }
}

/// Contents of memory, to work in: until this is dropped, other calls find it busy.
pub(crate) struct InUse<'a, T: Kind> {
    mark: &'a AtomicU32,
    contents: &'a mut T,
}

impl<T: Kind> InUse<'_, T> {
    /// Begins to work in memory.
    ///
    /// # Safety
    /// As [`free`]; no other thread uses it meanwhile.
    pub(crate) unsafe fn enter(memory: *mut c_void) -> Result<Self, RemoraStatus> {
        // SAFETY: the caller's word; the mark sees to it that there is one of these at a time.
        let (mark, contents) = unsafe {
            let place = free::<T>(memory)?;
            (&(*place).mark, &mut *UnsafeCell::raw_get(&raw const (*place).contents))
        };
        mark.store(T::MARK + BUSY, Ordering::Release);
        Ok(Self { mark, contents })
    }
}

impl<T: Kind> Drop for InUse<'_, T> {
    fn drop(&mut self) {
        self.mark.store(T::MARK, Ordering::Release);
    }
}

impl<T: Kind> Deref for InUse<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.contents
    }
}

impl<T: Kind> DerefMut for InUse<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        self.contents
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Zero bits, which [`make_workspace`] rests on. Padding counts, too: the language says nothing of it,
    /// and an image's data has zeros.
    #[test]
    #[cfg_attr(miri, ignore = "looks at an image's data, which an interpreter has not")]
    fn all_bits_of_a_new_planner_and_network_are_zero() {
        static PLANNER: Planner = Planner::new();
        static NETWORK: NetworkMemory = NetworkMemory::new();
        fn is_zero<T>(value: &'static T) -> bool {
            // SAFETY: all of a static is there to be read in an image, its padding included.
            let bytes = unsafe {
                core::slice::from_raw_parts((&raw const *value).cast::<u8>(), size_of::<T>())
            };
            bytes.iter().all(|byte| *byte == 0)
        }
        assert!(is_zero(&PLANNER) && is_zero(&NETWORK));
    }
}
