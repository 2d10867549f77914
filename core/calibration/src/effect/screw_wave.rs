//! A screw runs out of true: an error of a slide that is periodic in its travel, once or twice a turn of the screw (periodic positioning error, ISO 230-2).

use std::f64::consts::TAU;

use nalgebra::DMatrix;

use super::kind::{CandidateContext, DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::sampling::{Sampling, sampling};
use super::{
    Contribution, Effect, EffectId, EffectNameError, Parameter, Sample, Site, Size, Unit, amplitude,
};
use crate::arm_model::Model;

/// Waves a turn of the screw that are looked for: once, where its bearing's face or its nut is out of true; twice, where a coupling is bent.
const WAVES: [f64; 2] = [1.0, 2.0];

/// Greatest amplitude of a working screw, mm: ten times what rolled screws of the lowest grade are allowed (ISO 3408-3, grade 10).
const GREATEST: f64 = 0.5;

#[derive(Debug)]
struct ScrewWave {
    joint: usize,
    /// rad for a mm of travel.
    rate: f64,
    parameters: [Parameter; 2],
}

impl Effect for ScrewWave {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // Counted from the coordinate's zero, wherever the screw is there: the phase is found.
        let (sine, cosine) = (self.rate * sample.coordinate(self.joint)).sin_cos();
        contributions.push(sample.contribute_to_joint(self.joint, 0, sine));
        contributions.push(sample.contribute_to_joint(self.joint, 1, cosine));
    }

    fn changes_coordinate(&self) -> Option<usize> {
        Some(self.joint)
    }

    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        amplitude(values, covariance, Unit::MM)
    }
}

/// The period of a wave in a slide's travel, mm.
fn period(setting: &Setting<'_>) -> Result<f64, EffectNameError> {
    let joint = setting.joint()?;
    if !setting.slides(joint) {
        return Err(setting.unusable("is of a joint that slides: a turning one has joint_harmonic"));
    }
    let pitch = setting.model.chain.joints.get(joint).and_then(|row| row.screw_pitch);
    let pitch = pitch.ok_or_else(|| {
        setting.unusable("needs the travel for one turn of the screw in the joint's line of the model file, as in `screw_pitch_mm: 5`")
    })?;
    let waves = setting.id.order.filter(|order| *order > 0.0);
    let waves = waves.ok_or_else(|| EffectNameError::Malformed {
        text: setting.id.name.clone(),
        example: "screw_wave(x, 1): joint and waves a turn of its screw".to_owned(),
    })?;
    Ok(pitch / waves)
}

/// The period of an effect of this kind, mm; nothing of any other.
pub(super) fn period_of(model: &Model, id: &EffectId) -> Option<f64> {
    (id.name == KIND.name).then(|| period(&Setting { id, model }).ok()).flatten()
}

/// Whether the positions where an effect's joint was measured can determine it; nothing of any other effect.
pub(super) fn sampling_of(context: &CandidateContext<'_>, id: &EffectId) -> Option<Sampling> {
    let period = period_of(context.model, id)?;
    Some(sampling(context.summary.positions.get(id.joint()?)?, period))
}

pub(super) const KIND: Kind = Kind {
    name: "screw_wave",
    family: Family::Joint,
    sites: SiteKind::JointsAndOrder,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::ScrewTurn,
    sentence: "The screw of a slide runs out of true: the error comes back with every turn of the screw.",
    how_to_see: "Positions at random within a pitch, or a run of them a quarter of a pitch apart over two pitches; none at whole pitches.",
    sketch: ["   ╭╮  ╭╮  ╭╮", "  ╱  ╲╱  ╲╱  ╲ error", "  ├───┤ turn of the screw"],
    build: |setting: &Setting<'_>| {
        let rate = TAU / period(setting)?;
        let range = (-GREATEST, GREATEST);
        let parameters =
            [Parameter::new("sine_mm", Unit::MM, range), Parameter::new("cosine_mm", Unit::MM, range)];
        Ok(Box::new(ScrewWave { joint: setting.joint()?, rate, parameters }))
    },
    candidates: |context| {
        let joints = context.model.chain.joints.iter().enumerate();
        let screws = joints.filter(|(_, joint)| joint.screw_pitch.is_some()).map(|(index, _)| index);
        // A wave that the positions cannot distinguish from a slower one is no candidate: it would be named for whatever is slow.
        let waves = screws.flat_map(|joint| {
            WAVES.map(|waves| EffectId {
                order: Some(waves),
                ..EffectId::at("screw_wave", Site::Joint(joint))
            })
        });
        waves.filter(|id| sampling_of(context, id) == Some(Sampling::Separable)).collect()
    },
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{self, DatasetSummary};
    use crate::forward::rates;
    use crate::table::Table;

    const AXIS: &str = "
arm: axis
convention: distal
joints: [{name: x, slides: true, sign: -1, limits_mm: [0, 200], screw_pitch_mm: 5}, {name: turn}]
targets: {p1: {}}
";

    fn model(text: &str) -> Model {
        Model::parse("axis.yaml", text).unwrap()
    }

    fn refused(text: &str, effect: &str) -> String {
        let model = model(text);
        effect::build(&effect::parse(effect, &model).unwrap(), &model).unwrap_err().to_string()
    }

    #[test]
    fn it_is_a_sine_and_a_cosine_of_the_screws_angle() {
        let model = model(AXIS);
        let built = effect::build(&effect::parse("screw_wave(x, 2)", &model).unwrap(), &model).unwrap();
        // At 0.5 mm of 5 the screw has made a tenth of a turn, and a wave of two a turn a fifth of its own. The row counts against the axis.
        let found = rates(&model, built.as_ref(), &[0.5, 0.0], &[]);
        let angle = TAU / 5.0;
        assert!(
            (found[0] + angle.sin()).abs() < 1e-12 && (found[1] + angle.cos()).abs() < 1e-12,
            "{found:?}"
        );
        let size = built.size(&[0.03, 0.04], &DMatrix::from_diagonal(&vec![1e-6, 1e-6].into()));
        assert!((size.value - 0.05).abs() < 1e-12 && (size.error - 1e-3).abs() < 1e-12, "{size:?}");
        assert_eq!(size.unit, "mm");
    }

    #[test]
    fn it_needs_a_slide_and_its_pitch() {
        assert!(refused(AXIS, "screw_wave(turn, 1)").contains("is of a joint that slides"));
        let without = AXIS.replace(", screw_pitch_mm: 5", "");
        assert!(refused(&without, "screw_wave(x, 1)").contains("as in `screw_pitch_mm: 5`"));
    }

    #[test]
    fn it_is_a_candidate_where_the_positions_can_determine_it() {
        let offered = |spacing: f64| -> Vec<f64> {
            let rows = (0..12).map(|row| format!("{},0,{0},0,0\n", spacing * f64::from(row)));
            let text = format!("q1_mm,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n{}", rows.collect::<String>());
            let (model, table) = (model(AXIS), Table::parse("t.csv", &text).unwrap());
            let summary = DatasetSummary::of(&model, &table);
            let found = (KIND.candidates)(&CandidateContext { model: &model, summary: &summary });
            found.iter().filter_map(|id| id.order).collect()
        };
        assert_eq!(offered(1.1), [1.0, 2.0]);
        assert_eq!(offered(10.0), Vec::<f64>::new(), "whole pitches");
        assert_eq!(offered(2.5), [1.0], "half pitches tell one wave a turn, and two are a constant there");
    }
}
