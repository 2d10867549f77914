//! What the host emits for a robot that is read at rest.
//!
//! A sensor that takes in a robot's stream answers for a moment once it has seen a message not older than that moment. A driver emits while it
//! moves and at the end of a move; the moment of a later reading comes after that, and the sensor would wait for ever. Unless the plugin says
//! itself where the robot is, the host does it: on `joints`, and on `inputs` with the levels of the lines.

use plumb_plugin::{
    DigitalInputs, JointState, JointVector, LogLevel, Manifest, Message, PluginError, StreamDescription,
};

use crate::context::Context;
use crate::load::Device;

/// The stream of a robot's joints.
const JOINTS: &str = "joints";

/// The stream of a robot's input lines.
const INPUTS: &str = "inputs";

/// Which of the two streams a robot has.
pub(super) struct RestReport {
    joints: bool,
    inputs: bool,
    /// It was reported that the lines cannot be read.
    has_reported: bool,
}

impl RestReport {
    pub(super) fn of(manifest: &Manifest) -> Self {
        let has = |name: &str, message: &str| {
            let is_it = |stream: &StreamDescription| stream.name == name && stream.message == message;
            manifest.streams.iter().any(is_it)
        };
        Self {
            joints: has(JOINTS, JointState::TYPE_NAME),
            inputs: has(INPUTS, DigitalInputs::TYPE_NAME),
            has_reported: false,
        }
    }

    /// Emits where a robot is at rest, as it was just read, unless its plugin has.
    pub(super) fn emit(&mut self, state: &JointState, device: &Device, context: &Context) {
        if state.is_moving() {
            return;
        }
        let is_emitted = |last: Option<u64>| last.is_some_and(|last| last >= state.time_ns);
        if self.joints && !is_emitted(context.last_emitted::<JointState>(JOINTS).map(|last| last.time_ns)) {
            // What cannot be emitted has been logged by the context.
            let _ = context.emit(JOINTS, bytemuck::bytes_of(state));
        }
        let last_inputs = || context.last_emitted::<DigitalInputs>(INPUTS);
        if !self.inputs || is_emitted(last_inputs().map(|last| last.time_ns)) {
            return;
        }
        let read = device.robot().and_then(|robot| robot.read_inputs());
        let last = last_inputs();
        if is_emitted(last.map(|last| last.time_ns)) {
            return;
        }
        match read {
            Ok(now) => emit_levels(context, state, now.levels, last),
            Err(PluginError::Unsupported(_)) if last.is_some() => {
                emit_levels(context, state, last.map_or(0, |last| last.levels), last);
            }
            Err(error) => self.report_once(context, &error),
        }
    }

    fn report_once(&mut self, context: &Context, error: &PluginError) {
        if !std::mem::replace(&mut self.has_reported, true) {
            let text = format!(
                "its input lines cannot be read at rest: {error}. A sensor that is wired to its stream `inputs` waits in vain until it moves"
            );
            context.report(LogLevel::Warn, &text);
        }
    }
}

fn emit_levels(context: &Context, state: &JointState, levels: u64, last: Option<DigitalInputs>) {
    let changed = last.map_or(0, |last| last.levels ^ levels);
    for message in closing_messages(state, levels, changed, last) {
        // What cannot be emitted has been logged by the context.
        let _ = context.emit(INPUTS, bytemuck::bytes_of(&message));
    }
}

/// The messages that close the time up to a reading: lines that changed since the last message, between where the robot was then and is now, and
/// the levels at the reading.
fn closing_messages(
    state: &JointState,
    levels: u64,
    changed: u64,
    last: Option<DigitalInputs>,
) -> Vec<DigitalInputs> {
    let at_rest = DigitalInputs {
        time_ns: state.time_ns,
        sequence: 0,
        levels,
        changed: 0,
        joints: state.joints,
        joints_half_width: JointVector::zeros(state.joints.len()),
    };
    let mut messages = Vec::new();
    if let Some(last) = last.filter(|_| changed != 0) {
        let mut change = DigitalInputs { changed, ..at_rest };
        for joint in 0..state.joints.len() {
            let (before, now) = (last.joints.get(joint), state.joints.get(joint));
            let (Some(before), Some(now)) = (before, now) else { continue };
            change.joints.set(joint, 0.5 * (before + now));
            change.joints_half_width.set(joint, 0.5 * (before - now).abs());
        }
        messages.push(change);
    }
    messages.push(at_rest);
    messages
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::tests::Bench;

    #[test]
    fn a_stream_of_a_robot_is_known_by_its_name_and_its_message() {
        let has = |streams: &str| {
            let text = format!(
                "id: arm\ntitle: An arm\nversion: 0.1.0\ncontract: [1, 0]\nkind: robot\nlibrary: libarm.so\nstreams: [{streams}]\n"
            );
            let report = RestReport::of(&Manifest::parse(&text, "plugin.yaml").unwrap());
            (report.joints, report.inputs)
        };
        let (joints, inputs) =
            ("{name: joints, message: joint-state/1}", "{name: inputs, message: digital-inputs/1}");
        assert_eq!(has(&format!("{joints}, {inputs}")), (true, true));
        assert_eq!((has(joints), has(inputs)), ((true, false), (false, true)));
        assert_eq!(has("{name: elbow, message: joint-state/1}"), (false, false), "of another name");
        assert_eq!(has("{name: inputs, message: health/1}"), (false, false), "of other messages");
    }

    #[test]
    fn lines_whose_levels_differ_from_the_last_message_are_emitted_as_changed() {
        let bench = Bench::new();
        let stream = StreamDescription::of::<DigitalInputs>(INPUTS);
        bench.context.add_stream(INPUTS, bench.bus().publisher("arm", &stream).unwrap());
        let mut receiver = bench.bus().subscriber("arm", &stream).unwrap();
        let mut emitted = |last: Option<DigitalInputs>| {
            emit_levels(&bench.context, &at(bench.context.clock.now_ns(), 0.5), 0b0110, last);
            let messages = std::iter::from_fn(|| receiver.receive::<DigitalInputs>().unwrap());
            messages.map(|message| (message.levels, message.changed)).collect::<Vec<_>>()
        };
        assert_eq!(emitted(None), [(0b0110, 0)]);
        let of_levels =
            |levels| DigitalInputs { time_ns: 3, levels, joints: at(3, 0.1).joints, ..Default::default() };
        assert_eq!(emitted(Some(of_levels(0b0101))), [(0b0110, 0b0011), (0b0110, 0)]);
        assert_eq!(emitted(Some(of_levels(0b0110))), [(0b0110, 0)]);
    }

    fn at(time_ns: u64, waist: f64) -> JointState {
        let mut joints = JointVector::zeros(1);
        joints.set(0, waist);
        JointState::new(time_ns, joints, false)
    }

    #[test]
    fn a_reading_at_rest_is_closed_by_the_levels_as_they_are() {
        let messages = closing_messages(&at(7, 0.5), 0b10, 0, None);
        assert_eq!(messages.len(), 1);
        assert_eq!((messages[0].time_ns, messages[0].levels, messages[0].changed), (7, 0b10, 0));
        assert_eq!(messages[0].joints.get(0), Some(0.5));
    }

    #[test]
    fn a_line_that_changed_unseen_changed_between_there_and_here() {
        let last =
            DigitalInputs { time_ns: 3, levels: 0b01, joints: at(3, 0.1).joints, ..Default::default() };
        let messages = closing_messages(&at(7, 0.5), 0b11, 0b10, Some(last));
        assert_eq!(messages.iter().map(|message| message.changed).collect::<Vec<_>>(), [0b10, 0]);
        assert!((messages[0].joints.get(0).unwrap() - 0.3).abs() < 1e-12);
        assert!((messages[0].joints_half_width.get(0).unwrap() - 0.2).abs() < 1e-12);
        assert_eq!(messages[1].joints_half_width.get(0), Some(0.0));
    }
}
