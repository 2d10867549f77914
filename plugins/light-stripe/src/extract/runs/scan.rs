//! A picture's runs, by the widest instructions the processor has.
//!
//! A stripe lights one pixel in a hundred: what costs time is to see that the others are dark. Hence blocks of 64 pixels become the bits of
//! a word, and only where the bits change is anything done.

#![allow(unsafe_code, reason = "vector instructions, called only where the processor was seen to have them")]

use std::sync::OnceLock;

use super::Run;

/// Pixels in a block.
const BLOCK: usize = 64;

/// What the processor can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InstructionSet {
    /// 64 pixels at once.
    Avx512,
    /// 32 pixels at once.
    Avx2,
    /// What every processor has.
    Portable,
}

impl InstructionSet {
    /// As people call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Avx512 => "AVX-512",
            Self::Avx2 => "AVX2",
            Self::Portable => "portable",
        }
    }
}

/// The best this processor has, found out once.
pub fn instruction_set() -> InstructionSet {
    static FOUND: OnceLock<InstructionSet> = OnceLock::new();
    *FOUND.get_or_init(|| available().next().unwrap_or(InstructionSet::Portable))
}

/// What this processor has, the best first.
pub(super) fn available() -> impl Iterator<Item = InstructionSet> {
    #[cfg(target_arch = "x86_64")]
    let has_avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("bmi1");
    #[cfg(target_arch = "x86_64")]
    let has_avx512 = has_avx2 && is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bw");
    #[cfg(target_arch = "x86_64")]
    let has = [
        (InstructionSet::Avx512, has_avx512),
        (InstructionSet::Avx2, has_avx2),
        (InstructionSet::Portable, true),
    ];
    #[cfg(not(target_arch = "x86_64"))]
    let has = [(InstructionSet::Portable, true)];
    has.into_iter().filter_map(|(set, there)| there.then_some(set))
}

/// Adds the runs of pixels above `threshold_of_row`, and after each row of `width` pixels how many runs there are. `set` is one of [`available`].
pub(super) fn picture(
    set: InstructionSet,
    pixels: &[u8],
    width: usize,
    threshold_of_row: impl Fn(usize) -> u8,
    runs: &mut Vec<Run>,
    row_ends: &mut Vec<u32>,
) {
    match set {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `set` is only `Avx512` where `available` saw these instructions.
        InstructionSet::Avx512 => unsafe {
            picture_avx512(pixels, width, threshold_of_row, runs, row_ends);
        },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `set` is only `Avx2` where `available` saw these instructions.
        InstructionSet::Avx2 => unsafe {
            picture_avx2(pixels, width, threshold_of_row, runs, row_ends);
        },
        _ => each_row(pixels, width, threshold_of_row, runs, row_ends, row_portable),
    }
}

/// All rows, one after the other; part of its caller, so that a row costs no call.
#[inline(always)]
fn each_row(
    pixels: &[u8],
    width: usize,
    threshold_of_row: impl Fn(usize) -> u8,
    runs: &mut Vec<Run>,
    row_ends: &mut Vec<u32>,
    row: impl Fn(&[u8], u8, &mut Vec<Run>),
) {
    for (number, pixels) in pixels.chunks_exact(width).enumerate() {
        row(pixels, threshold_of_row(number), runs);
        row_ends.push(runs.len() as u32);
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,bmi1")]
fn picture_avx512(
    pixels: &[u8],
    width: usize,
    threshold_of_row: impl Fn(usize) -> u8,
    runs: &mut Vec<Run>,
    row_ends: &mut Vec<u32>,
) {
    each_row(pixels, width, threshold_of_row, runs, row_ends, |pixels, threshold, runs| {
        row_avx512(pixels, threshold, runs);
    });
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1")]
fn picture_avx2(
    pixels: &[u8],
    width: usize,
    threshold_of_row: impl Fn(usize) -> u8,
    runs: &mut Vec<Run>,
    row_ends: &mut Vec<u32>,
) {
    each_row(pixels, width, threshold_of_row, runs, row_ends, |pixels, threshold, runs| {
        row_avx2(pixels, threshold, runs);
    });
}

/// The run that is open where a block ends.
struct Edges {
    /// Whether the last pixel was lit, 0 or 1.
    lit: u64,
    start: u16,
}

impl Edges {
    const DARK: Edges = Edges { lit: 0, start: 0 };

    /// Takes the next block: a bit for each lit pixel.
    #[inline(always)]
    fn take(&mut self, mask: u64, at: usize, runs: &mut Vec<Run>) {
        let mut edges = mask ^ ((mask << 1) | self.lit);
        if self.lit != 0 {
            if edges == 0 {
                return;
            }
            runs.push(Run { start: self.start, end: (at + edges.trailing_zeros() as usize) as u16 });
            edges &= edges - 1;
        }
        // From here on edges come in pairs, but for the last of a run that goes on into the next block.
        while edges != 0 {
            let start = (at + edges.trailing_zeros() as usize) as u16;
            edges &= edges - 1;
            if edges == 0 {
                self.start = start;
                break;
            }
            runs.push(Run { start, end: (at + edges.trailing_zeros() as usize) as u16 });
            edges &= edges - 1;
        }
        self.lit = mask >> 63;
    }

    /// Takes the last, shorter block, and ends the row.
    #[inline(always)]
    fn finish(&mut self, rest: &[u8], at: usize, threshold: u8, runs: &mut Vec<Run>) {
        if !rest.is_empty() {
            let bit = |(place, pixel): (usize, &u8)| u64::from(*pixel > threshold) << place;
            self.take(rest.iter().enumerate().map(bit).sum(), at, runs);
        }
        if self.lit != 0 {
            runs.push(Run { start: self.start, end: (at + rest.len()) as u16 });
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,bmi1")]
#[inline]
fn row_avx512(pixels: &[u8], threshold: u8, runs: &mut Vec<Run>) {
    use std::arch::x86_64::{_mm512_cmpgt_epu8_mask, _mm512_loadu_si512, _mm512_max_epu8, _mm512_set1_epi8};
    const AT_ONCE: usize = 4 * BLOCK;
    let level = _mm512_set1_epi8(threshold as i8);
    let mut edges = Edges::DARK;
    let mut at = 0;
    while at + AT_ONCE <= pixels.len() {
        // SAFETY: the 256 bytes from `at` on lie within `pixels`.
        let blocks = unsafe {
            let block = |place: usize| _mm512_loadu_si512(pixels.as_ptr().add(at + place).cast());
            [block(0), block(BLOCK), block(2 * BLOCK), block(3 * BLOCK)]
        };
        let brightest =
            _mm512_max_epu8(_mm512_max_epu8(blocks[0], blocks[1]), _mm512_max_epu8(blocks[2], blocks[3]));
        if edges.lit | _mm512_cmpgt_epu8_mask(brightest, level) != 0 {
            for (place, block) in blocks.into_iter().enumerate() {
                let mask = _mm512_cmpgt_epu8_mask(block, level);
                edges.take(mask, at + place * BLOCK, runs);
            }
        }
        at += AT_ONCE;
    }
    while at + BLOCK <= pixels.len() {
        // SAFETY: the 64 bytes from `at` on lie within `pixels`.
        let block = unsafe { _mm512_loadu_si512(pixels.as_ptr().add(at).cast()) };
        edges.take(_mm512_cmpgt_epu8_mask(block, level), at, runs);
        at += BLOCK;
    }
    edges.finish(pixels.get(at..).unwrap_or_default(), at, threshold, runs);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1")]
#[inline]
fn row_avx2(pixels: &[u8], threshold: u8, runs: &mut Vec<Run>) {
    use std::arch::x86_64::{
        __m256i, _mm256_cmpeq_epi8, _mm256_loadu_si256, _mm256_max_epu8, _mm256_movemask_epi8,
        _mm256_set1_epi8, _mm256_setzero_si256, _mm256_subs_epu8, _mm256_testz_si256,
    };
    const AT_ONCE: usize = 2 * BLOCK;
    let level = _mm256_set1_epi8(threshold as i8);
    let above = |block: __m256i| _mm256_subs_epu8(block, level);
    let dark = |block: __m256i| _mm256_movemask_epi8(_mm256_cmpeq_epi8(block, _mm256_setzero_si256())) as u32;
    let mask = |low: __m256i, high: __m256i| !(u64::from(dark(low)) | (u64::from(dark(high)) << 32));
    let mut edges = Edges::DARK;
    let mut at = 0;
    while at + AT_ONCE <= pixels.len() {
        // SAFETY: the 128 bytes from `at` on lie within `pixels`.
        let [a, b, c, d] = unsafe {
            let block = |place: usize| _mm256_loadu_si256(pixels.as_ptr().add(at + place).cast());
            [block(0), block(32), block(64), block(96)]
        };
        let brightest = above(_mm256_max_epu8(_mm256_max_epu8(a, b), _mm256_max_epu8(c, d)));
        if edges.lit != 0 || _mm256_testz_si256(brightest, brightest) == 0 {
            edges.take(mask(above(a), above(b)), at, runs);
            edges.take(mask(above(c), above(d)), at + BLOCK, runs);
        }
        at += AT_ONCE;
    }
    while at + BLOCK <= pixels.len() {
        // SAFETY: the 64 bytes from `at` on lie within `pixels`.
        let [a, b] = unsafe {
            let block = |place: usize| _mm256_loadu_si256(pixels.as_ptr().add(at + place).cast());
            [block(0), block(32)]
        };
        edges.take(mask(above(a), above(b)), at, runs);
        at += BLOCK;
    }
    edges.finish(pixels.get(at..).unwrap_or_default(), at, threshold, runs);
}

fn row_portable(pixels: &[u8], threshold: u8, runs: &mut Vec<Run>) {
    let mut edges = Edges::DARK;
    let blocks = pixels.chunks_exact(BLOCK);
    let rest = blocks.remainder();
    let mut at = 0;
    for block in blocks {
        let brightest = block.iter().fold(0, |brightest: u8, pixel| brightest.max(*pixel));
        if edges.lit != 0 || brightest > threshold {
            let bit = |(place, pixel): (usize, &u8)| u64::from(*pixel > threshold) << place;
            edges.take(block.iter().enumerate().map(bit).sum(), at, runs);
        }
        at += BLOCK;
    }
    edges.finish(rest, at, threshold, runs);
}
