//! A picture's runs, by the widest instructions the processor has.
//!
//! A stripe lights one pixel in a hundred: what costs time is to see that the others are dark, and then each branch the processor guesses
//! wrongly. Hence blocks of 64 pixels become the bits of a word, and the edges in them are written down without a question asked.

#![allow(unsafe_code, reason = "vector instructions, called only where the processor was seen to have them")]

use std::sync::OnceLock;

use crate::extract::threshold::Levels;

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

impl Default for InstructionSet {
    /// The best this processor has.
    fn default() -> Self {
        instruction_set()
    }
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
pub(in crate::extract) fn available() -> impl Iterator<Item = InstructionSet> {
    #[cfg(target_arch = "x86_64")]
    let has_avx2 = is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("popcnt");
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

/// Writes down the edges of the runs of pixels above the `levels`, and after each row of `width` pixels how many there are.
/// `set` is one of [`available`]. Behind the last edge lies what was there before.
pub(super) fn picture(
    set: InstructionSet,
    pixels: &[u8],
    width: usize,
    levels: &Levels,
    edges: &mut Vec<u16>,
    row_ends: &mut Vec<u32>,
) {
    match set {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `set` is only `Avx512` where `available` saw these instructions.
        InstructionSet::Avx512 => unsafe {
            picture_avx512(pixels, width, levels, edges, row_ends);
        },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `set` is only `Avx2` where `available` saw these instructions.
        InstructionSet::Avx2 => unsafe {
            picture_avx2(pixels, width, levels, edges, row_ends);
        },
        _ => each_row(pixels, width, levels, edges, row_ends, row_portable),
    }
}

/// All rows, one after the other; part of its caller, so that a row costs no call.
#[inline(always)]
fn each_row(
    pixels: &[u8],
    width: usize,
    levels: &Levels,
    edges: &mut Vec<u16>,
    row_ends: &mut Vec<u32>,
    row: impl Fn(&[u8], u8, &mut [u16]) -> usize,
) {
    // Every pixel may be an edge, and so may the row's end; two more are written without a question.
    let most = width + 3;
    let mut count = 0;
    for (number, pixels) in pixels.chunks_exact(width).enumerate() {
        #[cfg(target_arch = "x86_64")]
        ask_ahead(pixels);
        if edges.len() < count + most {
            edges.resize(2 * (count + most), 0);
        }
        let room = edges.get_mut(count..).unwrap_or_default();
        count += row(pixels, levels.of_row(number), room);
        row_ends.push(count as u32);
    }
}

/// Asks the memory for the beginning of a page some way ahead of a row: the processor asks for what follows by itself, but not beyond a
/// page. Of a picture larger than its caches that saves a fifth of the time.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn ask_ahead(row: &[u8]) {
    use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
    const PAGE: usize = 4096;
    const LINE: usize = 64;
    let ahead = row.as_ptr().wrapping_add(4 * PAGE);
    let to_page = ahead.align_offset(PAGE);
    if to_page < row.len() {
        for line in 0..4 {
            // SAFETY: to ask changes nothing and cannot fail, wherever the address lies.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(ahead.wrapping_add(to_page + line * LINE).cast()) };
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,bmi1,popcnt")]
fn picture_avx512(
    pixels: &[u8],
    width: usize,
    levels: &Levels,
    edges: &mut Vec<u16>,
    row_ends: &mut Vec<u32>,
) {
    each_row(pixels, width, levels, edges, row_ends, |pixels, threshold, room| {
        row_avx512(pixels, threshold, room)
    });
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,popcnt")]
fn picture_avx2(pixels: &[u8], width: usize, levels: &Levels, edges: &mut Vec<u16>, row_ends: &mut Vec<u32>) {
    each_row(pixels, width, levels, edges, row_ends, |pixels, threshold, room| {
        row_avx2(pixels, threshold, room)
    });
}

/// The edges of one row.
struct Edges<'a> {
    room: &'a mut [u16],
    count: usize,
    /// Whether the last pixel was lit, 0 or 1.
    lit: u64,
}

impl<'a> Edges<'a> {
    #[inline(always)]
    fn new(room: &'a mut [u16]) -> Self {
        Self { room, count: 0, lit: 0 }
    }

    /// Takes the next block: a bit for each lit pixel.
    #[inline(always)]
    fn take(&mut self, mask: u64, at: usize) {
        let mut edges = mask ^ ((mask << 1) | self.lit);
        if edges == 0 {
            return;
        }
        self.lit = mask >> 63;
        let count = edges.count_ones() as usize;
        // Mostly there are two edges: to write two and keep as many as there are is faster than to guess.
        for index in 0..2 {
            self.write(index, at, edges);
            edges &= edges.wrapping_sub(1);
        }
        for index in 2..count {
            self.write(index, at, edges);
            edges &= edges.wrapping_sub(1);
        }
        self.count += count;
    }

    #[inline(always)]
    fn write(&mut self, index: usize, at: usize, edges: u64) {
        if let Some(edge) = self.room.get_mut(self.count + index) {
            *edge = (at + edges.trailing_zeros() as usize) as u16;
        }
    }

    /// Takes the last, shorter block, and ends the row: what lies beyond it is dark.
    #[inline(always)]
    fn finish(mut self, rest: &[u8], at: usize, mask: impl Fn(&[u8; BLOCK]) -> u64) -> usize {
        let mut block = [0; BLOCK];
        let mut lit = 0;
        if let Some(beginning) = block.get_mut(..rest.len())
            && !rest.is_empty()
        {
            beginning.copy_from_slice(rest);
            lit = mask(&block);
        }
        self.take(lit, at);
        self.count
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,bmi1,popcnt")]
#[inline]
fn row_avx512(pixels: &[u8], threshold: u8, room: &mut [u16]) -> usize {
    use std::arch::x86_64::{
        __m512i, _mm512_cmpgt_epu8_mask, _mm512_loadu_si512, _mm512_max_epu8, _mm512_set1_epi8,
    };
    let level = _mm512_set1_epi8(threshold as i8);
    // SAFETY: the 64 bytes are there.
    let load = |block: &[u8; BLOCK]| -> __m512i { unsafe { _mm512_loadu_si512(block.as_ptr().cast()) } };
    let lit = |block: __m512i| _mm512_cmpgt_epu8_mask(block, level);
    let mut edges = Edges::new(room);
    let mut at = 0;
    let (blocks, rest) = pixels.as_chunks::<BLOCK>();
    let (fours, others) = blocks.as_chunks::<4>();
    for four in fours {
        let [a, b, c, d] = four.each_ref().map(load);
        let brightest = _mm512_max_epu8(_mm512_max_epu8(a, b), _mm512_max_epu8(c, d));
        if edges.lit | lit(brightest) != 0 {
            for (index, block) in [a, b, c, d].into_iter().enumerate() {
                edges.take(lit(block), at + index * BLOCK);
            }
        }
        at += 4 * BLOCK;
    }
    for block in others {
        edges.take(lit(load(block)), at);
        at += BLOCK;
    }
    edges.finish(rest, at, |block| lit(load(block)))
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,popcnt")]
#[inline]
fn row_avx2(pixels: &[u8], threshold: u8, room: &mut [u16]) -> usize {
    use std::arch::x86_64::{
        __m256i, _mm256_cmpeq_epi8, _mm256_loadu_si256, _mm256_max_epu8, _mm256_movemask_epi8,
        _mm256_set1_epi8, _mm256_setzero_si256, _mm256_subs_epu8, _mm256_testz_si256,
    };
    let level = _mm256_set1_epi8(threshold as i8);
    // SAFETY: the 64 bytes are there.
    let load = |block: &[u8; BLOCK]| -> [__m256i; 2] {
        unsafe { [0, 32].map(|offset| _mm256_loadu_si256(block.as_ptr().add(offset).cast())) }
    };
    let above = |half: __m256i| _mm256_subs_epu8(half, level);
    let dark = |half: __m256i| {
        u64::from(_mm256_movemask_epi8(_mm256_cmpeq_epi8(above(half), _mm256_setzero_si256())) as u32)
    };
    let lit = |[low, high]: [__m256i; 2]| !(dark(low) | (dark(high) << 32));
    let mut edges = Edges::new(room);
    let mut at = 0;
    let (blocks, rest) = pixels.as_chunks::<BLOCK>();
    let (twos, others) = blocks.as_chunks::<2>();
    for two in twos {
        let [one, other] = two.each_ref().map(load);
        let of_two = |[low, high]: [__m256i; 2]| _mm256_max_epu8(low, high);
        let brightest = above(_mm256_max_epu8(of_two(one), of_two(other)));
        if edges.lit != 0 || _mm256_testz_si256(brightest, brightest) == 0 {
            edges.take(lit(one), at);
            edges.take(lit(other), at + BLOCK);
        }
        at += 2 * BLOCK;
    }
    for block in others {
        edges.take(lit(load(block)), at);
        at += BLOCK;
    }
    edges.finish(rest, at, |block| lit(load(block)))
}

fn row_portable(pixels: &[u8], threshold: u8, room: &mut [u16]) -> usize {
    let bit = |(index, pixel): (usize, &u8)| u64::from(*pixel > threshold) << index;
    let lit = |block: &[u8; BLOCK]| block.iter().enumerate().map(bit).sum();
    let mut edges = Edges::new(room);
    let mut at = 0;
    let (blocks, rest) = pixels.as_chunks::<BLOCK>();
    for block in blocks {
        let brightest = block.iter().fold(0, |brightest: u8, pixel| brightest.max(*pixel));
        if edges.lit != 0 || brightest > threshold {
            edges.take(lit(block), at);
        }
        at += BLOCK;
    }
    edges.finish(rest, at, lit)
}
