//! A picture was exposed later than its time says: where the arm was meanwhile is taken for where it was then.

use super::kind::{Kind, Setting};
use super::rig_numbers::{kind, needs_rig};
use super::{Contribution, Effect, EffectId, Parameter, Sample, Site, Unit};

#[derive(Debug)]
struct ClockSkew {
    parameters: [Parameter; 1],
}

impl Effect for ClockSkew {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // Late by one time for all joints: each was read where it was that much earlier.
        let speeds = sample.speed.iter().enumerate();
        contributions.extend(speeds.map(|(joint, speed)| sample.contribute_to_joint(joint, 0, *speed)));
    }
}

pub(super) const KIND: Kind = kind(
    "clock_skew",
    "The pictures are exposed later (or earlier) than their times say, so that an arm in motion was elsewhere.",
    "Scans in motion, fast and slow, and to and fro.",
    ["  ◯──→◯ moved on", "  •     the picture", "        came late"],
    |setting: &Setting<'_>| {
        needs_rig(setting)?;
        // A fifth of a second: a picture that is later belongs to the next one.
        Ok(Box::new(ClockSkew { parameters: [Parameter::new("late_ms", Unit::MS, (-0.2, 0.2))] }))
    },
    |context| match context.summary.stripes && context.summary.moves {
        // At rest every time shows the same pose.
        true => vec![EffectId::at("clock_skew", Site::Sensor)],
        false => Vec::new(),
    },
);
