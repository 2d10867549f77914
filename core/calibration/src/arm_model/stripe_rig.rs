//! The rig of a light stripe: camera and sheet of light in the flange's frame.

use nalgebra::{Isometry3, Point3, Rotation3, Unit, UnitQuaternion, Vector3};

use super::rig_number::RigNumber;

/// Camera and sheet of light on a flange.
#[derive(Debug, Clone, PartialEq)]
pub struct StripeRig {
    /// Focal lengths, px.
    pub focal_px: [f64; 2],
    /// Principal point, px.
    pub principal_px: [f64; 2],
    /// Distortion k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
    /// Where the camera is.
    pub flange_from_camera: Isometry3<f64>,
    /// Of the sheet n.x + d = 0 in the flange's frame, length one.
    pub normal: Vector3<f64>,
    /// Of the sheet, mm.
    pub d_mm: f64,
    /// The sheet is n.x + d = bow s^2, with s the place along it across the camera's view, mm from the flange's axis; 1/mm.
    pub bow: f64,
}

impl StripeRig {
    /// Two directions in the sheet, about which it tilts.
    fn in_sheet(&self) -> (Vector3<f64>, Vector3<f64>) {
        let down = self.flange_from_camera.rotation * Vector3::y();
        let first = (down - self.normal * self.normal.dot(&down)).normalize();
        (first, self.normal.cross(&first))
    }

    /// The same rig with one of its numbers moved.
    #[must_use]
    pub fn moved(&self, parameter: RigNumber, by: f64) -> Self {
        let mut rig = self.clone();
        match parameter {
            RigNumber::CameraAim(index) => rig.rotate_camera(axis(index), by),
            RigNumber::CameraRoll => rig.rotate_camera(axis(2), by),
            RigNumber::CameraScale(index) => {
                if let Some(focal) = rig.focal_px.get_mut(index) {
                    *focal *= 1.0 + by;
                }
            }
            RigNumber::PrincipalPoint(index) => {
                if let Some(principal) = rig.principal_px.get_mut(index) {
                    *principal += by;
                }
            }
            RigNumber::LensDistortion => rig.distortion[0] += by,
            RigNumber::StripePlane(2) => rig.d_mm += by,
            RigNumber::StripePlane(which) => {
                // It tilts about where it meets the principal ray, so that tilt and shift stay apart.
                let (first, second) = rig.in_sheet();
                let about = Unit::new_normalize(if which == 0 { first } else { second });
                let pivot = rig.on_principal_ray();
                rig.normal = Rotation3::from_axis_angle(&about, by) * rig.normal;
                rig.d_mm = -rig.normal.dot(&pivot);
            }
            RigNumber::StripeBow => rig.bow += by,
            RigNumber::HandEye(index) => {
                let shift = axis(index).into_inner() * by;
                rig.flange_from_camera.translation.vector += shift;
                rig.d_mm -= rig.normal.dot(&shift);
            }
        }
        rig
    }

    /// The same rig with every number moved, in the order of [`RigNumber::ALL`].
    #[must_use]
    pub fn with(&self, amounts: &[f64; RigNumber::ALL.len()]) -> Self {
        let moved = RigNumber::ALL.into_iter().zip(amounts).filter(|(_, amount)| **amount != 0.0);
        moved.fold(self.clone(), |rig, (number, amount)| rig.moved(number, *amount))
    }

    /// Where the light meets the principal ray, flange's frame, mm: the point the rig looks at.
    pub fn working_point(&self) -> Vector3<f64> {
        self.on_principal_ray()
    }

    fn rotate_camera(&mut self, axis: Unit<Vector3<f64>>, by: f64) {
        self.flange_from_camera.rotation *= UnitQuaternion::from_axis_angle(&axis, by);
    }

    fn on_principal_ray(&self) -> Vector3<f64> {
        let lens = self.flange_from_camera.translation.vector;
        let toward = self.flange_from_camera.rotation * Vector3::z();
        let falling = self.normal.dot(&toward);
        let distance =
            if falling.abs() > 1e-9 { -(self.normal.dot(&lens) + self.d_mm) / falling } else { 300.0 };
        lens + toward * distance
    }

    /// The point of the sheet a pixel shows, in the flange's frame, mm; none where the ray misses it.
    pub fn point(&self, u_px: f64, v_px: f64) -> Option<Point3<f64>> {
        let bent = [
            (u_px - self.principal_px[0]) / self.focal_px[0],
            (v_px - self.principal_px[1]) / self.focal_px[1],
        ];
        let [x, y] = self.straighten(bent);
        let toward = self.flange_from_camera.rotation * Vector3::new(x, y, 1.0);
        let lens = self.flange_from_camera.translation.vector;
        let falling = self.normal.dot(&toward);
        let height = self.normal.dot(&lens) + self.d_mm;
        // A ray along the sheet meets it nowhere.
        if falling.abs() < 1e-9 {
            return None;
        }
        let mut distance = -height / falling;
        if self.bow != 0.0 {
            let (along, _) = self.in_sheet();
            // A bow is small: each round leaves a fraction of the order of it times the position along the sheet.
            for _ in 0..4 {
                let position = (lens + toward * distance).dot(&along);
                distance = (self.bow * position * position - height) / falling;
            }
        }
        (distance > 0.0).then(|| Point3::from(lens + toward * distance))
    }

    fn straighten(&self, bent: [f64; 2]) -> [f64; 2] {
        let [k1, k2, p1, p2, k3] = self.distortion;
        if self.distortion == [0.0; 5] {
            return bent;
        }
        let [mut x, mut y] = bent;
        // A fixed point of bending, as OpenCV's undistortPoints.
        for _ in 0..10 {
            let square = x * x + y * y;
            let swell = 1.0 + square * (k1 + square * (k2 + square * k3));
            let aside_x = 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x);
            let aside_y = p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y;
            (x, y) = ((bent[0] - aside_x) / swell, (bent[1] - aside_y) / swell);
        }
        [x, y]
    }
}

/// An axis by its index; z for any beyond.
fn axis(index: usize) -> Unit<Vector3<f64>> {
    [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()].get(index).copied().unwrap_or(Vector3::z_axis())
}
