//! From links and joints to a chain of distal rows.

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Translation3, Vector3};

use super::read::{Does, Robot, UrdfJoint};
use super::{UrdfArm, UrdfError};
use crate::chain::{Chain, Convention, Joint, Motion};
use crate::gravity::Mass;
use crate::link_frames::LinkFrames;

/// Axes leaning less than this count as parallel, rad.
const PARALLEL: f64 = 1e-6;

/// The rows of the arm between the root link and a tip, the link named or the only one that can be meant.
///
/// # Errors
/// Every [`UrdfError`] but those of the file's form.
pub(super) fn arm(robot: &Robot, tip: Option<&str>) -> Result<UrdfArm, UrdfError> {
    let root = root_of(robot).map_err(|error| match error {
        // A joint that ends nowhere leaves the links beyond it without a root.
        UrdfError::NoTree(_) => robot.joints.iter().find_map(|joint| joint.fault.clone()).unwrap_or(error),
        other => other,
    })?;
    let tip = tip_of(robot, &root, tip)?;
    let path = path_to(robot, &tip);
    let moving = moving_joints(&path, &root)?;
    if moving.is_empty() {
        return Err(UrdfError::NothingMoves { root, tip });
    }
    let frames = frames(&path);
    let (root_from_base, rows) = rows(&axes(&path, &frames), &moving);
    let chain = Chain::new(Convention::Distal, rows)?;
    let link_frames = LinkFrames::of(&chain, &[], &[]);
    let at_tip = frames.last().copied().unwrap_or_else(IsometryMatrix3::identity);
    let notes = match robot.joints.len() - path.len() {
        0 => Vec::new(),
        count => vec![format!("{count} joints that do not lead to `{tip}` are left aside")],
    };
    Ok(UrdfArm {
        name: robot.name.clone(),
        masses: masses(robot, &path, &frames, &root_from_base, &link_frames),
        ends: (root, tip),
        chain,
        root_from_base,
        flange_from_tip: (root_from_base * link_frames.flange).inverse() * at_tip,
        notes,
    })
}

/// The joints of a path that move.
///
/// # Errors
/// The path does not begin at the root, a joint of it is faulty, or one that moves follows another.
fn moving_joints<'r>(path: &[&'r UrdfJoint], root: &str) -> Result<Vec<&'r UrdfJoint>, UrdfError> {
    if path.first().is_some_and(|first| first.parent != root) {
        let names: Vec<&str> = path.iter().map(|joint| joint.name.as_str()).collect();
        return Err(UrdfError::NoTree(format!(
            "the joints {} go in a circle, a closed loop, and do not begin at `{root}`: leave the joint out that closes it",
            names.join(", ")
        )));
    }
    if let Some(fault) = path.iter().find_map(|joint| joint.fault.clone()) {
        return Err(fault);
    }
    let moving: Vec<&UrdfJoint> = path.iter().copied().filter(|joint| joint.does != Does::Nothing).collect();
    match moving.iter().find(|joint| joint.mimics.is_some()) {
        Some(joint) => Err(UrdfError::Element {
            line: joint.line,
            element: format!("joint `{}`", joint.name),
            reason: format!(
                "it mimics joint `{}`: it has no coordinate of its own; leave <mimic> out where a motor drives it, or make it fixed",
                joint.mimics.as_deref().unwrap_or("another")
            ),
        }),
        None => Ok(moving),
    }
}

/// The axes of the joints of a path that move; `frames` are those of its joints.
fn axes(path: &[&UrdfJoint], frames: &[IsometryMatrix3<f64>]) -> Vec<Axis> {
    let moving = path.iter().zip(frames).filter(|(joint, _)| joint.does != Does::Nothing);
    let axis = |(joint, frame): (&&UrdfJoint, &IsometryMatrix3<f64>)| Axis {
        along: frame.rotation * joint.axis,
        through: frame.translation.vector,
    };
    moving.map(axis).collect()
}

/// A joint's axis at coordinates zero, root frame.
struct Axis {
    along: Vector3<f64>,
    through: Vector3<f64>,
}

fn root_of(robot: &Robot) -> Result<String, UrdfError> {
    for (index, joint) in robot.joints.iter().enumerate() {
        if let Some(first) = robot.joints.iter().take(index).find(|other| other.child == joint.child) {
            return Err(UrdfError::ClosedLoop {
                line: joint.line,
                link: joint.child.clone(),
                first: first.name.clone(),
                second: joint.name.clone(),
            });
        }
    }
    let hangs = |link: &str| robot.joints.iter().any(|joint| joint.child == link);
    let roots: Vec<&str> =
        robot.links.iter().map(|link| link.name.as_str()).filter(|link| !hangs(link)).collect();
    match roots.as_slice() {
        [root] => Ok((*root).to_owned()),
        [] if robot.links.is_empty() => Err(UrdfError::NoTree("the file has no links".to_owned())),
        [] => Err(UrdfError::NoTree(
            "every link hangs on another: the joints go in a circle, a closed loop, and no link is the base; leave the joint out that closes it"
                .to_owned(),
        )),
        several => Err(UrdfError::NoTree(format!(
            "several links hang on nothing ({}): one is the base; join the others to it by fixed joints, or take them out",
            several.join(", ")
        ))),
    }
}

fn tip_of(robot: &Robot, root: &str, requested: Option<&str>) -> Result<String, UrdfError> {
    if let Some(requested) = requested {
        return match robot.links.iter().find(|link| link.name == requested) {
            Some(link) => Ok(link.name.clone()),
            None => {
                let known: Vec<&str> = robot.links.iter().map(|link| link.name.as_str()).collect();
                Err(UrdfError::UnknownTip { requested: requested.to_owned(), known: known.join(", ") })
            }
        };
    }
    let bears = |link: &str| robot.joints.iter().any(|joint| joint.parent == link);
    let mut leaves: Vec<&str> = Vec::new();
    for leaf in robot.links.iter().map(|link| link.name.as_str()).filter(|link| !bears(link)) {
        let hand = before_fingers(robot, leaf);
        if !leaves.contains(&hand) {
            leaves.push(hand);
        }
    }
    let moving = |tip: &str| {
        path_to(robot, tip)
            .iter()
            .filter(|joint| joint.does != Does::Nothing && joint.mimics.is_none())
            .count()
    };
    let counted: Vec<(&str, usize)> = leaves.into_iter().map(|leaf| (leaf, moving(leaf))).collect();
    let most = counted.iter().map(|(_, count)| *count).max().unwrap_or(0);
    let longest: Vec<&str> =
        counted.iter().filter(|(_, count)| *count == most).map(|(leaf, _)| *leaf).collect();
    let last_moving = |tip: &str| {
        path_to(robot, tip)
            .iter()
            .rev()
            .find(|joint| joint.does != Does::Nothing)
            .map(|joint| joint.name.clone())
    };
    match longest.as_slice() {
        [] => Ok(root.to_owned()),
        // Several frames fixed to the same last link are one arm: the first is as good as the others.
        [first, rest @ ..] if rest.iter().all(|other| last_moving(other) == last_moving(first)) => {
            Ok((*first).to_owned())
        }
        several => Err(UrdfError::Branches(several.join(", "))),
    }
}

/// The link that bears the fingers a leaf belongs to, or the leaf itself: joints at the end that follow one another are a gripper's,
/// not the arm's.
fn before_fingers<'r>(robot: &'r Robot, leaf: &'r str) -> &'r str {
    let follows =
        |joint: &UrdfJoint| robot.joints.iter().any(|other| other.mimics.as_deref() == Some(&joint.name));
    let path = path_to(robot, leaf);
    let last = path.iter().rposition(|joint| joint.does != Does::Nothing);
    match last.and_then(|last| path.get(last).copied()) {
        Some(joint) if joint.mimics.is_some() || follows(joint) => before_fingers(robot, &joint.parent),
        _ => leaf,
    }
}

/// The joints from the root to a link.
fn path_to<'r>(robot: &'r Robot, tip: &str) -> Vec<&'r UrdfJoint> {
    let mut path = Vec::new();
    let mut link = tip;
    while let Some(joint) = robot.joints.iter().find(|joint| joint.child == link) {
        if path.iter().any(|known: &&UrdfJoint| known.name == joint.name) {
            break;
        }
        path.push(joint);
        link = &joint.parent;
    }
    path.reverse();
    path
}

/// The child's frame of each joint of the path at coordinates zero, root frame.
fn frames(path: &[&UrdfJoint]) -> Vec<IsometryMatrix3<f64>> {
    let mut frame = IsometryMatrix3::identity();
    path.iter()
        .map(|joint| {
            frame *= joint.origin;
            frame
        })
        .collect()
}

/// Distal rows for axes: each row's x is the common normal of its axis and the next; where axes are parallel, the normal through where the frame is.
fn rows(axes: &[Axis], joints: &[&UrdfJoint]) -> (IsometryMatrix3<f64>, Vec<Joint>) {
    let Some(first) = axes.first() else { return (IsometryMatrix3::identity(), Vec::new()) };
    let mut z = first.along;
    let mut x = square_to(&z);
    // Nearest to the root's origin on the first axis.
    let mut origin = first.through - z * first.through.dot(&z);
    let base = frame(&x, &z, &origin);
    let mut rows = Vec::new();
    for (index, joint) in joints.iter().enumerate() {
        let (mut a, mut alpha, mut d, mut theta) = (0.0, 0.0, 0.0, 0.0);
        if let Some(next) = axes.get(index + 1) {
            let cross = z.cross(&next.along);
            let between = next.through - origin;
            let (normal, foot, far) = if cross.norm() < PARALLEL {
                let across = between - z * between.dot(&z);
                let normal = across.try_normalize(1e-9).unwrap_or(x);
                (normal, origin, origin + across)
            } else {
                // Nearest points of the two axes.
                let normal = cross.normalize();
                let on_first = next.along.cross(&cross).dot(&between) / cross.norm_squared();
                let foot = origin + z * on_first;
                let far = foot + normal * between.dot(&normal);
                (if normal.dot(&x) < 0.0 { -normal } else { normal }, foot, far)
            };
            d = (foot - origin).dot(&z);
            a = (far - foot).dot(&normal);
            theta = turn_about(&z, &x, &normal);
            alpha = turn_about(&normal, &z, &next.along);
            (x, z, origin) = (normal, next.along, far);
        }
        let mut row = Joint::turning(&joint.name, a, alpha, d, theta);
        if joint.does == Does::Slides {
            row.motion = Motion::Slides;
        }
        if let Some(limits) = joint.limits {
            row.limits = limits;
        }
        rows.push(row);
    }
    (base, rows)
}

fn frame(x: &Vector3<f64>, z: &Vector3<f64>, origin: &Vector3<f64>) -> IsometryMatrix3<f64> {
    let axes = Matrix3::from_columns(&[*x, z.cross(x), *z]);
    IsometryMatrix3::from_parts(Translation3::from(*origin), Rotation3::from_matrix_unchecked(axes))
}

/// From one direction to another about an axis square to both.
fn turn_about(axis: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    axis.dot(&from.cross(to)).atan2(from.dot(to))
}

fn square_to(direction: &Vector3<f64>) -> Vector3<f64> {
    let least = if direction.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    (least - direction * direction.dot(&least)).normalize()
}

/// Masses of links, each in the frame of the last row before it; those before the first joint do not move.
fn masses(
    robot: &Robot,
    path: &[&UrdfJoint],
    frames: &[IsometryMatrix3<f64>],
    root_from_base: &IsometryMatrix3<f64>,
    link_frames: &LinkFrames,
) -> Vec<Mass> {
    let mut masses = Vec::new();
    let mut moving = 0;
    for (joint, frame) in path.iter().zip(frames) {
        moving += usize::from(joint.does != Does::Nothing);
        let link = robot.links.iter().find(|link| link.name == joint.child);
        let (Some((mass, centre)), Some(after)) = (link.and_then(|link| link.mass), moving.checked_sub(1))
        else {
            continue;
        };
        let Some(row) = link_frames.joints.get(after) else { continue };
        let position = (root_from_base * row.end).inverse() * (frame * Point3::from(centre));
        masses.push(Mass { after, mass, centre: position.coords });
    }
    masses
}
