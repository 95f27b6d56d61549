//! The parts of an audit and what holds them together.

use super::emulation::{Emulation, ReportFile};
use remora_host::choice::choices;
use remora_host::error::{Error, FieldError};
use remora_host::formats::{Limit, json, read_text, write_atomically};
use remora_host::provenance::Provenance;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

choices! {
    /// A part of the audit: a section of the page, and the numbers that it is made of. In the order in which they
    /// are measured: memory looks at the images that the instructions have been counted with.
    #[derive(PartialOrd, Ord, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Section {
        /// Instructions of the images under emulation.
        Instructions = "instructions",
        /// Static memory, code, stack, proofs, of the images.
        Memory = "memory",
        /// Bounds of loops and turns observed.
        Loops = "loops",
        /// Times on the host.
        Latency = "latency",
        /// Flipped bits.
        Injection = "injection",
        /// Where the planner works.
        Envelope = "envelope",
    }
}

/// A part that has been measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finished {
    /// Provenance: the program, its sources, the machine.
    pub provenance: Provenance,
    /// How long it took [s].
    pub took_s: f64,
    /// Findings, in the part's own form.
    pub findings: Value,
}

impl Finished {
    /// Findings of this type.
    ///
    /// # Errors
    /// Findings of another form: another version wrote them.
    pub fn findings<T: DeserializeOwned>(&self, section: Section) -> Result<T, FieldError> {
        json::typed(&self.findings).map_err(|error| {
            let part = format!("sections.{}.findings", section.name());
            let within =
                if error.field.is_empty() { part } else { format!("{part}.{}", error.field) };
            FieldError::new(within, error.reason)
        })
    }
}

/// The parts that have been measured: `audit.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Numbers {
    format: String,
    /// By part.
    pub sections: BTreeMap<Section, Finished>,
}

/// The `format` of the file.
const FORMAT: &str = "remora-audit/1";

impl Default for Numbers {
    fn default() -> Self {
        Self { format: FORMAT.into(), sections: BTreeMap::new() }
    }
}

impl Numbers {
    /// Reads a file; none where there is no such file.
    ///
    /// # Errors
    /// A file that cannot be read or is not one.
    pub fn read(file: &Path) -> Result<Option<Self>, Error> {
        if !file.exists() {
            return Ok(None);
        }
        json::parse(&read_text(file, Limit::DOCUMENT)?, FORMAT)
            .map(Some)
            .map_err(|error| error.at(file))
    }

    /// Measurements of the images, where they have been run.
    ///
    /// # Errors
    /// Findings of another form.
    pub fn emulation(&self) -> Result<Option<Emulation>, FieldError> {
        let report: Option<ReportFile> = self.findings(Section::Instructions)?;
        report.map(Emulation::new).transpose()
    }

    /// Writes a file.
    ///
    /// # Errors
    /// Where that is not possible.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        let text = json::to_text(self).map_err(|error| Error::output(file, &error.into()))?;
        write_atomically(file, text.as_bytes())
    }

    /// Findings of a part.
    ///
    /// # Errors
    /// Findings of another form.
    pub fn findings<T: DeserializeOwned>(&self, section: Section) -> Result<Option<T>, FieldError> {
        self.sections.get(&section).map(|finished| finished.findings(section)).transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers() -> Numbers {
        let provenance = Provenance::gather(Path::new("."));
        let findings = serde_json::json!({ "observed": [] });
        let finished = Finished { provenance, took_s: 1.5, findings };
        let mut numbers = Numbers::default();
        numbers.sections.insert(Section::Loops, finished);
        numbers
    }

    #[test]
    fn numbers_survive_a_round_trip() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("audit.json");
        assert_eq!(Numbers::read(&file), Ok(None));
        numbers().write(&file).unwrap();
        let read = Numbers::read(&file).unwrap().unwrap();
        assert_eq!(read, numbers());
        let loops: super::super::loops::Loops = read.findings(Section::Loops).unwrap().unwrap();
        assert!(loops.observed.is_empty());
        assert_eq!(read.findings::<Value>(Section::Memory), Ok(None));
    }

    #[test]
    fn what_is_not_understood_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("audit.json");
        std::fs::write(&file, "{\"format\": \"remora-audit/9\", \"sections\": {}}").unwrap();
        let error = Numbers::read(&file).unwrap_err().to_string();
        assert!(error.contains("audit.json: format: "), "{error}");
        let wrong = numbers().findings::<Vec<u8>>(Section::Loops).unwrap_err();
        assert_eq!(wrong.field, "sections.loops.findings");
    }
}
