//! Rounding and small numbers as the processor handles them now. A caller may have changed either; plans
//! would then have other bits than on the ground, and nothing else would tell.
#![allow(unsafe_code, reason = "reads a register")]

use crate::RemoraStatus;

/// Refuses every way of calculating but IEEE 754's usual one: round to nearest, small numbers as they are.
pub(crate) fn check() -> Result<(), RemoraStatus> {
    let (flushes, rounds_otherwise) = registers::read();
    if flushes {
        Err(RemoraStatus::FlushToZero)
    } else if rounds_otherwise {
        Err(RemoraStatus::Rounding)
    } else {
        Ok(())
    }
}

#[cfg(target_arch = "x86_64")]
mod registers {
    use core::arch::asm;

    /// MXCSR: whether results or operands are flushed, and whether it rounds other than to nearest.
    pub fn read() -> (bool, bool) {
        let mut register = 0u32;
        // SAFETY: stores four bytes where there is room for them.
        unsafe {
            asm!("stmxcsr [{}]", in(reg) &mut register, options(nostack, preserves_flags));
        }
        (register & 0x8040 != 0, register & 0x6000 != 0)
    }
}

#[cfg(target_arch = "aarch64")]
mod registers {
    use core::arch::asm;

    /// FPCR: likewise.
    pub fn read() -> (bool, bool) {
        let register: u64;
        // SAFETY: reads a register that every program may read.
        unsafe {
            asm!("mrs {}, fpcr", out(reg) register, options(nomem, nostack, preserves_flags));
        }
        (register & 0x0100_0001 != 0, register & 0x00c0_0000 != 0)
    }
}

#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
mod registers {
    use core::arch::asm;

    /// FPSCR: likewise.
    pub fn read() -> (bool, bool) {
        let register: u32;
        // SAFETY: reads a register; without a floating-point unit that is on nothing here would run.
        unsafe {
            asm!("vmrs {}, fpscr", out(reg) register, options(nomem, nostack, preserves_flags));
        }
        (register & 0x0100_0000 != 0, register & 0x00c0_0000 != 0)
    }
}

/// Elsewhere by what comes of a few sums and products.
#[cfg(any(
    test,
    not(any(
        target_arch = "x86_64",
        target_arch = "aarch64",
        all(target_arch = "arm", target_abi = "eabihf")
    ))
))]
#[cfg_attr(test, allow(dead_code, reason = "tests hold it against the register"))]
mod arithmetic {
    use core::hint::black_box;

    /// Whether small results or operands become zero, and whether it rounds other than to nearest.
    pub fn read() -> (bool, bool) {
        let half = black_box(f64::MIN_POSITIVE) * black_box(0.5);
        let least = black_box(f64::from_bits(1)) * black_box(1e16);
        let (one, little) = (black_box(1.0), black_box(f64::EPSILON / 8.0));
        (half == 0.0 || least == 0.0, one + little != one || one - little != one)
    }
}

#[cfg(not(any(
    target_arch = "x86_64",
    target_arch = "aarch64",
    all(target_arch = "arm", target_abi = "eabihf")
)))]
use arithmetic as registers;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_as_it_starts_is_accepted_by_register_and_arithmetic() {
        assert_eq!(check(), Ok(()));
        assert_eq!(arithmetic::read(), (false, false));
    }

    /// Reads registers and arithmetic with MXCSR changed for a moment.
    #[cfg(target_arch = "x86_64")]
    fn with(bits: u32) -> [(bool, bool); 2] {
        use core::arch::asm;
        let (usual, changed) = (0x1f80u32, 0x1f80 | bits);
        // SAFETY: loads a valid register, and the usual one before anything else is calculated.
        unsafe {
            asm!("ldmxcsr [{}]", in(reg) &changed, options(nostack));
            let found = [registers::read(), arithmetic::read()];
            asm!("ldmxcsr [{}]", in(reg) &usual, options(nostack));
            found
        }
    }

    #[test]
    #[cfg(target_arch = "x86_64")]
    fn flushing_and_other_rounding_are_seen_by_register_and_arithmetic() {
        for flush in [0x8000, 0x0040] {
            assert_eq!(with(flush), [(true, false); 2], "{flush:#x}");
        }
        for rounding in [0x2000, 0x4000, 0x6000] {
            assert_eq!(with(rounding), [(false, true); 2], "{rounding:#x}");
        }
    }
}
