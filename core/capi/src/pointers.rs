//! Structures of the caller, read and written after a look at each.
#![allow(unsafe_code, reason = "follows the caller's pointers")]

use crate::RemoraStatus;
use crate::abi::REMORA_ALIGNMENT;
use core::ffi::c_void;
use remora_core::advanced::qp::dense::is_usable;

/// A structure that begins with its size.
///
/// # Safety
/// Its first four bytes are a `u32` by which the caller tells its size, and all bit patterns are values.
pub(crate) unsafe trait Sized32: Copy {}

/// That an address is one where a `T` may be.
fn look_at<T>(pointer: *const T) -> Result<(), RemoraStatus> {
    if pointer.is_null() {
        Err(RemoraStatus::Null)
    } else if !pointer.is_aligned() {
        Err(RemoraStatus::Misaligned)
    } else {
        Ok(())
    }
}

/// That the caller's structure is as large as this library's.
///
/// # Safety
/// `pointer` is NULL, misaligned, or leads to as many bytes as its first member says, four at least.
unsafe fn look_at_size<T: Sized32>(pointer: *const T) -> Result<(), RemoraStatus> {
    look_at(pointer)?;
    // SAFETY: four bytes are there, by the caller's word, and aligned.
    let size = unsafe { pointer.cast::<u32>().read() };
    if size as usize == size_of::<T>() { Ok(()) } else { Err(RemoraStatus::StructSize) }
}

/// A copy of the caller's structure.
///
/// # Safety
/// As [`look_at_size`].
pub(crate) unsafe fn read<T: Sized32>(pointer: *const T) -> Result<T, RemoraStatus> {
    // SAFETY: the caller's word goes on; after the look all of it is there.
    unsafe {
        look_at_size(pointer)?;
        Ok(pointer.read())
    }
}

/// Checks that a time [s] is small enough to differ from one a millisecond later.
pub(crate) fn look_at_time(time_s: f64) -> Result<(), RemoraStatus> {
    if is_usable(time_s) && time_s.abs() <= 1e12 { Ok(()) } else { Err(RemoraStatus::InvalidTime) }
}

/// The caller's place for a result: looked at before work begins, written once it has ended.
pub(crate) struct Out<T>(*mut T);

impl<T: Copy> Out<T> {
    /// A place without a size of its own, such as a number.
    ///
    /// # Safety
    /// `pointer` is NULL, misaligned, or leads to a place for a `T` for as long as this lives.
    pub(crate) unsafe fn plain(pointer: *mut T) -> Result<Self, RemoraStatus> {
        look_at(pointer).map(|()| Self(pointer))
    }

    /// A structure, which is not to lie in `bytes` of memory that the call works in.
    ///
    /// # Safety
    /// As [`look_at_size`], writable, for as long as this lives.
    pub(crate) unsafe fn sized(
        pointer: *mut T,
        memory: *const c_void,
        bytes: usize,
    ) -> Result<Self, RemoraStatus>
    where
        T: Sized32,
    {
        // SAFETY: the caller's word goes on.
        unsafe { look_at_size(pointer)? };
        let (begin, from) = (pointer.addr(), memory.addr());
        let is_apart =
            begin.saturating_add(size_of::<T>()) <= from || from.saturating_add(bytes) <= begin;
        if is_apart { Ok(Self(pointer)) } else { Err(RemoraStatus::Overlap) }
    }

    /// Writes the result.
    pub(crate) fn write(self, value: T) {
        // SAFETY: looked at when this was made; the caller keeps it there.
        unsafe { self.0.write(value) };
    }
}

/// That memory of the caller's is where and as long as it must be.
pub(crate) fn look_at_memory(
    memory: *const c_void,
    bytes: usize,
    needed: usize,
) -> Result<(), RemoraStatus> {
    if memory.is_null() {
        Err(RemoraStatus::Null)
    } else if !memory.addr().is_multiple_of(REMORA_ALIGNMENT) {
        Err(RemoraStatus::Misaligned)
    } else if bytes < needed {
        Err(RemoraStatus::ShortMemory)
    } else {
        Ok(())
    }
}

/// That the caller knows this interface.
pub(crate) fn look_at_abi(abi: u32) -> Result<(), RemoraStatus> {
    if abi == crate::REMORA_ABI { Ok(()) } else { Err(RemoraStatus::ForeignAbi) }
}

/// The status of a call that has none to tell.
pub(crate) fn status(result: Result<(), RemoraStatus>) -> RemoraStatus {
    result.err().unwrap_or(RemoraStatus::Ok)
}
