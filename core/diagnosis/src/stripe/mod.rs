//! The light stripe in the lab: stripes on surfaces whose form is known and whose place is not become rows of a table, and what they lack is asked as of any other.
//!
//! No instrument measures anything here. That all points of a table lie in one plane, those of a ball on one ball and those of a pyramid on its
//! faces, whatever the direction they were seen from, is the measurement (Agin 1985 had planes at known heights, and no adjustment). What such
//! constraints cannot determine is said: a turn of everything about the first joint moves every surface alike, and the last joint's zero is the same as a turn
//! of the rig about the flange's axis.

mod adjust;
mod assign;
mod prepare;
mod scene;
mod surface;
mod table;
#[cfg(test)]
mod tests;

pub use adjust::{AdjustError, Adjustment, Found, StripeScene, adjust};
pub use scene::{SceneError, read_scene, scene_schema};
pub use surface::Surface;
pub use table::{Scans, ScansError, StripePixel, View};
