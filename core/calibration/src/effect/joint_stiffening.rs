//! A joint that gives easily at first and stiffens under load: the soft wind-up of harmonic drives, belts and cables.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Effect, EffectId, EffectNameError, LooksAt, Parameter, Sample, Unit};

/// Knees that are tried, as shares of the greatest moment in the table. A higher knee would be no other than a plain
/// compliance.
const KNEES: [f64; 4] = [0.03, 0.07, 0.15, 0.3];

#[derive(Debug)]
struct JointStiffening {
    joint: usize,
    knee: f64,
    parameters: [Parameter; 1],
}

/// How far a cubic spring winds (`share = wound + wound^3`, the usual law of harmonic drives: Spong 1987), by Newton's
/// method from outside, where it never overshoots.
fn wound(fraction: f64) -> f64 {
    let mut turn = fraction.abs().cbrt().min(fraction.abs());
    // Newton's method doubles its digits with each round: eight bring any start to rounding.
    for _ in 0..8 {
        turn -= (turn + turn.powi(3) - fraction.abs()) / (1.0 + 3.0 * turn * turn);
    }
    turn.copysign(fraction)
}

impl Effect for JointStiffening {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // The knee is the moment from which the cubic part is as large as the linear one.
        let fraction = sample.moment(self.joint) / self.knee;
        contributions.push(sample.rotate_joint(self.joint, 0, self.knee * wound(fraction)));
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Gravity
    }
}

pub(super) const KIND: Kind = Kind {
    name: "joint_stiffening",
    family: Family::Joint,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Smooth,
    driven_by: DrivenBy::Moment,
    sentence: "The joint gives easily under a small moment and less and less under a larger one.",
    how_to_see: "Many different moments about the joint, small ones above all; a load that is changed.",
    sketch: ["  turn  ╭──── stiffens", "      ╭─╯", "   ───╯   moment"],
    build: |setting: &Setting<'_>| {
        let knee = setting.id.inner.filter(|knee| *knee > 0.0).ok_or_else(|| EffectNameError::Unusable {
            effect: setting.model.label(setting.id),
            reason: "needs the moment at which it stiffens, in N m: write `searched:` or let `add` find it"
                .to_owned(),
        })?;
        let parameters = [Parameter::new("compliance_at_rest", Unit::COMPLIANCE, (0.0, 0.5))];
        Ok(Box::new(JointStiffening { joint: setting.joint()?, knee, parameters }))
    },
    candidates: |context| {
        if !context.has_weight() {
            return Vec::new();
        }
        let at = context.every_turning_joint("joint_stiffening").into_iter();
        at.flat_map(|id| {
            // Knees go by the moments that the table has: a knee far above all of them is a plain compliance.
            let greatest = id
                .joint()
                .and_then(|joint| context.summary.greatest_moments.get(joint))
                .copied()
                .unwrap_or(0.0);
            let knees = KNEES.into_iter().filter(move |_| greatest > 1e-6);
            knees.map(move |fraction| EffectId { inner: Some(fraction * greatest), ..id.clone() })
        })
        .collect()
    },
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cubic_spring_balances_its_moment() {
        for fraction in [-300.0, -1.0, 0.0, 1e-6, 0.4, 7.0, 1e4] {
            let turn = wound(fraction);
            assert!(
                (turn + turn.powi(3) - fraction).abs() < 1e-9 * (1.0 + fraction.abs()),
                "{fraction}: {turn}"
            );
        }
    }
}
