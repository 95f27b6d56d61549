//! Thumb-2, as on a Cortex-M.

use super::{Flow, Transfer, field, signed};

/// Transfers of control in `code`, of whole instructions from `address` on.
pub fn decode(code: &[u8], address: u64) -> Vec<Transfer> {
    let mut transfers = Vec::new();
    let half = |i: usize| {
        code.get(i..i + 2).map(|bytes| u32::from(u16::from_le_bytes([bytes[0], bytes[1]])))
    };
    let mut i = 0;
    while let Some(first) = half(i) {
        let at = address + i as u64;
        let flow = if first >> 11 >= 0b11101 {
            i += 4;
            half(i - 2).and_then(|second| wide(first, second, at))
        } else {
            i += 2;
            narrow(first, at)
        };
        transfers.extend(flow.map(|flow| Transfer { at, flow }));
    }
    transfers
}

/// An instruction of 16 bits.
fn narrow(word: u32, at: u64) -> Option<Flow> {
    // The program counter reads as the instruction after the next.
    let to = |offset: u64| Some(Flow::Jump(at.wrapping_add(4).wrapping_add(offset)));
    let register = field(word, 3, 4);
    match word {
        // B<c>; conditions 14 and 15 are other instructions.
        _ if word >> 12 == 0b1101 && field(word, 8, 4) < 14 => to(signed(word << 1, 9)),
        // B
        _ if word >> 11 == 0b11100 => to(signed(word << 1, 12)),
        // CBZ, CBNZ
        _ if word & 0xf500 == 0xb100 => {
            to(u64::from(field(word, 9, 1) << 6 | field(word, 3, 5) << 1))
        }
        // BLX register
        _ if word & 0xff87 == 0x4780 => Some(Flow::IndirectCall),
        // BX register, MOV pc: a return by way of the link register
        _ if word & 0xff87 == 0x4700 || word & 0xff87 == 0x4687 => {
            (register != 14).then_some(Flow::IndirectJump)
        }
        // ADD pc
        _ if word & 0xff87 == 0x4487 => Some(Flow::TableJump),
        _ => None,
    }
}

/// An instruction of 32 bits.
fn wide(first: u32, second: u32, at: u64) -> Option<Flow> {
    let into_pc = field(second, 12, 4) == 15;
    match first {
        _ if first >> 11 == 0b11110 && second & 0x8000 != 0 => branch(first, second, at),
        // TBB, TBH: forward by an offset from the table behind it
        _ if first & 0xfff0 == 0xe8d0 && second & 0xffe0 == 0xf000 => Some(Flow::TableJump),
        // LDR pc from the stack: a return
        0xf85d if second == 0xfb04 => None,
        // LDR pc: immediate, register, literal
        _ if first & 0xff70 == 0xf850 && into_pc => Some(Flow::IndirectJump),
        // LDM with pc: from the stack a return
        _ if matches!(first & 0xffd0, 0xe890 | 0xe910) && second & 0x8000 != 0 => {
            (field(first, 0, 4) != 13).then_some(Flow::IndirectJump)
        }
        _ => None,
    }
}

fn branch(first: u32, second: u32, at: u64) -> Option<Flow> {
    let from = at.wrapping_add(4);
    let (s, j1, j2) = (field(first, 10, 1), field(second, 13, 1), field(second, 11, 1));
    let far = || {
        let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
        let high = s << 24 | i1 << 23 | i2 << 22 | field(first, 0, 10) << 12;
        from.wrapping_add(signed(high | field(second, 0, 11) << 1, 25))
    };
    match (field(second, 14, 1), field(second, 12, 1)) {
        // BL
        (1, 1) => Some(Flow::Call(far())),
        // BLX to Arm code, which a Cortex-M has none of
        (1, _) => Some(Flow::Call(far() & !3)),
        // B.W
        (_, 1) => Some(Flow::Jump(far())),
        // B<c>.W; conditions 14 and 15 are other instructions.
        _ if field(first, 6, 4) < 14 => {
            let high = s << 20 | j2 << 19 | j1 << 18 | field(first, 0, 6) << 12;
            Some(Flow::Jump(from.wrapping_add(signed(high | field(second, 0, 11) << 1, 21))))
        }
        _ => None,
    }
}
