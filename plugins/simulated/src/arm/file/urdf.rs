//! The chain of an arm out of a URDF file. A reader of the world's own, which shares nothing with the lab's.
//!
//! A URDF joint turns about (or slides along) an axis given in the frame of its child link. The rows of [`crate::physics`] move along their own z,
//! so each row gets a fixed motion that brings z onto that axis, and the next one begins by undoing it.

use roxmltree::{Document, Node};

use crate::physics::description::{Joint, Motion, Weight};
use crate::physics::rigid::{Rigid, Rotation, Vector};

const MM_PER_M: f64 = 1e3;

/// An arm out of a URDF file.
pub(super) struct UrdfArm {
    /// From the root to the tip, only those that move.
    pub(super) joints: Vec<Joint>,
    /// Their greatest speeds, rad/s or mm/s, where the file has them.
    pub(super) speeds: Vec<Option<f64>>,
    /// The tip's link in the frame of the last joint's row.
    pub(super) flange: Rigid,
    /// Masses of the links beyond the first joint.
    pub(super) weights: Vec<Weight>,
}

/// Why a URDF file is no arm.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum UrdfError {
    #[error("line {line}: this is no XML: {reason}")]
    Syntax { line: u32, reason: String },
    #[error("the file begins with <{0}>; a URDF file begins with <robot>")]
    NotARobot(String),
    #[error("line {line}: {what} needs {needs}")]
    Missing { line: u32, what: String, needs: &'static str },
    #[error("line {line}: `{text}` is not {right}")]
    Number { line: u32, text: String, right: &'static str },
    #[error(
        "line {line}: joint `{joint}` is {kind}; an arm's joints are revolute, continuous, prismatic or fixed"
    )]
    Kind { line: u32, joint: String, kind: String },
    #[error("there is no link `{tip}` for the tip; the links are {links}")]
    NoTip { tip: String, links: String },
    #[error("the chain of links forks: say which link is the arm's tip (`tip: LINK`), one of {0}")]
    Forks(String),
    #[error(
        "the joints {0} close a loop: an arm's links go from the root to the tip without meeting again; leave out the joint that closes the loop"
    )]
    Loop(String),
    #[error(
        "line {line}: joint `{joint}` mimics another and has no drive of its own; make it fixed, or leave <mimic> out"
    )]
    Mimics { line: u32, joint: String },
    #[error("no joint between the root and the tip moves")]
    NothingMoves,
}

/// A joint as typed.
struct Typed<'doc> {
    name: &'doc str,
    parent: &'doc str,
    child: &'doc str,
    /// None for a fixed joint.
    motion: Option<Motion>,
    /// The child's frame in the parent's, mm.
    origin: Rigid,
    /// In the child's frame, length one.
    axis: Vector,
    /// rad or mm.
    limits: [f64; 2],
    /// rad/s or mm/s.
    speed: Option<f64>,
    mimics: bool,
    line: u32,
}

/// Reads the chain from the root to `tip`; to the only end there is where none is named.
pub(super) fn read(text: &str, tip: Option<&str>) -> Result<UrdfArm, UrdfError> {
    let document = Document::parse(text)
        .map_err(|error| UrdfError::Syntax { line: error.pos().row, reason: error.to_string() })?;
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        return Err(UrdfError::NotARobot(root.tag_name().name().to_owned()));
    }
    let joints: Vec<Typed<'_>> =
        root.children().filter(|node| node.has_tag_name("joint")).map(joint).collect::<Result<_, _>>()?;
    let links: Vec<Node<'_, '_>> = root.children().filter(|node| node.has_tag_name("link")).collect();
    let names: Vec<&str> = links.iter().filter_map(|link| link.attribute("name")).collect();
    let chain = chain(&joints, tip_of(&joints, &names, tip)?)?;
    if let Some(mimic) = chain.iter().find(|joint| joint.mimics && joint.motion.is_some()) {
        return Err(UrdfError::Mimics { line: mimic.line, joint: mimic.name.to_owned() });
    }
    rows(&chain, &links)
}

/// The link at the arm's end.
fn tip_of<'doc>(
    joints: &[Typed<'doc>],
    links: &[&'doc str],
    tip: Option<&'doc str>,
) -> Result<&'doc str, UrdfError> {
    if let Some(tip) = tip {
        let found = links.iter().find(|link| **link == tip);
        let missing = || UrdfError::NoTip { tip: tip.to_owned(), links: links.join(", ") };
        return found.copied().ok_or_else(missing);
    }
    let is_parent = |link: &str| joints.iter().any(|joint| joint.parent == link);
    let ends: Vec<&str> = joints.iter().map(|joint| joint.child).filter(|link| !is_parent(link)).collect();
    match ends.as_slice() {
        [] if joints.is_empty() => Err(UrdfError::NothingMoves),
        [] => Err(UrdfError::Loop(listed(joints))),
        [end] => Ok(end),
        several if several.iter().all(|end| Some(end) == several.first()) => {
            Err(UrdfError::Loop(listed(joints)))
        }
        several => Err(UrdfError::Forks(several.join(", "))),
    }
}

/// The joints from the root to a link. Anyone who comes to more joints than there are, or to a link that two joints hold, goes in a loop.
fn chain<'all, 'doc>(
    joints: &'all [Typed<'doc>],
    tip: &'doc str,
) -> Result<Vec<&'all Typed<'doc>>, UrdfError> {
    let mut path: Vec<&Typed<'_>> = Vec::new();
    let mut link = tip;
    loop {
        let holding: Vec<&Typed<'_>> = joints.iter().filter(|joint| joint.child == link).collect();
        match holding.as_slice() {
            [] => break,
            [joint] if path.len() < joints.len() => {
                path.push(joint);
                link = joint.parent;
            }
            _ => {
                let meeting = if holding.len() > 1 { &holding } else { &path };
                let names: Vec<&str> = meeting.iter().map(|joint| joint.name).collect();
                return Err(UrdfError::Loop(names.join(", ")));
            }
        }
    }
    path.reverse();
    Ok(path)
}

fn listed(joints: &[Typed<'_>]) -> String {
    joints.iter().map(|joint| joint.name).collect::<Vec<_>>().join(", ")
}

/// The rows of a chain.
fn rows(chain: &[&Typed<'_>], links: &[Node<'_, '_>]) -> Result<UrdfArm, UrdfError> {
    let mut arm =
        UrdfArm { joints: Vec::new(), speeds: Vec::new(), flange: Rigid::IDENTITY, weights: Vec::new() };
    // The frame of the link at hand in the frame of the row before.
    let mut row_from_link = Rigid::IDENTITY;
    for joint in chain {
        row_from_link = row_from_link * joint.origin;
        if let Some(motion) = joint.motion {
            let link_from_row = Rigid::turned(onto(joint.axis));
            arm.joints.push(Joint {
                name: joint.name.to_owned(),
                motion,
                mounted: row_from_link * link_from_row,
                length: 0.0,
                twist: 0.0,
                offset: 0.0,
                rest_angle: 0.0,
                sign: 1.0,
                limits: joint.limits,
                gear_ratio: None,
                screw_pitch: None,
            });
            arm.speeds.push(joint.speed);
            row_from_link = link_from_row.inverse();
        }
        let link = links.iter().find(|link| link.attribute("name") == Some(joint.child));
        if let (Some(link), Some(after)) = (link, arm.joints.len().checked_sub(1))
            && let Some((mass, centre)) = mass(link)?
        {
            arm.weights.push(Weight { after, mass, centre: row_from_link.apply(centre) });
        }
    }
    if arm.joints.is_empty() {
        return Err(UrdfError::NothingMoves);
    }
    arm.flange = row_from_link;
    Ok(arm)
}

/// A rotation that brings z onto a direction.
fn onto(direction: Vector) -> Rotation {
    let across = Vector::Z.cross(direction);
    match across.unit() {
        Some(axis) => Rotation::about(axis, across.norm().atan2(Vector::Z.dot(direction))),
        None if direction.z < 0.0 => Rotation::about(Vector::X, std::f64::consts::PI),
        None => Rotation::IDENTITY,
    }
}

fn joint<'doc>(node: Node<'doc, '_>) -> Result<Typed<'doc>, UrdfError> {
    let line = line_of(&node);
    let missing = |what: &str, needs| UrdfError::Missing { line, what: what.to_owned(), needs };
    let name = node.attribute("name").ok_or_else(|| missing("a joint", "a name"))?;
    let what = format!("joint `{name}`");
    let child = |tag: &str| node.children().find(|child| child.has_tag_name(tag));
    let end = |tag: &'static str, needs| {
        child(tag).and_then(|end| end.attribute("link")).ok_or_else(|| missing(&what, needs))
    };
    let (motion, endless) = match node.attribute("type") {
        Some("fixed") => (None, false),
        Some("revolute") => (Some(Motion::Turns), false),
        Some("continuous") => (Some(Motion::Turns), true),
        Some("prismatic") => (Some(Motion::Slides), false),
        other => {
            let kind = other.map_or("of no type".to_owned(), |kind| format!("`{kind}`"));
            return Err(UrdfError::Kind { line, joint: name.to_owned(), kind });
        }
    };
    let axis = match child("axis") {
        Some(axis) => Vector::from(triple(&axis, "xyz")?),
        None => Vector::X,
    };
    let axis = match axis.unit() {
        Some(axis) => axis,
        None if motion.is_none() => Vector::X,
        None => return Err(missing(&what, "an axis other than 0 0 0")),
    };
    let unit = if motion == Some(Motion::Slides) { MM_PER_M } else { 1.0 };
    let limit = child("limit");
    let bound = |key| limit.map_or(Ok(None), |limit| number(&limit, key));
    let (lower, upper) = (bound("lower")?, bound("upper")?);
    let limits = match (endless, lower, upper) {
        (true, ..) => [-std::f64::consts::TAU, std::f64::consts::TAU],
        (false, None, None) if motion.is_none() => [0.0, 0.0],
        (false, lower, upper) => [lower.unwrap_or(0.0) * unit, upper.unwrap_or(0.0) * unit],
    };
    if motion.is_some() && limits[0] >= limits[1] {
        return Err(missing(&what, "<limit lower=\"...\" upper=\"...\"/>, the lower one first"));
    }
    let speed = bound("velocity")?.filter(|speed| *speed > 0.0).map(|speed| speed * unit);
    Ok(Typed {
        name,
        parent: end("parent", "<parent link=\"...\"/>")?,
        child: end("child", "<child link=\"...\"/>")?,
        motion,
        origin: origin(&node)?,
        axis,
        limits,
        speed,
        mimics: child("mimic").is_some(),
        line,
    })
}

/// Mass (kg) of a link and its centre in the link's frame, mm; none for a link without one.
fn mass(link: &Node<'_, '_>) -> Result<Option<(f64, Vector)>, UrdfError> {
    let Some(inertial) = link.children().find(|child| child.has_tag_name("inertial")) else {
        return Ok(None);
    };
    let Some(mass) = inertial.children().find(|child| child.has_tag_name("mass")) else { return Ok(None) };
    let Some(kg) = number(&mass, "value")? else { return Ok(None) };
    if kg < 0.0 {
        let text = kg.to_string();
        return Err(UrdfError::Number { line: line_of(&mass), text, right: "a mass: it is negative" });
    }
    Ok((kg > 0.0).then_some((kg, origin(&inertial)?.translation)))
}

/// The `<origin>` of a joint or of a link's inertia.
fn origin(node: &Node<'_, '_>) -> Result<Rigid, UrdfError> {
    let Some(origin) = node.children().find(|child| child.has_tag_name("origin")) else {
        return Ok(Rigid::IDENTITY);
    };
    Ok(Rigid {
        rotation: Rotation::from_roll_pitch_yaw(triple(&origin, "rpy")?),
        translation: Vector::from(triple(&origin, "xyz")?) * MM_PER_M,
    })
}

/// Three numbers; zeros where they are left out.
fn triple(node: &Node<'_, '_>, key: &str) -> Result<[f64; 3], UrdfError> {
    let Some(text) = node.attribute(key) else { return Ok([0.0; 3]) };
    let wrong =
        || UrdfError::Number { line: line_of(node), text: text.to_owned(), right: "three finite numbers" };
    let numbers: Vec<f64> =
        text.split_whitespace().map(str::parse).collect::<Result<_, _>>().map_err(|_| wrong())?;
    let numbers: [f64; 3] = numbers.try_into().map_err(|_| wrong())?;
    if numbers.iter().all(|number| number.is_finite()) { Ok(numbers) } else { Err(wrong()) }
}

/// A number; none where it is left out.
fn number(node: &Node<'_, '_>, key: &str) -> Result<Option<f64>, UrdfError> {
    let Some(text) = node.attribute(key) else { return Ok(None) };
    let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    let wrong = || UrdfError::Number { line: line_of(node), text: text.to_owned(), right: "a finite number" };
    number.map(Some).ok_or_else(wrong)
}

fn line_of(node: &Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}
