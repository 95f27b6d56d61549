//! From single precision to bytes: a model as it was trained becomes one that flies.
//!
//! Each output channel of the blocks' linear maps (and of the flow decoder's two wide ones) gets a
//! scale of its own, its largest weight over 127; its weights are rounded to the nearest multiple.
//! All else stays in single precision.

use remora_core::advanced::nn::Precision;
use remora_host::error::{Error, FieldError};
use remora_host::formats::{ModelBuilder, ModelFile, NamedTensor, Values};
use remora_host::lineage::{self, Lineage};
use std::path::{Path, PathBuf};

/// Effect of quantisation on one tensor.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Quantised {
    /// Name.
    pub name: String,
    /// Rows.
    pub rows: usize,
    /// Numbers of a row.
    pub columns: usize,
    /// Bytes before and after, scales included.
    pub bytes: [usize; 2],
    /// Largest error of a weight, relative to the largest weight of its row; `None` where the tensor
    /// stays as it is.
    pub largest_error: Option<f64>,
    /// Root of the mean squared error, relative to that of the weights.
    pub rms_error: Option<f64>,
}

/// Quantises a model.
///
/// # Errors
/// A model that is quantised already, or a weight that is not finite.
pub fn quantise(model: &ModelFile) -> Result<(ModelFile, Vec<Quantised>), FieldError> {
    if model.is_quantised() {
        return Err(FieldError::new("precision", "is quantised already"));
    }
    let mut header = model.header().clone();
    header.precision = Precision::Int8;
    let mut builder = ModelBuilder::new(header)?;
    let mut report = Vec::new();
    for tensor in model.tensors() {
        let Values::F32(numbers) = &tensor.values else { continue };
        if let Some(odd) = numbers.iter().find(|x| !x.is_finite()) {
            return Err(FieldError::new(&tensor.name, format!("holds {odd}")));
        }
        if builder.set_f32(&tensor.name, numbers).is_ok() {
            report.push(unchanged(tensor, numbers.len()));
            continue;
        }
        let (rows, scales): (Vec<_>, Vec<_>) = numbers.chunks(tensor.columns).map(row).unzip();
        let bytes: Vec<i8> = rows.concat();
        report.push(changed(tensor, numbers, &bytes, &scales));
        let scale = tensor.name.replace("weight", "scale");
        builder.set_f32(&scale, &scales)?;
        builder.set(&tensor.name, Values::Int8(bytes))?;
    }
    Ok((builder.finish()?, report))
}

/// Quantises a model file into another; where it has a lineage beside it, so has the other. What was
/// done to each tensor, and the lineage written.
///
/// # Errors
/// A file that cannot be read, used or written.
pub fn quantise_file(input: &Path, out: &Path) -> Result<(Vec<Quantised>, Option<PathBuf>), Error> {
    let model = ModelFile::read(input)?;
    let known = Lineage::beside(input, checksum(&model.bytes()), &model.header().provenance)?;
    let (quantised, tensors) = quantise(&model).map_err(|error| error.at(input))?;
    quantised.write(out)?;
    let has_lineage = lineage::path_of(input).exists();
    let write = || known.write_beside(out, checksum(&quantised.bytes()));
    Ok((tensors, has_lineage.then(write).transpose()?))
}

/// A model file's last four bytes.
pub fn checksum(bytes: &[u8]) -> u32 {
    bytes.last_chunk().map_or(0, |last| u32::from_le_bytes(*last))
}

/// A row in bytes, and its scale.
fn row(weights: &[f32]) -> (Vec<i8>, f32) {
    let largest = weights.iter().fold(0f32, |most, w| most.max(w.abs()));
    let scale = largest / 127.0;
    if scale < f32::MIN_POSITIVE {
        return (vec![0; weights.len()], 0.0);
    }
    let round = |w: &f32| (w / scale).round_ties_even().clamp(-127.0, 127.0) as i8;
    (weights.iter().map(round).collect(), scale)
}

fn unchanged(tensor: &NamedTensor, count: usize) -> Quantised {
    Quantised {
        name: tensor.name.clone(),
        rows: tensor.rows,
        columns: tensor.columns,
        bytes: [4 * count; 2],
        largest_error: None,
        rms_error: None,
    }
}

fn changed(tensor: &NamedTensor, numbers: &[f32], bytes: &[i8], scales: &[f32]) -> Quantised {
    let (mut largest, mut squares, mut errors) = (0f64, 0f64, 0f64);
    let rows = numbers.chunks(tensor.columns).zip(bytes.chunks(tensor.columns));
    for ((numbers, bytes), scale) in rows.zip(scales) {
        let most = numbers.iter().fold(0f64, |most, w| most.max(f64::from(w.abs())));
        for (w, q) in numbers.iter().zip(bytes) {
            let (w, error) = (f64::from(*w), f64::from(*w) - f64::from(*q) * f64::from(*scale));
            squares += w * w;
            errors += error * error;
            if most > 0.0 {
                largest = largest.max(error.abs() / most);
            }
        }
    }
    let rms = if squares > 0.0 { (errors / squares).sqrt() } else { 0.0 };
    Quantised {
        name: tensor.name.clone(),
        rows: tensor.rows,
        columns: tensor.columns,
        bytes: [4 * numbers.len(), bytes.len() + 4 * scales.len()],
        largest_error: Some(largest),
        rms_error: Some(rms),
    }
}
