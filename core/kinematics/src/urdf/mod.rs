//! Arms from URDF files: the joints from the root to one tip, turned into distal Denavit-Hartenberg rows.
//!
//! URDF is in metres and radians; everything here is in mm and rad. Whatever cannot be an arm of this kind is refused with the element and its line.

mod error;
mod read;
mod rows;

pub use error::UrdfError;

use nalgebra::IsometryMatrix3;

use crate::chain::Chain;
use crate::gravity::Mass;

/// An arm as a URDF file has it.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfArm {
    /// The robot's name.
    pub name: String,
    /// The link the arm is on, and the one at its end.
    pub ends: (String, String),
    /// Distal rows, one a moving joint; at coordinates zero the arm is as the file has it at zero.
    pub chain: Chain,
    /// Pose of the first row's base in the root link's frame, mm.
    pub root_from_base: IsometryMatrix3<f64>,
    /// Pose of the tip's frame in the flange's (the end of the last row), mm.
    pub flange_from_tip: IsometryMatrix3<f64>,
    /// Masses that move, in the frames of the rows.
    pub masses: Vec<Mass>,
    /// What is worth knowing: joints and links that were left aside.
    pub notes: Vec<String>,
}

impl UrdfArm {
    /// Reads the arm from the root to `tip`; without a tip, to the end of the branch that has most moving joints.
    ///
    /// # Errors
    /// [`UrdfError`], naming the element and its line.
    pub fn parse(text: &str, tip: Option<&str>) -> Result<Self, UrdfError> {
        rows::arm(&read::robot(text)?, tip)
    }
}
