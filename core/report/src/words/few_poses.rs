//! What is said where few poses were measured often, as along an axis after ISO 230-2.

use crate::phrase::{listed, size_text};
use plumb_diagnosis::{AcrossPoses, ConditionAtPoses, Diagnosis, FewPoses, PoseFraction};

/// How much goes with the pose alone.
pub(super) fn fraction_in_words(fraction: &PoseFraction) -> String {
    format!(
        "{:.0} % of what is left depends on the pose alone, more than the returns to {} poses scatter",
        100.0 * fraction.fraction,
        fraction.poses
    )
}

/// How the positioning error of a slide is taken in as a curve; nothing where no slide alone was moved.
fn curve_in_words(few: &FewPoses) -> String {
    few.curve.as_ref().map_or_else(String::new, |curve| {
        format!(" `{curve}` holds it as the axis's positioning error; `grow` keeps it as a residual map.")
    })
}

/// What follows a verdict's sentence where no condition is at work: the fraction of the pose, unless the sentence has it already, and the curve.
pub(super) fn added_to(sentence: String, few: &FewPoses) -> String {
    let fraction = fraction_in_words(&few.fraction);
    let more = if sentence.contains(&fraction) { String::new() } else { format!(" {}.", capital(&fraction)) };
    format!("{sentence}{more}{}", curve_in_words(few))
}

/// The whole sentence where a condition is at work beside the poses' own errors.
pub(super) fn with_condition(diagnosis: &Diagnosis, few: &FewPoses, condition: &ConditionAtPoses) -> String {
    format!(
        "{} {}, and nothing in the library explains that.{}",
        at_work(diagnosis, condition),
        capital(&fraction_in_words(&few.fraction)),
        curve_in_words(few)
    )
}

/// What a condition does beside the poses' own errors.
fn at_work(diagnosis: &Diagnosis, condition: &ConditionAtPoses) -> String {
    let (label, unit) = (&condition.label, diagnosis.unit);
    let size = diagnosis.named.as_ref().map(|named| size_text(named.size, named.se, &named.unit));
    let size = size.unwrap_or_default();
    match condition.across {
        AcrossPoses::Tied { scatter_mm } => {
            let tied: Vec<String> =
                diagnosis.tied.iter().map(|one| format!("{}({})", one.effect, one.site)).collect();
            format!(
                "{} cannot be distinguished with these data: what depends on the direction of arrival differs from pose to pose by {scatter_mm:.4} {unit} (standard deviation), more than the returns scatter. \
                 Measure at more places, and let the moves to them be of several lengths.",
                listed(&tied, "and")
            )
        }
        AcrossPoses::Same => format!("{label} is at work: {size}, the same at every pose; add it."),
        AcrossPoses::Differs { scatter_mm } => format!(
            "{label} is at work: {size} on the average of the poses, from which they differ by {scatter_mm:.4} {unit} (standard deviation); add it."
        ),
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn few() -> FewPoses {
        let fraction = PoseFraction { fraction: 0.617, p: 1e-6, poses: 10 };
        FewPoses { fraction, condition: None, curve: None }
    }

    #[test]
    fn a_sentence_begins_with_a_capital() {
        assert_eq!(
            (capital("62 % goes"), capital("half goes"), capital("")),
            ("62 % goes".into(), "Half goes".into(), String::new())
        );
    }

    #[test]
    fn the_share_of_the_pose_is_said_once() {
        let fraction =
            "62 % of what is left depends on the pose alone, more than the returns to 10 poses scatter";
        assert_eq!(fraction_in_words(&few().fraction), fraction);
        assert_eq!(
            added_to("Nothing is named.".to_owned(), &few()),
            format!("Nothing is named. {fraction}.")
        );
        let has_it = format!("0.1 mm is left: {fraction}.");
        assert_eq!(added_to(has_it.clone(), &few()), has_it);
        let with_curve = FewPoses { curve: Some("positioning_error(x, 7)".to_owned()), ..few() };
        assert!(added_to(has_it, &with_curve).contains("scatter. `positioning_error(x, 7)` holds it"));
    }
}
