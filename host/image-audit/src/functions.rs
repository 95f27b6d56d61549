//! The functions of an image, each with its frame and what it calls.

use super::decode::{Decoded, Flow, decode};
use super::elf::{Elf, Kind, Machine, Section, SymbolKind, Use, is_unwinding};
use super::names;
use super::remarks::Frames;
use std::collections::{BTreeMap, BTreeSet};

/// A piece of code with a name.
#[derive(Clone, Debug)]
pub struct Function {
    /// Where it begins.
    pub address: u64,
    /// Where it ends.
    pub end: u64,
    /// All its mangled names: equal functions may have been merged.
    pub symbols: Vec<String>,
    /// Readable name, with generic arguments.
    pub path: String,
    /// The compiler's figure of its stack, with what an unusual alignment may add; `None` where
    /// the compiler said nothing, as of assembly.
    pub frame: Option<u64>,
    /// Its calls.
    pub calls: Calls,
}

/// Calls of a function, direct and otherwise.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Calls {
    /// Functions it calls or jumps into, by their place in the list.
    pub direct: BTreeSet<usize>,
    /// Places that call through a pointer.
    pub indirect: Vec<u64>,
    /// How many places call a shared library.
    pub external: usize,
    /// Places that lead to where no function is known.
    pub astray: Vec<u64>,
}

impl Function {
    /// Readable name without generic arguments.
    pub fn plain(&self) -> String {
        names::plain(&self.path)
    }
}

/// All functions in the order of their addresses, and those whose address is taken.
pub struct Program {
    /// The functions.
    pub functions: Vec<Function>,
    /// Functions whose address something holds, with those places. Indirect calls may reach them.
    pub taken: BTreeMap<usize, BTreeSet<u64>>,
    /// Direct calls and jumps out of functions, sorted: place and target.
    pub branches: Vec<(u64, u64)>,
    /// Addresses that code forms relative to itself (x86-64): place of the function, address.
    pub formed: Vec<(u64, u64)>,
}

impl Program {
    /// Finds the functions and follows their code.
    pub fn new(elf: &Elf, frames: &Frames) -> Self {
        let mut functions = functions(elf, frames);
        let mut decoded = Vec::new();
        for function in &functions {
            decoded.push(read_code(elf, function));
        }
        let mut program = Self {
            taken: BTreeMap::new(),
            branches: Vec::new(),
            formed: Vec::new(),
            functions: Vec::new(),
        };
        for (i, code) in decoded.iter().enumerate() {
            let calls = program.calls(elf, &functions, i, code);
            functions[i].calls = calls;
            let frame = functions[i].frame;
            functions[i].frame = frame.map(|bytes| bytes + code.realignment);
            let at = functions[i].address;
            program.formed.extend(code.references.iter().map(|to| (at, *to)));
        }
        program.branches.sort_unstable();
        program.functions = functions;
        program.taken = taken(elf, &program);
        program
    }

    /// The function that an address lies in.
    pub fn at(&self, address: u64) -> Option<usize> {
        at(&self.functions, address)
    }

    fn calls(&mut self, elf: &Elf, functions: &[Function], i: usize, code: &Decoded) -> Calls {
        let own = functions[i].address..functions[i].end;
        let mut calls = Calls::default();
        if is_patch(&functions[i].symbols) {
            return calls;
        }
        for transfer in &code.transfers {
            match transfer.flow {
                Flow::Jump(to) if own.contains(&to) => {}
                Flow::Call(to) | Flow::Jump(to) => {
                    self.branches.push((transfer.at, to));
                    match at(functions, to) {
                        Some(callee) => drop(calls.direct.insert(callee)),
                        None if elf.section_at(to).is_some_and(|s| s.name.starts_with(".plt")) => {
                            calls.external += 1;
                        }
                        None => calls.astray.push(transfer.at),
                    }
                }
                Flow::Through(slot) => match resolved(elf, slot).and_then(|to| at(functions, to)) {
                    Some(callee) => drop(calls.direct.insert(callee)),
                    // The dynamic linker fills it.
                    None => calls.external += 1,
                },
                Flow::IndirectCall => calls.indirect.push(transfer.at),
                Flow::IndirectJump if has_table(elf, &own) => {}
                Flow::IndirectJump => calls.indirect.push(transfer.at),
                Flow::TableJump => {}
            }
        }
        // Its address may be taken out of the table once and called from a register.
        let is_library = |slot: &&u64| {
            elf.section_at(**slot).is_some_and(|s| s.name.starts_with(".got"))
                && resolved(elf, **slot).is_none()
        };
        calls.external += code.references.iter().filter(is_library).count();
        calls.astray.extend(&code.invalid);
        calls
    }
}

/// Value of a pointer at a fixed address: by its relocation, otherwise by the bytes there.
/// Pointers of the dynamic linker are blank until it has run.
fn resolved(elf: &Elf, slot: u64) -> Option<u64> {
    let i = elf.relocations.partition_point(|r| r.at < slot);
    let told = elf.relocations.get(i).filter(|r| r.at == slot && r.used == Use::Address);
    told.map(|r| r.target).or_else(|| {
        let bytes = elf.section_at(slot)?.slice(slot, slot + 8);
        Some(u64::from_le_bytes(bytes.try_into().ok()?)).filter(|word| *word != 0)
    })
}

/// Whether data holds addresses inside a function, behind its first: a table of jumps. A jump
/// through a pointer is then taken for one through this table.
fn has_table(elf: &Elf, own: &std::ops::Range<u64>) -> bool {
    let inside = |address: u64| address > own.start && address < own.end;
    elf.relocations.iter().any(|r| {
        r.used == Use::Address
            && inside(r.target)
            && elf.section_at(r.at).is_some_and(|section| section.kind != Kind::Code)
    })
}

/// Decodes a function, without the data between its code.
fn read_code(elf: &Elf, function: &Function) -> Decoded {
    let mut all = Decoded::default();
    let Some(section) = elf.section_at(function.address) else { return all };
    for (from, to) in code_ranges(elf, section, function.address, function.end) {
        let part = decode(elf.machine, section.slice(from, to), from);
        all.transfers.extend(part.transfers);
        all.references.extend(part.references);
        all.invalid.extend(part.invalid);
        all.realignment = all.realignment.max(part.realignment);
    }
    all
}

/// The parts of `from..to` that are code, by the mapping symbols of Arm and RISC-V.
fn code_ranges(elf: &Elf, section: &Section, from: u64, to: u64) -> Vec<(u64, u64)> {
    let mut marks = BTreeMap::new();
    for symbol in elf.symbols.iter().filter(|s| s.address < to && is_mapping(&s.name)) {
        if section.address <= symbol.address {
            marks.insert(symbol.address, !symbol.name.starts_with("$d"));
        }
    }
    let mut ranges = Vec::new();
    // Bytes before the first mark are no code in an image with marks.
    let is_marked = elf.symbols.iter().any(|s| is_mapping(&s.name));
    let mut is_code = marks.range(..=from).next_back().map_or(!is_marked, |(_, code)| *code);
    let mut start = from;
    for (address, code) in marks.range(from + 1..to) {
        if is_code {
            ranges.push((start, *address));
        }
        (start, is_code) = (*address, *code);
    }
    if is_code {
        ranges.push((start, to));
    }
    ranges
}

/// `$x`, `$t.3`, `$d`: where code and data begin.
pub fn is_mapping(name: &str) -> bool {
    let mut bytes = name.bytes();
    bytes.next() == Some(b'$') && matches!(bytes.next(), Some(b'a' | b'd' | b't' | b'x'))
}

fn at(functions: &[Function], address: u64) -> Option<usize> {
    let i = functions.partition_point(|f| f.address <= address).checked_sub(1)?;
    (address < functions[i].end).then_some(i)
}

/// Functions by their symbols: typed ones with their size; labels in code, as assembly has them,
/// up to what follows. Code that none of them covers becomes a function without a name.
fn functions(elf: &Elf, frames: &Frames) -> Vec<Function> {
    let mut functions = Vec::new();
    for (index, section) in elf.sections.iter().enumerate().filter(|(_, s)| s.kind == Kind::Code) {
        let starts = starts(elf, index);
        let mut covered = section.address;
        let mut next = starts.iter().peekable();
        while let Some((address, (size, symbols))) = next.next() {
            let limit = next.peek().map_or(section.end(), |(address, _)| **address);
            functions.extend(unnamed(elf, section, covered, *address));
            let end = match size {
                // Labels without a size end before the padding that aligns the next function.
                0 => address + code_length(elf.machine, section.slice(*address, limit)),
                size => limit.min(address.saturating_add(*size)),
            };
            functions.push(named(*address, end, symbols, frames));
            covered = end;
        }
        functions.extend(unnamed(elf, section, covered, section.end()));
    }
    functions.sort_by_key(|f| f.address);
    functions
}

/// Where functions begin: size and names.
fn starts(elf: &Elf, section: usize) -> BTreeMap<u64, (u64, Vec<String>)> {
    let mut starts: BTreeMap<u64, (u64, Vec<String>)> = BTreeMap::new();
    let range = elf.sections[section].address..elf.sections[section].end();
    let here = || elf.symbols.iter().filter(|s| s.section == section && range.contains(&s.address));
    for symbol in here().filter(|s| s.kind == SymbolKind::Function) {
        let entry = starts.entry(symbol.address).or_default();
        entry.0 = entry.0.max(symbol.size);
        entry.1.push(symbol.name.clone());
    }
    let is_inside = |starts: &BTreeMap<u64, (u64, Vec<String>)>, address: u64| {
        let before = starts.range(..=address).next_back();
        before.is_some_and(|(start, (size, _))| address < start.saturating_add(*size.max(&1)))
    };
    // Labels of the assembler within a function are not functions; those of unsized ones may be.
    for symbol in here().filter(|s| s.kind == SymbolKind::Label && !is_hidden_label(&s.name)) {
        if !is_inside(&starts, symbol.address) {
            starts.insert(symbol.address, (symbol.size, vec![symbol.name.clone()]));
        }
    }
    starts
}

fn is_hidden_label(name: &str) -> bool {
    name.is_empty() || name.starts_with(".L") || is_mapping(name)
}

/// Whether it is the linker's patch for an erratum of the Cortex-A53: one instruction of its caller and a jump
/// back. It calls nothing and uses no stack.
fn is_patch(symbols: &[String]) -> bool {
    symbols.iter().any(|name| name.starts_with("__CortexA53843419_"))
}

fn named(address: u64, end: u64, symbols: &[String], frames: &Frames) -> Function {
    let mut symbols = symbols.to_vec();
    symbols.sort();
    let frame = symbols.iter().filter_map(|name| frames.get(name)).max().copied();
    let frame = frame.or(is_patch(&symbols).then_some(0));
    let path = symbols.iter().find_map(|name| names::readable(name));
    let path = path.unwrap_or_else(|| symbols.first().cloned().unwrap_or_default());
    Function { address, end, symbols, path, frame, calls: Calls::default() }
}

/// Code between functions that is not padding. What the linker makes to call shared libraries is
/// left to where it is called from.
fn unnamed(elf: &Elf, section: &Section, from: u64, to: u64) -> Option<Function> {
    let is_idle = |(a, b): (u64, u64)| is_padding(elf.machine, section.slice(a, b));
    let is_stub = section.name.starts_with(".plt");
    if from >= to || is_stub || code_ranges(elf, section, from, to).into_iter().all(is_idle) {
        return None;
    }
    let path = format!("code without a name at {from:#x}");
    Some(Function {
        address: from,
        end: to,
        symbols: vec![],
        path,
        frame: None,
        calls: Calls::default(),
    })
}

/// Zeros, or what the processor's linkers and assemblers fill gaps with.
pub fn is_padding(machine: Machine, bytes: &[u8]) -> bool {
    if bytes.iter().all(|b| *b == 0) || bytes.iter().all(|b| *b == 0xcc) {
        return true;
    }
    let units: &[&[u8]] = match machine {
        Machine::Arm => &[&[0x00, 0xbf], &[0xd4, 0xd4], &[0xc0, 0x46]],
        Machine::AArch64 => &[&[0x1f, 0x20, 0x03, 0xd5], &[0x00, 0x00, 0x20, 0xd4]],
        Machine::RiscV64 => &[&[0x01, 0x00], &[0x13, 0x00, 0x00, 0x00]],
        // Instructions that do nothing come in many lengths.
        Machine::X86_64 => {
            let mut decoder = iced_x86::Decoder::new(64, bytes, iced_x86::DecoderOptions::NONE);
            return decoder.iter().all(|i| {
                matches!(i.mnemonic(), iced_x86::Mnemonic::Nop | iced_x86::Mnemonic::Int3)
            });
        }
    };
    let mut rest = bytes;
    while !rest.is_empty() {
        let zero = || (rest.len() >= 2 && rest[..2] == [0, 0]).then_some(2);
        let unit = units.iter().find(|unit| rest.starts_with(unit)).map(|unit| unit.len());
        let Some(length) = unit.or_else(zero) else { return false };
        rest = &rest[length..];
    }
    true
}

/// Bytes of code of unknown length without the padding behind it.
fn code_length(machine: Machine, code: &[u8]) -> u64 {
    // An instruction of variable length may end in zeros.
    let blank = match machine {
        Machine::X86_64 => code.iter().rev().take_while(|byte| **byte == 0xcc).count(),
        _ => 4 * code.rchunks_exact(4).take_while(|tail| is_padding(machine, tail)).count(),
    };
    (code.len() - blank) as u64
}

/// Functions whose address something holds, with the places: relocations that are no calls; words
/// in data that are the address of a function, relocation or not; on x86-64 what code forms relative
/// to itself.
fn taken(elf: &Elf, program: &Program) -> BTreeMap<usize, BTreeSet<u64>> {
    let mut taken = BTreeMap::<usize, BTreeSet<u64>>::new();
    let functions = &program.functions;
    let mut take = |place: u64, address: u64| {
        let address = elf.machine.code_address(address);
        let i = functions.partition_point(|f| f.address < address);
        if functions.get(i).is_some_and(|f| f.address == address) && !is_start(elf, program, place)
        {
            taken.entry(i).or_default().insert(place);
        }
    };
    for relocation in elf.relocations.iter().filter(|r| r.used == Use::Address) {
        take(relocation.at, relocation.target);
    }
    program.formed.iter().for_each(|(place, address)| take(*place, *address));
    let size = elf.machine.pointer_bytes();
    for (section, from, to) in elf.sections.iter().flat_map(|s| data(elf, s)) {
        let from = from.next_multiple_of(size as u64);
        for (i, word) in section.slice(from, to).chunks_exact(size).enumerate() {
            let word = word.iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte));
            // Zero is the address of the first byte of some images, and of nothing else.
            if word != 0 {
                take(from + (i * size) as u64, word);
            }
        }
    }
    taken
}

/// Whether a place is part of how a bare-metal image starts, which hands addresses to the processor
/// and to nobody else: the function at its entry, and a table of vectors among its code.
fn is_start(elf: &Elf, program: &Program, place: u64) -> bool {
    let in_code = || elf.section_at(place).is_some_and(|s| s.kind == Kind::Code);
    !elf.is_hosted
        && match program.at(place) {
            Some(i) => program.functions[i].address == elf.entry,
            None => in_code(),
        }
}

/// The pieces of a section that hold data.
fn data<'a>(elf: &Elf, section: &'a Section) -> Vec<(&'a Section, u64, u64)> {
    match section.kind {
        // Unwinding tables describe functions; nothing calls through them.
        _ if is_unwinding(&section.name) => Vec::new(),
        Kind::Code => literals(elf, section),
        Kind::ReadOnly | Kind::Data => vec![(section, section.address, section.end())],
        Kind::Zero => Vec::new(),
    }
}

/// Data between code, by the mapping symbols.
fn literals<'a>(elf: &Elf, section: &'a Section) -> Vec<(&'a Section, u64, u64)> {
    let mut from = section.address;
    let mut literals = Vec::new();
    for (start, end) in code_ranges(elf, section, section.address, section.end()) {
        if from < start {
            literals.push((section, from, start));
        }
        from = end;
    }
    if from < section.end() {
        literals.push((section, from, section.end()));
    }
    literals
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_linkers_patches_use_no_stack() {
        let of = |symbol: &str| named(0, 8, &[symbol.to_string()], &Frames::default()).frame;
        assert_eq!(of("__CortexA53843419_40274004"), Some(0));
        assert_eq!(of("memcpy"), None);
    }
}
