//! A motor that loses steps once: from then on the joint is not where the count says.

/// `lost` rad go missing at `at_s`.
#[derive(Debug, Clone)]
pub(in crate::physics) struct LostSteps {
    pub(super) joint: usize,
    pub(super) lost: f64,
    pub(super) at_s: f64,
}

impl LostSteps {
    pub(super) fn pass(&mut self, angles: &mut [f64], time_s: f64) {
        if time_s >= self.at_s
            && let Some(angle) = angles.get_mut(self.joint)
        {
            *angle -= self.lost;
        }
    }
}
