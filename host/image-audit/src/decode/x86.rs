//! x86-64, by the disassembler of iced.

use super::{Decoded, Flow, Transfer};
use iced_x86::{
    Code, Decoder, DecoderOptions, FlowControl, Instruction, Mnemonic, OpKind, Register,
};

/// Alignment of the stack at a call by the ABI [bytes].
const ABI_ALIGNMENT: u64 = 16;

/// Transfers of control in `code`, of whole instructions from `address` on, and the addresses that
/// it forms relative to itself.
pub fn decode(code: &[u8], address: u64) -> Decoded {
    let mut decoded = Decoded::default();
    let mut decoder = Decoder::with_ip(64, code, address, DecoderOptions::NONE);
    let (mut instruction, mut before) = (Instruction::default(), Instruction::default());
    while decoder.can_decode() {
        decoder.decode_out(&mut instruction);
        if instruction.code() == Code::INVALID {
            decoded.invalid.push(instruction.ip());
        }
        if instruction.is_ip_rel_memory_operand() {
            decoded.references.push(instruction.ip_rel_memory_address());
        }
        decoded.realignment = decoded.realignment.max(realignment(&instruction));
        let flow = flow(&instruction, &before);
        decoded.transfers.extend(flow.map(|flow| Transfer { at: instruction.ip(), flow }));
        before = instruction;
    }
    decoded
}

fn flow(instruction: &Instruction, before: &Instruction) -> Option<Flow> {
    match instruction.flow_control() {
        FlowControl::Call if instruction.mnemonic() == Mnemonic::Call => {
            Some(Flow::Call(instruction.near_branch_target()))
        }
        FlowControl::UnconditionalBranch | FlowControl::ConditionalBranch => {
            Some(Flow::Jump(instruction.near_branch_target()))
        }
        FlowControl::IndirectCall | FlowControl::IndirectBranch
            if instruction.is_ip_rel_memory_operand() =>
        {
            Some(Flow::Through(instruction.ip_rel_memory_address()))
        }
        FlowControl::IndirectCall => Some(Flow::IndirectCall),
        FlowControl::IndirectBranch => Some(indirect_jump(instruction, before)),
        _ => None,
    }
}

/// A jump to what the instruction before added up from a base and an offset is one through a table
/// of offsets; the address of a function would have come from memory whole.
fn indirect_jump(instruction: &Instruction, before: &Instruction) -> Flow {
    let is_sum = instruction.op0_kind() == OpKind::Register
        && before.mnemonic() == Mnemonic::Add
        && before.op0_kind() == OpKind::Register
        && before.op0_register() == instruction.op0_register()
        && before.op1_kind() == OpKind::Register;
    if is_sum { Flow::TableJump } else { Flow::IndirectJump }
}

/// `and rsp, -N`: up to `N` less what the ABI aligns to anyway.
fn realignment(instruction: &Instruction) -> u64 {
    let aligns = instruction.mnemonic() == Mnemonic::And
        && instruction.op0_kind() == OpKind::Register
        && instruction.op0_register() == Register::RSP
        && instruction.op1_kind() != OpKind::Register;
    if !aligns {
        return 0;
    }
    instruction.immediate(1).wrapping_neg().saturating_sub(ABI_ALIGNMENT)
}
