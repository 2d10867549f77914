//! A time as people write it.

use std::time::Duration;

/// Longest time that makes sense here: a month.
const LONGEST_S: f64 = 31.0 * 86_400.0;

/// Reads `90s`, `5min`, `2h`.
pub(super) fn read(text: &str) -> Result<Duration, String> {
    let right = || "write a time with its unit, as in 90s, 5min or 2h; a month at most".to_owned();
    let unit_at = text.find(|letter: char| letter.is_ascii_alphabetic()).ok_or_else(right)?;
    let (number, unit) = text.split_at(unit_at);
    let seconds = match unit {
        "s" => 1.0,
        "min" => 60.0,
        "h" => 3_600.0,
        _ => return Err(right()),
    };
    let number: f64 = number.trim().parse().map_err(|_| right())?;
    let time = number * seconds;
    if !(0.0..=LONGEST_S).contains(&time) {
        return Err(right());
    }
    Ok(Duration::from_secs_f64(time))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_has_a_number_and_a_unit() {
        for (text, seconds) in [("90s", 90.0), ("5min", 300.0), ("1.5 h", 5_400.0), ("0s", 0.0)] {
            assert_eq!(read(text), Ok(Duration::from_secs_f64(seconds)), "{text}");
        }
        for wrong in ["", "5", "min", "5m", "-1s", "NaNs", "infs", "1e9h", "5 minutes"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
