//! `measure`: the values of a sensor are read.

use crate::read_context::{CheckContext, ReadContext};
use crate::yaml::{MapReader, Node, Place};

/// A declared measurement.
#[derive(Debug, Clone)]
pub struct MeasureStep {
    /// Which sensor.
    pub sensor: String,
    /// Where its name stands.
    pub sensor_place: Place,
    /// A sensor that is read first and whose stream feeds the other: a camera.
    pub trigger: Option<(String, Place)>,
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<MeasureStep> {
    let mut map = MapReader::new(node, "a measurement", context.problems)?;
    let sensor = context.required_text(&mut map, "sensor");
    let trigger = map
        .optional("trigger")
        .and_then(|node| Some((node.text("`trigger`", context.problems)?.to_owned(), node.place)));
    map.finish();
    let (sensor, sensor_place) = sensor?;
    Some(MeasureStep { sensor, sensor_place, trigger })
}

impl MeasureStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        context.sensor(&self.sensor, self.sensor_place);
        if let Some((trigger, place)) = &self.trigger {
            context.sensor(trigger, *place);
        }
    }
}
