//! The arm's joints as VAL counts them, and angles as its terminal takes and shows them.

/// How many joints the arm has.
pub const AXES: usize = 6;

/// One joint's name, its range, and its greatest speed: degrees, and degrees a second at SPEED 100.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// As cell files name it.
    pub name: &'static str,
    /// Where its range begins, degrees.
    pub lower: f64,
    /// Where it ends, degrees.
    pub upper: f64,
    /// Degrees a second at SPEED 100.
    pub top_speed: f64,
    /// In the ready position, degrees.
    pub ready: f64,
}

/// From the base to the flange.
pub const JOINTS: [Joint; AXES] = [
    Joint { name: "waist", lower: -160.0, upper: 160.0, top_speed: 82.0, ready: 0.0 },
    Joint { name: "shoulder", lower: -225.0, upper: 45.0, top_speed: 54.0, ready: -90.0 },
    Joint { name: "elbow", lower: -45.0, upper: 225.0, top_speed: 122.0, ready: 90.0 },
    Joint { name: "wrist_roll", lower: -110.0, upper: 170.0, top_speed: 228.0, ready: 0.0 },
    Joint { name: "wrist_bend", lower: -100.0, upper: 100.0, top_speed: 241.0, ready: 0.0 },
    Joint { name: "flange", lower: -266.0, upper: 266.0, top_speed: 228.0, ready: 0.0 },
];

/// The ready position, degrees.
pub const READY: [f64; AXES] = [0.0, -90.0, 90.0, 0.0, 0.0, 0.0];

/// An angle as the terminal takes it: from -180 up to, but not, 180 degrees. Rounded to thousandths first, so that 179.9999 is not typed as 180.
pub fn folded(degrees: f64) -> f64 {
    let rounded = (degrees * 1000.0).round() / 1000.0;
    if (-180.0..180.0).contains(&rounded) { rounded } else { (rounded + 180.0).rem_euclid(360.0) - 180.0 }
}

/// Whether an angle, folded, can mean this one only: a whole turn further the joint cannot go.
pub fn is_plain(joint: &Joint, degrees: f64) -> bool {
    let other = if degrees > 0.0 { degrees - 360.0 } else { degrees + 360.0 };
    !(joint.lower - 1.0..=joint.upper + 1.0).contains(&other)
}

/// What a shown angle means: the value in the joint's range, give or take half a degree, that is nearest to where the joint is thought to be.
pub fn unfolded(joint: &Joint, shown: f64, near: f64) -> Option<f64> {
    let candidates = [shown - 360.0, shown, shown + 360.0];
    let possible =
        candidates.into_iter().filter(|value| (joint.lower - 0.5..=joint.upper + 0.5).contains(value));
    possible.min_by(|one, other| (one - near).abs().total_cmp(&(other - near).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn agins_180_degrees_of_joint_3_are_typed_as_minus_180() {
        assert_eq!(folded(180.0), -180.0);
        assert_eq!(folded(179.999_9), -180.0);
        assert_eq!(folded(-180.0), -180.0);
        assert_eq!(folded(225.0), -135.0);
        assert_eq!(unfolded(&JOINTS[2], -180.0, 90.0), Some(180.0));
        assert_eq!(unfolded(&JOINTS[1], 135.0, -200.0), Some(-225.0));
        assert_eq!(unfolded(&JOINTS[0], 175.0, 0.0), None);
    }

    #[test]
    fn where_the_flange_can_go_either_way_round_its_angle_is_not_plain() {
        assert!(is_plain(&JOINTS[2], 225.0) && is_plain(&JOINTS[5], 90.0));
        assert!(!is_plain(&JOINTS[5], 200.0) && !is_plain(&JOINTS[5], -135.0));
    }

    #[test]
    fn an_angle_is_plain_where_the_joint_cannot_reach_it_a_turn_further_with_a_degree_to_spare() {
        // The flange goes from -266 to 266 degrees.
        assert!(is_plain(&JOINTS[5], 92.9) && !is_plain(&JOINTS[5], 93.1));
        assert!(is_plain(&JOINTS[5], -92.9) && !is_plain(&JOINTS[5], -93.1));
        assert!(is_plain(&JOINTS[5], 0.0));
    }

    #[test]
    fn a_shown_angle_may_be_half_a_degree_beyond_the_range() {
        let waist = &JOINTS[0];
        assert_eq!(unfolded(waist, 160.4, 150.0), Some(160.4));
        assert_eq!(unfolded(waist, -160.4, -150.0), Some(-160.4));
        assert_eq!((unfolded(waist, 160.6, 150.0), unfolded(waist, -160.6, -150.0)), (None, None));
        assert_eq!(unfolded(&JOINTS[5], 170.0, -180.0), Some(-190.0), "the nearer of 170 and -190");
        assert_eq!(unfolded(&JOINTS[5], 170.0, 0.0), Some(170.0));
    }

    /// Unimation's data sheet of the arm: 320, 270, 270, 280, 200 and 532 degrees.
    #[test]
    fn the_joints_turn_as_far_as_the_data_sheet_has_it_and_are_ready_within() {
        assert_eq!(JOINTS.map(|joint| joint.upper - joint.lower), [320.0, 270.0, 270.0, 280.0, 200.0, 532.0]);
        assert_eq!(JOINTS.map(|joint| joint.ready), READY);
        assert!(JOINTS.iter().all(|joint| joint.lower < joint.ready && joint.ready < joint.upper));
    }

    proptest! {
        #[test]
        fn what_is_folded_unfolds_again(joint in 0..AXES, fraction in 0.0..1.0_f64) {
            let joint = &JOINTS[joint];
            let angle = joint.lower + fraction * (joint.upper - joint.lower);
            let back = unfolded(joint, folded(angle), angle);
            prop_assert!(back.is_some_and(|back| (back - angle).abs() <= 0.000_51), "{back:?} for {angle}");
        }
    }
}
