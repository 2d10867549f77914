//! Something moves while the machine warms up, fast at first and then ever slower.

use plumb_kinematics::DhParameter;

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Dof, Effect, EffectId, EffectNameError, Parameter, Quantity, Sample, Unit};

/// Time constants that are tried, as shares of the time the table spans.
const CONSTANTS: [f64; 8] = [0.04, 0.08, 0.15, 0.25, 0.4, 0.7, 1.2, 2.5];

#[derive(Debug)]
struct WarmUp {
    joint: usize,
    of: Quantity,
    time_constant: f64,
    parameters: [Parameter; 1],
}

impl Effect for WarmUp {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        let time = if sample.time.is_finite() { sample.time } else { 0.0 };
        // One heat store that loses heat to the room in proportion to what it has (Newton's law of cooling).
        let rate = 1.0 - (-time / self.time_constant).exp();
        let dh_parameter = match self.of {
            Quantity::Zero => return contributions.push(sample.contribute_to_joint(self.joint, 0, rate)),
            Quantity::Length => DhParameter::A,
            Quantity::Offset => DhParameter::D,
        };
        contributions.push(Contribution { parameter: 0, dof: Dof::Joint(self.joint, dh_parameter), rate });
    }
}

pub(super) const KIND: Kind = Kind {
    name: "warm_up",
    family: Family::LinkAndTime,
    sites: SiteKind::JointsAndQuantity,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: true,
    is_event: false,
    // Neighbouring time constants fit nearly as well: the search costs as much as one more parameter.
    search: Search::Smooth,
    driven_by: DrivenBy::Time,
    sentence: "Something of the joint moves while the machine warms up: fast at first, then ever slower.",
    how_to_see: "The same poses from a cold start on, with the time logged.",
    sketch: ["         ╭────── warm", "      ╭──╯", "  ────╯ since it started"],
    build: |setting: &Setting<'_>| {
        let joint = setting.joint()?;
        let of = setting.id.of.ok_or_else(|| EffectNameError::Malformed {
            text: setting.model.label(setting.id),
            example: "warm_up(elbow, zero): the joint, and its zero, length or offset".to_owned(),
        })?;
        let time_constant =
            setting.id.inner.filter(|constant| *constant > 0.0).ok_or_else(|| EffectNameError::Unusable {
                effect: setting.model.label(setting.id),
                reason: "needs a time constant, in s: write `searched:` or let `add` find it".to_owned(),
            })?;
        let parameter = match (of, setting.slides(joint)) {
            // 6 degrees, or 10 mm: steel of a metre grows by 10 mm in 800 K.
            (Quantity::Zero, false) => Parameter::new("amount_deg", Unit::DEG, (-0.1, 0.1)),
            _ => Parameter::new("amount_mm", Unit::MM, (-10.0, 10.0)),
        };
        Ok(Box::new(WarmUp { joint, of, time_constant, parameters: [parameter] }))
    },
    candidates: |context| {
        let Some(span) = context.summary.time_span.filter(|span| *span > 0.0) else { return Vec::new() };
        let ids = context.every_joint("warm_up").into_iter();
        ids.flat_map(|id| Quantity::ALL.map(|of| EffectId { of: Some(of), ..id.clone() }))
            .flat_map(|id| CONSTANTS.map(|fraction| EffectId { inner: Some(fraction * span), ..id.clone() }))
            .collect()
    },
};
