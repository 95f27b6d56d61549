//! A model for an arm of another number of joints, or for many servicers, as something to start a training
//! from.
//!
//! Weights that a network has learnt for path, target and bus are of use whatever the arm. Inputs and outputs
//! of a joint that both arms have, counted from the bus, are taken over, those of other joints are zero. So are
//! the servicer's numbers at first, for a network that has not seen them.

use remora_core::advanced::nn::{Decoder, Header, Layout};
use remora_core::advanced::stages::size;
use remora_core::advanced::warmstart::Encoding;
use remora_host::error::{Error, FieldError};
use remora_host::formats::{ModelBuilder, ModelFile, NamedTensor, Values};
use remora_host::lineage::Lineage;
use remora_learn::quantise::checksum;
use std::path::{Path, PathBuf};

/// Writes a model for arms of so many joints beside another, with its lineage; its file.
///
/// # Errors
/// A model that cannot be read or changed, a file that cannot be written.
pub fn write(model: &Path, joints: usize) -> Result<PathBuf, Error> {
    let file = ModelFile::read(model)?;
    let lineage = Lineage::beside(model, checksum(&file.bytes()), &file.header().provenance)?;
    let made = for_joints(&file, joints).map_err(|error| error.at(model))?;
    let out = model.with_extension(format!("{joints}.model"));
    made.write(&out)?;
    lineage.write_beside(&out, checksum(&made.bytes())).map(|_| out)
}

/// Fits a network to another arm; linear decoders with one token a node or chunk only.
fn for_joints(file: &ModelFile, joints: usize) -> Result<ModelFile, FieldError> {
    let header = file.header();
    let refused = |field: &str| FieldError::new(field, "has no other number of joints");
    let encoding = Encoding::of_tag(header.inputs).ok_or_else(|| refused("encoding"))?;
    let action = size::controls(joints) as u16;
    let wanted = Header {
        version: Header::version_of(action),
        action,
        token_types: [encoding.features(joints) as u16].into_iter().collect(),
        ..header.clone()
    };
    fitted(file, wanted, &places(encoding.gaps(), joints_of(header), joints))
}

/// Adds the servicer's numbers to the inputs of a network that takes all others of that encoding;
/// `None` where it does not.
///
/// # Errors
/// A decoder that is not linear, more than one token a node.
pub(super) fn for_servicers(file: &ModelFile) -> Result<Option<ModelFile>, FieldError> {
    let (header, joints) = (file.header(), joints_of(file.header()));
    if Encoding::of_tag(header.inputs) != Some(Encoding::Body) {
        return Ok(None);
    }
    let [body, all] = [Encoding::Body, Encoding::Servicer].map(|of| of.features(joints));
    let time = size::controls(joints) + 1;
    let own = (time..time + all - body).map(|_| None);
    let inputs: Vec<_> = (0..time).map(Some).chain(own).chain((time..body).map(Some)).collect();
    let wanted = Header {
        inputs: Encoding::Servicer.tag(),
        token_types: [all as u16].into_iter().collect(),
        ..header.clone()
    };
    fitted(file, wanted, &inputs).map(Some)
}

/// Joints of the arms that a model is for.
fn joints_of(header: &Header) -> usize {
    usize::from(header.action).saturating_sub(size::controls(0))
}

/// Fits a network to another header, which finds each of its inputs at one of these places, or nowhere.
fn fitted(
    file: &ModelFile,
    wanted: Header,
    inputs: &[Option<usize>],
) -> Result<ModelFile, FieldError> {
    let header = file.header();
    if header.decoder != Decoder::Linear || header.layout == Layout::Separate {
        return Err(FieldError::new("decoder", "must be linear, with one token a node"));
    }
    let outputs = places(&[3], joints_of(header), joints_of(&wanted));
    let mut builder = ModelBuilder::new(wanted)?;
    let chunk = usize::from(header.chunk);
    for tensor in file.tensors() {
        let values = match tensor.name.as_str() {
            "input.mean" | "embed.0.weight" => taken(tensor, inputs, 1, 0.0),
            "input.std" => taken(tensor, inputs, 1, 1.0),
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
        assert_eq!(for_joints(&three, 3).unwrap(), three);
        let more = for_joints(&three, 5).unwrap();
        assert_eq!((more.header().action, more.header().version), (8, 2));
        assert_eq!(usize::from(more.header().token_types[0]), body.features(5));
        // The first three joints alone are the network that it was.
        assert_eq!(for_joints(&more, 3).unwrap(), three);
        // Of each action of the chunk.
        let bias = numbers(&more, "head.bias").chunks(8).collect::<Vec<_>>();
        assert!(bias.len() == 5 && bias.iter().all(|action| action[6..] == [0.0; 2]));
        assert_eq!(numbers(&more, "input.std")[6..8], [1.0; 2]);
        let fewer = for_joints(&three, 2).unwrap();
        assert_eq!(fewer.header().action, 5);
        assert_eq!(numbers(&fewer, "action.mean"), &numbers(&three, "action.mean")[..5]);
        let mean = numbers(&three, "input.mean");
        let kept = [&mean[..5], &mean[6..57], &mean[58..60], &mean[61..69]].concat();
        assert_eq!(numbers(&fewer, "input.mean"), kept);
        let same = ["block.2.down.weight", "node.embedding", "norm.gain"];
        assert!(same.iter().all(|name| fewer.tensor(name) == three.tensor(name)));
    }

    #[test]
    fn a_model_of_many_servicers_begins_as_one_of_the_built_in() {
        let one = built_in();
        let many = for_servicers(&one).unwrap().unwrap();
        assert_eq!(many.header().inputs, Encoding::Servicer.tag());
        assert_eq!(usize::from(many.header().token_types[0]), Encoding::Servicer.features(3));
        let (own, all) = (numbers(&one, "input.mean"), numbers(&many, "input.mean"));
        assert_eq!((&all[..7], &all[7 + 22..]), (&own[..7], &own[7..]));
        assert_eq!(numbers(&many, "input.std")[7..7 + 22], [1.0; 22]);
        // Inputs of the servicer have no weight yet.
        let weights = numbers(&many, "embed.0.weight").chunks(96).collect::<Vec<_>>();
        assert!(weights[7..7 + 22].iter().flat_map(|row| row.iter()).all(|w| *w == 0.0));
        assert_eq!(weights[7 + 22], &numbers(&one, "embed.0.weight")[7 * 96..8 * 96]);
        assert!(for_servicers(&many).unwrap().is_none());
    }

    #[test]
    fn joints_are_counted_from_the_bus() {
        assert_eq!(places(&[1, 2], 2, 1), [Some(0), Some(1), Some(3), Some(4), Some(5)]);
        let more = [Some(0), Some(1), None, Some(2), Some(3), Some(4), None];
        assert_eq!(places(&[1, 2], 1, 2), more);
    }
}
