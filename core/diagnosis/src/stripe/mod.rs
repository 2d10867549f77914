//! The light stripe in the lab: one adjustment of rig, joints and effects from stripes on surfaces whose form is known and whose place is not.
//!
//! No instrument measures anything here. That all points of a table lie in one plane, those of a ball on one ball and those of a pyramid on its
//! faces, whatever the direction they were seen from, is the measurement (Agin 1985 had planes at known heights, and no adjustment). What such
//! constraints cannot tell is said: a turn of everything about the first joint moves every surface alike, and the last joint's zero is the same as a turn
//! of the rig about the flange's axis.

mod adjust;
mod diagnose;
mod options;
mod parameter;
mod problem;
mod rig;
mod scene;
mod spread;
mod surface;
mod suspect;
mod table;
#[cfg(test)]
mod tests;
mod view_residuals;

pub use adjust::{Adjustment, Found, adjust};
pub use diagnose::{StripeDiagnosis, StripeVerdict, Tried, diagnose, resolved, with_added};
pub use options::{AdjustError, Options};
pub use parameter::RigParameter;
pub use rig::StripeRig;
pub use scene::{SceneError, read_scene, scene_schema};
pub use surface::Surface;
pub use suspect::{Suspect, classical, suspect, suspect_of, suspects};
pub use table::{Scans, ScansError};
pub use view_residuals::ViewResidual;

/// One picture: where the arm was told to be.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Commanded joints, rad or mm.
    pub q: Vec<f64>,
    /// How fast they were at the exposure, rad/s or mm/s; empty at rest.
    pub speed: Vec<f64>,
    /// Side each joint arrived from, -1, 0 or 1; empty where not known.
    pub approach: Vec<i8>,
}

/// One point of a stripe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StripePixel {
    /// The view it is of.
    pub view: usize,
    /// Column, pixels.
    pub u_px: f64,
    /// Row, pixels.
    pub v_px: f64,
    /// The column's standard uncertainty, pixels.
    pub sigma_px: f64,
}
