//! What is said of a model held against a table.

use crate::phrase::noise_text;
use plumb_calibration::fit::Gauge;
use plumb_diagnosis::laboratory::{Comparison, WhyHeld};

/// How far a model misses, and how large the noise is.
pub fn comparison_sentence(comparison: &Comparison) -> String {
    let (floor, rms, unit) = (&comparison.floor, &comparison.rms_mm, comparison.unit);
    let shown = rms.check.map_or_else(
        || format!("The model misses by {:.3} {unit} RMS", rms.fit),
        |check| {
            format!(
                "The model misses by {:.3} {unit} RMS where it was fitted and by {check:.3} {unit} where it was not",
                rms.fit
            )
        },
    );
    match floor.sigma_mm {
        Some(sigma) => format!("{shown}; the noise is {}.", noise_text(sigma, unit, 3)),
        None => format!("{shown}; the noise is not known: return to some poses, or declare it."),
    }
}

/// Why the data cannot determine an effect.
pub fn why_held_in_words(why: &WhyHeld) -> String {
    match why {
        WhyHeld::NoMasses => {
            "no masses are declared, so gravity moves nothing: declare `links:` or a payload, or add gravity_flexure(j)"
                .to_owned()
        }
        WhyHeld::ChangesNothing => "it changes nothing that was measured".to_owned(),
        WhyHeld::SameAs(others) => format!("same effect as {}", others.join(", ")),
    }
}

/// A freedom that the data cannot see.
pub fn gauge_in_words(gauge: &Gauge) -> String {
    match gauge.same_as.is_empty() {
        true => format!("{} not estimated: it changes nothing that was measured", gauge.held),
        false => format!("{} not estimated: same effect as {}", gauge.held, gauge.same_as.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links;
    use plumb_diagnosis::laboratory::Rms;
    use plumb_estimation::Progress;

    #[test]
    fn a_comparison_says_both_errors_and_that_nobody_knows_the_noise() {
        let mut compared =
            two_links(20, "free: []", 0.05, 5, |_| [0.0; 2]).compare(&Progress::unwatched()).unwrap();
        compared.rms_mm = Rms { fit: 0.1234, cv: None, check: None };
        compared.floor.sigma_mm = None;
        assert_eq!(
            comparison_sentence(&compared),
            "The model misses by 0.123 mm RMS; the noise is not known: return to some poses, or declare it."
        );
        compared.rms_mm.check = Some(0.2);
        compared.floor.sigma_mm = Some(0.05);
        assert_eq!(
            comparison_sentence(&compared),
            "The model misses by 0.123 mm RMS where it was fitted and by 0.200 mm where it was not; the noise is 0.050 mm an axis."
        );
    }

    #[test]
    fn what_is_held_says_what_does_the_same() {
        let others = vec!["base rotation about z".to_owned(), "joint_zero(lift)".to_owned()];
        let why = WhyHeld::SameAs(others.clone());
        assert_eq!(why_held_in_words(&why), "same effect as base rotation about z, joint_zero(lift)");
        let gauge = Gauge { held: "joint_zero(pan)".to_owned(), same_as: others };
        assert_eq!(
            gauge_in_words(&gauge),
            "joint_zero(pan) not estimated: same effect as base rotation about z, joint_zero(lift)"
        );
    }
}
