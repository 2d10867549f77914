//! The arm's model as stripes see it: base where it is, the rig on the flange, the surfaces free, and what everybody calibrates free as well.

use nalgebra::IsometryMatrix3;
use plumb_calibration::arm_model::{Base, MeasuredFrom, Model, Noise, StripeRig, Target};
use plumb_calibration::effect::{self, EffectId, EffectNameError};

use super::surface::Surface;

/// Numbers of the rig that every calibration finds: where camera and light are, each once. With the last joint's zero beside them, their common turn about the
/// flange's axis could not be determined.
const FREE_OF_RIG: [&str; 4] = ["camera_aim", "camera_roll", "stripe_plane", "hand_eye"];

/// The model with the rig and the surfaces, in the base's own frame. What the model file says of targets, instruments and noise is of other measurements.
pub(super) fn prepared(model: &Model, rig: &StripeRig, surfaces: &[(String, Surface)]) -> Model {
    let mut model = model.clone();
    model.gravity = Some(model.down(&model.base.pose.rotation));
    model.base = Base { pose: IsometryMatrix3::identity(), free: false, per_session: false };
    model.measured_from = MeasuredFrom::World;
    // The point the rig looks at: what the arm carries there is its tip.
    model.targets = vec![Target::point("p1", rig.working_point(), false)];
    model.surfaces = surfaces.iter().flat_map(|(name, surface)| surface.parts(name)).collect();
    model.free = free(&model);
    model.effects.clear();
    model.corrections.clear();
    model.fitted.clear();
    model.residual_map = None;
    model.measured_region = None;
    model.levels.clear();
    model.sensor = None;
    model.touch = None;
    model.noise = Noise::default();
    model.stripe_rig = Some(rig.clone());
    model
}

/// What a calibration as everybody does it adjusts: the zeros of all joints but the first and the last, and where camera and light are.
fn free(model: &Model) -> Vec<String> {
    let joints = model.chain.joints.iter().map(|joint| joint.name.as_str());
    let between = joints.skip(1).take(model.chain.len().saturating_sub(2));
    let zeros = between.map(|joint| format!("joint_zero({joint})"));
    zeros.chain(FREE_OF_RIG.map(str::to_owned)).collect()
}

/// The effects that are always fitted.
pub(super) fn free_effects(model: &Model) -> Result<Vec<EffectId>, EffectNameError> {
    let all: Result<Vec<_>, _> = model.free.iter().map(|pattern| effect::expand(pattern, model)).collect();
    Ok(all?.into_iter().flatten().collect())
}
