//! Before anything is fitted: can measured orientations be those of this arm as they are? Wherever base and body sit, the right convention fits the
//! nominal arm up to its errors and a wrong one does not, so that quaternions with `w` last, inverted or left-handed orientations and degrees for radians
//! are known by what would fit.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use plumb_calibration::arm_model::Model;
use plumb_calibration::fit::hand_eye::{
    SeenPose, TwoRotations, base_rotation, body_rotation, positions, rotations_left, turning, two_rotations,
};
use plumb_calibration::fit::{ResidualModel, SeenBody, State};
use plumb_calibration::table::{Body, OrientationForm, Table};
use plumb_document::counted;

use super::plausible::ImplausibleError;

/// Rows looked at, spread over the table.
const LOOKED_AT: usize = 200;

/// Pictures of a board from which a camera on the hand can be found: two turns of the hand, about different axes (Tsai & Lenz 1989).
const FEWEST_OF_A_CAMERA: usize = 3;

/// Rows fewer than these say nothing of a convention: two rotations are fitted to them.
const FEWEST: usize = 6;

/// Root mean square angle (rad) from which orientations do not go with the nominal arm: no arm that still works is 10 degrees off.
const FOREIGN: f64 = 0.175;

/// Fraction of the positions' spread that base and body may leave of them, from which orientations do not go with the positions: a quaternion with `w` last is that
/// of an inverted orientation in other axes, and only where the positions say how the base is turned are the two distinguished.
const FOREIGN_POSITIONS: f64 = 0.1;

/// What another convention may leave, in units of what is foreign, and as a fraction of what is left as it is.
const AGREES: f64 = 0.5;
const MUCH_BETTER: f64 = 0.25;

/// Factor within which two conventions fit alike.
const ALIKE: f64 = 1.5;

/// Root mean square turn (rad) across the axis of most turning, below which a hand turned about one axis only: 5 degrees.
const ONE_AXIS: f64 = 0.087;

/// Another way to read an orientation.
struct Reading {
    /// What the numbers would be, and what to do.
    what: &'static str,
    read: fn(&Rotation3<f64>) -> Rotation3<f64>,
    form: Option<OrientationForm>,
}

fn w_last(rotation: &Rotation3<f64>) -> Rotation3<f64> {
    let written = UnitQuaternion::from_rotation_matrix(rotation);
    let meant = Quaternion::new(written.k, written.w, written.i, written.j);
    UnitQuaternion::from_quaternion(meant).to_rotation_matrix()
}

fn inverted(rotation: &Rotation3<f64>) -> Rotation3<f64> {
    rotation.inverse()
}

/// Seen in a mirror: axes of the left hand.
fn mirrored(rotation: &Rotation3<f64>) -> Rotation3<f64> {
    let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
    Rotation3::from_matrix_unchecked(mirror * rotation.matrix() * mirror)
}

fn scaled(rotation: &Rotation3<f64>, factor: f64) -> Rotation3<f64> {
    Rotation3::new(UnitQuaternion::from_rotation_matrix(rotation).scaled_axis() * factor)
}

const QUATERNION: Option<OrientationForm> = Some(OrientationForm::Quaternion);
const VECTOR: Option<OrientationForm> = Some(OrientationForm::RotationVector);

/// The ways to read an orientation that people and programs differ in.
const READINGS: [Reading; 9] = [
    Reading {
        what: "with w last, in the order x, y, z, w (change the names of the columns)",
        read: w_last,
        form: QUATERNION,
    },
    Reading {
        what: "inverted, as the rotation from the measuring frame to the body's (change the sign of its last three numbers)",
        read: inverted,
        form: QUATERNION,
    },
    Reading {
        what: "inverted, as the rotation from the measuring frame to the body's (change the sign of its three numbers)",
        read: inverted,
        form: VECTOR,
    },
    Reading {
        what: "as those of left-handed axes (turn them into right-handed ones: change the sign of two of x, y and z, and of one coordinate of the positions)",
        read: mirrored,
        form: None,
    },
    Reading {
        what: "with w last, in the order x, y, z, w, and inverted (change the names of the columns, and the sign of x, y and z)",
        read: |rotation| inverted(&w_last(rotation)),
        form: QUATERNION,
    },
    Reading {
        what: "with w last, in the order x, y, z, w, of left-handed axes (change the names of the columns, and the sign of two of x, y and z)",
        read: |rotation| mirrored(&w_last(rotation)),
        form: QUATERNION,
    },
    Reading {
        what: "inverted and of left-handed axes (change the sign of one of x, y and z)",
        read: |rotation| mirrored(&inverted(rotation)),
        form: None,
    },
    Reading {
        what: "as radians (the columns then end in _rad)",
        read: |rotation| scaled(rotation, 180.0 / std::f64::consts::PI),
        form: VECTOR,
    },
    Reading {
        what: "as degrees (the columns then end in _deg)",
        read: |rotation| scaled(rotation, std::f64::consts::PI / 180.0),
        form: VECTOR,
    },
];

/// By how much poses miss the base and the body that fit best.
#[derive(Debug, Clone, Copy)]
struct Left {
    /// Root mean square angle, rad.
    angle: f64,
    /// What is left of the positions, as a fraction of their spread; 0 where none was measured.
    positions: f64,
}

impl Left {
    /// Nothing where the poses cannot determine base and body.
    fn of(poses: &[SeenPose]) -> Option<Self> {
        let found = two_rotations(poses)?;
        Some(Self { angle: rotations_left(poses, &found), positions: positions_left(poses, &found) })
    }

    /// Of orientations that do not turn as the flange does: they say nothing of base and body, and there is no angle.
    const STILL: Self = Self { angle: f64::INFINITY, positions: 0.0 };

    /// The worse of both, 1 where it is foreign.
    fn size(self) -> f64 {
        (self.angle / FOREIGN).max(self.positions / FOREIGN_POSITIONS)
    }
}

/// What base and body leave of the positions, as a fraction of their spread.
fn positions_left(poses: &[SeenPose], found: &TwoRotations) -> f64 {
    let none = (Vector3::zeros(), Vector3::zeros());
    let (origin, body) = positions(poses, &found.base, none, (true, true));
    let whole = poses.iter().map(|pose| (pose, pose.seen.translation.vector));
    let whole = whole.filter(|(_, seen)| seen.iter().all(|part| part.is_finite()));
    let whole: Vec<(&SeenPose, Vector3<f64>)> = whole.collect();
    let middle = whole.iter().map(|(_, seen)| seen).sum::<Vector3<f64>>() / whole.len().max(1) as f64;
    let (mut off, mut spread) = (0.0, 0.0);
    for (pose, seen) in &whole {
        let believed = found.base * (pose.flange.rotation * body + pose.flange.translation.vector) + origin;
        off += (seen - believed).norm_squared();
        spread += (seen - middle).norm_squared();
    }
    if spread > 0.0 { (off / spread).sqrt() } else { 0.0 }
}

/// The poses with every measured orientation read another way. Those of a camera are the inverse of what was measured of the board.
fn read_as(poses: &[SeenPose], body: SeenBody, read: fn(&Rotation3<f64>) -> Rotation3<f64>) -> Vec<SeenPose> {
    poses
        .iter()
        .map(|pose| {
            let of_board = matches!(body, SeenBody::Board(_));
            // The slip is in what was written down, so it is undone there.
            let mut measured = if of_board { pose.seen.inverse() } else { pose.seen };
            measured.rotation = read(&measured.rotation);
            SeenPose { seen: if of_board { measured.inverse() } else { measured }, ..*pose }
        })
        .collect()
}

fn name_of(model: &Model, body: SeenBody) -> String {
    match body {
        SeenBody::Board(board) => match model.board_name(board) {
            "board" => "the board".to_owned(),
            name => format!("the board {name}"),
        },
        SeenBody::Target(target) => {
            model.targets.get(target).map_or_else(|| "?".to_owned(), |target| target.name.clone())
        }
    }
}

fn form_of(model: &Model, table: &Table, body: SeenBody) -> Option<OrientationForm> {
    let columns = match body {
        SeenBody::Board(_) => table.orientations_as(Body::Board),
        SeenBody::Target(target) => {
            model.targets.get(target).and_then(|target| table.orientations_of(&target.name))
        }
    };
    columns.map(|columns| columns.form)
}

/// Looks at all orientations of a table.
///
/// # Errors
/// Orientations in a convention that can be recognized.
pub(super) fn check(problem: &ResidualModel<'_>) -> Result<Vec<String>, ImplausibleError> {
    let (model, table) = (problem.model, problem.table);
    let state = problem.start();
    let rows: Vec<usize> = (0..table.len()).step_by(table.len().div_ceil(LOOKED_AT).max(1)).collect();
    let mut odd = Vec::new();
    let bodies = problem.seen_bodies();
    let determined_by: Vec<SeenBody> =
        bodies.iter().copied().filter(|body| determines_its_camera(problem, &state, *body)).collect();
    for body in bodies {
        let poses = problem.seen_poses(&state, &rows, body);
        let name = name_of(model, body);
        // Where another board shows how the camera sits, one picture shows where this one lies.
        let elsewhere =
            determined_by.iter().any(|other| *other != body && other.target(problem) == body.target(problem));
        odd.extend(match matches!(body, SeenBody::Board(_)) && elsewhere {
            true => in_few_pictures(problem, &state, body),
            false => one_axis(problem, &poses, body),
        });
        if poses.len() < FEWEST {
            continue;
        }
        // Where the flange turns about several axes and what was seen does not follow, the two rotations have no solution, and that is the finding.
        let turns = turning(&poses).is_some_and(|(_, across)| across >= ONE_AXIS);
        let Some(as_given) = Left::of(&poses).or_else(|| turns.then_some(Left::STILL)) else { continue };
        if as_given.size() < 1.0 {
            odd.extend(held_otherwise(problem, &state, &poses, body));
            continue;
        }
        let others = others(&poses, body, form_of(model, table, body));
        if let Some((best, _)) = others.first()
            && best.size() < AGREES.min(MUCH_BETTER * as_given.size())
        {
            // On few poses several slips can leave about as little: all that do are named.
            let alike = others.iter().filter(|(left, _)| left.size() <= ALIKE * best.size());
            let whats: Vec<&str> = alike.map(|(_, reading)| reading.what).collect();
            return Err(ImplausibleError::Orientation {
                table: table.source.clone(),
                body: name,
                off: off_in_words(as_given),
                what: whats.join(", or "),
                left_deg: best.angle.to_degrees(),
            });
        }
        if as_given.angle >= FOREIGN {
            odd.push(format!(
                "the orientations of {name} have little to do with those the model expects: {}; check the order and the signs of the joints, the model's rows, \
                 and which axes were measured",
                off_in_words(as_given)
            ));
        }
    }
    Ok(odd)
}

/// What the other readings leave, the best first.
fn others(
    poses: &[SeenPose],
    body: SeenBody,
    form: Option<OrientationForm>,
) -> Vec<(Left, &'static Reading)> {
    let asked = READINGS.iter().filter(|reading| reading.form.is_none() || reading.form == form);
    let left = asked.filter_map(|reading| Some((Left::of(&read_as(poses, body, reading.read))?, reading)));
    let mut left: Vec<(Left, &Reading)> = left.collect();
    left.sort_by(|one, other| one.0.size().total_cmp(&other.0.size()));
    left
}

/// What does not go together.
fn off_in_words(left: Left) -> String {
    if !left.angle.is_finite() {
        return "they do not turn as the flange does".to_owned();
    }
    match left.angle >= FOREIGN {
        true => format!("{:.0} deg of them are left wherever base and body sit", left.angle.to_degrees()),
        false => format!(
            "with base and body turned as they ask for, {:.0} % of the places' spread is left",
            100.0 * left.positions
        ),
    }
}

/// What to say where the orientations fit the arm, but not with the base and the body as the model holds them.
fn held_otherwise(
    problem: &ResidualModel<'_>,
    state: &State,
    poses: &[SeenPose],
    body: SeenBody,
) -> Option<String> {
    let model = problem.model;
    let index = body.target(problem);
    let target = model.targets.get(index)?;
    let rotation = state.rotations.get(index)?;
    let (base, base_free) = match body {
        SeenBody::Target(_) => (state.base.rotation, model.base.free),
        SeenBody::Board(board) => {
            let board_is_free = model.boards.get(board).is_some_and(|board| board.free);
            let seen = state.boards.get(board)?.rotation;
            (seen.inverse() * state.base.rotation, board_is_free || model.base.free)
        }
    };
    let held = match (base_free, target.rotation_free) {
        (true, true) => return None,
        (true, false) => TwoRotations { base: base_rotation(poses, rotation)?, body: *rotation },
        (false, true) => TwoRotations { base, body: body_rotation(poses, &base)? },
        (false, false) => TwoRotations { base, body: *rotation },
    };
    let off = rotations_left(poses, &held);
    if off < FOREIGN {
        return None;
    }
    let found = two_rotations(poses)?;
    let mut would = Vec::new();
    if !target.rotation_free {
        would.push(format!("`rpy_deg: {}` of {}", rpy(&found.body), target.name));
    }
    if !base_free {
        let base = match body {
            SeenBody::Target(_) => found.base,
            SeenBody::Board(board) => state.boards.get(board)?.rotation * found.base,
        };
        would.push(format!("`rpy_deg: {}` of the base", rpy(&base)));
    }
    Some(format!(
        "the orientations of {} are {:.0} deg off as the model holds base and {}: {} would fit; put that into the model, or free it",
        name_of(model, body),
        off.to_degrees(),
        target.name,
        would.join(" with ")
    ))
}

/// A rotation as a model file has it after `rpy_deg:`.
fn rpy(rotation: &Rotation3<f64>) -> String {
    let (roll, pitch, yaw) = rotation.euler_angles();
    let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_degrees);
    format!("[{roll:.1}, {pitch:.1}, {yaw:.1}]")
}

/// Whether a board was seen from so many sides that it shows how its camera sits.
fn determines_its_camera(problem: &ResidualModel<'_>, state: &State, body: SeenBody) -> bool {
    let all: Vec<usize> = (0..problem.table.len()).collect();
    let poses = problem.seen_poses(state, &all, body);
    let turned = turning(&poses).is_some_and(|(_, across)| across >= ONE_AXIS);
    matches!(body, SeenBody::Board(_)) && poses.len() >= FEWEST_OF_A_CAMERA && turned
}

/// What to say of a board in so few pictures that nothing shows whether it was found rightly.
fn in_few_pictures(problem: &ResidualModel<'_>, state: &State, body: SeenBody) -> Option<String> {
    let all: Vec<usize> = (0..problem.table.len()).collect();
    let pictures = problem.seen_poses(state, &all, body).len();
    (pictures < FEWEST_OF_A_CAMERA).then(|| {
        let name = name_of(problem.model, body);
        let times = counted(pictures, "picture", "pictures");
        format!("{name} is in {times} only: its place follows from the camera as the other boards give it, and hardly anything confirms it; take 3 at least, from several sides")
    })
}

/// What to say where the hand turned about one axis only, and of what cannot be found then.
fn one_axis(problem: &ResidualModel<'_>, poses: &[SeenPose], body: SeenBody) -> Option<String> {
    let model = problem.model;
    let target = model.targets.get(body.target(problem))?;
    let (other, other_is_free) = match body {
        SeenBody::Board(board) => {
            let free = model.base.free || model.boards.get(board).is_some_and(|board| board.free);
            (name_of(model, body), free)
        }
        SeenBody::Target(_) => ("the base".to_owned(), model.base.free),
    };
    if !other_is_free || !(target.free || target.rotation_free) || poses.is_empty() {
        return None;
    }
    let name = &target.name;
    let (axis, across) = turning(poses).unwrap_or((Vector3::z(), 0.0));
    if poses.len() > 1 && across >= ONE_AXIS {
        return None;
    }
    if poses.len() < FEWEST_OF_A_CAMERA {
        let few = counted(poses.len(), "pose", "poses");
        return Some(format!(
            "{few} with an orientation cannot determine how {name} sits on the flange and where {other} is: measure three at least, between which the hand turns about different \
             axes; ten and more show how sure it is"
        ));
    }
    Some(format!(
        "between all poses the hand turned about one axis only ([{:.2}, {:.2}, {:.2}] in the base's frame): how far {name} sits along it, and how it is turned about it, cannot \
         be distinguished from {other}; add poses that turn the hand by 30 deg or more about another axis",
        axis.x, axis.y, axis.z
    ))
}

#[cfg(test)]
mod tests;
