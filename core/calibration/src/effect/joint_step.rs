//! A joint jumps at some moment and stays off: lost steps, a slipped coupling, a knock.

use super::kind::{CandidateContext, DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Effect, EffectId, EffectNameError, Parameter, Sample};
use crate::arm_model::Epochs;

/// Moments that are tried at most.
pub const MOMENTS: usize = 60;
/// Rows there must be on either side of the jump.
const EITHER_SIDE: usize = 4;

#[derive(Debug)]
struct JointStep {
    joint: usize,
    at: f64,
    parameters: [Parameter; 1],
}

impl Effect for JointStep {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // From the moment on, that moment included: it is the time of the first row that is off.
        let after = if sample.clock >= self.at { 1.0 } else { 0.0 };
        contributions.push(sample.contribute_to_joint(self.joint, 0, after));
    }

    fn changes_coordinate(&self) -> Option<usize> {
        Some(self.joint)
    }
}

/// Whether a clock counts rows, as far as this one.
fn is_a_row(clocks: &[f64], row: f64) -> bool {
    clocks.get(row as usize).is_some_and(|clock| *clock == row)
}

/// The moments at which the model's epochs begin, where they are times, or rows of a table without times: the clock counts its rows from 0.
fn dated(context: &CandidateContext<'_>) -> Vec<f64> {
    let clocks = &context.summary.clocks;
    match &context.model.epochs {
        Some(Epochs::Times(starts)) => starts.clone(),
        Some(Epochs::Rows(starts)) => {
            starts.iter().map(|start| *start as f64 - 1.0).filter(|row| is_a_row(clocks, *row)).collect()
        }
        Some(Epochs::Sessions(_)) | None => Vec::new(),
    }
}

pub(super) const KIND: Kind = Kind {
    name: "joint_step",
    family: Family::Joint,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: true,
    is_event: true,
    // Moments are unlike each other: each that is tried is a trial of its own.
    search: Search::Jumps,
    driven_by: DrivenBy::Time,
    sentence: "The joint jumps at one moment and stays off: lost steps, or a coupling that slipped.",
    how_to_see: "The same few poses again and again through the day, with the time logged.",
    sketch: ["         ┌──── after", "  ───────┘", "  before   it slipped"],
    build: |setting: &Setting<'_>| {
        let joint = setting.joint()?;
        let at = setting.id.inner.ok_or_else(|| EffectNameError::Unusable {
            effect: setting.model.label(setting.id),
            reason: "needs the moment of the jump: write `searched:` or let `add` find it".to_owned(),
        })?;
        // 30 degrees, or 50 mm: an arm that is knocked further is stopped by its drive.
        let parameter = setting.displacement(("step_deg", 0.5), ("step_mm", 50.0))?;
        Ok(Box::new(JointStep { joint, at, parameters: [parameter] }))
    },
    candidates: |context| {
        let clocks = &context.summary.clocks;
        // With fewer rows on one side a jump is a few outliers.
        let last = clocks.len().saturating_sub(EITHER_SIDE);
        let usable: Vec<f64> = clocks.get(EITHER_SIDE..last.max(EITHER_SIDE)).unwrap_or(&[]).to_vec();
        let stride = usable.len().div_ceil(MOMENTS).max(1);
        let mut moments: Vec<f64> = usable.iter().step_by(stride).copied().collect();
        // Where jumps are dated: between moments of the coarse grid a jump may look like another joint's.
        let (first, last) = (usable.first().copied(), usable.last().copied());
        let is_new = |at: &f64| Some(*at) >= first && Some(*at) <= last && !moments.contains(at);
        let dated: Vec<f64> = dated(context).into_iter().filter(is_new).collect();
        moments.extend(dated);
        context
            .every_joint("joint_step")
            .into_iter()
            .flat_map(|id| {
                moments.iter().map(move |at| EffectId { inner: Some(*at), ..id.clone() }).collect::<Vec<_>>()
            })
            .collect()
    },
};
