//! The arm a model file describes, its effects and all: where its flange is.

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};
use plumb_kinematics::{Deviation, DhParameter, LinkFrames, Motion, Weights};

use crate::arm_model::{MapEffect, Model};
use crate::effect::{self, Contribution, Dof, Effect, EffectNameError, LooksAt, Sample};

/// A model with everything that has been added to it, ready to be asked.
#[derive(Debug)]
pub struct ForwardModel {
    model: Model,
    effects: Vec<(Box<dyn Effect>, Vec<f64>)>,
}

impl ForwardModel {
    /// Builds the effects in `effects:` and `fitted:` of a model file. What acts elsewhere than in a joint's row (base, targets, instrument) leaves the
    /// flange where it is in the base's frame.
    ///
    /// # Errors
    /// [`EffectNameError`] for an effect that cannot be where the file has it.
    pub fn new(model: Model) -> Result<Self, EffectNameError> {
        let added = model.effects.iter().chain(&model.fitted);
        let effects = added
            .map(|added| Ok((effect::build(&added.id, &model)?, added.values.clone())))
            .collect::<Result<_, EffectNameError>>()?;
        Ok(Self { model, effects })
    }

    /// Where the flange is in the base's frame, mm. `q` are the joints as commanded, rad or mm; `approach` is the way in which each arrived (`Table::approach`), empty
    /// where not known.
    pub fn flange(&self, q: &[f64], approach: &[i8]) -> IsometryMatrix3<f64> {
        let effects = self.effects.iter().map(|(effect, values)| (effect.as_ref(), values.as_slice()));
        flange(&self.model, effects, q, approach)
    }
}

/// Rounds in which what bends under its own weight comes to balance.
const ROUNDS: usize = 3;

/// What effects do to an arm in one pose.
struct Done {
    deviations: Vec<Deviation>,
    /// Shift of the base's origin and turn about it that bent links give everything beyond them, base frame.
    shift: Vector3<f64>,
    rotation: Vector3<f64>,
}

/// Where the flange is under these effects at these values.
pub fn flange<'a>(
    model: &Model,
    effects: impl Iterator<Item = (&'a dyn Effect, &'a [f64])>,
    q: &[f64],
    approach: &[i8],
) -> IsometryMatrix3<f64> {
    let effects: Vec<(&dyn Effect, &[f64])> = effects.collect();
    let mapped = match (&model.residual_map, &model.measured_region) {
        (Some(map), Some(region)) => map.at(region, q, approach),
        _ => None,
    };
    let mut link_frames = LinkFrames::of(&model.chain, q, &[]);
    // The nominal arm: asked many times a second while a cell plans.
    if effects.is_empty() && mapped.is_none() {
        return link_frames.flange;
    }
    // Only what bends under its own weight has to come to balance.
    let yields = effects.iter().any(|(effect, _)| effect.looks_at() == LooksAt::Gravity);
    let mut done = done(model, &effects, (q, approach), &link_frames, mapped.as_ref());
    for _ in 1..if yields { ROUNDS } else { 1 } {
        link_frames = LinkFrames::of(&model.chain, q, &done.deviations);
        done = self::done(model, &effects, (q, approach), &link_frames, mapped.as_ref());
    }
    let stiff = LinkFrames::of(&model.chain, q, &done.deviations).flange;
    let at = stiff.translation.vector;
    // Bent links turn what lies beyond about the base's origin, and shift it.
    let turned = Rotation3::new(done.rotation) * stiff.rotation;
    IsometryMatrix3::from_parts(Translation3::from(at + done.shift + done.rotation.cross(&at)), turned)
}

/// What the effects do when the arm is so.
fn done(
    model: &Model,
    effects: &[(&dyn Effect, &[f64])],
    (q, approach): (&[f64], &[i8]),
    link_frames: &LinkFrames,
    mapped: Option<&MapEffect>,
) -> Done {
    let mut done = Done {
        deviations: vec![Deviation::default(); model.chain.len()],
        shift: mapped.map_or_else(Vector3::zeros, |mapped| mapped.shift),
        rotation: Vector3::zeros(),
    };
    let amounts = mapped.map_or(&[][..], |mapped| &mapped.joints);
    for (deviation, (joint, amount)) in done.deviations.iter_mut().zip(model.chain.joints.iter().zip(amounts))
    {
        let dh_parameter = if joint.motion == Motion::Slides { DhParameter::D } else { DhParameter::Theta };
        deviation.add(dh_parameter, joint.sign * amount);
    }
    in_pose(model, q, approach, link_frames, |sample| {
        let mut contributions = Vec::new();
        for (effect, values) in effects {
            for contribution in sample.contributions_of(*effect, &mut contributions) {
                let amount = contribution.rate * values.get(contribution.parameter).copied().unwrap_or(0.0);
                match contribution.dof {
                    Dof::Joint(joint, dh_parameter) => {
                        if let Some(deviation) = done.deviations.get_mut(joint) {
                            deviation.add(dh_parameter, amount);
                        }
                    }
                    Dof::Twist { shift, rotation, about, .. } => {
                        done.shift += (shift - rotation.cross(&about)) * amount;
                        done.rotation += rotation * amount;
                    }
                    // Base, targets and instrument do not move the flange in the base's frame.
                    _ => {}
                }
            }
        }
    });
    done
}

/// What an effect moves that does the same in every pose: looked at where all joints are at zero.
pub(crate) fn constant_contributions(model: &Model, effect: &dyn Effect) -> Vec<Contribution> {
    let q = vec![0.0; model.chain.len()];
    let link_frames = LinkFrames::of(&model.chain, &q, &[]);
    let mut contributions = Vec::new();
    in_pose(model, &q, &[], &link_frames, |sample| effect.contribute(sample, &mut contributions));
    contributions
}

/// How fast each of an effect's parameters changes a joint's coordinate in a pose; for an effect that does nothing else.
pub fn rates(model: &Model, effect: &dyn Effect, q: &[f64], approach: &[i8]) -> Vec<f64> {
    let mut rates = vec![0.0; effect.parameters().len()];
    let link_frames = LinkFrames::of(&model.chain, q, &[]);
    in_pose(model, q, approach, &link_frames, |sample| {
        let mut contributions = Vec::new();
        effect.contribute(sample, &mut contributions);
        for contribution in &contributions {
            if let Some(rate) = rates.get_mut(contribution.parameter) {
                *rate += contribution.rate;
            }
        }
    });
    rates
}

/// Hands over what an effect may know of a pose of which nothing but joints and sides of approach is known.
fn in_pose(
    model: &Model,
    q: &[f64],
    approach: &[i8],
    link_frames: &LinkFrames,
    mut ask: impl FnMut(&Sample<'_>),
) {
    let weights =
        Weights { masses: &model.masses, payload: 0.0, down: model.down(&model.base.pose.rotation) };
    let mut moments = Vec::new();
    weights.moments(link_frames, &mut moments);
    ask(&Sample {
        chain: &model.chain,
        q,
        // A cell asks of single poses: of time, warmth and the move before nothing is known.
        previous: None,
        approach,
        speed: &[],
        time: f64::NAN,
        clock: f64::NAN,
        epoch: 0,
        temperature: f64::NAN,
        moments: &moments,
        weights,
        link_frames,
        point: link_frames.flange.translation.vector,
        hand: link_frames.flange.rotation.into_inner(),
        trigger: None,
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    const PUMA: &str = include_str!("../../../workcells/arms/puma560.yaml");

    fn arm(effects: &str) -> ForwardModel {
        let text = PUMA.replace("effects: []", effects);
        ForwardModel::new(Model::parse("puma560.yaml", &text).unwrap()).unwrap()
    }

    #[test]
    fn a_shoulder_that_gives_way_lets_the_flange_down_and_play_distinguishes_the_sides() {
        let q = [0.3, -0.2, 1.4, 0.0, 0.3, 0.0];
        let stiff = arm("effects: []").flange(&q, &[]);
        let soft =
            arm("effects: [{effect: joint_compliance, where: shoulder, values: {compliance: 1.0e-4}}]");
        let sunk = soft.flange(&q, &[]).translation.z - stiff.translation.z;
        assert!((-5.0..-0.5).contains(&sunk), "{sunk} mm");
        let worn = arm("effects: [{effect: joint_backlash, where: shoulder, values: {play_deg: 0.2}}]");
        let side = |side: i8| worn.flange(&q, &[0, side, 0, 0, 0, 0]).translation.z;
        assert!((side(1) - side(-1)).abs() > 1.0 && (side(0) - stiff.translation.z).abs() < 1e-9);
    }
}
