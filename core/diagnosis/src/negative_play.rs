//! Play that comes out negative: the joint goes too far.

use crate::laboratory::Laboratory;
use crate::note::Note;
use crate::outcome::Diagnosis;

impl Laboratory {
    /// The joint, where negative play is named in a table that logs the way in which joints arrived.
    pub(crate) fn negative_play(&self, diagnosis: &Diagnosis) -> Option<Note> {
        self.table().approach.as_ref()?;
        let named = diagnosis.named.as_ref()?;
        let negative = named.effect.effect == "joint_backlash" && named.size < 0.0;
        negative.then(|| Note::NegativePlay(named.effect.site.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::Named;
    use crate::testing::{effect_at, sides_in_turn, two_links, with_table};
    use plumb_estimation::Progress;

    #[test]
    fn only_play_below_zero_with_logged_sides_is_worth_a_note() {
        let silent = two_links(30, "joint_zero(*)", 0.05, 4, |_| [0.0; 2]);
        let logged = with_table(&silent, |table| table.approach = Some(sides_in_turn(30)));
        let mut diagnosis = logged.diagnose(&Progress::unwatched()).unwrap();
        let mut noted = |lab: &Laboratory, effect: &str, size: f64| {
            diagnosis.named =
                Some(Named { effect: effect_at(effect, "elbow"), size, unit: "deg".to_owned(), se: 0.01 });
            lab.negative_play(&diagnosis)
        };
        assert_eq!(noted(&logged, "joint_backlash", -0.1), Some(Note::NegativePlay("elbow".to_owned())));
        assert_eq!(noted(&logged, "joint_backlash", 0.0), None);
        assert_eq!(noted(&logged, "joint_backlash", 0.1), None);
        assert_eq!(noted(&logged, "joint_gain", -0.1), None, "another effect may be negative");
        assert_eq!(noted(&silent, "joint_backlash", -0.1), None, "which side is which was not logged");
        diagnosis.named = None;
        assert_eq!(logged.negative_play(&diagnosis), None);
    }
}
