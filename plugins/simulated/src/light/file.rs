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

use std::path::Path;

use plumb_document::{FileProblems, Problems, Span, Spanned, parse, typed};
use serde::Deserialize;

use super::surface::{Form, Spot, Surface, pose};
use super::{Ambient, Camera, Light, Projector, Switches};
use crate::physics::rigid::{Rigid, Vector};

/// The `light:` of a world file as it is typed.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawLight {
    camera: RawCamera,
    projector: RawProjector,
    #[serde(default)]
    ambient: RawAmbient,
    #[serde(default)]
    laser: OnOff,
    #[serde(default)]
    filter: InOut,
    #[serde(default)]
    exposure_delay_ms: Spanned<f64>,
    surfaces: Vec<Spanned<RawSurface>>,
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
    xyz_mm: Spanned<[f64; 3]>,
    #[serde(default)]
    rpy_deg: Spanned<[f64; 3]>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCamera {
    size_px: Spanned<[usize; 2]>,
    focal_px: Spanned<[f64; 2]>,
    principal_px: Option<Spanned<[f64; 2]>>,
    #[serde(default)]
    distortion: RawDistortion,
    #[serde(default)]
    blur_px: Spanned<f64>,
    #[serde(default)]
    noise: RawNoise,
    #[serde(default)]
    black: Spanned<f64>,
    in_flange: RawPose,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawDistortion {
    k1: Spanned<f64>,
    k2: Spanned<f64>,
    k3: Spanned<f64>,
    p1: Spanned<f64>,
    p2: Spanned<f64>,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawNoise {
    dark: Spanned<f64>,
    per_level: Spanned<f64>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawProjector {
    in_flange: RawPose,
    width_mm: Spanned<f64>,
    half_fan_deg: Spanned<f64>,
    #[serde(default)]
    bow: Spanned<f64>,
    level: Spanned<f64>,
    #[serde(default)]
    speckle: Spanned<f64>,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawAmbient {
    open: Spanned<f64>,
    filtered: Spanned<f64>,
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
    reflectance: Spanned<f64>,
    spot: Option<RawSpot>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPlane {
    point_mm: Spanned<[f64; 3]>,
    normal: Spanned<[f64; 3]>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBlock {
    centre_mm: Spanned<[f64; 3]>,
    edges_mm: Spanned<[f64; 3]>,
    #[serde(default)]
    yaw_deg: Spanned<f64>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPyramid {
    apex_mm: Spanned<[f64; 3]>,
    edge_mm: Spanned<f64>,
    height_mm: Spanned<f64>,
    #[serde(default)]
    yaw_deg: Spanned<f64>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSphere {
    centre_mm: Spanned<[f64; 3]>,
    radius_mm: Spanned<f64>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTube {
    foot_mm: Spanned<[f64; 3]>,
    radius_mm: Spanned<f64>,
    height_mm: Spanned<f64>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawEllipsoid {
    centre_mm: Spanned<[f64; 3]>,
    half_axes_mm: Spanned<[f64; 3]>,
    #[serde(default)]
    yaw_deg: Spanned<f64>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSpot {
    centre_mm: Spanned<[f64; 3]>,
    radius_mm: Spanned<f64>,
    reflectance: Spanned<f64>,
}

/// A number that lies in its range; NaN after a error.
fn within(key: &str, value: &Spanned<f64>, low: f64, high: f64, problems: &Problems) -> f64 {
    value.between(&format!("`{key}`"), low..=high, "", problems)
}

/// Numbers of which each lies in its range; one error for all of them.
fn all_within<const N: usize>(
    key: &str,
    values: &Spanned<[f64; N]>,
    low: f64,
    high: f64,
    problems: &Problems,
) -> [f64; N] {
    if let Some(value) = values.value.iter().find(|value| **value < low || **value > high) {
        problems.add(
            values.span,
            format!("`{key}` holds {value}"),
            format!("each lies between {low} and {high}"),
        );
    }
    values.value
}

fn rigid_of(raw: &RawPose, problems: &Problems) -> Rigid {
    let xyz = all_within("xyz_mm", &raw.xyz_mm, -2000.0, 2000.0, problems);
    let rpy = all_within("rpy_deg", &raw.rpy_deg, -360.0, 360.0, problems);
    pose(xyz, rpy.map(f64::to_radians))
}

/// Reads a light by itself, out of a file that holds nothing else; `seed` is the world's.
///
/// # Errors
/// All mistakes of the file.
pub fn read_light(file: &Path, text: &str, seed: u64) -> Result<Light, FileProblems> {
    let problems = Problems::default();
    let root = parse(file, text, &problems)?;
    let raw: Option<RawLight> = typed(&root, "a light", &problems);
    let light = raw.and_then(|raw| raw.check(seed, &problems));
    problems.into_result(file, text)?;
    light.ok_or_else(|| FileProblems::whole_file(file, "this is no light", ""))
}

impl RawLight {
    /// Checks it; `seed` is the world's. What is wrong goes among `problems`; none where a part is missing then.
    pub(crate) fn check(&self, seed: u64, problems: &Problems) -> Option<Light> {
        let surfaces: Vec<Option<Surface>> =
            self.surfaces.iter().map(|surface| surface.value.check(surface.span, problems)).collect();
        let delay = within("exposure_delay_ms", &self.exposure_delay_ms, -1000.0, 1000.0, problems);
        let camera = self.camera.check(problems);
        let projector = self.projector.check(problems);
        let ambient = Ambient {
            open: within("open", &self.ambient.open, 0.0, 10_000.0, problems),
            filtered: within("filtered", &self.ambient.filtered, 0.0, 10_000.0, problems),
        };
        Some(Light {
            seed,
            camera: camera?,
            projector,
            ambient,
            switches: Switches { laser: self.laser == OnOff::On, filter: self.filter == InOut::In },
            exposure_delay_ns: (delay * 1e6) as i64,
            surfaces: surfaces.into_iter().collect::<Option<_>>()?,
        })
    }
}

impl RawCamera {
    fn check(&self, problems: &Problems) -> Option<Camera> {
        let [width, height] = self.size_px.value;
        let fits = |side: usize| (16..=4096).contains(&side);
        let focal = all_within("focal_px", &self.focal_px, 1.0, 1e6, problems);
        let RawDistortion { k1, k2, k3, p1, p2 } = &self.distortion;
        let [k1, k2, k3, p1, p2] = [("k1", k1), ("k2", k2), ("k3", k3), ("p1", p1), ("p2", p2)]
            .map(|(key, value)| within(key, value, -10.0, 10.0, problems));
        let blur = within("blur_px", &self.blur_px, 0.0, 50.0, problems);
        let dark_noise = within("dark", &self.noise.dark, 0.0, 100.0, problems);
        let noise_per_level = within("per_level", &self.noise.per_level, 0.0, 10.0, problems);
        let black = within("black", &self.black, 0.0, 255.0, problems);
        let flange_from_camera = rigid_of(&self.in_flange, problems);
        if !fits(width) || !fits(height) {
            let message = format!("`size_px` is [{width}, {height}]");
            problems.add(self.size_px.span, message, "each side is 16 to 4096");
            return None;
        }
        let middle = [(width - 1) as f64 / 2.0, (height - 1) as f64 / 2.0];
        Some(Camera {
            width,
            height,
            focal,
            principal: self.principal_px.map_or(middle, |typed| typed.value),
            radial: [k1, k2, k3],
            decentring: [p1, p2],
            blur,
            dark_noise,
            noise_per_level,
            black,
            flange_from_camera,
        })
    }
}

impl RawProjector {
    fn check(&self, problems: &Problems) -> Projector {
        let number =
            |key: &str, value: &Spanned<f64>, low: f64, high: f64| within(key, value, low, high, problems);
        Projector {
            flange_from_projector: rigid_of(&self.in_flange, problems),
            width_at_300: number("width_mm", &self.width_mm, 0.01, 50.0),
            half_fan: number("half_fan_deg", &self.half_fan_deg, 0.5, 80.0).to_radians(),
            bow: number("bow", &self.bow, -1.0, 1.0),
            level_at_300: number("level", &self.level, 0.0, 10_000.0),
            speckle: number("speckle", &self.speckle, 0.0, 1.0),
        }
    }
}

/// Lengths of a surface, mm.
const LENGTHS: (f64, f64) = (0.1, 10_000.0);

impl RawSurface {
    /// `span` is where the surface is.
    fn check(&self, span: Span, problems: &Problems) -> Option<Surface> {
        let reflectance = within("reflectance", &self.reflectance, 0.0, 1.0, problems);
        let spot = self.spot.map(|spot| spot.check(problems));
        Some(Surface { form: self.form(span, problems)?, reflectance, spot })
    }

    fn form(&self, span: Span, problems: &Problems) -> Option<Form> {
        let forms = (&self.plane, &self.block, &self.pyramid, &self.sphere, &self.tube, &self.ellipsoid);
        match forms {
            (Some(plane), None, None, None, None, None) => plane.form(problems),
            (None, Some(block), None, None, None, None) => Some(block.form(problems)),
            (None, None, Some(pyramid), None, None, None) => Some(pyramid.form(problems)),
            (None, None, None, Some(sphere), None, None) => Some(sphere.form(problems)),
            (None, None, None, None, Some(tube), None) => Some(tube.form(problems)),
            (None, None, None, None, None, Some(ellipsoid)) => Some(ellipsoid.form(problems)),
            _ => {
                let message = "a surface is one of plane, block, pyramid, sphere, tube and ellipsoid";
                problems.add(span, message, "");
                None
            }
        }
    }
}

fn length(key: &str, value: &Spanned<f64>, problems: &Problems) -> f64 {
    within(key, value, LENGTHS.0, LENGTHS.1, problems)
}

fn lengths(key: &str, values: &Spanned<[f64; 3]>, problems: &Problems) -> [f64; 3] {
    all_within(key, values, LENGTHS.0, LENGTHS.1, problems)
}

fn yaw(degrees: &Spanned<f64>, problems: &Problems) -> f64 {
    within("yaw_deg", degrees, -360.0, 360.0, problems).to_radians()
}

impl RawPlane {
    fn form(&self, problems: &Problems) -> Option<Form> {
        let normal = Vector::from(self.normal.value).unit();
        if normal.is_none() {
            problems.add(self.normal.span, "this normal has no length", "write for example [0, 0, 1]");
        }
        Some(Form::Plane { point: self.point_mm.value.into(), normal: normal? })
    }
}

impl RawBlock {
    fn form(&self, problems: &Problems) -> Form {
        let edges = lengths("edges_mm", &self.edges_mm, problems);
        Form::block(self.centre_mm.value.into(), edges, yaw(&self.yaw_deg, problems))
    }
}

impl RawPyramid {
    fn form(&self, problems: &Problems) -> Form {
        let edge = length("edge_mm", &self.edge_mm, problems);
        let height = length("height_mm", &self.height_mm, problems);
        Form::pyramid(self.apex_mm.value.into(), edge, height, yaw(&self.yaw_deg, problems))
    }
}

impl RawSphere {
    fn form(&self, problems: &Problems) -> Form {
        let radius = length("radius_mm", &self.radius_mm, problems);
        Form::Sphere { centre: self.centre_mm.value.into(), radius }
    }
}

impl RawTube {
    fn form(&self, problems: &Problems) -> Form {
        let radius = length("radius_mm", &self.radius_mm, problems);
        let height = length("height_mm", &self.height_mm, problems);
        Form::Tube { foot: self.foot_mm.value.into(), radius, height }
    }
}

impl RawEllipsoid {
    fn form(&self, problems: &Problems) -> Form {
        Form::Ellipsoid {
            centre: self.centre_mm.value.into(),
            halves: lengths("half_axes_mm", &self.half_axes_mm, problems),
            yaw: yaw(&self.yaw_deg, problems),
        }
    }
}

impl RawSpot {
    fn check(&self, problems: &Problems) -> Spot {
        Spot {
            centre: self.centre_mm.value.into(),
            radius: length("radius_mm", &self.radius_mm, problems),
            reflectance: within("reflectance", &self.reflectance, 0.0, 1.0, problems),
        }
    }
}
