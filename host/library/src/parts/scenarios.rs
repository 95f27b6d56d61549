//! Where the scenarios of a campaign in parts come from.

use crate::draw::{draw_one, id};
use crate::error::Error;
use crate::fingerprint::fingerprint;
use crate::formats::{Mission, NamedScenario};
use std::borrow::Cow;

/// The scenarios of a campaign: drawn when they are needed, so that a million take no memory, or listed.
#[derive(Clone, Debug)]
pub enum Scenarios {
    /// Scenarios `0..count` of a seed.
    Drawn {
        /// The seed.
        seed: u64,
        /// How many.
        count: u64,
    },
    /// Scenarios of a file; ids are unique.
    Listed(Vec<NamedScenario>),
}

impl Scenarios {
    /// How many there are.
    pub fn count(&self) -> u64 {
        match self {
            Self::Drawn { count, .. } => *count,
            Self::Listed(all) => all.len() as u64,
        }
    }

    /// Seed of their draw, where they were drawn.
    pub fn seed(&self) -> Option<u64> {
        match self {
            Self::Drawn { seed, .. } => Some(*seed),
            Self::Listed(_) => None,
        }
    }

    /// Id of one of them.
    pub fn id(&self, index: u64) -> Option<Cow<'_, str>> {
        match self {
            Self::Drawn { seed, count } => (index < *count).then(|| id(*seed, index).into()),
            Self::Listed(all) => Some(all.get(usize::try_from(index).ok()?)?.id.as_str().into()),
        }
    }

    /// One of them.
    ///
    /// # Errors
    /// One that there is not; a mission whose geometry lets no start pass.
    pub fn get(&self, index: u64, mission: &Mission) -> Result<NamedScenario, Error> {
        let found = match self {
            Self::Drawn { seed, .. } => draw_one(*seed, index, mission),
            Self::Listed(all) => usize::try_from(index).ok().and_then(|i| all.get(i)).cloned(),
        };
        let reason = "cannot be had: the mission's geometry lets no start pass";
        found.ok_or_else(|| Error::Scenario { id: index.to_string(), reason: reason.into() })
    }

    /// Whether they are the same.
    pub fn fingerprint(&self) -> String {
        match self {
            Self::Drawn { seed, count } => fingerprint(&("drawn", seed, count)),
            Self::Listed(all) => fingerprint(all),
        }
    }
}
