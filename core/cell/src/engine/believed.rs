//! What a device says, held against what it may say. A robot that ended elsewhere, or a reading from before a move, would put false rows into a
//! table; so nothing is taken from a device that was not looked at here. Pure functions: each gives a sentence that names device, plugin, what was
//! said and what would be right.

mod motors;

use std::time::Duration;

use plumb_plugin::{
    JointDescription, JointState, JointUnit, JointVector, ProximityEdge, Reading, RobotDescription,
    SensorDescription,
};

pub(crate) use motors::check_motors;

use crate::deg_or_mm::DegOrMm;

/// How far a joint may come to rest from its target, in steps of its drive. One for the rounding of the target, one for a driver that rounds towards
/// zero; more is another position.
const STEPS_OFF_TARGET: f64 = 2.0;

/// How far a turning joint of a servo may come to rest from its target beside that, rad (0.05 deg): the in-position windows of industrial
/// controllers are 0.01 to 0.05 deg. What is recorded is where the joint says it is, so that this is no error of a table.
const SETTLES_WITHIN_RAD: f64 = 0.05 * std::f64::consts::PI / 180.0;

/// The same for a sliding joint, mm.
const SETTLES_WITHIN_MM: f64 = 0.1;

/// How far a time may lie ahead of the cell's clock: what two readings of one clock in two processes can differ by is nothing; this is a driver that
/// rounds to 10 ms.
const AHEAD: Duration = Duration::from_millis(10);

/// By how much a camera may date a picture too early. Cameras date the opening of the shutter, or less exactly; what is left, some tens of ms, the
/// procedure `exposure-delay` finds. A picture that was asked for at rest shows the arm at rest all the same.
const PICTURE_EARLY: Duration = Duration::from_millis(100);

/// The earliest time of a picture that was asked for when the arm had come to rest at `rest_ns`, ns.
pub(crate) fn picture_not_before(rest_ns: u64) -> u64 {
    rest_ns.saturating_sub(nanoseconds(PICTURE_EARLY))
}

/// How old a state may be that a robot was asked for. A driver that polls its controller does so several times a second.
const OLDEST_STATE: Duration = Duration::from_secs(2);

/// Who says something: the device, and the plugin that serves it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) device: &'a str,
    pub(crate) plugin: &'a str,
}

impl Source<'_> {
    fn blame(&self, what: &str) -> String {
        format!("{what}. That is an error of plugin `{}` or of the device behind it", self.plugin)
    }
}

/// What is known of the time at which a device was asked, ns of the cell's clock.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RequestTimes {
    /// The last time its device reported before.
    pub(crate) reported_before_ns: u64,
    /// When it was asked, and when its answer had come; none in a cell whose clock this program cannot read.
    pub(crate) between_ns: Option<(u64, u64)>,
}

/// How far a joint may come to rest from its target, rad or mm.
pub(crate) fn tolerance(joint: &JointDescription) -> f64 {
    let settles = match joint.unit {
        JointUnit::Radian => SETTLES_WITHIN_RAD,
        JointUnit::Millimetre => SETTLES_WITHIN_MM,
    };
    (STEPS_OFF_TARGET * joint.resolution).max(settles)
}

/// Whether a robot describes joints that can be.
pub(crate) fn check_description(source: Source<'_>, robot: &RobotDescription) -> Result<(), String> {
    for joint in &robot.joints {
        let JointDescription { name, lower, upper, resolution, max_speed, .. } = joint;
        let wrong = if !(lower.is_finite() && upper.is_finite() && lower < upper) {
            format!("goes from {lower} to {upper} {}", joint.unit.symbol())
        } else if !(max_speed.is_finite() && *max_speed > 0.0) {
            format!("has a greatest speed of {max_speed} {}/s; it is above 0", joint.unit.symbol())
        } else if !(resolution.is_finite() && *resolution >= 0.0) {
            format!("has a smallest step of {resolution} {}; it is 0 or above", joint.unit.symbol())
        } else {
            continue;
        };
        return Err(source.blame(&format!("{} says of itself that its {name} {wrong}", source.device)));
    }
    Ok(())
}

/// Whether a robot can be in this state at all: as many joints as it has, numbers, and a time that can be.
pub(crate) fn check_state(
    source: Source<'_>,
    robot: &RobotDescription,
    state: &JointState,
    asked: RequestTimes,
) -> Result<(), String> {
    let device = source.device;
    if state.joints.len() != robot.joints.len() {
        let (reported, has) = (state.joints.len(), robot.joints.len());
        return Err(source.blame(&format!("{device} reports {reported} joint values; it has {has} joints")));
    }
    for (joint, value) in robot.joints.iter().zip(state.joints.as_slice()) {
        if !value.is_finite() {
            return Err(source.blame(&format!("{device} reports its {} at {value}", joint.name)));
        }
    }
    check_time(source, state.time_ns, asked, OLDEST_STATE)
}

/// Whether a robot is within its own limits, so that it may be measured with.
pub(crate) fn check_limits(
    source: Source<'_>,
    robot: &RobotDescription,
    joints: &JointVector,
) -> Result<(), String> {
    for (joint, value) in robot.joints.iter().zip(joints.as_slice()) {
        let beyond = (joint.lower - value).max(value - joint.upper);
        if beyond > tolerance(joint) {
            return Err(format!(
                "{} reports its {} at {}, but by its own description it goes from {} to {}. Bring it back with its pendant, or correct plugin `{}`",
                source.device,
                joint.name,
                shown(joint, *value),
                shown(joint, joint.lower),
                shown(joint, joint.upper),
                source.plugin
            ));
        }
    }
    Ok(())
}

/// Whether a move ended: at rest, at its target, after it began.
pub(crate) fn check_end(
    source: Source<'_>,
    robot: &RobotDescription,
    target: &JointVector,
    end: &JointState,
    asked: RequestTimes,
) -> Result<(), String> {
    check_state(source, robot, end, asked)?;
    let device = source.device;
    for ((joint, reported), commanded) in
        robot.joints.iter().zip(end.joints.as_slice()).zip(target.as_slice())
    {
        let off = (reported - commanded).abs();
        if off > tolerance(joint) {
            let moving = if end.is_moving() { " and still moves" } else { "" };
            return Err(source.blame(&format!(
                "{device} was sent with its {} to {} and reports {} after the move{moving}; {} are allowed",
                joint.name,
                shown(joint, *commanded),
                shown(joint, *reported),
                shown(joint, tolerance(joint))
            )));
        }
    }
    if end.is_moving() {
        return Err(source.blame(&format!("{device} says after its move that it still moves")));
    }
    if let Some((begun, _)) = asked.between_ns.filter(|(begun, _)| end.time_ns < *begun) {
        let early = age(begun, end.time_ns);
        return Err(source
            .blame(&format!("{device} dates the end of its move {early} before the move was commanded")));
    }
    Ok(())
}

fn check_time(source: Source<'_>, time_ns: u64, asked: RequestTimes, oldest: Duration) -> Result<(), String> {
    let device = source.device;
    if time_ns < asked.reported_before_ns {
        let back = age(asked.reported_before_ns, time_ns);
        return Err(source.blame(&format!("{device} dates its state {back} before one it reported earlier")));
    }
    let Some((begun, answered)) = asked.between_ns else { return Ok(()) };
    if time_ns > answered.saturating_add(nanoseconds(AHEAD)) {
        let ahead = age(time_ns, answered);
        return Err(
            source.blame(&format!("{device} dates its state {ahead} in the future of the cell's clock"))
        );
    }
    if time_ns < begun.saturating_sub(nanoseconds(oldest)) {
        let old = age(begun, time_ns);
        return Err(source.blame(&format!(
            "{device} reported a state that was {old} old when it was asked; {} s are allowed",
            oldest.as_secs()
        )));
    }
    Ok(())
}

/// Whether a reading is one of this sensor, taken after the last motion of a robot ended (`after_ns`, 0 before any).
pub(crate) fn check_reading(
    source: Source<'_>,
    sensor: &SensorDescription,
    reading: &Reading,
    after_ns: u64,
    asked: RequestTimes,
) -> Result<(), String> {
    let device = source.device;
    if reading.time_ns < after_ns {
        let old = age(after_ns, reading.time_ns);
        return Err(source.blame(&format!(
            "the reading of {device} is stale: it is dated {old} before the end of the last motion, so it does not belong to the arm's position"
        )));
    }
    if let Some((_, answered)) = asked.between_ns
        && reading.time_ns > answered.saturating_add(nanoseconds(AHEAD))
    {
        let ahead = age(reading.time_ns, answered);
        return Err(
            source.blame(&format!("{device} dates its reading {ahead} in the future of the cell's clock"))
        );
    }
    for (index, quantity) in reading.quantities.iter().enumerate() {
        let name = &quantity.name;
        if !sensor.quantities.iter().any(|known| known.name == *name) {
            let known = plumb_document::one_of(sensor.quantities.iter().map(|known| known.name.as_str()));
            return Err(source.blame(&format!(
                "{device} measured `{name}`, which it does not describe; of what it describes, {known}"
            )));
        }
        if reading.quantities.iter().take(index).any(|before| before.name == *name) {
            return Err(source.blame(&format!("{device} measured `{name}` twice in one reading")));
        }
        let (value, sigma) = (quantity.value, quantity.standard_uncertainty);
        if !value.is_finite() || !sigma.is_finite() || sigma < 0.0 {
            return Err(source.blame(&format!("{device} measured `{name}` as {value} +- {sigma}")));
        }
    }
    Ok(())
}

/// From when on a value is one that was measured because it was asked for, ns: a driver may round its time down, and a camera dates the opening of its
/// shutter.
pub(crate) fn asked_from(asked_ns: u64) -> u64 {
    asked_ns.saturating_sub(nanoseconds(PICTURE_EARLY))
}

/// Whether a sensor that takes nothing in from other devices measured because it was asked (from `asked_from_ns` on), and measured anything that it describes.
pub(crate) fn check_own_reading(
    source: Source<'_>,
    sensor: &SensorDescription,
    reading: &Reading,
    asked_from_ns: u64,
) -> Result<(), String> {
    let device = source.device;
    if reading.time_ns < asked_from_ns {
        let old = age(asked_from_ns, reading.time_ns);
        return Err(source
            .blame(&format!("the reading of {device} is stale: it is dated {old} before it was asked for")));
    }
    // What was not seen may be left out (a stripe in a dark picture): a step that uses it says that it is missing. A reading of nothing at all is none.
    let has_one = sensor
        .quantities
        .iter()
        .any(|described| reading.quantities.iter().any(|quantity| quantity.name == described.name));
    if !has_one && !sensor.quantities.is_empty() {
        let names: Vec<String> =
            sensor.quantities.iter().map(|described| format!("`{}`", described.name)).collect();
        let describes = names.join(", ");
        return Err(source.blame(&format!("the reading of {device} has no value; it describes {describes}")));
    }
    Ok(())
}

/// Whether an edge names a pose its robot can have been in.
pub(crate) fn check_edge(
    source: Source<'_>,
    robot: &RobotDescription,
    edge: &ProximityEdge,
) -> Result<(), String> {
    let device = source.device;
    if edge.joints.len() != robot.joints.len() {
        let (reported, has) = (edge.joints.len(), robot.joints.len());
        return Err(source.blame(&format!(
            "{device} reports an edge at {reported} joint values; the robot has {has} joints"
        )));
    }
    let half_widths = edge.joints_half_width.as_slice();
    if half_widths.len() != robot.joints.len() {
        let (reported, has) = (half_widths.len(), robot.joints.len());
        return Err(source.blame(&format!(
            "{device} reports an edge with {reported} half-widths; the robot has {has} joints, and each has one"
        )));
    }
    let joints = robot.joints.iter().zip(edge.joints.as_slice()).zip(half_widths);
    for ((joint, value), around) in joints {
        if !value.is_finite() || !around.is_finite() || *around < 0.0 {
            return Err(
                source.blame(&format!("{device} reports an edge with {} at {value} +- {around}", joint.name))
            );
        }
    }
    check_limits(source, robot, &edge.joints)
}

/// A joint's number as an operator reads it.
fn shown(joint: &JointDescription, value: f64) -> String {
    let unit = match joint.unit {
        JointUnit::Radian => DegOrMm::Deg,
        JointUnit::Millimetre => DegOrMm::Mm,
    };
    format!("{:.3} {}", unit.from_internal(value), unit.symbol())
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

/// The time from `earlier` to `later`, for people.
fn age(later: u64, earlier: u64) -> String {
    let seconds = later.saturating_sub(earlier) as f64 * 1e-9;
    if seconds < 0.1 { format!("{:.3} ms", seconds * 1e3) } else { format!("{seconds:.3} s") }
}

#[cfg(test)]
mod tests {
    use plumb_plugin::{Quantity, QuantityDescription, RobotCapabilities};

    use super::*;

    pub(super) const ARM: Source<'static> = Source { device: "arm", plugin: "scara4" };

    pub(super) fn robot() -> RobotDescription {
        let joint = |name: &str, unit, upper: f64| JointDescription {
            name: name.to_owned(),
            unit,
            lower: -upper,
            upper,
            resolution: 0.0,
            max_speed: 1.0,
            home: 0.0,
        };
        RobotDescription {
            model: "scara".to_owned(),
            joints: vec![joint("turn", JointUnit::Radian, 2.0), joint("slide", JointUnit::Millimetre, 100.0)],
            inputs: Vec::new(),
            outputs: Vec::new(),
            capabilities: RobotCapabilities::default(),
        }
    }

    #[test]
    fn a_joint_that_cannot_be_is_reported_with_what_it_says_of_itself() {
        assert_eq!(check_description(ARM, &robot()), Ok(()));
        let with = |change: fn(&mut JointDescription)| {
            let mut robot = robot();
            change(&mut robot.joints[1]);
            check_description(ARM, &robot)
        };
        for change in [
            (|joint| joint.lower = joint.upper) as fn(&mut JointDescription),
            |joint| joint.lower = joint.upper + 1.0,
            |joint| joint.lower = f64::NEG_INFINITY,
            |joint| joint.upper = f64::INFINITY,
            |joint| joint.upper = f64::NAN,
        ] {
            says(with(change), &["its slide goes from", "mm", "scara4"]);
        }
        for speed in [
            (|joint| joint.max_speed = 0.0) as fn(&mut JointDescription),
            |joint| joint.max_speed = -1.0,
            |joint| joint.max_speed = f64::INFINITY,
        ] {
            says(with(speed), &["its slide has a greatest speed of", "above 0"]);
        }
        for step in [(|joint| joint.resolution = -0.1) as fn(&mut JointDescription), |joint| {
            joint.resolution = f64::NAN
        }] {
            says(with(step), &["its slide has a smallest step of", "0 or above"]);
        }
    }

    pub(super) fn vector(values: [f64; 2]) -> JointVector {
        JointVector::from_slice(&values).unwrap()
    }

    fn end(time_ns: u64, values: [f64; 2], moving: bool, asked: RequestTimes) -> Result<(), String> {
        let state = JointState::new(time_ns, vector(values), moving);
        check_end(ARM, &robot(), &vector([0.5, 20.0]), &state, asked)
    }

    pub(super) fn says(result: Result<(), String>, words: &[&str]) {
        let message = result.unwrap_err();
        for word in words {
            assert!(message.contains(word), "{word}: {message}");
        }
    }

    #[test]
    fn a_move_that_ended_at_its_target_is_believed() {
        assert_eq!(end(5, [0.5, 20.0], false, RequestTimes::default()), Ok(()));
        assert_eq!(end(5, [0.5 + 0.9 * SETTLES_WITHIN_RAD, 20.09], false, RequestTimes::default()), Ok(()));
    }

    #[test]
    fn a_move_that_ended_elsewhere_names_joint_commanded_and_reported_value() {
        let elsewhere = end(5, [28.6, 20.0], false, RequestTimes::default());
        says(elsewhere, &["arm", "turn", "28.648 deg", "1638.659 deg", "`scara4`"]);
        says(end(5, [0.5, 20.2], false, RequestTimes::default()), &["slide", "20.000 mm", "20.200 mm"]);
    }

    #[test]
    fn a_move_that_has_not_ended_is_not_believed() {
        says(end(5, [0.5, 20.0], true, RequestTimes::default()), &["still moves"]);
        says(end(5, [0.1, 20.0], true, RequestTimes::default()), &["turn", "still moves"]);
    }

    #[test]
    fn what_is_no_number_and_what_is_too_few_is_not_believed() {
        says(end(5, [f64::NAN, 20.0], false, RequestTimes::default()), &["turn", "NaN"]);
        says(end(5, [0.5, f64::INFINITY], false, RequestTimes::default()), &["slide", "inf"]);
        let state = JointState::new(5, JointVector::zeros(1), false);
        says(check_state(ARM, &robot(), &state, RequestTimes::default()), &["1 joint values", "2 joints"]);
    }

    #[test]
    fn times_from_the_past_and_the_future_are_not_believed() {
        let second = 1_000_000_000;
        let asked =
            RequestTimes { reported_before_ns: 7 * second, between_ns: Some((10 * second, 11 * second)) };
        assert_eq!(end(11 * second, [0.5, 20.0], false, asked), Ok(()));
        says(end(3600 * second, [0.5, 20.0], false, asked), &["3589.000 s in the future"]);
        says(end(9 * second, [0.5, 20.0], false, asked), &["1.000 s before the move was commanded"]);
        says(end(5, [0.5, 20.0], false, asked), &["before one it reported earlier"]);
        let state = |time_ns| JointState::new(time_ns, vector([0.0, 0.0]), false);
        assert_eq!(check_state(ARM, &robot(), &state(9 * second), asked), Ok(()));
        says(check_state(ARM, &robot(), &state(7 * second), asked), &["3.000 s old"]);
        let blind = RequestTimes { reported_before_ns: 7 * second, between_ns: None };
        assert_eq!(check_state(ARM, &robot(), &state(3600 * second), blind), Ok(()), "another clock");
    }

    #[test]
    fn a_robot_outside_its_own_limits_is_not_measured_with() {
        assert_eq!(check_limits(ARM, &robot(), &vector([2.0, -100.0])), Ok(()));
        says(check_limits(ARM, &robot(), &vector([2.1, 0.0])), &["turn", "120.321 deg", "114.592 deg"]);
    }

    #[test]
    fn a_description_that_cannot_be_is_not_believed() {
        let with = |change: fn(&mut JointDescription)| {
            let mut robot = robot();
            change(&mut robot.joints[1]);
            check_description(ARM, &robot)
        };
        assert_eq!(with(|_| ()), Ok(()));
        says(with(|joint| joint.max_speed = -1.0), &["slide", "greatest speed of -1 mm/s"]);
        says(with(|joint| joint.lower = f64::NAN), &["slide", "from NaN"]);
        says(with(|joint| joint.resolution = -0.1), &["slide", "smallest step of -0.1"]);
    }

    fn tracker() -> SensorDescription {
        let quantity = |name: &str| QuantityDescription { name: name.to_owned(), unit: "mm".to_owned() };
        SensorDescription {
            model: "tracker".to_owned(),
            switches: false,
            quantities: ["x", "y"].map(quantity).to_vec(),
        }
    }

    fn reading(time_ns: u64, values: &[(&str, f64)]) -> Reading {
        let quantity = |(name, value): &(&str, f64)| Quantity {
            name: (*name).to_owned(),
            value: *value,
            standard_uncertainty: 0.1,
        };
        Reading { time_ns, quantities: values.iter().map(quantity).collect(), ..Reading::default() }
    }

    #[test]
    fn a_reading_from_before_the_motion_is_refused_with_its_age() {
        let source = Source { device: "tracker", plugin: "leica" };
        let check = |reading: &Reading, after| {
            check_reading(source, &tracker(), reading, after, RequestTimes::default())
        };
        let good = reading(2_000_000_000, &[("x", 1.0), ("y", 2.0)]);
        assert_eq!(check(&good, 2_000_000_000), Ok(()));
        says(check(&good, 5_200_000_000), &["tracker", "stale", "3.200 s before", "`leica`"]);
        says(check(&reading(5, &[("x", 1.0), ("z", 2.0)]), 0), &["`z`", "does not describe", "`x`"]);
        says(check(&reading(5, &[("x", 1.0), ("x", 2.0)]), 0), &["`x` twice"]);
        says(check(&reading(5, &[("x", f64::NAN)]), 0), &["NaN"]);
    }

    #[test]
    fn a_reading_of_a_sensors_own_has_a_value_and_was_measured_when_it_was_asked_for() {
        let source = Source { device: "tracker", plugin: "leica" };
        let check =
            |reading: &Reading| check_own_reading(source, &tracker(), reading, asked_from(5_000_000_000));
        assert_eq!(check(&reading(5_000_000_000, &[("x", 1.0), ("y", 2.0)])), Ok(()));
        assert_eq!(check(&reading(4_900_000_000, &[("x", 1.0), ("y", 2.0)])), Ok(()), "dated a little early");
        says(
            check(&reading(1_900_000_000, &[("x", 1.0), ("y", 2.0)])),
            &["tracker", "stale", "3.000 s before it was asked for", "`leica`"],
        );
        assert_eq!(check(&reading(5_000_000_000, &[("x", 1.0)])), Ok(()), "what was not seen is left out");
        says(
            check(&reading(5_000_000_000, &[])),
            &["tracker has no value; it describes `x`, `y`", "`leica`"],
        );
    }

    /// A picture dated 12 ms early is one of the arm at rest; one of a second ago is not.
    #[test]
    fn a_picture_may_be_dated_a_little_early() {
        let source = Source { device: "camera", plugin: "v4l2-camera" };
        let check = |time_ns| {
            let not_before_ns = picture_not_before(5_000_000_000);
            check_reading(source, &tracker(), &reading(time_ns, &[]), not_before_ns, RequestTimes::default())
        };
        assert_eq!(check(4_988_000_000), Ok(()));
        says(check(4_000_000_000), &["camera", "stale"]);
    }

    #[test]
    fn an_edge_at_no_pose_is_not_believed() {
        let wide = |values: [f64; 2], half_width: [f64; 2]| ProximityEdge {
            joints: vector(values),
            joints_half_width: vector(half_width),
            ..ProximityEdge::default()
        };
        let edge = |values| wide(values, [0.0, 0.1]);
        let check = |edge: &ProximityEdge| check_edge(ARM, &robot(), edge);
        assert_eq!(check(&edge([0.5, 1.0])), Ok(()));
        says(check(&edge([f64::NAN, 1.0])), &["turn", "NaN"]);
        says(check(&edge([9.0, 1.0])), &["turn", "reports"]);
        says(check(&wide([0.5, 1.0], [0.0, -0.1])), &["slide", "1 +- -0.1"]);
        says(check(&wide([0.5, 1.0], [f64::NAN, 0.1])), &["turn", "NaN"]);
        let without = ProximityEdge { joints: vector([0.5, 1.0]), ..ProximityEdge::default() };
        says(check(&without), &["0 half-widths", "2 joints"]);
        says(check(&ProximityEdge::default()), &["0 joint values"]);
    }

    #[test]
    fn a_robot_may_be_at_its_limits_and_a_tolerance_beyond() {
        let robot = robot();
        let [turn, slide] = robot.joints.as_slice() else { panic!("two joints") };
        let is_allowed = |values: [f64; 2]| check_limits(ARM, &robot, &vector(values)).is_ok();
        for sign in [1.0, -1.0] {
            assert!(is_allowed([sign * 2.0, sign * 100.0]));
            assert!(is_allowed([sign * (2.0 + 0.9 * tolerance(turn)), 0.0]));
            assert!(!is_allowed([sign * (2.0 + 1.1 * tolerance(turn)), 0.0]));
            assert!(is_allowed([0.0, sign * (100.0 + 0.9 * tolerance(slide))]));
            assert!(!is_allowed([0.0, sign * (100.0 + 1.1 * tolerance(slide))]));
        }
    }

    #[test]
    fn a_move_may_end_a_tolerance_off_and_no_further() {
        let robot = robot();
        let [turn, slide] = robot.joints.as_slice() else { panic!("two joints") };
        let asked = RequestTimes { reported_before_ns: 0, between_ns: None };
        let ended = |off: [f64; 2]| {
            let state = JointState::new(1, vector(off), false);
            check_end(ARM, &robot, &vector([0.0, 0.0]), &state, asked).is_ok()
        };
        for sign in [1.0, -1.0] {
            assert!(ended([sign * 0.9 * tolerance(turn), sign * 0.9 * tolerance(slide)]));
            assert!(!ended([sign * 1.1 * tolerance(turn), 0.0]));
            assert!(!ended([0.0, sign * 1.1 * tolerance(slide)]));
        }
    }

    #[test]
    fn a_time_may_be_as_old_and_as_far_ahead_as_is_allowed() {
        let second = 1_000_000_000;
        let (begun, answered) = (100 * second, 101 * second);
        let dated = |time_ns: u64, reported_before_ns: u64| {
            let asked = RequestTimes { reported_before_ns, between_ns: Some((begun, answered)) };
            check_time(ARM, time_ns, asked, Duration::from_secs(5)).is_ok()
        };
        assert!(dated(95 * second, 0) && !dated(95 * second - 1, 0));
        let ahead = answered + nanoseconds(AHEAD);
        assert!(dated(ahead, 0) && !dated(ahead + 1, 0));
        assert!(dated(begun, begun) && !dated(begun - 1, begun), "never before what it reported already");
        let unknown = RequestTimes { reported_before_ns: 7, between_ns: None };
        assert!(check_time(ARM, 7, unknown, Duration::ZERO).is_ok(), "nobody knows what the time is");
        assert!(check_time(ARM, 6, unknown, Duration::ZERO).is_err());
    }

    #[test]
    fn a_reading_may_be_as_new_as_the_end_of_the_motion_and_as_far_ahead_as_is_allowed() {
        let asked = RequestTimes { reported_before_ns: 0, between_ns: Some((10, 20)) };
        let source = Source { device: "tracker", plugin: "tracker" };
        let taken =
            |time_ns: u64| check_reading(source, &tracker(), &reading(time_ns, &[]), 15, asked).is_ok();
        assert!(taken(15) && !taken(14));
        let ahead = 20 + nanoseconds(AHEAD);
        assert!(taken(ahead) && !taken(ahead + 1));
        let unknown = RequestTimes { reported_before_ns: 0, between_ns: None };
        assert!(check_reading(source, &tracker(), &reading(u64::MAX, &[]), 15, unknown).is_ok());
    }
}
