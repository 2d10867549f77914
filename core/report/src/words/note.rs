//! What the user should know besides an error or a verdict.

use plumb_diagnosis::Note;

/// A note, as part of a list.
pub fn note_in_words(note: &Note) -> String {
    match note {
        Note::Noticed(message) => message.clone(),
        Note::OutsideRegion { outside, rows } => format!(
            "{outside} of {rows} rows lie outside the region in which the model's corrections were measured: there they are no more than a guess, and a residual map is left out"
        ),
        Note::NotArrived { reached, promised } => {
            format!("the fit has not arrived: {reached:.4} reached where a last step promises {promised:.4}")
        }
        Note::MapLeftOut => "the model's residual map is left out here: it explains nothing, and what it takes away is what is to be explained"
            .to_owned(),
        Note::SearchedPart { looked_at, fitted } => {
            format!("the search looked at {looked_at} of {fitted} fitted rows, spread at random")
        }
        Note::RisesUnderLoad(label) => format!(
            "gravity seems to point the other way in this model: {label} explains most, and would rise under its load; check `gravity:`, and how the base is mounted"
        ),
        Note::Twin { label, twin } => format!("{label}: {twin}"),
        Note::NegativePlay(joint) => format!(
            "the play of {joint} is negative: {joint} goes too far where play would make it stop short, as where a controller takes out more play than there is. If `approach_{joint}` is not 1 where {joint} \
             arrived so that its coordinate grew, and -1 where it fell, turn the signs of that column"
        ),
        Note::WorseHeldOut(label) => format!(
            "{label} is named by the rows that were fitted, but the held-out rows are predicted worse with it: it is not added"
        ),
        Note::Corrections(1) => "one of the effects added is a correction: it predicts rows it has not seen, but its mechanism is not identified; use it only in the measured region"
            .to_owned(),
        Note::Corrections(count) => format!(
            "{count} of the effects added are corrections: they predict rows they have not seen, but their mechanism is not identified; use them only \
             in the measured region"
        ),
        Note::DoesNotExtrapolate(way) => format!(
            "does not extrapolate: with {} left out it misses there by {:.3} {unit}, and by {:.3} {unit} without what was added; \
             use it only in the measured region",
            way.left_out, way.rms_mm, way.without_mm, unit = way.unit
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_calibration::measurement::ReadingUnit;
    use plumb_diagnosis::Extrapolation;

    #[test]
    fn notes_hold_the_numbers_and_names_they_are_about() {
        let way = Extrapolation {
            left_out: "regions".to_owned(),
            unit: ReadingUnit::Mm,
            rms_mm: 0.25,
            without_mm: 0.125,
        };
        let cases = [
            (Note::Noticed("as the reader says".to_owned()), "as the reader says"),
            (Note::OutsideRegion { outside: 3, rows: 40 }, "3 of 40 rows lie outside the region"),
            (
                Note::NotArrived { reached: 1.25, promised: 1.0 },
                "1.2500 reached where a last step promises 1.0000",
            ),
            (Note::SearchedPart { looked_at: 3000, fitted: 9000 }, "looked at 3000 of 9000 fitted rows"),
            (
                Note::RisesUnderLoad("joint_compliance(lift)".to_owned()),
                "joint_compliance(lift) explains most",
            ),
            (Note::NegativePlay("elbow".to_owned()), "If `approach_elbow` is not 1 where elbow arrived"),
            (Note::WorseHeldOut("joint_gain(elbow)".to_owned()), "joint_gain(elbow) is named"),
            (Note::Corrections(1), "one of the effects added is a correction: it predicts rows"),
            (Note::Corrections(2), "2 of the effects added are corrections"),
            (
                Note::DoesNotExtrapolate(way),
                "with regions left out it misses there by 0.250 mm, and by 0.125 mm without",
            ),
        ];
        for (note, part) in cases {
            assert!(note_in_words(&note).contains(part), "{}", note_in_words(&note));
        }
    }
}
