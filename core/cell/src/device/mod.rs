//! Devices as the engine uses them. Behind these traits are host processes; in tests, an arm in memory.

mod cell_resources;
pub(crate) mod configuration;
mod hosted;
mod input_lines;
mod joint_ranges;
mod kept;
mod stream_link;
#[cfg(test)]
mod test_cell;
mod watcher;
mod wiring;

use std::time::Duration;

pub use cell_resources::{CellResources, Occupancy, Remains};
pub use configuration::config_mistakes;
pub use hosted::{HostedDevices, World, hashed, plugin_files};
pub use input_lines::InputLines;
pub use joint_ranges::joint_ranges;
pub(crate) use joint_ranges::own_limits;
pub use kept::KeptDevices;
pub use plumb_host::{DeviceError, StartError};
pub use stream_link::StreamLink;
pub use watcher::PoseListener;
pub(crate) use wiring::check_plugins;

use plumb_plugin::{
    JogState, JointState, JointVector, Motion, MotorState, PluginError, Reading, RobotDescription,
    SensorDescription, StripeHeader, StripePoint, Value,
};

use crate::event::LogLevel;
pub use crate::joint_range::JointRange;
use crate::run_handle::StopAction;
use crate::workcell::DeviceSetting;

/// A robot that can be reached. Calls block; a stop comes by [`RobotLink::stop_action`] from another thread.
pub trait RobotLink: Send {
    /// What it says about itself.
    fn description(&self) -> &RobotDescription;
    /// Lets it move; clears an earlier stop.
    ///
    /// # Errors
    /// [`DeviceError`]
    fn activate(&mut self) -> Result<(), DeviceError>;
    /// Brings it to rest so that it may be left alone.
    ///
    /// # Errors
    /// [`DeviceError`]
    fn deactivate(&mut self) -> Result<(), DeviceError>;
    /// Where its drive says it is.
    ///
    /// # Errors
    /// [`DeviceError`]
    fn read_joints(&mut self) -> Result<JointState, DeviceError>;
    /// Moves; returns when it is at rest. `limit` bounds the wait.
    ///
    /// # Errors
    /// [`DeviceError`]; one for which [`DeviceError::is_stop`] holds when a stop ended the move, with the robot at rest.
    fn move_joints(&mut self, motion: &Motion, limit: Duration) -> Result<JointState, DeviceError>;
    /// Hands it to its pendant or takes it back, and reports where it is.
    ///
    /// # Errors
    /// [`DeviceError`]
    fn jog(&mut self, on: bool) -> Result<JogState, DeviceError>;
    /// Has its controller take where it is for these joint values from now on.
    ///
    /// # Errors
    /// [`DeviceError`]
    fn set_zero(&mut self, _joints: &JointVector) -> Result<(), DeviceError> {
        let error = PluginError::Unsupported("its zeros cannot be set".to_owned());
        Err(DeviceError::refused(&self.description().model, "set zero", error))
    }
    /// What its motors report of themselves.
    ///
    /// # Errors
    /// [`DeviceError`]
    fn read_motors(&mut self) -> Result<MotorState, DeviceError> {
        let error = PluginError::unsupported("read its motors");
        Err(DeviceError::refused(&self.description().model, "read motors", error))
    }
    /// Stops it at once, from any thread, although a call is in progress.
    fn stop_action(&self) -> StopAction;
    /// Informs the listener where it is while it moves, as long as this link lives. A link that cannot says nothing.
    fn watch(&mut self, _listener: PoseListener) {}
}

/// A sensor that can be reached.
pub trait SensorLink: Send {
    /// What it says about itself.
    fn description(&self) -> &SensorDescription;
    /// Lets it work.
    ///
    /// # Errors
    /// [`DeviceError`]
    fn activate(&mut self) -> Result<(), DeviceError>;
    /// Forgets what was seen and watches from now on.
    ///
    /// # Errors
    /// [`DeviceError`]
    fn arm(&mut self) -> Result<(), DeviceError>;
    /// What has been seen since the last reading, up to `after_ns` of the cell's clock at least.
    ///
    /// # Errors
    /// [`DeviceError`]
    fn read(&mut self, after_ns: u64) -> Result<Reading, DeviceError>;
    /// Changes settings: only the keys that change.
    ///
    /// # Errors
    /// [`DeviceError`]
    fn configure(&mut self, _settings: &Value) -> Result<(), DeviceError> {
        let error = PluginError::unsupported("be configured while it runs");
        Err(DeviceError::refused(&self.description().model, "configure", error))
    }
    /// The stripes a light stripe sensor has emitted since this was asked last; none of another sensor.
    ///
    /// # Errors
    /// [`DeviceError`] when some were lost.
    fn stripes(&mut self) -> Result<Vec<Stripe>, DeviceError> {
        Ok(Vec::new())
    }
}

/// A light stripe: what is known of it as a whole, and its points.
pub type Stripe = (StripeHeader, Vec<StripePoint>);

/// A device that was connected.
pub enum Link {
    /// It moves.
    Robot(Box<dyn RobotLink>),
    /// It measures.
    Sensor(Box<dyn SensorLink>),
}

/// A line a device or its host had to say.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceLog {
    /// The device.
    pub device: String,
    /// How severe.
    pub level: LogLevel,
    /// The line.
    pub message: String,
}

/// A device whose process ended unasked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LostDevice {
    /// The device.
    pub device: String,
    /// How its process ended.
    pub message: String,
}

/// What the operator of a simulated cell does.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Act {
    /// Its name: what there is, the world knows.
    pub name: String,
    /// Its numbers.
    pub numbers: Vec<(String, f64)>,
    /// Its words: where an instrument lies, which joint is driven, whether the instrument is `turned`.
    pub words: Vec<(String, String)>,
}

/// Starts the devices of a cell, and starts them again.
pub trait DeviceLinks: Send {
    /// Begins to start several devices at once, each with its check of moves as in [`DeviceLinks::connect`], which is asked for each of them afterwards
    /// and reports how that went.
    fn prepare(&mut self, _devices: &[(&DeviceSetting, Value)]) {}

    /// Starts a device, or starts it again, in place of what was there under its name. It does not move. `guard` is what its host makes a
    /// check of moves from ([`crate::workcell::guard`]); null for none.
    ///
    /// # Errors
    /// [`DeviceError::Start`]
    fn connect(&mut self, device: &DeviceSetting, guard: Value) -> Result<Link, DeviceError>;

    /// A device whose process ended unasked; each is reported once. Every robot has been commanded to stop when that happened.
    fn lost(&mut self) -> Option<LostDevice> {
        None
    }

    /// What the devices and their hosts have had to say since this was asked last.
    fn log_lines(&mut self) -> Vec<DeviceLog> {
        Vec::new()
    }

    /// Does in a simulated world what an operator would do in a real one, and reports what an instrument reads, for an act that reads one.
    /// Nothing in a cell that is not simulated: there people do it.
    ///
    /// # Errors
    /// A sentence that says why it cannot be done, and what would be right.
    fn simulate(&mut self, _act: &Act) -> Result<Option<f64>, String> {
        Ok(None)
    }

    /// Opens a stream of a device that was connected.
    ///
    /// # Errors
    /// [`DeviceError`], also for a stream that the device does not emit.
    fn listen(&mut self, device: &str, _stream: &str) -> Result<Box<dyn StreamLink>, DeviceError> {
        Err(DeviceError::refused(device, "listen", PluginError::unsupported("be listened to")))
    }

    /// The cell's clock now, ns, where this program can read it: `CLOCK_MONOTONIC`, unless a simulated world keeps a clock of its own.
    fn clock_ns(&self) -> Option<u64> {
        None
    }

    /// Whether the robots are in a simulated world that was started for this run: where a world of before left them says nothing, and each new one
    /// counts from the same place.
    fn is_new_world(&self) -> bool {
        false
    }

    /// Where the simulated world of the cell can be reached, for the record.
    fn world_socket(&self) -> Option<String>;

    /// Shuts everything down in good order. With `keep_world` the simulated world lives on, so that the run can be resumed in it.
    fn shut_down(&mut self, keep_world: bool);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Devices of which no more is known than that there are none.
    struct NoDevices;

    impl DeviceLinks for NoDevices {
        fn connect(&mut self, device: &DeviceSetting, _guard: Value) -> Result<Link, DeviceError> {
            Err(DeviceError::refused(&device.name, "connect", PluginError::unsupported("be connected")))
        }

        fn world_socket(&self) -> Option<String> {
            None
        }

        fn shut_down(&mut self, _keep_world: bool) {}
    }

    #[test]
    fn where_nothing_is_known_of_a_clock_no_time_is_given() {
        let mut devices = NoDevices;
        assert_eq!((devices.clock_ns(), devices.is_new_world()), (None, false));
        assert_eq!((devices.lost(), devices.log_lines()), (None, Vec::new()));
        assert!(devices.listen("arm", "joints").is_err());
    }
}
