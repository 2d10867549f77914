//! A rig with its corrections made.

use nalgebra::{Rotation3, Unit, Vector2, Vector3};

use super::{CorrectionError, Rig, RigCorrections, SheetFrame, StripePlane};

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
    use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

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
        let message = wrong(|one| one.camera_scale_u = 3.0);
        assert_eq!(message, "correction `camera_scale_u` is 3; it lies between 0.5 and 2");
        assert!(wrong(|one| one.sheet_tilt_deg = 31.0).contains("sheet_tilt_deg"));
        assert!(wrong(|one| one.camera_aim_x_deg = f64::NAN).contains("camera_aim_x_deg"));
    }
}
