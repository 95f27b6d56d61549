//! Checksum of numbers by their bits.

/// FNV-1a over 64-bit words. Two not-a-numbers count as equal: which one an operation makes is
/// the processor's choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Checksum(u64);

impl Checksum {
    /// Of nothing.
    pub const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds numbers in order.
    pub fn add(&mut self, values: &[f64]) {
        for value in values {
            let bits = if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() };
            self.0 = (self.0 ^ bits).wrapping_mul(0x0000_0100_0000_01b3);
            // A word at a time leaves the low bits of the product to the low bits of the words:
            // fold the high ones in.
            self.0 ^= self.0 >> 32;
        }
    }

    /// The checksum so far.
    pub fn value(self) -> u64 {
        self.0
    }
}

impl Default for Checksum {
    fn default() -> Self {
        Self::new()
    }
}
