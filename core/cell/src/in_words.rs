//! Numbers as an operator reads them.

/// The smallest uncertainty that is written out, in the unit it comes in; below it no operator's instrument reads.
const SMALLEST: f64 = 1e-4;

/// How far a number may be off either way, to two digits, with its unit: `± 0.013 deg`. What is smaller than anybody can
/// measure reads `± less than 0.0001 deg`; what is not known reads `± ? deg`.
///
/// ```
/// # use plumb_cell::give_or_take;
/// assert_eq!(give_or_take(0.0127, "deg"), "± 0.013 deg");
/// assert_eq!(give_or_take(0.0, "deg"), "± less than 0.0001 deg");
/// ```
pub fn give_or_take(uncertainty: f64, unit: &str) -> String {
    let uncertainty = uncertainty.abs();
    let text = if !uncertainty.is_finite() {
        format!("± ? {unit}")
    } else if uncertainty < SMALLEST {
        format!("± less than {SMALLEST} {unit}")
    } else {
        // Two digits from the first one that is not zero, and never more than the smallest has.
        let decimals = (1.0 - uncertainty.log10().floor()).clamp(0.0, 4.0) as usize;
        format!("± {uncertainty:.decimals$} {unit}")
    };
    text.trim_end().to_owned()
}

/// What a correction is about, as people say it.
///
/// ```
/// # use plumb_cell::corrected_quantity;
/// assert_eq!(corrected_quantity("joint_zero", "arm", "waist"), "joint zero of arm waist");
/// assert_eq!(corrected_quantity("sensor_parameter", "stripe", "camera_aim_x"), "camera aim x of stripe");
/// ```
pub fn corrected_quantity(quantity: &str, device: &str, place: &str) -> String {
    // A parameter's name says what it is.
    if quantity == crate::engine::SENSOR_PARAMETER {
        return format!("{} of {device}", place.replace('_', " "));
    }
    format!("{} of {device} {place}", quantity.replace('_', " "))
}

/// A change as people read it: `0.0000 -> 0.4031 deg`; a plain number has no unit behind it.
pub fn change_in_words(old: f64, new: f64, unit: &str) -> String {
    format!("{old:.4} -> {new:.4} {unit}").trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_uncertainty_is_written_to_two_digits_and_never_as_a_power_of_ten() {
        assert_eq!(give_or_take(0.001_23, "deg"), "± 0.0012 deg");
        assert_eq!(give_or_take(0.000_47, "deg"), "± 0.0005 deg");
        assert_eq!(give_or_take(1.26, "mm"), "± 1.3 mm");
        assert_eq!(give_or_take(38.4, "mm"), "± 38 mm");
        assert_eq!(give_or_take(4.0e-13, "deg"), "± less than 0.0001 deg");
        assert_eq!(give_or_take(f64::NAN, "deg"), "± ? deg");
        assert_eq!(give_or_take(0.5, ""), "± 0.50");
    }
}
