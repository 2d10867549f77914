//! Ratios that are not what the controller believes.

/// The joint turns by `1 + excess` of what is commanded.
#[derive(Debug, Clone)]
pub(in crate::physics) struct Ratio {
    pub(super) joint: usize,
    pub(super) excess: f64,
}

impl Ratio {
    pub(super) fn pass(&mut self, angles: &mut [f64]) {
        if let Some(angle) = angles.get_mut(self.joint) {
            *angle *= 1.0 + self.excess;
        }
    }
}

/// A wheel on the axis of `driver` drags the train of `joint`, as in wrists with nested shafts; or a cable that runs over that axis does.
#[derive(Debug, Clone)]
pub(in crate::physics) struct Coupling {
    pub(super) joint: usize,
    pub(super) driver: usize,
    pub(super) ratio: f64,
}

impl Coupling {
    pub(super) fn pass(&mut self, angles: &mut [f64]) {
        let driving = angles.get(self.driver).copied().unwrap_or(0.0);
        if let Some(angle) = angles.get_mut(self.joint) {
            *angle += self.ratio * driving;
        }
    }
}
