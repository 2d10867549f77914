//! What is said of a residual map: it explains nothing.

use plumb_diagnosis::laboratory::{MapNote, MapStep};

/// What the map of a model does, as part of a sentence.
pub fn map_in_words(map: &MapNote) -> String {
    format!(
        "a residual map takes {:.0} % of the variance that the model leaves: not understood; it acts in {} of {} rows, in the measured region",
        100.0 * map.not_understood,
        map.rows_inside,
        map.rows
    )
}

/// What a map does that was fitted last.
pub fn map_sentence(step: &MapStep) -> String {
    let [without_mm, with_mm] = step.left_out_mm;
    let sentence = format!(
        "A residual map of {} takes {:.0} % of the variance that is left ({without_mm:.3} -> {with_mm:.3} {} on rows left out): not understood, and good only in the measured region.",
        step.goes_by.join(" and "),
        100.0 * step.not_understood,
        step.unit,
    );
    match step.between_unknown {
        true => {
            format!(
                "{sentence} With so few poses it was judged on returns to them; between them it interpolates, which nothing here checks."
            )
        }
        false => sentence,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_calibration::measurement::ReadingUnit;
    use plumb_diagnosis::laboratory::Rms;

    #[test]
    fn the_sentence_of_a_map_says_what_it_takes_and_what_nothing_checks() {
        let step = |between_unknown: bool| MapStep {
            unit: ReadingUnit::Mm,
            left_out_mm: [0.2, 0.1234],
            rms_mm: Rms { fit: 0.1, cv: None, check: None },
            not_understood: 0.62,
            goes_by: vec!["pose".to_owned(), "side of approach".to_owned()],
            locked_inside: [3, 4],
            between_unknown,
        };
        assert_eq!(
            map_sentence(&step(false)),
            "A residual map of pose and side of approach takes 62 % of the variance that is left (0.200 -> 0.123 mm on rows left out): not understood, and good only in the measured region."
        );
        assert!(map_sentence(&step(true)).ends_with("which nothing here checks."));
    }

    #[test]
    fn a_note_says_in_how_many_rows_the_map_acts() {
        let note = MapNote { not_understood: 0.123, rows_inside: 30, rows: 40 };
        let message = map_in_words(&note);
        assert!(
            message.contains("takes 12 % of the variance") && message.contains("acts in 30 of 40 rows"),
            "{message}"
        );
    }
}
