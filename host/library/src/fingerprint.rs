//! Fingerprints: whether work that resumes is the work that was begun.

use std::fmt::Write;

/// FNV-1a, 64 bits, over what `Debug` prints: the shortest digits that tell a number from all
/// others, so that two values agree where all their bits do. Against mistakes, not against malice.
pub fn fingerprint(value: &impl std::fmt::Debug) -> String {
    let mut hash = Fnv::default();
    // Writing into a hash cannot fail.
    let _ = write!(hash, "{value:?}");
    hash.to_string()
}

/// Fingerprint of the running program itself: rows of one table come from one build.
pub fn program() -> String {
    let bytes = std::env::current_exe().and_then(std::fs::read);
    bytes.map_or_else(
        |_| "unknown".into(),
        |bytes| {
            let mut hash = Fnv::default();
            hash.add(&bytes);
            hash.to_string()
        },
    )
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
    fn one_bit_makes_another_fingerprint() {
        // FNV-1a of `1` is a published value.
        assert_eq!(fingerprint(&1), "af63ac4c86019afc");
        assert_eq!(fingerprint(&[0.1, 0.2]), fingerprint(&[0.1, 0.2]));
        let next = f64::from_bits(0.2f64.to_bits() + 1);
        assert_ne!(fingerprint(&[0.1, 0.2]), fingerprint(&[0.1, next]));
    }
}
