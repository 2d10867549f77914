//! The range of a robot's joint, as the robot itself has it.

/// How far one joint of a robot goes.
#[derive(Debug, Clone, PartialEq)]
pub struct JointRange {
    /// The robot.
    pub device: String,
    /// The joint, as the robot names it.
    pub joint: String,
    /// The lowest it may go, as its drive counts, rad or mm.
    pub least: f64,
    /// The highest it may go, as its drive counts, rad or mm.
    pub most: f64,
}
