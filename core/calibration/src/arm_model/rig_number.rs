//! What of the rig of a light stripe may be other than its file says.
//!
//! Camera and sheet of light together map a pixel to a point of the sheet by a 4 x 3 matrix, the inverse of the camera's 3 x 4 collineation on the sheet's plane
//! (Agin 1985, section 4). Its entries follow from these numbers, which are what a machinist or an optician would measure.

/// A number of the rig that a fit may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RigNumber {
    /// Direction of the principal ray: a turn of the camera about its own x or y (0, 1), rad.
    CameraAim(usize),
    /// Turn of the camera about its principal ray, rad.
    CameraRoll,
    /// Focal length across and down (0, 1), as a fraction of itself.
    CameraScale(usize),
    /// Where the principal ray falls (0 across, 1 down), px.
    PrincipalPoint(usize),
    /// Distortion of the lens: radial of the second power.
    LensDistortion,
    /// The sheet of light: its tilts about two axes in it (0, 1), rad, and its shift (2), mm.
    StripePlane(usize),
    /// How the sheet bends out of its plane: by this times the square of its extent, 1/mm.
    StripeBow,
    /// Shift of the whole rig on the flange along x, y, z (0, 1, 2), mm.
    HandEye(usize),
}

impl RigNumber {
    /// All of them, in the order in which they are applied.
    pub const ALL: [Self; 15] = [
        Self::HandEye(0),
        Self::HandEye(1),
        Self::HandEye(2),
        Self::CameraAim(0),
        Self::CameraAim(1),
        Self::CameraRoll,
        Self::CameraScale(0),
        Self::CameraScale(1),
        Self::PrincipalPoint(0),
        Self::PrincipalPoint(1),
        Self::LensDistortion,
        Self::StripePlane(0),
        Self::StripePlane(1),
        Self::StripePlane(2),
        Self::StripeBow,
    ];

    /// Its index among all of them.
    pub(crate) fn index(self) -> usize {
        Self::ALL.iter().position(|known| *known == self).unwrap_or(0)
    }

    /// How much of it is worth about a hundredth of a millimetre: the step of its derivative.
    pub(crate) fn small(self) -> f64 {
        match self {
            Self::LensDistortion => 1e-3,
            Self::PrincipalPoint(_) => 0.05,
            Self::StripePlane(2) | Self::HandEye(_) => 0.02,
            Self::StripeBow => 1e-6,
            Self::CameraAim(_) | Self::CameraRoll | Self::CameraScale(_) | Self::StripePlane(_) => 1e-4,
        }
    }
}
