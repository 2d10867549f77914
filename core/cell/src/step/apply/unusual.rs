//! Corrections that a person should look at twice before they come into force.

use plumb_record::{NewCorrection, RecordError, StoredCorrection};

use super::ApplyStep;
use crate::engine::Engine;

/// A shift larger than this share of what is plausible is reported: an arm that struck something, or lost steps, is off like that; one that
/// was switched on in its place is not.
const LARGE_SHARE: f64 = 0.5;

/// A value further than so many standard deviations from those found before is reported. Of sound findings that are normally distributed one
/// in two million is.
const FAR: f64 = 5.0;

/// Earlier findings from which on a mean says something.
const ENOUGH: usize = 3;

impl Engine {
    /// What is unusual about corrections, in sentences; empty where nothing is.
    pub(crate) fn unusual(
        &self,
        step: &ApplyStep,
        corrections: &[NewCorrection],
    ) -> Result<Vec<String>, RecordError> {
        let mut warnings = Vec::new();
        for one in corrections {
            let shift = step.shifts.iter().find(|shift| shift.joint == one.key.site);
            warnings.extend(shift.and_then(|shift| large(one, shift.plausible)));
            let before = self.journal.record.correction_history(&self.cell.name, &one.key)?;
            warnings.extend(far_from(one, &before));
        }
        Ok(warnings)
    }
}

fn large(one: &NewCorrection, plausible: f64) -> Option<String> {
    let shift = one.new - one.old;
    if shift.abs() <= LARGE_SHARE * plausible {
        return None;
    }
    Some(format!(
        "the zero of {} shifts by {shift:+.3} {unit}, most of the {plausible} {unit} that are plausible. Did the arm strike something, lose \
         steps, or was it switched on in another place?",
        one.key.site,
        unit = one.unit
    ))
}

/// Whether a value is far from what runs found before.
fn far_from(one: &NewCorrection, before: &[StoredCorrection]) -> Option<String> {
    let found: Vec<f64> =
        before.iter().filter(|earlier| earlier.run.is_some()).map(|earlier| earlier.new).collect();
    if found.len() < ENOUGH {
        return None;
    }
    let count = found.len() as f64;
    let mean = found.iter().sum::<f64>() / count;
    let scatter = (found.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
    // Where the uncertainty was not determined, the scatter of earlier runs is all that is known.
    let deviation = one.uncertainty.map_or(scatter, |uncertainty| scatter.hypot(uncertainty));
    let away = (one.new - mean).abs();
    if away <= FAR * deviation {
        return None;
    }
    let unit = &one.unit;
    Some(format!(
        "the zero of {} would be {:.3} {unit}; {} earlier runs found {mean:.3} {unit} with a scatter of {scatter:.3} {unit}. Is the target \
         where it was, and was the arm not moved by hand?",
        one.key.site,
        one.new,
        found.len()
    ))
}

#[cfg(test)]
mod tests {
    use plumb_record::{CorrectionKey, RunId};

    use super::*;

    fn correction(old: f64, new: f64) -> NewCorrection {
        let key = CorrectionKey { device: "arm".into(), quantity: "joint_zero".into(), site: "waist".into() };
        NewCorrection { key, old, new, uncertainty: Some(0.02), budget: None, unit: "deg".into() }
    }

    fn earlier(values: &[f64]) -> Vec<StoredCorrection> {
        let stored = |(index, value): (usize, &f64)| StoredCorrection {
            id: index as i64,
            run: Some(RunId(1)),
            step: "apply".into(),
            key: correction(0.0, 0.0).key,
            old: 0.0,
            new: *value,
            uncertainty: Some(0.02),
            budget: None,
            unit: "deg".into(),
            proposed: String::new(),
            revision: Some(index as i64 + 1),
        };
        values.iter().enumerate().map(stored).collect()
    }

    #[test]
    fn a_shift_of_most_of_what_is_plausible_is_reported() {
        assert_eq!(large(&correction(0.0, 10.0), 20.0), None);
        let warning = large(&correction(0.0, -17.084), 20.0).expect("a warning");
        assert!(warning.contains("shifts by -17.084 deg, most of the 20 deg"), "{warning}");
    }

    #[test]
    fn a_value_far_from_those_before_is_reported_and_one_among_them_is_not() {
        let before = earlier(&[1.70, 1.72, 1.69, 1.71]);
        assert_eq!(far_from(&correction(1.7, 1.74), &before), None);
        let warning = far_from(&correction(1.7, 2.1), &before).expect("a warning");
        assert!(warning.contains("4 earlier runs found 1.705 deg"), "{warning}");
        assert_eq!(far_from(&correction(1.7, 2.1), &before[..2]), None, "two values are no history");
    }

    #[test]
    fn what_was_rolled_back_is_no_finding() {
        let mut before = earlier(&[1.70, 1.72, 1.69]);
        before[0].run = None;
        assert_eq!(far_from(&correction(1.7, 9.0), &before), None);
    }

    #[test]
    fn the_scatter_is_that_of_the_runs_and_a_value_five_of_it_away_is_far() {
        // 1, 2 and 3: a mean of 2 and a standard deviation of 1.
        let before = earlier(&[1.0, 2.0, 3.0]);
        let undetermined = |new| NewCorrection { uncertainty: None, ..correction(2.0, new) };
        assert_eq!(far_from(&undetermined(7.0), &before), None, "five deviations away");
        assert_eq!(far_from(&undetermined(-3.0), &before), None);
        for new in [7.01, -3.01] {
            let warning = far_from(&undetermined(new), &before).expect("a warning");
            assert!(
                warning.contains("3 earlier runs found 2.000 deg with a scatter of 1.000 deg"),
                "{warning}"
            );
        }
        // An uncertainty of 0.75 makes of a scatter of 1 one of 1.25.
        let known = |new| NewCorrection { uncertainty: Some(0.75), ..correction(2.0, new) };
        assert_eq!(far_from(&known(8.25), &before), None);
        assert!(far_from(&known(8.26), &before).is_some());
        assert_eq!(large(&correction(1.0, 11.0), 20.0), None, "half of it is not most of it");
        assert!(
            large(&correction(1.0, 11.01), 20.0).is_some() && large(&correction(1.0, -9.01), 20.0).is_some()
        );
    }
}
