//! `configure`: settings of a sensor change.

use plumb_document::{MapReader, Node, Span};
use serde_json::json;

use super::declaration::{Action, numbers_shape};
use super::kind::{Kind, StepKind};
use super::time::{EXCHANGE_S, TimeContext};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::engine::Engine;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::expression::Shape;
use crate::read_context::ReadContext;

/// A declared change of settings.
#[derive(Debug, Clone)]
pub(crate) struct ConfigureStep {
    /// Which sensor.
    pub(crate) sensor: String,
    /// Where its name is written.
    pub(crate) sensor_span: Span,
    /// The keys that change, as the sensor's plugin knows them.
    pub(crate) settings: serde_json::Value,
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<ConfigureStep> {
    let mut map = MapReader::new(node, "a change of settings", context.problems)?;
    let sensor = context.required_text(&mut map, "sensor");
    let settings = map.required("settings").map(Node::to_json);
    map.finish();
    let (sensor, sensor_span) = sensor?;
    Some(ConfigureStep { sensor, sensor_span, settings: settings? })
}

impl Action for ConfigureStep {
    fn check(&self, context: &CheckContext<'_>) {
        context.sensor(&self.sensor, self.sensor_span);
    }

    fn result_shape(&self, _cell: &CellNames) -> Shape {
        numbers_shape(&["configured"])
    }

    fn estimated_time_s(&self, _context: &TimeContext<'_>) -> Option<f64> {
        Some(EXCHANGE_S)
    }
}

pub(super) const KIND: Kind = Kind::entry::<ConfigureStep>();

impl StepKind for ConfigureStep {
    const NAME: &'static str = "configure";
    const SENTENCE: &'static str = "changes settings of a sensor";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["sensor", "settings"],
  "properties": {
    "sensor": {"$ref": "#/definitions/text"},
    "settings": {"description": "The sensor's settings, as under its `config`."}
  }
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, _at: &StepContext) -> Result<Done, StepError> {
        engine.execute_configure(self)
    }

    /// A sensor whose process is started anew is given its settings again.
    fn take_over(&self, engine: &mut Engine) {
        engine.remember_settings(&self.sensor, &self.settings);
    }
}

impl Engine {
    fn execute_configure(&mut self, step: &ConfigureStep) -> Result<Done, StepError> {
        let configured = self.sensor(&step.sensor)?.link.configure(&step.settings);
        configured.map_err(|error| self.device_error(error))?;
        self.remember_settings(&step.sensor, &step.settings);
        let message = format!("{} works with {}", step.sensor, step.settings);
        Ok(Done { result: json!({"configured": true}), values: Vec::new(), message })
    }
}
