//! How far the joints go.
//!
//! The ranges are the maker's: base +-90, shoulder +144 to -35 from the horizontal, elbow 0 to -149 from the upper arm, wrist pitch
//! +-90 from the forearm, roll +-360 (its cables), fingers 0 to 3 in. No joint has a switch: a motor sent beyond its stop loses steps, and the registers
//! do not know.

use plumb_plugin::PluginError;

use crate::drive::{Joint, Joints, MOTORS};

/// A range of a joint, of itself or from the joint before it.
struct Range {
    joint: Joint,
    /// The joint it is measured from, with the words for it.
    from: Option<(Joint, &'static str)>,
    lower: f64,
    upper: f64,
}

/// The ranges in the order of [`Joint::ALL`]: degrees, and mm for the gripper.
const RANGES: [Range; MOTORS] = [
    Range { joint: Joint::Waist, from: None, lower: -90.0, upper: 90.0 },
    Range { joint: Joint::Shoulder, from: None, lower: -35.0, upper: 144.0 },
    Range {
        joint: Joint::Elbow,
        from: Some((Joint::Shoulder, " from the upper arm")),
        lower: -149.0,
        upper: 0.0,
    },
    Range {
        joint: Joint::WristPitch,
        from: Some((Joint::Elbow, " from the forearm")),
        lower: -90.0,
        upper: 90.0,
    },
    Range { joint: Joint::WristRoll, from: None, lower: -360.0, upper: 360.0 },
    Range { joint: Joint::Gripper, from: None, lower: 0.0, upper: 76.2 },
];

/// What half a half-step of the coarsest joint may make a joint be beyond its end: degrees, or mm.
const TOLERANCE: f64 = 0.2;

/// The widest a joint can go whatever the others do, in the units of the joint vectors: rad, or mm.
pub(crate) fn widest(joint: Joint) -> (f64, f64) {
    let (mut lower, mut upper) = (0.0, 0.0);
    let mut next = Some(joint);
    while let Some(range) = next.and_then(|joint| RANGES.get(joint.index())) {
        lower += range.lower;
        upper += range.upper;
        next = range.from.map(|(joint, _)| joint);
    }
    match joint {
        Joint::Gripper => (lower, upper),
        _ => (lower.to_radians(), upper.to_radians()),
    }
}

/// Refuses a move that ends beyond a range, unless it leads back from further beyond it.
///
/// # Errors
/// [`PluginError::OutOfRange`], naming the joint, where it would be and its range.
pub(crate) fn check(start: &Joints, end: &Joints) -> Result<(), PluginError> {
    for range in &RANGES {
        let beyond = |joints: &Joints| {
            let value = range.value(joints);
            (range.lower - value).max(value - range.upper) - TOLERANCE
        };
        let leads_further = beyond(end) - beyond(start) > 1e-9;
        if !beyond(end).is_finite() || (beyond(end) > 0.0 && leads_further) {
            let unit = if range.joint == Joint::Gripper { "mm" } else { "deg" };
            return Err(PluginError::OutOfRange(format!(
                "{} would go to {:.1} {unit}{}; it goes from {} to {} {unit}",
                range.joint.name(),
                range.value(end),
                range.from.map_or("", |(_, words)| words),
                range.lower,
                range.upper,
            )));
        }
    }
    Ok(())
}

impl Range {
    /// The joint's value as its range counts it: degrees, or mm.
    fn value(&self, joints: &Joints) -> f64 {
        let of = |joint: Joint| joints.get(joint.index()).copied().unwrap_or(f64::NAN);
        let value = of(self.joint) - self.from.map_or(0.0, |(joint, _)| of(joint));
        if self.joint == Joint::Gripper { value } else { value.to_degrees() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(degrees: [f64; 5], opening: f64) -> Joints {
        let [waist, shoulder, elbow, pitch, roll] = degrees.map(f64::to_radians);
        [waist, shoulder, elbow, pitch, roll, opening]
    }

    fn start() -> Joints {
        pose([0.0, 20.0, -90.0, -90.0, 0.0], 10.0)
    }

    fn refusal(end: Joints) -> String {
        check(&start(), &end).unwrap_err().to_string()
    }

    #[test]
    fn a_move_beyond_a_range_is_refused_with_joint_position_and_range() {
        assert_eq!(
            refusal(pose([95.0, 20.0, -90.0, -90.0, 0.0], 10.0)),
            "waist would go to 95.0 deg; it goes from -90 to 90 deg"
        );
        assert_eq!(
            refusal(pose([0.0, 80.0, -90.0, -90.0, 0.0], 10.0)),
            "elbow would go to -170.0 deg from the upper arm; it goes from -149 to 0 deg"
        );
        assert_eq!(
            refusal(pose([0.0, 20.0, 10.0, -90.0, 0.0], 10.0)),
            "wrist_pitch would go to -100.0 deg from the forearm; it goes from -90 to 90 deg"
        );
        assert_eq!(
            refusal(pose([0.0, 20.0, -90.0, -90.0, 0.0], 80.0)),
            "gripper would go to 80.0 mm; it goes from 0 to 76.2 mm"
        );
    }

    #[test]
    fn an_arm_beyond_its_range_may_come_back_but_not_go_further() {
        let beyond = pose([100.0, 20.0, -90.0, -90.0, 0.0], 10.0);
        check(&beyond, &pose([95.0, 20.0, -90.0, -90.0, 0.0], 10.0)).unwrap();
        check(&beyond, &pose([100.0, 30.0, -90.0, -90.0, 0.0], 10.0)).unwrap();
        assert!(check(&beyond, &pose([101.0, 20.0, -90.0, -90.0, 0.0], 10.0)).is_err());
    }

    #[test]
    fn a_value_that_is_no_number_is_refused() {
        let mut end = start();
        end[0] = f64::NAN;
        assert!(check(&start(), &end).is_err());
    }

    #[test]
    fn the_widest_range_of_a_joint_counts_those_before_it() {
        let (lower, upper) = widest(Joint::WristPitch);
        assert!((lower.to_degrees() - (-35.0 - 149.0 - 90.0)).abs() < 1e-9);
        assert!((upper.to_degrees() - (144.0 + 90.0)).abs() < 1e-9);
        assert_eq!(widest(Joint::Gripper), (0.0, 76.2));
    }
}
