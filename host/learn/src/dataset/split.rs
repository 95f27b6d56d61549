//! Split of a dataset: trajectories are held out while a network is trained.

/// A part of a dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// To learn from.
    Train,
    /// Held out, to see what was learnt.
    Validation,
}

/// One scenario in so many is held out.
const VALIDATION: u64 = 50;

impl Split {
    /// The part that a scenario belongs to: a fixed function of its seed and index, so that a
    /// smaller set of the same seed is split alike.
    pub fn of(seed: u64, index: u64) -> Self {
        match mixed(mixed(seed).wrapping_add(index)).is_multiple_of(VALIDATION) {
            true => Self::Validation,
            false => Self::Train,
        }
    }
}

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014): each bit depends on all.
fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held_out(seed: u64, count: u64) -> Vec<u64> {
        (0..count).filter(|i| Split::of(seed, *i) == Split::Validation).collect()
    }

    #[test]
    fn the_hash_is_the_published_one() {
        // First output of SplitMix64 from state 0.
        assert_eq!(mixed(0), 0xe220_a839_7b1d_cdaf);
    }

    /// Found by another implementation: models were trained with this split.
    #[test]
    fn the_split_never_changes() {
        assert_eq!(held_out(1000, 300), [76, 201, 213, 246, 263, 269]);
    }

    #[test]
    fn one_in_fifty_is_held_out_and_never_another() {
        let count = held_out(1000, 90_000).len();
        // Mean 1800, standard deviation 42.
        assert!((1650..1950).contains(&count), "{count}");
        let even = held_out(1000, 90_000).iter().filter(|i| i.is_multiple_of(2)).count();
        assert!((750..1050).contains(&even), "{even}");
        assert_ne!(held_out(1000, 1000), held_out(2000, 1000));
    }
}
