//! From a pixel on the stripe to a point in the flange's frame.
//!
//! Frames: `flange` is the robot's mounting flange, `camera` has its origin in the lens, x to the right and y down in the picture and z along the
//! principal ray, `projector` has the light in its plane x = 0. Lengths are mm, pixels count from the middle of the first.

mod camera;
mod camera_file;
mod collineation;
mod corrected;
mod correction;
mod rig;
mod rig_file;
mod stripe_plane;

pub use camera::{Camera, Distortion};
pub use camera_file::{CameraFormat, read_camera, write_camera};
pub use collineation::{Collineation, CollineationError, NoPoint};
pub use correction::{CorrectionError, RigCorrections, SheetFrame};
pub use rig::Rig;
pub use rig_file::{RigFileError, read_rig, rig_schema, write_rig};
pub use stripe_plane::StripePlane;
