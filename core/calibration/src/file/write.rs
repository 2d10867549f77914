//! Writing a model file, in the shape people write it by hand.

use std::fmt::Write;

use nalgebra::{Rotation3, Vector3};
use plumb_kinematics::{Convention, DhParameter, Motion};

use super::residual_map::write_measured;
use super::yaml_text::{number, text};
use crate::arm_model::SurfaceShape;
use crate::arm_model::{
    AddedEffect, Epochs, Frame, MeasuredFrom, Model, Noise, Revision, Surface, Target, ValuePrior,
};
use crate::effect::{self, EffectId, FormulaTarget, Parameter};
use crate::table::scalar::SCALARS;

fn triple(vector: &Vector3<f64>) -> String {
    format!("[{}, {}, {}]", number(vector.x), number(vector.y), number(vector.z))
}

/// The whole file.
pub fn model_text(model: &Model) -> String {
    let mut out = String::new();
    write_into(&mut out, model).unwrap_or_default();
    out
}

fn write_into(out: &mut String, model: &Model) -> std::fmt::Result {
    writeln!(out, "arm: {}", text(&model.arm))?;
    let convention = match model.chain.convention {
        Convention::Distal => "distal",
        Convention::Proximal => "proximal",
    };
    writeln!(out, "convention: {convention}")?;
    // Rows of the arm before what is on them: effects name joints, and people read from the top.
    joints(out, model)?;
    // Always in degrees and mm, whatever the file that was read used.
    let rpy = rpy_deg(&model.base.pose.rotation);
    let xyz = model.base.pose.translation.vector;
    writeln!(
        out,
        "base: {{xyz_mm: {}, rpy_deg: {}, free: {}{}}}",
        triple(&xyz),
        triple(&rpy),
        model.base.free,
        if model.base.per_session { ", per: session" } else { "" }
    )?;
    if let Some(epochs) = &model.epochs {
        writeln!(out, "epochs: {}", epochs_text(epochs))?;
    }
    if !model.targets.is_empty() {
        writeln!(out, "targets:")?;
    }
    for target in &model.targets {
        writeln!(out, "  {}: {}", target.name, target_text(target))?;
    }
    boards(out, model)?;
    if let Some(sensor) = model.profile_sensor.and_then(|index| model.targets.get(index)) {
        writeln!(out, "profile: {{seen_by: {}}}", sensor.name)?;
    }
    // As it was written: a wildcard stays one.
    let free: Vec<String> = model.free.iter().map(|pattern| text(pattern)).collect();
    writeln!(out, "free: [{}]", free.join(", "))?;
    // Before the effects that use them.
    definitions(out, model)?;
    effects(out, "effects", &model.effects, model)?;
    effects(out, "fitted", &model.fitted, model)?;
    surfaces(out, &model.surfaces)?;
    let from = match model.measured_from {
        MeasuredFrom::Instrument => "instrument",
        MeasuredFrom::World => "world",
    };
    writeln!(out, "measured_from: {from}")?;
    if let Some(gravity) = &model.gravity {
        writeln!(out, "gravity: {}", triple(gravity))?;
    }
    if let Some([x, y, z]) = &model.working_volume {
        let [x, y, z] = [x, y, z].map(|(low, high)| format!("[{}, {}]", number(*low), number(*high)));
        writeln!(out, "working_volume: {{x_mm: {x}, y_mm: {y}, z_mm: {z}}}")?;
    }
    ends(out, model)
}

/// Roll, pitch and yaw, degrees.
fn rpy_deg(rotation: &Rotation3<f64>) -> Vector3<f64> {
    let (roll, pitch, yaw) = rotation.euler_angles();
    Vector3::new(roll, pitch, yaw).map(f64::to_degrees)
}

/// A target; how it is turned only where that is not as the flange is, and whether that is free only where its place is not alike.
fn target_text(target: &Target) -> String {
    let mut keys = format!("xyz_mm: {}", triple(&target.xyz));
    // Most targets are points.
    if target.rotation != Rotation3::identity() {
        keys.push_str(&format!(", rpy_deg: {}", triple(&rpy_deg(&target.rotation))));
    }
    keys.push_str(&format!(", free: {}", target.free));
    // What follows `free` is left out, so that a file that did not say it does not begin to.
    if target.rotation_free != target.free {
        keys.push_str(&format!(", free_rpy: {}", target.rotation_free));
    }
    format!("{{{keys}}}")
}

/// `{rows: [141, 507]}`.
fn epochs_text(epochs: &Epochs) -> String {
    let (key, starts): (_, Vec<String>) = match epochs {
        Epochs::Rows(rows) => ("rows", rows.iter().map(usize::to_string).collect()),
        Epochs::Times(times) => ("times_s", times.iter().map(|time| number(*time)).collect()),
        Epochs::Sessions(names) => ("sessions", names.iter().map(|name| format!("{name:?}")).collect()),
    };
    format!("{{{key}: [{}]}}", starts.join(", "))
}

fn joints(out: &mut String, model: &Model) -> std::fmt::Result {
    writeln!(out, "joints:")?;
    for joint in &model.chain.joints {
        write!(out, "  - {{name: {}, a_mm: {}", text(&joint.name), number(joint.a))?;
        write!(out, ", alpha_deg: {}, d_mm: {}", number(joint.alpha.to_degrees()), number(joint.d))?;
        write!(out, ", theta_deg: {}", number(joint.theta.to_degrees()))?;
        let (low, high) = joint.limits;
        match joint.motion {
            Motion::Turns => {
                write!(out, ", limits_deg: [{}, {}]", number(low.to_degrees()), number(high.to_degrees()))?;
            }
            Motion::Slides => write!(out, ", slides: true, limits_mm: [{}, {}]", number(low), number(high))?,
        }
        // What is usual is not written.
        if joint.sign < 0.0 {
            write!(out, ", sign: -1")?;
        }
        if let Some(less) = joint.less.and_then(|less| model.chain.joints.get(less)) {
            write!(out, ", less: {}", text(&less.name))?;
        }
        if let Some(ratio) = joint.gear_ratio {
            write!(out, ", gear_ratio: {}", number(ratio))?;
        }
        if let Some(pitch) = joint.screw_pitch {
            write!(out, ", screw_pitch_mm: {}", number(pitch))?;
        }
        writeln!(out, "}}")?;
    }
    if !model.masses.is_empty() {
        writeln!(out, "links:")?;
    }
    for mass in &model.masses {
        let after = model.chain.joints.get(mass.after).map_or("?", |joint| joint.name.as_str());
        let (kg, centre) = (number(mass.mass), triple(&mass.centre));
        writeln!(out, "  - {{after: {}, mass_kg: {kg}, centre_mm: {centre}}}", text(after))?;
    }
    Ok(())
}

fn definitions(out: &mut String, model: &Model) -> std::fmt::Result {
    if !model.definitions.is_empty() {
        writeln!(out, "define:")?;
    }
    for definition in &model.definitions {
        writeln!(out, "  - name: {}", definition.name)?;
        writeln!(out, "    where: {}", text(&model.site_name(definition.site)))?;
        let joint =
            |index: usize| text(model.chain.joints.get(index).map_or("?", |joint| joint.name.as_str()));
        let mut adds: Vec<String> = Vec::new();
        for addend in &definition.addends {
            let on = match addend.target {
                FormulaTarget::Coordinate(index) => Some(format!("joint: {}", joint(index))),
                FormulaTarget::Row(index, DhParameter::A) => Some(format!("length: {}", joint(index))),
                FormulaTarget::Row(index, DhParameter::D) => Some(format!("offset: {}", joint(index))),
                FormulaTarget::Row(index, DhParameter::Alpha) => Some(format!("twist: {}", joint(index))),
                FormulaTarget::Row(index, _) => Some(format!("skew: {}", joint(index))),
                FormulaTarget::Target(index, _) => {
                    model.targets.get(index).map(|target| format!("target: {}", target.name))
                }
                _ => None,
            };
            // A target whose three coordinates are moved is named once.
            adds.extend(on.filter(|on| !adds.contains(on)));
            adds.push(format!("{}: {:?}", addend.key, addend.text()));
        }
        writeln!(out, "    adds: {{{}}}", adds.join(", "))?;
        let parameter = |parameter: &Parameter| {
            let (low, high) = parameter.range;
            let unit = parameter.unit.name;
            format!("{}: {{unit: {unit:?}, range: [{}, {}]}}", parameter.name, number(low), number(high))
        };
        let parameters: Vec<String> = definition.parameters.iter().map(parameter).collect();
        writeln!(out, "    parameters: {{{}}}", parameters.join(", "))?;
        if let Some(sentence) = &definition.sentence {
            writeln!(out, "    sentence: {sentence:?}")?;
        }
    }
    Ok(())
}

fn identity(id: &EffectId, model: &Model) -> String {
    let mut keys = format!("effect: {}", id.name);
    let mut key = |name: &str, value: String| keys.push_str(&format!(", {name}: {value}"));
    key("where", text(&model.site_name(id.site)));
    if let Some(joint) = id.with.and_then(|with| model.chain.joints.get(with)) {
        key("with", text(&joint.name));
    }
    if let Some(order) = id.order {
        key("n", number(order));
    }
    if let Some(of) = id.of {
        key("of", of.name().to_owned());
    }
    if let Some(searched) = id.inner {
        key("searched", number(searched));
    }
    keys
}

fn effects(out: &mut String, heading: &str, effects: &[AddedEffect], model: &Model) -> std::fmt::Result {
    if effects.is_empty() {
        return if heading == "effects" { writeln!(out, "effects: []") } else { Ok(()) };
    }
    writeln!(out, "{heading}:")?;
    for added in effects {
        let values = match effect::build(&added.id, model) {
            Ok(built) => {
                let shown = added.values.iter().zip(built.parameters());
                let parts: Vec<String> = shown
                    .map(|(value, parameter)| {
                        format!("{}: {}", parameter.name, number(value * parameter.unit.factor))
                    })
                    .collect();
                parts.join(", ")
            }
            Err(_) => String::new(),
        };
        let claim = match model.correction(&added.id).filter(|_| heading == "effects") {
            Some(correction) => {
                let may_be: Vec<String> = correction.may_be.iter().map(|one| format!("{one:?}")).collect();
                format!(", claim: correction, may_be: [{}]", may_be.join(", "))
            }
            None => String::new(),
        };
        let prior = model.prior(&added.id).filter(|_| heading == "effects");
        let prior = prior.map_or_else(String::new, |prior| prior_text(prior, model));
        writeln!(out, "  - {{{}, values: {{{values}}}{prior}{claim}}}", identity(&added.id, model))?;
    }
    Ok(())
}

/// The standard deviations known of an effect's values, in the units of the values.
fn prior_text(prior: &ValuePrior, model: &Model) -> String {
    let Ok(built) = effect::build(&prior.id, model) else { return String::new() };
    let known = prior.sd.iter().zip(built.parameters());
    let known: Vec<String> = known
        .filter_map(|(sd, parameter)| {
            Some(format!("{}: {}", parameter.name, number((*sd)? * parameter.unit.factor)))
        })
        .collect();
    if known.is_empty() { String::new() } else { format!(", prior_sd: {{{}}}", known.join(", ")) }
}

fn surfaces(out: &mut String, surfaces: &[Surface]) -> std::fmt::Result {
    if !surfaces.is_empty() {
        writeln!(out, "surfaces:")?;
    }
    for surface in surfaces {
        let shape = match &surface.shape {
            SurfaceShape::Plane { normal, offset } => {
                format!("plane: {{normal: {}, offset_mm: {}}}", triple(normal), number(*offset))
            }
            SurfaceShape::Line { point, direction } => {
                let light = match surface.light {
                    Some(side) if side > 0.0 => ", light: left",
                    Some(_) => ", light: right",
                    None => "",
                };
                format!("line: {{point_mm: {}, direction: {}{light}}}", triple(point), triple(direction))
            }
            SurfaceShape::Sphere { centre, radius, .. } => {
                format!("sphere: {{centre_mm: {}, radius_mm: {}}}", triple(centre), number(*radius))
            }
            SurfaceShape::Point { point } => format!("point_mm: {}", triple(point)),
        };
        writeln!(out, "  {}: {{{shape}, free: {}}}", text(&surface.name), surface.free)?;
    }
    Ok(())
}

fn ends(out: &mut String, model: &Model) -> std::fmt::Result {
    sensor(out, model)?;
    levels(out, model)?;
    noise(out, &model.noise)?;
    touch(out, model)?;
    write_measured(out, model)?;
    model.revision.as_ref().map_or(Ok(()), |known| revision(out, known))
}

fn sensor(out: &mut String, model: &Model) -> std::fmt::Result {
    let Some(sensor) = &model.sensor else { return Ok(()) };
    writeln!(
        out,
        "sensor: {{working_mm: {}, peak_mm: {}, spot_mm: {}, hysteresis_percent: {}, dark_percent: {}}}",
        number(sensor.working),
        number(sensor.peak),
        number(sensor.spot),
        number(sensor.hysteresis * 100.0),
        number(sensor.dark * 100.0)
    )
}

fn boards(out: &mut String, model: &Model) -> std::fmt::Result {
    if model.boards.iter().any(|board| board.name.is_some()) {
        writeln!(out, "boards:")?;
    }
    for board in &model.boards {
        let key = board.name.as_ref().map_or_else(|| "board".to_owned(), |name| format!("  {}", text(name)));
        let camera = model.targets.get(board.camera).map_or("p1", |target| target.name.as_str());
        let (xyz, rpy) = (triple(&board.pose.translation.vector), triple(&rpy_deg(&board.pose.rotation)));
        writeln!(out, "{key}: {{seen_by: {camera}, xyz_mm: {xyz}, rpy_deg: {rpy}, free: {}}}", board.free)?;
    }
    Ok(())
}

fn levels(out: &mut String, model: &Model) -> std::fmt::Result {
    if model.levels.iter().any(|level| level.name.is_some()) {
        writeln!(out, "levels:")?;
    }
    for level in &model.levels {
        let after = match level.frame {
            Frame::Base => "base",
            Frame::After(joint) => {
                model.chain.joints.get(joint).map_or("flange", |joint| joint.name.as_str())
            }
        };
        let rpy = rpy_deg(&level.rotation);
        let key = level.name.as_ref().map_or_else(|| "level".to_owned(), |name| format!("  {}", text(name)));
        writeln!(out, "{key}: {{after: {}, rpy_deg: {}}}", text(after), triple(&rpy))?;
    }
    Ok(())
}

fn noise(out: &mut String, noise: &Noise) -> std::fmt::Result {
    let positions = noise.positions.iter().map(|(name, sigma)| (format!("{name}_mm"), *sigma));
    let turns = noise.orientations.iter().map(|(name, sigma)| (format!("{name}_deg"), sigma.to_degrees()));
    let others = [
        ("touch_mm", noise.touch),
        ("tilt_deg", noise.tilt.map(f64::to_degrees)),
        ("board_mm", noise.board),
        ("profile_mm", noise.profile),
        ("board_deg", noise.board_rotation.map(f64::to_degrees)),
    ];
    let scalars =
        SCALARS.iter().filter_map(|scalar| noise.of(scalar).map(|sigma| (scalar.key(), scalar.shown(sigma))));
    let others = others.into_iter().filter_map(|(key, sigma)| sigma.map(|sigma| (key.to_owned(), sigma)));
    let others = scalars.chain(others);
    let entries =
        positions.chain(turns).chain(others).map(|(key, sigma)| format!("{key}: {}", number(sigma)));
    let entries: Vec<String> = entries.collect();
    if entries.is_empty() { Ok(()) } else { writeln!(out, "noise: {{{}}}", entries.join(", ")) }
}

fn touch(out: &mut String, model: &Model) -> std::fmt::Result {
    let Some(touch) = &model.touch else { return Ok(()) };
    writeln!(out, "touch:\n  p: {}", text(&touch.target))?;
    if !touch.distances.is_empty() {
        writeln!(out, "  distances:")?;
    }
    for distance in &touch.distances {
        let [first, second] = distance.between.each_ref().map(|name| text(name));
        writeln!(out, "    - {{between: [{first}, {second}], mm: {}}}", number(distance.length))?;
    }
    Ok(())
}

fn revision(out: &mut String, revision: &Revision) -> std::fmt::Result {
    let Revision { number: of_file, of, did, data, parent, rms } = revision;
    write!(out, "revision: {{number: {of_file}, of: {of:?}, did: {did:?}")?;
    if let Some(data) = data {
        write!(out, ", data: {data:?}")?;
    }
    if let Some(parent) = parent {
        write!(out, ", parent: {parent}")?;
    }
    if let Some(rms) = rms {
        write!(out, ", rms_{}: {}", rms.unit, number(rms.value))?;
    }
    writeln!(out, "}}")
}
