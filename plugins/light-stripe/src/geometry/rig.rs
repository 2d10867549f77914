//! The rig: a camera and a sheet of light, both fixed to the flange.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector2, Vector3};

use super::{Camera, Collineation, CollineationError, NoPoint, RigCorrections, StripePlane};

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
    /// How the sheet bends out of its plane: n.x + d = bow s^2, with s the position along it down the camera's view, mm from the flange's axis; 1/mm.
    pub bow_per_mm: f64,
    /// The corrections of the record that these numbers contain already; none in the maker's file.
    pub contains: RigCorrections,
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
        let mut fraction = 1.0;
        for _ in 0..BENDING_ROUNDS {
            let along_sheet = (lens + ray * fraction).coords.dot(&along);
            fraction = 1.0 - self.bow_per_mm * along_sheet * along_sheet / height;
        }
        lens + ray * fraction
    }

    /// The same with the camera turned where it is, first about the flange's y, then about its x, rad.
    #[must_use]
    pub fn aimed(mut self, about_x: f64, about_y: f64) -> Self {
        let turn = |axis: Unit<Vector3<f64>>, angle| UnitQuaternion::from_axis_angle(&axis, angle);
        let aimed = turn(Vector3::x_axis(), about_x) * turn(Vector3::y_axis(), about_y);
        self.flange_from_camera.rotation = aimed * self.flange_from_camera.rotation;
        self
    }

    /// The same with the camera turned about its principal ray, rad.
    #[must_use]
    pub fn rolled(mut self, angle: f64) -> Self {
        self.flange_from_camera.rotation *= UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        self
    }

    /// The same with another sheet of light, by a normal of any length in the flange's frame, and how far it is turned from this one, rad; none of a
    /// normal without length.
    pub fn with_sheet(mut self, normal: [f64; 3], d_mm: f64) -> Option<(Self, f64)> {
        let plane = StripePlane::new(Vector3::from(normal), d_mm)?;
        let angle = self.plane.normal.angle(&plane.normal);
        self.plane = plane;
        Some((self, angle))
    }

    /// The direction a pixel of the real picture looks in, in the flange's frame: x/z and y/z; none where the lens model does not hold, or across z.
    pub fn ray(&self, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
        let straight = self.camera.straighten(pixel)?;
        let toward = self.camera.ray_from_pixel() * Vector3::new(straight.x, straight.y, 1.0);
        let toward = self.flange_from_camera.rotation * toward;
        (toward.z > 0.1 * toward.norm()).then(|| Vector2::new(toward.x / toward.z, toward.y / toward.z))
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
