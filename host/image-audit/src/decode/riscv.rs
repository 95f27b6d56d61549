//! RISC-V of 64 bits with compressed instructions.

use super::{Flow, Transfer, field, signed};

/// `auipc`: register and value.
type Upper = Option<(u32, u64)>;

/// Transfers of control in `code`, of whole instructions from `address` on.
///
/// A far call is `auipc` and `jalr` side by side: the linker, which may shorten the pair, never
/// parts it.
pub fn decode(code: &[u8], address: u64) -> Vec<Transfer> {
    let mut transfers = Vec::new();
    let half = |i: usize| {
        code.get(i..i + 2).map(|bytes| u32::from(u16::from_le_bytes([bytes[0], bytes[1]])))
    };
    let (mut i, mut upper) = (0, None);
    while let Some(low) = half(i) {
        let at = address + i as u64;
        let mut next = None;
        let flow = if low & 3 != 3 {
            i += 2;
            compressed(low, at)
        } else {
            i += 4;
            half(i - 2).and_then(|high| {
                let word = high << 16 | low;
                if word & 0x7f == 0x17 {
                    next = Some((field(word, 7, 5), at.wrapping_add(signed(word & !0xfff, 32))));
                }
                full(word, at, upper)
            })
        };
        upper = next;
        transfers.extend(flow.map(|flow| Transfer { at, flow }));
    }
    transfers
}

/// Flow of a jump through a register that names no offset of its own. `ra` and `t0` are link
/// registers: to jump to one is to return.
fn through(register: u32) -> Option<Flow> {
    (!matches!(register, 1 | 5)).then_some(Flow::IndirectJump)
}

/// An instruction of 16 bits.
fn compressed(word: u32, at: u64) -> Option<Flow> {
    let register = field(word, 7, 5);
    // Bits of the offset as they lie in the instruction: (from, to, count).
    let offset = |parts: &[(u32, u32, u32)], bits: u32| {
        let join =
            |sum, (from, to, count): &(u32, u32, u32)| sum | field(word, *from, *count) << to;
        at.wrapping_add(signed(parts.iter().fold(0, join), bits))
    };
    match word {
        // C.J
        _ if word & 0xe003 == 0xa001 => {
            let parts = [
                (12, 11, 1),
                (11, 4, 1),
                (9, 8, 2),
                (8, 10, 1),
                (7, 6, 1),
                (6, 7, 1),
                (3, 1, 3),
                (2, 5, 1),
            ];
            Some(Flow::Jump(offset(&parts, 12)))
        }
        // C.BEQZ, C.BNEZ
        _ if word & 0xc003 == 0xc001 => {
            let parts = [(12, 8, 1), (10, 3, 2), (5, 6, 2), (3, 1, 2), (2, 5, 1)];
            Some(Flow::Jump(offset(&parts, 9)))
        }
        // C.JR, C.JALR; without a register they are other instructions.
        _ if word & 0xf07f == 0x8002 && register != 0 => through(register),
        _ if word & 0xf07f == 0x9002 && register != 0 => Some(Flow::IndirectCall),
        _ => None,
    }
}

/// An instruction of 32 bits, with the `auipc` right before it.
fn full(word: u32, at: u64, upper: Upper) -> Option<Flow> {
    let (link, register) = (field(word, 7, 5), field(word, 15, 5));
    let go = |to: u64| if link == 0 { Flow::Jump(to) } else { Flow::Call(to) };
    match word & 0x7f {
        // JAL
        0x6f => {
            let offset = field(word, 31, 1) << 20
                | field(word, 12, 8) << 12
                | field(word, 20, 1) << 11
                | field(word, 21, 10) << 1;
            Some(go(at.wrapping_add(signed(offset, 21))))
        }
        // Branches
        0x63 => {
            let offset = field(word, 31, 1) << 12
                | field(word, 7, 1) << 11
                | field(word, 25, 6) << 5
                | field(word, 8, 4) << 1;
            Some(Flow::Jump(at.wrapping_add(signed(offset, 13))))
        }
        // JALR
        0x67 => match upper {
            Some((base, value)) if base == register => {
                Some(go(value.wrapping_add(signed(word >> 20, 12))))
            }
            _ if link == 0 => through(register),
            _ => Some(Flow::IndirectCall),
        },
        _ => None,
    }
}
