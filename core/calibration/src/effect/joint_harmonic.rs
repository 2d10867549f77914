//! A wheel, gear or encoder disc runs out of true: an error periodic in the joint's angle.

use nalgebra::DMatrix;

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{
    Contribution, Effect, EffectId, EffectNameError, Parameter, Sample, Site, Size, Unit, amplitude,
};

/// The highest number of periods a turn that is looked for, besides the gear ratios.
pub(super) const HIGHEST: u32 = 64;

#[derive(Debug)]
struct JointHarmonic {
    joint: usize,
    order: f64,
    parameters: [Parameter; 2],
}

/// Sine and cosine of an angle, rad. Kept apart, so that the compiler asks for both at once: most of a grown arm's work is this.
#[inline(never)]
fn wave(angle: f64) -> (f64, f64) {
    angle.sin_cos()
}

impl Effect for JointHarmonic {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // Sine and cosine in place of amplitude and phase: both are linear, and no start is needed.
        let (sine, cosine) = wave(self.order * sample.coordinate(self.joint));
        contributions.push(sample.contribute_to_joint(self.joint, 0, sine));
        contributions.push(sample.contribute_to_joint(self.joint, 1, cosine));
    }

    fn changes_coordinate(&self) -> Option<usize> {
        Some(self.joint)
    }

    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        amplitude(values, covariance, Unit::DEG)
    }
}

pub(super) const KIND: Kind = Kind {
    name: "joint_harmonic",
    family: Family::Joint,
    sites: SiteKind::JointsAndOrder,
    geometry_group: false,
    depends_on_conditions: false,
    // 64 orders of a joint are a Fourier series.
    imitates_anything: true,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Waves,
    sentence: "A wheel of the joint runs out of true: the error comes back the same number of times in every turn.",
    how_to_see: "Many poses spread over the joint's travel, not on a regular grid.",
    sketch: ["   ╭╮  ╭╮  ╭╮", "  ╱  ╲╱  ╲╱  ╲ error", "  ── turns of a wheel ──"],
    build: |setting: &Setting<'_>| {
        let joint = setting.joint()?;
        let order =
            setting.id.order.filter(|order| *order > 0.0).ok_or_else(|| EffectNameError::Malformed {
                text: setting.id.name.clone(),
                example: "joint_harmonic(waist, 1): joint and periods a turn".to_owned(),
            })?;
        // 6 degrees: an eccentric wheel that large does not mesh.
        let range = (-0.1, 0.1);
        let parameters =
            [Parameter::new("sine_deg", Unit::DEG, range), Parameter::new("cosine_deg", Unit::DEG, range)];
        Ok(Box::new(JointHarmonic { joint, order, parameters }))
    },
    candidates: |context| {
        let joints = context.model.chain.joints.iter().enumerate().filter(|(index, _)| context.turns(*index));
        joints
            .flat_map(|(index, joint)| {
                let mut orders: Vec<f64> = (1..=HIGHEST).map(f64::from).collect();
                // A gear out of true shows at its ratio, and its teeth's neighbours at one more and one less.
                if let Some(ratio) = joint.gear_ratio {
                    let near = [0.5, 1.0, 2.0].map(|multiple| multiple * ratio.abs());
                    orders.extend(
                        near.into_iter().filter(|order| !orders.contains(order)).collect::<Vec<f64>>(),
                    );
                }
                orders.into_iter().map(move |order| EffectId {
                    order: Some(order),
                    ..EffectId::at("joint_harmonic", Site::Joint(index))
                })
            })
            .collect()
    },
};
