//! Parts that several reports share.

use plumb_calibration::measurement::{NoiseSource, ReadingNoise, ReadingUnit};
use plumb_diagnosis::laboratory::{
    EffectValue, ErrorSummary, Errors, FoundAngle, FoundNumber, FoundSurface, OrientationErrors, Placement,
    Rms,
};
use plumb_diagnosis::noise_floor::{Floor, FloorSource};
use plumb_diagnosis::{Claim, Explainable};
use plumb_report::{explainable_sentence, is_determined, noise_text, why_held_in_words};

use crate::shown_unit::shown_unit;

/// `RMS error: fit 0.112 mm, cross-validation 0.126 mm, held out 0.111 mm`.
pub(super) fn rms_line(rms: &Rms, unit: ReadingUnit) -> String {
    let mut text = format!("RMS error: fit {:.4} {unit}", rms.fit);
    if let Some(cv) = rms.cv {
        text.push_str(&format!(", cross-validation {cv:.4} {unit}"));
    }
    if let Some(check) = rms.check {
        text.push_str(&format!(", held out {check:.4} {unit}"));
    }
    text + "\n"
}

/// The error of one measured point where the model was fitted and where it was not, a line each.
pub(crate) fn error_lines(errors: &Errors, unit: ReadingUnit) -> String {
    let mut text = format!(
        "{:<28}{:>10}{:>10}{:>10}{:>10}{:>9}\n",
        format!("error of a point, {unit}"),
        "RMS",
        "mean",
        "95 %",
        "maximum",
        "points"
    );
    let parts = [("fit", Some(errors.fit)), ("cross-validation", errors.cv), ("held out", errors.check)];
    for (name, summary) in parts {
        let Some(ErrorSummary { points, rms, mean, percentile_95, max }) = summary else { continue };
        text.push_str(&format!(
            "  {name:<26}{rms:>10.4}{mean:>10.4}{percentile_95:>10.4}{max:>10.4}{points:>9}\n"
        ));
    }
    text
}

/// How far measured orientations are off, a line each for fitted and held-out rows; empty where none was measured.
pub(super) fn orientation_lines(errors: Option<&OrientationErrors>) -> String {
    let Some(errors) = errors else { return String::new() };
    let mut text = "error of an orientation or angle, deg\n".to_owned();
    for (name, summary) in [("fit", Some(errors.fit)), ("held out", errors.check)] {
        let Some(ErrorSummary { points, rms, mean, percentile_95, max }) = summary else { continue };
        text.push_str(&format!(
            "  {name:<26}{rms:>10.4}{mean:>10.4}{percentile_95:>10.4}{max:>10.4}{points:>9}\n"
        ));
    }
    text
}

/// Where bodies, cameras and the board were found, two lines each.
pub(super) fn placement_lines(placed: &[Placement]) -> String {
    let sure = |error: &Option<f64>| error.map_or_else(String::new, |error| format!(" +- {}", figure(error)));
    let numbers = |names: [&str; 3], values: &[f64; 3], errors: &[Option<f64>; 3]| {
        let each = names.iter().zip(values).zip(errors);
        let each: Vec<String> =
            each.map(|((name, value), error)| format!("{name} {value:.3}{}", sure(error))).collect();
        each.join(", ")
    };
    let lines = |one: &Placement| {
        let frame = if one.frame == "flange" { "on the flange" } else { "in the frame of the measurements" };
        let label = format!("{} {frame}: ", one.name);
        // How sure a turn is is given about the axes of the frame, which roll, pitch and yaw are not.
        let turn = ["roll", "pitch", "yaw"].iter().zip(one.rpy_deg);
        let turn: Vec<String> = turn.map(|(name, value)| format!("{name} {value:.4}")).collect();
        let about: Vec<String> =
            one.se_deg.iter().map(|error| error.map_or("-".to_owned(), figure)).collect();
        let about = match one.se_deg.iter().any(Option::is_some) {
            true => format!(" +- {} about its x, y, z", about.join(", ")),
            false => String::new(),
        };
        format!(
            "  {label}{} mm\n  {:width$}{} deg{about}\n",
            numbers(["x", "y", "z"], &one.xyz_mm, &one.se_mm),
            "",
            turn.join(", "),
            width = label.len()
        )
    };
    placed.iter().map(lines).collect()
}

/// Where planes, balls and edges that were fitted lie, and how sure that is.
pub(super) fn surface_lines(found: &[FoundSurface]) -> String {
    let number = |one: &FoundNumber| {
        let value = one.value.map_or_else(String::new, |value| format!(" {value:.3}"));
        let sure = one.se.map_or_else(|| " (not estimated)".to_owned(), |se| format!(" +- {}", figure(se)));
        format!("{}{value}{sure} {}", one.name, one.unit)
    };
    let line = |one: &FoundSurface| {
        let mut parts = Vec::new();
        if let Some([x, y, z]) = one.direction {
            let what = if one.shape == "plane" { "normal" } else { "direction" };
            parts.push(format!("{what} ({x:.5}, {y:.5}, {z:.5})"));
        }
        if let (Some([x, y, z]), "edge") = (one.xyz_mm, one.shape) {
            parts.push(format!("through ({x:.3}, {y:.3}, {z:.3}) mm"));
        }
        parts.extend(one.numbers.iter().map(number));
        let angle = |other: &FoundAngle| {
            let sure = other
                .se_deg
                .map_or_else(|| " (not estimated)".to_owned(), |se| format!(" +- {}", figure(se)));
            format!("  {} to {}: {:.4}{sure} deg\n", one.name, other.to, other.deg)
        };
        let angles: String = one.angles.iter().map(angle).collect();
        format!(
            "  {} ({}) in the frame of the measurements: {}\n{angles}",
            one.name,
            one.shape,
            parts.join(", ")
        )
    };
    found.iter().map(line).collect()
}

/// How much of what is left could be explained at all, and how much where whole regions are left out; empty where that was not asked.
pub(super) fn explainable_line(explainable: Option<&Explainable>) -> String {
    let Some(explainable) = explainable else { return String::new() };
    let regions =
        explainable.blocked.filter(|_| explainable.is_structured()).map_or_else(String::new, |blocked| {
            format!(
                "; in cross-validation by whole regions {:.3} {unit} is left, {:.3} {unit} is not predictable",
                blocked.left_mm,
                blocked.not_predictable_mm,
                unit = explainable.unit
            )
        });
    format!("explainable: {}{regions}\n", explainable_sentence(explainable))
}

/// Where the noise floor lies and how that is known.
pub(super) fn floor_line(floor: &Floor, unit: ReadingUnit) -> String {
    match (floor.sigma_mm, floor.source) {
        (Some(sigma), FloorSource::Repeats) => {
            let allowed = match floor.allowed_for.as_slice() {
                [] => String::new(),
                some => format!(", {} allowed for", some.join(", ")),
            };
            format!(
                "noise: {}, from returns ({} degrees of freedom{allowed})\n",
                noise_text(sigma, unit, 4),
                floor.dof
            )
        }
        (Some(sigma), _) => format!("noise: {}, as declared\n", noise_text(sigma, unit, 4)),
        (None, _) => {
            "noise: unknown; return to some poses (column `repeat`) or declare it (`noise:`)\n".to_owned()
        }
    }
}

/// Which noise was declared and which is estimated, where not all of it was declared; else nothing.
pub(super) fn noise_lines(noise: &[ReadingNoise]) -> String {
    if !noise.iter().any(|one| one.source == NoiseSource::Estimated) {
        return String::new();
    }
    let line = |one: &ReadingNoise| {
        let source = match one.source {
            NoiseSource::Declared => "declared",
            NoiseSource::Estimated => "estimated from the fit",
            NoiseSource::Unknown => "not known",
        };
        format!("  noise of {}: {}, {source}\n", one.reading, figure(one.sigma))
    };
    noise.iter().map(line).collect()
}

/// The fitted effects, one a line.
pub(super) fn effects_table(effects: &[EffectValue]) -> String {
    let width = effects.iter().map(|effect| effect.label.len()).max().unwrap_or(0);
    let line = |effect: &EffectValue| {
        let label = format!("{:width$}", effect.label);
        if effect.held {
            let why = effect
                .held_because
                .as_ref()
                .map_or_else(String::new, |why| format!(": {}", why_held_in_words(why)));
            return format!("  {label}  not estimated{why}\n");
        }
        let mut odd = if effect.plausible { String::new() } else { "  (implausible value)".to_owned() };
        if effect.claim == Claim::Correction {
            odd.push_str(&format!("  (correction: may be {})", effect.may_be.join(", or ")));
        }
        if !is_determined(effect.se) {
            return format!("  {label}  size not determined{odd}\n");
        }
        let unit = shown_unit(&effect.unit);
        let line = format!("  {label}  {:>12} +- {:<10} {unit}{odd}", figure(effect.size), figure(effect.se));
        format!("{}\n", line.trim_end())
    };
    effects.iter().map(line).collect()
}

/// A number with a few significant figures.
pub(super) fn figure(value: f64) -> String {
    let size = value.abs();
    match size {
        0.0 => "0".to_owned(),
        _ if !(1e-4..1e6).contains(&size) => format!("{value:.3e}"),
        _ => {
            let digits = (3.0 - size.log10().floor()).clamp(0.0, 7.0) as usize;
            format!("{value:.digits$}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::figure;

    #[test]
    fn figures_are_short() {
        assert_eq!(figure(0.065_524_667), "0.06552");
        assert_eq!(figure(1.62e-5), "1.620e-5");
        assert_eq!(figure(-431.8), "-431.8");
    }
}
