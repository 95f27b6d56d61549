#![doc = include_str!("../README.md")]
//! ## Reading the code
//!
//! Data goes down this list, imports go up it: names of symbols (`names`), the ELF file (`elf`) and the
//! remarks (`remarks`), instructions (`decode`), functions and what they call (`functions`, `graph`), then
//! `sizes`, `stack` and `proofs`; `outline` is what can be told of any processor's image.
//! `docs/evidence/verification.md` of Remora tells how bounds are made.
#![forbid(unsafe_code)]

mod decode;
mod elf;
mod error;
mod functions;
mod graph;
mod names;
mod outline;
mod proofs;
mod remarks;
mod sizes;
mod stack;
#[cfg(test)]
mod tests;

pub use elf::{Kind, Machine};
pub use error::ImageError;
pub use names::Origin;
pub use outline::Outline;
pub use proofs::{Proof, Proofs, Verdict};
pub use sizes::{Named, Share, Sizes};
pub use stack::{
    Dispatch, EntryPoint, Frame, IndirectCalls, NotCovered, StackBound, Subject, TraitObject,
};

use elf::Elf;
use functions::Program;
use stack::Calls;
use std::path::Path;

/// An image with its functions and what they call.
pub struct Image {
    subject: Subject,
    elf: Elf,
    program: Program,
    /// The calls, with those through pointers resolved one way and, where that makes circles, the
    /// other.
    calls: (Calls, Option<Calls>),
}

/// How many calls the linker relocated, and how many of them were found in the code, at the same
/// place and with the same target: all, or the code was read wrongly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Witness {
    /// Relocations of calls, and of jumps between sections.
    pub relocated: usize,
    /// Those among the calls and jumps that were decoded.
    pub found: usize,
}

impl Image {
    /// Reads an image of `subject`, and the output of the compiler that made it.
    ///
    /// # Errors
    /// A file that cannot be read; an image that is no ELF file of a known processor, or without
    /// symbols or relocations; an output without remarks, or with those of another image.
    pub fn read(elf: &Path, remarks: &Path, subject: &Subject) -> Result<Self, ImageError> {
        let frames = remarks::read(remarks)?;
        let image = Elf::read(elf)?;
        let program = Program::new(&image, &frames);
        let known = program.functions.iter().filter(|f| f.frame.is_some()).count();
        if 2 * known < program.functions.len() {
            let reason = format!(
                "has figures for {known} of the {} functions of {}: it is of another build",
                program.functions.len(),
                elf.display()
            );
            return Err(ImageError::new(remarks, reason));
        }
        let by = |dispatch| Calls::new(&image, &program, subject, dispatch);
        let calls = match image.is_hosted {
            true => (by(Dispatch::OwnTraits), None),
            false => (by(Dispatch::AnyTaken), Some(by(Dispatch::OwnTraits))),
        };
        Ok(Self { subject: *subject, elf: image, program, calls })
    }

    /// Its processor.
    pub fn machine(&self) -> Machine {
        self.elf.machine
    }

    /// Whether it was linked for an operating system.
    pub fn is_hosted(&self) -> bool {
        self.elf.is_hosted
    }

    /// Bounds the stack below an entry point.
    ///
    /// A call through a pointer may at first reach anything that a pointer can. Where that makes a
    /// circle, or in an image for an operating system, those of the program's crates are narrowed to its traits.
    pub fn stack(&self, entry: &EntryPoint) -> StackBound {
        self.stack_without(entry, &[])
    }

    /// Bounds the stack as if functions of these paths, without generic arguments, were never called.
    /// The figure explains a measured mark of a run without them. It bounds nothing.
    pub fn stack_without(&self, entry: &EntryPoint, functions: &[&str]) -> StackBound {
        let by = |calls: &Calls| calls.bound(&self.program, entry, functions);
        let first = by(&self.calls.0);
        let narrow = self.calls.1.as_ref().map(by);
        let narrow_bytes = narrow.as_ref().unwrap_or(&first).bytes;
        let bound = match narrow {
            Some(narrow) if !first.not_covered.cycles.is_empty() => narrow,
            _ => first,
        };
        StackBound { narrow_bytes, ..bound }
    }

    /// The bounds of the subject's entry points, in their order.
    pub fn stacks(&self) -> Vec<StackBound> {
        self.subject.entry_points.iter().map(|entry| self.stack(entry)).collect()
    }

    /// Parts of the stack that no bound covers, whatever the entry point.
    pub fn limits(&self) -> Vec<&'static str> {
        stack::limits(self.elf.machine)
    }

    /// Holds the calls found in the code against those that the linker relocated.
    pub fn witness(&self) -> Witness {
        // Addends on x86-64 count from the instruction's end. Targets in shared libraries have no section
        // here.
        let ahead = if self.elf.machine == Machine::X86_64 { 4 } else { 0 };
        let target = |r: &elf::Relocation| r.target.wrapping_add(ahead);
        let found = |at: u64, to: u64| self.program.branches.binary_search(&(at, to)).is_ok();
        // Relocations stand at the first of two instructions, on x86-64 inside of one.
        let is_found = |r: &&elf::Relocation| match self.elf.machine {
            Machine::RiscV64 => found(r.at, target(r)) || found(r.at.wrapping_add(4), target(r)),
            Machine::X86_64 => [1, 2].iter().any(|into| found(r.at.wrapping_sub(*into), target(r))),
            _ => found(r.at, target(r)),
        };
        let all = self.elf.relocations.iter().filter(|r| r.used == elf::Use::Branch);
        let relocated = all.filter(|r| self.elf.section_at(target(r)).is_some());
        Witness { relocated: relocated.clone().count(), found: relocated.filter(is_found).count() }
    }

    /// Sizes of its code and data by owner.
    pub fn sizes(&self) -> Sizes {
        sizes::of(&self.elf, &self.program, self.subject.models)
    }

    /// Proofs from its symbols.
    pub fn proofs(&self) -> Proofs {
        let symbols = self.elf.symbols.iter().filter(|s| s.kind != elf::SymbolKind::Other);
        let names = symbols.map(|symbol| symbol.name.as_str()).collect();
        proofs::of(names, self.elf.is_hosted, &self.subject)
    }
}
