//! Stick and slip: the joint hangs in rough spots along its travel and jumps from one to the next.

use crate::physics::random::Random;

/// Rough spots along the travel. Moving on from a spot the joint stays while the drive winds up, then slips and is ahead; a controller's friction
/// compensation takes out the average, so that between two spots the error runs evenly from `-depth` to `+depth`, mirrored for the other way.
#[derive(Debug, Clone, PartialEq)]
pub struct Detents {
    joint: usize,
    depth: f64,
    spots: Vec<f64>,
    last: Option<f64>,
    side: f64,
}

impl Detents {
    /// Spots over `travel` (rad), from half to one and a half of `spacing` apart, where chance number `pattern` puts them.
    pub fn new(joint: usize, depth: f64, spacing: f64, travel: [f64; 2], pattern: u64) -> Self {
        let mut chance = Random::new(pattern, "detents");
        let mut spots = vec![travel[0] - 2.0 * spacing];
        let mut spot = travel[0] - spacing;
        while spot < travel[1] + 2.0 * spacing {
            spots.push(spot);
            spot += spacing * chance.between(0.5, 1.5);
        }
        Self { joint, depth, spots, last: None, side: 1.0 }
    }

    /// The joint's error, rad, at `angle` when it came moving towards `side` (+1 up, -1 down).
    pub fn error(&self, angle: f64, side: f64) -> f64 {
        let next = self.spots.partition_point(|spot| *spot <= angle);
        let (Some(below), Some(above)) =
            (next.checked_sub(1).and_then(|i| self.spots.get(i)), self.spots.get(next))
        else {
            return 0.0;
        };
        let fraction = (angle - below) / (above - below);
        let wound = if side >= 0.0 { fraction } else { 1.0 - fraction };
        side * self.depth * (1.0 - 2.0 * wound)
    }
}

impl Detents {
    pub(super) fn pass(&mut self, angles: &mut [f64]) {
        let Some(angle) = angles.get_mut(self.joint) else { return };
        let input = *angle;
        if let Some(last) = self.last
            && input != last
        {
            self.side = (input - last).signum();
        }
        self.last = Some(input);
        *angle = input + self.error(input, self.side);
    }
}
