//! The learned models that an image carries, each in a section of its own: the linker scripts keep
//! them apart from code and constants, and a symbol tells each one's size.

use remora_firmware::Models;

const FILES: [&[u8]; 2] = [
    include_bytes!("../../../fixtures/models/euler.model"),
    include_bytes!("../../../fixtures/models/rk4.model"),
];

/// The bytes of one of [`FILES`] as an array.
const fn file<const N: usize>(index: usize) -> [u8; N] {
    match FILES[index].first_chunk() {
        Some(bytes) => *bytes,
        None => panic!("an array is as long as its file"),
    }
}

#[unsafe(no_mangle)]
#[cfg_attr(target_os = "none", unsafe(link_section = ".model.euler"))]
static REMORA_MODEL_EULER: [u8; FILES[0].len()] = file(0);

#[unsafe(no_mangle)]
#[cfg_attr(target_os = "none", unsafe(link_section = ".model.rk4"))]
static REMORA_MODEL_RK4: [u8; FILES[1].len()] = file(1);

/// The models.
pub const MODELS: Models<'static> = Models { euler: &REMORA_MODEL_EULER, rk4: &REMORA_MODEL_RK4 };
