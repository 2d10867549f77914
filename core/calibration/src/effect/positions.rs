//! Effects of a slide that the positions which were measured cannot show, whatever was read there.

use super::identity::EffectId;
use super::kind::CandidateContext;
use super::sampling::Sampling;
use super::{positioning_error, screw_wave};
use crate::arm_model::Model;

/// Runs of positions that determine a wave: so many to its period, over so many periods.
const TO_A_PERIOD: f64 = 4.0;
const PERIODS: f64 = 2.0;

/// Why the positions of a table cannot show an effect, and which would; nothing where they can, or where an effect asks for none.
pub fn not_at_these_positions(context: &CandidateContext<'_>, id: &EffectId) -> Option<String> {
    let name = &context.model.chain.joints.get(id.joint()?)?.name;
    let label = context.model.label(id);
    if let Some((from, to)) = positioning_error::unmeasured(context, id) {
        return Some(format!(
            "{label} needs positions all along the travel, and {name} was not measured near the middle of {from:.1} to {to:.1} mm: measure there, take fewer pieces, or give {name} \
             the limits_mm between which it was measured"
        ));
    }
    let looks = match screw_wave::sampling_of(context, id)? {
        Sampling::Separable => return None,
        Sampling::TooFew { positions, fewest } => {
            format!("{name} was measured at {positions} positions, and it takes {fewest}")
        }
        Sampling::LooksLike { period } if period.is_finite() => {
            format!(
                "at the positions of {name} that were measured it looks like a slow wave of {period:.1} mm"
            )
        }
        Sampling::LooksLike { .. } => {
            format!(
                "at the positions of {name} that were measured, whole pitches apart, it is the same everywhere"
            )
        }
    };
    // By the period, not the pitch: a wave that comes twice a turn needs positions twice as close.
    let period = screw_wave::period_of(context.model, id)?;
    Some(format!(
        "{label} cannot be identified: {looks}. Measure at random within a pitch (ISO 230-2), or a run of positions {:.2} mm apart over {:.1} mm",
        period / TO_A_PERIOD,
        PERIODS * period
    ))
}

/// The waves of screws whose pitch a model gives and that the positions of a table cannot show, each with the reason.
pub fn waves_not_shown(context: &CandidateContext<'_>) -> Vec<String> {
    let model: &Model = context.model;
    let screws = (0..model.chain.len()).filter(|joint| {
        let pitch = model.chain.joints.get(*joint).and_then(|row| row.screw_pitch);
        pitch.is_some() && context.summary.positions.get(*joint).is_some_and(|positions| positions.len() > 1)
    });
    let waves = screws
        .map(|joint| EffectId { order: Some(1.0), ..EffectId::at("screw_wave", super::Site::Joint(joint)) });
    waves.filter_map(|wave| not_at_these_positions(context, &wave)).collect()
}
