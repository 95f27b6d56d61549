//! Synthetic models with random weights: they cost and round as trained ones do. For tests,
//! benchmarks and the self-check of an image.

use super::crc::Crc32;
use super::header::{Header, MAGIC, VERSION_OF_ANY_ACTION};
use super::layout::{Element, Tensor, tensors};
use super::noise::uniform;

/// Writes a model file with this header and random weights into `out`; returns its length. The weights
/// are a function of the seed alone, scaled so that activations neither vanish nor explode. `None`
/// where the header is invalid or `out` too short.
pub fn synthetic_model(header: &Header, seed: u64, out: &mut [u8]) -> Option<usize> {
    let mut at = write_header(header, out)?;
    let mut count = 0;
    let mut fits = true;
    tensors(header, |tensor| {
        let place = out.get_mut(at..).and_then(|rest| rest.get_mut(..tensor.bytes()));
        at += tensor.bytes();
        match place {
            Some(place) => fill(&tensor, seed, &mut count, place),
            None => fits = false,
        }
    })
    .ok()?;
    let (body, rest) = out.split_at_mut_checked(at).filter(|_| fits)?;
    *rest.first_chunk_mut::<4>()? = Crc32::of(body).to_le_bytes();
    Some(at + 4)
}

/// Writes magic and header of a model file; returns their length, `None` where `out` is too short.
pub fn write_header(header: &Header, out: &mut [u8]) -> Option<usize> {
    let (magic, rest) = out.split_first_chunk_mut::<4>()?;
    *magic = MAGIC;
    let mut length = postcard::to_slice(header, rest).ok()?.len();
    if header.version == VERSION_OF_ANY_ACTION {
        length += postcard::to_slice(&header.action, rest.get_mut(length..)?).ok()?.len();
    }
    Some(MAGIC.len() + length)
}

fn fill(tensor: &Tensor, seed: u64, count: &mut u64, place: &mut [u8]) {
    let mut number = || {
        *count += 1;
        (uniform(seed, *count) * 2.0 - 1.0) as f32
    };
    if tensor.element == Element::Int8 {
        for byte in place {
            *byte = (number() * 127.0) as i8 as u8;
        }
        return;
    }
    // Variance of one over the number of inputs; the scales give the bytes the same.
    let spread = libm::sqrtf(3.0 / tensor.columns as f32);
    let (centre, half) = match tensor.name.field() {
        "gain" | "std" => (1.0, 0.2),
        "scale" => (spread / 127.0, 0.2 * spread / 127.0),
        "weight" => (0.0, spread),
        "embedding" => (0.0, 1.0),
        _ => (0.0, 0.1),
    };
    for bytes in place.as_chunks_mut::<4>().0 {
        *bytes = (centre + half * number()).to_le_bytes();
    }
}
