//! `correct`: what a calibration found of a sensor is applied, as corrections of its parameters.

use crate::expression::Expression;
use crate::read_context::{CheckContext, ReadContext};
use crate::yaml::{Key, MapReader, Node, Place};

/// Declared corrections of a sensor's parameters.
#[derive(Debug, Clone)]
pub struct CorrectStep {
    /// Which sensor.
    pub sensor: String,
    /// Where its name stands.
    pub sensor_place: Place,
    /// The parameters that change.
    pub parameters: Vec<ParameterCorrection>,
    /// A person (or the answers file) accepts it first.
    pub ask: bool,
}

/// The correction of one parameter.
#[derive(Debug, Clone)]
pub struct ParameterCorrection {
    /// The parameter, as the sensor's plugin names it under `corrections`: its unit is the end of its name.
    pub key: String,
    /// Where it stands.
    pub place: Place,
    /// How it changes.
    pub change: Change,
    /// One standard uncertainty of the change, or its budget.
    pub uncertainty: Expression,
    /// A greater change is a mistake, not a correction.
    pub plausible: f64,
}

/// How a parameter changes.
#[derive(Debug, Clone)]
pub enum Change {
    /// By this much; 0 changes nothing, and is the parameter's value before any correction.
    Shift(Expression),
    /// By this factor; 1 changes nothing, and is the parameter's value before any correction.
    Factor(Expression),
}

impl Change {
    /// The parameter's value before any correction.
    pub fn uncorrected(&self) -> f64 {
        match self {
            Change::Shift(_) => 0.0,
            Change::Factor(_) => 1.0,
        }
    }
}

/// Units that a parameter's name can end in; a name without one of them is of a plain number.
const UNITS: &[&str] = &["deg", "mm", "px"];

/// A parameter's name without its unit, and the unit: `camera_roll`, `deg`.
pub(crate) fn name_and_unit(key: &str) -> (&str, &str) {
    let ending = |unit: &&&str| key.strip_suffix(**unit).is_some_and(|name| name.ends_with('_'));
    match UNITS.iter().find(ending) {
        Some(unit) => (key.get(..key.len() - unit.len() - 1).unwrap_or(key), unit),
        None => (key, ""),
    }
}

/// A parameter's name as the plugin has it: [`name_and_unit`] the other way.
pub(crate) fn key_of(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}_{unit}") }
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<CorrectStep> {
    let mut map = MapReader::new(node, "`correct`", context.problems)?;
    let sensor = context.required_text(&mut map, "sensor");
    let parameters =
        map.required("parameters").and_then(|node| node.entries("`parameters`", context.problems));
    let ask = map.optional("ask").and_then(|node| node.boolean("`ask`", context.problems)).unwrap_or(true);
    let place = map.place();
    map.finish();
    let (sensor, sensor_place) = sensor?;
    let parameters = parameters?;
    if parameters.is_empty() {
        let help = "name what changes, as in `parameters: {camera_roll_deg: {shift: found.roll_deg, uncertainty: 0.02, plausible: 5}}`";
        context.problems.add(place, "this corrects nothing", help);
    }
    let parameters: Vec<ParameterCorrection> =
        parameters.iter().filter_map(|(key, node)| read_parameter(key, node, context)).collect();
    Some(CorrectStep { sensor, sensor_place, parameters, ask })
}

fn read_parameter(key: &Key, node: &Node, context: &ReadContext<'_>) -> Option<ParameterCorrection> {
    let mut map = MapReader::new(node, "a parameter's correction", context.problems)?;
    let factor = map.optional("factor");
    let change = match factor {
        Some(node) => context.expression(node, "the factor").map(Change::Factor),
        None => {
            map.required("shift").and_then(|node| context.expression(node, "the shift")).map(Change::Shift)
        }
    };
    let uncertainty =
        map.required("uncertainty").and_then(|node| context.expression(node, "the uncertainty"));
    let plausible = map
        .required("plausible")
        .and_then(|node| node.number_between("`plausible`", 1e-9, 1e6, context.problems));
    map.finish();
    Some(ParameterCorrection {
        key: key.name.clone(),
        place: key.place,
        change: change?,
        uncertainty: uncertainty?,
        plausible: plausible?,
    })
}

impl CorrectStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        context.sensor(&self.sensor, self.sensor_place);
        for parameter in &self.parameters {
            let (Change::Shift(change) | Change::Factor(change)) = &parameter.change;
            context.check_expression(change);
            context.check_expression(&parameter.uncertainty);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameters_unit_is_the_end_of_its_name() {
        assert_eq!(name_and_unit("camera_roll_deg"), ("camera_roll", "deg"));
        assert_eq!(name_and_unit("sheet_offset_mm"), ("sheet_offset", "mm"));
        assert_eq!(name_and_unit("camera_scale_u"), ("camera_scale_u", ""));
        assert_eq!(name_and_unit("deg"), ("deg", ""));
        for key in ["camera_roll_deg", "camera_scale_u", "gain"] {
            let (name, unit) = name_and_unit(key);
            assert_eq!(key_of(name, unit), key);
        }
    }
}
