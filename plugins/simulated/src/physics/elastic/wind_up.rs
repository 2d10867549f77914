//! A cable run over two joints that hangs slack, and pulls once it is wound up.

use super::{ElasticPart, Loaded, Yielding};

/// Beyond `slack` rad of the two joints' sum the cable drags the joint back by `pull` rad for each further rad.
#[derive(Debug)]
pub(super) struct WindUp {
    pub(super) joint: usize,
    pub(super) pull: f64,
    pub(super) slack: f64,
}

impl ElasticPart for WindUp {
    fn yield_to(&self, loaded: &Loaded<'_>, yielding: &mut Yielding) {
        let angle = |joint: usize| loaded.angles.get(joint).copied().unwrap_or(0.0);
        let wound = angle(self.joint) + angle(self.joint + 1);
        let taut = wound - wound.clamp(-self.slack, self.slack);
        yielding.turn(self.joint, -self.pull * taut);
    }
}
