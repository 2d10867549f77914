//! Where something sits and how it is turned, in a world file.

use plumb_document::Spanned;
use serde::Deserialize;

use super::checker::Checker;
use crate::physics::rigid::{Rigid, Rotation, Vector};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPlaced {
    xyz_mm: Spanned<[f64; 3]>,
    #[serde(default)]
    rpy_deg: [f64; 3],
}

impl Checker<'_> {
    /// Where something sits and how it is turned.
    pub(super) fn placed(&self, what: &str, raw: &RawPlaced, farthest: f64) -> Rigid {
        if raw.xyz_mm.value.iter().any(|part| part.abs() > farthest) {
            let problem = format!("the {what} is too far away; three numbers, each within {farthest} mm");
            self.typed.wrong(raw.xyz_mm.span, &problem);
        }
        let rotation = Rotation::from_roll_pitch_yaw(raw.rpy_deg.map(f64::to_radians));
        Rigid { rotation, translation: Vector::from(raw.xyz_mm.value) }
    }
}
