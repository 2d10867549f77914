//! The fall of the error as a picture: a bar a step, the error of one measured point in the unit of the table's readings. Mechanisms are solid, corrections and a residual map hatched; the
//! noise and what no function of what is known of a row predicts are lines.

use std::fmt::Write;

use crate::plot::escaped;
use plumb_calibration::measurement::ReadingUnit;
use plumb_diagnosis::report::{ErrorStep, Report, StepKind};

/// Where the bars begin, and the length of the longest.
const BARS: (f64, f64) = (300.0, 520.0);

/// Height of one step.
const STEP_HEIGHT: f64 = 44.0;

/// The error at the end of the longest bar, and the unit of all errors.
#[derive(Clone, Copy)]
struct Scale {
    greatest: f64,
    unit: ReadingUnit,
}

/// The greatest error of any step, mm or deg.
fn greatest(error_steps: &[ErrorStep]) -> f64 {
    let values =
        error_steps.iter().flat_map(|step| [Some(step.fit_mm2), step.cv_mm2, step.check_mm2]).flatten();
    values.filter(|value| value.is_finite()).fold(1e-12, f64::max).sqrt()
}

/// Draws the fall.
pub(super) fn draw(out: &mut String, report: &Report) -> std::fmt::Result {
    let scale = Scale { greatest: greatest(&report.error_steps), unit: report.comparison.unit };
    let height = STEP_HEIGHT * report.error_steps.len() as f64 + 78.0;
    writeln!(
        out,
        "<p class=\"faint\">Bars: RMS error of one measured point, {}, in the fit; below each, outlined, in cross-validation (regions left out in turn), and dashed on the held-out rows. A solid bar is the \
         model with mechanisms alone, a hatched one has a correction or a residual map in. Lines: the noise of a point, and what no function of pose, moves or \
         conditions predicts on unseen rows.</p>",
        report.comparison.unit
    )?;
    writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 960 {height}\" width=\"960\" height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">"
    )?;
    writeln!(
        out,
        "<defs><pattern id=\"hatched\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\"><rect width=\"6\" height=\"6\" \
         fill=\"white\"/><path d=\"M0 0V6\" stroke=\"#1f5fa0\" stroke-width=\"5\"/></pattern></defs>"
    )?;
    let mut hatched = false;
    for (index, step) in report.error_steps.iter().enumerate() {
        let name = if index == 0 { "start".to_owned() } else { format!("+ {}", step.added) };
        // Once a correction is in, every later model holds it.
        hatched |= matches!(step.kind, StepKind::Correction | StepKind::ResidualMap);
        bars(out, step, (&name, hatched), 10.0 + STEP_HEIGHT * index as f64, scale)?;
    }
    axis(out, height, scale)?;
    if let Some(noise) = report.comparison.floor_of_a_point_mm {
        vertical_line(out, ("noise of a point", "#2a8a2a", noise), height - 30.0, scale)?;
    }
    if let Some(explainable) = report.comparison.explainable.as_ref().filter(|known| known.is_structured()) {
        let bound = explainable.not_predictable_mm;
        vertical_line(out, ("not predictable", "#b06000", bound), height - 44.0, scale)?;
    }
    writeln!(out, "</svg>")
}

/// The bars of one step: fitted, left out, held out.
fn bars(
    out: &mut String,
    step: &ErrorStep,
    (name, hatched): (&str, bool),
    top: f64,
    Scale { greatest, unit }: Scale,
) -> std::fmt::Result {
    let (left, width) = BARS;
    writeln!(
        out,
        "<text x=\"{}\" y=\"{:.0}\" text-anchor=\"end\">{}</text>",
        left - 10.0,
        top + 14.0,
        escaped(name)
    )?;
    let fitted = match hatched {
        true => "class=\"correction\" fill=\"url(#hatched)\" stroke=\"#1f5fa0\"",
        false => "class=\"mechanism\" fill=\"#1f5fa0\"",
    };
    let bars = [
        (Some(step.fit_mm2), fitted, 0.0),
        (step.cv_mm2, "fill=\"white\" stroke=\"#1f5fa0\"", 12.0),
        (step.check_mm2, "fill=\"white\" stroke=\"#1f5fa0\" stroke-dasharray=\"3 2\"", 24.0),
    ];
    for (square, style, down) in bars {
        let Some(error) = square.map(f64::sqrt).filter(|error| error.is_finite()) else { continue };
        // Half a pixel, so that an error of nothing is still seen to have been measured.
        let long = (width * error / greatest).max(0.5);
        writeln!(
            out,
            "<rect x=\"{left}\" y=\"{:.0}\" width=\"{long:.1}\" height=\"10\" {style}/>",
            top + 4.0 + down
        )?;
        writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.0}\" font-size=\"10\" fill=\"#555\">{error:.4} {unit}</text>",
            left + long + 6.0,
            top + 13.0 + down,
        )?;
    }
    Ok(())
}

/// The axis below the bars.
fn axis(out: &mut String, height: f64, Scale { greatest, unit }: Scale) -> std::fmt::Result {
    let (left, width) = BARS;
    let y = height - 16.0;
    writeln!(
        out,
        "<path d=\"M{left} {y:.0}h{width}\" stroke=\"#888\"/><text x=\"{left}\" y=\"{t:.0}\" fill=\"#555\">0</text><text x=\"{end}\" y=\"{t:.0}\" fill=\"#555\" \
         text-anchor=\"end\">{greatest:.4} {unit}</text><text x=\"{middle}\" y=\"{t:.0}\" fill=\"#555\" text-anchor=\"middle\">RMS error of one measured point, {unit}</text>",
        t = y + 13.0,
        end = left + width,
        middle = left + 0.5 * width,
    )
}

/// A line across all steps with its name below, at an error on the scale.
fn vertical_line(
    out: &mut String,
    (name, colour, error): (&str, &str, f64),
    below: f64,
    Scale { greatest, unit }: Scale,
) -> std::fmt::Result {
    // A noise beyond all errors is at the end, not outside the picture.
    let x = BARS.0 + BARS.1 * (error / greatest).min(1.0);
    let foot = below - 12.0;
    writeln!(
        out,
        "<path d=\"M{x:.1} 6V{foot:.0}\" stroke=\"{colour}\" stroke-width=\"1.5\" stroke-dasharray=\"5 3\"/>"
    )?;
    writeln!(out, "<text x=\"{x:.1}\" y=\"{below:.0}\" fill=\"{colour}\">{name} {error:.4} {unit}</text>")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_is_that_of_the_greatest_error_of_any_step() {
        let error_steps = |fit_mm2: f64, cv_mm2: Option<f64>| ErrorStep {
            added: String::new(),
            kind: StepKind::Mechanism,
            fit_mm2,
            cv_mm2,
            check_mm2: Some(f64::NAN),
        };
        assert_eq!(greatest(&[error_steps(1.0, Some(9.0)), error_steps(4.0, None)]), 3.0);
        assert!(greatest(&[]) > 0.0, "nothing is divided by zero");
    }

    #[test]
    fn a_line_is_at_its_share_of_the_greatest_error_and_never_outside() {
        let at = |error: f64| {
            let mut out = String::new();
            vertical_line(
                &mut out,
                ("noise", "green", error),
                100.0,
                Scale { greatest: 2.0, unit: ReadingUnit::Mm },
            )
            .unwrap();
            out
        };
        assert!(at(1.0).contains(&format!("M{:.1} 6V88", BARS.0 + 0.5 * BARS.1)), "{}", at(1.0));
        assert!(at(5.0).contains(&format!("M{:.1} 6", BARS.0 + BARS.1)), "{}", at(5.0));
    }
}
