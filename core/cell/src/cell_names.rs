//! What a cell offers to the names in a procedure.

use crate::check_context::RobotNames;
use crate::expression::Shape;
use crate::stream_names::DeviceStreams;

/// What a cell offers to the names in a procedure.
#[derive(Debug, Clone, Default)]
pub(crate) struct CellNames {
    pub(crate) robots: Vec<RobotNames>,
    pub(crate) sensors: Vec<String>,
    /// For each sensor whose quantities are known, the names of its readings' values: `tip.x_mm`.
    pub(crate) quantities: Vec<(String, Vec<String>)>,
    /// The streams of each device whose manifest is known.
    pub(crate) streams: Vec<DeviceStreams>,
    /// For each robot, what its model file gives: `arm.model.shoulder.a_mm`.
    pub(crate) models: Vec<(String, Shape)>,
}

impl CellNames {
    /// The joints of a robot as expressions name them: `waist_deg`.
    pub(crate) fn joints_shape(&self, robot: &str) -> Shape {
        let known = self.robots.iter().find(|known| known.name == robot);
        let joints = known.map(|robot| robot.joints.as_slice()).unwrap_or_default();
        let entries = joints.iter().map(|(name, unit)| (format!("{name}_{}", unit.symbol()), Shape::Single));
        Shape::Map(entries.collect())
    }
}
