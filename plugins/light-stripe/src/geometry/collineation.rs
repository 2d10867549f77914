//! K: from a pixel on the stripe's picture straight to a point (Agin 1985, section 2).

use nalgebra::{Isometry3, Matrix3, Matrix4, Matrix4x3, Point3, Vector2, Vector3};

use super::StripePlane;

/// The 4 x 3 matrix that takes an ideal pixel (u, v, 1) on the stripe to the homogeneous point it is the picture of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collineation {
    matrix: Matrix4x3<f64>,
}

/// Why there is no collineation.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CollineationError {
    /// The lens lies in the light.
    #[error(
        "the lens lies {distance_mm:.4} mm from the sheet of light: from within the sheet every point of it looks like one line; \
         camera and projector stand side by side, some ten millimetres apart at least"
    )]
    LensInSheet {
        /// How far it is from it, mm.
        distance_mm: f64,
    },
    /// The camera's projection has no inverse.
    #[error("the camera's projection matrix has no inverse: write it 4 x 4, with a row for the depth")]
    NoInverse,
}

/// Why a pixel means no point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoPoint {
    /// The ray runs along the sheet.
    #[error("the ray of this pixel runs along the sheet of light and meets it nowhere")]
    Parallel,
    /// The ray meets the sheet behind the lens.
    #[error("the ray of this pixel meets the sheet of light behind the lens")]
    Behind,
}

/// A lens nearer to the sheet than this lies in it, mm.
const LEAST_DISTANCE: f64 = 0.1;

impl Collineation {
    /// From the camera's pose C and 4 x 4 projection P and the projector's pose S, whose light lies in its plane x = 0: with R = C P^-1, r3 its third
    /// column, R' the others, and pi the first row of S^-1, K = (pi r3) R' - r3 (pi R'): the printed elements times q13.
    ///
    /// # Errors
    /// [`CollineationError`]
    pub fn from_matrices(
        camera: &Matrix4<f64>,
        projection: &Matrix4<f64>,
        projector: &Matrix4<f64>,
    ) -> Result<Self, CollineationError> {
        let inverse = projection.try_inverse().ok_or(CollineationError::NoInverse)?;
        let image_to_frame = camera * inverse;
        let frame_to_projector = projector.try_inverse().ok_or(CollineationError::NoInverse)?;
        let sheet = frame_to_projector.row(0).into_owned();
        // P^-1 takes the pseudo-depth's direction to the lens centre.
        let lens = image_to_frame.column(2).into_owned();
        let pierced = (sheet * lens).x;
        let distance = if lens.w == 0.0 { pierced } else { pierced / lens.w };
        if distance.is_nan() || distance.abs() < LEAST_DISTANCE {
            return Err(CollineationError::LensInSheet { distance_mm: distance });
        }
        let others = Matrix4x3::from_columns(&[
            image_to_frame.column(0).into_owned(),
            image_to_frame.column(1).into_owned(),
            image_to_frame.column(3).into_owned(),
        ]);
        let matrix = others * pierced - lens * (sheet * others);
        // P C^-1 K has the last row (0, 0, pi r3), and that row of a point before the lens is positive.
        Ok(Self { matrix: if pierced < 0.0 { -matrix } else { matrix } }.scaled())
    }

    /// From the direct form: rays x = o + t M u from the lens o, the plane n.x + d = 0: K = [o (n M) - (n.o + d) M; n M].
    ///
    /// # Errors
    /// [`CollineationError::LensInSheet`]
    pub fn from_plane(
        frame_from_camera: &Isometry3<f64>,
        ray_from_pixel: &Matrix3<f64>,
        plane: &StripePlane,
    ) -> Result<Self, CollineationError> {
        let rays = frame_from_camera.rotation.to_rotation_matrix().into_inner() * ray_from_pixel;
        let lens = frame_from_camera.translation.vector;
        let distance = plane.normal.dot(&lens) + plane.d_mm;
        if distance.is_nan() || distance.abs() < LEAST_DISTANCE {
            return Err(CollineationError::LensInSheet { distance_mm: distance });
        }
        let across = plane.normal.transpose() * rays;
        let upper = lens * across - rays * distance;
        let mut matrix = Matrix4x3::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&upper);
        matrix.fixed_view_mut::<1, 3>(3, 0).copy_from(&across);
        // The point lies before the lens where n M u and the lens's distance differ in sign.
        Ok(Self { matrix: if distance > 0.0 { -matrix } else { matrix } }.scaled())
    }

    /// Scaled so that single precision holds it well.
    fn scaled(self) -> Self {
        let largest = self.matrix.row(3).amax();
        if largest > 0.0 { Self { matrix: self.matrix / largest } } else { self }
    }

    /// The matrix, up to scale.
    pub fn matrix(&self) -> &Matrix4x3<f64> {
        &self.matrix
    }

    /// The point an ideal pixel means, mm.
    ///
    /// # Errors
    /// [`NoPoint`]
    pub fn point(&self, pixel: Vector2<f64>) -> Result<Point3<f64>, NoPoint> {
        let image = Vector3::new(pixel.x, pixel.y, 1.0);
        let homogeneous = self.matrix * image;
        // Far from the sheet's own horizon all four numbers are of the size the matrix gives them.
        if homogeneous.w.abs() <= 1e-12 * self.matrix.row(3).dot(&image.abs().transpose()).abs().max(1.0) {
            return Err(NoPoint::Parallel);
        }
        if homogeneous.w < 0.0 {
            return Err(NoPoint::Behind);
        }
        Ok(Point3::from(homogeneous.xyz() / homogeneous.w))
    }

    /// How the point moves with the pixel's column, mm/px.
    ///
    /// # Errors
    /// [`NoPoint`]
    pub fn per_column(&self, pixel: Vector2<f64>) -> Result<Vector3<f64>, NoPoint> {
        let point = self.point(pixel)?;
        let w = (self.matrix * Vector3::new(pixel.x, pixel.y, 1.0)).w;
        let column = self.matrix.column(0);
        Ok((column.xyz() - point.coords * column.w) / w)
    }

    /// The points of many ideal pixels in single precision, as long as the shortest slice; a pixel that means no point gives not-a-number.
    pub fn points(&self, u: &[f32], v: &[f32], x: &mut [f32], y: &mut [f32], z: &mut [f32]) {
        let k = self.matrix.map(|element| element as f32);
        let row = |row: usize| [k[(row, 0)], k[(row, 1)], k[(row, 2)]];
        let (kx, ky, kz, kw) = (row(0), row(1), row(2), row(3));
        let pixels_and_points = u.iter().zip(v).zip(x).zip(y).zip(z);
        for ((((u, v), x), y), z) in pixels_and_points {
            let times = |k: [f32; 3]| k[0] * u + k[1] * v + k[2];
            let w = times(kw);
            let inverse = if w > 0.0 { 1.0 / w } else { f32::NAN };
            *x = times(kx) * inverse;
            *y = times(ky) * inverse;
            *z = times(kz) * inverse;
        }
    }
}
