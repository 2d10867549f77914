//! What the effects of a light stripe's rig share: each moves some numbers of it, the same in every picture.

use nalgebra::DMatrix;

use super::kind::{CandidateContext, DrivenBy, Family, Kind, Search, Setting, SiteKind, Sketch};
use super::tool_offset::length_of;
use super::{
    Contribution, Dof, Effect, EffectId, EffectNameError, LooksAt, Parameter, Sample, Site, Size, Unit,
    standard_error,
};
use crate::arm_model::RigNumber;

/// A number of the rig as a parameter: name, unit, greatest plausible size either way (internal unit), number.
pub(super) type RigParameter = (&'static str, Unit, f64, RigNumber);

/// Some numbers of the rig, one a parameter.
#[derive(Debug)]
struct RigNumbers {
    parameters: Vec<Parameter>,
    numbers: Vec<RigNumber>,
}

impl Effect for RigNumbers {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Nothing
    }

    fn contribute(&self, _: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        let numbers = self.numbers.iter().enumerate();
        contributions.extend(numbers.map(|(parameter, number)| Contribution {
            parameter,
            dof: Dof::Rig(*number),
            rate: 1.0,
        }));
    }

    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        let unit = self.parameters.first().map_or(Unit::RATIO, |parameter| parameter.unit);
        let (value, error) = match values {
            // A single number keeps its sign.
            [value] => (*value, standard_error(covariance.get((0, 0)).copied().unwrap_or(0.0))),
            _ => {
                let length = length_of(values, covariance);
                (length.value, length.error)
            }
        };
        Size { value: value * unit.factor, unit: unit.name, error: error * unit.factor }
    }
}

/// Makes the effect of these numbers; the model has to have a rig.
pub(super) fn build(
    setting: &Setting<'_>,
    parameters: &[RigParameter],
) -> Result<Box<dyn Effect>, EffectNameError> {
    needs_rig(setting)?;
    // Each parameter is one number of the rig, in the same order.
    let numbers = parameters.iter().map(|(.., number)| *number).collect();
    let parameters =
        parameters.iter().map(|(name, unit, most, _)| Parameter::new(name, *unit, (-most, *most))).collect();
    Ok(Box::new(RigNumbers { parameters, numbers }))
}

/// Refuses a model without a rig.
pub(super) fn needs_rig(setting: &Setting<'_>) -> Result<(), EffectNameError> {
    match setting.model.stripe_rig {
        Some(_) => Ok(()),
        // A rig has a file of its own, which is given beside the model.
        None => Err(setting.unusable(
            "is of the rig of a light stripe, which no model file holds: give it to `plumb stripe`",
        )),
    }
}

/// A candidate where stripes were seen.
pub(super) fn candidates(name: &str, context: &CandidateContext<'_>) -> Vec<EffectId> {
    match context.summary.stripes {
        true => vec![EffectId::at(name, Site::Sensor)],
        false => Vec::new(),
    }
}

/// What all kinds of the rig have alike.
pub(super) const fn kind(
    name: &'static str,
    sentence: &'static str,
    how_to_see: &'static str,
    sketch: Sketch,
    build: fn(&Setting<'_>) -> Result<Box<dyn Effect>, EffectNameError>,
    candidates: fn(&CandidateContext<'_>) -> Vec<EffectId>,
) -> Kind {
    Kind {
        name,
        family: Family::Sensor,
        sites: SiteKind::Sensor,
        geometry_group: false,
        depends_on_conditions: false,
        imitates_anything: false,
        depends_on_time: false,
        is_event: false,
        search: Search::Nothing,
        driven_by: DrivenBy::Several,
        sentence,
        how_to_see,
        sketch,
        build,
        candidates,
    }
}
