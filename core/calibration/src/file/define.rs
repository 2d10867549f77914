//! `define:`: effects of the user's own, from what was typed to what can be worked out.

use std::sync::Arc;

use plumb_document::Spanned;
use plumb_kinematics::Knob;

use super::raw::{RawAdds, RawDefinition};
use super::validate::{Checked, Checker};
use crate::arm_model::Model;
use crate::effect::{self, Addend, DefinedPlace, Definition, Parameter, Spot, Unit};
use crate::suggestion::suggestion;

const EXAMPLE: &str = "write for example adds: {joint: shoulder, deg: \"a*sin(3*q2)\"}";

impl Checker<'_> {
    /// Whether all of them are right: their names are then known to the effects.
    pub(super) fn definitions(&self, raw: &[RawDefinition], model: &mut Model) -> bool {
        for raw in raw {
            if let Ok(definition) = self.definition(raw, model) {
                model.definitions.push(Arc::new(definition));
            }
        }
        raw.len() == model.definitions.len()
    }

    fn definition(&self, raw: &RawDefinition, model: &Model) -> Checked<Definition> {
        let name = &raw.name;
        let word = |text: &str| {
            text.starts_with(|letter: char| letter.is_alphabetic())
                && text.chars().all(|letter| letter.is_alphanumeric() || letter == '_')
        };
        if !word(&name.value) {
            return self.fail(
                &name.span,
                format!("`{}` cannot be an effect's name; use letters, digits and _", name.value),
            );
        }
        let taken = model.definitions.iter().any(|known| known.name == name.value);
        if effect::kind(&name.value).is_some() || name.value == "geometry" || taken {
            return self.fail(
                &name.span,
                format!("there is an effect `{}` already; choose another name", name.value),
            );
        }
        let mut parameters = Vec::new();
        let mut names = Vec::new();
        for (key, parameter) in &raw.parameters.0 {
            if !word(&key.value) {
                return self.fail(&key.span, format!("`{}` cannot be a parameter's name", key.value));
            }
            let unit = match &parameter.unit {
                None => Unit::RATIO,
                Some(unit) => match Unit::by_name(&unit.value) {
                    Some(known) => known,
                    None => {
                        let known = Unit::names().iter().copied();
                        return self.fail(
                            &unit.span,
                            format!("no unit `{}` is known{}", unit.value, suggestion(&unit.value, known)),
                        );
                    }
                },
            };
            let [low, high] = parameter.range.value;
            if low.partial_cmp(&high) != Some(std::cmp::Ordering::Less) {
                return self.fail(
                    &parameter.range.span,
                    format!("the range [{low}, {high}] holds no value; the lower comes first"),
                );
            }
            parameters.push(Parameter { name: key.value.clone(), unit, range: (low, high) });
            names.push(key.value.clone());
        }
        if parameters.is_empty() {
            return self.fail(
                &name.span,
                "an effect needs at least one parameter to be fitted, with `unit` and `range`",
            );
        }
        let addends = self.addends(raw, &names, model)?;
        let spot = match (&raw.place, addends.first()) {
            (Some(place), _) => self.spot(place, model)?,
            (None, Some(addend)) => match addend.place {
                DefinedPlace::Coordinate(joint) | DefinedPlace::Row(joint, _) => Spot::Joint(joint),
                DefinedPlace::Target(target, _) => Spot::Target(target),
                DefinedPlace::BaseShift(_) | DefinedPlace::BaseTurn(_) => Spot::Base,
                DefinedPlace::Reading(_) => Spot::Instrument,
                DefinedPlace::TriggerHeight => Spot::Sensor,
            },
            (None, None) => Spot::Base,
        };
        Ok(Definition::new(&name.value, spot, addends, parameters, raw.sentence.clone()))
    }

    fn spot(&self, place: &Spanned<String>, model: &Model) -> Checked<Spot> {
        let text = place.value.as_str();
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == text);
        let joint = model.chain.position_of(text).map(Spot::Joint);
        let spot =
            joint.or_else(|| model.target_position(text).map(Spot::Target)).or_else(|| axis.map(Spot::Axis));
        let spot = spot.or(match text {
            "base" => Some(Spot::Base),
            "instrument" => Some(Spot::Instrument),
            "sensor" => Some(Spot::Sensor),
            _ => None,
        });
        let known = model.chain.joints.iter().map(|joint| joint.name.as_str()).chain([
            "base",
            "instrument",
            "sensor",
        ]);
        spot.map_or_else(
            || self.fail(&place.span, format!("there is no place `{text}`{}", suggestion(text, known))),
            Ok,
        )
    }

    fn addends(&self, raw: &RawDefinition, names: &[String], model: &Model) -> Checked<Vec<Addend>> {
        let adds = &raw.adds;
        let joint = |name: &Spanned<String>| self.joint_named(name, &model.chain);
        let mut wanted: Vec<(DefinedPlace, String, &Spanned<String>)> = Vec::new();
        let one = |unit: &str, text: &Option<Spanned<String>>| text.as_ref().map(|_| unit.to_owned());
        let given = one("deg", &adds.deg).or_else(|| one("mm", &adds.mm));
        let single: Option<(DefinedPlace, &Spanned<String>, &str)> =
            match (&adds.joint, &adds.length, &adds.offset, &adds.twist, &adds.skew) {
                (Some(name), None, None, None, None) => {
                    let index = joint(name)?;
                    let unit = if model.slides(index) { "mm" } else { "deg" };
                    Some((DefinedPlace::Coordinate(index), name, unit))
                }
                (None, Some(name), None, None, None) => {
                    Some((DefinedPlace::Row(joint(name)?, Knob::A), name, "mm"))
                }
                (None, None, Some(name), None, None) => {
                    Some((DefinedPlace::Row(joint(name)?, Knob::D), name, "mm"))
                }
                (None, None, None, Some(name), None) => {
                    Some((DefinedPlace::Row(joint(name)?, Knob::Alpha), name, "deg"))
                }
                (None, None, None, None, Some(name)) => {
                    Some((DefinedPlace::Row(joint(name)?, Knob::Beta), name, "deg"))
                }
                (None, None, None, None, None) => None,
                _ => {
                    return self.fail(
                        &raw.name.span,
                        format!("`adds` acts on one of joint, length, offset, twist, skew; {EXAMPLE}"),
                    );
                }
            };
        if let Some((place, name, unit)) = single {
            let text = if unit == "deg" { &adds.deg } else { &adds.mm };
            match (text, given.as_deref() == Some(unit)) {
                (Some(text), true) => wanted.push((place, unit.to_owned(), text)),
                _ => {
                    return self.fail(&name.span, format!("what is added here is in {unit}; {EXAMPLE}"));
                }
            }
        }
        let target = match &adds.target {
            None => None,
            Some(name) => match model.target_position(&name.value) {
                Some(index) => Some(index),
                None => {
                    let known = model.targets.iter().map(|target| target.name.as_str());
                    return self.fail(
                        &name.span,
                        format!("there is no target `{}`{}", name.value, suggestion(&name.value, known)),
                    );
                }
            },
        };
        for (axis, text) in [&adds.x_mm, &adds.y_mm, &adds.z_mm].into_iter().enumerate() {
            let (Some(text), key) = (text, format!("{}_mm", axis_name(axis))) else { continue };
            match target {
                Some(target) => wanted.push((DefinedPlace::Target(target, axis), key, text)),
                None => {
                    return self.fail(
                        &text.span,
                        format!("`{key}` moves a target; name it: adds: {{target: p1, {key}: ...}}"),
                    );
                }
            }
        }
        self.frame_addends(adds, &mut wanted);
        if wanted.is_empty() {
            return self.fail(&raw.name.span, format!("`adds` says nothing that is added; {EXAMPLE}"));
        }
        let read = |(place, key, text): (DefinedPlace, String, &Spanned<String>)| {
            Addend::new(place, &key, &text.value, names, model.chain.len(), self.place(&text.span))
                .or_else(|error| self.fail(&text.span, error.to_string()))
        };
        wanted.into_iter().map(read).collect()
    }

    fn frame_addends<'r>(
        &self,
        adds: &'r RawAdds,
        wanted: &mut Vec<(DefinedPlace, String, &'r Spanned<String>)>,
    ) {
        let shifts = [&adds.base_x_mm, &adds.base_y_mm, &adds.base_z_mm];
        let turns = [&adds.base_x_deg, &adds.base_y_deg, &adds.base_z_deg];
        let readings = [&adds.reading_x_mm, &adds.reading_y_mm, &adds.reading_z_mm];
        for axis in 0..3 {
            let name = axis_name(axis);
            let mut add = |place, key: String, text: &'r Option<Spanned<String>>| {
                wanted.extend(text.as_ref().map(|text| (place, key, text)));
            };
            add(DefinedPlace::BaseShift(axis), format!("base_{name}_mm"), shifts[axis]);
            add(DefinedPlace::BaseTurn(axis), format!("base_{name}_deg"), turns[axis]);
            add(DefinedPlace::Reading(axis), format!("reading_{name}_mm"), readings[axis]);
        }
        wanted.extend(
            adds.trigger_height_mm
                .as_ref()
                .map(|text| (DefinedPlace::TriggerHeight, "trigger_height_mm".to_owned(), text)),
        );
    }
}

fn axis_name(axis: usize) -> &'static str {
    ["x", "y", "z"].get(axis).copied().unwrap_or("?")
}
