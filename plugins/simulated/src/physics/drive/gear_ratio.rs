//! Ratios that are not what the controller believes.

use super::DrivePart;

/// The joint turns by `1 + excess` of what is commanded.
pub(super) struct Ratio {
    pub(super) joint: usize,
    pub(super) excess: f64,
}

impl DrivePart for Ratio {
    fn pass(&mut self, angles: &mut [f64], _time_s: f64) {
        if let Some(angle) = angles.get_mut(self.joint) {
            *angle *= 1.0 + self.excess;
        }
    }
}

/// A wheel on the axis of `driver` drags the train of `joint`, as in wrists with nested shafts.
pub(super) struct Coupling {
    pub(super) joint: usize,
    pub(super) driver: usize,
    pub(super) ratio: f64,
}

impl DrivePart for Coupling {
    fn pass(&mut self, angles: &mut [f64], _time_s: f64) {
        let driving = angles.get(self.driver).copied().unwrap_or(0.0);
        if let Some(angle) = angles.get_mut(self.joint) {
            *angle += self.ratio * driving;
        }
    }
}
