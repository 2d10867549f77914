//! What every robot and every sensor must do, as checks a plugin's author runs in a test of their own.
//!
//! Each check gets a fresh device. [`check_robot`] and [`check_sensor`] run them on a device in the test's own process, over a
//! [`RecordingHost`](crate::recording::RecordingHost); the same robot checks run on a device behind a host process through [`RobotBench`].
//!
//! A robot is moved by small amounts towards the middle of its range, and once for two seconds: keep clear of a real one.

mod in_process;
mod outcome;
mod robot;
mod sensor;
mod times;

pub use in_process::{check_robot, check_sensor};
pub use outcome::{CheckOutcome, CheckReport};
pub use robot::{Interruption, ROBOT_CHECKS, RobotBench, RobotCheck, not_run, run_robot_check};
pub use sensor::{KNOWN_UNITS, SENSOR_CHECKS, SensorBench, SensorCheck};
pub use times::CALL_WITHIN;
