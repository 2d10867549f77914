//! How much a device may write: long lines are cut, and those that come faster than can be read are left out and counted.

use std::time::{Duration, Instant};

/// The longest line and the longest reason of an error, in bytes. Longer ones are cut, and say so.
pub(crate) const LONGEST_TEXT: usize = 4096;

/// The longest answer of a plugin (a description, a reading), in bytes: sixteen times what a request carries.
pub(crate) const LONGEST_ANSWER: usize = 1 << 20;

/// How much may be written: a stock of lines and bytes that is used up at once and fills again slowly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Allowance {
    /// Lines that may come at once.
    pub(crate) lines: f64,
    /// Lines a second after that.
    pub(crate) lines_per_second: f64,
    /// Bytes that may come at once.
    pub(crate) bytes: f64,
    /// Bytes a second after that.
    pub(crate) bytes_per_second: f64,
    /// Bytes in all, for the life of the process.
    pub(crate) bytes_in_all: u64,
}

impl Allowance {
    /// What a plugin logs with `log`: a driver that logs both sides of a serial line at 9600 baud stays far below, also in a simulated cell
    /// whose time runs fast.
    pub(crate) const LOG: Self = Self {
        lines: 5000.0,
        lines_per_second: 500.0,
        bytes: 1e6,
        bytes_per_second: 50e3,
        bytes_in_all: 100_000_000,
    };

    /// What it prints: meant for who writes the plugin, and shown as warnings.
    pub(crate) const OUTPUT: Self = Self {
        lines: 200.0,
        lines_per_second: 20.0,
        bytes: 64e3,
        bytes_per_second: 4e3,
        bytes_in_all: 20_000_000,
    };
}

/// Lets lines through as an [`Allowance`] says, and counts the others.
pub(crate) struct Flood {
    allowance: Allowance,
    lines: f64,
    bytes: f64,
    written: u64,
    at: Instant,
    left_out: LeftOut,
}

/// Lines that were left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct LeftOut {
    lines: u64,
    bytes: u64,
}

impl LeftOut {
    pub(crate) fn is_none(self) -> bool {
        self.lines == 0
    }

    /// What is written in place of them.
    pub(crate) fn line(self) -> String {
        let (lines, bytes) = (self.lines, self.bytes);
        let lines = if lines == 1 { "1 line".to_owned() } else { format!("{lines} lines") };
        format!("{lines} ({}) left out here: they came faster than the log takes them", size(bytes))
    }
}

/// Bytes, for people.
fn size(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} bytes"),
        1_000..1_000_000 => format!("{} kB", bytes / 1_000),
        _ => format!("{} MB", bytes / 1_000_000),
    }
}

impl Flood {
    pub(crate) fn new(allowance: Allowance, now: Instant) -> Self {
        let Allowance { lines, bytes, .. } = allowance;
        Self { allowance, lines, bytes, written: 0, at: now, left_out: LeftOut::default() }
    }

    /// Whether a line of some bytes may be written now; one that may not is counted.
    pub(crate) fn lets_through(&mut self, bytes: usize, now: Instant) -> bool {
        let passed = now.saturating_duration_since(self.at).as_secs_f64();
        self.at = now;
        let allowance = &self.allowance;
        self.lines = (self.lines + passed * allowance.lines_per_second).min(allowance.lines);
        self.bytes = (self.bytes + passed * allowance.bytes_per_second).min(allowance.bytes);
        let size = bytes as f64;
        let is_exhausted = self.written.saturating_add(bytes as u64) > allowance.bytes_in_all;
        if self.lines < 1.0 || self.bytes < size || is_exhausted {
            self.leave_out(bytes);
            return false;
        }
        self.lines -= 1.0;
        self.bytes -= size;
        self.written += bytes as u64;
        true
    }

    /// Counts a line of some bytes that was not written.
    pub(crate) fn leave_out(&mut self, bytes: usize) {
        self.left_out.lines += 1;
        self.left_out.bytes += bytes as u64;
    }

    /// What was left out since this was asked last.
    pub(crate) fn take_left_out(&mut self) -> LeftOut {
        std::mem::take(&mut self.left_out)
    }

    /// Whether something was left out that was not reported yet.
    pub(crate) fn has_left_out(&self) -> bool {
        !self.left_out.is_none()
    }
}

/// How often it is reported that lines are left out while a flood goes on.
pub(crate) const REPORT_EVERY: Duration = Duration::from_secs(1);

/// A text that may be no text and of any length, as a line: cut at a character, with what was cut off counted.
pub(crate) fn cut(bytes: &[u8]) -> String {
    let Some(kept) = bytes.get(..LONGEST_TEXT).filter(|_| bytes.len() > LONGEST_TEXT) else {
        return String::from_utf8_lossy(bytes).into_owned();
    };
    // A character that the cut goes through is left out whole.
    let end = kept.iter().rposition(|byte| byte & 0xC0 != 0x80).filter(|at| kept.len() - at < 4);
    let kept = match end {
        Some(at) if std::str::from_utf8(kept.get(at..).unwrap_or_default()).is_err() => {
            kept.get(..at).unwrap_or_default()
        }
        _ => kept,
    };
    format!(
        "{} ... ({} more left out)",
        String::from_utf8_lossy(kept),
        size((bytes.len() - kept.len()) as u64)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(start: Instant, seconds: f64) -> Instant {
        start + Duration::from_secs_f64(seconds)
    }

    const SMALL: Allowance = Allowance {
        lines: 3.0,
        lines_per_second: 1.0,
        bytes: 100.0,
        bytes_per_second: 10.0,
        bytes_in_all: 150,
    };

    #[test]
    fn a_stock_of_lines_is_used_up_and_fills_again() {
        let start = Instant::now();
        let mut flood = Flood::new(SMALL, start);
        let through = (0..10).filter(|_| flood.lets_through(5, start)).count();
        assert_eq!(through, 3);
        assert_eq!(flood.take_left_out(), LeftOut { lines: 7, bytes: 35 });
        assert!(!flood.has_left_out());
        assert!(!flood.lets_through(5, after(start, 0.5)));
        assert!(flood.lets_through(5, after(start, 1.5)));
        assert!(!flood.lets_through(5, after(start, 1.5)));
    }

    #[test]
    fn bytes_are_counted_beside_lines_and_in_all() {
        let start = Instant::now();
        let mut flood = Flood::new(SMALL, start);
        assert!(flood.lets_through(90, start));
        assert!(!flood.lets_through(20, start), "the bytes are used up");
        assert!(flood.lets_through(60, after(start, 1000.0)));
        assert!(!flood.lets_through(1, after(start, 2000.0)), "150 bytes in all were written");
        assert_eq!(
            flood.take_left_out().line(),
            "2 lines (21 bytes) left out here: they came faster than the log takes them"
        );
    }

    #[test]
    fn all_bytes_that_may_come_at_once_may_be_written_and_none_beside_them() {
        let start = Instant::now();
        let mut flood = Flood::new(SMALL, start);
        assert!(flood.lets_through(100, start) && !flood.lets_through(1, start));
        assert!(!Flood::new(SMALL, start).lets_through(101, start));
        // Of the 150 in all the last may be written.
        assert!(!flood.lets_through(51, after(start, 100.0)) && flood.lets_through(50, after(start, 100.0)));
    }

    #[test]
    fn what_was_left_out_is_counted_in_the_unit_that_people_use() {
        let message = |lines, bytes| LeftOut { lines, bytes }.line();
        let end = "left out here: they came faster than the log takes them";
        assert_eq!(message(1, 999), format!("1 line (999 bytes) {end}"));
        assert_eq!(message(2, 1_000), format!("2 lines (1 kB) {end}"));
        assert_eq!(message(3, 999_999), format!("3 lines (999 kB) {end}"));
        assert_eq!(message(4, 1_000_000), format!("4 lines (1 MB) {end}"));
    }

    #[test]
    fn a_long_text_is_cut_at_a_character_and_says_how_much_is_missing() {
        assert_eq!(cut("short".as_bytes()), "short");
        let long = cut("x".repeat(5_000_000).as_bytes());
        assert!(long.len() < LONGEST_TEXT + 40, "{}", long.len());
        assert!(long.ends_with("x ... (4 MB more left out)"), "{}", &long[long.len() - 40..]);
        let umlauts = cut("\u{e4}".repeat(3000).as_bytes());
        assert!(!umlauts.contains('\u{fffd}'), "no half characters");
        assert!(cut(&[0xff; 10]).contains('\u{fffd}'));
    }

    #[test]
    fn a_text_is_cut_just_behind_its_greatest_length_and_a_character_in_two_left_out() {
        assert_eq!(cut("x".repeat(LONGEST_TEXT).as_bytes()), "x".repeat(LONGEST_TEXT));
        let one_more = cut("x".repeat(LONGEST_TEXT + 1).as_bytes());
        assert_eq!(one_more, format!("{} ... (1 bytes more left out)", "x".repeat(LONGEST_TEXT)));
        // A character of four bytes of which the cut leaves one, two, three or all.
        for inside in 1..=4 {
            let text = "x".repeat(LONGEST_TEXT - inside) + "\u{1f600}y";
            let kept = "x".repeat(LONGEST_TEXT - inside) + if inside == 4 { "\u{1f600}" } else { "" };
            assert!(cut(text.as_bytes()).starts_with(&format!("{kept} ... (")), "{inside}");
        }
    }
}
