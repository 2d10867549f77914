//! The camera of a light stripe looks aside of where its rig file says.

use super::Unit;
use super::kind::Kind;
use super::rig_numbers::{RigParameter, build, candidates, kind};
use crate::arm_model::RigNumber;

const NUMBERS: [RigParameter; 2] =
    [("x_deg", Unit::DEG, 0.1, RigNumber::CameraAim(0)), ("y_deg", Unit::DEG, 0.1, RigNumber::CameraAim(1))];

pub(super) const KIND: Kind = kind(
    "camera_aim",
    "The camera of the light stripe looks aside of where its file says: it is turned about its own x or y.",
    "Stripes on surfaces at several heights, seen from many sides.",
    ["   ▭ camera", "   ╎╲ looks aside", "   ╎ ╲"],
    |setting| build(setting, &NUMBERS),
    |context| candidates("camera_aim", context),
);
