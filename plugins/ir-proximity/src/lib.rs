//! An infrared proximity sensor whose switching line another device reads, or this computer.
//!
//! The sensor itself is a lamp, a phototransistor and a Schmitt trigger: it has no wire to the computer but one digital line.
//! That runs into an input of the robot that carries it, or into a line of a GPIO chip of this computer. The plugin takes it from the robot's
//! stream of input levels, or from the kernel beside the robot's stream of joints, and makes of it what the sensor saw: edges, each with the pose
//! the robot was in at that moment.

mod config;
mod gpio;
mod pose_of_edge;
mod watch;

use plumb_plugin::{
    DigitalInputs, Host, JointState, LogLevel, PluginError, Reading, Sensor, SensorDescription, Value,
};

use config::Config;
use gpio::{GpioLine, LineSource};
use pose_of_edge::PoseOfEdge;
use watch::Watch;

/// A wired input: the levels of the device that reads the line.
const LINE: &str = "line";
/// A wired input: where the robot is whose movement changes a line of this computer.
const JOINTS: &str = "joints";
/// The stream of edges.
const EDGES: &str = "edges";

/// An infrared proximity sensor.
#[derive(Debug)]
pub struct IrProximity {
    host: Host,
    config: Config,
    /// The line of this computer, where the sensor is wired to one.
    own_line: Option<OwnLine>,
    watch: Watch,
    unread: Vec<plumb_plugin::ProximityEdge>,
}

/// A line of this computer, and the poses its changes belong to.
#[derive(Debug)]
struct OwnLine {
    source: Box<dyn LineSource>,
    poses: PoseOfEdge,
}

impl OwnLine {
    fn new(mut source: Box<dyn LineSource>) -> Result<Self, PluginError> {
        let level = source.level()?;
        Ok(Self { source, poses: PoseOfEdge::new(level) })
    }
}

impl Sensor for IrProximity {
    fn create(config: &Value, host: Host) -> Result<Self, PluginError> {
        let config = Config::read(config)?;
        let own_line = match config.gpio() {
            Some(setting) => Some(OwnLine::new(Box::new(GpioLine::open(setting)?))?),
            None => None,
        };
        Ok(Self { host, config, own_line, watch: Watch::default(), unread: Vec::new() })
    }

    fn describe(&self) -> SensorDescription {
        SensorDescription {
            model: "Infrared lamp and phototransistor with a Schmitt trigger".to_owned(),
            switches: true,
            quantities: Vec::new(),
        }
    }

    fn configure(&mut self, settings: &Value) -> Result<(), PluginError> {
        let config = self.config.with(settings)?;
        if config != self.config {
            self.config = config;
            self.watch.forget();
        }
        Ok(())
    }

    fn arm(&mut self) -> Result<(), PluginError> {
        loop {
            match self.poll() {
                Ok(()) => break,
                Err(PluginError::InputLost(text)) => self.host.log(LogLevel::Warn, &text),
                Err(error) => return Err(error),
            }
        }
        self.watch.settle();
        self.unread.clear();
        Ok(())
    }

    fn poll(&mut self) -> Result<(), PluginError> {
        let taken = match self.own_line {
            Some(_) => self.take_own_line(),
            None => self.take_wired_line(),
        };
        if taken.is_err() {
            self.watch.forget();
        }
        taken
    }

    fn read(&mut self, after_ns: u64) -> Result<Option<Reading>, PluginError> {
        self.poll()?;
        if self.watch.seen_ns < after_ns {
            return Ok(None);
        }
        if let Some(edge) = self.watch.settle() {
            self.keep(edge)?;
        }
        Ok(Some(Reading {
            time_ns: self.watch.seen_ns,
            fired: self.watch.fired(),
            edges: std::mem::take(&mut self.unread),
            quantities: Vec::new(),
        }))
    }
}

impl IrProximity {
    /// Takes in the levels that the robot has reported.
    fn take_wired_line(&mut self) -> Result<(), PluginError> {
        while let Some(message) =
            self.host.receive::<DigitalInputs>(LINE).map_err(|error| unwired(error, LINE, "inputs"))?
        {
            self.take(&message)?;
        }
        Ok(())
    }

    /// Takes in where the robot has been, and what the line of this computer did meanwhile.
    fn take_own_line(&mut self) -> Result<(), PluginError> {
        let Some(own) = &mut self.own_line else { return Ok(()) };
        let mut states = Vec::new();
        loop {
            match self.host.receive::<JointState>(JOINTS) {
                Ok(Some(state)) => states.push(state),
                Ok(None) => break,
                Err(error) => {
                    own.poses.forget();
                    return Err(unwired(error, JOINTS, "joints"));
                }
            }
        }
        // After the states, so that every change up to the last of them is among these.
        while let Some(edge) = own.source.next_edge()? {
            own.poses.changed(edge);
        }
        let messages: Vec<DigitalInputs> = states.iter().flat_map(|state| own.poses.joints(state)).collect();
        messages.iter().try_for_each(|message| self.take(message))
    }

    fn take(&mut self, message: &DigitalInputs) -> Result<(), PluginError> {
        let certain = self.watch.take(&self.config, message)?;
        certain.into_iter().try_for_each(|edge| self.keep(edge))
    }

    fn keep(&mut self, edge: plumb_plugin::ProximityEdge) -> Result<(), PluginError> {
        self.unread.push(edge);
        self.host.emit(EDGES, &edge)
    }
}

/// What to say when the stream that is needed is not wired.
fn unwired(error: PluginError, input: &str, stream: &str) -> PluginError {
    match error {
        PluginError::Refused(_) | PluginError::Unsupported(_) => PluginError::Refused(format!(
            "the sensor needs the robot's {stream}: wire them in the cell file with `inputs: {{{input}: ROBOT/{stream}}}`"
        )),
        other => other,
    }
}

plumb_plugin::export_sensor!(IrProximity, include_str!("../plugin.yaml"));

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use plumb_plugin::recording::RecordingHost;
    use plumb_plugin::{JointVector, ProximityEdge};

    use super::*;
    use config::{Active, GpioSetting, Wiring};
    use gpio::LineEdge;

    /// A line that does what was written down.
    #[derive(Debug)]
    struct Written(VecDeque<LineEdge>);

    impl LineSource for Written {
        fn level(&mut self) -> Result<bool, PluginError> {
            Ok(false)
        }

        fn next_edge(&mut self) -> Result<Option<LineEdge>, PluginError> {
            Ok(self.0.pop_front())
        }
    }

    fn on_own_line(edges_ms: &[(u64, bool)], debounce_ms: f64) -> (IrProximity, RecordingHost) {
        let edge = |(ms, level): &(u64, bool)| LineEdge { time_ns: ms * 1_000_000, level: *level };
        let source = Written(edges_ms.iter().map(edge).collect());
        let recording = RecordingHost::new();
        let mut config = Config::of_bit(0, Active::High, debounce_ms);
        config.wiring = Wiring::Gpio(GpioSetting { chip: "/dev/gpiochip0".to_owned(), line: 17 });
        let sensor = IrProximity {
            host: recording.host(),
            config,
            own_line: Some(OwnLine::new(Box::new(source)).unwrap()),
            watch: Watch::default(),
            unread: Vec::new(),
        };
        (sensor, recording)
    }

    fn at(ms: u64, joint: f64) -> JointState {
        JointState::new(ms * 1_000_000, JointVector::from_slice(&[joint]).unwrap(), true)
    }

    #[test]
    fn changes_of_a_line_of_this_computer_are_edges_at_the_robots_pose() {
        let (mut sensor, host) = on_own_line(&[(14, true), (33, false)], 0.0);
        for (ms, joint) in [(10, 1.0), (20, 2.0), (30, 3.0), (40, 4.0)] {
            host.feed(JOINTS, &at(ms, joint));
        }
        let reading = sensor.read(40_000_000).unwrap().unwrap();
        let edges: Vec<_> = reading
            .edges
            .iter()
            .map(|edge| {
                (
                    edge.time_ns / 1_000_000,
                    edge.has_fired(),
                    edge.joints.get(0),
                    edge.joints_half_width.get(0),
                )
            })
            .collect();
        assert_eq!(edges, [(14, true, Some(1.5), Some(0.5)), (33, false, Some(3.5), Some(0.5))]);
        assert_eq!(reading.fired, Some(false));
        assert_eq!(host.emitted::<ProximityEdge>(EDGES).len(), 2);
    }

    #[test]
    fn a_reading_waits_until_the_robot_has_reported_where_it_was() {
        let (mut sensor, host) = on_own_line(&[(14, true)], 0.0);
        host.feed(JOINTS, &at(10, 1.0));
        assert_eq!(sensor.read(20_000_000).unwrap(), None);
        host.feed(JOINTS, &at(20, 1.0));
        assert_eq!(sensor.read(20_000_000).unwrap().unwrap().edges.len(), 1);
    }

    #[test]
    fn a_line_that_chatters_is_debounced() {
        let (mut sensor, host) = on_own_line(&[(11, true), (12, false), (13, true)], 5.0);
        for ms in [10, 20, 30] {
            host.feed(JOINTS, &at(ms, ms as f64));
        }
        let reading = sensor.read(30_000_000).unwrap().unwrap();
        let edges: Vec<_> =
            reading.edges.iter().map(|edge| (edge.time_ns / 1_000_000, edge.has_fired())).collect();
        assert_eq!(edges, [(13, true)]);
    }

    #[test]
    fn states_that_were_lost_are_an_error_and_no_pose_is_made_up() {
        let (mut sensor, host) = on_own_line(&[(14, true)], 0.0);
        host.feed(JOINTS, &at(10, 1.0));
        sensor.read(0).unwrap();
        host.feed_loss(JOINTS);
        assert!(matches!(sensor.read(0), Err(PluginError::InputLost(_))));
        host.feed(JOINTS, &at(20, 2.0));
        let reading = sensor.read(20_000_000).unwrap().unwrap();
        assert_eq!((reading.edges.len(), reading.fired), (0, Some(true)));
    }
}
