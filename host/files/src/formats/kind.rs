//! Kinds of files: what a file that a reader refuses may be in fact.

use super::input::{Limit, open_regular, read_bytes};
use super::json::format_of;
use crate::error::{Error, FieldError};
use std::io::Read;
use std::path::Path;

/// First bytes of a plan's packet.
pub(super) const PLAN_MAGIC: &[u8; 8] = b"REMORA\0P";
/// First bytes of an evidence record's packet.
pub(super) const EVIDENCE_MAGIC: &[u8; 8] = b"REMORA\0E";

/// Whether bytes are a packet, of whatever.
pub(super) fn is_packet(bytes: &[u8]) -> bool {
    [PLAN_MAGIC, EVIDENCE_MAGIC].iter().any(|magic| bytes.starts_with(*magic))
}

/// Whether a file's name is that of a packet.
pub fn is_named_packet(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension == "postcard")
}

/// Kind that a reader takes, or that it was given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `*.plan.json`
    Plan,
    /// `*.scenarios.json`
    Scenarios,
    /// `*.mission.toml`
    Mission,
    /// `*.errors.toml`
    Errors,
    /// `*.chief.toml`
    Chief,
    /// `*.model`
    Model,
    /// `*.urdf`
    Urdf,
    /// `history/RUN.jsonl`
    History,
    /// A file that no command takes by name, in words.
    Other(&'static str),
}

/// Formats that texts name, up to the `/`.
const DOCUMENTS: [(&str, Kind); 24] = [
    ("remora-plan", Kind::Plan),
    ("remora-scenarios", Kind::Scenarios),
    ("remora-mission", Kind::Mission),
    ("remora-chief", Kind::Chief),
    ("remora-lineage", Kind::Other("a model's lineage")),
    ("remora-budgets", Kind::Other("budgets of an audit")),
    ("remora-evidence", Kind::Other("a record of evidence")),
    ("remora-flights", Kind::Other("the settings of a folder of flights")),
    ("remora-flights-journal", Kind::Other("a journal of flights")),
    ("remora-flights-summary", Kind::Other("a summary of flights")),
    ("remora-history", Kind::History),
    ("remora-journal", Kind::Other("a journal of a campaign")),
    ("remora-part", Kind::Other("a part of a campaign")),
    ("remora-summary", Kind::Other("a summary of a campaign")),
    ("remora-check", Kind::Other("the output of check")),
    ("remora-vehicle", Kind::Other("the output of mission show")),
    ("remora-import", Kind::Other("the output of mission import")),
    ("remora-export", Kind::Other("the output of export")),
    ("remora-replay", Kind::Other("the output of replay")),
    ("remora-ways-out", Kind::Other("the output of fly --safety")),
    ("remora-qp", Kind::Other("a subproblem")),
    ("remora-envelope", Kind::Other("a map of an envelope")),
    ("remora-audit", Kind::Other("the numbers of an audit")),
    ("remora-profile", Kind::Other("a profile")),
];

/// First bytes of binary files and marked-up texts.
const BEGINNINGS: [(&[u8], Kind); 9] = [
    (PLAN_MAGIC, Kind::Plan),
    (EVIDENCE_MAGIC, Kind::Other("a record of evidence")),
    (b"RMRN", Kind::Model),
    (b"REMORA\0D", Kind::Other("a part of a dataset")),
    (b"REMORACK", Kind::Other("a checkpoint of a training")),
    (b"PAR1", Kind::Other("a Parquet table")),
    (b"\x7fELF", Kind::Other("a program")),
    (b"<!doctype html", Kind::Other("a page")),
    (b"<svg", Kind::Other("a picture")),
];

/// Keys of top-level values by which a kind is known too.
const WORDS: [&str; 3] = ["frame", "name", "designator"];

/// Tables and keys by which each kind of TOML file is known.
const KEYS: [(Kind, &[&str]); 4] = [
    (
        Kind::Mission,
        &[
            "horizon",
            "orbit",
            "target",
            "approach",
            "weights",
            "tolerances",
            "margins",
            "corridor",
            "scenarios",
            "typical",
            "roll",
            "servicer",
        ],
    ),
    (
        Kind::Errors,
        &[
            "navigation",
            "thrusters",
            "wheels",
            "joints",
            "mass",
            "tumble",
            "geometry",
            "orbit",
            "sensors",
            "faults",
        ],
    ),
    (Kind::Chief, &["frame", "elements", "state", "name", "designator"]),
    (Kind::Other("a training's configuration"), &["data", "model", "training"]),
];

/// Length of the head by which a file's kind is found [bytes].
const HEAD: u64 = 1 << 16;

impl Kind {
    /// Name in words, with an article.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plan => "a plan",
            Self::Scenarios => "a scenario set",
            Self::Mission => "a mission file",
            Self::Errors => "an errors file",
            Self::Chief => "a chief file",
            Self::Model => "a model",
            Self::Urdf => "a URDF file",
            Self::History => "the history of a flight",
            Self::Other(name) => name,
        }
    }

    /// Reads a file that ought to be of this kind.
    ///
    /// # Errors
    /// The file and the reason, or the kind that the file is of instead.
    pub fn read<T>(
        self,
        file: &Path,
        limit: Limit,
        parse: impl FnOnce(&[u8]) -> Result<T, FieldError>,
    ) -> Result<T, Error> {
        let read = read_bytes(file, limit);
        read.and_then(|bytes| parse(&bytes).map_err(|error| error.at(file)))
            .map_err(|error| self.unless_other(file, error))
    }

    /// Error of reading a file: the other kind if it is of one, else the reason.
    pub fn unless_other(self, file: &Path, error: Error) -> Error {
        self.refuse_other(file).err().unwrap_or(error)
    }

    /// Refuses a file that is of another kind. A file of unknown kind passes.
    ///
    /// # Errors
    /// The file is of another kind.
    pub fn refuse_other(self, file: &Path) -> Result<(), Error> {
        match Self::of_file(file) {
            Some(found) if found != self => {
                let (found, expected) = (found.name(), self.name());
                Err(Error::WrongKind { file: file.into(), found, expected })
            }
            _ => Ok(()),
        }
    }

    fn of_file(file: &Path) -> Option<Self> {
        let mut head = Vec::new();
        open_regular(file).ok()?.take(HEAD).read_to_end(&mut head).ok()?;
        Self::of(&head)
    }

    /// Finds the kind of a file from its head.
    fn of(head: &[u8]) -> Option<Self> {
        let lower = head[..head.len().min(64)].to_ascii_lowercase();
        let begins = |(beginning, _): &&(&[u8], Self)| {
            head.starts_with(beginning) || lower.starts_with(beginning)
        };
        if let Some((_, kind)) = BEGINNINGS.iter().find(begins) {
            return Some(*kind);
        }
        let text = match std::str::from_utf8(head) {
            Ok(text) => text,
            // The head may end within a letter.
            Err(error) => std::str::from_utf8(&head[..error.valid_up_to()]).ok()?,
        };
        let text = text.trim_start_matches('\u{feff}').trim_start();
        match text.as_bytes().first()? {
            b'{' => Some(Self::of_format(&format_of(text)?)),
            b'<' => text.contains("<robot").then_some(Self::Urdf),
            _ => Self::of_toml(text).or_else(|| Self::of_csv(text)),
        }
    }

    fn of_format(format: &str) -> Self {
        let name = format.split('/').next().unwrap_or_default();
        let found = DOCUMENTS.iter().find(|(known, _)| *known == name);
        found.map_or(Self::Other("another document"), |(_, kind)| *kind)
    }

    /// The kind that the `format` names; without one the kind with most of the keys.
    fn of_toml(text: &str) -> Option<Self> {
        // Searches by lines: the head of a long file may end anywhere.
        let lines = text.lines().map(str::trim);
        let entries = lines.clone().filter_map(|line| line.split_once('='));
        let quoted = |value: &str| value.split(['"', '\'']).nth(1).map(Self::of_format);
        if let Some((_, format)) = entries.clone().find(|(key, _)| key.trim() == "format") {
            return quoted(format);
        }
        let tables = lines.filter_map(|line| line.strip_prefix('['));
        let tables =
            tables.filter_map(|line| line.trim_start_matches('[').split(['.', ']']).next());
        let words = entries.map(|(key, _)| key.trim()).filter(|key| WORDS.contains(key));
        let mut keys: Vec<&str> = tables.map(str::trim).chain(words).collect();
        keys.sort_unstable();
        keys.dedup();
        let count = |known: &[&str]| keys.iter().filter(|key| known.contains(key)).count();
        let mut counts = KEYS.map(|(kind, known)| (count(known), kind));
        counts.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
        let [(most, kind), (next, _), ..] = counts;
        (most > next).then_some(kind)
    }

    /// A head of columns with commas, and nothing else in the first line.
    fn of_csv(text: &str) -> Option<Self> {
        let is_of_name = |c: char| c.is_ascii_alphanumeric() || "_[],: ".contains(c);
        let head = text.lines().next()?;
        let is_head = head.split(',').count() > 2 && head.chars().all(is_of_name);
        is_head.then_some(Self::Other("a CSV table"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_is_told_by_what_a_file_begins_with() {
        for (text, kind) in [
            ("{\"format\": \"remora-plan/9\", ", Some(Kind::Plan)),
            (
                "\u{feff} {\"a\": 1, \"format\": \"remora-new/1\"}",
                Some(Kind::Other("another document")),
            ),
            ("{\"a\": 1}", None),
            ("[horizon]\nnodes = 7", Some(Kind::Mission)),
            ("[orbit]\n[target]\nmass_kg = 1", Some(Kind::Mission)),
            ("[servicer]\n[[servicer.links]]\ntip_m = 1", Some(Kind::Mission)),
            ("[orbit]\n[navigation]", Some(Kind::Errors)),
            ("[elements]\na = 1\n[target]\nname = 1", Some(Kind::Chief)),
            ("format = 'remora-lineage/1'\n[[training]]", Some(Kind::Other("a model's lineage"))),
            ("[data]\nmodel = 1\n[training]", Some(Kind::Other("a training's configuration"))),
            ("<?xml version=\"1.0\"?>\n<robot name=\"a\">", Some(Kind::Urdf)),
            ("<!DOCTYPE html>", Some(Kind::Other("a page"))),
            ("scenario,status,cost[0]\na,b,1", Some(Kind::Other("a CSV table"))),
            ("PAR1", Some(Kind::Other("a Parquet table"))),
            ("{\"format\":\"remora-history/2\",\"run\":7}\n{}\n", Some(Kind::History)),
            ("RMRN", Some(Kind::Model)),
            ("", None),
            ("some words", None),
        ] {
            assert_eq!(Kind::of(text.as_bytes()), kind, "{text}");
        }
    }
}
