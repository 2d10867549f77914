//! What may be the matter beyond zeros and rig.

use plumb_kinematics::{Posture, Weights};

use super::{Options, RigParameter, View};
use plumb_calibration::arm_model::Model;
use plumb_calibration::effect::{self, EffectId, EffectNameError, Passport, Search, Survey};

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

/// Effects of the arm that stripes can show, by name: all of the library but those that need what the scans do not log (time, temperature, the pose before),
/// and those that only move every surface alike.
const OF_ARM: [&str; 11] = [
    "joint_compliance",
    "joint_stiffening",
    "joint_backlash",
    "joint_gain",
    "joint_coupling",
    "joint_harmonic",
    "link_length",
    "link_offset",
    "link_twist",
    "axis_skew",
    "link_sag",
];

/// Reads a name as people write it: an effect of the library (`joint_backlash(elbow)`) or of the rig (`lens_distortion`).
///
/// # Errors
/// [`EffectNameError`]
pub fn suspect(name: &str, model: &Model) -> Result<Suspect, EffectNameError> {
    if let Some((name, rig)) = of_rig().into_iter().find(|(known, _)| *known == name) {
        let options = Options { rig, effects: Vec::new() };
        return Ok(Suspect { name: name.to_owned(), options, family: name.to_owned() });
    }
    Ok(suspect_of(effect::parse(name, model)?, model))
}

/// An effect of the arm as a suspect.
pub fn suspect_of(id: EffectId, model: &Model) -> Suspect {
    let name = model.label(&id);
    let family = match id.order {
        Some(_) => format!("{} {}", id.name, model.site_name(id.spot)),
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

/// Everything that is suspected of an arm and its rig, seen in these views. The last joint's zero, and what only shifts all surfaces alike, are not among it.
pub fn suspects(model: &Model, views: &[View]) -> Vec<Suspect> {
    let mut all = Vec::new();
    for (name, rig) in of_rig() {
        let options = Options { rig, effects: Vec::new() };
        all.push(Suspect { name: name.to_owned(), options, family: name.to_owned() });
    }
    all.extend(OF_ARM.iter().flat_map(|name| everywhere(name, model, views)).map(|id| suspect_of(id, model)));
    all
}

/// The variants of an effect that differ in what is searched for inside it: the moment at which a joint stiffens. Those of any other effect are itself.
pub(super) fn variants(id: &EffectId, model: &Model, views: &[View]) -> Vec<EffectId> {
    let searched = effect::kind(&id.name).is_some_and(|kind| kind.search != Search::Nothing);
    if !searched || id.inner.is_some() {
        return vec![id.clone()];
    }
    let mut all = everywhere(&id.name, model, views);
    all.retain(|other| other.same_as(id));
    all
}

/// An effect of the library wherever these views could show it.
fn everywhere(name: &str, model: &Model, views: &[View]) -> Vec<EffectId> {
    let passport = Passport {
        both_sides: (0..model.chain.len()).map(|joint| both_sides(views, joint)).collect(),
        greatest_moments: greatest_moments(model, views),
        ..Passport::default()
    };
    effect::kind(name).map_or_else(Vec::new, |kind| (kind.candidates)(&Survey { model, passport: &passport }))
}

fn both_sides(views: &[View], joint: usize) -> bool {
    let has = |side: i8| views.iter().any(|view| view.approach.get(joint) == Some(&side));
    has(1) && has(-1)
}

/// Of gravity about each joint, N m.
fn greatest_moments(model: &Model, views: &[View]) -> Vec<f64> {
    let weights =
        Weights { masses: &model.masses, payload: 0.0, down: model.down(&model.base.pose.rotation) };
    let (mut greatest, mut moments) = (vec![0.0_f64; model.chain.len()], Vec::new());
    for view in views {
        weights.moments(&Posture::of(&model.chain, &view.q, &[]), &mut moments);
        for (greatest, moment) in greatest.iter_mut().zip(&moments) {
            *greatest = greatest.max(moment.abs());
        }
    }
    greatest
}

/// What a calibration as everybody does it adjusts: the zeros of all joints but the first and the last, and where camera and light are.
pub fn classical(model: &Model) -> Options {
    let joints = model.chain.joints.iter().map(|joint| joint.name.as_str());
    let between = joints.skip(1).take(model.chain.len().saturating_sub(2));
    let zero = |joint: &str| effect::parse(&format!("joint_zero({joint})"), model).ok();
    Options { rig: RigParameter::USUAL.to_vec(), effects: between.filter_map(zero).collect() }
}
