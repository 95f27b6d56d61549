//! A model for an arm of another number of joints, as something to start a training from.
//!
//! What a network has learnt of path, target and bus is of use whatever the arm. Its inputs and outputs of a
//! joint that both arms have, counted from the bus, are taken over, those of other joints are zero.

use crate::quantise::checksum;
use remora_core::advanced::nn::{Decoder, Header, Layout};
use remora_core::advanced::stages::size;
use remora_core::advanced::warmstart::Encoding;
use remora_host::error::{Error, FieldError};
use remora_host::formats::{ModelBuilder, ModelFile, NamedTensor, Values};
use remora_host::lineage::Lineage;
use std::path::{Path, PathBuf};

/// Writes a model for arms of so many joints beside another, with its lineage; its file.
///
/// # Errors
/// A model that cannot be read or changed, a file that cannot be written.
pub(super) fn write(model: &Path, joints: usize) -> Result<PathBuf, Error> {
    let file = ModelFile::read(model)?;
    let lineage = Lineage::beside(model, checksum(&file.bytes()), &file.header().provenance)?;
    let made = fitted(&file, joints).map_err(|error| error.at(model))?;
    let out = model.with_extension(format!("{joints}.model"));
    made.write(&out)?;
    lineage.write_beside(&out, checksum(&made.bytes())).map(|_| out)
}

/// The same network for another arm; linear decoders with one token a node only.
fn fitted(file: &ModelFile, joints: usize) -> Result<ModelFile, FieldError> {
    let header = file.header();
    let refused = |field: &str| FieldError::new(field, "has no other number of joints");
    let encoding = Encoding::of_tag(header.inputs).ok_or_else(|| refused("encoding"))?;
    if header.decoder != Decoder::Linear || header.layout != Layout::Fused {
        return Err(refused("decoder"));
    }
    let had = usize::from(header.action).saturating_sub(size::controls(0));
    let action = size::controls(joints) as u16;
    let mut builder = ModelBuilder::new(Header {
        version: Header::version_of(action),
        action,
        token_types: [encoding.features(joints) as u16].into_iter().collect(),
        ..header.clone()
    })?;
    let inputs = places(encoding.gaps(), had, joints);
    let outputs = places(&[3], had, joints);
    let chunk = usize::from(header.chunk);
    for tensor in file.tensors() {
        let values = match tensor.name.as_str() {
            "input.mean" | "embed.0.weight" => taken(tensor, &inputs, 1, 0.0),
            "input.std" => taken(tensor, &inputs, 1, 1.0),
            "action.mean" => taken(tensor, &outputs, 1, 0.0),
            "action.std" => taken(tensor, &outputs, 1, 1.0),
            "head.weight" | "head.bias" => taken(tensor, &outputs, chunk, 0.0),
            _ => tensor.values.clone(),
        };
        builder.set(&tensor.name, values)?;
    }
    builder.finish()
}

/// Where each number of an arm of `joints` joints is among those of one that `had` another number: numbers
/// that are of no joint, and rows of one a joint, by turns.
fn places(gaps: &[usize], had: usize, joints: usize) -> Vec<Option<usize>> {
    let mut from = 0;
    let mut places = Vec::new();
    for gap in gaps {
        places.extend((from..from + gap).map(Some));
        from += gap;
        places.extend((0..joints).map(|joint| (joint < had).then_some(from + joint)));
        from += had;
    }
    places
}

/// The rows of a tensor that are at `places`, in each of `parts` parts of it; others hold `rest`. A vector's
/// numbers are its rows.
fn taken(tensor: &NamedTensor, places: &[Option<usize>], parts: usize, rest: f32) -> Values {
    let Values::F32(numbers) = &tensor.values else { return tensor.values.clone() };
    let columns = if tensor.rows == 1 { 1 } else { tensor.columns };
    let rows: Vec<&[f32]> = numbers.chunks(columns).collect();
    let filler = vec![rest; columns];
    let part = |part: &[&[f32]]| -> Vec<f32> {
        let row = |place: &Option<usize>| place.map_or(filler.as_slice(), |at| part[at]).to_vec();
        places.iter().flat_map(row).collect()
    };
    Values::F32(rows.chunks(rows.len() / parts).flat_map(part).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_host::learned::Learned;
    use remora_host::method::Integrator;

    fn built_in() -> ModelFile {
        ModelFile::parse(Learned::built_in_file(Integrator::Euler)).unwrap()
    }

    fn numbers<'a>(file: &'a ModelFile, name: &str) -> &'a [f32] {
        match &file.tensor(name).unwrap().values {
            Values::F32(numbers) => numbers,
            Values::Int8(_) => panic!("{name} is bytes"),
        }
    }

    #[test]
    fn what_is_of_no_joint_is_taken_over_as_it_is() {
        let (body, three) = (Encoding::Body, built_in());
        assert_eq!(fitted(&three, 3).unwrap(), three);
        let more = fitted(&three, 5).unwrap();
        assert_eq!((more.header().action, more.header().version), (8, 2));
        assert_eq!(usize::from(more.header().token_types[0]), body.features(5));
        // The first three joints alone are the network that it was.
        assert_eq!(fitted(&more, 3).unwrap(), three);
        assert_eq!(numbers(&more, "head.bias")[6..], [0.0; 2]);
        assert_eq!(numbers(&more, "input.std")[6..8], [1.0; 2]);
        let fewer = fitted(&three, 2).unwrap();
        assert_eq!(fewer.header().action, 5);
        assert_eq!(numbers(&fewer, "action.mean"), &numbers(&three, "action.mean")[..5]);
        let mean = numbers(&three, "input.mean");
        let kept = [&mean[..5], &mean[6..57], &mean[58..60], &mean[61..69]].concat();
        assert_eq!(numbers(&fewer, "input.mean"), kept);
        let same = ["block.2.down.weight", "node.embedding", "norm.gain"];
        assert!(same.iter().all(|name| fewer.tensor(name) == three.tensor(name)));
    }

    #[test]
    fn joints_are_counted_from_the_bus() {
        assert_eq!(places(&[1, 2], 2, 1), [Some(0), Some(1), Some(3), Some(4), Some(5)]);
        let more = [Some(0), Some(1), None, Some(2), Some(3), Some(4), None];
        assert_eq!(places(&[1, 2], 1, 2), more);
    }
}
