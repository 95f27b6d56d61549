//! 64-bit RISC-V: QEMU's `virt`, in machine mode.

use super::{ExitCode, WATCHDOG_SECONDS, read_register, write_register};
use core::arch::{asm, global_asm};
use remora_firmware::{Board, Stack};

// Floating point on, default rounding, exceptions to one place, .bss zeroed, stack painted.
global_asm!(
    ".section .text.reset, \"ax\"",
    ".global reset",
    "reset:",
    "la t0, trap",
    "csrw mtvec, t0",
    "li t0, 1 << 13", // mstatus.FS: initial
    "csrs mstatus, t0",
    "csrw fcsr, zero",
    "la t0, __bss_start",
    "la t1, __bss_end",
    "1: bgeu t0, t1, 2f",
    "sd zero, 0(t0)",
    "addi t0, t0, 8",
    "j 1b",
    "2: la t0, __stack_bottom",
    "la sp, __stack_top",
    "li t1, 0x5afe57ac",
    "3: bgeu t0, sp, 4f",
    "sw t1, 0(t0)",
    "addi t0, t0, 4",
    "j 3b",
    "4: la t0, REMORA_REQUEST",
    "lw a0, 0(t0)",
    "call remora_main",
    ".balign 4",
    "trap:",
    "la sp, __stack_top",
    "call remora_fault",
    ".text",
);

/// Transmit register of the board's 16550.
const UART_DATA: usize = 0x1000_0000;
/// The CLINT's time, at 10 MHz, and the one at which it interrupts.
const TIMER_NOW: usize = 0x0200_bff8;
const TIMER_COMPARE: usize = 0x0200_4000;
const WATCHDOG_TICKS: u64 = WATCHDOG_SECONDS as u64 * 10_000_000;
/// The test device that ends the emulation.
const TEST_DEVICE: usize = 0x0010_0000;

/// The board.
pub struct ThisBoard;

impl ThisBoard {
    /// The start-up code has turned on what is used of it.
    pub fn new() -> Self {
        Self
    }
}

impl Board for ThisBoard {
    const NAME: &'static str = "virt-riscv64";
    const RESOLUTION: u64 = 1;

    fn write(&self, byte: u8) {
        // SAFETY: this board's UART; the emulated one is never busy, so nothing waits for it.
        unsafe { write_register(UART_DATA, byte) }
    }

    fn instructions(&self) -> u64 {
        let count;
        // SAFETY: reads a counter.
        unsafe { asm!("csrr {}, minstret", out(reg) count, options(nomem, nostack)) }
        count
    }

    fn known_loop(&self, turns: u32) -> u64 {
        // SAFETY: counts a register down to zero, no more.
        unsafe {
            asm!("2: addi {n}, {n}, -1", "bnez {n}, 2b", n = inout(reg) u64::from(turns) => _, options(nomem, nostack));
        }
        2 * u64::from(turns)
    }

    fn paint_stack(&self) {
        super::paint_stack();
    }

    fn start_watchdog(&self) {
        // SAFETY: registers of this board's timer, which know no memory; its interrupt goes where exceptions go.
        unsafe {
            let now: u64 = read_register(TIMER_NOW);
            write_register(TIMER_COMPARE, now.wrapping_add(WATCHDOG_TICKS));
            asm!("csrw mie, {}", "csrsi mstatus, 8", in(reg) 1 << 7, options(nomem, nostack));
        }
    }

    fn stack(&self) -> Option<Stack> {
        Some(super::painted_stack())
    }
}

/// Ends the emulation by the test device: "pass", or "fail" with a code.
pub fn exit(code: ExitCode) -> ! {
    let word = match code {
        ExitCode::Done => 0x5555,
        failed => ((failed as u32) << 16) | 0x3333,
    };
    loop {
        // SAFETY: this board's test device, which stops the emulator.
        unsafe { write_register(TEST_DEVICE, word) }
    }
}
