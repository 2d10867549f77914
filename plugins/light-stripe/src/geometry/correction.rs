//! Corrections of a rig: by how much its camera and its sheet of light differ from the numbers of the rig file (Agin 1985, section 4).

use nalgebra::{Point3, Unit, Vector3};
use serde::{Deserialize, Serialize};

/// A turn of more than this is a mistake, not a correction, deg: the camera would see another scene.
const MOST_DEG: f64 = 30.0;

/// A scale beyond this factor, or below its inverse, belongs to another lens.
const MOST_SCALE: f64 = 2.0;

/// A sheet shifted by more than this is another projector's, mm: the shipped rig has 95 mm between lens and sheet.
const MOST_OFFSET_MM: f64 = 100.0;

/// What calibrations found of a rig, relative to its file. All of them at their defaults leave the file's numbers as they are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RigCorrections {
    /// The camera turned about the flange's x axis, deg.
    pub camera_aim_x_deg: f64,
    /// The camera turned about the flange's y axis, deg; this turn comes first.
    pub camera_aim_y_deg: f64,
    /// The camera turned about its principal ray, deg.
    pub camera_roll_deg: f64,
    /// Factor of the focal length in pixel widths.
    pub camera_scale_u: f64,
    /// Factor of the focal length in pixel heights.
    pub camera_scale_v: f64,
    /// The sheet turned about the stripe's direction, deg.
    pub sheet_tilt_deg: f64,
    /// The sheet turned about the direction in it that is square to the stripe, deg.
    pub sheet_turn_deg: f64,
    /// The sheet moved along its normal, where the principal ray meets it, mm.
    pub sheet_offset_mm: f64,
}

impl Default for RigCorrections {
    fn default() -> Self {
        Self {
            camera_aim_x_deg: 0.0,
            camera_aim_y_deg: 0.0,
            camera_roll_deg: 0.0,
            camera_scale_u: 1.0,
            camera_scale_v: 1.0,
            sheet_tilt_deg: 0.0,
            sheet_turn_deg: 0.0,
            sheet_offset_mm: 0.0,
        }
    }
}

/// Why a rig cannot be corrected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CorrectionError {
    /// A number that no calibration finds.
    #[error("correction `{name}` is {value}; it lies between {least} and {most}")]
    Implausible {
        /// Which.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The least it may be.
        least: f64,
        /// The most it may be.
        most: f64,
    },
    /// The sheet has no point that its corrections could be measured from.
    #[error(
        "the camera's principal ray does not meet the sheet of light: the corrections sheet_tilt, sheet_turn and sheet_offset have no meaning for this rig"
    )]
    NoMiddle,
}

/// The frame in which corrections of a sheet are expressed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheetFrame {
    /// Where the camera's principal ray meets the sheet, mm in the flange's frame.
    pub middle: Point3<f64>,
    /// Along the stripe, as the camera looks down it; of length one.
    pub along: Unit<Vector3<f64>>,
    /// In the sheet and square to the stripe: normal x along.
    pub across: Unit<Vector3<f64>>,
}

impl RigCorrections {
    pub(super) fn is_of_sheet(&self) -> bool {
        [self.sheet_tilt_deg, self.sheet_turn_deg, self.sheet_offset_mm].iter().any(|value| *value != 0.0)
    }

    /// Whether they leave the file's numbers as they are.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    pub(super) fn check(&self) -> Result<(), CorrectionError> {
        let turn = (-MOST_DEG, MOST_DEG);
        let scale = (1.0 / MOST_SCALE, MOST_SCALE);
        let named = [
            ("camera_aim_x_deg", self.camera_aim_x_deg, turn),
            ("camera_aim_y_deg", self.camera_aim_y_deg, turn),
            ("camera_roll_deg", self.camera_roll_deg, turn),
            ("camera_scale_u", self.camera_scale_u, scale),
            ("camera_scale_v", self.camera_scale_v, scale),
            ("sheet_tilt_deg", self.sheet_tilt_deg, turn),
            ("sheet_turn_deg", self.sheet_turn_deg, turn),
            ("sheet_offset_mm", self.sheet_offset_mm, (-MOST_OFFSET_MM, MOST_OFFSET_MM)),
        ];
        for (name, value, (least, most)) in named {
            if !(least..=most).contains(&value) {
                return Err(CorrectionError::Implausible { name, value, least, most });
            }
        }
        Ok(())
    }

    /// What is still to be done to a rig whose numbers contain `contained`.
    pub(super) fn beyond(&self, contained: &Self) -> Self {
        Self {
            camera_aim_x_deg: self.camera_aim_x_deg - contained.camera_aim_x_deg,
            camera_aim_y_deg: self.camera_aim_y_deg - contained.camera_aim_y_deg,
            camera_roll_deg: self.camera_roll_deg - contained.camera_roll_deg,
            camera_scale_u: self.camera_scale_u / contained.camera_scale_u,
            camera_scale_v: self.camera_scale_v / contained.camera_scale_v,
            sheet_tilt_deg: self.sheet_tilt_deg - contained.sheet_tilt_deg,
            sheet_turn_deg: self.sheet_turn_deg - contained.sheet_turn_deg,
            sheet_offset_mm: self.sheet_offset_mm - contained.sheet_offset_mm,
        }
    }
}
