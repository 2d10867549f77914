//! Play that comes out negative: the joint goes too far.

use crate::laboratory::Laboratory;
use crate::outcome::Diagnosis;

impl Laboratory {
    /// What to look at where negative play is named in a table that logs the way in which joints arrived.
    pub(crate) fn negative_play(&self, diagnosis: &Diagnosis) -> Option<String> {
        self.table().approach.as_ref()?;
        let named = diagnosis.named.as_ref()?;
        let negative = named.effect.effect == "joint_backlash" && named.size < 0.0;
        negative.then(|| {
            let joint = &named.effect.place;
            format!(
                "the play of {joint} is negative: {joint} goes too far where play would make it stop short, as where a controller takes out more play than there is. If `approach_{joint}` is not 1 where {joint} \
                 arrived so that its coordinate grew, and -1 where it fell, turn the signs of that column"
            )
        })
    }
}
