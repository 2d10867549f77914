//! Sizes of what is hidden, as the lab and people who measure machines write them; inside they are rad and mm.

/// A size with its unit: angles in degrees, as diagnoses have them; turns of a guideway in deg/m, as in model files, and in urad/m, as ISO 230-1 has them.
pub(super) fn shown_size(size: f64, unit: &str) -> String {
    match unit {
        "rad" => format!("{} deg", figure(size.to_degrees())),
        "rad/mm" => format!("{} deg/m ({} urad/m)", figure(1000.0 * size.to_degrees()), figure(1e9 * size)),
        // A ratio of angles.
        "rad/rad" => figure(size),
        "mm" | "mm/h" => format!("{} {unit}", figure(size)),
        _ => format!("{size:.3e} {unit}"),
    }
}

/// Four figures, as a plain number where that is short.
fn figure(value: f64) -> String {
    let size = value.abs();
    match size {
        _ if size == 0.0 => "0".to_owned(),
        _ if (1e-3..1e4).contains(&size) => {
            let decimals = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{value:.decimals$}")
        }
        _ => format!("{value:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_shown_in_the_units_people_measure_in() {
        for (size, unit, shown) in [
            (1e-3, "rad", "0.05730 deg"),
            (-3.49066e-7, "rad/mm", "-0.02000 deg/m (-349.1 urad/m)"),
            (0.0123, "rad/rad", "0.01230"),
            (1.5e-5, "rad/(N m)", "1.500e-5 rad/(N m)"),
            (0.4, "mm", "0.4000 mm"),
            (12.5, "mm/h", "12.50 mm/h"),
            (1.2894e-2, "rad/(N m)", "1.289e-2 rad/(N m)"),
            (0.0, "mm", "0 mm"),
        ] {
            assert_eq!(shown_size(size, unit), shown);
        }
    }
}
