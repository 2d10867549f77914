//! `configure`: settings of a sensor change.

use crate::read_context::{CheckContext, ReadContext};
use crate::yaml::{MapReader, Node, Place};

/// A declared change of settings.
#[derive(Debug, Clone)]
pub struct ConfigureStep {
    /// Which sensor.
    pub sensor: String,
    /// Where its name stands.
    pub sensor_place: Place,
    /// The keys that change, as the sensor's plugin knows them.
    pub settings: serde_json::Value,
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<ConfigureStep> {
    let mut map = MapReader::new(node, "a change of settings", context.problems)?;
    let sensor = context.required_text(&mut map, "sensor");
    let settings = map.required("settings").map(Node::to_json);
    map.finish();
    let (sensor, sensor_place) = sensor?;
    Some(ConfigureStep { sensor, sensor_place, settings: settings? })
}

impl ConfigureStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        context.sensor(&self.sensor, self.sensor_place);
    }
}
