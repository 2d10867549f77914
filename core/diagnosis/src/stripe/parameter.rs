//! What of a rig may be adjusted.

/// A number of the rig that an adjustment may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RigParameter {
    /// Direction of the principal ray: a turn of the camera about its own x or y (0, 1), rad.
    CameraAim(usize),
    /// Turn of the camera about its principal ray, rad.
    CameraRoll,
    /// Focal length across and down (0, 1), as a share of itself.
    CameraScale(usize),
    /// Where the principal ray falls (0 across, 1 down), px.
    PrincipalPoint(usize),
    /// Distortion of the lens: radial of the second (0) and fourth power (1).
    LensDistortion(usize),
    /// The sheet of light: its tilts about two axes in it (0, 1), rad, and its shift (2), mm.
    StripePlane(usize),
    /// How the sheet bends out of its plane: by this times the square of its extent, 1/mm.
    StripeBow,
    /// Shift of the whole rig on the flange along x, y, z (0, 1, 2), mm.
    HandEyeShift(usize),
    /// Turn of the whole rig on the flange about x, y, z (0, 1, 2), rad.
    HandEyeTurn(usize),
    /// How much later than its time says a picture was exposed, s.
    ClockSkew,
}

impl RigParameter {
    /// Where camera and light are, each once: the camera's attitude and place, and the sheet. With the last joint's zero beside them, their common
    /// turn about the flange's axis could not be told.
    pub const USUAL: [RigParameter; 9] = [
        Self::CameraAim(0),
        Self::CameraAim(1),
        Self::CameraRoll,
        Self::StripePlane(0),
        Self::StripePlane(1),
        Self::StripePlane(2),
        Self::HandEyeShift(0),
        Self::HandEyeShift(1),
        Self::HandEyeShift(2),
    ];

    /// As files and screens call it.
    pub fn name(self) -> String {
        let axis = |names: [&str; 3], place: usize| names.get(place).copied().unwrap_or("").to_owned();
        match self {
            Self::CameraAim(axis_) => format!("camera_aim({})", axis(["x", "y", ""], axis_)),
            Self::CameraRoll => "camera_roll".to_owned(),
            Self::CameraScale(axis_) => format!("camera_scale({})", axis(["u", "v", ""], axis_)),
            Self::PrincipalPoint(axis_) => format!("principal_point({})", axis(["u", "v", ""], axis_)),
            Self::LensDistortion(power) => format!("lens_distortion({})", axis(["k1", "k2", ""], power)),
            Self::StripePlane(which) => {
                format!("stripe_plane({})", axis(["tilt_1", "tilt_2", "shift"], which))
            }
            Self::StripeBow => "stripe_bow".to_owned(),
            Self::HandEyeShift(axis_) => format!("hand_eye({})", axis(["x", "y", "z"], axis_)),
            Self::HandEyeTurn(axis_) => format!("hand_eye({})", axis(["turn_x", "turn_y", "turn_z"], axis_)),
            Self::ClockSkew => "clock_skew".to_owned(),
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::CameraAim(_) | Self::CameraRoll | Self::HandEyeTurn(_) | Self::StripePlane(0 | 1) => "rad",
            Self::StripePlane(_) | Self::HandEyeShift(_) => "mm",
            Self::PrincipalPoint(_) => "px",
            Self::CameraScale(_) | Self::LensDistortion(_) => "",
            Self::StripeBow => "1/mm",
            Self::ClockSkew => "s",
        }
    }

    /// How much of it is worth about a tenth of a millimetre: the step of its derivative.
    pub(super) fn small(self) -> f64 {
        match self {
            Self::CameraScale(_) => 1e-4,
            Self::LensDistortion(_) => 1e-3,
            Self::PrincipalPoint(_) => 0.05,
            Self::StripePlane(2) | Self::HandEyeShift(_) => 0.02,
            Self::StripeBow => 1e-6,
            Self::ClockSkew => 1e-4,
            _ => 1e-4,
        }
    }
}
