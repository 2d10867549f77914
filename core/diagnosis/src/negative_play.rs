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
        negative.then(|| Note::NegativePlay(named.effect.place.clone()))
    }
}
