//! Transfers of control in a piece of machine code: calls and jumps, nothing else.
//!
//! Three decoders know just the branch instructions of their processor; x86-64, whose instructions
//! have no fixed place to look at, is read by a whole disassembler.

mod aarch64;
mod riscv;
#[cfg(test)]
mod tests;
mod thumb;
mod x86;

use super::elf::Machine;

/// Target of one instruction, or of a pair that belongs together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// A call of this address.
    Call(u64),
    /// A jump to this address, conditional or not.
    Jump(u64),
    /// A call through a register or memory.
    IndirectCall,
    /// A call or jump through a pointer at a fixed address, as of a table that the linker makes.
    Through(u64),
    /// A jump through a register or memory: a table of jumps, or a call in tail position.
    IndirectJump,
    /// A jump through a table of offsets, which stays in its function.
    TableJump,
}

/// A transfer of control; plain returns are none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transfer {
    /// Address of the instruction; of the second one of a pair.
    pub at: u64,
    /// Where it leads.
    pub flow: Flow,
}

/// Transfers of control and addresses found in a piece of code.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Decoded {
    /// Calls and jumps, in the order of their addresses.
    pub transfers: Vec<Transfer>,
    /// Addresses that the code forms relative to itself; only of x86-64, whose code says so
    /// without a relocation's help.
    pub references: Vec<u64>,
    /// Most bytes that an alignment of the stack to more than the ABI's may cost; only of x86-64.
    pub realignment: u64,
    /// Addresses of bytes that are no instruction the decoder knows; only of x86-64.
    pub invalid: Vec<u64>,
}

/// Decodes a piece of code that begins at `address` and holds no data.
pub fn decode(machine: Machine, code: &[u8], address: u64) -> Decoded {
    let transfers = match machine {
        Machine::Arm => thumb::decode(code, address),
        Machine::AArch64 => aarch64::decode(code, address),
        Machine::RiscV64 => riscv::decode(code, address),
        Machine::X86_64 => return x86::decode(code, address),
    };
    Decoded { transfers, ..Decoded::default() }
}

/// The low `bits` of `value`, as a signed number.
fn signed(value: u32, bits: u32) -> u64 {
    let shift = 64 - bits;
    (((u64::from(value) << shift) as i64) >> shift) as u64
}

/// `bits` of `word` from `low` up.
fn field(word: u32, low: u32, bits: u32) -> u32 {
    (word >> low) & ((1 << bits) - 1)
}
