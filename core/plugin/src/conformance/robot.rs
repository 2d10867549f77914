//! What every robot must do.

use std::collections::HashSet;
use std::thread;
use std::time::Duration;

use super::CheckOutcome;
use super::names::{WRITABLE, can_be_written};
use super::outcome::caught;
use super::times::wrong_time;
use crate::{
    DigitalInputs, JointDescription, JointState, JointUnit, JointVector, MAX_JOINTS, Motion, PluginError,
    RobotDescription,
};

/// A fresh robot, however it is reached.
pub trait RobotBench {
    /// What it says about itself.
    ///
    /// # Errors
    /// What the robot says, as all below.
    fn describe(&mut self) -> Result<RobotDescription, PluginError>;

    /// Makes it ready to move, and takes back a stop.
    ///
    /// # Errors
    /// What the robot says.
    fn activate(&mut self) -> Result<(), PluginError>;

    /// Where its joints are.
    ///
    /// # Errors
    /// What the robot says.
    fn read_joints(&mut self) -> Result<JointState, PluginError>;

    /// Moves it.
    ///
    /// # Errors
    /// What the robot says.
    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError>;

    /// Starts a move and asks for a stop as soon as the robot reports that it moves.
    fn interrupt(&mut self, motion: &Motion) -> Interruption;

    /// The levels of its input lines.
    ///
    /// # Errors
    /// What the robot says.
    fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError>;

    /// Brings it to rest after a check that failed, so that the next check does not meet a moving arm.
    ///
    /// # Errors
    /// Why it may still move.
    fn stop(&mut self) -> Result<(), PluginError>;

    /// What it emitted on `joints` since the last call.
    fn emitted_joints(&mut self) -> Vec<JointState>;

    /// What it emitted on `inputs` since the last call.
    fn emitted_inputs(&mut self) -> Vec<DigitalInputs>;
}

/// What came of a move that was to be stopped.
#[derive(Clone, Debug, PartialEq)]
pub struct Interruption {
    /// What the move returned.
    pub result: Result<JointState, PluginError>,
    /// How long after the stop was asked for; `None` when the move was over before.
    pub after: Option<Duration>,
}

/// A check of a robot: a statement, and the function that says whether it holds.
pub type RobotCheck = (&'static str, fn(&mut dyn RobotBench) -> Result<CheckOutcome, PluginError>);

/// What every robot must do.
pub const ROBOT_CHECKS: &[RobotCheck] = &[
    ("it is at rest before anything is asked of it", comes_to_rest_first),
    ("its description makes sense", description_makes_sense),
    ("it is at rest when it is read", rests_when_read),
    ("a move ends at its target", move_ends_at_its_target),
    ("a relative move adds to where the joints are", relative_move_adds),
    ("joints that take no part stay where they are", others_stay),
    ("its joint stream ends at rest where the move ended", stream_ends_at_rest),
    ("its times are those of the cell's clock", times_are_the_cells),
    ("its times never go back", times_never_go_back),
    ("its input stream closes every move", inputs_close_every_move),
    ("its input lines can be read at rest", inputs_can_be_read),
    ("a stop ends a move in time", stop_ends_a_move),
    ("a stop holds until it is activated again", stop_holds),
];

/// Checks that neither move a robot nor make it ready to.
const AT_REST: [&str; 4] = [
    "it is at rest before anything is asked of it",
    "its description makes sense",
    "it is at rest when it is read",
    "its input lines can be read at rest",
];

/// Whether a check leaves the robot at rest: nobody need keep clear of it.
pub fn leaves_at_rest(check: &str) -> bool {
    AT_REST.contains(&check)
}

/// Runs one check on a fresh robot, and stops the robot when the check failed. What follows is not run when the stop fails too: `false`.
pub fn run_robot_check(check: RobotCheck, bench: &mut dyn RobotBench) -> (CheckOutcome, bool) {
    let (_, function) = check;
    let outcome = caught(|| function(bench));
    let CheckOutcome::Failed(how) = &outcome else { return (outcome, true) };
    match caught(|| bench.stop().map(|()| CheckOutcome::Passed)) {
        CheckOutcome::Failed(why) => {
            let text =
                format!("{how}; then it could not be stopped, so that nothing more is asked of it: {why}");
            (CheckOutcome::Failed(text), false)
        }
        _ => (outcome, true),
    }
}

/// What is in the report for the checks after one that left a robot that could not be stopped.
pub fn not_run() -> CheckOutcome {
    CheckOutcome::Skipped("not run: the robot could not be stopped".to_owned())
}

/// How long a move may go on after a stop was asked for: two looks at `should_stop`, and what a busy machine adds. The robot's own stop time
/// comes on top.
const STOP_NOTICED: Duration = Duration::from_millis(300);

/// How often a stop is tried whose move ends late: a busy machine makes a stop late, never early, so that the best of a few says what the robot does.
const STOPS_TRIED: u32 = 4;

/// How often a robot that comes to rest is looked at.
const LOOK: Duration = Duration::from_millis(20);

/// How far a joint may end from its target beside its resolution: what a driver's own units round.
fn rounding(joint: &JointDescription) -> f64 {
    joint.resolution.max(1e-9) * 1.001
}

fn failed(how: String) -> Result<CheckOutcome, PluginError> {
    Ok(CheckOutcome::Failed(how))
}

/// A run that was broken off, or a program before this one, may have left it moving.
fn comes_to_rest_first(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    if !bench.read_joints()?.is_moving() {
        return Ok(CheckOutcome::Passed);
    }
    let stop_time = Duration::from_millis(bench.describe()?.capabilities.stop_time_ms.into());
    bench.stop()?;
    let limit = STOP_NOTICED + stop_time;
    // So many looks, each after a pause: on a busy machine they take longer, and the robot has longer too.
    for _ in 0..limit.as_millis().div_ceil(LOOK.as_millis()) {
        if !bench.read_joints()?.is_moving() {
            return Ok(CheckOutcome::Passed);
        }
        thread::sleep(LOOK);
    }
    if !bench.read_joints()?.is_moving() {
        return Ok(CheckOutcome::Passed);
    }
    failed(format!("it moved, was told to stop, and still moves {limit:?} later"))
}

fn description_makes_sense(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    if robot != bench.describe()? {
        return failed("it describes itself in two ways".to_owned());
    }
    if robot.joints.is_empty() || robot.joints.len() > MAX_JOINTS {
        return failed(format!("it has {} joints; 1 to {MAX_JOINTS} are possible", robot.joints.len()));
    }
    let mut names = HashSet::new();
    for joint in &robot.joints {
        let name = &joint.name;
        if name.is_empty() || !names.insert(name) {
            return failed(format!("two joints are called '{name}', or one has no name"));
        }
        if !can_be_written(name) {
            return failed(format!("joint '{name}' cannot be named in an expression: {WRITABLE}"));
        }
        let numbers = [joint.lower, joint.upper, joint.resolution, joint.max_speed, joint.home];
        if !numbers.iter().all(|number| number.is_finite()) {
            return failed(format!("{name} has a number that is none: {joint:?}"));
        }
        if joint.lower >= joint.upper || joint.home < joint.lower || joint.home > joint.upper {
            return failed(format!(
                "{name} goes from {} to {} and is at home at {}",
                joint.lower, joint.upper, joint.home
            ));
        }
        if joint.max_speed <= 0.0 || joint.resolution < 0.0 {
            return failed(format!(
                "{name} has speed {} and resolution {}",
                joint.max_speed, joint.resolution
            ));
        }
        if let Some(how) = looks_like_degrees(joint) {
            return failed(how);
        }
    }
    for lines in [&robot.inputs, &robot.outputs] {
        let mut bits = HashSet::new();
        if let Some(line) = lines.iter().find(|line| line.bit > 63 || !bits.insert(line.bit)) {
            return failed(format!(
                "line '{}' has bit {}, which another has or none can have",
                line.name, line.bit
            ));
        }
    }
    Ok(CheckOutcome::Passed)
}

/// From here on a range whose ends are whole numbers of radians is taken for one in degrees, rad: nearly five turns, more than a joint with cables
/// in it makes, and no stop lies at a whole number of radians.
const LIKE_DEGREES_RAD: f64 = 30.0;

/// A turning joint whose range was described in degrees. All of it would be off by 57, and alike both ways, so that moves seem to end where they should.
fn looks_like_degrees(joint: &JointDescription) -> Option<String> {
    let (lower, upper) = (joint.lower, joint.upper);
    let is_like = joint.unit == JointUnit::Radian
        && lower.fract() == 0.0
        && upper.fract() == 0.0
        && upper - lower >= LIKE_DEGREES_RAD;
    let turns = (upper - lower) / std::f64::consts::TAU;
    is_like.then(|| {
        format!(
            "{} goes from {lower} to {upper} rad, which is {turns:.1} turns: are these degrees? Joints that turn are described, read and moved in rad: \
             {lower} to {upper} deg are {:.4} to {:.4} rad. If it does turn so often, give its ends in rad where its stops lie, which is at no whole numbers of them",
            joint.name,
            lower.to_radians(),
            upper.to_radians()
        )
    })
}

fn rests_when_read(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    let state = bench.read_joints()?;
    if state.joints.len() != robot.joints.len() {
        return failed(format!("it has {} joints and reads {}", robot.joints.len(), state.joints.len()));
    }
    if state.is_moving() || !state.joints.as_slice().iter().all(|value| value.is_finite()) {
        return failed(format!("it reads {state:?}"));
    }
    Ok(CheckOutcome::Passed)
}

/// A small step of one joint towards the middle of its range, and where it leads from `from`.
fn step_of(robot: &RobotDescription, joint: usize, from: &JointVector) -> Option<(Motion, JointVector)> {
    let description = robot.joints.get(joint)?;
    let at = from.get(joint)?;
    let most = match description.unit {
        JointUnit::Radian => 0.05,
        JointUnit::Millimetre => 3.0,
    };
    let middle = 0.5 * (description.lower + description.upper);
    let way = (middle - at).abs().max(0.1 * (description.upper - description.lower)).min(most);
    let mut change = JointVector::zeros(from.len());
    change.set(joint, if middle >= at { way } else { -way });
    let motion = Motion::relative(change, 1.0).only(1 << joint);
    Some((motion, motion.end_from(from)))
}

fn move_ends_at_its_target(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    bench.activate()?;
    for (index, joint) in robot.joints.iter().enumerate() {
        let from = bench.read_joints()?.joints;
        let Some((_, target)) = step_of(&robot, index, &from) else { continue };
        let state = bench.move_joints(&Motion::absolute(target, 1.0).only(1 << index))?;
        let end = state.joints;
        if state.is_moving() {
            return failed(format!("told to move {}, it returns while it still moves", joint.name));
        }
        if let Some(how) = off_target(&robot, &end, &target) {
            return failed(format!("told to move {}, {how}", joint.name));
        }
        let read = bench.read_joints()?.joints;
        if read != end {
            return failed(format!("the move ended at {end:?} and is read as {read:?}"));
        }
    }
    Ok(CheckOutcome::Passed)
}

/// The joint that is not where it should be.
fn off_target(robot: &RobotDescription, end: &JointVector, target: &JointVector) -> Option<String> {
    robot.joints.iter().enumerate().find_map(|(index, joint)| {
        let (end, target) = (end.get(index)?, target.get(index)?);
        let off = end.is_nan() || (end - target).abs() > rounding(joint);
        off.then(|| format!("{} ends at {end} instead of {target} {}", joint.name, joint.unit.symbol()))
    })
}

fn relative_move_adds(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    bench.activate()?;
    // Twice, because at zero to add and to go are the same.
    for _ in 0..2 {
        let from = bench.read_joints()?.joints;
        let Some((motion, target)) = step_of(&robot, 0, &from) else { return Ok(CheckOutcome::Passed) };
        let end = bench.move_joints(&motion)?.joints;
        if let Some(how) = off_target(&robot, &end, &target) {
            return failed(how);
        }
    }
    Ok(CheckOutcome::Passed)
}

fn others_stay(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    bench.activate()?;
    let from = bench.read_joints()?.joints;
    let Some((_, target)) = step_of(&robot, 0, &from) else { return Ok(CheckOutcome::Passed) };
    let mut nonsense = target;
    for index in 1..nonsense.len() {
        nonsense.set(index, f64::NAN);
    }
    let end = bench.move_joints(&Motion::absolute(nonsense, 1.0).only(1))?.joints;
    Ok(off_target(&robot, &end, &target).map_or(CheckOutcome::Passed, CheckOutcome::Failed))
}

fn stream_ends_at_rest(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    bench.activate()?;
    let from = bench.read_joints()?.joints;
    let Some((motion, _)) = step_of(&robot, 0, &from) else { return Ok(CheckOutcome::Passed) };
    bench.emitted_joints();
    let end = bench.move_joints(&motion)?;
    match bench.emitted_joints().last() {
        None => failed("it emits nothing on 'joints' while it moves".to_owned()),
        Some(last) if last.is_moving() => failed("the last state of the move still moves".to_owned()),
        Some(last) if last.joints != end.joints => {
            failed(format!("the stream ends at {:?}, the move at {:?}", last.joints, end.joints))
        }
        Some(_) => Ok(CheckOutcome::Passed),
    }
}

fn times_are_the_cells(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    bench.activate()?;
    let before = bench.read_joints()?;
    let Some((motion, _)) = step_of(&robot, 0, &before.joints) else { return Ok(CheckOutcome::Passed) };
    bench.emitted_joints();
    bench.emitted_inputs();
    let end = bench.move_joints(&motion)?;
    let joints = bench.emitted_joints().into_iter().map(|state| state.time_ns);
    let inputs = bench.emitted_inputs().into_iter().map(|inputs| inputs.time_ns);
    let mut times = [before.time_ns, end.time_ns].into_iter().chain(joints).chain(inputs);
    if let Some(how) = times.find_map(wrong_time) {
        return failed(format!("a time {how}"));
    }
    if end.time_ns <= before.time_ns {
        let (before, end) = (before.time_ns, end.time_ns);
        return failed(format!("it was read at {before} ns, and a move after that ended at {end} ns"));
    }
    Ok(CheckOutcome::Passed)
}

fn inputs_can_be_read(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    if robot.inputs.is_empty() {
        return Ok(CheckOutcome::Skipped("it has no input lines".to_owned()));
    }
    let inputs = match bench.read_inputs() {
        Ok(inputs) => inputs,
        Err(PluginError::Unsupported(_)) => {
            return failed(
                "it has input lines and no read_inputs: a sensor that is wired to them waits in vain while the robot is at rest"
                    .to_owned(),
            );
        }
        Err(error) => return Err(error),
    };
    match wrong_time(inputs.time_ns) {
        Some(how) => failed(format!("the time of its input lines {how}")),
        None => Ok(CheckOutcome::Passed),
    }
}

fn times_never_go_back(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    bench.activate()?;
    let before = bench.read_joints()?;
    let Some((motion, _)) = step_of(&robot, 0, &before.joints) else { return Ok(CheckOutcome::Passed) };
    bench.emitted_joints();
    let end = bench.move_joints(&motion)?;
    let after = bench.read_joints()?;
    let mut times = vec![before.time_ns];
    times.extend(bench.emitted_joints().iter().map(|state| state.time_ns));
    if let Some(pair) = times.windows(2).find(|pair| pair[0] > pair[1]) {
        return failed(format!("{} ns comes after {} ns on 'joints'", pair[1], pair[0]));
    }
    if end.time_ns < before.time_ns || after.time_ns < end.time_ns {
        let (before, end, after) = (before.time_ns, end.time_ns, after.time_ns);
        return failed(format!("read at {before} ns, moved until {end} ns, read again at {after} ns"));
    }
    Ok(CheckOutcome::Passed)
}

fn inputs_close_every_move(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    if robot.inputs.is_empty() {
        return Ok(CheckOutcome::Skipped("it has no input lines".to_owned()));
    }
    bench.activate()?;
    let from = bench.read_joints()?.joints;
    let Some((motion, _)) = step_of(&robot, 0, &from) else { return Ok(CheckOutcome::Passed) };
    bench.emitted_inputs();
    let end = bench.move_joints(&motion)?;
    match bench.emitted_inputs().last() {
        None => failed("it emits nothing on 'inputs' at the end of a move".to_owned()),
        Some(last) if last.changed != 0 => {
            failed("the last message of the move is a change, not its end".to_owned())
        }
        Some(last) if last.time_ns < end.time_ns => failed(format!(
            "the move's last message is of {} ns, before the state it returned, of {} ns",
            last.time_ns, end.time_ns
        )),
        Some(_) => Ok(CheckOutcome::Passed),
    }
}

/// A move of about two seconds, of the joint with most room for it. No further than two seconds at full speed lead: where a joint's range depends on
/// another joint, the whole of it need not be free.
fn long_move(robot: &RobotDescription, from: &JointVector) -> Motion {
    let way = |index: usize, joint: &JointDescription| {
        let at = from.get(index).unwrap_or(0.0);
        let (up, down) = (joint.upper - at, joint.lower - at);
        let most = 2.0 * joint.max_speed;
        (0.9 * if up.abs() > down.abs() { up } else { down }).clamp(-most, most)
    };
    let seconds = |index: usize, joint: &JointDescription| way(index, joint).abs() / joint.max_speed;
    let longest = robot
        .joints
        .iter()
        .enumerate()
        .max_by(|(a, one), (b, other)| seconds(*a, one).total_cmp(&seconds(*b, other)));
    let mut change = JointVector::zeros(from.len());
    let Some((index, joint)) = longest else { return Motion::relative(change, 1.0) };
    change.set(index, way(index, joint));
    Motion::relative(change, (seconds(index, joint) / 2.0).clamp(0.01, 1.0)).only(1 << index)
}

fn stop_ends_a_move(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    if !robot.capabilities.interruptible {
        return Ok(CheckOutcome::Skipped("it says that its moves cannot be interrupted".to_owned()));
    }
    let limit = STOP_NOTICED + Duration::from_millis(robot.capabilities.stop_time_ms.into());
    let mut soonest: Option<Duration> = None;
    for _ in 0..STOPS_TRIED {
        bench.activate()?;
        let motion = long_move(&robot, &bench.read_joints()?.joints);
        let Interruption { result, after } = bench.interrupt(&motion);
        let Some(after) = after else {
            result?;
            return Ok(CheckOutcome::Skipped("its moves take no time".to_owned()));
        };
        match result {
            Err(PluginError::Stopped(_)) if after <= limit => return Ok(CheckOutcome::Passed),
            Err(PluginError::Stopped(_)) => soonest = Some(soonest.map_or(after, |known| known.min(after))),
            // It may have ended by itself just before it could take notice.
            Ok(_) => {}
            Err(error) => return Err(error),
        }
    }
    failed(soonest.map_or_else(
        || "the move ended as if it had not been stopped".to_owned(),
        |after| {
            format!("it came to rest {after:?} after the stop at the soonest of {STOPS_TRIED}; {limit:?} are allowed")
        },
    ))
}

fn stop_holds(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    if !robot.capabilities.interruptible {
        return Ok(CheckOutcome::Skipped("it says that its moves cannot be interrupted".to_owned()));
    }
    bench.activate()?;
    let motion = long_move(&robot, &bench.read_joints()?.joints);
    let Interruption { result, after } = bench.interrupt(&motion);
    if after.is_none() {
        result?;
        return Ok(CheckOutcome::Skipped("its moves take no time".to_owned()));
    }
    let rest_joints = bench.read_joints()?.joints;
    match bench.move_joints(&motion) {
        Err(PluginError::Stopped(_)) => {}
        other => return failed(format!("a move after the stop ended with {other:?}")),
    }
    if bench.read_joints()?.joints != rest_joints {
        return failed("it moved after the stop".to_owned());
    }
    bench.activate()?;
    let Some((small, target)) = step_of(&robot, 0, &rest_joints) else { return Ok(CheckOutcome::Passed) };
    let end = bench.move_joints(&small)?.joints;
    Ok(off_target(&robot, &end, &target).map_or(CheckOutcome::Passed, CheckOutcome::Failed))
}
