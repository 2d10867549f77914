//! The joints of a PUMA 560 as its controller counts them: angles as VAL reads them, and the motors' encoders behind coupled wrist gears.

/// How many joints, and how many motors, the arm has.
pub(crate) const AXES: usize = 6;

/// What is known of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointOfPuma {
    /// As files and people name it.
    pub name: &'static str,
    /// How far software lets it go, degrees.
    pub limits_deg: [f64; 2],
    /// Greatest speed, degrees/s.
    pub top_speed_deg: f64,
    /// Counts of the motor's encoder for a degree of the joint (comp.robotics 1990; joint 6 without its divide-by-two bit).
    pub counts_per_deg: f64,
    /// Counts from one index pulse to the next (Armstrong's table of potentiometers: 800 at joint 2, 1000 else).
    pub counts_a_turn: f64,
    /// Where it stands in the ready position, degrees.
    pub ready_deg: f64,
}

/// From the base to the flange.
pub const JOINTS: [JointOfPuma; AXES] = [
    joint("waist", [-160.0, 160.0], 82.0, [173.92, 1000.0], 0.0),
    joint("shoulder", [-225.0, 45.0], 54.0, [239.59, 800.0], -90.0),
    joint("elbow", [-45.0, 225.0], 122.0, [149.18, 1000.0], 90.0),
    joint("wrist_roll", [-110.0, 170.0], 228.0, [211.21, 1000.0], 0.0),
    joint("wrist_bend", [-100.0, 100.0], 241.0, [199.79, 1000.0], 0.0),
    joint("flange", [-266.0, 266.0], 228.0, [213.02, 1000.0], 0.0),
];

/// How far a joint's hard stop lies beyond its software limit, degrees.
const TO_THE_STOP_DEG: f64 = 4.0;

/// Turning joint 4 by this many turns drags joint 5's motor by one, as read at the joint.
const ROLL_TO_BEND: f64 = 1.0 / 71.923;
/// The same for joint 6.
const ROLL_TO_FLANGE: f64 = 1.0 / 76.686;
/// Joint 6's motor follows joint 5's raw reading by this share.
const BEND_TO_FLANGE: f64 = 13.0 / 72.0;

const fn joint(
    name: &'static str,
    limits_deg: [f64; 2],
    top_speed_deg: f64,
    [counts_per_deg, counts_a_turn]: [f64; 2],
    ready_deg: f64,
) -> JointOfPuma {
    JointOfPuma { name, limits_deg, top_speed_deg, counts_per_deg, counts_a_turn, ready_deg }
}

impl JointOfPuma {
    /// Where its hard stops are, degrees.
    pub fn stops_deg(&self) -> [f64; 2] {
        let [lower, upper] = self.limits_deg;
        [lower - TO_THE_STOP_DEG, upper + TO_THE_STOP_DEG]
    }

    /// How far the joint turns from one index pulse of its motor's encoder to the next, degrees: a turn of the motor.
    pub fn index_spacing_deg(&self) -> f64 {
        self.counts_a_turn / self.counts_per_deg
    }

    /// How far a value (rad) lies beyond a hard stop, rad.
    pub fn beyond_stop(&self, value: f64) -> f64 {
        let [lower, upper] = self.stops_deg();
        (lower.to_radians() - value).max(value - upper.to_radians()).max(0.0)
    }
}

/// What the motors' encoders show for these joint values (rad): counts, not whole.
pub fn encoder_counts(joints: &[f64; AXES]) -> [f64; AXES] {
    let [waist, shoulder, elbow, roll, bend, flange] = *joints;
    let raw_bend = bend + roll * ROLL_TO_BEND;
    let raw_flange = flange - roll * ROLL_TO_FLANGE + raw_bend * BEND_TO_FLANGE;
    scaled([waist, shoulder, elbow, roll, raw_bend, raw_flange], |value, counts| value.to_degrees() * counts)
}

/// The joint values (rad) for what the encoders show.
fn from_counts(counts: &[f64; AXES]) -> [f64; AXES] {
    let [waist, shoulder, elbow, roll, raw_bend, raw_flange] =
        scaled(*counts, |value, counts| (value / counts).to_radians());
    let bend = raw_bend - roll * ROLL_TO_BEND;
    let flange = raw_flange + roll * ROLL_TO_FLANGE - raw_bend * BEND_TO_FLANGE;
    [waist, shoulder, elbow, roll, bend, flange]
}

fn scaled(values: [f64; AXES], by: impl Fn(f64, f64) -> f64) -> [f64; AXES] {
    let mut values = values;
    for (value, joint) in values.iter_mut().zip(&JOINTS) {
        *value = by(*value, joint.counts_per_deg);
    }
    values
}

/// The nearest joint values that whole counts stand for.
pub(super) fn nearest_counted(joints: &[f64; AXES]) -> [f64; AXES] {
    from_counts(&encoder_counts(joints).map(f64::round))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_joints_convert_both_ways_through_the_coupled_wrist() {
        let joints = [0.3, -1.2, 2.0, -0.7, 0.9, -2.5];
        let back = from_counts(&encoder_counts(&joints));
        for (there, back) in joints.iter().zip(back) {
            assert!((there - back).abs() < 1e-14);
        }
    }

    #[test]
    fn bending_the_wrist_turns_the_flanges_motor_by_13_in_72() {
        let counts = encoder_counts(&[0.0, 0.0, 0.0, 0.0, 1.0_f64.to_radians(), 0.0]);
        assert!((counts[5] - 213.02 * 13.0 / 72.0).abs() < 1e-9);
    }

    #[test]
    fn rounding_to_counts_moves_no_joint_more_than_a_hundredth_of_a_degree() {
        let joints = [0.1234, -1.2345, 2.0456, -0.7654, 0.9876, -2.5432];
        for (joint, counted) in joints.iter().zip(nearest_counted(&joints)) {
            assert!((joint - counted).to_degrees().abs() < 0.005);
        }
    }
}
