//! What sits on the hand and sees: a camera that sees a board, a laser line sensor.

use nalgebra::IsometryMatrix3;
use plumb_document::Spanned;

use super::raw::{RawBoard, RawProfile};
use super::validate::{Checked, Checker, rotation};
use crate::arm_model::{Board, Model};
use crate::suggestion::suggestion;

impl Checker<'_> {
    pub(super) fn board(&self, raw: &RawBoard, model: &Model) -> Checked<Board> {
        let camera = self.seeing_target(&raw.seen_by, "camera", model)?;
        let pose = IsometryMatrix3::from_parts(raw.xyz_mm.into(), rotation(raw.rpy_deg));
        Ok(Board { camera, pose, free: raw.free })
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
