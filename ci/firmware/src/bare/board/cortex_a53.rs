//! Cortex-A53: QEMU's `virt` with `-cpu cortex-a53`, at EL1, without address translation.

use super::{ExitCode, WATCHDOG_SECONDS, write_register};
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
    "fault:",
    "ldr x0, =__stack_top",
    "mov sp, x0",
    "bl remora_fault",
    ".ltorg",
    ".balign 2048",
    "vectors:",
    ".rept 16",
    "b fault",
    ".balign 128",
    ".endr",
    ".text",
);

/// Data register of the board's PL011.
const UART_DATA: usize = 0x0900_0000;

/// GICv2: the distributor's control and the interrupts that are private to a processor.
const DISTRIBUTOR_CONTROL: usize = 0x0800_0000;
const DISTRIBUTOR_ENABLE: usize = 0x0800_0100;
/// The processor's side of it: control, and the priority from which on interrupts are let through.
const INTERFACE_CONTROL: usize = 0x0801_0000;
const INTERFACE_PRIORITY: usize = 0x0801_0004;
/// The interrupt of the physical timer.
const TIMER_INTERRUPT: u32 = 30;

/// The board.
pub struct ThisBoard;

impl ThisBoard {
    /// The start-up code has turned on what is used of it, but for the watchdog's interrupt.
    pub fn new() -> Self {
        // SAFETY: registers of this board's interrupt controller, which know no memory.
        unsafe {
            write_register(DISTRIBUTOR_ENABLE, 1_u32 << TIMER_INTERRUPT);
            write_register(DISTRIBUTOR_CONTROL, 1_u32);
            write_register(INTERFACE_PRIORITY, 0xff_u32);
            write_register(INTERFACE_CONTROL, 1_u32);
        }
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

    fn start_watchdog(&self) {
        // SAFETY: sets the physical timer, which nothing else uses, and lets its interrupt through.
        unsafe {
            asm!(
                "mrs {now}, cntpct_el0",
                "mrs {rate}, cntfrq_el0",
                "madd {now}, {rate}, {seconds}, {now}",
                "msr cntp_cval_el0, {now}",
                "mov {rate}, #1",
                "msr cntp_ctl_el0, {rate}",
                "msr daifclr, #2",
                now = out(reg) _, rate = out(reg) _, seconds = in(reg) u64::from(WATCHDOG_SECONDS),
                options(nomem, nostack),
            );
        }
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
