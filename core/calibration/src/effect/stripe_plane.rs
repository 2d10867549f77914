//! The sheet of light of a light stripe leans or lies elsewhere than its rig file says.

use super::Unit;
use super::kind::Kind;
use super::rig_numbers::{RigParameter, build, candidates, kind};
use crate::arm_model::RigNumber;

const NUMBERS: [RigParameter; 3] = [
    ("tilt_1_deg", Unit::DEG, 0.1, RigNumber::StripePlane(0)),
    ("tilt_2_deg", Unit::DEG, 0.1, RigNumber::StripePlane(1)),
    ("shift_mm", Unit::MM, 20.0, RigNumber::StripePlane(2)),
];

pub(super) const KIND: Kind = kind(
    "stripe_plane",
    "The sheet of light leans or lies elsewhere than the file says.",
    "Stripes on surfaces at several heights, seen from many sides.",
    ["    ╎ ╱ the sheet of", "    ╎╱  light leans", "  ━━━━━━━━"],
    |setting| build(setting, &NUMBERS),
    |context| candidates("stripe_plane", context),
);
