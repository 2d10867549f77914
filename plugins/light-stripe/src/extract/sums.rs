//! What a row's centroid is made of.

#![allow(unsafe_code, reason = "vector instructions that every processor of this kind has")]

use super::runs::Run;

/// What a row's centroid and its uncertainty are made of: sums of level, level times place, level times place squared, and the brightest.
pub(super) struct Sums {
    pub(super) peak: u8,
    pub(super) levels: i64,
    pub(super) first: i64,
    pub(super) second: i64,
}

impl Sums {
    /// Runs no longer than this are added up in vectors, with nothing to be guessed about their length.
    #[cfg(target_arch = "x86_64")]
    const SHORT: usize = 16;

    /// The sums of a run of a row, places counted from its start.
    #[inline]
    pub(super) fn of(run: Run, pixels: &[u8]) -> Self {
        let (start, end) = (usize::from(run.start), usize::from(run.end));
        #[cfg(target_arch = "x86_64")]
        if end - start <= Self::SHORT
            && let Some(Ok(window)) =
                pixels.get(start..start + Self::SHORT).map(<&[u8; Self::SHORT]>::try_from)
        {
            // SAFETY: every processor of this kind has SSE2.
            return unsafe { Self::of_short(end - start, window) };
        }
        let lit = pixels.get(start..end).unwrap_or_default();
        let mut sums = Self { peak: 0, levels: 0, first: 0, second: 0 };
        for (place, pixel) in (0_i64..).zip(lit) {
            let level = i64::from(*pixel);
            sums.levels += level;
            sums.first += level * place;
            sums.second += level * place * place;
            sums.peak = sums.peak.max(*pixel);
        }
        sums
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "sse2")]
    #[inline]
    fn of_short(length: usize, window: &[u8; Self::SHORT]) -> Self {
        use std::arch::x86_64::{
            __m128i, _mm_add_epi32, _mm_and_si128, _mm_cmpgt_epi8, _mm_cvtsi128_si32, _mm_cvtsi128_si64,
            _mm_madd_epi16, _mm_max_epu8, _mm_sad_epu8, _mm_set_epi64x, _mm_set1_epi8, _mm_setr_epi8,
            _mm_setr_epi16, _mm_setzero_si128, _mm_shuffle_epi32, _mm_srli_si128, _mm_unpackhi_epi8,
            _mm_unpacklo_epi8,
        };
        let pixels = u128::from_le_bytes(*window);
        let all = _mm_set_epi64x((pixels >> 64) as i64, pixels as i64);
        let places = _mm_setr_epi8(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        let lit = _mm_and_si128(all, _mm_cmpgt_epi8(_mm_set1_epi8(length as i8), places));
        let zero = _mm_setzero_si128();
        let (low, high) = (_mm_unpacklo_epi8(lit, zero), _mm_unpackhi_epi8(lit, zero));
        let weighed = |of_low: __m128i, of_high: __m128i| -> i64 {
            let quads = _mm_add_epi32(_mm_madd_epi16(low, of_low), _mm_madd_epi16(high, of_high));
            let pairs = _mm_add_epi32(quads, _mm_shuffle_epi32::<0b0100_1110>(quads));
            let sum = _mm_add_epi32(pairs, _mm_shuffle_epi32::<0b1011_0001>(pairs));
            i64::from(_mm_cvtsi128_si32(sum))
        };
        let eights = _mm_sad_epu8(lit, zero);
        let of_8 = _mm_max_epu8(lit, _mm_srli_si128::<8>(lit));
        let of_4 = _mm_max_epu8(of_8, _mm_srli_si128::<4>(of_8));
        let of_2 = _mm_max_epu8(of_4, _mm_srli_si128::<2>(of_4));
        let of_1 = _mm_max_epu8(of_2, _mm_srli_si128::<1>(of_2));
        Self {
            peak: _mm_cvtsi128_si32(of_1) as u8,
            levels: _mm_cvtsi128_si64(eights) + _mm_cvtsi128_si64(_mm_srli_si128::<8>(eights)),
            first: weighed(
                _mm_setr_epi16(0, 1, 2, 3, 4, 5, 6, 7),
                _mm_setr_epi16(8, 9, 10, 11, 12, 13, 14, 15),
            ),
            second: weighed(
                _mm_setr_epi16(0, 1, 4, 9, 16, 25, 36, 49),
                _mm_setr_epi16(64, 81, 100, 121, 144, 169, 196, 225),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn short_and_long_runs_are_summed_alike(
            row in prop::collection::vec(any::<u8>(), 1..60), from in 0_usize..60, length in 1_usize..40,
        ) {
            let start = from.min(row.len() - 1);
            let end = (start + length).min(row.len());
            let sums = Sums::of(Run { start: start as u16, end: end as u16 }, &row);
            let lit = row[start..end].iter().enumerate().map(|(place, level)| (place as i64, i64::from(*level)));
            prop_assert_eq!(sums.levels, lit.clone().map(|(_, level)| level).sum::<i64>());
            prop_assert_eq!(sums.first, lit.clone().map(|(place, level)| place * level).sum::<i64>());
            prop_assert_eq!(sums.second, lit.map(|(place, level)| place * place * level).sum::<i64>());
            prop_assert_eq!(Some(&sums.peak), row[start..end].iter().max());
        }
    }
}
