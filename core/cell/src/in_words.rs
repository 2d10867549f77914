//! Numbers as an operator reads them.

use plumb_record::{Budget, SENSOR_PARAMETER};

/// The smallest uncertainty that is written out, in the unit it comes in; below it no operator's instrument reads.
const SMALLEST: f64 = 1e-4;

/// What is written where an uncertainty was not determined.
pub const NOT_DETERMINED: &str = "not determined";

/// How far a number may be off either way, to two digits, with its unit: `± 0.013 deg`. What is smaller than anybody can
/// measure reads `± less than 0.0001 deg`; what is not known, and 0, which no uncertainty is, read `± not determined`.
///
/// ```
/// # use plumb_cell::give_or_take;
/// assert_eq!(give_or_take(0.0127, "deg"), "± 0.013 deg");
/// assert_eq!(give_or_take(None, "deg"), "± not determined");
/// ```
pub fn give_or_take(uncertainty: impl Into<Option<f64>>, unit: &str) -> String {
    let digits = uncertainty_digits(uncertainty);
    let unit = if digits == NOT_DETERMINED { "" } else { unit };
    format!("± {digits} {unit}").trim_end().to_owned()
}

/// A surface or an edge of a model file as people call it: `line_b` is line B.
///
/// ```
/// # use plumb_cell::surface_called;
/// assert_eq!(surface_called("line_b"), "line B");
/// assert_eq!(surface_called("left_face"), "left face");
/// ```
pub fn surface_called(name: &str) -> String {
    match name.strip_prefix("line_") {
        Some(letter) if letter.chars().count() == 1 => format!("line {}", letter.to_uppercase()),
        _ => name.replace('_', " "),
    }
}

/// The words with a capital first letter, as a sentence begins.
///
/// ```
/// # use plumb_cell::sentence_case;
/// assert_eq!(sentence_case("line A not found"), "Line A not found");
/// ```
pub fn sentence_case(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// An uncertainty without its unit, as columns of tables show it: `0.013`, `less than 0.0001`, `not determined`.
///
/// ```
/// # use plumb_cell::uncertainty_digits;
/// assert_eq!(uncertainty_digits(0.0127), "0.013");
/// assert_eq!(uncertainty_digits(None), "not determined");
/// ```
pub fn uncertainty_digits(uncertainty: impl Into<Option<f64>>) -> String {
    let known = uncertainty.into().map(f64::abs).filter(|value| value.is_finite() && *value > 0.0);
    let Some(uncertainty) = known else { return NOT_DETERMINED.to_owned() };
    if uncertainty < SMALLEST {
        return format!("less than {SMALLEST}");
    }
    // Two digits from the first one that is not zero, and never more than the smallest has.
    let decimals = (1.0 - uncertainty.log10().floor()).clamp(0.0, 4.0) as usize;
    format!("{uncertainty:.decimals$}")
}

/// A half-width, within which something was seen to lie, with its unit. Unlike an uncertainty it may be 0, or as good as that: then it is
/// `± less than 0.0001 deg`.
///
/// ```
/// # use plumb_cell::known_within;
/// assert_eq!(known_within(0.025, "deg"), "± 0.025 deg");
/// assert_eq!(known_within(0.0, "deg"), "± less than 0.0001 deg");
/// ```
pub fn known_within(half_width: f64, unit: &str) -> String {
    give_or_take(half_width.abs().max(f64::MIN_POSITIVE), unit)
}

/// What a person has to know of an uncertainty besides its size: which components were not determined, and what the others come to.
/// None where all were determined.
pub fn left_open(budget: &Budget, unit: &str) -> Option<String> {
    let open: Vec<String> =
        budget.not_determined().map(|one| format!("{} ({})", one.name, one.source)).collect();
    if open.is_empty() {
        return None;
    }
    let rest = budget.at_least();
    let rest =
        if rest > 0.0 { format!("; the rest comes to {}", give_or_take(rest, unit)) } else { String::new() };
    Some(format!("not determined: {}{rest}", open.join("; ")))
}

/// What a correction is about, as people say it.
///
/// ```
/// # use plumb_cell::corrected_quantity;
/// assert_eq!(corrected_quantity("joint_zero", "arm", "waist"), "joint zero of arm waist");
/// assert_eq!(corrected_quantity("sensor_parameter", "stripe", "camera_aim_x"), "camera aim x of stripe");
/// ```
pub fn corrected_quantity(quantity: &str, device: &str, site: &str) -> String {
    // A parameter's name says what it is.
    if quantity == SENSOR_PARAMETER {
        return format!("{} of {device}", site.replace('_', " "));
    }
    format!("{} of {device} {site}", quantity.replace('_', " "))
}

/// A change as people read it: `0.0000 -> 0.4031 deg`; a plain number has no unit behind it.
pub fn change_in_words(old: f64, new: f64, unit: &str) -> String {
    let (old, new) = (with_decimals(old, 4), with_decimals(new, 4));
    format!("{old} -> {new} {unit}").trim_end().to_owned()
}

/// A number with so many decimals, and no sign where they are all 0: a joint is at `0.000`, never at `-0.000`.
///
/// ```
/// # use plumb_cell::with_decimals;
/// assert_eq!(with_decimals(-0.0004, 3), "0.000");
/// assert_eq!(with_decimals(-0.0006, 3), "-0.001");
/// ```
pub fn with_decimals(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|digit| matches!(digit, '0' | '.')) => digits.to_owned(),
        _ => text,
    }
}

/// A number that was measured, to four decimals at most: `12.3401`, `312`, `2.1e-6`.
pub(crate) fn short_number(value: f64) -> String {
    if value != 0.0 && value.abs() < SMALLEST {
        return format!("{value:.1e}");
    }
    let digits = format!("{value:.4}");
    digits.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_record::Component;

    #[test]
    fn what_was_not_determined_is_named_with_what_the_rest_comes_to() {
        let component = |name: &str, standard| Component {
            name: name.to_owned(),
            source: "the cell file gives no `tolerances.target_mm`".to_owned(),
            standard,
            unit: "mm".to_owned(),
            sensitivity: 0.5,
        };
        let mut budget =
            Budget { components: vec![component("line A", None), component("play", Some(0.05))] };
        assert_eq!(
            left_open(&budget, "deg").as_deref(),
            Some(
                "not determined: line A (the cell file gives no `tolerances.target_mm`); the rest comes to ± 0.025 deg"
            )
        );
        budget.components.remove(0);
        assert_eq!(left_open(&budget, "deg"), None);
    }

    #[test]
    fn a_number_is_written_without_zeros_that_say_nothing() {
        assert_eq!(
            [12.34, 312.0, 100.0, 0.0, -0.5, 2.1e-6].map(short_number),
            ["12.34", "312", "100", "0", "-0.5", "2.1e-6"]
        );
    }

    #[test]
    fn an_uncertainty_is_written_to_two_digits_and_never_as_a_power_of_ten() {
        assert_eq!(give_or_take(0.001_23, "deg"), "± 0.0012 deg");
        assert_eq!(give_or_take(0.000_47, "deg"), "± 0.0005 deg");
        assert_eq!(give_or_take(1.26, "mm"), "± 1.3 mm");
        assert_eq!(give_or_take(38.4, "mm"), "± 38 mm");
        assert_eq!(give_or_take(4.0e-13, "deg"), "± less than 0.0001 deg");
        assert_eq!(give_or_take(f64::NAN, "deg"), "± not determined");
        assert_eq!(give_or_take(0.0, "deg"), "± not determined", "nothing is known exactly");
        assert_eq!(give_or_take(0.5, ""), "± 0.50");
    }
}
