//! `measure`: the values of a sensor are read.

use plumb_document::{MapReader, Node, Span};
use serde_json::{Map, Value, json};

use super::declaration::{Action, numbers_shape};
use super::kind::{Kind, StepKind};
use super::time::{EXCHANGE_S, TimeContext};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::engine::Engine;
use crate::engine::scope::result_name;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::expression::Shape;
use crate::in_words::with_decimals;
use crate::read_context::ReadContext;

/// A declared measurement.
#[derive(Debug, Clone)]
pub(crate) struct MeasureStep {
    /// Which sensor.
    pub(crate) sensor: String,
    /// Where its name is written.
    pub(crate) sensor_span: Span,
    /// A sensor that is read first and whose stream feeds the other: a camera.
    pub(crate) trigger: Option<(String, Span)>,
}

/// By which expressions call the standard uncertainty of a measured value.
fn standard(name: &str) -> String {
    format!("std_{name}")
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<MeasureStep> {
    let mut map = MapReader::new(node, "a measurement", context.problems)?;
    let sensor = context.required_text(&mut map, "sensor");
    let trigger = map
        .optional("trigger")
        .and_then(|node| Some((node.text("`trigger`", context.problems)?.to_owned(), node.span)));
    map.finish();
    let (sensor, sensor_span) = sensor?;
    Some(MeasureStep { sensor, sensor_span, trigger })
}

impl Action for MeasureStep {
    fn check(&self, context: &CheckContext<'_>) {
        context.sensor(&self.sensor, self.sensor_span);
        if let Some((trigger, span)) = &self.trigger {
            context.sensor(trigger, *span);
        }
    }

    fn result_shape(&self, cell: &CellNames) -> Shape {
        let known = cell.quantities.iter().find(|(sensor, _)| *sensor == self.sensor);
        known.map_or(Shape::Anything, |(_, names)| {
            let all: Vec<String> =
                names.iter().cloned().chain(names.iter().map(|name| standard(name))).collect();
            numbers_shape(&all.iter().map(String::as_str).collect::<Vec<_>>())
        })
    }

    fn estimated_time_s(&self, _context: &TimeContext<'_>) -> Option<f64> {
        Some(EXCHANGE_S)
    }
}

pub(super) const KIND: Kind = Kind::entry::<MeasureStep>();

impl StepKind for MeasureStep {
    const NAME: &'static str = "measure";
    const SENTENCE: &'static str = "reads the values of a sensor";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["sensor"],
  "properties": {
    "sensor": {"$ref": "#/definitions/text"},
    "trigger": {"description": "The camera that takes a picture for it.", "$ref": "#/definitions/text"}
  }
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_measure(self, at)
    }
}

impl Engine {
    fn execute_measure(&mut self, step: &MeasureStep, at: &StepContext) -> Result<Done, StepError> {
        let trigger = step.trigger.as_ref().map(|(name, _)| name.as_str());
        let reading = self.take_reading(&step.sensor, trigger)?;
        let mut result = Map::new();
        let mut values = Vec::new();
        for quantity in &reading.quantities {
            let unit = self.unit_of_quantity(&step.sensor, &quantity.name)?;
            let name = result_name(&quantity.name, &unit);
            // 0 means one that the sensor does not know: then there is none.
            if quantity.standard_uncertainty > 0.0 {
                result.insert(standard(&name), json!(quantity.standard_uncertainty));
            }
            result.insert(name, json!(quantity.value));
            values.push(NamedValue {
                name: quantity.name.clone(),
                value: quantity.value,
                unit,
                uncertainty: Some(quantity.standard_uncertainty).filter(|sigma| *sigma > 0.0),
            });
        }
        self.journal.noted(&at.path, &step.sensor, &values)?;
        let shown = values
            .iter()
            .map(|value| format!("{} {} {}", value.name, with_decimals(value.value, 3), value.unit));
        let message = shown.map(|text| text.trim_end().to_owned()).collect::<Vec<_>>().join(", ");
        Ok(Done { result: Value::Object(result), values, message })
    }

    fn unit_of_quantity(&mut self, sensor: &str, name: &str) -> Result<String, StepError> {
        let quantities = &self.sensor(sensor)?.link.description().quantities;
        let found = quantities.iter().find(|known| known.name == name);
        Ok(found.map(|known| known.unit.clone()).unwrap_or_default())
    }
}
