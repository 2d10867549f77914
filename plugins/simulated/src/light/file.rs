//! The `light:` of a world file, as it is typed and then checked. Every key carries its unit.
//!
//! ```yaml
//! light:
//!   camera:
//!     size_px: [256, 256]
//!     focal_px: [694, 694]
//!     principal_px: [127.5, 127.5]        # the picture's middle, if left out
//!     distortion: {k1: 0, k2: 0, k3: 0, p1: 0, p2: 0}
//!     blur_px: 0.6
//!     noise: {dark: 2, per_level: 0.05}
//!     black: 8
//!     in_flange: {xyz_mm: [-30, 0, 60], rpy_deg: [0, 0, 0]}
//!   projector:
//!     in_flange: {xyz_mm: [70, 0, 60], rpy_deg: [0, -18.43, 0]}
//!     width_mm: 1                         # at 300 mm
//!     half_fan_deg: 18.4
//!     bow: 0
//!     level: 200                          # grey, at 300 mm on a perfect white
//!     speckle: 0
//!   ambient: {open: 120, filtered: 2}
//!   laser: on                             # at the beginning
//!   filter: in
//!   exposure_delay_ms: 0
//!   surfaces:
//!     - {plane: {point_mm: [0, 0, 0], normal: [0, 0, 1]}, reflectance: 0.6, spot: {centre_mm: [300, 0, 0], radius_mm: 6, reflectance: 0.05}}
//!     - {block: {centre_mm: [300, 0, 20], edges_mm: [60, 60, 40], yaw_deg: 0}, reflectance: 0.6}
//!     - {pyramid: {apex_mm: [300, 0, 60], edge_mm: 120, height_mm: 60, yaw_deg: 0}, reflectance: 0.6}
//!     - {sphere: {centre_mm: [300, 0, 40], radius_mm: 40}, reflectance: 0.6}
//!     - {tube: {foot_mm: [300, 0, 0], radius_mm: 40, height_mm: 90}, reflectance: 0.6}
//! ```

use serde::Deserialize;

use super::surface::{Form, Spot, Surface, pose};
use super::{Ambient, Camera, Light, Projector, Switches};
use crate::physics::rigid::{Rigid, Vector};

/// The `light:` of a world file as it is typed.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawLight {
    camera: RawCamera,
    projector: RawProjector,
    #[serde(default)]
    ambient: RawAmbient,
    #[serde(default)]
    laser: OnOff,
    #[serde(default)]
    filter: InOut,
    #[serde(default)]
    exposure_delay_ms: f64,
    surfaces: Vec<RawSurface>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum OnOff {
    #[default]
    On,
    Off,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum InOut {
    #[default]
    In,
    Out,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPose {
    xyz_mm: [f64; 3],
    #[serde(default)]
    rpy_deg: [f64; 3],
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCamera {
    size_px: [usize; 2],
    focal_px: [f64; 2],
    principal_px: Option<[f64; 2]>,
    #[serde(default)]
    distortion: RawDistortion,
    #[serde(default)]
    blur_px: f64,
    #[serde(default)]
    noise: RawNoise,
    #[serde(default)]
    black: f64,
    in_flange: RawPose,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawDistortion {
    k1: f64,
    k2: f64,
    k3: f64,
    p1: f64,
    p2: f64,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawNoise {
    dark: f64,
    per_level: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawProjector {
    in_flange: RawPose,
    width_mm: f64,
    half_fan_deg: f64,
    #[serde(default)]
    bow: f64,
    level: f64,
    #[serde(default)]
    speckle: f64,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawAmbient {
    open: f64,
    filtered: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSurface {
    plane: Option<RawPlane>,
    block: Option<RawBlock>,
    pyramid: Option<RawPyramid>,
    sphere: Option<RawSphere>,
    tube: Option<RawTube>,
    ellipsoid: Option<RawEllipsoid>,
    reflectance: f64,
    spot: Option<RawSpot>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPlane {
    point_mm: [f64; 3],
    normal: [f64; 3],
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBlock {
    centre_mm: [f64; 3],
    edges_mm: [f64; 3],
    #[serde(default)]
    yaw_deg: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPyramid {
    apex_mm: [f64; 3],
    edge_mm: f64,
    height_mm: f64,
    #[serde(default)]
    yaw_deg: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSphere {
    centre_mm: [f64; 3],
    radius_mm: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTube {
    foot_mm: [f64; 3],
    radius_mm: f64,
    height_mm: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawEllipsoid {
    centre_mm: [f64; 3],
    half_axes_mm: [f64; 3],
    #[serde(default)]
    yaw_deg: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSpot {
    centre_mm: [f64; 3],
    radius_mm: f64,
    reflectance: f64,
}

/// What is wrong with a number, as a sentence.
type Problem = String;

fn within(key: &str, value: f64, low: f64, high: f64) -> Result<f64, Problem> {
    let fits = value.is_finite() && (low..=high).contains(&value);
    if fits { Ok(value) } else { Err(format!("`{key}` is {value}, but must be {low} to {high}")) }
}

fn place(key: &str, raw: &RawPose) -> Result<Rigid, Problem> {
    for value in raw.xyz_mm {
        within(&format!("{key}: xyz_mm"), value, -2000.0, 2000.0)?;
    }
    for value in raw.rpy_deg {
        within(&format!("{key}: rpy_deg"), value, -360.0, 360.0)?;
    }
    Ok(pose(raw.xyz_mm, raw.rpy_deg.map(f64::to_radians)))
}

impl RawLight {
    /// Checks it; `seed` is the world's.
    ///
    /// # Errors
    /// What is wrong and what would be right.
    pub fn check(&self, seed: u64) -> Result<Light, Problem> {
        let surfaces = self.surfaces.iter().map(RawSurface::check).collect::<Result<Vec<_>, _>>()?;
        let delay = within("exposure_delay_ms", self.exposure_delay_ms, -1000.0, 1000.0)?;
        Ok(Light {
            seed,
            camera: self.camera.check()?,
            projector: self.projector.check()?,
            ambient: Ambient {
                open: within("ambient: open", self.ambient.open, 0.0, 10_000.0)?,
                filtered: within("ambient: filtered", self.ambient.filtered, 0.0, 10_000.0)?,
            },
            switches: Switches { laser: self.laser == OnOff::On, filter: self.filter == InOut::In },
            exposure_delay_ns: (delay * 1e6) as i64,
            surfaces,
        })
    }
}

impl RawCamera {
    fn check(&self) -> Result<Camera, Problem> {
        let [width, height] = self.size_px;
        if !(16..=4096).contains(&width) || !(16..=4096).contains(&height) {
            return Err(format!("`size_px` is [{width}, {height}]; each side is 16 to 4096"));
        }
        for focal in self.focal_px {
            within("focal_px", focal, 1.0, 1e6)?;
        }
        let middle = [(width - 1) as f64 / 2.0, (height - 1) as f64 / 2.0];
        let RawDistortion { k1, k2, k3, p1, p2 } = self.distortion;
        for value in [k1, k2, k3, p1, p2] {
            within("distortion", value, -10.0, 10.0)?;
        }
        Ok(Camera {
            width,
            height,
            focal: self.focal_px,
            principal: self.principal_px.unwrap_or(middle),
            radial: [k1, k2, k3],
            decentring: [p1, p2],
            blur: within("blur_px", self.blur_px, 0.0, 50.0)?,
            dark_noise: within("noise: dark", self.noise.dark, 0.0, 100.0)?,
            noise_per_level: within("noise: per_level", self.noise.per_level, 0.0, 10.0)?,
            black: within("black", self.black, 0.0, 255.0)?,
            flange_from_camera: place("camera: in_flange", &self.in_flange)?,
        })
    }
}

impl RawProjector {
    fn check(&self) -> Result<Projector, Problem> {
        Ok(Projector {
            flange_from_projector: place("projector: in_flange", &self.in_flange)?,
            width_at_300: within("width_mm", self.width_mm, 0.01, 50.0)?,
            half_fan: within("half_fan_deg", self.half_fan_deg, 0.5, 80.0)?.to_radians(),
            bow: within("bow", self.bow, -1.0, 1.0)?,
            level_at_300: within("level", self.level, 0.0, 10_000.0)?,
            speckle: within("speckle", self.speckle, 0.0, 1.0)?,
        })
    }
}

impl RawSurface {
    fn check(&self) -> Result<Surface, Problem> {
        let lengths = |key: &str, values: &[f64]| {
            values.iter().try_for_each(|value| within(key, *value, 0.1, 10_000.0).map(drop))
        };
        let yaw = |degrees: f64| within("yaw_deg", degrees, -360.0, 360.0).map(f64::to_radians);
        let forms = (&self.plane, &self.block, &self.pyramid, &self.sphere, &self.tube, &self.ellipsoid);
        let form = match forms {
            (Some(plane), None, None, None, None, None) => {
                let normal = Vector::from(plane.normal).unit();
                let normal = normal.ok_or("`normal` of a plane has no length")?;
                Form::Plane { point: plane.point_mm.into(), normal }
            }
            (None, Some(block), None, None, None, None) => {
                lengths("edges_mm", &block.edges_mm)?;
                Form::block(block.centre_mm.into(), block.edges_mm, yaw(block.yaw_deg)?)
            }
            (None, None, Some(pyramid), None, None, None) => {
                lengths("edge_mm and height_mm", &[pyramid.edge_mm, pyramid.height_mm])?;
                Form::pyramid(
                    pyramid.apex_mm.into(),
                    pyramid.edge_mm,
                    pyramid.height_mm,
                    yaw(pyramid.yaw_deg)?,
                )
            }
            (None, None, None, Some(sphere), None, None) => {
                lengths("radius_mm", &[sphere.radius_mm])?;
                Form::Sphere { centre: sphere.centre_mm.into(), radius: sphere.radius_mm }
            }
            (None, None, None, None, Some(tube), None) => {
                lengths("radius_mm and height_mm", &[tube.radius_mm, tube.height_mm])?;
                Form::Tube { foot: tube.foot_mm.into(), radius: tube.radius_mm, height: tube.height_mm }
            }
            (None, None, None, None, None, Some(ellipsoid)) => {
                lengths("half_axes_mm", &ellipsoid.half_axes_mm)?;
                Form::Ellipsoid {
                    centre: ellipsoid.centre_mm.into(),
                    halves: ellipsoid.half_axes_mm,
                    yaw: yaw(ellipsoid.yaw_deg)?,
                }
            }
            _ => {
                return Err(
                    "a surface is one of plane, block, pyramid, sphere, tube and ellipsoid".to_owned()
                );
            }
        };
        let spot = match &self.spot {
            None => None,
            Some(spot) => {
                lengths("radius_mm of a spot", &[spot.radius_mm])?;
                let reflectance = within("reflectance of a spot", spot.reflectance, 0.0, 1.0)?;
                Some(Spot { centre: spot.centre_mm.into(), radius: spot.radius_mm, reflectance })
            }
        };
        Ok(Surface { form, reflectance: within("reflectance", self.reflectance, 0.0, 1.0)?, spot })
    }
}
