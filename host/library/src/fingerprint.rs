//! Fingerprints: whether work that resumes is the work that was begun.

use std::fmt::Write;
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
/// It is made of the file's bytes, eight at a time, and its length. A copy on another machine has the same
/// fingerprint, which time stamps would not give. A process reads its file once.
pub fn program() -> String {
    static PROGRAM: OnceLock<String> = OnceLock::new();
    let of_file = || std::env::current_exe().and_then(std::fs::read);
    let made = || of_file().map_or_else(|_| "unknown".into(), |bytes| of_words(&bytes).to_string());
    PROGRAM.get_or_init(made).clone()
}

/// FNV-1a over words of eight bytes, then over the bytes that are left and the length.
fn of_words(bytes: &[u8]) -> Fnv {
    let (words, rest) = bytes.as_chunks();
    let step = |hash: u64, word: &[u8; 8]| (hash ^ u64::from_le_bytes(*word)).wrapping_mul(PRIME);
    let mut hash = Fnv(words.iter().fold(OFFSET, step));
    hash.add(rest);
    hash.add(&bytes.len().to_le_bytes());
    hash
}

const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

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
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(PRIME);
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
    fn a_program_is_its_files_bytes_and_length() {
        let mut bytes = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        assert_eq!(program(), of_words(&bytes).to_string());
        for at in [0, bytes.len() / 2, bytes.len() - 1] {
            bytes[at] ^= 0x80;
            assert_ne!(program(), of_words(&bytes).to_string(), "bit of byte {at}");
            bytes[at] ^= 0x80;
        }
        bytes.push(0);
        assert_ne!(program(), of_words(&bytes).to_string());
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
