//! Viscous friction that winds a gear up while it runs, and dry friction that holds it so when it stops.

use crate::physics::description::{ArmDescription, Motion};

/// Moves shorter than this end before full speed is reached, rad: an arm gets there within a few degrees.
const RAMP_RAD: f64 = 0.09;

/// The same of slides, mm.
const RAMP_MM: f64 = 5.0;

/// A joint that stays behind by what its greatest speed in the last move winds its gear up. The drives are synchronized: they start and stop together, speed up and slow
/// down alike, and the one with the longest way reaches the greatest speed. A controller that feeds forward more than the gear winds up goes beyond: the lag is negative.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::physics) struct ViscousLag {
    joint: usize,
    at_full_speed: f64,
    /// Joints whose drives are of its kind, so that their speeds can be compared.
    synchronized: Vec<usize>,
    ramp: f64,
    wound: f64,
    last: Option<Vec<f64>>,
}

impl ViscousLag {
    /// Behind by `at_full_speed` (rad or mm) after a move at full speed.
    pub(super) fn new(arm: &ArmDescription, joint: usize, at_full_speed: f64) -> Self {
        let motion = |joint: usize| arm.joints.get(joint).map(|row| row.motion);
        let synchronized = (0..arm.joints.len()).filter(|other| motion(*other) == motion(joint)).collect();
        let ramp = if motion(joint) == Some(Motion::Slides) { RAMP_MM } else { RAMP_RAD };
        Self { joint, at_full_speed, synchronized, ramp, wound: 0.0, last: None }
    }

    pub(super) fn pass(&mut self, angles: &mut [f64]) {
        let before = self.last.replace(angles.to_vec()).unwrap_or_else(|| angles.to_vec());
        let ways: Vec<f64> = angles.iter().zip(&before).map(|(now, before)| now - before).collect();
        let of_drives = self.synchronized.iter().filter_map(|drive| ways.get(*drive));
        let longest = of_drives.fold(0.0_f64, |longest, way| longest.max(way.abs()));
        if let (true, Some(way)) = (longest > 0.0, ways.get(self.joint)) {
            // Along a ramp of constant acceleration the speed grows with the root of the way.
            let greatest = (longest / self.ramp).sqrt().min(1.0);
            self.wound = self.at_full_speed * greatest * way / longest;
        }
        if let Some(angle) = angles.get_mut(self.joint) {
            *angle -= self.wound;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lag(at_full_speed: f64) -> ViscousLag {
        let synchronized = vec![0, 1];
        ViscousLag { joint: 1, at_full_speed, synchronized, ramp: RAMP_RAD, wound: 0.0, last: None }
    }

    #[test]
    fn the_joint_with_the_longest_way_lags_in_full_and_another_by_its_part_of_the_speed() {
        let mut part = lag(0.01);
        for (commanded, left) in
            [([0.0, 0.0], 0.0), ([0.2, 1.0], 0.01), ([0.7, 0.75], -0.005), ([0.7, 0.75], -0.005)]
        {
            let mut angles = commanded;
            part.pass(&mut angles);
            assert_eq!(angles[0], commanded[0]);
            assert!((commanded[1] - angles[1] - left).abs() < 1e-12, "{commanded:?}: {angles:?}");
        }
    }

    #[test]
    fn a_move_that_is_shorter_than_the_ramp_does_not_reach_full_speed() {
        let mut part = lag(0.01);
        part.pass(&mut [0.0, 0.0]);
        let mut angles = [0.0, RAMP_RAD / 4.0];
        part.pass(&mut angles);
        assert!(
            (RAMP_RAD / 4.0 - angles[1] - 0.005).abs() < 1e-12,
            "half the speed after a quarter of the ramp"
        );
    }
}
