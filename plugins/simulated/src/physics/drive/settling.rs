//! Creep: a belt or spring that takes its time after a move.

/// Every move leaves the joint short by a fraction of its length; what is left is forgotten exponentially.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settling {
    joint: usize,
    fraction: f64,
    forgetting_s: f64,
    lag: f64,
    last: Option<(f64, f64)>,
}

impl Settling {
    /// Short by `fraction` of each move, forgotten with the time constant `forgetting_s`.
    pub fn new(joint: usize, fraction: f64, forgetting_s: f64) -> Self {
        Self { joint, fraction, forgetting_s, lag: 0.0, last: None }
    }

    /// Where the joint is after a straight move to `input` that ends at `time_s`.
    pub fn follow(&mut self, input: f64, time_s: f64) -> f64 {
        let (before, since) = self.last.unwrap_or((input, time_s));
        self.lag = self.lag * (-(time_s - since).max(0.0) / self.forgetting_s).exp()
            + self.fraction * (input - before);
        self.last = Some((input, time_s));
        input - self.lag
    }
}

impl Settling {
    pub(super) fn pass(&mut self, angles: &mut [f64], time_s: f64) {
        if let Some(angle) = angles.get_mut(self.joint) {
            *angle = self.follow(*angle, time_s);
        }
    }
}
