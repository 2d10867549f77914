//! From XML to links and joints.

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};
use roxmltree::{Document, Node};

use super::UrdfError;

const MM_PER_M: f64 = 1e3;

/// Lengths beyond this are no metres of an arm.
const LONGEST_M: f64 = 20.0;

/// Limits beyond this, rad, are written where none are meant.
const ENDLESS: f64 = 1e4;

/// What a joint does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Does {
    Nothing,
    Turns,
    TurnsOn,
    Slides,
}

/// A joint as typed, in mm and rad.
#[derive(Debug, Clone)]
pub(super) struct UrdfJoint {
    pub(super) name: String,
    pub(super) line: u32,
    pub(super) does: Does,
    pub(super) parent: String,
    pub(super) child: String,
    /// Pose of the child's frame in the parent's at coordinate zero.
    pub(super) origin: IsometryMatrix3<f64>,
    /// In the child's frame, unit length.
    pub(super) axis: Vector3<f64>,
    pub(super) limits: Option<(f64, f64)>,
    pub(super) mimics: Option<String>,
    /// What is wrong with it: reported only if the joint is part of the arm.
    pub(super) fault: Option<UrdfError>,
}

/// A link as typed.
#[derive(Debug, Clone)]
pub(super) struct UrdfLink {
    pub(super) name: String,
    /// kg, and its centre in the link's frame, mm.
    pub(super) mass: Option<(f64, Vector3<f64>)>,
}

/// The whole file.
#[derive(Debug, Clone)]
pub(super) struct Robot {
    pub(super) name: String,
    pub(super) links: Vec<UrdfLink>,
    pub(super) joints: Vec<UrdfJoint>,
}

pub(super) fn robot(text: &str) -> Result<Robot, UrdfError> {
    let document = Document::parse(text)
        .map_err(|error| UrdfError::Syntax { line: error.pos().row, reason: error.to_string() })?;
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        return Err(UrdfError::NotARobot(root.tag_name().name().to_owned()));
    }
    let named = |tag: &'static str| root.children().filter(move |node| node.has_tag_name(tag));
    let links: Result<Vec<UrdfLink>, UrdfError> = named("link").map(|node| link(&node)).collect();
    let links = links?;
    let joints: Result<Vec<UrdfJoint>, UrdfError> = named("joint").map(|node| joint(&node, &links)).collect();
    let name = root.attribute("name").unwrap_or("arm").to_owned();
    Ok(Robot { name, links, joints: joints? })
}

fn line_of(node: &Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

fn refuse<T>(node: &Node<'_, '_>, element: &str, reason: impl Into<String>) -> Result<T, UrdfError> {
    Err(UrdfError::Element { line: line_of(node), element: element.to_owned(), reason: reason.into() })
}

fn link(node: &Node<'_, '_>) -> Result<UrdfLink, UrdfError> {
    let Some(name) = node.attribute("name") else { return refuse(node, "a link", "it has no name") };
    let element = format!("link `{name}`");
    let inertial = node.children().find(|child| child.has_tag_name("inertial"));
    let mass = inertial.and_then(|inertial| {
        let mass = inertial.children().find(|child| child.has_tag_name("mass"))?;
        Some((inertial, mass))
    });
    let mass = match mass {
        Some((inertial, mass)) => {
            let kg = number(&mass, &element, "value")?;
            if kg < 0.0 {
                return refuse(&mass, &element, format!("a mass of {kg} kg cannot be"));
            }
            let origin = origin_of(&inertial, &element)?;
            (kg > 0.0).then_some((kg, origin.translation.vector))
        }
        None => None,
    };
    Ok(UrdfLink { name: name.to_owned(), mass })
}

fn joint(node: &Node<'_, '_>, links: &[UrdfLink]) -> Result<UrdfJoint, UrdfError> {
    let Some(name) = node.attribute("name") else { return refuse(node, "a joint", "it has no name") };
    let element = format!("joint `{name}`");
    let child_of = |tag: &str| node.children().find(|child| child.has_tag_name(tag));
    let end = |tag: &str| -> Result<String, UrdfError> {
        let Some(found) = child_of(tag).and_then(|end| end.attribute("link").map(str::to_owned)) else {
            return refuse(node, &element, format!("it needs <{tag} link=\"...\"/>"));
        };
        Ok(found)
    };
    let mimics = child_of("mimic").map(|mimic| mimic.attribute("joint").unwrap_or("another").to_owned());
    let mut read = UrdfJoint {
        name: name.to_owned(),
        line: line_of(node),
        does: Does::Turns,
        parent: end("parent")?,
        child: end("child")?,
        origin: IsometryMatrix3::identity(),
        axis: Vector3::x(),
        limits: None,
        mimics,
        fault: None,
    };
    let strange = [("parent", &read.parent), ("child", &read.child)]
        .into_iter()
        .find(|(_, end)| !links.iter().any(|link| link.name == **end))
        .map(|(tag, end)| format!("its {tag} `{end}` is no link of the file"));
    let moves = match strange {
        Some(reason) => refuse(node, &element, reason),
        None => motion(node, &element, &mut read),
    };
    read.fault = moves.err();
    Ok(read)
}

/// How a joint moves, and where it is.
fn motion(node: &Node<'_, '_>, element: &str, joint: &mut UrdfJoint) -> Result<(), UrdfError> {
    let child_of = |tag: &str| node.children().find(|child| child.has_tag_name(tag));
    joint.does = match node.attribute("type") {
        Some("fixed") => Does::Nothing,
        Some("revolute") => Does::Turns,
        Some("continuous") => Does::TurnsOn,
        Some("prismatic") => Does::Slides,
        Some(other) => {
            let reason = format!(
                "its type is `{other}`; an arm's joints are revolute, continuous, prismatic or fixed"
            );
            return refuse(node, element, reason);
        }
        None => return refuse(node, element, "it has no `type`: revolute, continuous, prismatic or fixed"),
    };
    joint.origin = origin_of(node, element)?;
    if joint.does == Does::Nothing {
        return Ok(());
    }
    let axis = match child_of("axis") {
        Some(axis) => triple(&axis, element, "xyz")?.unwrap_or_else(Vector3::x),
        None => Vector3::x(),
    };
    let Some(axis) = axis.try_normalize(1e-9) else {
        return refuse(node, element, "its axis has no direction; write for example xyz=\"0 0 1\"");
    };
    joint.axis = axis;
    joint.limits = limits(node, child_of("limit"), element, joint.does)?;
    Ok(())
}

fn limits(
    node: &Node<'_, '_>,
    limit: Option<Node<'_, '_>>,
    element: &str,
    does: Does,
) -> Result<Option<(f64, f64)>, UrdfError> {
    let scale = match does {
        Does::Nothing | Does::TurnsOn => return Ok(None),
        Does::Turns => 1.0,
        Does::Slides => MM_PER_M,
    };
    let Some(limit) = limit else {
        let kind = if does == Does::Turns { "revolute" } else { "prismatic" };
        let else_ =
            if does == Does::Turns { ", or the type `continuous` if it turns without end" } else { "" };
        return refuse(
            node,
            element,
            format!("a {kind} joint needs <limit lower=\"...\" upper=\"...\"/>{else_}"),
        );
    };
    // The format's own rule: what is not written is 0.
    let or_zero = |name: &str| match limit.attribute(name) {
        Some(_) => number(&limit, element, name),
        None => Ok(0.0),
    };
    let (lower, upper) = (or_zero("lower")?, or_zero("upper")?);
    if lower >= upper {
        let reason = format!(
            "its limits {lower} and {upper} hold no pose; write the lower and the upper{}",
            if does == Does::Turns { ", or the type `continuous` if it turns without end" } else { "" }
        );
        return refuse(&limit, element, reason);
    }
    if does == Does::Turns && lower.min(-upper) < -ENDLESS {
        return Ok(None);
    }
    if does == Does::Turns && lower.abs().max(upper.abs()) > 30.0 {
        let reason = format!(
            "its limits {lower} and {upper} look like degrees: URDF counts in radians, and a joint that does turn so often is of the type `continuous`"
        );
        return refuse(&limit, element, reason);
    }
    if does == Does::Slides && lower.abs().max(upper.abs()) > LONGEST_M {
        let reason = format!("its limits {lower} and {upper} look like millimetres: URDF counts in metres");
        return refuse(&limit, element, reason);
    }
    Ok(Some((lower * scale, upper * scale)))
}

fn origin_of(node: &Node<'_, '_>, element: &str) -> Result<IsometryMatrix3<f64>, UrdfError> {
    let Some(origin) = node.children().find(|child| child.has_tag_name("origin")) else {
        return Ok(IsometryMatrix3::identity());
    };
    let xyz = triple(&origin, element, "xyz")?.unwrap_or_else(Vector3::zeros);
    let rpy = triple(&origin, element, "rpy")?.unwrap_or_else(Vector3::zeros);
    if xyz.amax() > LONGEST_M {
        let reason = format!(
            "its origin lies {:.0} away: that looks like millimetres; URDF counts in metres",
            xyz.amax()
        );
        return refuse(&origin, element, reason);
    }
    if rpy.amax() > 7.0 {
        let reason = format!(
            "its origin is turned by {:.0}: that looks like degrees; URDF counts in radians",
            rpy.amax()
        );
        return refuse(&origin, element, reason);
    }
    let turn = Rotation3::from_euler_angles(rpy.x, rpy.y, rpy.z);
    Ok(IsometryMatrix3::from_parts(Translation3::from(xyz * MM_PER_M), turn))
}

fn number(node: &Node<'_, '_>, element: &str, attribute: &str) -> Result<f64, UrdfError> {
    let Some(text) = node.attribute(attribute) else {
        return refuse(node, element, format!("<{}> has no `{attribute}`", node.tag_name().name()));
    };
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => refuse(node, element, format!("`{attribute}` is `{text}`, which is no number")),
    }
}

fn triple(node: &Node<'_, '_>, element: &str, attribute: &str) -> Result<Option<Vector3<f64>>, UrdfError> {
    let Some(text) = node.attribute(attribute) else { return Ok(None) };
    let numbers: Vec<f64> = text.split_whitespace().filter_map(|part| part.parse().ok()).collect();
    match numbers.as_slice() {
        [x, y, z]
            if text.split_whitespace().count() == 3 && numbers.iter().all(|number| number.is_finite()) =>
        {
            Ok(Some(Vector3::new(*x, *y, *z)))
        }
        _ => {
            refuse(node, element, format!("`{attribute}` is `{text}`; it takes three numbers between blanks"))
        }
    }
}
