//! Play: the driven side rests until the driving side has crossed the gap.

/// The play operator: the output follows the input at half a width's distance and remembers the side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Play {
    joint: usize,
    width: f64,
    wear: Option<Wear>,
    output: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Wear {
    at: f64,
    spread: f64,
}

impl Play {
    /// The same gap of `width` rad everywhere.
    pub fn even(joint: usize, width: f64) -> Self {
        Self { joint, width: width.abs(), wear: None, output: None }
    }

    /// Teeth worn around one angle: a gap of `width` rad at `at`, closing as a bell over `spread` rad.
    pub fn worn(joint: usize, width: f64, at: f64, spread: f64) -> Self {
        Self { joint, width: width.abs(), wear: Some(Wear { at, spread }), output: None }
    }

    /// The gap at `angle`, rad.
    pub fn width_at(&self, angle: f64) -> f64 {
        self.wear
            .map_or(self.width, |wear| self.width * (-0.5 * ((angle - wear.at) / wear.spread).powi(2)).exp())
    }

    /// The driven side after the driving side has moved straight to `input`.
    pub fn follow(&mut self, input: f64) -> f64 {
        let half = 0.5 * self.width_at(input);
        let output = self.output.map_or(input, |output| output.clamp(input - half, input + half));
        self.output = Some(output);
        output
    }
}

impl Play {
    pub(super) fn pass(&mut self, angles: &mut [f64]) {
        if let Some(angle) = angles.get_mut(self.joint) {
            *angle = self.follow(*angle);
        }
    }
}
