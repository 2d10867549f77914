//! A motor that loses steps once: from then on the joint is not where the count says.

use super::DrivePart;

/// `lost` rad go missing at `at_s`.
pub(super) struct LostSteps {
    pub(super) joint: usize,
    pub(super) lost: f64,
    pub(super) at_s: f64,
}

impl DrivePart for LostSteps {
    fn pass(&mut self, angles: &mut [f64], time_s: f64) {
        if time_s >= self.at_s
            && let Some(angle) = angles.get_mut(self.joint)
        {
            *angle -= self.lost;
        }
    }
}
