//! Cortex-M7 with double-precision floating point: QEMU's `mps2-an500`.

use super::countdown::Countdown;
use super::{ExitCode, WATCHDOG_SECONDS, write_register};
use core::arch::{asm, global_asm};
use remora_firmware::{Board, Stack};

// Vectors, then: floating-point unit on, flush-to-zero off, .bss zeroed, .data copied, stack
// painted. The table's alignment covers the sixteen exceptions of the core; interrupts stay off but
// for the watchdog's, which cannot be.
global_asm!(
    ".section .vectors, \"a\"",
    ".word __stack_top",
    ".word reset",
    ".rept 14",
    ".word fault",
    ".endr",
    ".section .text.reset, \"ax\"",
    ".global reset",
    ".type reset, %function",
    ".thumb_func",
    "reset:",
    "ldr r0, =0xe000ed88", // CPACR
    "ldr r1, [r0]",
    "orr r1, r1, #0xf00000",
    "str r1, [r0]",
    "dsb",
    "isb",
    "movs r1, #0",
    "vmsr fpscr, r1",
    "ldr r0, =__bss_start",
    "ldr r2, =__bss_end",
    "1: cmp r0, r2",
    "bhs 2f",
    "str r1, [r0], #4",
    "b 1b",
    "2: ldr r0, =__data_start",
    "ldr r2, =__data_end",
    "ldr r3, =__data_load",
    "3: cmp r0, r2",
    "bhs 4f",
    "ldr r1, [r3], #4",
    "str r1, [r0], #4",
    "b 3b",
    "4: ldr r0, =__stack_bottom",
    "ldr r1, =0x5afe57ac",
    "5: cmp r0, sp",
    "bhs 6f",
    "str r1, [r0], #4",
    "b 5b",
    "6: ldr r0, =REMORA_REQUEST",
    "ldr r0, [r0]",
    "bl remora_main",
    ".type fault, %function",
    ".thumb_func",
    "fault:",
    "ldr r0, =__stack_top",
    "mov sp, r0",
    "bl remora_fault",
    ".ltorg",
    ".text",
);

/// CMSDK UART 0.
const UART_DATA: usize = 0x4000_4000;
const UART_CONTROL: usize = 0x4000_4008;
const UART_DIVIDER: usize = 0x4000_4010;

/// CMSDK timer 0: counts down at 25 MHz. SysTick has 24 bits only, too few for a plan.
const TIMER_CONTROL: usize = 0x4000_0000;
const TIMER_VALUE: usize = 0x4000_0004;
const TIMER_RELOAD: usize = 0x4000_0008;

/// CMSDK watchdog: counts down at 25 MHz, then raises the one interrupt that is never off.
const WATCHDOG_RELOAD: usize = 0x4000_8000;
const WATCHDOG_CONTROL: usize = 0x4000_8008;
const WATCHDOG_TICKS: u32 = WATCHDOG_SECONDS * 25_000_000;

/// The board.
pub struct ThisBoard {
    timer: Countdown,
}

impl ThisBoard {
    /// Turns on what is used of it.
    pub fn new() -> Self {
        // SAFETY: registers of this board's UART and timer, which know no memory.
        unsafe {
            write_register(UART_DIVIDER, 16_u32);
            write_register(UART_CONTROL, 1_u32);
            write_register(TIMER_RELOAD, u32::MAX);
            write_register(TIMER_VALUE, u32::MAX);
            write_register(TIMER_CONTROL, 1_u32);
        }
        // SAFETY: the value of the timer that was started above.
        Self { timer: unsafe { Countdown::new(TIMER_VALUE) } }
    }
}

impl Board for ThisBoard {
    const NAME: &'static str = "mps2-an500";
    /// An instruction is a nanosecond of the emulator's time, a tick 40 of them.
    const RESOLUTION: u64 = 40;

    fn write(&self, byte: u8) {
        // SAFETY: this board's UART; the emulated one is never busy, so nothing waits for it.
        unsafe { write_register(UART_DATA, u32::from(byte)) }
    }

    /// Must be read more often than the timer wraps: every 171 s of the emulator's time.
    fn instructions(&self) -> u64 {
        self.timer.ticks().wrapping_mul(Self::RESOLUTION)
    }

    fn known_loop(&self, turns: u32) -> u64 {
        // SAFETY: counts a register down to zero, no more.
        unsafe {
            asm!("2: subs {n}, {n}, #1", "bne 2b", n = inout(reg) turns => _, options(nomem, nostack));
        }
        2 * u64::from(turns)
    }

    fn paint_stack(&self) {
        super::paint_stack();
    }

    fn start_watchdog(&self) {
        // SAFETY: registers of this board's watchdog, which know no memory.
        unsafe {
            write_register(WATCHDOG_RELOAD, WATCHDOG_TICKS);
            write_register(WATCHDOG_CONTROL, 1_u32);
        }
    }

    fn stack(&self) -> Option<Stack> {
        Some(super::painted_stack())
    }
}

/// Ends the emulation: semihosting's SYS_EXIT_EXTENDED with ADP_Stopped_ApplicationExit.
pub fn exit(code: ExitCode) -> ! {
    let block = [0x20026_u32, code as u32];
    loop {
        // SAFETY: a breakpoint that the emulator takes as this request; it only reads `block`.
        unsafe { asm!("bkpt #0xab", in("r0") 0x20, in("r1") &raw const block) }
    }
}
