//! `define:`: effects of the user's own, from what was typed to what can be worked out.

use std::sync::Arc;

use plumb_document::Spanned;
use plumb_kinematics::DhParameter;

use super::raw::{RawAdds, RawDefinition, RawParameter};
use super::validate::{Checked, Checker};
use crate::arm_model::Model;
use crate::effect::{self, Addend, Definition, FormulaTarget, Parameter, Site, Unit};
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
        self.name_is_free(&raw.name, model)?;
        let parameters = raw.parameters.0.iter().map(|(key, parameter)| self.parameter(key, parameter));
        let parameters: Vec<Parameter> = parameters.collect::<Checked<_>>()?;
        if parameters.is_empty() {
            return self.fail(
                &raw.name.span,
                "an effect needs at least one parameter to be fitted, with `unit` and `range`",
            );
        }
        let names: Vec<String> = parameters.iter().map(|parameter| parameter.name.clone()).collect();
        let addends = self.addends(raw, &names, model)?;
        let site = match (&raw.place, addends.first()) {
            (Some(name), _) => self.site(name, model)?,
            (None, Some(addend)) => site_of(&addend.target),
            (None, None) => Site::Base,
        };
        Ok(Definition::new(&raw.name.value, site, addends, parameters, raw.sentence.clone()))
    }

    /// The name of a new effect is a word, and no other effect has it.
    fn name_is_free(&self, name: &Spanned<String>, model: &Model) -> Checked<()> {
        if !is_word(&name.value) {
            return self.fail(
                &name.span,
                format!("`{}` cannot be an effect's name; use letters, digits and _", name.value),
            );
        }
        // A name means one effect, no matter who defined it.
        let taken = model.definitions.iter().any(|known| known.name == name.value);
        if effect::kind(&name.value).is_some() || name.value == "geometry" || taken {
            return self.fail(
                &name.span,
                format!("there is an effect `{}` already; choose another name", name.value),
            );
        }
        Ok(())
    }

    fn parameter(&self, key: &Spanned<String>, parameter: &RawParameter) -> Checked<Parameter> {
        if !is_word(&key.value) {
            return self.fail(&key.span, format!("`{}` cannot be a parameter's name", key.value));
        }
        let unit = parameter.unit.as_ref().map_or(Ok(Unit::RATIO), |unit| self.unit(unit))?;
        let [low, high] = parameter.range.value;
        if low.partial_cmp(&high) != Some(std::cmp::Ordering::Less) {
            return self.fail(
                &parameter.range.span,
                format!("the range [{low}, {high}] holds no value; the lower comes first"),
            );
        }
        Ok(Parameter { name: key.value.clone(), unit, range: (low, high) })
    }

    fn unit(&self, unit: &Spanned<String>) -> Checked<Unit> {
        let known = Unit::names().iter().copied();
        Unit::by_name(&unit.value).map_or_else(
            || {
                let reason = format!("no unit `{}` is known{}", unit.value, suggestion(&unit.value, known));
                self.fail(&unit.span, reason)
            },
            Ok,
        )
    }

    fn site(&self, name: &Spanned<String>, model: &Model) -> Checked<Site> {
        let text = name.value.as_str();
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == text);
        let joint = model.chain.position_of(text).map(Site::Joint);
        let site =
            joint.or_else(|| model.target_position(text).map(Site::Target)).or_else(|| axis.map(Site::Axis));
        let site = site.or(match text {
            "base" => Some(Site::Base),
            "instrument" => Some(Site::Instrument),
            "sensor" => Some(Site::Sensor),
            _ => None,
        });
        let known = model.chain.joints.iter().map(|joint| joint.name.as_str()).chain([
            "base",
            "instrument",
            "sensor",
        ]);
        site.map_or_else(
            || self.fail(&name.span, format!("there is no place `{text}`{}", suggestion(text, known))),
            Ok,
        )
    }

    /// What the effect adds, each with its formula.
    fn addends(&self, raw: &RawDefinition, names: &[String], model: &Model) -> Checked<Vec<Addend>> {
        let mut requested: Vec<Requested<'_>> = self.joint_addend(raw, model)?.into_iter().collect();
        self.target_addends(&raw.adds, model, &mut requested)?;
        frame_addends(&raw.adds, &mut requested);
        if requested.is_empty() {
            return self.fail(&raw.name.span, format!("`adds` says nothing that is added; {EXAMPLE}"));
        }
        let read = requested.into_iter().map(|(target, key, text)| {
            Addend::new(target, &key, &text.value, names, model.chain.len(), self.location(&text.span))
                .or_else(|error| self.fail(&text.span, error.to_string()))
        });
        read.collect()
    }

    /// What is added to a joint's coordinate or to one number of its row: one of them at most, in the unit that belongs to it.
    fn joint_addend<'r>(&self, raw: &'r RawDefinition, model: &Model) -> Checked<Option<Requested<'r>>> {
        let adds = &raw.adds;
        let given = [&adds.joint, &adds.length, &adds.offset, &adds.twist, &adds.skew];
        let mut given = given.into_iter().enumerate().filter_map(|(key, name)| Some((key, name.as_ref()?)));
        let Some((key, name)) = given.next() else { return Ok(None) };
        if let Some((_, second)) = given.next() {
            return self.fail(
                &second.span,
                format!("`adds` acts on one of joint, length, offset, twist, skew; {EXAMPLE}"),
            );
        }
        let joint = self.joint_named(name, &model.chain)?;
        let target = match key {
            0 => FormulaTarget::Coordinate(joint),
            1 => FormulaTarget::Row(joint, DhParameter::A),
            2 => FormulaTarget::Row(joint, DhParameter::D),
            3 => FormulaTarget::Row(joint, DhParameter::Alpha),
            _ => FormulaTarget::Row(joint, DhParameter::Beta),
        };
        let is_length = match &target {
            FormulaTarget::Coordinate(joint) => model.slides(*joint),
            FormulaTarget::Row(_, dh_parameter) => matches!(dh_parameter, DhParameter::A | DhParameter::D),
            _ => false,
        };
        let unit = if is_length { "mm" } else { "deg" };
        match (&adds.deg, &adds.mm) {
            (Some(text), _) if !is_length => Ok(Some((target, unit.to_owned(), text))),
            (None, Some(text)) if is_length => Ok(Some((target, unit.to_owned(), text))),
            _ => self.fail(&name.span, format!("what is added here is in {unit}; {EXAMPLE}")),
        }
    }

    /// What is added to a target's position.
    fn target_addends<'r>(
        &self,
        adds: &'r RawAdds,
        model: &Model,
        requested: &mut Vec<Requested<'r>>,
    ) -> Checked<()> {
        let target = adds.target.as_ref().map(|name| self.target(name, model)).transpose()?;
        for (axis, text) in [&adds.x_mm, &adds.y_mm, &adds.z_mm].into_iter().enumerate() {
            let (Some(text), key) = (text, format!("{}_mm", axis_name(axis))) else { continue };
            match target {
                Some(target) => requested.push((FormulaTarget::Target(target, axis), key, text)),
                None => {
                    return self.fail(
                        &text.span,
                        format!("`{key}` moves a target; name it: adds: {{target: p1, {key}: ...}}"),
                    );
                }
            }
        }
        Ok(())
    }

    fn target(&self, name: &Spanned<String>, model: &Model) -> Checked<usize> {
        let known = model.targets.iter().map(|target| target.name.as_str());
        model.target_position(&name.value).map_or_else(
            || {
                let reason = format!("there is no target `{}`{}", name.value, suggestion(&name.value, known));
                self.fail(&name.span, reason)
            },
            Ok,
        )
    }
}

/// Something an effect adds: where, under which key, and the formula.
type Requested<'r> = (FormulaTarget, String, &'r Spanned<String>);

/// What is added to the base, to the instrument's readings and to the sensor's trigger height.
fn frame_addends<'r>(adds: &'r RawAdds, requested: &mut Vec<Requested<'r>>) {
    let shifts = [&adds.base_x_mm, &adds.base_y_mm, &adds.base_z_mm];
    let turns = [&adds.base_x_deg, &adds.base_y_deg, &adds.base_z_deg];
    let readings = [&adds.reading_x_mm, &adds.reading_y_mm, &adds.reading_z_mm];
    for axis in 0..3 {
        let name = axis_name(axis);
        let all = [
            (FormulaTarget::BaseShift(axis), format!("base_{name}_mm"), shifts[axis]),
            (FormulaTarget::BaseRotation(axis), format!("base_{name}_deg"), turns[axis]),
            (FormulaTarget::Reading(axis), format!("reading_{name}_mm"), readings[axis]),
        ];
        requested
            .extend(all.into_iter().filter_map(|(target, key, text)| Some((target, key, text.as_ref()?))));
    }
    let height = adds.trigger_height_mm.as_ref();
    requested.extend(height.map(|text| (FormulaTarget::TriggerHeight, "trigger_height_mm".to_owned(), text)));
}

/// Where an effect acts that adds to this target.
fn site_of(target: &FormulaTarget) -> Site {
    match target {
        FormulaTarget::Coordinate(joint) | FormulaTarget::Row(joint, _) => Site::Joint(*joint),
        FormulaTarget::Target(target, _) => Site::Target(*target),
        FormulaTarget::BaseShift(_) | FormulaTarget::BaseRotation(_) => Site::Base,
        FormulaTarget::Reading(_) => Site::Instrument,
        FormulaTarget::TriggerHeight => Site::Sensor,
    }
}

/// Letters, digits and _, a letter first.
fn is_word(text: &str) -> bool {
    text.starts_with(|letter: char| letter.is_alphabetic())
        && text.chars().all(|letter| letter.is_alphanumeric() || letter == '_')
}

fn axis_name(axis: usize) -> &'static str {
    ["x", "y", "z"].get(axis).copied().unwrap_or("?")
}
