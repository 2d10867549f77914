//! The camera: pinhole and lens.

use nalgebra::{Matrix2, Matrix3, Vector2};
use serde::{Deserialize, Serialize};

/// A pinhole camera with a lens in front of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Pixels in a row.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// Focal length in pixel widths.
    pub fx_px: f64,
    /// Focal length in pixel heights.
    pub fy_px: f64,
    /// Column of the principal point.
    pub cx_px: f64,
    /// Row of the principal point.
    pub cy_px: f64,
    /// What the lens does to straight lines.
    #[serde(default)]
    pub distortion: Distortion,
}

/// Brown's model of a lens, `plumb_bob` in ROS, in OpenCV's order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Distortion {
    /// Radial, of the second power.
    pub k1: f64,
    /// Radial, of the fourth power.
    pub k2: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
    /// Radial, of the sixth power.
    pub k3: f64,
}

impl Distortion {
    /// Where a straight ray (x/z, y/z) comes to lie.
    pub fn distort(&self, straight: Vector2<f64>) -> Vector2<f64> {
        let (x, y) = (straight.x, straight.y);
        let r2 = straight.norm_squared();
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        Vector2::new(
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        )
    }

    fn derivative(&self, straight: Vector2<f64>) -> Matrix2<f64> {
        let (x, y) = (straight.x, straight.y);
        let r2 = straight.norm_squared();
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        let slope = 2.0 * (self.k1 + r2 * (2.0 * self.k2 + r2 * 3.0 * self.k3));
        let across = x * y * slope + 2.0 * self.p1 * x + 2.0 * self.p2 * y;
        Matrix2::new(
            radial + x * x * slope + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            across,
            across,
            radial + y * y * slope + 6.0 * self.p1 * y + 2.0 * self.p2 * x,
        )
    }

    /// The straight ray that comes to lie there, by Newton's method; none where the model folds over.
    pub fn straighten(&self, bent: Vector2<f64>) -> Option<Vector2<f64>> {
        if *self == Self::default() {
            return Some(bent);
        }
        let mut straight = bent;
        for _ in 0..20 {
            let derivative = self.derivative(straight);
            // Beyond the fold of the radial polynomial the way back would be another ray's.
            if derivative.determinant() <= 0.0 {
                return None;
            }
            let step = derivative.try_inverse()? * (self.distort(straight) - bent);
            straight -= step;
            if step.norm() < 1e-14 {
                return Some(straight);
            }
        }
        ((self.distort(straight) - bent).norm() < 1e-10).then_some(straight)
    }
}

/// A picture wider than this is of no lens that this model describes, deg.
const WIDEST_DEG: f64 = 150.0;

impl Camera {
    /// The pixel a straight ray (x/z, y/z) falls on.
    pub fn pixel(&self, ray: Vector2<f64>) -> Vector2<f64> {
        let bent = self.distortion.distort(ray);
        Vector2::new(self.fx_px * bent.x + self.cx_px, self.fy_px * bent.y + self.cy_px)
    }

    /// The pixel where it would lie had the lens been ideal: what a collineation takes. None outside of what the lens model holds for.
    pub fn straighten(&self, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
        let bent = Vector2::new((pixel.x - self.cx_px) / self.fx_px, (pixel.y - self.cy_px) / self.fy_px);
        let ray = self.distortion.straighten(bent)?;
        Some(Vector2::new(self.fx_px * ray.x + self.cx_px, self.fy_px * ray.y + self.cy_px))
    }

    /// From an ideal pixel (u, v, 1) to a ray in the camera's frame.
    pub fn ray_from_pixel(&self) -> Matrix3<f64> {
        Matrix3::new(
            1.0 / self.fx_px,
            0.0,
            -self.cx_px / self.fx_px,
            0.0,
            1.0 / self.fy_px,
            -self.cy_px / self.fy_px,
            0.0,
            0.0,
            1.0,
        )
    }

    /// Focal lengths, centre and distortion, in the order of their keys.
    pub(super) fn numbers(&self) -> [f64; 9] {
        let Distortion { k1, k2, p1, p2, k3 } = self.distortion;
        [self.fx_px, self.fy_px, self.cx_px, self.cy_px, k1, k2, p1, p2, k3]
    }

    /// What is wrong with it, if anything.
    pub fn problem(&self) -> Option<String> {
        if self.numbers().iter().any(|number| !number.is_finite()) {
            return Some("a number is not finite".to_owned());
        }
        if self.fx_px == 0.0 {
            return Some(
                "the focal length is 0, which says that the camera was never calibrated: calibrate it first"
                    .to_owned(),
            );
        }
        if self.fx_px < 0.0 || self.fy_px <= 0.0 {
            return Some(format!(
                "the focal lengths are {} and {} px; both are above 0",
                self.fx_px, self.fy_px
            ));
        }
        if self.width_px == 0 || self.height_px == 0 {
            return Some("the picture has no pixels: give width_px and height_px".to_owned());
        }
        let across = 2.0 * (0.5 * f64::from(self.width_px) / self.fx_px).atan().to_degrees();
        if across > WIDEST_DEG {
            return Some(format!(
                "a focal length of {} px makes a picture {across:.0} deg wide: fx_px and fy_px count in pixels; 25 mm behind pixels of 0.036 mm are 694 px",
                self.fx_px
            ));
        }
        None
    }
}
