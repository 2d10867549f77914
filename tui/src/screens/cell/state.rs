//! What is known of the devices, gathered from the engine's events.

use std::collections::VecDeque;

use plumb_cell::event::{DeviceState, Event, NamedValue};
use plumb_cell::workcell::TTarget;

use super::ArmShape;
use super::trace::Trace;

/// Changes of signals kept for the list on the screen.
const KEPT_EDGES: usize = 200;
/// Positions where a trigger was found, kept for the drawing.
const KEPT_TRIGGERS: usize = 40;

/// All devices of the cell and what they last said.
#[derive(Clone, Debug, Default)]
pub(crate) struct CellState {
    /// Name of the cell.
    pub name: String,
    /// In the order in which they first spoke.
    pub devices: Vec<Device>,
    /// Changes of signals, newest last.
    pub edges: VecDeque<Edge>,
    /// Joints at the moments when searches found what they looked for, newest last.
    pub triggers: VecDeque<Vec<NamedValue>>,
    /// The arm to draw, where its lengths are known.
    pub shape: Option<ArmShape>,
    /// The target on the table, where the cell describes one.
    pub target: Option<TTarget>,
    /// Clock of the cell at the newest reading, nanoseconds.
    pub now_ns: u64,
}

/// One device.
#[derive(Clone, Debug)]
pub(crate) struct Device {
    /// Its name in the cell file.
    pub name: String,
    /// The plugin that serves it; empty until the device has said so.
    pub plugin: String,
    /// Its state.
    pub state: DeviceState,
    /// The last thing it said.
    pub message: String,
    /// Where its joints are, for a robot.
    pub joints: Vec<NamedValue>,
    /// How each of them moved of late, in the same order.
    pub joint_traces: Vec<Trace>,
    /// It moves.
    pub moving: bool,
    /// Clock of the cell at its last joint reading, nanoseconds.
    pub joints_at_ns: u64,
    /// The last level of each of its signals.
    pub signals: Vec<Signal>,
}

/// The level of one line.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Signal {
    /// As the device calls it.
    pub name: String,
    /// The level.
    pub on: bool,
    /// Changes seen.
    pub changes: u64,
    /// The level of late: 0 off, 1 on.
    pub trace: Trace,
}

/// A signal that changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Edge {
    /// The device.
    pub device: String,
    /// The line.
    pub signal: String,
    /// The level after it.
    pub on: bool,
    /// Clock of the cell at the change, nanoseconds.
    pub time_ns: u64,
}

impl CellState {
    /// Takes in what concerns devices; other events change nothing here.
    pub(crate) fn take(&mut self, event: &Event) {
        match event {
            Event::RunStarted { cell, .. } => self.name.clone_from(cell),
            Event::Device { device, plugin, state, message } => {
                let known = self.device(device);
                known.plugin.clone_from(plugin);
                known.state = *state;
                if let Some(message) = message {
                    known.message.clone_from(message);
                }
                if *state != DeviceState::Active {
                    known.moving = false;
                }
            }
            Event::Joints { device, time_ns, moving, joints } => {
                self.now_ns = self.now_ns.max(*time_ns);
                let known = self.device(device);
                known.joint_traces.resize(joints.len(), Trace::default());
                for (trace, joint) in known.joint_traces.iter_mut().zip(joints) {
                    trace.push(*time_ns, joint.value);
                }
                known.joints.clone_from(joints);
                known.joints_at_ns = *time_ns;
                known.moving = *moving;
            }
            Event::Signal { device, signal, on, time_ns } => self.take_signal(device, signal, *on, *time_ns),
            Event::TriggerFound { joints, .. } => {
                push_bounded(&mut self.triggers, joints.clone(), KEPT_TRIGGERS);
            }
            _ => {}
        }
    }

    /// Where the joints of a robot are, once it has said so.
    pub(crate) fn joints_of(&self, device: &str) -> Option<&[NamedValue]> {
        let device = self.devices.iter().find(|known| known.name == device && !known.joints.is_empty())?;
        Some(&device.joints)
    }

    /// The robot to draw: the first device with joints.
    pub(crate) fn robot(&self) -> Option<&Device> {
        self.devices.iter().find(|device| !device.joints.is_empty())
    }

    /// Whether any robot reports that it moves.
    pub(crate) fn is_moving(&self) -> bool {
        self.devices.iter().any(|device| device.moving)
    }

    fn take_signal(&mut self, device: &str, name: &str, on: bool, time_ns: u64) {
        self.now_ns = self.now_ns.max(time_ns);
        let signals = &mut self.device(device).signals;
        let level = f64::from(u8::from(on));
        match signals.iter_mut().find(|signal| signal.name == name) {
            Some(signal) if signal.on == on => return,
            Some(signal) => {
                signal.on = on;
                signal.trace.push(time_ns, level);
                signal.changes = signal.changes.saturating_add(1);
            }
            None => {
                let mut trace = Trace::default();
                trace.push(time_ns, level);
                signals.push(Signal { name: name.to_owned(), on, changes: 0, trace });
            }
        }
        let edge = Edge { device: device.to_owned(), signal: name.to_owned(), on, time_ns };
        push_bounded(&mut self.edges, edge, KEPT_EDGES);
    }

    fn device(&mut self, name: &str) -> &mut Device {
        let index = self.devices.iter().position(|device| device.name == name).unwrap_or_else(|| {
            self.devices.push(Device::named(name));
            self.devices.len() - 1
        });
        &mut self.devices[index]
    }
}

impl Device {
    fn named(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            plugin: String::new(),
            state: DeviceState::Unconfigured,
            message: String::new(),
            joints: Vec::new(),
            joint_traces: Vec::new(),
            moving: false,
            joints_at_ns: 0,
            signals: Vec::new(),
        }
    }
}

fn push_bounded<T>(list: &mut VecDeque<T>, item: T, bound: usize) {
    if list.len() >= bound {
        list.pop_front();
    }
    list.push_back(item);
}
