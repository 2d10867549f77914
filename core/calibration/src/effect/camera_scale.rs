//! The focal lengths of a light stripe's camera are other than its rig file says.

use super::Unit;
use super::kind::Kind;
use super::rig_numbers::{RigParameter, build, candidates, kind};
use crate::arm_model::RigNumber;

const NUMBERS: [RigParameter; 2] = [
    ("across", Unit::RATIO, 0.2, RigNumber::CameraScale(0)),
    ("down", Unit::RATIO, 0.2, RigNumber::CameraScale(1)),
];

pub(super) const KIND: Kind = kind(
    "camera_scale",
    "The camera's focal lengths, in pixels, are other than its file says.",
    "Stripes on a body of known size, near and far, and in all corners of the picture.",
    ["      ▭", "    ╱╱ ╲╲ wider or", "   ╱╱   ╲╲ narrower"],
    |setting| build(setting, &NUMBERS),
    |context| candidates("camera_scale", context),
);
