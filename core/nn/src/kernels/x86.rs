//! AVX2, AVX-VNNI and AVX-512-VNNI, and how to know whether they are there without `std`.

use super::{BATCH, Rows, Sums, TILE, Vectors, portable};
use core::arch::x86_64::*;
use core::sync::atomic::{AtomicU8, Ordering};

/// Which vector instructions processor and operating system offer.
#[derive(Clone, Copy)]
pub(super) struct Features {
    pub avx2: bool,
    pub avx_vnni: bool,
    pub avx512_vnni: bool,
}

/// Answer of `cpuid`, asked once: under a hypervisor each question costs microseconds. Bit 7: was
/// asked.
static KNOWN: AtomicU8 = AtomicU8::new(0);

pub(super) fn features() -> Features {
    let mut known = KNOWN.load(Ordering::Relaxed);
    if known == 0 {
        let Features { avx2, avx_vnni, avx512_vnni } = ask();
        known = 0x80 | u8::from(avx2) | u8::from(avx_vnni) << 1 | u8::from(avx512_vnni) << 2;
        // Threads that ask at the same time hear the same.
        KNOWN.store(known, Ordering::Relaxed);
    }
    Features { avx2: known & 1 != 0, avx_vnni: known & 2 != 0, avx512_vnni: known & 4 != 0 }
}

/// Bits by Intel's manual, volume 2, CPUID.
fn ask() -> Features {
    // Miri interprets no `cpuid`: it has the instructions that it was built with.
    if cfg!(miri) {
        return Features {
            avx2: cfg!(target_feature = "avx2"),
            avx_vnni: cfg!(target_feature = "avxvnni"),
            avx512_vnni: cfg!(all(target_feature = "avx512vl", target_feature = "avx512vnni")),
        };
    }
    let none = Features { avx2: false, avx_vnni: false, avx512_vnni: false };
    let bit = |word: u32, bit: u32| word >> bit & 1 == 1;
    if __cpuid(0).eax < 7 {
        return none;
    }
    // OSXSAVE (the operating system uses XSAVE, `xgetbv` may be executed) and AVX.
    let one = __cpuid(1);
    if !(bit(one.ecx, 27) && bit(one.ecx, 28)) {
        return none;
    }
    // SAFETY: OSXSAVE says that the instruction exists.
    let saved = unsafe { saved_registers() };
    if saved & VECTORS != VECTORS {
        return none;
    }
    let seven = __cpuid_count(7, 0);
    let avx2 = bit(seven.ebx, 5);
    let avx_vnni = avx2 && seven.eax >= 1 && bit(__cpuid_count(7, 1).eax, 4);
    // AVX512F, AVX512VL and AVX512_VNNI.
    let avx512 = bit(seven.ebx, 16) && bit(seven.ebx, 31) && bit(seven.ecx, 11);
    let avx512_vnni = avx2 && avx512 && saved & LARGE_VECTORS == LARGE_VECTORS;
    Features { avx2, avx_vnni, avx512_vnni }
}

/// XMM and YMM in XCR0: the operating system saves them.
const VECTORS: u64 = 0b110;

/// XMM, YMM, masks and ZMM in XCR0.
const LARGE_VECTORS: u64 = 0b1110_0110;

/// Register XCR0.
#[target_feature(enable = "xsave")]
fn saved_registers() -> u64 {
    // SAFETY: register 0 exists wherever the instruction does.
    unsafe { _xgetbv(0) }
}

/// Operands of a product, cut to the rows and columns that all of them have in full.
struct Full<'a, const T: usize> {
    rows: Rows<'a>,
    bytes: [&'a [u8]; T],
    operand_i16: [&'a [i16]; T],
    columns: usize,
    /// 128 times each vector's sum over the columns that are taken 32 at a time.
    excess: [i32; T],
}

impl<'a, const T: usize> Full<'a, T> {
    /// Cuts the columns to what every vector has, the rows to those that have as many. `operand_i16`
    /// counts only where the kernel reads it.
    #[inline(always)]
    fn new(rows: Rows<'a>, columns: usize, vectors: Vectors<'a>, operand_i16: bool) -> Self {
        let mut full =
            Full { rows, bytes: [&[]; T], operand_i16: [&[]; T], columns, excess: [0; T] };
        for (t, (bytes, wides)) in full.bytes.iter_mut().zip(&mut full.operand_i16).enumerate() {
            (*bytes, *wides) = vectors.vector(t, columns);
            full.columns = full.columns.min(bytes.len());
            if operand_i16 {
                full.columns = full.columns.min(wides.len());
            }
        }
        let spare = rows.bytes.len().checked_sub(full.columns);
        let whole = spare.map_or(0, |spare| spare.checked_div(rows.stride).map_or(TILE, |n| n + 1));
        full.rows.count = rows.count.min(whole).min(TILE);
        if !operand_i16 {
            for (excess, bytes) in full.excess.iter_mut().zip(full.bytes) {
                let taken = bytes.get(..full.columns / 32 * 32).unwrap_or_default();
                *excess = 128 * taken.iter().map(|byte| i32::from(*byte as i8)).sum::<i32>();
            }
        }
        full
    }

    /// Adds the products of the columns from `from` on, fewer than a vector register takes, and
    /// puts the sums of `R` rows where they belong.
    // Not inlined: all instruction sets share it.
    #[inline(never)]
    fn finish<const R: usize>(
        &self,
        from: usize,
        mut found: [[i32; R]; T],
        first: usize,
        sums: &mut Sums,
    ) {
        if from < self.columns {
            for (found, x) in found.iter_mut().zip(&self.bytes) {
                let x = x.get(from..self.columns).unwrap_or_default();
                for (r, found) in found.iter_mut().enumerate() {
                    let row = self.rows.row(first + r, self.columns);
                    *found += portable::dot(row.get(from..).unwrap_or_default(), x);
                }
            }
        }
        for (sums, found) in sums.iter_mut().zip(&found) {
            if let Some((_, rest)) = sums.split_at_mut_checked(first)
                && let Some(place) = rest.first_chunk_mut::<R>()
            {
                *place = *found;
            }
        }
    }
}

/// Sums of the eight lanes of each part.
#[inline]
#[target_feature(enable = "avx2")]
fn lanes<const R: usize>(parts: &[__m256i; R]) -> [i32; R] {
    let mut out = [0; R];
    for (out, parts) in out.chunks_mut(4).zip(parts.chunks(4)) {
        let part = |i: usize| parts.get(i).copied().unwrap_or(_mm256_setzero_si256());
        let sums = _mm256_hadd_epi32(
            _mm256_hadd_epi32(part(0), part(1)),
            _mm256_hadd_epi32(part(2), part(3)),
        );
        let sums = _mm_add_epi32(_mm256_castsi256_si128(sums), _mm256_extracti128_si256::<1>(sums));
        // SAFETY: both are four numbers of 32 bits, the lowest first.
        let all = unsafe { core::mem::transmute::<__m128i, [i32; 4]>(sums) };
        match out.first_chunk_mut::<4>() {
            Some(out) => *out = all,
            None => out.iter_mut().zip(all).for_each(|(out, sum)| *out = sum),
        }
    }
    out
}

/// Products of a whole tile, in groups of as many rows as leave the sums in registers: a function
/// for either instruction set.
macro_rules! products {
    ($(#[$doc:meta])* $name:ident, $all:ident, $rows:ident, $features:literal, $operand_i16:literal,
        $groups:expr) => {
        $(#[$doc])*
        #[target_feature(enable = $features)]
        pub(super) fn $name(rows: Rows, columns: usize, vectors: Vectors, sums: &mut Sums) {
            const R: [usize; BATCH] = $groups;
            match vectors.count {
                0 => {}
                1 => $all::<{ R[0] }, 1>(rows, columns, vectors, sums),
                2 => $all::<{ R[1] }, 2>(rows, columns, vectors, sums),
                3 => $all::<{ R[2] }, 3>(rows, columns, vectors, sums),
                4 => $all::<{ R[3] }, 4>(rows, columns, vectors, sums),
                _ => $all::<{ R[4] }, 5>(rows, columns, vectors, sums),
            }
        }

        #[target_feature(enable = $features)]
        fn $all<const R: usize, const T: usize>(
            rows: Rows,
            columns: usize,
            vectors: Vectors,
            sums: &mut Sums,
        ) {
            let full = Full::<T>::new(rows, columns, vectors, $operand_i16);
            let mut first = 0;
            // Bound: tile.
            while first + R <= full.rows.count {
                $rows::<R, T>(&full, first, sums);
                first += R;
            }
            // Bound: tile.
            while first < full.rows.count {
                $rows::<1, T>(&full, first, sums);
                first += 1;
            }
        }
    };
}

products! {
    /// Bytes of both widened to 16 bits, multiplied and added in pairs: 16 columns a step. Two rows
    /// and five vectors keep ten sums in registers; each row is widened once for all vectors.
    ///
    /// The processor must have AVX2.
    avx2, avx2_all, avx2_rows, "avx2", true, [4, 4, 2, 2, 2]
}

#[inline]
#[target_feature(enable = "avx2")]
fn avx2_rows<const R: usize, const T: usize>(full: &Full<T>, first: usize, sums: &mut Sums) {
    let rows = full.rows.bytes.as_ptr().wrapping_add(first * full.rows.stride);
    let mut parts = [[_mm256_setzero_si256(); R]; T];
    let mut at = 0;
    // Bound: columns.
    while at + 16 <= full.columns {
        let mut w = [_mm256_setzero_si256(); R];
        for r in 0..R {
            let row = rows.wrapping_add(r * full.rows.stride + at);
            // SAFETY: rows `first..first + R` are below `rows.count`, those of which
            // `Full::new` found all columns to be there, and `at + 16` is no more than the columns.
            // Loads need no alignment.
            w[r] = unsafe { _mm256_cvtepi8_epi16(_mm_loadu_si128(row.cast())) };
        }
        for t in 0..T {
            // SAFETY: as above, of the widened vectors.
            let x =
                unsafe { _mm256_loadu_si256(full.operand_i16[t].as_ptr().wrapping_add(at).cast()) };
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
    full.finish(at, found, first, sums);
}

products! {
    /// Products of unsigned with signed bytes, added in fours: 32 columns a step. A row's bytes are
    /// made unsigned by adding 128, and 128 times the vector's sum is taken off again.
    ///
    /// The processor must have AVX2 and AVX-VNNI.
    avx_vnni, vnni_all, vnni_rows, "avx2,avxvnni", false, [8, 4, 2, 2, 2]
}

products! {
    /// Products of unsigned with signed bytes by AVX-512's instruction, of vectors of 256 bits.
    ///
    /// The processor must have AVX2, AVX-512-VL and AVX-512-VNNI.
    avx512_vnni, vnni512_all, vnni512_rows, "avx2,avx512vl,avx512vnni", false, [8, 4, 2, 2, 2]
}

/// Products of a group of rows with unsigned bytes: a function for either instruction.
macro_rules! unsigned_rows {
    ($name:ident, $features:literal, $add_products:ident) => {
        #[inline]
        #[target_feature(enable = $features)]
        fn $name<const R: usize, const T: usize>(full: &Full<T>, first: usize, sums: &mut Sums) {
            let rows = full.rows.bytes.as_ptr().wrapping_add(first * full.rows.stride);
            let offset = _mm256_set1_epi8(-128);
            let mut parts = [[_mm256_setzero_si256(); R]; T];
            let mut at = 0;
            // Bound: columns.
            while at + 32 <= full.columns {
                let mut w = [_mm256_setzero_si256(); R];
                for r in 0..R {
                    let row = rows.wrapping_add(r * full.rows.stride + at);
                    // SAFETY: rows `first..first + R` are below `rows.count`, those of which
                    // `Full::new` found all columns to be there, and `at + 32` is no more than the
                    // columns. Loads need no alignment.
                    w[r] = _mm256_xor_si256(unsafe { _mm256_loadu_si256(row.cast()) }, offset);
                }
                for t in 0..T {
                    // SAFETY: as above, of the vectors.
                    let x = unsafe {
                        _mm256_loadu_si256(full.bytes[t].as_ptr().wrapping_add(at).cast())
                    };
                    for r in 0..R {
                        parts[t][r] = $add_products(parts[t][r], w[r], x);
                    }
                }
                at += 32;
            }
            let mut found = [[0; R]; T];
            for ((found, parts), excess) in found.iter_mut().zip(&parts).zip(full.excess) {
                *found = lanes(parts);
                // The longest vectors' sums of unsigned products pass 2^31, the differences do not.
                for found in found {
                    *found = found.wrapping_sub(excess);
                }
            }
            full.finish(at, found, first, sums);
        }
    };
}

unsigned_rows!(vnni_rows, "avx2,avxvnni", _mm256_dpbusd_avx_epi32);
unsigned_rows!(vnni512_rows, "avx2,avx512vl,avx512vnni", _mm256_dpbusd_epi32);
