//! Scenarios that a model was trained on, in the words of its provenance.

use std::fmt;
use std::str::FromStr;

/// The first `count` scenarios of a seed: `s1000:90000`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Source {
    /// Seed of the draw.
    pub seed: u64,
    /// Scenarios `0..count`.
    pub count: u64,
}

impl Source {
    /// Several of them, joined with `+`, as a model's provenance holds them.
    pub fn join(sources: &[Self]) -> String {
        sources.iter().map(Self::to_string).collect::<Vec<_>>().join("+")
    }

    /// Union of the scenarios in the texts of two models: the larger count of each seed. A text that
    /// names no scenarios, such as `synthetic`, is kept as it is.
    pub fn union(own: &str, other: &str) -> String {
        let (Ok(mut all), Ok(others)) = (Self::parse_all(own), Self::parse_all(other)) else {
            return if own == other { own.into() } else { format!("{own}+{other}") };
        };
        for source in others {
            match all.iter_mut().find(|known| known.seed == source.seed) {
                Some(known) => known.count = known.count.max(source.count),
                None => all.push(source),
            }
        }
        Self::join(&all)
    }

    /// Parses a text that [`Source::join`] wrote.
    ///
    /// # Errors
    /// Where it is something else; with the reason.
    pub fn parse_all(text: &str) -> Result<Vec<Self>, String> {
        text.split('+').map(str::parse).collect()
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "s{}:{}", self.seed, self.count)
    }
}

impl FromStr for Source {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (seed, count) = text.strip_prefix('s')?.split_once(':')?;
            Some(Self { seed: seed.parse().ok()?, count: count.parse().ok()? })
        };
        parse().ok_or_else(|| format!("{text:?} is not of the form sSEED:COUNT"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_survive_a_round_trip() {
        let sources = [Source { seed: 1000, count: 90_000 }, Source { seed: 2000, count: 12_000 }];
        assert_eq!(Source::join(&sources), "s1000:90000+s2000:12000");
        assert_eq!(Source::parse_all("s1000:90000+s2000:12000").unwrap(), sources);
        let union = Source::union("s2000:12000+s3000:5", "s3000:9+s1000:90000");
        assert_eq!(union, "s2000:12000+s3000:9+s1000:90000");
        assert_eq!(Source::union("synthetic", "synthetic"), "synthetic");
        assert_eq!(Source::union("s1:2", "synthetic"), "s1:2+synthetic");
        for text in ["", "s1000", "1000:5", "s:5", "s1:", "s1:5+", "s-1:5", "synthetic"] {
            assert!(Source::parse_all(text).is_err(), "{text}");
        }
    }
}
