//! What every robot and every sensor must do, as checks a plugin's author runs in a test of their own.
//!
//! Each check gets a fresh device. [`check_robot`] and [`check_sensor`] run them on a device in the test's own process, over a
//! [`RecordingHost`](crate::recording::RecordingHost); the same robot checks run on a device behind a host process through [`RobotBench`].
//!
//! A robot is moved by small amounts towards the middle of its range, and once for two seconds: keep clear of a real one.

mod in_process;
mod lesson;
mod lists;
mod names;
mod outcome;
mod robot;
mod sensor;
mod times;

pub use in_process::{check_robot, check_sensor, manifest_is_good};
pub use lesson::{Lesson, lesson};
pub use lists::{LISTS, check_quantities, check_robot_lists};
pub use outcome::{CheckOutcome, CheckReport, row_in_words};
pub use robot::{
    Interruption, ROBOT_CHECKS, RobotBench, RobotCheck, leaves_at_rest, not_run, run_robot_check,
};
pub use sensor::{KNOWN_UNITS, SENSOR_CHECKS, SensorBench, SensorCheck};
pub use times::CALL_WITHIN;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_check_has_a_lesson() {
        let names =
            ROBOT_CHECKS.iter().map(|(name, _)| name).chain(SENSOR_CHECKS.iter().map(|(name, _)| name));
        let without: Vec<_> = names.filter(|name| lesson(name).is_none()).collect();
        assert!(without.is_empty(), "{without:?}");
    }
}
