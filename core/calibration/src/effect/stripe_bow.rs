//! The sheet of light of a light stripe bends out of its plane.

use super::Unit;
use super::kind::Kind;
use super::rig_numbers::{RigParameter, build, candidates, kind};
use crate::arm_model::RigNumber;

const NUMBERS: [RigParameter; 1] = [("bow", Unit::PER_MM, 0.002, RigNumber::StripeBow)];

pub(super) const KIND: Kind = kind(
    "stripe_bow",
    "The sheet of light is no plane: it bends out of it by the square of its extent.",
    "Long stripes on a plane, in the middle of the picture and at its edges.",
    ["    ╎ ╲", "    ╎  │ the sheet bends", "    ╎ ╱"],
    |setting| build(setting, &NUMBERS),
    |context| candidates("stripe_bow", context),
);
