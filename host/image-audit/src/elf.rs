//! Contents read from a linked ELF file: sections in memory, symbols, relocations.

use crate::error::ImageError;
use object::elf::{
    EM_AARCH64, EM_ARM, EM_RISCV, EM_X86_64, SHF_ALLOC, SHF_EXECINSTR, SHF_TLS, SHF_WRITE,
};
use object::elf::{SHT_NOBITS, STT_FUNC, STT_NOTYPE, STT_OBJECT, STT_SECTION};
use object::read::elf::{ElfFile, ElfFile32, ElfFile64, FileHeader};
use object::{Endianness, FileKind, Object, ObjectSection, ObjectSymbol, ObjectSymbolTable};
use object::{RelocationFlags, RelocationTarget, SectionFlags, SymbolFlags};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The processors whose code is understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Machine {
    /// Thumb-2 of a Cortex-M.
    Arm,
    /// AArch64.
    AArch64,
    /// RISC-V of 64 bits.
    RiscV64,
    /// x86-64.
    X86_64,
}

impl Machine {
    /// Bytes of a pointer.
    pub fn pointer_bytes(self) -> usize {
        if self == Self::Arm { 4 } else { 8 }
    }

    /// Bytes that a call puts on the stack itself, which the compiler's figures do not hold.
    pub fn call_bytes(self) -> u64 {
        if self == Self::X86_64 { 8 } else { 0 }
    }

    /// Bytes below the stack pointer that a function which calls nothing may use; the compiler's
    /// figures leave them out, and the last function of a chain alone has them.
    pub fn red_zone_bytes(self) -> u64 {
        if self == Self::X86_64 { 128 } else { 0 }
    }

    /// The address that a pointer to code means.
    pub fn code_address(self, pointer: u64) -> u64 {
        if self == Self::Arm { pointer & !1 } else { pointer }
    }
}

/// Content of a section in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Machine code, with the constants between.
    Code,
    /// Data that nothing writes.
    ReadOnly,
    /// Data that the image brings along.
    Data,
    /// Memory that is zero at the start or left alone.
    Zero,
}

/// A section that lies in memory.
#[derive(Clone, Debug)]
pub struct Section {
    /// Its name.
    pub name: String,
    /// Its content.
    pub kind: Kind,
    /// Where it begins.
    pub address: u64,
    /// How long it is; longer than `bytes` where the file holds none of it.
    pub size: u64,
    /// Its contents.
    pub bytes: Vec<u8>,
    /// Its index in the file.
    index: usize,
}

impl Section {
    /// The section's end.
    pub fn end(&self) -> u64 {
        self.address + self.size
    }

    /// Contents from `from` to `to`, as far as the file holds them.
    pub fn slice(&self, from: u64, to: u64) -> &[u8] {
        let at =
            |address: u64| (address.saturating_sub(self.address) as usize).min(self.bytes.len());
        &self.bytes[at(from)..at(to).max(at(from))]
    }
}

/// Kind of a symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SymbolKind {
    /// A function, by its type.
    Function,
    /// An object, by its type.
    Object,
    /// A label of no type.
    Label,
    /// Anything else.
    Other,
}

/// A symbol with an address in a section.
#[derive(Clone, Debug)]
pub struct Symbol {
    /// Its name, mangled.
    pub name: String,
    /// Its kind.
    pub kind: SymbolKind,
    /// Where it points; of code without the bit that tells Thumb.
    pub address: u64,
    /// Its size, zero where unknown.
    pub size: u64,
    /// Its section, by its place among [`Elf::sections`].
    pub section: usize,
}

/// Use of a relocation's target at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// An instruction calls the target, or jumps there.
    Branch,
    /// Something holds the target's address, or forms it.
    Address,
}

/// A relocation, resolved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Relocation {
    /// Its place.
    pub at: u64,
    /// Address of the target.
    pub target: u64,
    /// Its use.
    pub used: Use,
}

/// An ELF file.
#[derive(Clone, Debug)]
pub struct Elf {
    /// Its processor.
    pub machine: Machine,
    /// Whether it was linked for an operating system.
    pub is_hosted: bool,
    /// Where it starts.
    pub entry: u64,
    /// Sections in memory, in the order of the file.
    pub sections: Vec<Section>,
    /// Their symbols.
    pub symbols: Vec<Symbol>,
    /// Relocations of these sections, by address.
    pub relocations: Vec<Relocation>,
}

impl Elf {
    /// Reads an image.
    ///
    /// # Errors
    /// A file that cannot be read, is no ELF file of a known processor, or has no symbols or no
    /// relocations.
    pub fn read(file: &Path) -> Result<Self, ImageError> {
        let bytes = std::fs::read(file).map_err(|e| ImageError::io(file, &e))?;
        Self::parse(&bytes).map_err(|reason| ImageError::new(file, reason))
    }

    fn parse(bytes: &[u8]) -> Result<Self, String> {
        let elf = match FileKind::parse(bytes) {
            Ok(FileKind::Elf32) => of(&ElfFile32::<Endianness>::parse(bytes).map_err(broken)?)?,
            Ok(FileKind::Elf64) => of(&ElfFile64::<Endianness>::parse(bytes).map_err(broken)?)?,
            _ => return Err("is no ELF file".into()),
        };
        if !elf.symbols.iter().any(|symbol| symbol.kind == SymbolKind::Function) {
            return Err("has no symbols: it was stripped".into());
        }
        if elf.relocations.is_empty() {
            return Err("has no relocations: link with -C link-arg=--emit-relocs".into());
        }
        Ok(elf)
    }

    /// The section that an address lies in.
    pub fn section_at(&self, address: u64) -> Option<&Section> {
        self.sections.iter().find(|s| (s.address..s.end()).contains(&address))
    }
}

/// Whether a section is a table for unwinders.
pub fn is_unwinding(name: &str) -> bool {
    [".ARM.ex", ".eh_frame", ".gcc_except"].iter().any(|prefix| name.starts_with(prefix))
}

/// The reason of a file that is not what it says it is.
pub fn broken(cause: object::Error) -> String {
    format!("is no sound ELF file: {cause}")
}

fn of<H: FileHeader<Endian = Endianness>>(file: &ElfFile<'_, H>) -> Result<Elf, String> {
    let machine = match (file.elf_header().e_machine(file.endian()), file.endian(), file.is_64()) {
        (EM_ARM, Endianness::Little, false) => Machine::Arm,
        (EM_AARCH64, Endianness::Little, true) => Machine::AArch64,
        (EM_RISCV, Endianness::Little, true) => Machine::RiscV64,
        (EM_X86_64, Endianness::Little, true) => Machine::X86_64,
        _ => return Err("is for a processor whose code is not understood here".into()),
    };
    let sections = sections(file).map_err(broken)?;
    // Addresses are added up from here on: none comes near the end of 64 bits.
    let end = |s: &Section| s.address.checked_add(s.size).filter(|end| *end < u64::MAX / 2);
    if sections.iter().any(|s| end(s).is_none()) {
        return Err("is no sound ELF file: a section ends beyond all memory".into());
    }
    let mut ranges: Vec<_> = sections.iter().map(|s| (s.address, s.end())).collect();
    ranges.sort_unstable();
    if ranges.windows(2).any(|pair| pair[0].1 > pair[1].0) {
        return Err("is no sound ELF file: two sections share memory".into());
    }
    let symbols = symbols(file, machine, &sections).map_err(broken)?;
    let relocations = relocations(file, machine, &sections);
    let is_hosted = file.section_by_name(".interp").is_some();
    let entry = machine.code_address(file.entry());
    Ok(Elf { machine, is_hosted, entry, sections, symbols, relocations })
}

/// The sections of a file that lie in memory.
pub fn sections<H: FileHeader<Endian = Endianness>>(
    file: &ElfFile<'_, H>,
) -> object::Result<Vec<Section>> {
    let mut sections = Vec::new();
    for section in file.sections() {
        let SectionFlags::Elf { sh_type, sh_flags } = section.flags() else { continue };
        let has = |flag: object::elf::SectionFlags| sh_flags.0 & flag.0 != 0;
        // Zeros of a thread have no place in the image: other sections use their addresses too.
        let is_threads = has(SHF_TLS) && sh_type == SHT_NOBITS;
        if !has(SHF_ALLOC) || section.size() == 0 || is_threads {
            continue;
        }
        let kind = match sh_type {
            _ if has(SHF_EXECINSTR) => Kind::Code,
            SHT_NOBITS => Kind::Zero,
            _ if has(SHF_WRITE) => Kind::Data,
            _ => Kind::ReadOnly,
        };
        sections.push(Section {
            name: section.name()?.into(),
            kind,
            address: section.address(),
            size: section.size(),
            bytes: section.data()?.into(),
            index: section.index().0,
        });
    }
    Ok(sections)
}

/// Kind of a symbol by its flags.
pub fn symbol_kind(flags: SymbolFlags<object::SectionIndex, object::SymbolIndex>) -> SymbolKind {
    let SymbolFlags::Elf { st_info, .. } = flags else { return SymbolKind::Other };
    match st_info.st_type() {
        STT_FUNC => SymbolKind::Function,
        STT_OBJECT => SymbolKind::Object,
        STT_NOTYPE => SymbolKind::Label,
        _ => SymbolKind::Other,
    }
}

fn symbols<H: FileHeader<Endian = Endianness>>(
    file: &ElfFile<'_, H>,
    machine: Machine,
    sections: &[Section],
) -> object::Result<Vec<Symbol>> {
    let mut symbols = Vec::new();
    for symbol in file.symbols() {
        let index = symbol.section_index().map(|index| index.0);
        let Some(section) = sections.iter().position(|s| Some(s.index) == index) else { continue };
        let kind = symbol_kind(symbol.flags());
        let is_code = kind == SymbolKind::Function;
        let address = symbol.address();
        symbols.push(Symbol {
            name: symbol.name()?.into(),
            kind,
            address: if is_code { machine.code_address(address) } else { address },
            size: symbol.size(),
            section,
        });
    }
    Ok(symbols)
}

fn relocations<H: FileHeader<Endian = Endianness>>(
    file: &ElfFile<'_, H>,
    machine: Machine,
    sections: &[Section],
) -> Vec<Relocation> {
    let mut relocations = Vec::new();
    let Some(table) = file.symbol_table() else { return relocations };
    let within = |address: u64| sections.iter().find(|s| (s.address..s.end()).contains(&address));
    for section in
        file.sections().filter(|s| sections.iter().any(|known| known.index == s.index().0))
    {
        // Unwinding tables name functions to describe them; nothing calls through them.
        if is_unwinding(section.name().unwrap_or_default()) {
            continue;
        }
        for (at, relocation) in section.relocations() {
            let RelocationFlags::Elf { r_type } = relocation.flags() else { continue };
            let is_code = within(at).is_some_and(|s| s.kind == Kind::Code);
            let Some(used) = meaning(machine, is_code, r_type.0) else { continue };
            let RelocationTarget::Symbol(index) = relocation.target() else { continue };
            let Ok(symbol) = table.symbol_by_index(index) else { continue };
            let SymbolFlags::Elf { st_info, .. } = symbol.flags() else { continue };
            // Without an addend of its own the place holds the whole address; the instructions
            // that do so are only ever about named symbols.
            let target = match (relocation.has_implicit_addend(), st_info.st_type()) {
                (true, STT_SECTION) => {
                    let bytes =
                        within(at).map(|s| s.slice(at, at.saturating_add(4))).unwrap_or_default();
                    let Ok(word) = bytes.try_into() else { continue };
                    u64::from(u32::from_le_bytes(word))
                }
                (true, _) => symbol.address(),
                (false, _) => symbol.address().wrapping_add_signed(relocation.addend()),
            };
            let is_code = within(target).is_some_and(|s| s.kind == Kind::Code);
            let target = if is_code { machine.code_address(target) } else { target };
            relocations.push(Relocation { at, target, used });
        }
    }
    // A position-independent image says only at its start where its pointers point.
    for (at, relocation) in file.dynamic_relocations().into_iter().flatten() {
        if relocation.target() == RelocationTarget::Absolute {
            let target = relocation.addend() as u64;
            relocations.push(Relocation { at, target, used: Use::Address });
        }
    }
    relocations.sort_by_key(|r| (r.at, r.target));
    relocations
}

/// Maps a relocation's type to its use; `None` where it concerns no address.
fn meaning(machine: Machine, is_code: bool, kind: u32) -> Option<Use> {
    let (branches, silent): (&[u32], &[u32]) = match machine {
        // PC24, THM_CALL, CALL, JUMP24, THM_JUMP24, THM_JUMP19, THM_JUMP11, THM_JUMP8;
        // NONE, V4BX, PREL31
        Machine::Arm => (&[1, 10, 28, 29, 30, 51, 102, 103], &[0, 40, 42]),
        // TSTBR14, CONDBR19, JUMP26, CALL26; NONE
        Machine::AArch64 => (&[279, 280, 282, 283], &[0, 256]),
        // BRANCH, JAL, CALL, CALL_PLT, RVC_BRANCH, RVC_JUMP; NONE, PCREL_LO12_I and _S, which name
        // the instruction of the upper half instead of the target, RELAX, ALIGN
        Machine::RiscV64 => (&[16, 17, 18, 19, 44, 45], &[0, 24, 25, 43, 51]),
        // PLT32; NONE, and in code what is relative to the place: PC32, GOTPCREL, GOTPCRELX,
        // REX_GOTPCRELX. Its addend depends on the instruction, which tells the address itself.
        Machine::X86_64 if is_code => (&[4], &[0, 2, 9, 41, 42]),
        Machine::X86_64 => (&[4], &[0]),
    };
    match kind {
        _ if silent.contains(&kind) => None,
        _ if branches.contains(&kind) => Some(Use::Branch),
        _ => Some(Use::Address),
    }
}
