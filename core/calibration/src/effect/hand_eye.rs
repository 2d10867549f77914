//! The rig of a light stripe, camera and projector together, sits elsewhere on the flange than its rig file says.

use super::Unit;
use super::kind::Kind;
use super::rig_numbers::{RigParameter, build, candidates, kind};
use crate::arm_model::RigNumber;

const NUMBERS: [RigParameter; 3] = [
    ("x_mm", Unit::MM, 30.0, RigNumber::HandEye(0)),
    ("y_mm", Unit::MM, 30.0, RigNumber::HandEye(1)),
    ("z_mm", Unit::MM, 30.0, RigNumber::HandEye(2)),
];

pub(super) const KIND: Kind = kind(
    "hand_eye",
    "The whole rig of the light stripe sits elsewhere on the flange than its file says.",
    "One body seen with the hand turned into many directions.",
    ["  ━━━┓ flange", "     ╎ ←→", "     ╵  ▭ camera, light"],
    |setting| build(setting, &NUMBERS),
    |context| candidates("hand_eye", context),
);
