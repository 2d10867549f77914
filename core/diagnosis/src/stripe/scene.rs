//! What there is to be scanned, as a file: forms, and about where they are.
//!
//! ```yaml
//! surfaces:
//!   platform: {plane: {normal: [0, 0, 1], offset_mm: -300}}
//!   pyramid: {pyramid: {apex_mm: [60, 530, -260], edge_mm: 110, height_mm: 40, yaw_deg: 17}}
//!   ball: {sphere: {centre_mm: [-120, 530, -275], radius_mm: 25}}
//! ```

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Point3, Vector3};
use plumb_document::{
    DocumentKind, FileKind, FileProblems, Node, NodeValue, Problems, parse_as, read_document, schema_of,
    typed, with_words,
};
use serde::Deserialize;

use super::surface::Surface;

/// Why a scene cannot be read: every mistake in it.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct SceneError(#[from] FileProblems);

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

/// The JSON Schema of scene files, for editors.
pub fn scene_schema() -> serde_json::Value {
    let words = [(
        "surfaces",
        "What there is to be scanned, by name, about where it is: mm in the arm's base frame.",
    )];
    with_words(schema_of::<RawScene>(), "A scene for the light stripe", &words)
}

/// Reads a scene: the surfaces in the order of their names, about where they are, mm in the arm's base frame.
///
/// # Errors
/// [`SceneError`]
pub fn read_scene(path: &Path) -> Result<Vec<(String, Surface)>, SceneError> {
    let text = read_document(path, FileKind::SCENE)?;
    parse(&text, path)
}

fn parse(text: &str, file: &Path) -> Result<Vec<(String, Surface)>, SceneError> {
    let problems = Problems::default();
    let root = parse_as(DocumentKind::Scene, file, text, &problems)?;
    let raw: Option<RawScene> = typed(&root, "a scene", &problems);
    let surfaces = raw.map(|raw| raw.checked(&root, &problems));
    problems.into_result(file, text)?;
    surfaces.ok_or_else(|| FileProblems::whole_file(file, "this is no scene", "").into())
}

impl RawScene {
    fn checked(self, root: &Node, problems: &Problems) -> Vec<(String, Surface)> {
        let surfaces = root.get("surfaces");
        if surfaces.is_some_and(|node| matches!(&node.value, NodeValue::Map(entries) if entries.is_empty())) {
            let help = "name one, as in `table: {plane: {normal: [0, 0, 1], offset_mm: 0}}`";
            problems.add(root.span_at(&["surfaces"]), "`surfaces` names none", help);
        }
        self.surfaces
            .into_iter()
            .map(|(name, raw)| {
                let node = surfaces.and_then(|node| node.get(&name)).unwrap_or(root);
                let surface = raw.surface(node, problems);
                (name, surface)
            })
            .collect()
    }
}

impl RawSurface {
    /// The surface; numbers that could not be read are NaN, and not looked at.
    fn surface(&self, node: &Node, problems: &Problems) -> Surface {
        let lengths = match self {
            Self::Plane { .. } => Vec::new(),
            Self::Pyramid { edge_mm, height_mm, .. } => {
                vec![("pyramid", "edge_mm", *edge_mm), ("pyramid", "height_mm", *height_mm)]
            }
            Self::Sphere { radius_mm, .. } => vec![("sphere", "radius_mm", *radius_mm)],
        };
        for (form, key, value) in lengths.into_iter().filter(|(_, _, value)| *value <= 0.0) {
            problems.add(node.span_at(&[form, key]), format!("`{key}` is {value}"), "it is above 0");
        }
        match self {
            Self::Plane { normal, offset_mm } => {
                let normal = Vector3::from(*normal);
                // It need not be a unit vector, but it must point somewhere.
                if normal.norm() <= SHORTEST_NORMAL {
                    let help = "write for example [0, 0, 1]";
                    problems.add(node.span_at(&["plane", "normal"]), "`normal` has no length", help);
                }
                Surface::plane(normal, *offset_mm)
            }
            Self::Pyramid { apex_mm, edge_mm, height_mm, yaw_deg } => {
                Surface::pyramid(Point3::from(*apex_mm), *edge_mm, *height_mm, yaw_deg.to_radians())
            }
            Self::Sphere { centre_mm, radius_mm } => Surface::Sphere(Point3::from(*centre_mm), *radius_mm),
        }
    }
}

/// A normal shorter than this has no direction; it is given without a unit.
const SHORTEST_NORMAL: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_read_and_its_mistakes_are_reported() {
        let good = "surfaces:\n  table: {plane: {normal: [0, 0, 2], offset_mm: -300}}\n  ball: {sphere: {centre_mm: [1, 2, 3], radius_mm: 25}}\n";
        let scene = parse(good, Path::new("scene.yaml")).unwrap();
        assert_eq!(scene.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["ball", "table"]);
        let refusal = |from: &str, to: &str| {
            parse(&good.replace(from, to), Path::new("scene.yaml")).err().map(|e| e.to_string())
        };
        let message = refusal("radius_mm: 25", "radius_mm: -1").unwrap();
        assert_eq!(
            message,
            "scene.yaml:3:52: `radius_mm` is -1\n    3 |   ball: {sphere: {centre_mm: [1, 2, 3], radius_mm: -1}}\n      |                                                    ^^\n  = it is above 0\n"
        );
        assert!(refusal("[0, 0, 2]", "[0, 0, 0]").unwrap().contains("`normal` has no length"));
        assert!(refusal("sphere", "cone").unwrap().contains("unknown key `cone` in `ball`"));
        let two = refusal("[0, 0, 2], offset_mm", "[0, 0, 0], ofset_mm").unwrap();
        assert!(two.contains("did you mean `offset_mm`?") && two.contains("`normal` has no length"), "{two}");
        assert!(parse("surfaces: {}", Path::new("scene.yaml")).is_err());
    }

    #[test]
    fn a_normal_has_a_length_that_rounding_does_not_make() {
        let with = |length: f64| {
            let text =
                format!("surfaces:\n  table: {{plane: {{normal: [0, {length:e}, 0], offset_mm: -300}}}}\n");
            parse(&text, Path::new("scene.yaml")).is_ok()
        };
        assert!(with(1.5 * SHORTEST_NORMAL) && with(-1.5 * SHORTEST_NORMAL));
        assert!(!with(0.7 * SHORTEST_NORMAL));
    }
}
