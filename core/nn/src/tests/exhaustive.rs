//! Integer arithmetic over all of its values, where there are few enough; proofs by counting.

use super::*;
use crate::arithmetic::{exp, quantise};
use crate::kernels::{BATCH, Rows, Sums, TILE, Vectors};

/// The products of the first rows of a matrix with the first vectors.
fn products(
    kernel: Kernel,
    (matrix, rows): (&[u8], usize),
    vectors: &[u8],
    columns: usize,
) -> Sums {
    let mut operand = vec![0; vectors.len()];
    for (bytes, operand) in vectors.chunks(columns).zip(operand.chunks_mut(columns)) {
        kernel.prepare(bytes, operand);
    }
    let count = vectors.len() / columns;
    let mut sums = [[0; TILE]; BATCH];
    let rows = Rows { bytes: matrix, stride: columns, count: rows };
    let vectors = Vectors { bytes: vectors, operand_i16: &operand, stride: columns, count };
    kernel.products(rows, columns, vectors, &mut sums);
    sums
}

/// As many vectors or rows as bytes, each zero but for its byte at one place.
fn ones(bytes: &[u8], place: usize, columns: usize) -> Vec<u8> {
    let mut all = vec![0; bytes.len() * columns];
    for (row, byte) in all.chunks_mut(columns).zip(bytes) {
        row[place] = *byte;
    }
    all
}

/// All pairs of bytes, at every place of two registers and of what is left behind them, by every kernel.
// Verifies REM-LRN-004.
#[test]
fn every_product_of_two_bytes_is_exact() {
    const COLUMNS: usize = 67;
    let bytes: Vec<u8> = (0..=255).collect();
    for kernel in Kernel::available() {
        for place in 0..COLUMNS {
            for weights in bytes.chunks(TILE) {
                let matrix = ones(weights, place, COLUMNS);
                for inputs in bytes.chunks(BATCH) {
                    let vectors = ones(inputs, place, COLUMNS);
                    let sums = products(kernel, (&matrix, weights.len()), &vectors, COLUMNS);
                    for (x, sums) in inputs.iter().zip(sums) {
                        for (w, sum) in weights.iter().zip(sums) {
                            let exact = i32::from(*w as i8) * i32::from(*x as i8);
                            assert_eq!(sum, exact, "{} {w} {x} at {place}", kernel.name());
                        }
                    }
                }
            }
        }
    }
}

/// The longest product that is promised to be exact, of the bytes that make it largest.
// Verifies REM-LRN-004.
#[test]
fn the_longest_sums_do_not_overflow() {
    const COLUMNS: usize = 131_071;
    let ends = [-128i8, -127, -1, 1, 127];
    let rows: Vec<u8> = ends.iter().flat_map(|x| vec![*x as u8; COLUMNS]).collect();
    for kernel in Kernel::available() {
        let sums = products(kernel, (&rows, ends.len()), &rows, COLUMNS);
        for (x, sums) in ends.iter().zip(sums) {
            for (w, sum) in ends.iter().zip(sums) {
                let exact = i64::from(*w) * i64::from(*x) * COLUMNS as i64;
                assert_eq!(i64::from(sum), exact, "{} {w} {x}", kernel.name());
            }
        }
    }
}

/// That a number alone becomes the largest byte, or is marked; for numbers of these bits.
fn quantises_alone(bits: impl Iterator<Item = u32>) {
    for bits in bits {
        let (x, mut q) = (f32::from_bits(bits), [0]);
        let scale = quantise(&[x], &mut q);
        if !x.is_finite() {
            assert!(scale.is_nan(), "{x:e}");
        } else if x.abs() < 1e-30 {
            assert_eq!((scale, q), (0.0, [0]), "{x:e}");
        } else {
            assert_eq!(q[0] as i8, if x < 0.0 { -127 } else { 127 }, "{x:e}");
            // In double precision: 127 steps of the largest number's scale may be beyond it.
            let back = f64::from(scale) * 127.0 / f64::from(x.abs());
            assert!((back - 1.0).abs() < 3e-7, "{x:e}");
        }
    }
}

/// Every exponent with a thousand mantissas, of either sign.
#[test]
fn a_number_of_any_size_is_quantised() {
    quantises_alone((0..=u32::MAX).step_by(4093));
}

#[test]
#[ignore = "a minute; ci/memory.sh runs it"]
fn every_number_is_quantised() {
    quantises_alone(0..=u32::MAX);
}

/// Numbers below the largest: a byte that grows with them, is never -128, and is within half a step.
#[test]
fn steps_are_even_below_any_largest_number() {
    for mantissa in 0..256 {
        let largest = f32::from_bits(0x3f80_0000 | mantissa << 15);
        let mut before = -127;
        for k in -4096..=4096 {
            let x = largest * (k as f32 / 4096.0);
            let mut q = [0; 2];
            let scale = quantise(&[largest, x], &mut q);
            let byte = q[1] as i8;
            assert!(byte >= before, "{largest} {x}");
            assert!((f32::from(byte) * scale - x).abs() <= 0.50001 * scale, "{largest} {x}");
            before = byte;
        }
        assert_eq!(before, 127);
    }
}

/// Every number that the exponential is asked for: to 2 ulp, and never subnormal.
#[test]
#[ignore = "a minute; ci/memory.sh runs it"]
fn every_exponential_is_close() {
    let mut before = 1.0;
    for bits in (-0.0f32).to_bits()..=(-87.0f32).to_bits() {
        let x = f32::from_bits(bits);
        let (found, exact) = (exp(x), libm::exp(f64::from(x)));
        assert!((f64::from(found) / exact - 1.0).abs() < 2.5e-7, "{x:e}");
        assert!(found.is_normal() && found <= before * 1.000_001, "{x:e}");
        before = found;
    }
}

/// All messages of two bytes, beside division bit by bit.
#[test]
fn checksums_of_all_short_messages_are_those_of_the_polynomial() {
    for message in 0..=u16::MAX {
        let bytes = message.to_le_bytes();
        let mut value = !0u32;
        for byte in bytes {
            value ^= u32::from(byte);
            for _ in 0..8 {
                value = value >> 1 ^ if value & 1 == 1 { 0xedb8_8320 } else { 0 };
            }
        }
        assert_eq!(Crc32::of(&bytes), !value, "{message}");
    }
}

/// Whatever 16 bits a header says: dimensions within their limits that fit each other, or a refusal.
#[test]
fn dimensions_are_sound_whatever_a_header_says() {
    let sound = header(Precision::F32, Layout::Separate, Decoder::Flow { steps: 1 }, TINY);
    let mut taken = [0; 5];
    for value in 0..=u16::MAX {
        let changes: [fn(&mut Header, u16); 5] = [
            |h, value| (h.width, h.heads) = (value, 4),
            |h, value| h.heads = value,
            |h, value| h.layers = value,
            |h, value| h.nodes = value,
            |h, value| h.chunk = value,
        ];
        for (change, taken) in changes.iter().zip(&mut taken) {
            let mut header = sound.clone();
            change(&mut header, value);
            let Ok(size) = header.dimensions() else { continue };
            *taken += 1;
            assert_eq!(size.head_width * size.heads, size.width);
            assert!(size.width <= limit::WIDTH && size.heads <= limit::HEADS);
            assert!(size.layers <= limit::LAYERS && size.nodes <= limit::NODES);
            let mut bytes = 0u64;
            tensors(&header, |tensor| bytes += tensor.bytes() as u64).unwrap();
            assert!(bytes < 1 << 32);
        }
    }
    assert!(taken.iter().all(|taken| *taken > 0), "{taken:?}");
    assert!(taken[0] <= limit::WIDTH && taken[2] == limit::LAYERS && taken[3] == limit::NODES);
}
