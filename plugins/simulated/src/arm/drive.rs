//! The drive of an arm as its controller counts: how far each joint goes and how fast, and the encoders of motors that may be coupled.

use crate::physics::description::Motion;

/// What is known of the drive of one joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointDrive {
    /// As files and people name the joint.
    pub name: String,
    /// Whether it turns or slides.
    pub motion: Motion,
    /// How far software lets it go, rad or mm.
    pub limits: [f64; 2],
    /// Where its hard stops are, rad or mm.
    pub stops: [f64; 2],
    /// Greatest speed, rad/s or mm/s.
    pub top_speed: f64,
    /// Counts of the motor's encoder for a rad or mm of the joint; 0 where nobody counts.
    pub counts_per_unit: f64,
    /// Where it is at home, rad or mm.
    pub home: f64,
}

impl JointDrive {
    /// The unit in which people write its values.
    pub fn unit(&self) -> &'static str {
        match self.motion {
            Motion::Turns => "deg",
            Motion::Slides => "mm",
        }
    }

    /// A value (rad or mm) in the unit in which people write it.
    pub fn written(&self, value: f64) -> f64 {
        match self.motion {
            Motion::Turns => value.to_degrees(),
            Motion::Slides => value,
        }
    }

    /// A value as people write it, in rad or mm.
    pub fn read(&self, written: f64) -> f64 {
        match self.motion {
            Motion::Turns => written.to_radians(),
            Motion::Slides => written,
        }
    }

    /// How far a value (rad or mm) lies beyond a hard stop.
    pub fn beyond_stop(&self, value: f64) -> f64 {
        let [lower, upper] = self.stops;
        (lower - value).max(value - upper).max(0.0)
    }
}

/// A gear by which one motor drags another along: the reading of `motor` holds `fraction` of the reading of `driver`, both in the joint's unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorCoupling {
    /// Index of the motor that is dragged.
    pub motor: usize,
    /// Index of the motor that drags it, which comes before it.
    pub driver: usize,
    /// rad for a rad.
    pub fraction: f64,
}

/// The drive of the whole arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// Joint by joint, from the base to the flange.
    pub joints: Vec<JointDrive>,
    /// In the order of the motors that are dragged.
    pub couplings: Vec<MotorCoupling>,
    /// Whether the arm is set to whole counts of its encoders. One that is not takes any value: no machine is built so, but what a method
    /// itself costs is seen best with it.
    pub whole_counts: bool,
    /// From full speed the brakes bring the arm to rest in this time, s; from a share of it, in that fraction.
    pub braking_s: f64,
}

impl Drive {
    /// What the motors' encoders show for these joint values (rad or mm): counts, not whole.
    pub fn encoder_counts(&self, joints: &[f64]) -> Vec<f64> {
        let mut readings = joints.to_vec();
        for coupling in &self.couplings {
            let driving = readings.get(coupling.driver).copied().unwrap_or(0.0);
            if let Some(reading) = readings.get_mut(coupling.motor) {
                *reading += coupling.fraction * driving;
            }
        }
        for (reading, joint) in readings.iter_mut().zip(&self.joints) {
            *reading *= joint.counts_per_unit;
        }
        readings
    }

    /// The joint values (rad or mm) for what the encoders show. The value of a joint that nobody counts stays what it was, in `joints`.
    fn joints_for(&self, counts: &[f64], joints: &[f64]) -> Vec<f64> {
        let counted = self.joints.iter().zip(counts).zip(joints);
        let readings: Vec<f64> = counted
            .map(|((joint, counts), value)| match joint.counts_per_unit > 0.0 {
                true => counts / joint.counts_per_unit,
                false => *value,
            })
            .collect();
        let mut values = readings.clone();
        for coupling in &self.couplings {
            let driving = readings.get(coupling.driver).copied().unwrap_or(0.0);
            if let Some(value) = values.get_mut(coupling.motor) {
                *value -= coupling.fraction * driving;
            }
        }
        values
    }

    /// The nearest joint values that the motors can hold.
    pub(super) fn nearest_held(&self, joints: &[f64]) -> Vec<f64> {
        if !self.whole_counts {
            return joints.to_vec();
        }
        let whole: Vec<f64> = self.encoder_counts(joints).into_iter().map(f64::round).collect();
        self.joints_for(&whole, joints)
    }

    /// The smallest step of a joint, rad or mm; 0 for one that takes any value.
    pub(super) fn step(&self, joint: &JointDrive) -> f64 {
        match self.whole_counts && joint.counts_per_unit > 0.0 {
            true => 1.0 / joint.counts_per_unit,
            false => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::arm::puma560;

    #[test]
    fn counts_and_joints_convert_both_ways_through_the_coupled_wrist() {
        let drive = puma560::drive();
        let joints = [0.3, -1.2, 2.0, -0.7, 0.9, -2.5];
        let back = drive.joints_for(&drive.encoder_counts(&joints), &[0.0; 6]);
        for (there, back) in joints.iter().zip(back) {
            assert!((there - back).abs() < 1e-14);
        }
    }

    #[test]
    fn bending_the_wrist_turns_the_flanges_motor_by_13_in_72() {
        let counts = puma560::drive().encoder_counts(&[0.0, 0.0, 0.0, 0.0, 1.0_f64.to_radians(), 0.0]);
        assert!((counts[5] - 213.02 * 13.0 / 72.0).abs() < 1e-9);
    }

    #[test]
    fn rounding_to_counts_moves_no_joint_more_than_a_hundredth_of_a_degree() {
        let joints = [0.1234, -1.2345, 2.0456, -0.7654, 0.9876, -2.5432];
        for (joint, counted) in joints.iter().zip(puma560::drive().nearest_held(&joints)) {
            assert!((joint - counted).to_degrees().abs() < 0.005);
        }
    }

    #[test]
    fn a_joint_that_nobody_counts_takes_any_value_beside_one_that_is_counted() {
        let mut drive = puma560::drive();
        if let Some(waist) = drive.joints.first_mut() {
            waist.counts_per_unit = 0.0;
        }
        let held = drive.nearest_held(&[0.123_456_789, 0.123_456_789, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(held[0], 0.123_456_789);
        assert!(held[1] != 0.123_456_789 && (held[1] - 0.123_456_789).abs() < 1e-4);
    }
}
