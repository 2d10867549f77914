//! What a camera on the hand can see: the board as near, as little aside and as little aslant as in the pictures that were taken.

use nalgebra::IsometryMatrix3;
use plumb_calibration::fit::{ResidualModel, State};
use plumb_calibration::table::Body;

use crate::laboratory::Laboratory;

/// By how much more than in the pictures so far the board may be aside or aslant, rad.
const WIDER: f64 = 0.05;

/// By which factor it may be nearer or farther than in the pictures so far.
const FARTHER: f64 = 1.1;

/// How the board may lie in the camera's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct View {
    /// Least and greatest distance of the board's origin, mm.
    distances: (f64, f64),
    /// The greatest angle of the board's origin from the camera's z, rad.
    aside: f64,
    /// The greatest angle between the board's normal and the line to its origin, rad.
    aslant: f64,
}

/// Distance (mm), angle aside and angle aslant (rad) of a board in the camera's frame.
fn look(board: &IsometryMatrix3<f64>) -> (f64, f64, f64) {
    let position = board.translation.vector;
    let distance = position.norm().max(f64::MIN_POSITIVE);
    let normal = board.rotation.matrix().column(2);
    // A board is seen from either side of its z, no matter who defined it.
    let aslant = (normal.dot(&position) / distance).abs().clamp(0.0, 1.0).acos();
    (distance, (position.z / distance).clamp(-1.0, 1.0).acos(), aslant)
}

impl View {
    /// From the pictures of a table; nothing where no camera on the hand saw a board whole.
    pub(super) fn of(lab: &Laboratory) -> Option<Self> {
        let table = lab.table();
        let mut view: Option<Self> = None;
        for row in lab.measured_rows() {
            let position = table.board.as_ref().and_then(|board| board.get(row)).copied();
            let (Some(position), Some(rotation)) = (position, table.rotation_of(Body::Board, row)) else {
                continue;
            };
            if !position.iter().all(|part| part.is_finite()) {
                continue;
            }
            let (distance, aside, aslant) = look(&IsometryMatrix3::from_parts(position.into(), rotation));
            // Only what was seen shows what the camera can see: its lens and its board are in no file.
            let known = view.get_or_insert(Self { distances: (distance, distance), aside, aslant });
            known.distances = (known.distances.0.min(distance), known.distances.1.max(distance));
            known.aside = known.aside.max(aside);
            known.aslant = known.aslant.max(aslant);
        }
        view
    }

    fn holds(&self, board: &IsometryMatrix3<f64>) -> bool {
        let (distance, aside, aslant) = look(board);
        let (near, far) = self.distances;
        (near / FARTHER..=far * FARTHER).contains(&distance)
            && aside <= self.aside + WIDER
            && aslant <= self.aslant + WIDER
    }

    /// Whether the camera sees the board in a pose to come.
    pub(super) fn sees(&self, problem: &ResidualModel<'_>, state: &State, row: usize) -> bool {
        problem.believed_board(state, row).is_none_or(|board| self.holds(&board))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Translation3, Vector3};

    #[test]
    fn a_board_is_in_view_as_near_as_straight_and_as_little_aside_as_before() {
        let at = |position: [f64; 3], tilt: f64| {
            let rotation = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI + tilt);
            IsometryMatrix3::from_parts(Translation3::from(position), rotation)
        };
        let view = View { distances: (250.0, 400.0), aside: 0.3, aslant: 0.5 };
        assert!(view.holds(&at([20.0, -30.0, 300.0], 0.4)));
        assert!(!view.holds(&at([0.0, 0.0, 200.0], 0.0)), "too near");
        assert!(!view.holds(&at([0.0, 0.0, 500.0], 0.0)), "too far");
        assert!(!view.holds(&at([200.0, 0.0, 250.0], 0.0)), "too far aside");
        assert!(!view.holds(&at([0.0, 0.0, -300.0], 0.0)), "behind the camera");
        assert!(!view.holds(&at([0.0, 0.0, 300.0], 0.7)), "too aslant");
    }

    #[test]
    fn a_board_may_be_a_little_farther_nearer_further_aside_and_more_aslant_than_before() {
        let at = |distance: f64, aside: f64, tilt: f64| {
            let rotation = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI + tilt);
            let position = [distance * aside.sin(), 0.0, distance * aside.cos()];
            IsometryMatrix3::from_parts(Translation3::from(position), rotation)
        };
        let view = View { distances: (250.0, 400.0), aside: 0.3, aslant: 0.5 };
        let (near, far) = (250.0 / FARTHER, 400.0 * FARTHER);
        assert!(view.holds(&at(1.001 * near, 0.0, 0.0)) && !view.holds(&at(0.999 * near, 0.0, 0.0)));
        assert!(view.holds(&at(0.999 * far, 0.0, 0.0)) && !view.holds(&at(1.001 * far, 0.0, 0.0)));
        let (aside, aslant) = (0.3 + WIDER, 0.5 + WIDER);
        assert!(view.holds(&at(300.0, aside - 0.001, 0.0)) && !view.holds(&at(300.0, aside + 0.001, 0.0)));
        assert!(view.holds(&at(300.0, 0.0, aslant - 0.001)) && !view.holds(&at(300.0, 0.0, aslant + 0.001)));
    }

    #[test]
    fn without_a_camera_on_the_hand_every_pose_is_in_view() {
        let lab = crate::testing::two_links(4, "", 0.05, 4, |_| [0.0; 2]);
        let fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
        assert_eq!(View::of(&lab), None);
        let view = View { distances: (250.0, 400.0), aside: 0.3, aslant: 0.5 };
        assert!(view.sees(&fitted.problem, &fitted.fit.state, 0));
    }
}
