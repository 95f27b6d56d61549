//! Description of a model, for the tables.

use remora_core::advanced::nn;
use remora_core::advanced::warmstart::{Action, Encoding};
use remora_host::error::{Error, io_reason};
use remora_host::learned::Learned;
use remora_host::lineage::{Lineage, Source};
use serde::{Serialize, Serializer};
use std::fmt;
use std::path::{Path, PathBuf};

/// How a network's latent becomes an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Decoder {
    /// A linear map.
    Linear,
    /// Flow matching.
    Flow,
}

impl fmt::Display for Decoder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Linear => "linear",
            Self::Flow => "flow",
        })
    }
}

/// A trained model, as its file describes it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Card {
    /// Name in the tables: its file's without the extension.
    pub name: String,
    /// Its file.
    #[serde(skip)]
    pub file: PathBuf,
    /// Checksum of the file, in hexadecimal digits.
    pub checksum: String,
    /// Its decoder.
    pub decoder: Decoder,
    /// Actions it predicts at once.
    pub chunk: u16,
    /// Layers, width, inputs, precision: what tells two networks apart that learned the same.
    pub network: String,
    /// Inputs, actions and size in words.
    pub about: String,
    /// Whether it is a network of the paper's kind: five tokens a node, inputs in RTN, torques.
    pub is_of_the_papers_kind: bool,
    /// The integrator whose plans it learned.
    pub integrator: String,
    /// Trainings and datasets of the model and its ancestors.
    #[serde(serialize_with = "joined", rename = "sources")]
    pub lineage: Lineage,
}

/// How many tokens there are.
fn tokens(header: &nn::Header) -> &'static str {
    match header.layout {
        nn::Layout::Separate => "five tokens a node",
        nn::Layout::Fused => "one token a node",
        nn::Layout::Chunked => "one token a chunk",
    }
}

/// `3 x 96, one token a node, body, rate, int8`.
fn network(header: &nn::Header) -> String {
    let tokens = tokens(header);
    let inputs = match Encoding::of_tag(header.inputs) {
        Some(Encoding::Paper) => "paper",
        Some(Encoding::Body) => "body",
        Some(Encoding::Servicer) => "servicer",
        None => "unknown",
    };
    let action = match Action::of_tag(header.outputs) {
        Some(Action::Torque) => "torque",
        Some(Action::Rate) => "rate",
        None => "unknown",
    };
    let precision = match header.precision {
        nn::Precision::Int8 => "int8",
        nn::Precision::F32 => "f32",
    };
    format!("{} x {}, {tokens}, {inputs}, {action}, {precision}", header.layers, header.width)
}

/// Inputs, actions and size, for a reader.
fn about(header: &nn::Header) -> String {
    let inputs = match Encoding::of_tag(header.inputs) {
        Some(Encoding::Paper) => "the paper's inputs, in RTN (`paper`)",
        Some(Encoding::Body) => "inputs in bus axes (`body`)",
        Some(Encoding::Servicer) => "inputs in bus axes, with the servicer's numbers (`servicer`)",
        None => "inputs unknown",
    };
    let action = match Action::of_tag(header.outputs) {
        Some(Action::Torque) => "actions are torques",
        Some(Action::Rate) => "actions are the next node's rates",
        None => "actions unknown",
    };
    let tokens = tokens(header);
    let decoder = match header.decoder {
        nn::Decoder::Linear => "linear decoder",
        nn::Decoder::Flow { .. } => "flow decoder",
    };
    let nn::Header { layers, heads, width, chunk, .. } = header;
    format!(
        "{inputs}, {action}, {tokens}, {layers} blocks of width {width} with {heads} heads, \
         {decoder}, H = {chunk}"
    )
}

fn is_of_the_papers_kind(header: &nn::Header) -> bool {
    header.layout == nn::Layout::Separate
        && Encoding::of_tag(header.inputs) == Some(Encoding::Paper)
        && Action::of_tag(header.outputs) == Some(Action::Torque)
}

fn joined<S: Serializer>(lineage: &Lineage, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&Source::join(&lineage.sources))
}

impl Card {
    /// Reads a model file, with the lineage beside it.
    ///
    /// # Errors
    /// A file that is no model, or a lineage that is not its own.
    pub fn read(file: &Path) -> Result<Self, Error> {
        let wrong = |reason: String| Error::input(file, "", reason);
        let learned = Learned::read(file)?;
        let model = learned
            .model()
            .ok_or_else(|| wrong(learned.refused().unwrap_or("is no model").into()))?;
        let header = model.header();
        Source::parse_all(&header.provenance.dataset)
            .map_err(|reason| wrong(format!("provenance: dataset: {reason}")))?;
        let lineage = Lineage::beside(file, learned.checksum(), &header.provenance)?;
        let name = file.file_stem().unwrap_or(file.as_os_str()).to_string_lossy();
        Ok(Self {
            name: name.into_owned(),
            file: file.into(),
            checksum: format!("{:08x}", learned.checksum()),
            decoder: match header.decoder {
                nn::Decoder::Linear => Decoder::Linear,
                nn::Decoder::Flow { .. } => Decoder::Flow,
            },
            chunk: header.chunk,
            network: network(header),
            about: about(header),
            is_of_the_papers_kind: is_of_the_papers_kind(header),
            integrator: header.provenance.integrator.as_str().into(),
            lineage,
        })
    }

    /// Scenarios that it or an ancestor was trained on; those of one seed count once.
    pub fn size(&self) -> u64 {
        self.lineage.size()
    }
}

/// The models of a directory, by name.
///
/// # Errors
/// A directory that cannot be read; a file that is not a model.
pub fn read_cards(directory: &Path) -> Result<Vec<Card>, Error> {
    let failed = |cause: std::io::Error| Error::input(directory, "", io_reason(&cause));
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(failed)? {
        let file = entry.map_err(failed)?.path();
        if file.extension().is_some_and(|extension| extension == "model") {
            files.push(file);
        }
    }
    files.sort();
    files.iter().map(|file| Card::read(file)).collect()
}

/// The models trained on the most scenarios.
pub(super) fn largest(cards: impl Iterator<Item = Card> + Clone) -> Vec<Card> {
    let most = cards.clone().map(|card| card.size()).max();
    cards.filter(|card| Some(card.size()) == most).collect()
}

/// A number of scenarios as the paper writes it: `90k`.
pub(super) fn thousands(count: u64) -> String {
    match count.is_multiple_of(1000) && count > 0 {
        true => format!("{}k", count / 1000),
        false => count.to_string(),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use remora_host::lineage::Training;

    /// A model that there is not.
    pub(crate) fn card(decoder: Decoder, chunk: u16, size: u64) -> Card {
        Card {
            name: format!("{decoder}-{chunk}-{}", thousands(size)),
            file: PathBuf::new(),
            checksum: format!("{:08x}", size * 100 + u64::from(chunk) * 10 + decoder as u64),
            decoder,
            chunk,
            network: "3 x 96".into(),
            about: "3 blocks of width 96".into(),
            is_of_the_papers_kind: false,
            integrator: "euler".into(),
            lineage: Lineage {
                trainings: vec![Training {
                    name: String::new(),
                    integrator: "euler".into(),
                    learnt_from: format!("s1000:{size}"),
                    steps: 3_000,
                    batch: Some(32),
                }],
                before: None,
                sources: vec![Source { seed: 1000, count: size }],
            },
        }
    }

    #[test]
    fn the_largest_sets_are_found() {
        let sizes = [5_000, 90_000, 10_000, 90_000];
        let cards = sizes.map(|size| card(Decoder::Flow, 1, size));
        assert_eq!(largest(cards.iter().cloned()).len(), 2);
        assert_eq!(largest([].into_iter()), []);
        assert_eq!([90_000, 1_500, 0, 1_000].map(thousands), ["90k", "1500", "0", "1k"]);
    }
}
