//! What there is to be scanned, as a file: forms, and about where they stand.
//!
//! ```yaml
//! surfaces:
//!   platform: {plane: {normal: [0, 0, 1], offset_mm: -300}}
//!   pyramid: {pyramid: {apex_mm: [60, 530, -260], edge_mm: 110, height_mm: 40, yaw_deg: 17}}
//!   ball: {sphere: {centre_mm: [-120, 530, -275], radius_mm: 25}}
//! ```

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use plumb_document::{FileKind, read_text, yaml};
use serde::Deserialize;

use super::Surface;

/// Why a scene cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// Not readable.
    #[error("{}: cannot be read: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// Not as it must be.
    #[error("{origin}: {what}")]
    Form {
        /// The file.
        origin: String,
        /// What is wrong, and what would be right.
        what: String,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawScene {
    surfaces: BTreeMap<String, RawSurface>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum RawSurface {
    Plane {
        normal: [f64; 3],
        offset_mm: f64,
    },
    Pyramid {
        apex_mm: [f64; 3],
        edge_mm: f64,
        height_mm: f64,
        #[serde(default)]
        yaw_deg: f64,
    },
    Sphere {
        centre_mm: [f64; 3],
        radius_mm: f64,
    },
}

/// Reads a scene: the surfaces in the order of their names, about where they stand, mm in the arm's base frame.
///
/// # Errors
/// [`SceneError`]
pub fn read_scene(path: &Path) -> Result<Vec<(String, Surface)>, SceneError> {
    let text = read_text(path, FileKind::SCENE)
        .map_err(|cause| SceneError::Read { path: path.to_owned(), cause: cause.into() })?;
    parse(&text, &path.display().to_string())
}

fn parse(text: &str, origin: &str) -> Result<Vec<(String, Surface)>, SceneError> {
    let wrong = |what: String| SceneError::Form { origin: origin.to_owned(), what };
    let raw: RawScene = serde_yaml::from_str(text).map_err(|error| wrong(yaml::in_words(&error)))?;
    if raw.surfaces.is_empty() {
        return Err(wrong("`surfaces` names none".to_owned()));
    }
    let checked = |(name, raw): (String, RawSurface)| {
        let surface = raw.surface().map_err(|what| wrong(format!("surface `{name}`: {what}")))?;
        Ok((name, surface))
    };
    raw.surfaces.into_iter().map(checked).collect()
}

impl RawSurface {
    fn surface(&self) -> Result<Surface, &'static str> {
        let finite = |numbers: &[f64]| numbers.iter().all(|number| number.is_finite());
        match self {
            Self::Plane { normal, offset_mm } => {
                let normal = Vector3::from(*normal);
                let good = normal.norm() > 1e-9 && finite(normal.as_slice()) && offset_mm.is_finite();
                good.then(|| Surface::plane(normal, *offset_mm)).ok_or("`normal` has no length")
            }
            Self::Pyramid { apex_mm, edge_mm, height_mm, yaw_deg } => {
                let good = *edge_mm > 0.0 && *height_mm > 0.0 && finite(apex_mm) && yaw_deg.is_finite();
                let apex = Point3::from(*apex_mm);
                good.then(|| Surface::pyramid(apex, *edge_mm, *height_mm, yaw_deg.to_radians()))
                    .ok_or("`edge_mm` and `height_mm` are above 0")
            }
            Self::Sphere { centre_mm, radius_mm } => {
                let good = *radius_mm > 0.0 && finite(centre_mm);
                good.then(|| Surface::Sphere(Point3::from(*centre_mm), *radius_mm))
                    .ok_or("`radius_mm` is above 0")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_read_and_its_mistakes_are_told() {
        let good = "surfaces:\n  table: {plane: {normal: [0, 0, 2], offset_mm: -300}}\n  ball: {sphere: {centre_mm: [1, 2, 3], radius_mm: 25}}\n";
        let scene = parse(good, "scene.yaml").unwrap();
        assert_eq!(scene.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["ball", "table"]);
        let told =
            |from: &str, to: &str| parse(&good.replace(from, to), "scene.yaml").err().map(|e| e.to_string());
        let message = told("radius_mm: 25", "radius_mm: -1").unwrap();
        assert_eq!(message, "scene.yaml: surface `ball`: `radius_mm` is above 0");
        assert!(told("[0, 0, 2]", "[0, 0, 0]").unwrap().contains("`normal` has no length"));
        assert!(told("sphere", "cone").unwrap().contains("cone"));
        assert!(parse("surfaces: {}", "scene.yaml").is_err());
    }
}
