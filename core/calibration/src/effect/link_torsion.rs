//! A link twists about its own axis under the torque of what it carries, as a shaft clamped at its joint.

use nalgebra::Vector3;
use plumb_kinematics::{Chain, LinkFrames, Motion, Weights};

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Dof, Effect, LooksAt, Parameter, Sample, Unit};

/// Sine of the angle below which a link lies along an axis: as for parallel axes, what is left of it is an error of the arm.
const ALONG: f64 = 0.05;

#[derive(Debug)]
struct LinkTorsion {
    joint: usize,
    parameters: [Parameter; 1],
}

impl Effect for LinkTorsion {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        let (weights, link_frames) = (&sample.weights, sample.link_frames);
        let Some((start, end)) = weights.link(link_frames, self.joint) else { return };
        let Some(along) = (end - start).try_normalize(1e-6) else { return };
        let length = (end - start).norm() * 1e-3;
        // Saint-Venant's torsion of a shaft: angle = T L / (G J) (Timoshenko 1955, Strength of Materials I, chapter 10). What hangs beyond the link twists
        // all of it, its own weight the part up to where it hangs; rad per 1/(N m2).
        let mut turned = 0.0;
        for (after, weight, position) in weights.beyond(link_frames, self.joint) {
            let arm = (position - start) * 1e-3;
            let reach = if after == self.joint { arm.dot(&along).clamp(0.0, length) } else { length };
            turned += along.dot(&arm.cross(&(weights.down * weight))) * reach;
        }
        let dof =
            Dof::Twist { after: self.joint, shift: Vector3::zeros(), rotation: along * turned, about: end };
        contributions.push(Contribution { parameter: 0, dof, rate: 1.0 });
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Gravity
    }
}

/// Whether the link after one joint lies along the axis of another that turns: springs in series about one axis are one spring, so the link's twist is
/// then the other joint's compliance. The angle between the two is the same in all poses where that joint is its own or the next.
fn lies_along(chain: &Chain, link: usize, joint: usize) -> bool {
    let turns = |at: usize| chain.joints.get(at).is_some_and(|row| row.motion == Motion::Turns);
    if !turns(link) || !turns(joint) {
        return false;
    }
    let link_frames = LinkFrames::of(chain, &vec![0.0; chain.len()], &[]);
    let line =
        Weights::WITHOUT.link(&link_frames, link).and_then(|(start, end)| (end - start).try_normalize(1e-6));
    let axis = link_frames.joints.get(joint).map(|frame| frame.axis);
    line.zip(axis).is_some_and(|(line, axis)| line.cross(&axis).norm() < ALONG)
}

/// The joints after which a link lies along a joint's axis: its own link, and the one before it.
pub(super) fn links_along(chain: &Chain, joint: usize) -> Vec<usize> {
    let links = joint.checked_sub(1).into_iter().chain([joint]);
    links.filter(|link| lies_along(chain, *link, joint)).collect()
}

pub(super) const KIND: Kind = Kind {
    name: "link_torsion",
    family: Family::LinkAndTime,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Weights,
    sentence: "The link after the joint twists about its own axis under the torque of what it carries, like a shaft.",
    how_to_see: "The weight to one side of the link and to the other: the wrist turned out level both ways, the link level and upright, with and without a load. \
                 A link along the axis of its joint, or of the next, cannot be distinguished from joint_compliance there.",
    sketch: ["  ┃━━━━━━━━┓ ↻ seen", "           ╲  from its", "            ▼ end"],
    build: |setting: &Setting<'_>| {
        // The reciprocal of G J: 0.1 for a N m2 is an open channel of sheet aluminium (60 mm wide, 2 mm thick); a closed tube is hundreds of times as stiff.
        // A link that turns against its torque does not exist.
        let parameters = [Parameter::new("flexibility", Unit::FLEXIBILITY, (0.0, 0.1))];
        Ok(Box::new(LinkTorsion { joint: setting.joint()?, parameters }))
    },
    candidates: |context| {
        if !context.has_weight() {
            return Vec::new();
        }
        // What is the same as a joint's compliance goes by that name, and is reported with it (`Effect::twin`).
        let chain = &context.model.chain;
        let own = |link: usize| !lies_along(chain, link, link) && !lies_along(chain, link, link + 1);
        let mut ids = context.every_link("link_torsion");
        ids.retain(|id| id.joint().is_some_and(own));
        ids
    },
};
