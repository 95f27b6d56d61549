//! LEON3, a SPARC V8 for space with a register window's traps to serve: QEMU's `leon3_generic`.

use super::countdown::Countdown;
use super::{ExitCode, WATCHDOG_SECONDS, write_register};
use core::arch::global_asm;
use remora_firmware::{Board, Stack};

// Functions that the compiler calls for atomic words, which not every SPARC has. The one core here reads and
// writes a word at a time anyway.
global_asm!(
    ".section .text.__atomic_load_4, \"ax\"",
    ".global __atomic_load_4",
    ".type __atomic_load_4, #function",
    "__atomic_load_4:",
    "retl",
    " ld [%o0], %o0",
    ".size __atomic_load_4, . - __atomic_load_4",
    ".section .text.__atomic_store_4, \"ax\"",
    ".global __atomic_store_4",
    ".type __atomic_store_4, #function",
    "__atomic_store_4:",
    "retl",
    " st %o1, [%o0]",
    ".size __atomic_store_4, . - __atomic_store_4",
    ".text",
);

// Traps at 4 KiB, of which windows that overflow and underflow are served; all others end the run.
// Then: supervisor with floating point on, default rounding, .bss zeroed, stack painted, traps on.
// The processor has eight windows.
global_asm!(
    ".section .text.reset, \"ax\"",
    ".balign 4096",
    "trap_table:",
    ".rept 5",
    "ba stop",
    "nop",
    "nop",
    "nop",
    ".endr",
    "ba window_overflow",
    "nop",
    "nop",
    "nop",
    "ba window_underflow",
    "nop",
    "nop",
    "nop",
    ".rept 249",
    "ba stop",
    "nop",
    "nop",
    "nop",
    ".endr",
    ".global reset",
    "reset:",
    "set 0x1fc0, %g1", // PSR: floating point, no interrupts, supervisor, traps off, window 0
    "wr %g1, %psr",
    "nop",
    "nop",
    "nop",
    "wr %g0, 2, %wim",
    "set trap_table, %g1",
    "wr %g1, %tbr",
    "nop",
    "nop",
    "nop",
    "set __bss_start, %g1",
    "set __bss_end, %g2",
    "1: cmp %g1, %g2",
    "bgeu 2f",
    "nop",
    "st %g0, [%g1]",
    "ba 1b",
    "add %g1, 4, %g1",
    "2: set __stack_bottom, %g1",
    "set __stack_top, %g2",
    "set 0x5afe57ac, %g3",
    "3: cmp %g1, %g2",
    "bgeu 4f",
    "nop",
    "st %g3, [%g1]",
    "ba 3b",
    "add %g1, 4, %g1",
    "4: sub %g2, 96, %sp",
    "mov %g0, %fp",
    "st %g0, [%sp + 64]",
    "ld [%sp + 64], %fsr",
    "set 0x10e0, %g1", // PSR: traps and interrupts on
    "wr %g1, %psr",
    "nop",
    "nop",
    "nop",
    "set REMORA_REQUEST, %g1",
    "call remora_main",
    "ld [%g1], %o0",
    "window_overflow:",
    "mov %wim, %l3",
    "mov %g1, %l7",
    "srl %l3, 1, %g1",
    "sll %l3, 7, %l4",
    "or %l4, %g1, %g1",
    "save",
    "mov %g1, %wim",
    "nop",
    "nop",
    "nop",
    "std %l0, [%sp]",
    "std %l2, [%sp + 8]",
    "std %l4, [%sp + 16]",
    "std %l6, [%sp + 24]",
    "std %i0, [%sp + 32]",
    "std %i2, [%sp + 40]",
    "std %i4, [%sp + 48]",
    "std %i6, [%sp + 56]",
    "restore",
    "mov %l7, %g1",
    "jmp %l1",
    "rett %l2",
    "window_underflow:",
    "mov %wim, %l3",
    "sll %l3, 1, %l4",
    "srl %l3, 7, %l5",
    "or %l5, %l4, %l5",
    "mov %l5, %wim",
    "nop",
    "nop",
    "nop",
    "restore",
    "restore",
    "ldd [%sp], %l0",
    "ldd [%sp + 8], %l2",
    "ldd [%sp + 16], %l4",
    "ldd [%sp + 24], %l6",
    "ldd [%sp + 32], %i0",
    "ldd [%sp + 40], %i2",
    "ldd [%sp + 48], %i4",
    "ldd [%sp + 56], %i6",
    "save",
    "save",
    "jmp %l1",
    "rett %l2",
    // With traps off a software trap ends the emulation.
    ".global stop",
    "stop:",
    "set 0x1fc0, %g1",
    "wr %g1, %psr",
    "nop",
    "nop",
    "nop",
    "ta 0",
    "nop",
    "ba stop",
    "nop",
    ".global known_loop",
    "known_loop:",
    "subcc %o0, 1, %o0",
    "bne known_loop",
    "nop",
    "retl",
    "nop",
    ".text",
);

unsafe extern "C" {
    /// Ends the emulation.
    safe fn stop() -> !;
    /// Counts down to zero: three instructions a turn.
    safe fn known_loop(turns: u32);
}

/// APBUART.
const UART_DATA: usize = 0x8000_0100;
const UART_CONTROL: usize = 0x8000_0108;

/// GPTIMER: its first timer counts down at 40 MHz.
const TIMER_PRESCALER: usize = 0x8000_0304;
const TIMER_VALUE: usize = 0x8000_0310;
const TIMER_RELOAD: usize = 0x8000_0314;
const TIMER_CONTROL: usize = 0x8000_0318;

/// Its second is the watchdog: interrupt 7, which the controller lets through where its mask says so.
const WATCHDOG_RELOAD: usize = 0x8000_0324;
const WATCHDOG_CONTROL: usize = 0x8000_0328;
const WATCHDOG_TICKS: u32 = WATCHDOG_SECONDS * 40_000_000;
const WATCHDOG_INTERRUPT: u32 = 7;
const INTERRUPT_MASK: usize = 0x8000_0240;

/// The board.
pub struct ThisBoard {
    timer: Countdown,
}

impl ThisBoard {
    /// Turns on what is used of it.
    pub fn new() -> Self {
        // SAFETY: registers of this board's UART and timer, which know no memory.
        unsafe {
            write_register(UART_CONTROL, 2_u32);
            write_register(TIMER_PRESCALER, 0_u32);
            write_register(TIMER_RELOAD, u32::MAX);
            // Load, restart at zero, enable.
            write_register(TIMER_CONTROL, 7_u32);
        }
        // SAFETY: the value of the timer that was started above.
        Self { timer: unsafe { Countdown::new(TIMER_VALUE) } }
    }
}

impl Board for ThisBoard {
    const NAME: &'static str = "leon3_generic";
    /// An instruction is a nanosecond of the emulator's time, a tick 25 of them.
    const RESOLUTION: u64 = 25;

    fn write(&self, byte: u8) {
        // SAFETY: this board's UART; the emulated one is never busy, so nothing waits for it.
        unsafe { write_register(UART_DATA, u32::from(byte)) }
    }

    /// Must be read more often than the timer wraps: every 107 s of the emulator's time.
    fn instructions(&self) -> u64 {
        self.timer.ticks().wrapping_mul(Self::RESOLUTION)
    }

    fn known_loop(&self, turns: u32) -> u64 {
        known_loop(turns);
        3 * u64::from(turns)
    }

    fn paint_stack(&self) {
        super::paint_stack();
    }

    fn start_watchdog(&self) {
        // SAFETY: registers of this board's timer and interrupt controller, which know no memory.
        unsafe {
            write_register(INTERRUPT_MASK, 1_u32 << WATCHDOG_INTERRUPT);
            write_register(WATCHDOG_RELOAD, WATCHDOG_TICKS);
            // Interrupt, load, enable.
            write_register(WATCHDOG_CONTROL, 13_u32);
        }
    }

    fn stack(&self) -> Option<Stack> {
        Some(super::painted_stack())
    }
}

/// Ends the emulation. This emulator has no exit code: a run that ended early is known by the
/// missing last line of its output.
pub fn exit(_: ExitCode) -> ! {
    stop()
}
