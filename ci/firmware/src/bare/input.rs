//! Numbers that whoever starts the image leaves in its memory, beside the request.

use core::cell::UnsafeCell;
use remora_firmware::NUMBERS;

/// Memory of the numbers. The start-up code leaves the section alone.
#[repr(align(8))]
struct Input(UnsafeCell<[u64; NUMBERS]>);

// SAFETY: written before the image starts, and read only.
unsafe impl Sync for Input {}

#[unsafe(no_mangle)]
#[unsafe(link_section = ".input")]
static REMORA_INPUT: Input = Input(UnsafeCell::new([0; NUMBERS]));

/// The numbers' bits, in the processor's order of bytes.
pub fn numbers() -> [u64; NUMBERS] {
    // SAFETY: the static is valid and aligned; the volatile read makes no assumption about what the linker put
    // there.
    unsafe { REMORA_INPUT.0.get().read_volatile() }
}
