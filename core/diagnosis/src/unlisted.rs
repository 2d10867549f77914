//! Mechanisms the library has no name for. They are never named or added; they show when a named effect would be an
//! impostor, and where the real one sits.

use std::sync::Arc;

use nalgebra::Vector3;

use super::score_test::Probe;
use crate::laboratory::Laboratory;
use plumb_calibration::effect::{
    Contribution, Dof, Effect, EffectId, LooksAt, Parameter, Sample, Search, Site, Unit,
};

/// What a mechanism without a name does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    /// Play that depends on the joint's angle.
    PlayByAngle,
    /// Play, or friction, that depends on the load.
    PlayByLoad,
    /// Pulls beyond some angle either way: of this joint alone, or of its sum with another.
    Hinge { other: Option<usize>, at: f64 },
    /// The base leans with what would tip it over.
    RockingBase { limit: Option<f64> },
}

#[derive(Debug)]
struct Unlisted {
    joint: usize,
    shape: Shape,
    parameters: Vec<Parameter>,
}

impl Unlisted {
    fn new(joint: usize, shape: Shape) -> Self {
        let count = match shape {
            Shape::PlayByAngle | Shape::RockingBase { .. } => 4,
            Shape::PlayByLoad | Shape::Hinge { .. } => 2,
        };
        let parameters =
            (1..=count).map(|number| Parameter::new(&number.to_string(), Unit::RATIO, (-1.0, 1.0))).collect();
        Self { joint, shape, parameters }
    }
}

impl Effect for Unlisted {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        let q = sample.coordinate(self.joint);
        let side = sample.side(self.joint);
        match self.shape {
            Shape::PlayByAngle => {
                let waves = [q.cos(), q.sin(), (2.0 * q).cos(), (2.0 * q).sin()];
                let terms = waves.into_iter().enumerate();
                contributions.extend(
                    terms.map(|(parameter, wave)| {
                        sample.contribute_to_joint(self.joint, parameter, side * wave)
                    }),
                );
            }
            Shape::PlayByLoad => {
                let moment = sample.moment(self.joint);
                contributions.push(sample.contribute_to_joint(self.joint, 0, side * moment));
                contributions.push(sample.contribute_to_joint(self.joint, 1, side * moment.abs()));
            }
            Shape::Hinge { other, at } => {
                let sum = q + other.map_or(0.0, |other| sample.coordinate(other));
                contributions.push(sample.contribute_to_joint(self.joint, 0, (sum - at).max(0.0)));
                contributions.push(sample.contribute_to_joint(self.joint, 1, (sum + at).min(0.0)));
            }
            Shape::RockingBase { limit } => {
                let tipping = sample.weights.overturning(sample.link_frames);
                for (parameter, (moment, axis)) in
                    [(tipping.x, 0), (tipping.x, 1), (tipping.y, 0), (tipping.y, 1)].into_iter().enumerate()
                {
                    // A foot that rocks gives way to a stop: beyond the limit it leans no further.
                    let eased = limit.map_or(moment, |limit| (moment / limit).tanh());
                    let rotation = Vector3::ith(axis, eased);
                    let dof =
                        Dof::Twist { after: 0, shift: Vector3::zeros(), rotation, about: Vector3::zeros() };
                    contributions.push(Contribution { parameter, dof, rate: 1.0 });
                }
            }
        }
    }

    fn changes_coordinate(&self) -> Option<usize> {
        (!matches!(self.shape, Shape::RockingBase { .. })).then_some(self.joint)
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Gravity
    }
}

/// Angles at which hinges are tried, as shares of the farthest the sum reaches.
const HINGES: [f64; 4] = [0.0, 0.25, 0.4, 0.55];

/// Moments at which a foot that rocks comes to its stop, as shares of the greatest moment that any joint bears.
const STOPS: [f64; 3] = [0.03, 0.1, 0.3];

fn probe((joint, site, shape): (usize, Site, Shape), family: usize) -> Probe {
    Probe {
        id: EffectId::at("unlisted", site),
        effect: Arc::new(Unlisted::new(joint, shape)),
        search: Search::Jumps,
        family,
        weight: 1.0,
        search_cost: 0.0,
    }
}

/// Probes for everything that has no name, at every place.
pub(super) fn probes(lab: &Laboratory) -> Vec<Probe> {
    let numbered = families(lab).into_iter().zip(1..);
    let probes =
        numbered.flat_map(|(variants, family)| variants.into_iter().map(move |one| probe(one, family)));
    probes.collect()
}

/// Everything that has no name, by joint, place and shape; those that differ in a searched number together.
fn families(lab: &Laboratory) -> Vec<Vec<(usize, Site, Shape)>> {
    let (model, summary) = (lab.model(), lab.summary());
    let mut families: Vec<Vec<(usize, Site, Shape)>> = Vec::new();
    for joint in (0..model.chain.len()).filter(|joint| lab.context().turns(*joint)) {
        let site = Site::Joint(joint);
        if summary.has_both_sides(joint) {
            families.push(vec![(joint, site, Shape::PlayByAngle)]);
            if lab.context().has_weight() {
                families.push(vec![(joint, site, Shape::PlayByLoad)]);
            }
        }
        let others = [joint.checked_sub(1), Some(joint + 1).filter(|other| *other < model.chain.len())];
        for other in [None].into_iter().chain(others.into_iter().flatten().map(Some)) {
            let [(low, high), (other_low, other_high)] = [Some(joint), other].map(|joint| {
                joint.and_then(|joint| summary.ranges.get(joint)).copied().unwrap_or((0.0, 0.0))
            });
            // Where the sum cannot reach a hinge nothing would be seen of it.
            let farthest = (low + other_low).abs().max((high + other_high).abs());
            let hinges =
                HINGES.map(|fraction| (joint, site, Shape::Hinge { other, at: fraction * farthest }));
            families.push(hinges.to_vec());
        }
    }
    if lab.context().has_weight() {
        let greatest = summary.greatest_moments.iter().copied().fold(0.0, f64::max);
        families.push(vec![(0, Site::Base, Shape::RockingBase { limit: None })]);
        let limits =
            STOPS.map(|fraction| (0, Site::Base, Shape::RockingBase { limit: Some(fraction * greatest) }));
        families.push(limits.into_iter().filter(|_| greatest > 0.0).collect());
    }
    families
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links;

    #[test]
    fn hinges_are_tried_within_what_each_joint_and_each_sum_of_neighbours_reaches() {
        let lab = two_links(40, "", 0.05, 83, |_| [0.0; 2]);
        let ends = |joint: usize| {
            let q = (0..40).map(|row| lab.table().q_of(row)[joint]);
            q.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)))
        };
        let (shoulder, elbow) = (ends(0), ends(1));
        let reach = |(low, high): (f64, f64)| low.abs().max(high.abs());
        let both = reach((shoulder.0 + elbow.0, shoulder.1 + elbow.1));
        // Without sides of approach and without masses there is neither play nor a foot that rocks.
        let found = families(&lab);
        let expected =
            [(0, None, reach(shoulder)), (0, Some(1), both), (1, None, reach(elbow)), (1, Some(0), both)];
        assert_eq!(found.len(), expected.len());
        for (family, (joint, other, farthest)) in found.iter().zip(expected) {
            for ((at_joint, site, shape), fraction) in family.iter().zip(HINGES) {
                assert_eq!((*at_joint, *site), (joint, Site::Joint(joint)));
                let Shape::Hinge { other: beside, at } = shape else { panic!("{shape:?}") };
                assert!(*beside == other && (at - fraction * farthest).abs() < 1e-12, "{shape:?}");
            }
        }
        let probes = probes(&lab);
        assert_eq!((probes.len(), probes[0].family, probes[15].family), (16, 1, 4));
    }

    /// How fast a mechanism turns the second joint a unit of each of its numbers, where the joints are at 0.3 and 0.5 rad, or as far the other way.
    fn rates(shape: Shape, sense: f64) -> Vec<f64> {
        let lab = two_links(4, "", 0.05, 1, |_| [0.0; 2]);
        let chain = &lab.model().chain;
        let q = [0.3 * sense, 0.5 * sense];
        let link_frames = plumb_kinematics::LinkFrames::of(chain, &q, &[]);
        let sample = Sample {
            chain,
            q: &q,
            previous: None,
            approach: &[1, -1],
            speed: &[],
            time: f64::NAN,
            clock: f64::NAN,
            epoch: 0,
            temperature: f64::NAN,
            moments: &[5.0, -2.0],
            weights: plumb_kinematics::Weights { masses: &[], payload: 0.0, down: -Vector3::z() },
            link_frames: &link_frames,
            point: Vector3::zeros(),
            hand: nalgebra::Matrix3::identity(),
            trigger: None,
        };
        let mut contributions = Vec::new();
        Unlisted::new(1, shape).contribute(&sample, &mut contributions);
        assert!(
            contributions.iter().enumerate().all(|(index, contribution)| contribution.parameter == index)
        );
        contributions.iter().map(|contribution| contribution.rate).collect()
    }

    #[test]
    fn play_without_a_name_goes_by_the_side_and_with_angle_or_load_and_a_hinge_pulls_beyond_its_angle() {
        let close = |found: &[f64], expected: &[f64]| {
            let same = found.len() == expected.len();
            assert!(
                same && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
                "{found:?} {expected:?}"
            );
        };
        // It came from above: the side is -1.
        close(
            &rates(Shape::PlayByAngle, 1.0),
            &[-0.5_f64.cos(), -0.5_f64.sin(), -1.0_f64.cos(), -1.0_f64.sin()],
        );
        close(&rates(Shape::PlayByLoad, 1.0), &[2.0, -2.0]);
        let hinge = |other: Option<usize>, at: f64, sense: f64| rates(Shape::Hinge { other, at }, sense);
        close(&hinge(None, 0.2, 1.0), &[0.3, 0.0]);
        close(&hinge(None, 0.2, -1.0), &[0.0, -0.3]);
        close(&hinge(None, 0.6, 1.0), &[0.0, 0.0]);
        close(&hinge(Some(0), 0.6, 1.0), &[0.2, 0.0]);
        close(&hinge(Some(0), 0.6, -1.0), &[0.0, -0.2]);
    }

    #[test]
    fn a_foot_that_rocks_changes_no_joint() {
        let of = |shape: Shape| Unlisted::new(2, shape).changes_coordinate();
        assert_eq!(of(Shape::RockingBase { limit: None }), None);
        assert_eq!(of(Shape::RockingBase { limit: Some(3.0) }), None);
        assert_eq!(of(Shape::Hinge { other: None, at: 0.3 }), Some(2));
    }
}
