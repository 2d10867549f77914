//! The lens of a light stripe's camera bends straight lines (Brown 1971, the radial term of second power).

use super::Unit;
use super::kind::Kind;
use super::rig_numbers::{RigParameter, build, candidates, kind};
use crate::arm_model::RigNumber;

const NUMBERS: [RigParameter; 1] = [("k1", Unit::RATIO, 1.5, RigNumber::LensDistortion)];

pub(super) const KIND: Kind = kind(
    "lens_distortion",
    "The camera's lens bends straight lines more or less than its file says.",
    "Stripes in the corners of the picture as well as in its middle.",
    ["   ╭────╮ straight", "   │    │ lines bend", "   ╰────╯"],
    |setting| build(setting, &NUMBERS),
    |context| candidates("lens_distortion", context),
);
