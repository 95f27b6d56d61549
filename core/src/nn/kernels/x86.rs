//! AVX2 and AVX-VNNI, and how to know whether they are there without `std`.

use super::{BATCH, Rows, Sums, TILE, Vectors, portable};
use core::arch::x86_64::*;
use core::sync::atomic::{AtomicU8, Ordering};

/// Which vector instructions processor and operating system offer.
#[derive(Clone, Copy)]
pub(super) struct Features {
    pub avx2: bool,
    pub avx_vnni: bool,
}

/// What `cpuid` said, asked once: under a hypervisor each question costs microseconds. Bit 7: was
/// asked.
static KNOWN: AtomicU8 = AtomicU8::new(0);

pub(super) fn features() -> Features {
    let mut known = KNOWN.load(Ordering::Relaxed);
    if known == 0 {
        let Features { avx2, avx_vnni } = ask();
        known = 0x80 | u8::from(avx2) | u8::from(avx_vnni) << 1;
        // Whoever asks at the same time hears the same.
        KNOWN.store(known, Ordering::Relaxed);
    }
    Features { avx2: known & 1 != 0, avx_vnni: known & 2 != 0 }
}

/// Bits by Intel's manual, volume 2, CPUID.
fn ask() -> Features {
    let none = Features { avx2: false, avx_vnni: false };
    let bit = |word: u32, bit: u32| word >> bit & 1 == 1;
    if __cpuid(0).eax < 7 {
        return none;
    }
    // OSXSAVE (the operating system uses XSAVE, `xgetbv` may be executed) and AVX.
    let one = __cpuid(1);
    // SAFETY: OSXSAVE says that the instruction exists.
    if !(bit(one.ecx, 27) && bit(one.ecx, 28) && unsafe { saves_vectors() }) {
        return none;
    }
    let seven = __cpuid_count(7, 0);
    let avx2 = bit(seven.ebx, 5);
    let avx_vnni = avx2 && seven.eax >= 1 && bit(__cpuid_count(7, 1).eax, 4);
    Features { avx2, avx_vnni }
}

/// Whether the operating system saves the vector registers in whole: XMM and YMM in XCR0.
#[target_feature(enable = "xsave")]
fn saves_vectors() -> bool {
    // SAFETY: register 0 exists wherever the instruction does.
    unsafe { _xgetbv(0) & 6 == 6 }
}

/// A batch's rows and vectors, cut to what all of them have.
struct Cut<'a, const R: usize, const T: usize> {
    rows: [&'a [u8]; R],
    bytes: [&'a [u8]; T],
    wide: [&'a [i16]; T],
    length: usize,
}

impl<'a, const R: usize, const T: usize> Cut<'a, R, T> {
    /// Rows from `first` on. `wide` counts only where the kernel reads it.
    #[inline(always)]
    fn new(
        rows: &Rows<'a>,
        first: usize,
        vectors: &Vectors<'a>,
        columns: usize,
        wide: bool,
    ) -> Self {
        let mut cut = Cut { rows: [&[]; R], bytes: [&[]; T], wide: [&[]; T], length: columns };
        for (r, row) in cut.rows.iter_mut().enumerate() {
            *row = rows.row(first + r, columns);
            cut.length = cut.length.min(row.len());
        }
        for (t, (bytes, wides)) in cut.bytes.iter_mut().zip(&mut cut.wide).enumerate() {
            (*bytes, *wides) = vectors.vector(t, columns);
            cut.length = cut.length.min(bytes.len());
            if wide {
                cut.length = cut.length.min(wides.len());
            }
        }
        cut
    }

    /// Adds the products of the columns from `from` on, fewer than a vector register takes, and
    /// puts the sums where they belong.
    #[inline(always)]
    fn finish(&self, from: usize, mut found: [[i32; R]; T], first: usize, sums: &mut Sums) {
        for t in 0..T {
            for r in 0..R {
                if from < self.length {
                    let row = self.rows[r].get(from..self.length).unwrap_or_default();
                    let x = self.bytes[t].get(from..self.length).unwrap_or_default();
                    found[t][r] += portable::dot(row, x);
                }
            }
        }
        for (sums, found) in sums.iter_mut().zip(&found) {
            if let Some(place) = sums.get_mut(first..first + R) {
                place.copy_from_slice(found);
            }
        }
    }
}

/// Sums of the eight lanes of each: `[r]` of the result is the sum of `parts[r]`.
#[inline]
#[target_feature(enable = "avx2")]
fn lanes<const R: usize>(parts: &[__m256i; R]) -> [i32; R] {
    let part = |i: usize| parts.get(i).copied().unwrap_or(_mm256_setzero_si256());
    let sums =
        _mm256_hadd_epi32(_mm256_hadd_epi32(part(0), part(1)), _mm256_hadd_epi32(part(2), part(3)));
    let sums = _mm_add_epi32(_mm256_castsi256_si128(sums), _mm256_extracti128_si256::<1>(sums));
    let low = _mm_cvtsi128_si64(sums);
    let high = _mm_extract_epi64::<1>(sums);
    let all = [low as i32, (low >> 32) as i32, high as i32, (high >> 32) as i32];
    let mut out = [0; R];
    out.iter_mut().zip(all).for_each(|(out, sum)| *out = sum);
    out
}

/// Bytes of both widened to 16 bits, multiplied and added in pairs: 16 columns a step. Two rows and
/// five vectors keep ten sums in registers, and each row is widened once for all vectors.
///
/// # Safety
/// The processor must have AVX2.
#[target_feature(enable = "avx2")]
pub(super) fn avx2(rows: Rows, columns: usize, vectors: Vectors, sums: &mut Sums) {
    match vectors.count.min(BATCH) {
        0 => {}
        1 => avx2_all::<4, 1>(rows, columns, vectors, sums),
        2 => avx2_all::<4, 2>(rows, columns, vectors, sums),
        3 => avx2_all::<2, 3>(rows, columns, vectors, sums),
        4 => avx2_all::<2, 4>(rows, columns, vectors, sums),
        _ => avx2_all::<2, 5>(rows, columns, vectors, sums),
    }
}

#[target_feature(enable = "avx2")]
fn avx2_all<const R: usize, const T: usize>(
    rows: Rows,
    columns: usize,
    vectors: Vectors,
    sums: &mut Sums,
) {
    let count = rows.count.min(TILE);
    let mut first = 0;
    while first + R <= count {
        avx2_rows::<R, T>(&rows, first, columns, &vectors, sums);
        first += R;
    }
    while first < count {
        avx2_rows::<1, T>(&rows, first, columns, &vectors, sums);
        first += 1;
    }
}

#[inline]
#[target_feature(enable = "avx2")]
fn avx2_rows<const R: usize, const T: usize>(
    rows: &Rows,
    first: usize,
    columns: usize,
    vectors: &Vectors,
    sums: &mut Sums,
) {
    let cut = Cut::<R, T>::new(rows, first, vectors, columns, true);
    let mut parts = [[_mm256_setzero_si256(); R]; T];
    let mut at = 0;
    while at + 16 <= cut.length {
        let mut w = [_mm256_setzero_si256(); R];
        for r in 0..R {
            // SAFETY: `at + 16` is within every row and vector of the cut; loads need no alignment.
            w[r] = unsafe {
                _mm256_cvtepi8_epi16(_mm_loadu_si128(cut.rows[r].as_ptr().add(at).cast()))
            };
        }
        for t in 0..T {
            // SAFETY: as above.
            let x = unsafe { _mm256_loadu_si256(cut.wide[t].as_ptr().add(at).cast()) };
            for r in 0..R {
                parts[t][r] = _mm256_add_epi32(parts[t][r], _mm256_madd_epi16(w[r], x));
            }
        }
        at += 16;
    }
    let mut found = [[0; R]; T];
    for (found, parts) in found.iter_mut().zip(&parts) {
        *found = lanes(parts);
    }
    cut.finish(at, found, first, sums);
}

/// Products of unsigned with signed bytes, added in fours: 32 columns a step. The vector's bytes
/// are made unsigned by adding 128, and 128 times the row's sum taken off again.
///
/// # Safety
/// The processor must have AVX2 and AVX-VNNI.
#[target_feature(enable = "avx2,avxvnni")]
pub(super) fn avx_vnni(rows: Rows, columns: usize, vectors: Vectors, sums: &mut Sums) {
    match vectors.count.min(BATCH) {
        0 => {}
        1 => vnni_all::<4, 1>(rows, columns, vectors, sums),
        2 => vnni_all::<4, 2>(rows, columns, vectors, sums),
        3 => vnni_all::<2, 3>(rows, columns, vectors, sums),
        4 => vnni_all::<2, 4>(rows, columns, vectors, sums),
        _ => vnni_all::<2, 5>(rows, columns, vectors, sums),
    }
}

#[target_feature(enable = "avx2,avxvnni")]
fn vnni_all<const R: usize, const T: usize>(
    rows: Rows,
    columns: usize,
    vectors: Vectors,
    sums: &mut Sums,
) {
    let count = rows.count.min(TILE);
    let mut first = 0;
    while first + R <= count {
        vnni_rows::<R, T>(&rows, first, columns, &vectors, sums);
        first += R;
    }
    while first < count {
        vnni_rows::<1, T>(&rows, first, columns, &vectors, sums);
        first += 1;
    }
}

#[inline]
#[target_feature(enable = "avx2,avxvnni")]
fn vnni_rows<const R: usize, const T: usize>(
    rows: &Rows,
    first: usize,
    columns: usize,
    vectors: &Vectors,
    sums: &mut Sums,
) {
    let cut = Cut::<R, T>::new(rows, first, vectors, columns, false);
    let offset = _mm256_set1_epi8(-128);
    let mut parts = [[_mm256_setzero_si256(); R]; T];
    let mut excess = [_mm256_setzero_si256(); R];
    let mut at = 0;
    while at + 32 <= cut.length {
        let mut w = [_mm256_setzero_si256(); R];
        for r in 0..R {
            // SAFETY: `at + 32` is within every row and vector of the cut; loads need no alignment.
            w[r] = unsafe { _mm256_loadu_si256(cut.rows[r].as_ptr().add(at).cast()) };
            excess[r] = _mm256_dpbusd_avx_epi32(excess[r], offset, w[r]);
        }
        for t in 0..T {
            // SAFETY: as above.
            let x = unsafe { _mm256_loadu_si256(cut.bytes[t].as_ptr().add(at).cast()) };
            let x = _mm256_xor_si256(x, offset);
            for r in 0..R {
                parts[t][r] = _mm256_dpbusd_avx_epi32(parts[t][r], x, w[r]);
            }
        }
        at += 32;
    }
    let mut found = [[0; R]; T];
    for (found, parts) in found.iter_mut().zip(&mut parts) {
        for r in 0..R {
            parts[r] = _mm256_sub_epi32(parts[r], excess[r]);
        }
        *found = lanes(parts);
    }
    cut.finish(at, found, first, sums);
}
