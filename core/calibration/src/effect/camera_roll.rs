//! The camera of a light stripe is turned about its principal ray.

use super::Unit;
use super::kind::Kind;
use super::rig_numbers::{RigParameter, build, candidates, kind};
use crate::arm_model::RigNumber;

const NUMBERS: [RigParameter; 1] = [("roll_deg", Unit::DEG, 0.1, RigNumber::CameraRoll)];

pub(super) const KIND: Kind = kind(
    "camera_roll",
    "The camera of the light stripe is turned about the ray through the middle of its picture.",
    "Stripes that run across the whole picture, seen from many sides.",
    ["   ┌────┐", "   │ ↻  │ the picture", "   └────┘ is turned"],
    |setting| build(setting, &NUMBERS),
    |context| candidates("camera_roll", context),
);
