//! The camera: lens and sensor.

use crate::physics::rigid::{Rigid, Vector};

/// A camera on the flange: origin in the lens, x to the right in the picture, y down, z along the principal ray.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Focal length in pixels, across and down.
    pub focal: [f64; 2],
    /// Where the principal ray falls, pixels; the middle of the first pixel is 0.
    pub principal: [f64; 2],
    /// The lens's distortion: radial of the second, fourth and sixth power.
    pub radial: [f64; 3],
    /// The lens's distortion: decentring, down and across.
    pub decentring: [f64; 2],
    /// Standard deviation of the lens's blur, pixels.
    pub blur: f64,
    /// Standard deviation of the noise in the dark, grey levels.
    pub dark_noise: f64,
    /// Variance that each grey level of light adds.
    pub noise_per_level: f64,
    /// Grey level in the dark.
    pub black: f64,
    /// Where it sits.
    pub flange_from_camera: Rigid,
}

impl Camera {
    /// Where a point in the camera's frame falls in the picture; none behind the lens.
    pub fn project(&self, point: Vector) -> Option<[f64; 2]> {
        if point.z <= 1.0 {
            return None;
        }
        let (x, y) = (point.x / point.z, point.y / point.z);
        let square = x * x + y * y;
        let swell = 1.0 + square * (self.radial[0] + square * (self.radial[1] + square * self.radial[2]));
        let [down, across] = self.decentring;
        let bent_x = x * swell + 2.0 * down * x * y + across * (square + 2.0 * x * x);
        let bent_y = y * swell + down * (square + 2.0 * y * y) + 2.0 * across * x * y;
        Some([self.focal[0] * bent_x + self.principal[0], self.focal[1] * bent_y + self.principal[1]])
    }

    /// The direction, in the camera's frame, a pixel looks in. The lens is undone by repetition: its distortion is small.
    pub fn direction(&self, u: f64, v: f64) -> Vector {
        let bent = [(u - self.principal[0]) / self.focal[0], (v - self.principal[1]) / self.focal[1]];
        let [mut x, mut y] = bent;
        for _ in 0..8 {
            let Some([seen_u, seen_v]) = self.project(Vector::new(x * 100.0, y * 100.0, 100.0)) else {
                break;
            };
            x += (u - seen_u) / self.focal[0];
            y += (v - seen_v) / self.focal[1];
        }
        Vector::new(x, y, 1.0)
    }
}
