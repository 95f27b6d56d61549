//! Parts that all bare-metal images share: the static memory, the painted stack, the panic handler.
//!
//! Each board brings its start-up code (in assembly: registers and memory are set up before any
//! Rust runs), its output, its counter and its way to stop the emulator.

#[cfg_attr(target_arch = "arm", path = "board/cortex_m7.rs")]
#[cfg_attr(target_arch = "aarch64", path = "board/cortex_a53.rs")]
#[cfg_attr(target_arch = "riscv64", path = "board/riscv64.rs")]
#[cfg_attr(target_arch = "sparc", path = "board/leon3.rs")]
mod board;

#[cfg(any(target_arch = "arm", target_arch = "sparc"))]
mod countdown;
#[cfg(feature = "replay")]
mod input;

use crate::models::MODELS;
use core::cell::UnsafeCell;
use core::panic::PanicInfo;
use remora_firmware::{Memory, Stack};
#[cfg(not(feature = "replay"))]
use remora_firmware::{Request, run};

/// Exit code of an image.
#[derive(Clone, Copy)]
#[repr(u32)]
pub enum ExitCode {
    /// The run came to its end.
    Done = 0,
    /// A panic.
    Panic = 101,
    /// An exception of the processor.
    Fault = 102,
}

/// Time that the watchdog allows a plan [s]: the hardest of the audit's corpus takes 6.5 on a Cortex-M7.
const WATCHDOG_SECONDS: u32 = 50;

/// Word that the start-up code paints the stack with; its assembly repeats the number.
const PAINT: u32 = 0x5afe_57ac;

/// The planner's memory, in `.bss`: an image holds none of it.
struct StaticMemory(UnsafeCell<Memory>);

// SAFETY: the image runs on one core without interrupts, and `remora_main` alone touches it, once.
unsafe impl Sync for StaticMemory {}

static MEMORY: StaticMemory = StaticMemory(UnsafeCell::new(Memory::new()));

unsafe extern "C" {
    /// Lowest word of the stack, from the linker script.
    static __stack_bottom: u32;
    /// End of the stack, from the linker script.
    static __stack_top: u32;
    /// Does nothing. It stands in a section of its own, which the linker leaves out of an image
    /// without anything that leads to it: its name in an image says that a panic can be reached.
    safe fn remora_panic_reachable();
}

core::arch::global_asm!(
    ".section .text.remora_panic_reachable, \"ax\"",
    ".global remora_panic_reachable",
    ".balign 8",
    "remora_panic_reachable:",
    // Never returns, so that it needs to know nothing of the processor: `.long 0` is no
    // instruction anywhere but for padding.
    ".long 0",
    ".text",
);

/// Entry from the start-up code: memory is initialised, the stack painted, the floating-point
/// unit on. `request` is the word that the starter left for [`Request::from_word`].
#[unsafe(no_mangle)]
extern "C" fn remora_main(request: u32) -> ! {
    // SAFETY: the start-up code calls this function once and nothing else does, so this is the
    // only reference there ever is.
    let memory = unsafe { &mut *MEMORY.0.get() };
    let board = board::ThisBoard::new();
    #[cfg(not(feature = "replay"))]
    run(&board, Request::from_word(request), &MODELS, memory);
    #[cfg(feature = "replay")]
    {
        let _ = request;
        remora_firmware::replay(&board, &input::numbers(), &MODELS, memory);
    }
    board::exit(ExitCode::Done)
}

/// Handler of every exception, on a stack of its own: the pointer to the other may be
/// damaged.
#[unsafe(no_mangle)]
extern "C" fn remora_fault() -> ! {
    board::exit(ExitCode::Fault)
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    remora_panic_reachable();
    board::exit(ExitCode::Panic)
}

/// High-water mark: paint left from the bottom up is stack never used.
fn painted_stack() -> Stack {
    let bottom = &raw const __stack_bottom;
    let size = (&raw const __stack_top as usize).wrapping_sub(bottom as usize);
    let words = size / size_of::<u32>();
    let is_paint = |i: &usize| {
        // SAFETY: the linker script reserves these words for the stack; the volatile read makes no
        // assumption about what the running code keeps in them.
        unsafe { bottom.wrapping_add(*i).read_volatile() == PAINT }
    };
    let left = (0..words).take_while(is_paint).count() * size_of::<u32>();
    Stack { used: size.saturating_sub(left), size }
}

/// Bytes below a function's own variable that it leaves alone: the rest of its frame.
const FRAME_BYTES: usize = 512;

/// Paints the stack anew, from its bottom up to the frame of this function.
#[inline(never)]
fn paint_stack() {
    let local = 0_u8;
    let bottom = &raw const __stack_bottom as usize;
    let end = (&raw const local as usize).saturating_sub(FRAME_BYTES);
    for address in (bottom..end).step_by(size_of::<u32>()) {
        // SAFETY: the linker script reserves these words for the stack, and they lie below all
        // frames: the deepest is this function's, which calls nothing.
        unsafe { (address as *mut u32).write_volatile(PAINT) }
    }
}

/// Writes a device's register.
///
/// # Safety
/// `address` is that of a register of the board, and writing this value has no effect on memory.
#[allow(dead_code, reason = "not every board writes its registers from Rust")]
unsafe fn write_register<T>(address: usize, value: T) {
    // SAFETY: as the caller promises.
    unsafe { (address as *mut T).write_volatile(value) }
}

/// Reads a device's register.
///
/// # Safety
/// `address` is that of a register of the board.
#[allow(dead_code, reason = "not every board reads its registers from Rust")]
unsafe fn read_register<T>(address: usize) -> T {
    // SAFETY: as the caller promises.
    unsafe { (address as *const T).read_volatile() }
}
