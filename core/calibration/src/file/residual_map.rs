//! What a model file says of where it was measured, and of its residual map: `measured_region:`, `residual_map:`.

use std::fmt::Write;

use nalgebra::Vector3;
use plumb_document::Spanned;
use plumb_kinematics::Chain;

use super::raw::{RawMap, RawModel, RawOfJoint, RawRegion, RawWave};
use super::validate::{Checked, Checker, Refused};
use super::yaml_text::{number, text};
use crate::arm_model::{Along, JointRange, MeasuredRegion, Model, ResidualMap, Side, Wave};

/// rad (or mm) in one of what a file holds for a joint.
fn factor(chain: &Chain, joint: usize) -> f64 {
    let slides =
        chain.joints.get(joint).is_some_and(|joint| joint.motion == plumb_kinematics::Motion::Slides);
    if slides { 1.0 } else { 1.0_f64.to_radians() }
}

impl Checker<'_> {
    /// Reads both into a model, where they are there and right.
    pub(super) fn measured(&self, raw: &RawModel, model: &mut Model) {
        let chain = &model.chain;
        let region = raw.measured_region.as_ref().map(|region| self.region(region, chain));
        let failed = matches!(region, Some(Err(Refused)));
        model.measured_region = region.and_then(Result::ok);
        let Some(map) = &raw.residual_map else { return };
        match &model.measured_region {
            Some(region) => model.residual_map = self.map(map, region, &model.chain).ok(),
            None if failed => {}
            None => self.problems.add(
                map.span,
                "a residual map holds only in the measured region, and the file does not say where",
                "give `measured_region:` as `plumb model grow` writes it, or leave the map out",
            ),
        }
    }

    fn region(&self, typed: &Spanned<RawRegion>, chain: &Chain) -> Checked<MeasuredRegion> {
        let RawRegion { ranges, reach, poses } = &typed.value;
        let mut joints = vec![None; chain.len()];
        for (name, range) in &ranges.0 {
            let joint = self.joint_named(name, chain)?;
            let [low, high] = range.value;
            if low.is_nan() || high.is_nan() || low > high {
                return self.fail(&range.span, format!("[{low}, {high}] is no range; the lower comes first"));
            }
            let (low, high) = (low * factor(chain, joint), high * factor(chain, joint));
            if let Some(slot) = joints.get_mut(joint) {
                *slot = Some(JointRange::of(chain, joint, low, high));
            }
        }
        if let Some(missing) = joints.iter().position(Option::is_none) {
            let name = chain.joints.get(missing).map_or("?", |joint| joint.name.as_str());
            let reason =
                format!("`ranges` lacks the joint `{name}`; give the range that was measured of every joint");
            return self.fail(&typed.span, reason);
        }
        if reach.value < 0.0 {
            return self.fail(&reach.span, format!("a reach of {} cannot be; it is 0 or more", reach.value));
        }
        let mut kept = Vec::new();
        for pose in poses {
            if pose.value.len() != chain.len() {
                let reason = format!(
                    "this pose has {} coordinates; the arm has {} joints",
                    pose.value.len(),
                    chain.len()
                );
                return self.fail(&pose.span, reason);
            }
            kept.push(pose.value.iter().enumerate().map(|(joint, q)| q * factor(chain, joint)).collect());
        }
        Ok(MeasuredRegion { joints: joints.into_iter().flatten().collect(), poses: kept, reach: reach.value })
    }

    fn map(&self, typed: &Spanned<RawMap>, region: &MeasuredRegion, chain: &Chain) -> Checked<ResidualMap> {
        let raw = &typed.value;
        let fraction = raw.not_understood.value;
        if !(0.0..=1.0).contains(&fraction) {
            return self.fail(
                &raw.not_understood.span,
                format!("a fraction of {fraction} cannot be; it lies between 0 and 1"),
            );
        }
        let middle: Vec<f64> = region.joints.iter().map(|joint| 0.5 * (joint.low + joint.high)).collect();
        let inputs = region.inputs(&middle).len();
        let mut map = ResidualMap { not_understood: fraction, ..ResidualMap::default() };
        for wave in &raw.waves {
            let RawWave { rates, phase_rad, shift_mm } = &wave.value;
            if rates.len() != inputs {
                let reason = format!(
                    "this wave has {} rates; poses in `measured_region` have {inputs} scaled coordinates (two of a joint that turned by 180 deg or more)",
                    rates.len()
                );
                return self.fail(&wave.span, reason);
            }
            map.waves.push(Wave { rates: rates.clone(), phase: *phase_rad, shift: Vector3::from(*shift_mm) });
        }
        for raw in &raw.along {
            let (joint, weights) = self.of_joint(raw, chain)?;
            map.along.push(Along { joint, weights });
        }
        for raw in &raw.sides {
            let (joint, weights) = self.of_joint(raw, chain)?;
            map.sides.push(Side { joint, weights });
        }
        Ok(map)
    }

    /// A joint with its weights in rad or mm.
    fn of_joint(&self, raw: &RawOfJoint, chain: &Chain) -> Checked<(usize, Vec<f64>)> {
        let joint = self.joint_named(&raw.joint, chain)?;
        Ok((joint, raw.weights.iter().map(|weight| weight * factor(chain, joint)).collect()))
    }
}

fn list(values: impl IntoIterator<Item = f64>) -> String {
    values.into_iter().map(number).collect::<Vec<_>>().join(", ")
}

fn joint_name(chain: &Chain, joint: usize) -> String {
    text(chain.joints.get(joint).map_or("?", |joint| joint.name.as_str()))
}

/// Writes the joints of a section with their weights, in degrees or mm; nothing of an empty section.
fn write_joints(
    out: &mut String,
    chain: &Chain,
    key: &str,
    parts: Vec<(usize, &Vec<f64>)>,
) -> std::fmt::Result {
    if !parts.is_empty() {
        writeln!(out, "  {key}:")?;
    }
    for (joint, weights) in parts {
        let weights = list(weights.iter().map(|weight| weight / factor(chain, joint)));
        writeln!(out, "    - {{joint: {}, weights: [{weights}]}}", joint_name(chain, joint))?;
    }
    Ok(())
}

/// Writes both, where they are there.
pub(super) fn write_measured(out: &mut String, model: &Model) -> std::fmt::Result {
    let chain = &model.chain;
    if let Some(region) = &model.measured_region {
        let ranges: Vec<String> = region
            .joints
            .iter()
            .enumerate()
            .map(|(index, joint)| {
                let ends = [joint.low, joint.high].map(|end| end / factor(chain, index));
                format!("{}: [{}]", joint_name(chain, index), list(ends))
            })
            .collect();
        writeln!(out, "measured_region:\n  ranges: {{{}}}", ranges.join(", "))?;
        writeln!(out, "  reach: {}\n  poses:", number(region.reach))?;
        for pose in &region.poses {
            writeln!(
                out,
                "    - [{}]",
                list(pose.iter().enumerate().map(|(joint, q)| q / factor(chain, joint)))
            )?;
        }
    }
    let Some(map) = &model.residual_map else { return Ok(()) };
    writeln!(out, "residual_map:\n  not_understood: {}", number(map.not_understood))?;
    write_joints(out, chain, "along", map.along.iter().map(|one| (one.joint, &one.weights)).collect())?;
    write_joints(out, chain, "sides", map.sides.iter().map(|one| (one.joint, &one.weights)).collect())?;
    if !map.waves.is_empty() {
        writeln!(out, "  waves:")?;
    }
    for wave in &map.waves {
        let (rates, shift) = (list(wave.rates.iter().copied()), list(wave.shift.iter().copied()));
        writeln!(out, "    - {{rates: [{rates}], phase_rad: {}, shift_mm: [{shift}]}}", number(wave.phase))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::arm_model::Model;
    use crate::file::model_text;

    const ARM: &str = "arm: two\nconvention: distal\njoints: [{name: turn, a_mm: 100}, {name: slide, slides: true}]\ntargets: {p1: {}}\n";
    const REGION: &str = "measured_region: {ranges: {turn: [-90, 95], slide: [0, 50]}, reach: 0.5, poses: [[-90, 0], [95, 50]]}\n";
    const MAP: &str = "residual_map: {not_understood: 0.6, along: [{joint: slide, weights: [0.1, 0.02]}], sides: [{joint: turn, weights: [0.3]}], waves: [{rates: [1, 2, 3], phase_rad: 0.5, shift_mm: [0.1, 0, -0.2]}]}\n";

    fn parse(more: &str) -> Result<Model, String> {
        Model::parse("model.yaml", &format!("{ARM}{more}")).map_err(|error| error.to_string())
    }

    #[test]
    fn a_region_and_a_map_are_read_and_written() {
        let model = parse(&format!("{REGION}{MAP}")).unwrap();
        let region = model.measured_region.as_ref().unwrap();
        assert!(region.joints[0].wide && !region.joints[1].wide);
        assert!((region.joints[0].high - 95_f64.to_radians()).abs() < 1e-12 && region.joints[1].high == 50.0);
        let map = model.residual_map.as_ref().unwrap();
        assert!((map.sides[0].weights[0] - 0.3_f64.to_radians()).abs() < 1e-12);
        let again = Model::parse("again.yaml", &model_text(&model)).unwrap();
        assert_eq!(again.residual_map.unwrap().waves, map.waves);
        assert_eq!(again.measured_region.unwrap().reach, region.reach);
        // Inside, the map acts: the wave alone where the joint came from nowhere.
        let effect = map.at(region, &[95_f64.to_radians(), 50.0], &[]).unwrap();
        assert!(effect.shift.norm() > 0.0 && effect.joints[0] == 0.0 && effect.joints[1] != 0.0);
        assert!(map.at(region, &[0.0, 60.0], &[]).is_none());
    }

    #[test]
    fn what_is_no_region_and_no_map_is_refused_with_what_would_be() {
        let message = parse(MAP).unwrap_err();
        assert!(message.contains("does not say where") && message.contains("measured_region"), "{message}");
        let message = parse(&REGION.replace("slide: [0, 50]", "slde: [0, 50]")).unwrap_err();
        assert!(message.contains("no joint `slde`") && message.contains("slide"), "{message}");
        let message = parse(&REGION.replace(", slide: [0, 50]", "")).unwrap_err();
        assert!(message.contains("lacks the joint `slide`"), "{message}");
        let message = parse(&REGION.replace("[-90, 95]", "[95, -90]")).unwrap_err();
        assert!(message.contains("the lower comes first"), "{message}");
        let message = parse(&REGION.replace("[95, 50]]", "[95]]")).unwrap_err();
        assert!(message.contains("1 coordinates") && message.contains("2 joints"), "{message}");
        let message = parse(&format!("{REGION}{}", MAP.replace("[1, 2, 3]", "[1, 2]"))).unwrap_err();
        assert!(message.contains("2 rates") && message.contains("3 scaled coordinates"), "{message}");
        let message = parse(&format!("{REGION}{}", MAP.replace("0.6", "6"))).unwrap_err();
        assert!(message.contains("a fraction of 6 cannot be"), "{message}");
    }
}
