//! Findings of a reproduction, for the terminal and for files.

use remora_host::error::Error;
use remora_host::formats::{json, make_directory, write_atomically};
use remora_host::report::Table;
use serde::Serialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Tables, plots and numbers of one of the paper's tables.
pub struct Findings {
    /// Title, for the reader.
    pub title: &'static str,
    /// How the numbers are to be read, a paragraph each.
    pub notes: Vec<String>,
    /// Captions and tables.
    pub tables: Vec<(String, Table)>,
    /// Names and texts of SVG files.
    pub plots: Vec<(&'static str, String)>,
    /// All numbers.
    pub numbers: Value,
}

/// Columns of the terminal, and of a page's source.
const TERMINAL: usize = 100;
const PAGE: usize = 120;

/// A paragraph in lines of at most so many columns.
fn wrapped(text: &str, columns: usize) -> String {
    let (mut out, mut column) = (String::new(), 0);
    for word in text.split_whitespace() {
        let width = word.chars().count();
        let before = match column {
            0 => "",
            column if column + 1 + width <= columns => " ",
            _ => "\n",
        };
        column = if before == "\n" { width } else { column + before.len() + width };
        out += before;
        out += word;
    }
    out
}

/// The `format` of the numbers' file.
const FORMAT: &str = "remora-reproduction/1";

#[derive(Serialize)]
struct Numbers<'a> {
    format: &'static str,
    title: &'a str,
    notes: &'a [String],
    numbers: &'a Value,
}

impl Findings {
    /// For the terminal, at most 100 columns wide where names are short.
    pub fn text(&self) -> String {
        let mut out = format!("{}\n", self.title);
        for note in &self.notes {
            out += &format!("{}\n", wrapped(note, TERMINAL));
        }
        for (caption, table) in &self.tables {
            out += &format!("\n{}\n\n{table}", wrapped(caption, TERMINAL));
        }
        out
    }

    /// For a page.
    pub fn markdown(&self) -> String {
        let mut out = format!("# {}\n", self.title);
        for note in &self.notes {
            out += &format!("\n{}\n", wrapped(note, PAGE));
        }
        for (caption, table) in &self.tables {
            out += &format!("\n{caption}\n\n{}", table.markdown());
        }
        for (name, _) in &self.plots {
            out += &format!("\n![{name}]({name}.svg)\n");
        }
        out
    }

    /// Writes `NAME.md`, `NAME.json` and the plots; returns the files.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, directory: &Path, name: &str) -> Result<Vec<PathBuf>, Error> {
        let failed = |cause: std::io::Error| Error::output(directory, &cause);
        make_directory(directory)?;
        let Self { title, notes, numbers, .. } = self;
        let numbers = json::to_text(&Numbers { format: FORMAT, title, notes, numbers })
            .map_err(|error| failed(error.into()))?;
        let mut files =
            vec![(format!("{name}.md"), self.markdown()), (format!("{name}.json"), numbers)];
        let svg = |(name, text): &(&str, String)| (format!("{name}.svg"), text.clone());
        files.extend(self.plots.iter().map(svg));
        let write = |(name, text): (String, String)| {
            let file = directory.join(name);
            write_atomically(&file, text.as_bytes()).map(|()| file)
        };
        files.into_iter().map(write).collect()
    }
}
