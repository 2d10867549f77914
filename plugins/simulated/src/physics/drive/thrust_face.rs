//! A screw that bears against a face which is not square to it.

use std::f64::consts::TAU;

/// The motor turns the screw by the travel that is commanded over its pitch. Its thrust face leans: at a turn by `a` from where it is highest it lifts the
/// screw, and the nut with it,
/// by `runout sin(a)`, as a swash plate does; a face with two high places does so twice a turn.
#[derive(Debug, Clone)]
pub(in crate::physics) struct ThrustFace {
    pub(super) joint: usize,
    /// Travel for a turn of the screw, mm.
    pub(super) pitch: f64,
    /// High places of the face.
    pub(super) per_turn: f64,
    /// Where the face is at zero, rad of the wave.
    pub(super) phase: f64,
    /// Half of the lift, mm.
    pub(super) runout: f64,
}

impl ThrustFace {
    pub(super) fn pass(&mut self, angles: &mut [f64]) {
        if let Some(travel) = angles.get_mut(self.joint) {
            let turned = TAU * *travel / self.pitch;
            *travel += self.runout * (self.per_turn * turned + self.phase).sin();
        }
    }
}
