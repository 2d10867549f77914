//! The principal ray of a light stripe's camera falls on another pixel than its rig file says.

use super::Unit;
use super::kind::Kind;
use super::rig_numbers::{RigParameter, build, candidates, kind};
use crate::arm_model::RigNumber;

const NUMBERS: [RigParameter; 2] = [
    ("across_px", Unit::PX, 50.0, RigNumber::PrincipalPoint(0)),
    ("down_px", Unit::PX, 50.0, RigNumber::PrincipalPoint(1)),
];

pub(super) const KIND: Kind = kind(
    "principal_point",
    "The ray through the middle of the lens falls on another pixel than the file says.",
    "Stripes near and far, and in all corners of the picture.",
    ["   ┌────┐", "   │ +• │ its middle", "   └────┘ lies beside"],
    |setting| build(setting, &NUMBERS),
    |context| candidates("principal_point", context),
);
