//! The last half minute of one live value, and the line of blocks it is drawn as.

use std::collections::VecDeque;

/// How much is kept and shown, nanoseconds of the cell's clock.
pub(crate) const SPAN_NS: u64 = 30_000_000_000;

/// Samples kept at most, whatever their spacing: a robot reports twenty times a second.
const MOST: usize = 1200;

/// Eight heights of a block.
const BLOCKS: [char; 8] =
    ['\u{2581}', '\u{2582}', '\u{2583}', '\u{2584}', '\u{2585}', '\u{2586}', '\u{2587}', '\u{2588}'];

/// The last samples of a value, oldest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Trace {
    samples: VecDeque<(u64, f64)>,
}

impl Trace {
    /// Takes a sample in. One that is not newer than the last is dropped, so that a clock set back draws no knots.
    pub(crate) fn push(&mut self, time_ns: u64, value: f64) {
        if self.samples.back().is_some_and(|(last, _)| time_ns <= *last) || !value.is_finite() {
            return;
        }
        // The one before the span stays: it is the value with which the span begins.
        while self.samples.get(1).is_some_and(|(second, _)| time_ns.saturating_sub(*second) > SPAN_NS)
            || self.samples.len() >= MOST
        {
            self.samples.pop_front();
        }
        self.samples.push_back((time_ns, value));
    }

    /// The value over the half minute up to `now_ns`, in `width` blocks; low and high are the least and the greatest
    /// value shown. A value that does not change is a flat line, times before the first sample are empty.
    pub(crate) fn drawn(&self, now_ns: u64, width: usize) -> String {
        let values: Vec<Option<f64>> = (1..=width).map(|column| self.at(now_ns, column, width)).collect();
        let known = || values.iter().flatten().copied();
        let (low, high) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
        let block = |value: f64| {
            if high - low < 1e-9 {
                return '\u{2500}';
            }
            // Between 0 and 7.
            let height = ((value - low) / (high - low) * 7.0).round() as usize;
            BLOCKS.get(height).copied().unwrap_or(' ')
        };
        values.iter().map(|value| value.map_or(' ', block)).collect()
    }

    /// The value at the end of a column.
    fn at(&self, now_ns: u64, column: usize, width: usize) -> Option<f64> {
        let back = SPAN_NS as f64 * (width - column) as f64 / width as f64;
        let time = now_ns.checked_sub(back as u64)?;
        let after = self.samples.partition_point(|(sample, _)| *sample <= time);
        after.checked_sub(1).and_then(|index| self.samples.get(index)).map(|(_, value)| *value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000_000;

    #[test]
    fn a_value_that_rises_is_drawn_from_low_to_high_and_a_still_one_flat() {
        let mut rising = Trace::default();
        let mut still = Trace::default();
        for second in 0..=30 {
            rising.push((second + 1) * SECOND, second as f64);
            still.push((second + 1) * SECOND, 5.0);
        }
        let drawn = rising.drawn(31 * SECOND, 8);
        assert_eq!(drawn.chars().next(), Some('\u{2581}'));
        assert_eq!(drawn.chars().last(), Some('\u{2588}'));
        assert!(drawn.chars().collect::<Vec<_>>().is_sorted(), "{drawn}");
        assert_eq!(still.drawn(31 * SECOND, 4), "\u{2500}\u{2500}\u{2500}\u{2500}");
    }

    #[test]
    fn what_is_older_than_the_span_is_forgotten_but_for_the_value_it_left() {
        let mut trace = Trace::default();
        trace.push(SECOND, 1.0);
        trace.push(2 * SECOND, 2.0);
        trace.push(100 * SECOND, 3.0);
        assert_eq!(trace.samples.len(), 2);
        assert_eq!(trace.drawn(101 * SECOND, 3), "\u{2581}\u{2581}\u{2588}");
        assert_eq!(trace.drawn(SECOND / 2, 3), "   ");
    }
}
