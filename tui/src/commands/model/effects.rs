//! `plumb model effects`: the library of effects, read from the effects themselves.

use std::error::Error;

use nalgebra::{Isometry3, Vector3};
use plumb_calibration::arm_model::{Model, StripeRig};
use plumb_calibration::effect::{self, EffectId, EffectNameError, Family, Kind, Parameter, Search, SiteKind};

use super::arguments::EffectsArguments;
use super::text::figure;
use crate::shown_unit::shown_unit;

/// An arm at which every effect of the library can act: where sites have names, parameters have units.
const EXAMPLE: &str = "
arm: example
convention: distal
joints:
  - {name: rail, slides: true, limits_mm: [0, 500], screw_pitch_mm: 5}
  - {name: waist, a_mm: 0, alpha_deg: 90, d_mm: 400}
  - {name: shoulder, a_mm: 300, alpha_deg: 0, d_mm: 0}
  - {name: elbow, a_mm: 250, alpha_deg: 0, d_mm: 0}
links: [{after: elbow, mass_kg: 2, centre_mm: [-100, 0, 0]}]
targets: {p1: {xyz_mm: [0, 0, 50]}}
surfaces: {table: {plane: {normal: [0, 0, 1], offset_mm: 0}}}
sensor: {working_mm: 8, peak_mm: 5}
epochs: {rows: [11]}
";

/// The library in a list, or one effect with its parameters.
///
/// # Errors
/// There is no effect of that name.
pub(super) fn run(arguments: &EffectsArguments) -> Result<String, Box<dyn Error>> {
    match &arguments.name {
        None => Ok(list()),
        Some(name) => {
            // `joint_backlash(elbow)` asks for joint_backlash.
            let plain = name.split('(').next().unwrap_or(name).trim();
            details(effect::kind(plain).ok_or_else(|| unknown(plain))?)
        }
    }
}

fn unknown(name: &str) -> String {
    let names: Vec<&str> = effect::kinds().iter().map(|kind| kind.name).collect();
    let near = plumb_document::nearest(name, &names);
    let near = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    format!("there is no effect `{name}`{near}\n`plumb model effects` lists all of them")
}

/// The families in the order they are listed.
const FAMILIES: [(Family, &str); 6] = [
    (Family::Geometry, "Geometry: constant errors of shape"),
    (Family::Joint, "Joints: what a drive does"),
    (Family::LinkAndTime, "Links, base and time: what bends, grows or drifts"),
    (Family::Sensor, "The sensor in the arm's hand"),
    (Family::Instrument, "The measuring instrument"),
    (Family::Epoch, "Between two stretches of rows (epochs): what was re-set"),
];

fn list() -> String {
    let width = effect::kinds().iter().map(|kind| signature(kind).len()).max().unwrap_or(0);
    let mut text = String::new();
    for (family, title) in FAMILIES {
        text.push_str(&format!("{title}\n"));
        for kind in effect::kinds().iter().filter(|kind| kind.family == family) {
            text.push_str(&format!("  {:width$}  {}\n", signature(kind), kind.sentence));
        }
        text.push('\n');
    }
    text.push_str(
        "`plumb model effects NAME` draws it, says what to measure and which parameters it has.\n`geometry(*)` means all of the first group but joint_zero. \
         An effect of your own is written in the model file under `define:`.\n",
    );
    text
}

/// How an effect is written: its name and what is in its brackets.
fn signature(kind: &Kind) -> String {
    let arguments = match kind.sites {
        SiteKind::Joints => "(JOINT)",
        SiteKind::JointsAndOrder => "(JOINT, PERIODS)",
        SiteKind::JointsAndPieces => "(JOINT, PIECES)",
        SiteKind::JointPairs => "(JOINT, DRIVING)",
        SiteKind::JointsAndQuantity => "(JOINT, WHAT)",
        SiteKind::Targets => "(TARGET)",
        SiteKind::Axes => "(AXIS)",
        SiteKind::Surfaces => "(SURFACE)",
        SiteKind::Readings => "(READING)",
        SiteKind::Base | SiteKind::Instrument | SiteKind::Sensor => "",
    };
    format!("{}{arguments}", kind.name)
}

/// The effect at a site of the example arm: at a joint that turns, or, where it is of slides, at its rail.
fn example(kind: &Kind, joint: &str) -> String {
    let arguments = match kind.sites {
        SiteKind::Joints => format!("({joint})"),
        SiteKind::JointsAndOrder => format!("({joint}, 2)"),
        SiteKind::JointsAndPieces => format!("({joint}, 10)"),
        SiteKind::JointPairs => format!("({joint}, shoulder)"),
        SiteKind::JointsAndQuantity => format!("({joint}, zero)"),
        SiteKind::Targets => "(p1)".to_owned(),
        SiteKind::Axes => "(x)".to_owned(),
        SiteKind::Surfaces => "(table)".to_owned(),
        SiteKind::Readings => "(distance)".to_owned(),
        SiteKind::Base | SiteKind::Instrument | SiteKind::Sensor => String::new(),
    };
    format!("{}{arguments}", kind.name)
}

/// The effect of a kind at the example arm, with what is searched for in it set to something: its parameters are the same whatever that is.
fn example_id(kind: &Kind, joint: &str, model: &Model) -> Result<EffectId, EffectNameError> {
    let mut id = effect::parse(&example(kind, joint), model)?;
    if kind.search != Search::Nothing {
        id.inner = Some(1.0);
    }
    Ok(id)
}

fn details(kind: &Kind) -> Result<String, Box<dyn Error>> {
    let mut model = Model::parse("example", EXAMPLE)?;
    let acts = |joint: &str| effect::build(&example_id(kind, joint, &model)?, &model).map(|_| ());
    let at = ["elbow", "rail"].into_iter().find(|joint| acts(joint).is_ok());
    let of_a_stripe = at.is_none();
    let example = example(kind, at.unwrap_or("elbow"));
    let id = example_id(kind, at.unwrap_or("elbow"), &model)?;
    model.stripe_rig = Some(example_rig());
    let effect = effect::build(&id, &model)?;
    let mut text = format!("{}\n\n", signature(kind));
    for line in kind.sketch {
        text.push_str(&format!("    {line}\n"));
    }
    text.push_str(&format!("\n{}\n", kind.sentence));
    text.push_str(&format!("\nTo see it: {}\n", kind.how_to_see));
    text.push_str("\nParameters\n");
    for parameter in effect.parameters() {
        text.push_str(&format!("  {}\n", parameter_line(parameter)));
    }
    for line in properties(kind) {
        text.push_str(&format!("\n{line}\n"));
    }
    text.push_str(&match of_a_stripe {
        true => format!("\nAdd it: plumb stripe adjust CELL --scans RUN --add '{example}' -o NEW_CELL\n"),
        false => format!("\nAdd it: plumb model add MODEL '{example}' --data TABLE\n"),
    });
    Ok(text)
}

/// Any light stripe will do for its effects to have parameters.
fn example_rig() -> StripeRig {
    StripeRig {
        focal_px: [700.0; 2],
        principal_px: [128.0; 2],
        distortion: [0.0; 5],
        flange_from_camera: Isometry3::identity(),
        normal: Vector3::z(),
        d_mm: -300.0,
        bow: 0.0,
    }
}

/// `play_deg  between -5.73 and 5.73 deg on a real machine`.
fn parameter_line(parameter: &Parameter) -> String {
    let shown = |value: f64| figure(value * parameter.unit.factor);
    let unit = shown_unit(parameter.unit.name);
    let (least, greatest) = parameter.range;
    let range = format!("plausible from {} to {} {unit}", shown(least), shown(greatest));
    format!("{:<16}  {}", parameter.name, range.trim_end())
}

/// What else decides how the diagnosis treats it.
fn properties(kind: &Kind) -> Vec<&'static str> {
    let mut lines = Vec::new();
    if kind.geometry_group {
        lines.push("It is part of `geometry(*)`.");
    }
    if kind.is_event {
        lines.push("It is something that happened, not a property of the arm, so it is not used to predict.");
    }
    if kind.imitates_anything {
        lines.push("Several of it at one joint can take the form of any other effect there; the diagnosis is then careful with names.");
    }
    if kind.changes_gradually() {
        lines.push("It changes with time or temperature; log `time_s` or `temperature_c`.");
    }
    match kind.search {
        Search::Nothing => {}
        Search::Smooth => lines.push("One number in it (such as a time constant) is searched for."),
        Search::Jumps => lines.push("The row at which it begins is searched for."),
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_is_listed_and_has_details_with_its_parameters() {
        let list = list();
        for kind in effect::kinds() {
            assert!(list.contains(&signature(kind)), "{} is not listed", kind.name);
            let details = details(kind).unwrap();
            assert!(details.contains(kind.how_to_see), "{details}");
            assert!(details.contains("plausible from"), "{details}");
            assert!(kind.sketch.iter().all(|line| details.contains(line)), "the sketch is drawn: {details}");
        }
    }

    #[test]
    fn an_angle_is_shown_in_degrees() {
        let details = run(&EffectsArguments { name: Some("joint_backlash(elbow)".to_owned()) }).unwrap();
        assert!(details.contains("play_deg          plausible from -5.730 to 5.730 deg"), "{details}");
    }

    #[test]
    fn a_misspelled_name_is_refused_with_the_nearest() {
        let error =
            run(&EffectsArguments { name: Some("joint_backslash".to_owned()) }).unwrap_err().to_string();
        assert!(error.contains("did you mean `joint_backlash`?"), "{error}");
        let short = run(&EffectsArguments { name: Some("backlash".to_owned()) }).unwrap_err().to_string();
        assert!(short.contains("did you mean `joint_backlash`?"), "{short}");
        let stranger = run(&EffectsArguments { name: Some("zebra".to_owned()) }).unwrap_err().to_string();
        assert_eq!(stranger, "there is no effect `zebra`\n`plumb model effects` lists all of them");
    }
}
