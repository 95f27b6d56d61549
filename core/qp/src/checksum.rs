//! A checksum over exact bits.

/// FNV-1a, 64 bits: no table, one multiplication a byte. It tells whether two records hold the
/// same bits; it does not protect against someone who wants them to seem so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Checksum(u64);

impl Checksum {
    const PRIME: u64 = 0x0000_0100_0000_01b3;

    /// Of nothing yet.
    pub const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds bytes in order.
    // One copy in an image: unrolled into records of hundreds of numbers it would be a twentieth of it.
    #[inline(never)]
    pub fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(Self::PRIME);
        }
    }

    /// Adds an integer, least byte first.
    // One copy of it makes images smaller, as above.
    #[inline(never)]
    pub fn integer(&mut self, value: u64) {
        self.bytes(&value.to_le_bytes());
    }

    /// Adds numbers by their bits: zeros of either sign differ, and so do NaNs.
    pub fn numbers<'a>(&mut self, values: impl IntoIterator<Item = &'a f64>) {
        for value in values {
            self.integer(value.to_bits());
        }
    }

    /// The checksum of all that was added.
    pub const fn value(&self) -> u64 {
        self.0
    }
}

impl Default for Checksum {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(bytes: &[u8]) -> u64 {
        let mut checksum = Checksum::new();
        checksum.bytes(bytes);
        checksum.value()
    }

    /// From the test suite of the algorithm's authors (draft-eastlake-fnv).
    #[test]
    fn published_vectors() {
        assert_eq!(of(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(of(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(of(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn numbers_count_by_their_bits() {
        let of = |values: &[f64]| {
            let mut checksum = Checksum::new();
            checksum.numbers(values);
            checksum.value()
        };
        assert_eq!(of(&[1.0, 2.0]), of(&[1.0, 2.0]));
        assert_ne!(of(&[1.0, 2.0]), of(&[2.0, 1.0]));
        assert_ne!(of(&[0.0]), of(&[-0.0]));
        assert_ne!(of(&[f64::NAN]), of(&[-f64::NAN]));
        let mut one = Checksum::new();
        one.integer(1.0f64.to_bits());
        assert_eq!(one.value(), of(&[1.0]));
    }

    /// Sums by hand: `(basis ^ byte) * prime`, wrapped to 64 bits.
    #[test]
    fn integers_come_least_byte_first() {
        let of_integer = |value: u64| {
            let mut checksum = Checksum::default();
            checksum.integer(value);
            checksum.value()
        };
        assert_eq!(of_integer(0x0102), of(&[2, 1, 0, 0, 0, 0, 0, 0]));
        assert_eq!(of_integer(u64::MAX), of(&[255; 8]));
        assert_eq!(Checksum::default(), Checksum::new());
        assert_eq!(of(&[0x25]), 0xcbf2_9ce4_8422_2300u64.wrapping_mul(0x0000_0100_0000_01b3));
        // Bytes in pieces are bytes in order.
        let mut pieces = Checksum::new();
        pieces.bytes(b"foo");
        pieces.bytes(b"bar");
        assert_eq!(pieces.value(), of(b"foobar"));
    }
}
