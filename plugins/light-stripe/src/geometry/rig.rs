//! The rig: a camera and a sheet of light, both fixed to the flange.

use nalgebra::{Isometry3, Point3, Unit, Vector2, Vector3};

use super::{Camera, Collineation, CollineationError, NoPoint};

/// The sheet of light: n.x + d = 0 in the flange's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StripePlane {
    /// Of length one.
    pub normal: Vector3<f64>,
    /// mm.
    pub d_mm: f64,
}

impl StripePlane {
    /// The plane of a normal of any length; none of length 0.
    pub fn new(normal: Vector3<f64>, d_mm: f64) -> Option<Self> {
        let unit = Unit::try_new(normal, 1e-9)?;
        Some(Self { normal: unit.into_inner(), d_mm: d_mm / normal.norm() })
    }
}

/// A camera and a sheet of light on a flange.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    /// As people call it.
    pub name: String,
    /// The camera.
    pub camera: Camera,
    /// Where the camera is.
    pub flange_from_camera: Isometry3<f64>,
    /// Where the light is.
    pub plane: StripePlane,
    /// How the sheet bends out of its plane: n.x + d = bow s^2, with s the place along it down the camera's view, mm from the flange's axis; 1/mm.
    pub bow_per_mm: f64,
}

/// Rounds in which a bent sheet's point is found from its plane's.
const BENDING_ROUNDS: usize = 6;

impl Rig {
    /// From ideal pixels to points in the flange's frame.
    ///
    /// # Errors
    /// [`CollineationError`]
    pub fn collineation(&self) -> Result<Collineation, CollineationError> {
        Collineation::from_plane(&self.flange_from_camera, &self.camera.ray_from_pixel(), &self.plane)
    }

    /// The point of the bent sheet on the ray that meets its plane in this point.
    pub fn bent(&self, flat: Point3<f64>) -> Point3<f64> {
        if self.bow_per_mm == 0.0 {
            return flat;
        }
        let normal = self.plane.normal;
        let down = self.flange_from_camera.rotation * Vector3::y();
        let along = (down - normal * normal.dot(&down)).normalize();
        let lens = Point3::from(self.flange_from_camera.translation.vector);
        let ray = flat - lens;
        let height = normal.dot(&lens.coords) + self.plane.d_mm;
        let mut share = 1.0;
        for _ in 0..BENDING_ROUNDS {
            let place = (lens + ray * share).coords.dot(&along);
            share = 1.0 - self.bow_per_mm * place * place / height;
        }
        lens + ray * share
    }

    /// The pixel a point in the flange's frame falls on; none behind the lens.
    pub fn pixel_of(&self, point: Point3<f64>) -> Option<Vector2<f64>> {
        let seen = self.flange_from_camera.inverse_transform_point(&point);
        (seen.z > 0.0).then(|| self.camera.pixel(Vector2::new(seen.x / seen.z, seen.y / seen.z)))
    }

    /// The point of the stripe that a pixel of the real, distorted picture means, in the flange's frame.
    ///
    /// # Errors
    /// [`NoPoint`], or what is wrong with the rig.
    pub fn point_of(&self, pixel: Vector2<f64>) -> Result<Point3<f64>, String> {
        let straight = self
            .camera
            .straighten(pixel)
            .ok_or_else(|| "the pixel lies outside of what the lens's distortion holds for".to_owned())?;
        let collineation = self.collineation().map_err(|error| error.to_string())?;
        let flat = collineation.point(straight).map_err(|error: NoPoint| error.to_string())?;
        Ok(self.bent(flat))
    }
}
