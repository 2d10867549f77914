//! The list of effects: help, files, candidates and screens are read from it.

use super::Effect;
use super::defined::{Defined, Definition};
use super::identity::{EffectId, EffectNameError, Written};
use super::kind::{Kind, Setting};
use super::pose_error::{POSE_ERROR, PoseError};
use super::sites::Sites;
use crate::arm_model::Model;
use crate::suggestion::suggestion;

static KINDS: &[Kind] = &[
    super::joint_zero::KIND,
    super::link_length::KIND,
    super::link_offset::KIND,
    super::link_twist::KIND,
    super::axis_skew::KIND,
    super::axis_roll::KIND,
    super::axis_pitch::KIND,
    super::axis_yaw::KIND,
    super::tool_offset::KIND,
    super::joint_gain::KIND,
    super::joint_compliance::KIND,
    super::joint_stiffening::KIND,
    super::gravity_flexure::KIND,
    super::joint_backlash::KIND,
    super::joint_settling::KIND,
    super::joint_lag::KIND,
    super::joint_coupling::KIND,
    super::joint_step::KIND,
    super::joint_harmonic::KIND,
    super::screw_wave::KIND,
    super::positioning_error::KIND,
    super::link_sag::KIND,
    super::link_torsion::KIND,
    super::thermal_growth::KIND,
    super::warm_up::KIND,
    super::drift::KIND,
    super::base_tilt::KIND,
    super::base_position::KIND,
    super::scale::KIND,
    super::trigger_height::KIND,
    super::trigger_spot::KIND,
    super::trigger_hysteresis::KIND,
    super::reflectance::KIND,
    super::sensor_tilt::KIND,
    super::camera_aim::KIND,
    super::camera_roll::KIND,
    super::camera_scale::KIND,
    super::principal_point::KIND,
    super::lens_distortion::KIND,
    super::stripe_plane::KIND,
    super::stripe_bow::KIND,
    super::hand_eye::KIND,
    super::clock_skew::KIND,
    super::instrument_tilt::KIND,
    super::reading_warming::KIND,
    super::reading_reset::KIND,
    super::reading_rescaled::KIND,
    super::base_shifted::KIND,
    super::base_reset::KIND,
    super::target_reset::KIND,
    super::joint_zero_reset::KIND,
];

/// All kinds of effect, in the order they are listed to people.
pub fn kinds() -> &'static [Kind] {
    KINDS
}

/// A kind by its name.
pub fn kind(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.name == name)
}

/// Makes an effect at its place.
///
/// # Errors
/// The name is not known, or the model lacks what the effect needs.
pub fn build(id: &EffectId, model: &Model) -> Result<Box<dyn Effect>, EffectNameError> {
    if let Some(definition) = model.definition(&id.name) {
        return Ok(Box::new(Defined::new(definition)));
    }
    // It is in no list: nobody may write it.
    if id.name == POSE_ERROR && !model.pose_errors.is_empty() {
        return Ok(Box::new(PoseError::new(model)));
    }
    let kind = kind(&id.name).ok_or_else(|| unknown(&id.name, model))?;
    (kind.build)(&Setting { id, model })
}

fn unknown(name: &str, model: &Model) -> EffectNameError {
    let names = KINDS.iter().map(|kind| kind.name);
    let names = names.chain(model.definitions.iter().map(|definition| definition.name.as_str()));
    EffectNameError::UnknownEffect { name: name.to_owned(), suggestion: suggestion(name, names) }
}

/// Reads `joint_zero(shoulder)`, `joint_harmonic(waist, 1)`: exactly one effect.
///
/// # Errors
/// Unknown names, a wildcard, or the wrong number of arguments.
pub fn parse(text: &str, model: &Model) -> Result<EffectId, EffectNameError> {
    // One effect is a list of one.
    let mut ids = expand(text, model)?;
    match (ids.pop(), ids.is_empty()) {
        (Some(id), true) => Ok(id),
        _ => Err(EffectNameError::Malformed {
            text: text.to_owned(),
            example: "one effect at one place".to_owned(),
        }),
    }
}

/// Reads one effect, a wildcard (`joint_zero(*)`) or a group (`geometry(*)`), and lists what it means.
///
/// # Errors
/// Unknown names or the wrong number of arguments.
pub fn expand(text: &str, model: &Model) -> Result<Vec<EffectId>, EffectNameError> {
    let written = Written::split(text)?;
    if written.name == "geometry" {
        let group = KINDS.iter().filter(|kind| kind.geometry_group);
        let parts: Result<Vec<_>, _> =
            group.map(|kind| Sites::new(kind, text, model).at(&written.arguments)).collect();
        return Ok(parts?.into_iter().flatten().collect());
    }
    if let Some(definition) = model.definition(written.name) {
        return defined_at(definition, text, &written.arguments, model);
    }
    let kind = kind(written.name).ok_or_else(|| unknown(written.name, model))?;
    Sites::new(kind, text, model).at(&written.arguments)
}

/// A defined effect is at one place: naming it is allowed, not needed.
fn defined_at(
    definition: &Definition,
    text: &str,
    arguments: &[&str],
    model: &Model,
) -> Result<Vec<EffectId>, EffectNameError> {
    let id = EffectId::at(&definition.name, definition.site);
    match arguments {
        [] | ["*"] => Ok(vec![id]),
        [site] if *site == model.site_name(id.site) => Ok(vec![id]),
        _ => Err(EffectNameError::Malformed { text: text.to_owned(), example: model.label(&id) }),
    }
}
