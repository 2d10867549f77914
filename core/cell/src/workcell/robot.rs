//! What a cell says about one of its robots.

use super::ModelFile;
use crate::check_context::RobotNames;
use crate::deg_or_mm::DegOrMm;

/// What a cell says about one of its robots.
#[derive(Debug, Clone)]
pub struct RobotSetting {
    /// The device.
    pub device: String,
    /// The joints procedures may name, and how people write their numbers.
    pub joints: Vec<(String, DegOrMm)>,
    /// Its geometry.
    pub model: Option<ModelFile>,
    /// Limits narrower than the drive's own: joint, least, most; rad or mm.
    pub limits: Vec<(String, f64, f64)>,
    /// Joints whose numbers mean nothing until a run has found their zeros; keep-out planes are watched from then on.
    pub initialize: Vec<String>,
}

impl RobotSetting {
    pub(crate) fn names(&self) -> RobotNames {
        let surfaces = self.model.as_ref().map(|model| model.surfaces.clone()).unwrap_or_default();
        let levels = self.model.as_ref().map(|model| model.levels.clone()).unwrap_or_default();
        let targets = self.model.iter().flat_map(|model| &model.model.targets);
        let targets = targets.map(|target| target.name.clone()).collect();
        let boards = self.model.iter().flat_map(|model| &model.model.boards);
        let boards = boards.filter_map(|board| board.name.clone()).collect();
        RobotNames {
            name: self.device.clone(),
            joints: self.joints.clone(),
            limits: self.limits.clone(),
            own_limits: Vec::new(),
            surfaces,
            levels,
            targets,
            boards,
        }
    }

    /// How people write a joint's numbers.
    pub fn unit(&self, joint: &str) -> Option<DegOrMm> {
        self.joints.iter().find(|(name, _)| name == joint).map(|(_, unit)| *unit)
    }
}
