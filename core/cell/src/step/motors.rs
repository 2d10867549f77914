//! `motors`: what the motors of a robot report of themselves is read.

use plumb_document::{MapReader, Node, Span};
use plumb_plugin::{MotorState, PluginError};
use serde_json::{Map, Value, json};

use super::declaration::{Action, numbers_shape};
use super::kind::{Kind, StepKind};
use super::time::{EXCHANGE_S, TimeContext};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::device::DeviceError;
use crate::engine::Engine;
use crate::engine::believed::{RequestTimes, Source, check_motors};
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::expression::Shape;
use crate::motor_quantity::{MOTOR_QUANTITIES, TEMPERATURE};
use crate::read_context::ReadContext;

/// A declared reading of a robot's motors.
#[derive(Debug, Clone)]
pub(crate) struct MotorsStep {
    /// Which robot.
    pub(crate) robot: String,
    /// Where its name is written.
    pub(crate) robot_span: Span,
}

/// By which expressions call the temperature of the hottest motor.
const HOTTEST: &str = "hottest_c";

/// What the step comes to. What a motor does not report is left out, and so is an uncertainty that the plugin does not know.
fn result_of(joints: &[&str], motors: &MotorState) -> Done {
    let (mut result, mut values, mut sentences) = (Map::new(), Vec::new(), Vec::new());
    for quantity in &MOTOR_QUANTITIES {
        let reported = quantity.reported(joints, motors);
        let uncertainty = Some((quantity.uncertainty)(motors) * quantity.scale).filter(|sigma| *sigma > 0.0);
        sentences.extend(quantity.range_in_words(&reported));
        for (joint, value) in &reported {
            result.insert(quantity.result_name(joint), json!(value));
            let (name, unit) = (format!("{joint}_{}", quantity.name), quantity.unit.to_owned());
            values.push(NamedValue { name, value: *value, unit, uncertainty });
        }
    }
    let temperatures = TEMPERATURE.reported(joints, motors);
    if let Some((joint, hottest)) = temperatures.iter().max_by(|one, other| one.1.total_cmp(&other.1)) {
        result.insert(HOTTEST.to_owned(), json!(hottest));
        let are_cooler = temperatures.iter().any(|(_, temperature)| temperature < hottest);
        sentences.extend(are_cooler.then(|| format!("the hottest is {joint}")));
    }
    Done { result: Value::Object(result), values, message: sentences.join(", ") }
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<MotorsStep> {
    let mut map = MapReader::new(node, "`motors`", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    map.finish();
    let (robot, robot_span) = robot?;
    Some(MotorsStep { robot, robot_span })
}

impl Action for MotorsStep {
    fn check(&self, context: &CheckContext<'_>) {
        context.robot(&self.robot, self.robot_span);
    }

    fn result_shape(&self, cell: &CellNames) -> Shape {
        let robot = cell.robots.iter().find(|robot| robot.name == self.robot);
        let joints = robot.map(|robot| robot.joints.as_slice()).unwrap_or_default();
        if joints.is_empty() {
            return Shape::Anything;
        }
        let of_joint =
            |(joint, _): &(String, _)| MOTOR_QUANTITIES.each_ref().map(|one| one.result_name(joint));
        let mut names: Vec<String> = joints.iter().flat_map(of_joint).collect();
        names.push(HOTTEST.to_owned());
        numbers_shape(&names.iter().map(String::as_str).collect::<Vec<_>>())
    }

    fn estimated_time_s(&self, _context: &TimeContext<'_>) -> Option<f64> {
        Some(EXCHANGE_S)
    }
}

pub(super) const KIND: Kind = Kind::entry::<MotorsStep>();

impl StepKind for MotorsStep {
    const NAME: &'static str = "motors";
    const SENTENCE: &'static str = "reads temperature, load and supply voltage of a robot's motors";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["robot"],
  "properties": {
    "robot": {"description": "One whose plugin reports its motors.", "$ref": "#/definitions/text"}
  }
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_motors(self, at)
    }
}

impl Engine {
    fn execute_motors(&mut self, step: &MotorsStep, at: &StepContext) -> Result<Done, StepError> {
        self.look_for_interrupt()?;
        let asked_ns = self.links.clock_ns();
        let read = self.arm(&step.robot)?.link.read_motors();
        let motors = read.map_err(|error| self.motors_error(&step.robot, error))?;
        let between_ns = asked_ns.zip(self.links.clock_ns());
        let arm = self.arm(&step.robot)?;
        let source = Source { device: &arm.name, plugin: &arm.plugin };
        let asked = RequestTimes { reported_before_ns: 0, between_ns };
        check_motors(source, &arm.description, &motors, asked).map_err(StepError::Error)?;
        let joints: Vec<&str> = arm.description.joints.iter().map(|joint| joint.name.as_str()).collect();
        let done = result_of(&joints, &motors);
        self.journal.noted(&at.path, &step.robot, &done.values)?;
        Ok(done)
    }

    /// Why the motors of a robot were not read; of one that cannot report them, with what to do.
    fn motors_error(&mut self, robot: &str, error: DeviceError) -> StepError {
        let is_unsupported = matches!(error.plugin_error(), Some(PluginError::Unsupported(_)));
        let plugin = self.arm(robot).ok().filter(|_| is_unsupported).map(|arm| arm.plugin.clone());
        let Some(plugin) = plugin else { return self.device_error(error) };
        StepError::error(format!(
            "{error}. Its plugin `{plugin}` does not report motors: take the step out, or name a robot whose plugin has `read_motors`"
        ))
    }
}

#[cfg(test)]
mod tests {
    use plumb_plugin::JointVector;

    use super::*;

    fn vector(values: [f64; 2]) -> JointVector {
        JointVector::from_slice(&values).unwrap()
    }

    fn motors() -> MotorState {
        MotorState {
            temperature: vector([31.0, 52.0]),
            load: vector([0.06, 0.08]),
            voltage: vector([7.1, 7.1]),
            temperature_uncertainty: 0.25,
            load_uncertainty: 0.0005,
            ..MotorState::unreported(1, 2)
        }
    }

    #[test]
    fn values_have_the_units_of_their_names_and_the_uncertainty_that_is_known() {
        let done = result_of(&["pan", "lift"], &motors());
        let requested = json!({
            "pan_temperature_c": 31.0, "lift_temperature_c": 52.0, "hottest_c": 52.0,
            "pan_load_percent": 6.0, "lift_load_percent": 8.0,
            "pan_voltage_v": 7.1, "lift_voltage_v": 7.1,
        });
        assert_eq!(done.result, requested);
        let of = |name: &str| done.values.iter().find(|value| value.name == name).unwrap();
        let known = |name: &str| (of(name).value, of(name).unit.as_str(), of(name).uncertainty);
        assert_eq!(known("lift_temperature"), (52.0, "degC", Some(0.25)));
        assert_eq!(known("pan_load"), (6.0, "%", Some(0.05)));
        assert_eq!(known("pan_voltage"), (7.1, "V", None));
        assert_eq!(
            done.message,
            "temperature 31.0 to 52.0 degC, load 6.0 to 8.0 %, voltage 7.1 V, the hottest is lift"
        );
    }

    #[test]
    fn what_a_motor_does_not_report_is_left_out() {
        let mut some = motors();
        some.temperature.set(1, f64::NAN);
        some.load = vector([f64::NAN; 2]);
        let done = result_of(&["pan", "lift"], &some);
        let requested = json!({
            "pan_temperature_c": 31.0, "hottest_c": 31.0, "pan_voltage_v": 7.1, "lift_voltage_v": 7.1,
        });
        assert_eq!(done.result, requested);
        assert_eq!(done.values.len(), 3);
        assert_eq!(done.message, "temperature 31.0 degC, voltage 7.1 V");
        some.temperature = some.load;
        let without = result_of(&["pan", "lift"], &some);
        assert_eq!(without.result.get(HOTTEST), None, "{}", without.result);
    }

    #[test]
    fn expressions_may_name_what_the_motors_of_the_cells_joints_may_report() {
        let step = MotorsStep { robot: "arm".to_owned(), robot_span: Span::default() };
        assert_eq!(step.result_shape(&CellNames::default()), Shape::Anything);
    }
}
