//! What a state of the arm says beside residuals: where its points are, what pulls on its joints, whether it stays clear.

use nalgebra::{IsometryMatrix3, Point3, Rotation3, Vector3};
use plumb_kinematics::{DhParameter, HalfSpace};

use super::residual_model::ResidualModel;
use super::scratch::Scratch;
use super::state::State;
use crate::effect::{Contribution, DefinitionError, Effect};

/// What plots are drawn against.
pub struct RowDetails {
    /// N m.
    pub moments: Vec<f64>,
    /// Motion of the first target per turn of each joint, mm/rad, frame of the measurements.
    pub by_joint: Vec<Vector3<f64>>,
}

impl ResidualModel<'_> {
    /// Works every formula of the model out in every row, so that none fails later.
    ///
    /// # Errors
    /// A formula gives no finite number somewhere.
    pub fn check_formulas(&self) -> Result<(), Box<DefinitionError>> {
        let state = self.start();
        for definition in &self.model.definitions {
            // At the start: later states differ by little, and a formula that has no value there has none near it.
            definition.check(self.table, &|row, look| {
                let pose = self.in_row(&state, row).pose;
                let (point, _) = pose.point(&state, 0);
                look(&self.sample(&state, row, &pose.link_frames, &pose.moments, Some(point)));
            })?;
        }
        Ok(())
    }

    fn in_row<'s>(&self, state: &'s State, row: usize) -> Scratch<'s> {
        let mut scratch = self.scratch(state);
        self.assume(row, &mut scratch);
        scratch
    }

    /// The flange in a row's pose, base frame.
    pub(super) fn flange(&self, row: usize, scratch: &mut Scratch<'_>) -> IsometryMatrix3<f64> {
        self.assume(row, scratch);
        *scratch.pose.flange()
    }

    /// Where a row's first target is believed to be, mm, frame of the measurements.
    pub fn believed_point(&self, state: &State, row: usize) -> Vector3<f64> {
        self.believed_target(state, 0, row)
    }

    /// Where a target of the model (by its index in the file, from 0) is believed to be in a row, mm, frame of the measurements.
    pub(crate) fn believed_target(&self, state: &State, target: usize, row: usize) -> Vector3<f64> {
        self.in_row(state, row).pose.point(state, target).0
    }

    /// The same with its axes.
    pub(crate) fn believed_body(&self, state: &State, target: usize, row: usize) -> IsometryMatrix3<f64> {
        let pose = self.in_row(state, row).pose;
        let rotation = state.rotations.get(target).copied().unwrap_or_else(Rotation3::identity);
        IsometryMatrix3::from_parts(pose.point(state, target).0.into(), pose.hand() * rotation)
    }

    /// Where a camera on the hand is believed to see the row's board: the board in the camera's frame, mm. Nothing of a model without a board.
    pub fn believed_board(&self, state: &State, row: usize) -> Option<IsometryMatrix3<f64>> {
        let board = self.board_of(row)?;
        let camera = self.model.boards.get(board)?.camera;
        let pose = self.in_row(state, row).pose;
        let rotation = pose.hand() * state.rotations.get(camera).copied()?;
        let position = pose.point(state, camera).0;
        let seen = IsometryMatrix3::from_parts(position.into(), rotation);
        Some(seen.inverse() * state.boards.get(board)?)
    }

    /// Whether every joint, the flange and every target stay clear of some half-spaces (base frame) in a row's pose.
    pub fn stays_clear(&self, state: &State, row: usize, keep_out: &[HalfSpace]) -> bool {
        let pose = self.in_row(state, row).pose;
        let flange = pose.flange();
        let targets = state.targets.iter().map(|target| (flange * Point3::from(*target)).coords);
        // The first joint's axis is in the base, which is where it is.
        let joints = pose.link_frames.joints.iter().skip(1).map(|joint| joint.axis_point);
        let mut points = joints.chain([flange.translation.vector]).chain(targets);
        points.all(|point| keep_out.iter().all(|plane| plane.allows(point.into())))
    }

    /// The points along the arm in a row, from the base's origin to the first target, mm, frame of the measurements.
    pub fn points_along(&self, state: &State, row: usize) -> Vec<Vector3<f64>> {
        let pose = self.in_row(state, row).pose;
        let ends = pose
            .link_frames
            .joints
            .iter()
            .map(|joint| pose.origin + pose.base * joint.end.translation.vector);
        let tip = pose.point(state, 0).0;
        std::iter::once(pose.origin).chain(ends).chain([tip]).collect()
    }

    /// What an effect moves in a row per unit of its parameters, whether it takes part or not.
    pub fn contributions(&self, state: &State, row: usize, effect: &dyn Effect) -> Vec<Contribution> {
        let pose = self.in_row(state, row).pose;
        let (point, _) = pose.point(state, 0);
        let mut contributions = Vec::new();
        effect.contribute(
            &self.sample(state, row, &pose.link_frames, &pose.moments, Some(point)),
            &mut contributions,
        );
        contributions
    }

    /// Moments of gravity of a row, and how its first target moves with each joint.
    pub fn row_details(&self, state: &State, row: usize) -> RowDetails {
        let pose = self.in_row(state, row).pose;
        let (_, in_base) = pose.point(state, 0);
        let by_joint = (0..self.model.chain.len())
            .map(|joint| pose.base * pose.link_frames.twist(joint, DhParameter::Theta, &in_base).linear)
            .collect();
        RowDetails { moments: pose.moments, by_joint }
    }
}
