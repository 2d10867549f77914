//! Corrections of a rig: by how much its camera and its sheet of light differ from the numbers of the rig file (Agin 1985, section 4).

use nalgebra::{Point3, Rotation3, Unit, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::{Rig, StripePlane};

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
    fn is_of_sheet(&self) -> bool {
        [self.sheet_tilt_deg, self.sheet_turn_deg, self.sheet_offset_mm].iter().any(|value| *value != 0.0)
    }

    /// Whether they leave the file's numbers as they are.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    fn check(&self) -> Result<(), CorrectionError> {
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
    fn beyond(&self, contained: &Self) -> Self {
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

impl Rig {
    /// The frame in which corrections of the sheet are expressed; none where the principal ray does not meet the sheet.
    pub fn sheet_frame(&self) -> Option<SheetFrame> {
        let principal = Vector2::new(self.camera.cx_px, self.camera.cy_px);
        let middle = self.collineation().ok()?.point(principal).ok()?;
        let normal = self.plane.normal;
        let down = self.flange_from_camera.rotation * Vector3::y();
        let along = Unit::try_new(down - normal * normal.dot(&down), 1e-6)?;
        let across = Unit::try_new(normal.cross(&along), 1e-6)?;
        Some(SheetFrame { middle, along, across })
    }

    /// The rig with these corrections of its file's numbers, in place of those it contains.
    ///
    /// # Errors
    /// [`CorrectionError`]
    pub fn corrected(&self, corrections: &RigCorrections) -> Result<Self, CorrectionError> {
        corrections.check()?;
        let change = corrections.beyond(&self.contains);
        let mut rig = if change.is_of_sheet() { self.with_sheet_moved(&change)? } else { self.clone() };
        rig.camera.fx_px *= change.camera_scale_u;
        rig.camera.fy_px *= change.camera_scale_v;
        let aim = [change.camera_aim_x_deg, change.camera_aim_y_deg].map(f64::to_radians);
        let mut rig = rig.aimed(aim[0], aim[1]).rolled(change.camera_roll_deg.to_radians());
        rig.contains = *corrections;
        Ok(rig)
    }

    fn with_sheet_moved(&self, change: &RigCorrections) -> Result<Self, CorrectionError> {
        let frame = self.sheet_frame().ok_or(CorrectionError::NoMiddle)?;
        let turn = frame.along.into_inner() * change.sheet_tilt_deg.to_radians()
            + frame.across.into_inner() * change.sheet_turn_deg.to_radians();
        let normal = Rotation3::new(turn) * self.plane.normal;
        let d_mm = -normal.dot(&frame.middle.coords) - change.sheet_offset_mm;
        let mut rig = self.clone();
        rig.plane = StripePlane { normal, d_mm };
        Ok(rig)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};

    use super::*;
    use crate::geometry::Camera;

    fn rig() -> Rig {
        Rig {
            name: "Agin's".to_owned(),
            camera: Camera {
                width_px: 256,
                height_px: 256,
                fx_px: 694.4,
                fy_px: 694.4,
                cx_px: 127.5,
                cy_px: 127.5,
                distortion: Default::default(),
            },
            flange_from_camera: Isometry3::from_parts(
                Translation3::new(-30.0, 0.0, 60.0),
                UnitQuaternion::identity(),
            ),
            plane: StripePlane::new(Vector3::new(3.0, 0.0, 1.0), -270.0).unwrap(),
            bow_per_mm: 0.0,
            contains: RigCorrections::default(),
        }
    }

    fn all() -> RigCorrections {
        RigCorrections {
            camera_aim_x_deg: 0.4,
            camera_aim_y_deg: -0.3,
            camera_roll_deg: 0.5,
            camera_scale_u: 1.02,
            camera_scale_v: 0.985,
            sheet_tilt_deg: 0.33,
            sheet_turn_deg: -0.2,
            sheet_offset_mm: 1.5,
        }
    }

    #[test]
    fn no_correction_leaves_the_rig_as_it_is() {
        assert_eq!(rig().corrected(&RigCorrections::default()).unwrap(), rig());
    }

    #[test]
    fn corrections_a_rig_contains_are_not_made_twice() {
        let once = rig().corrected(&all()).unwrap();
        assert_eq!(once.corrected(&all()).unwrap(), once);
        assert_ne!(once.plane, rig().plane);
    }

    #[test]
    fn what_a_correction_changed_is_taken_back_by_the_defaults() {
        let back = rig().corrected(&all()).unwrap().corrected(&RigCorrections::default()).unwrap();
        assert!((back.plane.normal - rig().plane.normal).norm() < 1e-4, "{back:?}");
        assert!((back.flange_from_camera.rotation.angle_to(&rig().flange_from_camera.rotation)) < 1e-4);
        assert!((back.camera.fx_px - 694.4).abs() < 1e-9 && (back.camera.fy_px - 694.4).abs() < 1e-9);
    }

    #[test]
    fn the_sheet_turns_about_where_the_principal_ray_meets_it_and_moves_along_its_normal() {
        let frame = rig().sheet_frame().unwrap();
        assert!((frame.middle - Point3::new(-30.0, 0.0, 360.0)).norm() < 1e-9, "{frame:?}");
        assert!((frame.along.into_inner() - Vector3::y()).norm() < 1e-12);
        let only = RigCorrections { sheet_tilt_deg: 1.0, sheet_turn_deg: 2.0, ..Default::default() };
        let turned = rig().corrected(&only).unwrap();
        assert!((turned.plane.normal.dot(&frame.middle.coords) + turned.plane.d_mm).abs() < 1e-9);
        assert!((turned.plane.normal.angle(&rig().plane.normal).to_degrees() - 5.0_f64.sqrt()).abs() < 1e-9);
        let only = RigCorrections { sheet_offset_mm: 2.0, ..Default::default() };
        let moved = rig().corrected(&only).unwrap();
        let new_middle = frame.middle + rig().plane.normal * 2.0;
        assert!((moved.plane.normal.dot(&new_middle.coords) + moved.plane.d_mm).abs() < 1e-9);
    }

    #[test]
    fn implausible_corrections_are_refused_by_name() {
        let wrong = |change: fn(&mut RigCorrections)| {
            let mut corrections = all();
            change(&mut corrections);
            rig().corrected(&corrections).unwrap_err().to_string()
        };
        let told = wrong(|one| one.camera_scale_u = 3.0);
        assert_eq!(told, "correction `camera_scale_u` is 3; it lies between 0.5 and 2");
        assert!(wrong(|one| one.sheet_tilt_deg = 31.0).contains("sheet_tilt_deg"));
        assert!(wrong(|one| one.camera_aim_x_deg = f64::NAN).contains("camera_aim_x_deg"));
    }
}
