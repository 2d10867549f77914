//! What keys, mouse and stripes change on the Scan screen.

use plumb_cell::event::Event;

use super::command::ScanCommand;
use super::eye::Viewpoint;
use super::picture::{PictureSize, picture};
use super::state::{Colouring, ScanState, Strokes};
use super::view::units;
use crate::screens::message::Action;
use crate::screens::state::{Severity, State};

/// An angle key turns by this, rad.
const TURN: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// A move key moves by this, in units of the view.
const MOVE: f64 = 0.1;
/// The cross moves by this.
const AIM: f64 = 0.02;
/// A zoom key shows this much less.
const ZOOM: f64 = 0.8;
/// A mouse turns by this a column, rad.
const DRAG: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// The usual sides: turn and up, deg, and their names.
const SIDES: [(f64, f64, &str); 4] = [
    (-30.0, 30.0, "from before and above"),
    (0.0, 0.0, "from before"),
    (90.0, 0.0, "from the right"),
    (0.0, 90.0, "from above"),
];

/// Takes in what the engine says of scans.
pub(crate) fn take(state: &mut State, event: &Event) {
    let Event::StripeTaken { step, stripe, points, .. } = event else { return };
    let goes_on = state.scan.as_ref().is_some_and(|scan| scan.step.as_ref() == Some(step) && *stripe > 0);
    if !goes_on {
        let before = state.scan.take();
        let mut scan = ScanState::of_step(step);
        // A new scan is looked at as the one before was.
        if let Some(before) = before.filter(|before| before.step.is_some() && before.before_edge.is_none()) {
            (scan.eye, scan.eye_is_set) = (before.eye, before.eye_is_set);
            (scan.strokes, scan.colouring) = (before.strokes, before.colouring);
        }
        state.scan = Some(scan);
    }
    if let Some(scan) = &mut state.scan {
        scan.add_stripe(*stripe, points);
        if scan.colouring == Colouring::Residual || scan.before_edge.is_some() {
            scan.know_band();
        }
    }
}

/// Does what a key asks for.
pub(crate) fn obey(state: &mut State, command: ScanCommand) -> Vec<Action> {
    use ScanCommand as Do;
    let Some(scan) = &mut state.scan else { return Vec::new() };
    let mut reported = None;
    match command {
        Do::TurnLeft => scan.eye.turn(-TURN, 0.0),
        Do::TurnRight => scan.eye.turn(TURN, 0.0),
        Do::TurnUp => scan.eye.turn(0.0, TURN),
        Do::TurnDown => scan.eye.turn(0.0, -TURN),
        Do::RollLeft => scan.eye.roll(-TURN),
        Do::RollRight => scan.eye.roll(TURN),
        Do::MoveLeft => scan.eye.shift(-MOVE, 0.0),
        Do::MoveRight => scan.eye.shift(MOVE, 0.0),
        Do::MoveUp => scan.eye.shift(0.0, MOVE),
        Do::MoveDown => scan.eye.shift(0.0, -MOVE),
        Do::Nearer => scan.eye.zoom(ZOOM),
        Do::Farther => scan.eye.zoom(1.0 / ZOOM),
        Do::Wider => scan.eye.open(TURN),
        Do::Narrower => scan.eye.open(-TURN),
        Do::NextSide => reported = Some(next_side(scan)),
        Do::Whole => scan.eye.see_all(scan.points.iter().map(|point| point.position)),
        Do::Strokes => {
            scan.strokes = match scan.strokes {
                Strokes::Points => Strokes::Stripes,
                Strokes::Stripes => Strokes::Points,
            };
        }
        Do::Colour => next_colouring(scan),
        Do::EdgeOn => {
            if !scan.toggle_edge_on() {
                reported = Some("There is no plane in these points to look along.".to_owned());
            }
        }
        Do::AimLeft => aim(scan, -AIM, 0.0),
        Do::AimRight => aim(scan, AIM, 0.0),
        Do::AimUp => aim(scan, 0.0, AIM),
        Do::AimDown => aim(scan, 0.0, -AIM),
        Do::Mark if scan.cursor.is_none() => {
            reported =
                Some("Point at something first: h, j, k and l move the cross, a click sets it.".to_owned());
        }
        Do::Mark => scan.mark = if scan.mark == scan.cursor { None } else { scan.cursor },
        Do::Picture | Do::Stereo => {
            let bytes = picture(scan, PictureSize::default(), command == Do::Stereo);
            return vec![Action::SavePicture { name: picture_name(scan), bytes }];
        }
    }
    scan.eye_is_set |= moves_the_eye(command);
    if let Some(reported) = reported {
        state.notify(Severity::Info, reported);
    }
    Vec::new()
}

/// Colours by the next quantity.
fn next_colouring(scan: &mut ScanState) {
    scan.colouring = match scan.colouring {
        Colouring::Height => Colouring::Residual,
        Colouring::Residual => Colouring::Intensity,
        Colouring::Intensity => Colouring::Height,
    };
    if scan.colouring == Colouring::Residual {
        scan.know_band();
        // Of a body of several faces nothing is measured from a plane.
        if scan.band.is_none() {
            scan.colouring = Colouring::Intensity;
        }
    }
}

/// Whether a command chooses from where the cloud is seen; that view is kept when further stripes come in.
fn moves_the_eye(command: ScanCommand) -> bool {
    use ScanCommand as Do;
    let stays = [Do::Strokes, Do::Colour, Do::EdgeOn, Do::Mark, Do::Whole];
    let aims = [Do::AimLeft, Do::AimRight, Do::AimUp, Do::AimDown];
    !stays.contains(&command) && !aims.contains(&command)
}

/// The name of a picture's file, without its ending.
fn picture_name(scan: &ScanState) -> String {
    let name = scan.name.rsplit('/').next().unwrap_or_default();
    let name =
        name.rsplit_once('.').map_or(name, |(stem, ending)| if ending.len() <= 4 { stem } else { name });
    let kept: String =
        name.chars().map(|letter| if letter.is_alphanumeric() { letter } else { '-' }).collect();
    if kept.is_empty() { "view".to_owned() } else { format!("{kept}-view") }
}

fn next_side(scan: &mut ScanState) -> String {
    scan.before_edge = None;
    let here = match &scan.eye.viewpoint {
        Viewpoint::Around { yaw, pitch, .. } => SIDES.iter().position(|(turn, up, _)| {
            let off = (yaw - turn.to_radians()).rem_euclid(std::f64::consts::TAU);
            off.min(std::f64::consts::TAU - off) < 1e-6 && (pitch - up.to_radians()).abs() < 1e-6
        }),
        Viewpoint::EdgeOn { .. } => None,
    };
    let next = here.map_or(0, |here| (here + 1) % SIDES.len());
    let (turn, up, name) = SIDES.get(next).copied().unwrap_or(SIDES[0]);
    scan.eye.viewpoint = Viewpoint::Around { yaw: turn.to_radians(), pitch: up.to_radians(), roll: 0.0 };
    if scan.eye.opening == 0.0 && next == 0 {
        scan.eye.opening = 30.0_f64.to_radians();
    }
    scan.eye.see_all(scan.points.iter().map(|point| point.position));
    format!("Seen {name}.")
}

fn aim(scan: &mut ScanState, to_right: f64, upward: f64) {
    let (x, y) = scan.aim;
    set_aim(scan, x + to_right, y + upward);
}

fn set_aim(scan: &mut ScanState, x: f64, y: f64) {
    scan.aim = (x.clamp(-3.0, 3.0), y.clamp(-3.0, 3.0));
    scan.cursor = scan.nearest(scan.aim.0, scan.aim.1);
}

/// A click into the view sets the cursor.
pub(crate) fn click(state: &mut State, column: u16, row: u16) -> Vec<Action> {
    let aim = units(state, column, row);
    if let (Some(scan), Some((x, y))) = (&mut state.scan, aim) {
        set_aim(scan, x, y);
    }
    grab(state, column, row);
    Vec::new()
}

/// A button is pressed: from here on the mouse drags.
pub(crate) fn grab(state: &mut State, column: u16, row: u16) {
    if let Some(scan) = &mut state.scan {
        scan.grabbed = Some((column, row));
    }
}

/// The mouse is dragged: turns the cloud, or moves it.
pub(crate) fn drag(state: &mut State, column: u16, row: u16, moves: bool) {
    let before = state.scan.as_ref().and_then(|scan| scan.grabbed);
    let way = before.and_then(|(from, over)| {
        let ((x, y), (to_x, to_y)) = (units(state, from, over)?, units(state, column, row)?);
        Some((to_x - x, to_y - y))
    });
    let Some(scan) = &mut state.scan else { return };
    if let (Some((from, over)), Some((x, y))) = (before, way) {
        if moves {
            scan.eye.shift(-x, -y);
        } else {
            let (columns, rows) = (f64::from(column) - f64::from(from), f64::from(row) - f64::from(over));
            scan.eye.turn(-columns * DRAG, 2.0 * rows * DRAG);
        }
        scan.eye_is_set = true;
    }
    scan.grabbed = Some((column, row));
}

/// The wheel, or a page key: nearer and farther.
pub(crate) fn scroll(state: &mut State, by: isize) {
    if let Some(scan) = &mut state.scan {
        scan.eye.zoom(ZOOM.powf(-by as f64 / 6.0));
        scan.eye_is_set = true;
    }
}
