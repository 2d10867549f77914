//! What may be the matter beyond zeros and rig.

use super::{Options, RigParameter};
use crate::effect::{self, EffectId, EffectNameError};
use crate::file::Model;

/// Something that may be the matter.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspect {
    /// As it is named and added.
    pub name: String,
    /// What would be adjusted for it.
    pub options: Options,
    /// Those of one family are told apart by their fit alone: wheels out of true of one joint, of several orders.
    pub family: String,
}

/// Effects of joints that stripes can show, by name.
const OF_JOINTS: [&str; 7] = [
    "joint_compliance",
    "joint_backlash",
    "joint_gain",
    "link_length",
    "link_offset",
    "link_twist",
    "axis_skew",
];

/// Wheels out of true: so many periods a turn of the joint.
const ORDERS: [u32; 4] = [1, 2, 3, 4];

/// Reads a name as people write it: an effect of the library (`joint_backlash(elbow)`) or of the rig (`lens_distortion`).
///
/// # Errors
/// [`EffectNameError`]
pub fn suspect(name: &str, model: &Model) -> Result<Suspect, EffectNameError> {
    if let Some((name, rig)) = of_rig().into_iter().find(|(known, _)| *known == name) {
        let options = Options { rig, effects: Vec::new() };
        return Ok(Suspect { name: name.to_owned(), options, family: name.to_owned() });
    }
    Ok(of_arm(effect::parse(name, model)?, model))
}

fn of_arm(id: EffectId, model: &Model) -> Suspect {
    let name = id.label(model);
    let family = match id.order {
        Some(_) => format!("{} {}", id.name, id.place(model)),
        None => name.clone(),
    };
    Suspect { name, options: Options { rig: Vec::new(), effects: vec![id] }, family }
}

fn of_rig() -> Vec<(&'static str, Vec<RigParameter>)> {
    vec![
        ("lens_distortion", vec![RigParameter::LensDistortion(0)]),
        ("stripe_bow", vec![RigParameter::StripeBow]),
        ("clock_skew", vec![RigParameter::ClockSkew]),
        ("camera_scale", vec![RigParameter::CameraScale(0), RigParameter::CameraScale(1)]),
        ("principal_point", vec![RigParameter::PrincipalPoint(0), RigParameter::PrincipalPoint(1)]),
    ]
}

/// Everything that is suspected of an arm and its rig. The last joint's zero, and what only shifts all surfaces alike, are not among it.
pub fn suspects(model: &Model) -> Vec<Suspect> {
    let mut all = Vec::new();
    for (name, rig) in of_rig() {
        let options = Options { rig, effects: Vec::new() };
        all.push(Suspect { name: name.to_owned(), options, family: name.to_owned() });
    }
    let orders = ORDERS.iter().map(|order| format!("joint_harmonic(*, {order})"));
    let names = OF_JOINTS.iter().map(|name| format!("{name}(*)")).chain(orders);
    for name in names {
        let ids = effect::expand(&name, model).unwrap_or_default();
        all.extend(ids.into_iter().map(|id| of_arm(id, model)));
    }
    all
}

/// What a calibration as everybody does it adjusts: the zeros of all joints but the first and the last, and where camera and light are.
pub fn classical(model: &Model) -> Options {
    let joints = model.chain.joints.iter().map(|joint| joint.name.as_str());
    let between = joints.skip(1).take(model.chain.len().saturating_sub(2));
    let zero = |joint: &str| effect::parse(&format!("joint_zero({joint})"), model).ok();
    Options { rig: RigParameter::USUAL.to_vec(), effects: between.filter_map(zero).collect() }
}
