//! What sits on the hand and sees: a camera that sees a board, a laser line sensor.

use nalgebra::IsometryMatrix3;
use plumb_document::Spanned;

use super::raw::{RawBoard, RawModel, RawProfile};
use super::validate::{Checked, Checker, rotation};
use crate::arm_model::{Board, Model};
use crate::suggestion::suggestion;

impl Checker<'_> {
    /// The boards that a camera on the hand sees: the only one, or several by name.
    pub(super) fn boards(&self, raw: &RawModel, model: &Model) -> Vec<Board> {
        let named = raw.boards.0.iter().map(|(name, board)| (Some(name.value.clone()), board));
        let all = raw.board.iter().map(|board| (None, board)).chain(named);
        if let (Some(only), Some((name, _))) = (&raw.board, raw.boards.0.first()) {
            let reason = format!(
                "`board` is the only one, and `boards` names others, such as `{}`: put all of them under `boards`",
                name.value
            );
            let _: Checked<()> = self.fail(&only.seen_by.span, reason);
        }
        all.filter_map(|(name, board)| self.board(name, board, model).ok()).collect()
    }

    fn board(&self, name: Option<String>, raw: &RawBoard, model: &Model) -> Checked<Board> {
        let camera = self.seeing_target(&raw.seen_by, "camera", model)?;
        let pose = IsometryMatrix3::from_parts(raw.xyz_mm.into(), rotation(raw.rpy_deg));
        Ok(Board { name, camera, pose, free: raw.free })
    }

    /// The target that is the laser line sensor.
    pub(super) fn profile_sensor(&self, raw: &RawProfile, model: &Model) -> Checked<usize> {
        self.seeing_target(&raw.seen_by, "laser line sensor", model)
    }

    fn seeing_target(&self, name: &Spanned<String>, what: &str, model: &Model) -> Checked<usize> {
        if let Some(target) = model.target_position(&name.value) {
            return Ok(target);
        }
        let names = model.targets.iter().map(|target| target.name.as_str());
        let reason = format!(
            "there is no target `{}` that could be the {what}{}",
            name.value,
            suggestion(&name.value, names)
        );
        self.fail(&name.span, reason)
    }
}
