//! A camera and a sheet of light on the flange of an arm, and the surfaces they see.
//!
//! A picture is made from the light's side: rays go out in the sheet, as thick and as bowed as it is, fall on the surfaces ([`surface`]), and what of
//! them the lens sees (`camera`) is laid into the picture as bright as slope, reflectance and distance leave it. Then come speckle, the room's light,
//! noise, and the end of the scale. It shares no code with the sensor that looks for the stripe.

mod camera;
pub mod file;
mod picture;
mod projector;
pub mod surface;

pub use camera::Camera;
pub use picture::Picture;
pub use projector::Projector;

use crate::physics::rigid::Rigid;
use surface::Surface;

/// The light in the room, grey levels over a perfect white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ambient {
    /// Without the filter before the lens.
    pub open: f64,
    /// With it: what passes is infrared, which fluorescent lamps hardly have and incandescent ones have too much of.
    pub filtered: f64,
}

/// What can be switched by hand or wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Switches {
    /// Whether the laser shines.
    pub laser: bool,
    /// Whether the infrared filter is before the lens.
    pub filter: bool,
}

/// A camera and a sheet of light over surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// From which noise and speckle are drawn.
    pub seed: u64,
    /// The camera.
    pub camera: Camera,
    /// The projector.
    pub projector: Projector,
    /// The room.
    pub ambient: Ambient,
    /// As they are at the beginning.
    pub switches: Switches,
    /// How much later than its time says a picture is exposed, ns; negative for earlier.
    pub exposure_delay_ns: i64,
    /// What there is to see, in the world's frame.
    pub surfaces: Vec<Surface>,
}

impl Light {
    /// The picture taken with the flange there. `number` distinguishes this exposure from others: each has its own noise.
    pub fn picture(&self, world_from_flange: &Rigid, switches: Switches, number: u64) -> Picture {
        picture::take(self, world_from_flange, switches, number)
    }
}
