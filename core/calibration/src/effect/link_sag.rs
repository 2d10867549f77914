//! A link bends under its load, as a beam clamped at its joint.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Dof, Effect, LooksAt, Parameter, Sample, Unit};

#[derive(Debug)]
struct LinkSag {
    joint: usize,
    parameters: [Parameter; 1],
}

impl Effect for LinkSag {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        if let Some(sag) = sample.weights.sag(sample.link_frames, self.joint) {
            // Euler and Bernoulli's beam, clamped at its joint: shift and slope of its end go to everything beyond (Timoshenko 1955, Strength of Materials I).
            let dof =
                Dof::Twist { after: self.joint, shift: sag.shift, rotation: sag.rotation, about: sag.end };
            contributions.push(Contribution { parameter: 0, dof, rate: 1.0 });
        }
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Gravity
    }
}

pub(super) const KIND: Kind = Kind {
    name: "link_sag",
    family: Family::LinkAndTime,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Weights,
    sentence: "The link after the joint bends under its load like a beam.",
    how_to_see: "The arm stretched out in several directions, with and without a load.",
    sketch: ["  ┃━━━╸╌╌╌╌╌ straight", "      ╲━━╸", "         ╲━━▼ weight"],
    build: |setting: &Setting<'_>| {
        // The reciprocal of E I: 0.1 for a N m2 is a ruler; a bar that bends upwards under its load does not exist.
        let parameters = [Parameter::new("flexibility", Unit::FLEXIBILITY, (0.0, 0.1))];
        Ok(Box::new(LinkSag { joint: setting.joint()?, parameters }))
    },
    candidates: |context| match context.has_weight() {
        true => context.every_link("link_sag"),
        false => Vec::new(),
    },
};
