//! `remora learn quantise`

use super::Output;
use super::options::{ForceArgs, JsonArgs};
use remora_host::error::Error;
use remora_host::formats::check_writable;
use remora_host::report::Table;
use remora_learn::quantise::{Quantised, quantise_file};
use std::path::PathBuf;

/// Round a trained model to eight bits, as the network that flies needs it.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Model in single precision (*.model), as training writes it
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Quantised model to write
    #[arg(value_name = "OUT")]
    out: PathBuf,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora learn quantise small.f32.model small.model

Prints every tensor with its bytes before and after, the largest error of a weight relative to the
largest of its row, and the relative root mean square of all its errors. What the model descends
from (IN's *.lineage.toml, where it has one) goes with it.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        check_writable(&self.out)?;
        self.force.keep(&self.out)?;
        let (tensors, lineage) = quantise_file(&self.input, &self.out)?;
        let mut text = format!("{}\nwritten: {}\n", table(&tensors), self.out.display());
        if let Some(file) = lineage {
            text += &format!("written: {}\n", file.display());
        }
        Output::new(text, true).or_json(self.json.json, &tensors)
    }
}

fn table(tensors: &[Quantised]) -> String {
    let mut table =
        Table::new("tensor | >rows | >columns | >bytes | >quantised | >largest error | >rms error");
    let percent = |error: Option<f64>| error.map_or("-".into(), |e| format!("{:.3} %", 100.0 * e));
    let mut total = [0, 0];
    for tensor in tensors {
        total = [total[0] + tensor.bytes[0], total[1] + tensor.bytes[1]];
        table.row([
            tensor.name.clone(),
            tensor.rows.to_string(),
            tensor.columns.to_string(),
            tensor.bytes[0].to_string(),
            tensor.bytes[1].to_string(),
            percent(tensor.largest_error),
            percent(tensor.rms_error),
        ]);
    }
    let none = || String::new();
    let [before, after] = total.map(|bytes: usize| bytes.to_string());
    table.row(["all".into(), none(), none(), before, after, none(), none()]);
    table.to_string()
}
