//! Cortex-A53: QEMU's `virt` with `-cpu cortex-a53`, at EL1, without address translation.

use super::{ExitCode, write_register};
use core::arch::{asm, global_asm};
use remora_firmware::{Board, Stack};

// Floating point on, default rounding, exceptions to one place, cycle counter on, .bss zeroed,
// stack painted.
global_asm!(
    ".section .text.reset, \"ax\"",
    ".global reset",
    "reset:",
    "mov x0, #(3 << 20)",
    "msr cpacr_el1, x0",
    "isb",
    "msr fpcr, xzr",
    "adrp x0, vectors",
    "add x0, x0, :lo12:vectors",
    "msr vbar_el1, x0",
    "mov x0, #0x41", // PMCR_EL0: enabled, 64 bits
    "msr pmcr_el0, x0",
    "mov x0, #(1 << 31)", // PMCNTENSET_EL0: the cycle counter
    "msr pmcntenset_el0, x0",
    "msr pmccfiltr_el0, xzr",
    "isb",
    "ldr x0, =__bss_start",
    "ldr x1, =__bss_end",
    "1: cmp x0, x1",
    "b.hs 2f",
    "str xzr, [x0], #8",
    "b 1b",
    "2: ldr x0, =__stack_bottom",
    "ldr x1, =__stack_top",
    "mov sp, x1",
    "ldr w2, =0x5afe57ac",
    "3: cmp x0, x1",
    "b.hs 4f",
    "str w2, [x0], #4",
    "b 3b",
    "4: ldr x0, =REMORA_REQUEST",
    "ldr w0, [x0]",
    "mov x29, xzr",
    "mov x30, xzr",
    "bl remora_main",
    ".ltorg",
    ".balign 2048",
    "vectors:",
    ".rept 16",
    "b remora_fault",
    ".balign 128",
    ".endr",
    ".text",
);

/// Data register of the board's PL011.
const UART_DATA: usize = 0x0900_0000;

/// The board.
pub struct ThisBoard;

impl ThisBoard {
    /// The start-up code has turned on what is used of it.
    pub fn new() -> Self {
        Self
    }
}

impl Board for ThisBoard {
    const NAME: &'static str = "virt-cortex-a53";
    /// The emulated cycle counter goes at 1 GHz: a cycle is an instruction.
    const RESOLUTION: u64 = 1;

    fn write(&self, byte: u8) {
        // SAFETY: this board's UART; the emulated one is never busy, so nothing waits for it.
        unsafe { write_register(UART_DATA, u32::from(byte)) }
    }

    fn instructions(&self) -> u64 {
        let cycles;
        // SAFETY: reads a counter.
        unsafe { asm!("isb", "mrs {}, pmccntr_el0", out(reg) cycles, options(nomem, nostack)) }
        cycles
    }

    fn known_loop(&self, turns: u32) -> u64 {
        // SAFETY: counts a register down to zero, no more.
        unsafe {
            asm!("2: subs {n:w}, {n:w}, #1", "b.ne 2b", n = inout(reg) turns => _, options(nomem, nostack));
        }
        2 * u64::from(turns)
    }

    fn paint_stack(&self) {
        super::paint_stack();
    }

    fn stack(&self) -> Option<Stack> {
        Some(super::painted_stack())
    }
}

/// Ends the emulation: semihosting's SYS_EXIT with ADP_Stopped_ApplicationExit.
pub fn exit(code: ExitCode) -> ! {
    let block = [0x20026_u64, code as u64];
    loop {
        // SAFETY: a halt that the emulator takes as this request; it only reads `block`.
        unsafe { asm!("hlt #0xf000", in("w0") 0x18, in("x1") &raw const block) }
    }
}
