//! What a robot in a host must do beside what it must do in any case, and how its messages are gathered.

use plumb_plugin::{JointVector, LineDescription, RobotCapabilities, StreamDescription};

use super::*;
use crate::context::tests::Bench;

/// When the robot is read, ns.
const READ_AT: u64 = 1_000;

/// A robot that says nothing unless it is asked what it emitted: once before it is read, once after.
struct Emitting {
    has_lines: bool,
    /// When the messages were dated that it emitted before it was read, and after.
    joints: [Vec<u64>; 2],
    inputs: [Vec<u64>; 2],
    has_been_read: bool,
}

impl Emitting {
    fn since(&self, times: &[Vec<u64>; 2]) -> Vec<u64> {
        times[usize::from(self.has_been_read)].clone()
    }
}

impl RobotBench for Emitting {
    fn describe(&mut self) -> Result<RobotDescription, PluginError> {
        let line = LineDescription { name: "line 0".to_owned(), bit: 0 };
        Ok(RobotDescription {
            model: "emitting".to_owned(),
            joints: Vec::new(),
            inputs: if self.has_lines { vec![line] } else { Vec::new() },
            outputs: Vec::new(),
            capabilities: RobotCapabilities::default(),
        })
    }

    fn activate(&mut self) -> Result<(), PluginError> {
        Ok(())
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        self.has_been_read = true;
        Ok(JointState::new(READ_AT, JointVector::zeros(1), false))
    }

    fn move_joints(&mut self, _: &Motion) -> Result<JointState, PluginError> {
        Err(PluginError::unsupported("move"))
    }

    fn interrupt(&mut self, motion: &Motion) -> Interruption {
        Interruption { result: self.move_joints(motion), after: None }
    }

    fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError> {
        Err(PluginError::unsupported("read inputs"))
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        Ok(())
    }

    fn emitted_joints(&mut self) -> Vec<JointState> {
        let state = |time_ns| JointState::new(time_ns, JointVector::zeros(1), false);
        self.since(&self.joints).into_iter().map(state).collect()
    }

    fn emitted_inputs(&mut self) -> Vec<DigitalInputs> {
        let inputs = |time_ns| DigitalInputs { time_ns, ..Default::default() };
        self.since(&self.inputs).into_iter().map(inputs).collect()
    }
}

/// What is missing of a robot that emits messages of these times after it was read; it emitted some of any time before.
fn missing(joints: &[u64], inputs: &[u64], has_lines: bool) -> Option<String> {
    let after = |times: &[u64]| [vec![0, READ_AT, 5 * READ_AT], times.to_vec()];
    let mut robot =
        Emitting { has_lines, joints: after(joints), inputs: after(inputs), has_been_read: false };
    match heard_at_rest(&mut robot).unwrap() {
        CheckOutcome::Passed => None,
        CheckOutcome::Failed(how) => Some(how),
        CheckOutcome::Skipped(why) => panic!("{why}"),
    }
}

#[test]
fn a_robot_that_was_read_has_emitted_something_as_new_on_each_of_its_streams() {
    let wrong = |stream: &str| {
        Some(format!("it was read at 1000 ns, and nothing as new as that came on its stream `{stream}`"))
    };
    assert_eq!(missing(&[READ_AT], &[READ_AT], true), None);
    assert_eq!(missing(&[1, READ_AT + 1], &[2, READ_AT + 1, 3], true), None, "one is enough");
    assert_eq!(missing(&[], &[READ_AT], true), wrong("joints"));
    assert_eq!(missing(&[READ_AT - 1], &[READ_AT], true), wrong("joints"));
    assert_eq!(missing(&[READ_AT], &[], true), wrong("inputs"));
    assert_eq!(missing(&[READ_AT], &[READ_AT - 1], true), wrong("inputs"));
    assert_eq!(missing(&[READ_AT], &[], false), None, "it has no lines");
    assert_eq!(missing(&[], &[], false), wrong("joints"));
}

#[test]
fn what_a_device_refuses_is_its_own_error_and_anything_else_a_failure() {
    let refused: Result<(), _> = answered(Err(DeviceError::refused("arm", "jog", PluginError::stopped())));
    assert_eq!(refused, Err(PluginError::stopped()));
    let late = DeviceError::TimedOut { device: "arm".to_owned(), operation: "jog", limit: READ };
    let text = "arm did not answer 'jog' within 100ms".to_owned();
    assert_eq!(answered::<()>(Err(late)), Err(PluginError::Failed(text)));
    assert_eq!(answered(Ok(7)), Ok(7));
}

#[test]
fn all_that_has_come_on_a_stream_is_gathered_and_the_last_of_it_has_a_while_to_arrive() {
    let bench = Bench::new();
    let stream = StreamDescription::of::<JointState>("joints");
    let mut receiver = Some(bench.bus().subscriber("leg", &stream).unwrap());
    let mut sender = bench.bus().publisher("leg", &stream).unwrap();
    let begin = Instant::now();
    assert_eq!(emitted::<JointState>(&mut receiver), []);
    assert!(begin.elapsed() >= ARRIVAL, "nothing may have come yet");
    for time_ns in [3, 7] {
        sender.emit(bytemuck::bytes_of(&JointState::new(time_ns, JointVector::zeros(1), false))).unwrap();
    }
    let times = emitted::<JointState>(&mut receiver).into_iter().map(|state| state.time_ns);
    assert_eq!(times.collect::<Vec<_>>(), [3, 7]);
    assert_eq!(emitted::<JointState>(&mut None), [], "it has no such stream");
}
