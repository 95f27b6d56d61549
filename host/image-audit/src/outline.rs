//! Outline of a linked ELF file, whatever its processor: sections in memory, symbols, proofs.

use super::elf::{self, SymbolKind, broken};
use super::error::ImageError;
use super::proofs::{self, Proofs};
use super::sizes::Named;
use super::stack::Subject;
use object::read::elf::{ElfFile, ElfFile32, ElfFile64, FileHeader};
use object::{Endianness, FileKind, Object, ObjectSymbol};
use std::path::Path;

/// Sections and symbols of an image, of processors too whose code [`Image`](super::Image) does not
/// understand. Neither relocations nor remarks are needed.
#[derive(Clone, Debug)]
pub struct Outline {
    /// Sections in memory, in the order of the file.
    pub sections: Vec<Named>,
    /// Names, kinds and addresses.
    symbols: Vec<(String, SymbolKind, u64)>,
    is_hosted: bool,
}

impl Outline {
    /// Reads an image.
    ///
    /// # Errors
    /// A file that cannot be read or is no ELF file.
    pub fn read(file: &Path) -> Result<Self, ImageError> {
        let bytes = std::fs::read(file).map_err(|cause| ImageError::io(file, &cause))?;
        Self::parse(&bytes).map_err(|reason| ImageError::new(file, reason))
    }

    fn parse(bytes: &[u8]) -> Result<Self, String> {
        match FileKind::parse(bytes) {
            Ok(FileKind::Elf32) => of(&ElfFile32::<Endianness>::parse(bytes).map_err(broken)?),
            Ok(FileKind::Elf64) => of(&ElfFile64::<Endianness>::parse(bytes).map_err(broken)?),
            _ => Err("is no ELF file".into()),
        }
    }

    /// Address of the symbol of this name, as it stands in the file.
    pub fn address(&self, name: &str) -> Option<u64> {
        self.symbols.iter().find(|(known, ..)| known == name).map(|(.., address)| *address)
    }

    /// Proofs from its symbols.
    pub fn proofs(&self, subject: &Subject) -> Proofs {
        let symbols = self.symbols.iter().filter(|(_, kind, _)| *kind != SymbolKind::Other);
        proofs::of(symbols.map(|(name, ..)| name.as_str()).collect(), self.is_hosted, subject)
    }
}

fn of<H: FileHeader<Endian = Endianness>>(file: &ElfFile<'_, H>) -> Result<Outline, String> {
    let sections = elf::sections(file).map_err(broken)?;
    let sections =
        sections.into_iter().map(|s| Named { name: s.name, kind: s.kind, bytes: s.size });
    let symbols = file.symbols().map(|symbol| {
        let kind = elf::symbol_kind(symbol.flags());
        Ok((symbol.name()?.to_string(), kind, symbol.address()))
    });
    Ok(Outline {
        sections: sections.collect(),
        symbols: symbols.collect::<object::Result<_>>().map_err(broken)?,
        is_hosted: file.section_by_name(".interp").is_some(),
    })
}
