//! A wheel, or the disc of an encoder, whose centre is not its axis.

/// A wheel that turns `per_turn` times for a turn of the joint about an axis beside its centre.
///
/// Centre, axis and reading point (or tooth in mesh) form a triangle. With the centre at distance `e` from the axis, the track of radius `R`
/// about the centre, and `a` the angle between the centre and the reading point as the axis sees them, the law of sines gives the error at the wheel
/// exactly: `asin(e/R sin a)`. Its first order is the `412 e/D` arcseconds (e in micrometres, D in mm) of encoder makers' catalogues.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EccentricWheel {
    /// Joint.
    pub joint: usize,
    /// e/R, below one.
    pub eccentricity: f64,
    /// Turns of the wheel for a turn of the joint.
    pub per_turn: f64,
    /// Where the centre is at zero, rad.
    pub phase: f64,
}

impl EccentricWheel {
    /// By how much the wheel reads too much, rad at the joint, when the joint truly is at `angle`.
    pub fn reads_too_much(&self, angle: f64) -> f64 {
        let sine = self.eccentricity * (self.per_turn * angle + self.phase).sin();
        sine.clamp(-1.0, 1.0).asin() / self.per_turn
    }

    /// Where the joint truly is when the wheel reads `reading` rad.
    pub fn true_angle(&self, reading: f64) -> f64 {
        let mut angle = reading;
        for _ in 0..60 {
            let next = reading - self.reads_too_much(angle);
            let done = (next - angle).abs() < 1e-15;
            angle = next;
            if done {
                break;
            }
        }
        angle
    }
}

impl EccentricWheel {
    pub(super) fn pass(&mut self, angles: &mut [f64]) {
        if let Some(angle) = angles.get_mut(self.joint) {
            *angle = self.true_angle(*angle);
        }
    }
}
