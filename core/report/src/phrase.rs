//! Numbers and lists as a person would write them.

use plumb_calibration::effect::Unit;
use plumb_calibration::measurement::ReadingUnit;

/// A number with three figures, as a person would write it.
pub(crate) fn figure(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-3..1e5).contains(&size) {
        format!("{value:.2e}")
    } else if size >= 100.0 {
        format!("{value:.0}")
    } else if size >= 1.0 {
        format!("{value:.2}")
    } else {
        format!("{value:.4}")
    }
}

/// Millionths of a radian in a degree.
const URAD_PER_DEG: f64 = 1e6 * std::f64::consts::PI / 180.0;

/// A size known no better than this, in any unit the lab shows, is not determined at all: 1 km, or 2,800 turns.
const LARGEST_SHOWN: f64 = 1e6;

/// Whether rows determine a number of this standard error, shown unit.
pub fn is_determined(error: f64) -> bool {
    error.is_finite() && error < LARGEST_SHOWN
}

/// A size with its standard error and unit: `0.0078 +- 0.0003 rad`. A ratio has no unit to be shown.
pub(crate) fn size_text(size: f64, error: f64, unit: &str) -> String {
    if !is_determined(error) {
        return "size not determined".to_owned();
    }
    let number = format!("{} +- {}", figure(size), figure(error));
    match unit {
        _ if unit == Unit::RATIO.name => number,
        // Turns of a guideway are given in urad/m by those who measure machines (ISO 230-1).
        _ if unit == Unit::DEG_PER_M.name => {
            format!(
                "{number} {unit} ({} +- {} urad/m)",
                figure(size * URAD_PER_DEG),
                figure(error * URAD_PER_DEG)
            )
        }
        _ => format!("{number} {unit}"),
    }
}

/// How large the noise of a reading is, with so many digits: `0.050 mm an axis` of coordinates and other lengths, `0.003 deg a reading` of angles.
pub fn noise_text(sigma: f64, unit: ReadingUnit, digits: usize) -> String {
    let of = match unit {
        ReadingUnit::Mm => "an axis",
        ReadingUnit::Deg => "a reading",
    };
    format!("{sigma:.digits$} {unit} {of}")
}

/// Words joined as in speech: `a, b and c`.
pub(crate) fn listed(words: &[String], last: &str) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., end] => format!("{} {last} {end}", most.join(", ")),
    }
}

/// A probability in percent; none is certain.
pub fn percent(probability: f64) -> String {
    match probability {
        p if p >= 0.995 => "over 99 %".to_owned(),
        p if p < 0.005 => "under 1 %".to_owned(),
        p => format!("{:.0} %", 100.0 * p),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_whose_error_is_beyond_all_that_is_shown_is_not_determined() {
        assert!(is_determined(0.99 * LARGEST_SHOWN) && !is_determined(1.01 * LARGEST_SHOWN));
        assert!(!is_determined(f64::NAN) && !is_determined(f64::INFINITY));
        assert_eq!(size_text(1.0, f64::INFINITY, "deg"), "size not determined");
    }

    #[test]
    fn no_probability_is_certain() {
        assert_eq!(percent(1.0), "over 99 %");
        assert_eq!(percent(0.93), "93 %");
        assert_eq!(percent(0.0), "under 1 %");
    }
}
