//! AArch64.

use super::{Flow, Transfer, field, signed};

/// Transfers of control in `code`, of whole instructions from `address` on.
pub fn decode(code: &[u8], address: u64) -> Vec<Transfer> {
    let mut transfers = Vec::new();
    let mut before = 0;
    for (i, bytes) in code.chunks_exact(4).enumerate() {
        let word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        let at = address + 4 * i as u64;
        transfers.extend(instruction(word, before, at).map(|flow| Transfer { at, flow }));
        before = word;
    }
    transfers
}

fn instruction(word: u32, before: u32, at: u64) -> Option<Flow> {
    let to = |low: u32, bits: u32| at.wrapping_add(signed(field(word, low, bits) << 2, bits + 2));
    match word {
        // BL, B
        _ if word >> 26 == 0b100101 => Some(Flow::Call(to(0, 26))),
        _ if word >> 26 == 0b000101 => Some(Flow::Jump(to(0, 26))),
        // B.cond, BC.cond; CBZ, CBNZ
        _ if word >> 24 == 0x54 || word & 0x7e00_0000 == 0x3400_0000 => Some(Flow::Jump(to(5, 19))),
        // TBZ, TBNZ
        _ if word & 0x7e00_0000 == 0x3600_0000 => Some(Flow::Jump(to(5, 14))),
        // BR, BLR, RET, and the same with authentication
        _ if word >> 25 == 0b1101011 => match field(word, 21, 4) & 0b0111 {
            0 => Some(register_jump(word, before)),
            1 => Some(Flow::IndirectCall),
            _ => None,
        },
        _ => None,
    }
}

/// A jump to what the instruction before added up from a base and an offset is one through a table
/// of offsets; the address of a function would have come from memory whole.
fn register_jump(word: u32, before: u32) -> Flow {
    let is_sum = before >> 24 == 0x8b && field(before, 0, 5) == field(word, 5, 5);
    if is_sum { Flow::TableJump } else { Flow::IndirectJump }
}
