//! A cell in words, on the terminal and on the page alike.

use plumb_central::CellState;
use plumb_document::counted;

/// A cell that was not heard of for so long counts as silent, s: three times what a shipper lets pass.
pub(super) const SILENT_AFTER_S: f64 = 15.0;

/// Days before the end of a calibration from which on it is shown: time to order a new one.
const SHOWN_DAYS_BEFORE: i64 = 30;

/// What a cell does, in words.
pub(super) fn doing(cell: &CellState) -> String {
    let mut words = match (&cell.waits_for, cell.waits_s, &cell.step) {
        (Some(title), Some(waits_s), _) => format!("WAITS for {}: {title}", duration(waits_s)),
        (_, _, Some(step)) if cell.state == "running" => format!("{}, at {step}", cell.procedure),
        _ => cell.message.clone().unwrap_or_else(|| cell.procedure.clone()),
    };
    if is_off(cell) {
        words.push_str(&format!(" (off for {})", duration(cell.silent_s)));
    } else if is_silent(cell) {
        words.push_str(&format!(" (nothing heard for {})", duration(cell.silent_s)));
    }
    words
}

/// Whether its shipper has gone without a word, or in the middle of a run.
pub(super) fn is_silent(cell: &CellState) -> bool {
    cell.silent_s > SILENT_AFTER_S && !is_off(cell)
}

/// Whether its shipper has ended in good order while no run was open, as when the machine is switched off for the night.
pub(super) fn is_off(cell: &CellState) -> bool {
    cell.signed_off.is_some() && cell.state != "running"
}

/// Who waits comes first, then who runs, then the others by name.
pub(super) fn in_order(cells: &[CellState]) -> Vec<&CellState> {
    let mut sorted: Vec<&CellState> = cells.iter().collect();
    sorted.sort_by(|one, other| {
        (rank(one), &one.cell, &one.record).cmp(&(rank(other), &other.cell, &other.record))
    });
    sorted
}

fn rank(cell: &CellState) -> u8 {
    match (&cell.waits_for, cell.state.as_str()) {
        (Some(_), _) => 0,
        (None, "running") => 1,
        _ => 2,
    }
}

/// All cells in a line.
pub(super) fn summary(cells: &[CellState]) -> String {
    let waiting = cells.iter().filter(|cell| cell.waits_for.is_some()).count();
    let silent = cells.iter().filter(|cell| is_silent(cell)).count();
    let off = cells.iter().filter(|cell| is_off(cell)).count();
    let off = if off == 0 { String::new() } else { format!(", {} off", counted(off, "is", "are")) };
    format!(
        "{}; {} for an answer, {} silent{off}",
        counted(cells.len(), "cell", "cells"),
        counted(waiting, "waits", "wait"),
        counted(silent, "is", "are")
    )
}

/// Runs that wait for the cell, where there are any.
pub(super) fn queued(count: i64) -> String {
    if count == 0 { String::new() } else { format!("; {count} queued") }
}

/// A calibration that is over, or soon will be.
pub(super) fn calibration(cell: &CellState, today: &str) -> String {
    let (Some(day), Some(instrument)) = (&cell.due, &cell.due_instrument) else { return String::new() };
    match due(Some(day), today) {
        Due::Later => String::new(),
        Due::Soon => format!("; {instrument} is due on {day}"),
        Due::Over => format!("; {instrument} was DUE on {day}"),
    }
}

/// A duration in the largest unit that says it in whole numbers.
pub(super) fn duration(seconds: f64) -> String {
    match seconds.max(0.0) {
        seconds if seconds < 120.0 => format!("{seconds:.0} s"),
        seconds if seconds < 7_200.0 => format!("{:.0} min", seconds / 60.0),
        seconds if seconds < 172_800.0 => format!("{:.0} h", seconds / 3_600.0),
        seconds => format!("{:.0} days", seconds / 86_400.0),
    }
}

/// How a calibration's last day is to be taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Due {
    /// Far off, or nothing is due.
    Later,
    /// Within a month.
    Soon,
    /// Over.
    Over,
}

/// How far off a day is.
pub(super) fn due(day: Option<&str>, today: &str) -> Due {
    let Some(left) = day.and_then(|day| days_between(today, day)) else { return Due::Later };
    match left {
        ..0 => Due::Over,
        0..=SHOWN_DAYS_BEFORE => Due::Soon,
        _ => Due::Later,
    }
}

/// Days from one day to another, both as 2027-03-31.
fn days_between(from: &str, to: &str) -> Option<i64> {
    Some(day_number(to)? - day_number(from)?)
}

/// Days since 1970-01-01 (Hinnant, "chrono-compatible low-level date algorithms", days_from_civil).
pub(super) fn day_number(day: &str) -> Option<i64> {
    let mut parts = day.get(..10)?.splitn(3, '-').map(str::parse::<i64>);
    let (year, month, day) = (parts.next()?.ok()?, parts.next()?.ok()?, parts.next()?.ok()?);
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let year_of_era = year.rem_euclid(400);
    let day_of_year = (153 * (month + if month > 2 { -3 } else { 9 }) + 2) / 5 + day - 1;
    let day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    Some(era * 146_097 + day_of_era - 719_468)
}

/// A time of the record in minutes, for people.
pub(super) fn minute(time: &str) -> String {
    time.get(..16).unwrap_or(time).replace('T', " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_read_as_people_say_them() {
        assert_eq!(duration(3.2), "3 s");
        assert_eq!(duration(600.0), "10 min");
        assert_eq!(duration(5.0 * 3_600.0), "5 h");
        assert_eq!(duration(3.0 * 86_400.0), "3 days");
        assert_eq!(duration(-1.0), "0 s", "two clocks need not agree");
    }

    #[test]
    fn a_calibration_is_announced_a_month_before_it_is_over() {
        assert_eq!(day_number("1970-01-01"), Some(0));
        assert_eq!(day_number("2000-03-01T12:00"), Some(11_017));
        for (day, expected) in [
            ("2026-11-22", Due::Over),
            ("2026-11-23", Due::Soon),
            ("2026-12-23", Due::Soon),
            ("2026-12-24", Due::Later),
            ("2027-11-23", Due::Later),
            ("some day", Due::Later),
        ] {
            assert_eq!(due(Some(day), "2026-11-23"), expected, "{day}");
        }
        assert_eq!(due(None, "2026-11-23"), Due::Later);
    }
}
