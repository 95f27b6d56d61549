//! Fingerprints: whether work that resumes is the work that was begun.

use std::fmt::Write;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::sync::OnceLock;

/// FNV-1a, 64 bits, over what `Debug` prints: the shortest digits that tell a number from all
/// others, so that two values agree where all their bits do. Against mistakes, not against malice.
pub fn fingerprint(value: &impl std::fmt::Debug) -> String {
    let mut hash = Fnv::default();
    // Writing into a hash cannot fail.
    let _ = write!(hash, "{value:?}");
    hash.to_string()
}

/// Fingerprint of the running program itself: rows of one table come from one build.
///
/// It is the file's checksum and length. A copy on another machine has the same fingerprint, which time
/// stamps would not give. The processor has instructions for the checksum, and a process reads its file once.
pub fn program() -> String {
    static PROGRAM: OnceLock<String> = OnceLock::new();
    PROGRAM.get_or_init(|| of_file().unwrap_or_else(|_| "unknown".into())).clone()
}

/// Bytes of the program that are read at once.
const BLOCK: usize = 1 << 18;

fn of_file() -> std::io::Result<String> {
    let mut file = File::open(std::env::current_exe()?)?;
    let (mut checksum, mut length) = (crc32fast::Hasher::new(), 0);
    let mut block = vec![0; BLOCK];
    loop {
        match file.read(&mut block) {
            Ok(0) => break Ok(format!("{:08x}{length:08x}", checksum.finalize())),
            Ok(read) => {
                checksum.update(&block[..read]);
                length += read;
            }
            Err(cause) if cause.kind() == ErrorKind::Interrupted => {}
            Err(cause) => break Err(cause),
        }
    }
}

const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;

/// FNV-1a over bytes as they come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(OFFSET)
    }
}

impl std::fmt::Display for Fnv {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl Fnv {
    /// Adds bytes.
    pub fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

impl Write for Fnv {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.add(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_is_its_files_checksum_and_length() {
        let bytes = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        let (checksum, length) = (crc32fast::hash(&bytes), bytes.len());
        assert_eq!(program(), format!("{checksum:08x}{length:08x}"));
        assert_eq!(program(), program());
    }

    #[test]
    fn one_bit_makes_another_fingerprint() {
        // FNV-1a of `1` is a published value.
        assert_eq!(fingerprint(&1), "af63ac4c86019afc");
        assert_eq!(fingerprint(&[0.1, 0.2]), fingerprint(&[0.1, 0.2]));
        let next = f64::from_bits(0.2f64.to_bits() + 1);
        assert_ne!(fingerprint(&[0.1, 0.2]), fingerprint(&[0.1, next]));
    }
}
