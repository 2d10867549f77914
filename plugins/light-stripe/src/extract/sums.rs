//! What a row's centroid is made of.

#![allow(unsafe_code, reason = "vector instructions, called only where the processor was seen to have them")]

use super::runs::Run;

/// What a row's centroid and its uncertainty are made of: whole numbers, all of them exact.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Sums {
    /// Of the grey levels.
    pub(super) levels: f64,
    /// Of level times position, counted from the run's start.
    pub(super) first: f64,
    /// Of level times position squared.
    pub(super) second: f64,
    /// The brightest level.
    pub(super) peak: f64,
}

/// The sums of a run of a row, one pixel after the other.
#[inline(never)]
pub(super) fn of_any(run: Run, pixels: &[u8]) -> Sums {
    let lit = pixels.get(usize::from(run.start)..usize::from(run.end)).unwrap_or_default();
    let (mut levels, mut first, mut second, mut peak) = (0, 0, 0, 0);
    for (position, pixel) in (0_u64..).zip(lit) {
        let level = u64::from(*pixel);
        levels += level;
        first += level * position;
        second += level * position * position;
        peak = peak.max(*pixel);
    }
    Sums { levels: levels as f64, first: first as f64, second: second as f64, peak: f64::from(peak) }
}

/// Runs no longer than this are added up in one vector.
#[cfg(target_arch = "x86_64")]
const SHORT: usize = 16;

/// The sums of a run of a row, a short run's all at once.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
pub(super) fn of_short(run: Run, pixels: &[u8]) -> Sums {
    use std::arch::x86_64::{
        __m128d, __m128i, _mm_add_epi32, _mm_and_si128, _mm_andnot_si128, _mm_cmpgt_epi8, _mm_cvtsd_f64,
        _mm_hadd_epi32, _mm_loadu_si128, _mm_madd_epi16, _mm_maddubs_epi16, _mm_min_epu8, _mm_minpos_epu16,
        _mm_set1_epi8, _mm_set1_epi16, _mm_setr_epi8, _mm_setr_epi32, _mm_slli_epi32, _mm_srli_epi16,
        _mm_sub_epi32, _mm_unpackhi_pd, _mm_xor_si128, _mm256_castpd256_pd128, _mm256_cvtepi32_pd,
        _mm256_extractf128_pd,
    };
    let length = usize::from(run.length());
    let window = pixels.get(usize::from(run.start)..).and_then(<[u8]>::first_chunk::<SHORT>);
    let Some(window) = window.filter(|_| length <= SHORT) else { return of_any(run, pixels) };
    // SAFETY: the 16 bytes are there.
    let all = unsafe { _mm_loadu_si128(window.as_ptr().cast()) };
    let positions = _mm_setr_epi8(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    let lit = _mm_and_si128(all, _mm_cmpgt_epi8(_mm_set1_epi8(length as i8), positions));
    let fours = |weights: __m128i| _mm_madd_epi16(_mm_maddubs_epi16(lit, weights), _mm_set1_epi16(1));
    // Squares up to 225 do not fit a signed byte: those of the distances from position 8 do, and p^2 = (p - 8)^2 + 16 p - 64.
    let from_8 = _mm_setr_epi8(64, 49, 36, 25, 16, 9, 4, 1, 0, 1, 4, 9, 16, 25, 36, 49);
    let (levels, first) = (fours(_mm_set1_epi8(1)), fours(positions));
    let square = _mm_add_epi32(fours(from_8), _mm_slli_epi32::<4>(first));
    let second = _mm_sub_epi32(square, _mm_slli_epi32::<6>(levels));
    // The instruction finds the least of eight, so what is brightest has to be darkest.
    let dark = _mm_xor_si128(lit, _mm_set1_epi8(-1));
    let darkest = _mm_minpos_epu16(_mm_min_epu8(dark, _mm_srli_epi16::<8>(dark)));
    let peak = _mm_andnot_si128(darkest, _mm_setr_epi32(255, 0, 0, 0));
    let sums = _mm_hadd_epi32(_mm_hadd_epi32(levels, first), _mm_hadd_epi32(second, peak));
    let sums = _mm256_cvtepi32_pd(sums);
    let [low, high] = [_mm256_castpd256_pd128(sums), _mm256_extractf128_pd::<1>(sums)];
    let one = |two: __m128d| _mm_cvtsd_f64(two);
    let other = |two: __m128d| _mm_cvtsd_f64(_mm_unpackhi_pd(two, two));
    Sums { levels: one(low), first: other(low), second: one(high), peak: other(high) }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn short_and_long_runs_are_summed_alike(
            row in prop::collection::vec(prop_oneof![any::<u8>(), Just(255_u8)], 1..60),
            from in 0_usize..60,
            length in 1_usize..40,
        ) {
            let start = from.min(row.len() - 1);
            let end = (start + length).min(row.len());
            let run = Run { start: start as u16, end: end as u16 };
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the processor was seen to have these instructions.
                prop_assert_eq!(unsafe { of_short(run, &row) }, of_any(run, &row));
            }
        }
    }
}
