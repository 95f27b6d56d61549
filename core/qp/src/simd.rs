//! Loops compiled for the vector unit that the processor turns out to have.

#[cfg(target_arch = "x86_64")]
cpufeatures::new!(avx2, "avx2");

/// Whether AVX2 instructions may be executed. The processor is asked once; later calls read a byte.
#[cfg(target_arch = "x86_64")]
#[inline]
pub(crate) fn has_avx2() -> bool {
    avx2::get()
}

/// Compiles a function a second time with AVX2 on x86-64 and chooses between the two at run time;
/// elsewhere it stays as written.
///
/// The results have the same bits: the compiler neither contracts nor reassociates. What the body
/// calls gets AVX2 where it is inlined, so hot helpers are `#[inline(always)]`.
macro_rules! multiversion {
    (
        $(#[$attribute:meta])*
        $visibility:vis fn $name:ident<$(const $size:ident: usize),+>(
            $($argument:ident: $kind:ty),+ $(,)?
        ) $(-> $result:ty)? $body:block
    ) => {
        #[cfg(not(target_arch = "x86_64"))]
        $(#[$attribute])*
        $visibility fn $name<$(const $size: usize),+>(
            $($argument: $kind),+
        ) $(-> $result)? $body

        #[cfg(target_arch = "x86_64")]
        $(#[$attribute])*
        $visibility fn $name<$(const $size: usize),+>($($argument: $kind),+) $(-> $result)? {
            #[inline(always)]
            fn body<$(const $size: usize),+>($($argument: $kind),+) $(-> $result)? $body

            if $crate::simd::has_avx2() {
                #[target_feature(enable = "avx2")]
                fn with_avx2<$(const $size: usize),+>($($argument: $kind),+) $(-> $result)? {
                    body($($argument),+)
                }
                // SAFETY: the processor has AVX2, all that the function asks for.
                #[allow(unsafe_code)]
                let result = unsafe { with_avx2($($argument),+) };
                return result;
            }
            // Not inlined: its frame is not below that of the version with AVX2.
            #[inline(never)]
            fn portable<$(const $size: usize),+>($($argument: $kind),+) $(-> $result)? {
                body($($argument),+)
            }
            portable($($argument),+)
        }
    };
}
pub(crate) use multiversion;

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    extern crate std;

    #[test]
    fn the_processor_is_asked() {
        assert_eq!(super::has_avx2(), std::is_x86_feature_detected!("avx2"));
    }
}
