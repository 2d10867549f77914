//! Quantities of corrections: what about a device a correction changes.

/// Quantity of a zero that the program keeps: what is added to a joint as its drive reports it.
pub const JOINT_ZERO: &str = "joint_zero";

/// Quantity of a zero that the controller itself keeps. The record knows what it was, but cannot change it: the arm has to be brought to
/// the pose again.
pub const CONTROLLER_ZERO: &str = "controller_zero";

/// Quantity of a parameter of a sensor.
pub const SENSOR_PARAMETER: &str = "sensor_parameter";
