//! Names of sensors' parameters, whose end is their unit.

/// Units that a parameter's name can end in; a name without one of them is of a plain number.
const UNITS: &[&str] = &["deg", "mm", "px"];

/// A parameter's name without its unit, and the unit: `camera_roll`, `deg`.
pub(crate) fn name_and_unit(key: &str) -> (&str, &str) {
    let ending = |unit: &&&str| key.strip_suffix(**unit).is_some_and(|name| name.ends_with('_'));
    match UNITS.iter().find(ending) {
        Some(unit) => (key.get(..key.len() - unit.len() - 1).unwrap_or(key), unit),
        None => (key, ""),
    }
}

/// A parameter's name as the plugin has it: [`name_and_unit`] the other way.
pub(crate) fn key_of(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}_{unit}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameters_unit_is_the_end_of_its_name() {
        assert_eq!(name_and_unit("camera_roll_deg"), ("camera_roll", "deg"));
        assert_eq!(name_and_unit("sheet_offset_mm"), ("sheet_offset", "mm"));
        assert_eq!(name_and_unit("camera_scale_u"), ("camera_scale_u", ""));
        assert_eq!(name_and_unit("deg"), ("deg", ""));
        for key in ["camera_roll_deg", "camera_scale_u", "gain"] {
            let (name, unit) = name_and_unit(key);
            assert_eq!(key_of(name, unit), key);
        }
    }
}
