//! A first guess of how bodies and cameras sit on the flange, how the base is turned and where the board is, where whole poses were measured.

use nalgebra::{IsometryMatrix3, Translation3, Vector3};

use super::hand_eye::{SeenPose, base_rotation, body_rotation, positions, rigid_of, two_rotations};
use super::residual_model::ResidualModel;
use super::state::State;
use crate::table::Body;

/// Whose poses were measured: a target's by an instrument, or a board's by a camera on the hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeenBody {
    /// A target, by its index in the model.
    Target(usize),
    /// A board, by its index in the model: the poses are then those of the camera as the board sees it.
    Board(usize),
}

impl SeenBody {
    /// The target that the flange carries.
    pub fn target(self, problem: &ResidualModel<'_>) -> usize {
        match self {
            Self::Target(target) => target,
            Self::Board(board) => problem.model.boards.get(board).map_or(0, |board| board.camera),
        }
    }
}

impl ResidualModel<'_> {
    /// Whose poses the table holds.
    pub fn seen_bodies(&self) -> Vec<SeenBody> {
        let mut seen = Vec::new();
        for columns in &self.table.orientations {
            match columns.body {
                Body::Board => seen.extend(self.boards_seen().into_iter().map(SeenBody::Board)),
                // The flange's pose replaces joints: it was commanded, not measured.
                Body::Flange => {}
                body @ Body::Target(_) => {
                    seen.extend(self.model.target_position(&body.name()).map(SeenBody::Target));
                }
            }
        }
        seen
    }

    /// The board that a row would see, by its index in the model.
    pub(crate) fn board_of(&self, row: usize) -> Option<usize> {
        self.model.board_position(self.table.board_seen.name(row))
    }

    /// The boards that a table speaks of, by their indices in the model: with or without rows that see them.
    pub fn boards_named(&self) -> Vec<usize> {
        let boards = &self.model.boards;
        let named = |board: usize| match boards.get(board).and_then(|board| board.name.as_deref()) {
            Some(name) => boards.len() == 1 || self.table.board_seen.names.iter().any(|known| known == name),
            None => true,
        };
        if self.table.sees_a_board() {
            (0..boards.len()).filter(|board| named(*board)).collect()
        } else {
            Vec::new()
        }
    }

    /// The boards that some row sees, by their indices in the model; the one that most rows see first.
    pub fn boards_seen(&self) -> Vec<usize> {
        if !self.table.sees_a_board() {
            return Vec::new();
        }
        let mut rows = vec![0_usize; self.model.boards.len()];
        for row in (0..self.table.len()).filter(|row| self.table.sees_a_board_in(*row)) {
            if let Some(count) = self.board_of(row).and_then(|board| rows.get_mut(board)) {
                *count += 1;
            }
        }
        let mut seen: Vec<usize> = (0..rows.len()).filter(|board| rows[*board] > 0).collect();
        seen.sort_by_key(|board| std::cmp::Reverse(rows[*board]));
        seen
    }

    /// The poses of a body in some rows, with the flange as the model at `state` has it.
    pub fn seen_poses(&self, state: &State, rows: &[usize], body: SeenBody) -> Vec<SeenPose> {
        let mut scratch = self.scratch(state);
        rows.iter()
            .filter_map(|row| {
                let seen = self.seen_in(*row, body)?;
                Some(SeenPose { flange: self.flange(*row, &mut scratch), seen })
            })
            .collect()
    }

    fn seen_in(&self, row: usize, body: SeenBody) -> Option<IsometryMatrix3<f64>> {
        let unknown = Vector3::repeat(f64::NAN);
        match body {
            SeenBody::Target(target) => {
                let name = self.model.targets.get(target).map(|target| target.name.as_str())?;
                let rotation = self.table.orientations_of(name)?.rotations.get(row).copied().flatten()?;
                let columns = self.table.positions.iter().find(|columns| columns.target == name);
                let position = columns.and_then(|columns| columns.xyz.get(row)).copied().map(Vector3::from);
                Some(rigid_of(rotation, position.unwrap_or(unknown)))
            }
            SeenBody::Board(board) => {
                if self.board_of(row) != Some(board) {
                    return None;
                }
                let rotation = self.table.rotation_of(Body::Board, row)?;
                let position = self.table.board.as_ref().and_then(|board| board.get(row)).copied();
                Some(rigid_of(rotation, position.map_or(unknown, Vector3::from)).inverse())
            }
        }
    }
}

/// The pose of the base as an instrument that sees a body has it: of a board, its own.
fn base_seen(state: &State, body: SeenBody) -> IsometryMatrix3<f64> {
    match body {
        SeenBody::Target(_) => state.base,
        SeenBody::Board(board) => {
            state.boards.get(board).map_or(state.base, |board| board.inverse() * state.base)
        }
    }
}

/// Whether it is a board that fits may move.
fn is_free(problem: &ResidualModel<'_>, body: SeenBody) -> bool {
    match body {
        SeenBody::Board(board) => problem.model.boards.get(board).is_some_and(|board| board.free),
        SeenBody::Target(_) => false,
    }
}

/// A state in which the base is seen so: the base moves, or the board does, whichever may.
fn with_base_seen(
    problem: &ResidualModel<'_>,
    state: &State,
    body: SeenBody,
    seen: IsometryMatrix3<f64>,
) -> State {
    let mut next = state.clone();
    match body {
        SeenBody::Target(_) => next.base = seen,
        SeenBody::Board(index) => match next.boards.get_mut(index) {
            Some(board) if is_free(problem, body) => *board = state.base * seen.inverse(),
            Some(board) => next.base = *board * seen,
            None => {}
        },
    }
    next
}

/// The guesses from one body's poses: with the base as it is, with the body as it is, and with neither known.
fn guesses(problem: &ResidualModel<'_>, state: &State, rows: &[usize], body: SeenBody) -> Vec<State> {
    let index = body.target(problem);
    let Some(target) = problem.model.targets.get(index) else { return Vec::new() };
    let poses = problem.seen_poses(state, rows, body);
    let base_free = problem.model.base.free || is_free(problem, body);
    let known_base = base_seen(state, body);
    let known_rotation = state.rotations.get(index).copied().unwrap_or(target.rotation);
    let known_position = state.targets.get(index).copied().unwrap_or(target.xyz);
    // Three guesses, for a file may be right about either: which fits best is seen from the residuals.
    let mut rotations = Vec::new();
    if target.rotation_free {
        rotations.extend(
            body_rotation(&poses, &known_base.rotation).map(|rotation| (known_base.rotation, rotation)),
        );
    }
    if base_free {
        rotations.extend(base_rotation(&poses, &known_rotation).map(|base| (base, known_rotation)));
    }
    if base_free && target.rotation_free {
        rotations.extend(two_rotations(&poses).map(|found| (found.base, found.body)));
    }
    let mut all: Vec<_> = rotations.into_iter().map(|found| (found, target.free)).collect();
    // A camera that another board has placed stays where it is.
    if is_free(problem, body) {
        all.extend(base_rotation(&poses, &known_rotation).map(|base| ((base, known_rotation), false)));
    }
    let guesses = all.into_iter().map(|((base, rotation), position_free)| {
        // With both rotations known, the positions are a linear problem (Shah 2013).
        let start = (known_base.translation.vector, known_position);
        let (origin, position) = positions(&poses, &base, start, (base_free, position_free));
        let seen = IsometryMatrix3::from_parts(Translation3::from(origin), base);
        let mut next = match base_free {
            true => with_base_seen(problem, state, body, seen),
            false => state.clone(),
        };
        if let Some(entry) = next.rotations.get_mut(index) {
            *entry = rotation;
        }
        if let Some(entry) = next.targets.get_mut(index) {
            *entry = position;
        }
        next
    });
    guesses.collect()
}

/// Places bodies, cameras, the board and, where only they say where it is, the base; what fits no better stays as it is.
pub(super) fn place_bodies(problem: &ResidualModel<'_>, state: &mut State, rows: &[usize]) {
    let ones = vec![1.0; problem.observations.rows()];
    let mut placed: Vec<usize> = Vec::new();
    for body in problem.seen_bodies() {
        // Rows that see a board which nobody has placed yet say nothing of a guess.
        if let SeenBody::Board(board) = body {
            placed.push(board);
        }
        let is_known = |row: &usize| {
            !problem.table.sees_a_board_in(*row)
                || problem.board_of(*row).is_none_or(|board| placed.contains(&board))
        };
        let rows: Vec<usize> = rows.iter().copied().filter(is_known).collect();
        let mut least = problem.squares(state, &rows, &ones);
        for guess in guesses(problem, state, &rows, body).into_iter().filter(State::is_finite) {
            let left = problem.squares(&guess, &rows, &ones);
            // A guess that fits no better is none.
            if left < least {
                (*state, least) = (guess, left);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm_model::Model;
    use crate::measurement::Observations;
    use crate::table::Table;

    /// Where base and board are once the base has been seen 40 mm beside the board.
    fn placed(free: bool) -> (IsometryMatrix3<f64>, IsometryMatrix3<f64>) {
        let text = format!(
            "arm: one\nconvention: distal\njoints: [{{name: turn, a_mm: 100}}]\nbase: {{xyz_mm: [5, 0, 0]}}\ntargets: {{p1: {{}}}}\n\
             board: {{seen_by: p1, xyz_mm: [1, 2, 3], free: {free}}}\n"
        );
        let header = "q1_deg,board_x_mm,board_y_mm,board_z_mm,board_rx_deg,board_ry_deg,board_rz_deg";
        let model = Model::parse("m.yaml", &text).unwrap();
        let table = Table::parse("t.csv", &format!("{header}\n0,0,0,300,0,0,0\n")).unwrap();
        let observations = Observations::new(&model, &table).unwrap();
        let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
        let body = SeenBody::Board(0);
        let seen = IsometryMatrix3::translation(40.0, 0.0, 0.0);
        let state = with_base_seen(&problem, &problem.start(), body, seen);
        assert!((base_seen(&state, body).to_homogeneous() - seen.to_homogeneous()).norm() < 1e-9);
        (state.base, state.boards[0])
    }

    #[test]
    fn a_board_that_is_free_moves_and_one_that_is_known_moves_the_base() {
        for (free, expected) in [(true, [5.0, -35.0]), (false, [41.0, 1.0])] {
            let (base, board) = placed(free);
            let found = [base, board].map(|pose| pose.translation.vector.x);
            assert!(found.iter().zip(expected).all(|(one, other)| (one - other).abs() < 1e-9), "{found:?}");
        }
    }
}
