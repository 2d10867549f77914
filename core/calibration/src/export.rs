//! A calibrated model in the forms of other programs: the arm as rigid links between joints, which is what a URDF, a table of Denavit-Hartenberg
//! rows or a ROS driver's calibration can hold. What they cannot hold is listed.

mod axis_scale;
mod compensation;
mod dh_table;
mod rigid_arm;
mod ros_calibration;
mod targets;
mod urdf;

pub use axis_scale::{AxisScale, axis_scale, fluidnc};
pub use compensation::{Compensation, CompensationError, MOST_LINES, compensation, linuxcnc};
pub use dh_table::dh_table;
pub use rigid_arm::{ExportError, RigidArm, RigidJoint};
pub use ros_calibration::ros_calibration;
pub use targets::{CompensatedTarget, TargetsError, compensated_targets};
pub use urdf::urdf;

#[cfg(test)]
mod tests;
