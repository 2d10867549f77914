//! Whether an answer lies within what its prompt takes.

/// Whether a number is finite and in its range, both ends included.
pub(crate) fn check_number(
    value: f64,
    unit: &str,
    minimum: Option<f64>,
    maximum: Option<f64>,
) -> Result<(), String> {
    let least = minimum.unwrap_or(f64::NEG_INFINITY);
    let most = maximum.unwrap_or(f64::INFINITY);
    if value.is_finite() && (least..=most).contains(&value) {
        return Ok(());
    }
    let range = match (minimum, maximum) {
        (Some(least), Some(most)) => format!("lies between {least} and {most}"),
        (Some(least), None) => format!("is at least {least}"),
        (None, Some(most)) => format!("is at most {most}"),
        (None, None) => "is a finite number".to_owned(),
    };
    Err(format!("{value} {unit} is out of range: it {range} {unit}").trim_end().to_owned())
}

/// Whether a level can show this along both axes, deg.
pub(crate) fn check_level(x: f64, y: f64, most: f64) -> Result<(), String> {
    match [("x", x), ("y", y)].into_iter().find(|(_, value)| !(-most..=most).contains(value)) {
        None => Ok(()),
        Some((axis, value)) => Err(format!(
            "{axis} = {value} deg is out of range: this level shows {most} deg at most, to either side"
        )),
    }
}

/// Whether something is written, in one line and not too long.
pub(crate) fn check_text(text: &str, longest: usize) -> Result<(), String> {
    let long = text.chars().count();
    if text.trim().is_empty() {
        return Err("nothing is written: write a line".to_owned());
    }
    if long > longest {
        return Err(format!("{long} characters are too many: {longest} at most"));
    }
    match text.chars().find(|character| character.is_control()) {
        Some(_) => Err("a line of text holds no line breaks and no other control characters".to_owned()),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_lies_in_its_range_both_ends_included() {
        let check = |value, minimum, maximum| check_number(value, "mm", minimum, maximum);
        assert_eq!(check(1.0, Some(1.0), Some(2.0)), Ok(()));
        assert_eq!(check(2.0, Some(1.0), Some(2.0)), Ok(()));
        assert_eq!(check(-1e9, None, None), Ok(()));
        let range = |value, minimum, maximum| check(value, minimum, maximum).unwrap_err();
        assert_eq!(range(2.5, Some(1.0), Some(2.0)), "2.5 mm is out of range: it lies between 1 and 2 mm");
        assert_eq!(range(0.5, Some(1.0), None), "0.5 mm is out of range: it is at least 1 mm");
        assert_eq!(range(2.5, None, Some(2.0)), "2.5 mm is out of range: it is at most 2 mm");
        assert_eq!(range(f64::NAN, None, None), "NaN mm is out of range: it is a finite number mm");
        assert!(check(f64::INFINITY, Some(1.0), None).is_err());
    }

    #[test]
    fn a_level_shows_so_much_to_either_side() {
        assert_eq!(check_level(2.0, -2.0, 2.0), Ok(()));
        assert!(check_level(2.1, 0.0, 2.0).unwrap_err().starts_with("x = 2.1 deg"));
        assert!(check_level(0.0, -2.1, 2.0).unwrap_err().starts_with("y = -2.1 deg"));
        assert!(check_level(f64::NAN, 0.0, 2.0).is_err());
    }

    #[test]
    fn a_line_of_text_is_written_and_not_too_long() {
        assert_eq!(check_text("12345", 5), Ok(()));
        assert_eq!(check_text("123456", 5), Err("6 characters are too many: 5 at most".to_owned()));
        assert!(check_text("  ", 5).is_err() && check_text("a\nb", 5).is_err());
    }
}
