//! A joint gives under the weight of what it carries, of which nobody knows how heavy it is.
//!
//! The moment of a link about a joint before it is linear in the link's first moments (mass times centre; Khalil & Dombre 2002, section 9.3): axis . (R c x down) for each axis of
//! its frame, which for parallel axes are the sine and the cosine of the link's absolute angle. What a link adds by where it hangs is a first moment of the links before it.

use nalgebra::{DMatrix, Vector3};

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Effect, LooksAt, Parameter, Sample, Size, Unit, standard_error};

/// Links looked at, from the joint on: those beyond are short and light, and their moments are nearly those of the last of these.
const LINKS: usize = 3;

/// Greatest plausible deflection by one term, rad: a soft joint of a long arm gives one degree.
const GREATEST: f64 = 0.02;

#[derive(Debug)]
struct GravityFlexure {
    joint: usize,
    links: usize,
    parameters: Vec<Parameter>,
}

impl Effect for GravityFlexure {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        let joints = &sample.link_frames.joints;
        // All in the base's frame: only the angle between the axis and what is down counts.
        let Some(axis) = joints.get(self.joint).map(|joint| joint.axis) else { return };
        // axis . (arm x down) = arm . (down x axis)
        let lever: Vector3<f64> = sample.weights.down.cross(&axis);
        for link in 0..self.links {
            let Some(frame) = joints.get(self.joint + link) else { return };
            for part in 0..3 {
                let along = frame.end.rotation.matrix().column(part).into_owned();
                contributions.push(sample.rotate_joint(self.joint, 3 * link + part, along.dot(&lever)));
            }
        }
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Gravity
    }

    /// Root of the sum of squares of all terms.
    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        let value = values.iter().map(|value| value * value).sum::<f64>().sqrt();
        // The slope of the length of a vector is its direction; of a vector of nothing there is none.
        let length = if value > 0.0 { value } else { f64::INFINITY };
        let along: Vec<f64> = values.iter().map(|value| value / length).collect();
        let mut variance = 0.0;
        for (row, left) in along.iter().enumerate() {
            for (column, right) in along.iter().enumerate() {
                variance += left * right * covariance.get((row, column)).copied().unwrap_or(0.0);
            }
        }
        let factor = Unit::DEG.factor;
        Size { value: value * factor, unit: Unit::DEG.name, error: standard_error(variance) * factor }
    }
}

pub(super) const KIND: Kind = Kind {
    name: "gravity_flexure",
    family: Family::Joint,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The joint gives under the weight it carries, of which nothing is known: any sum of what its outboard links can make.",
    how_to_see: "Poses all over the range of the joint and of those beyond it; masses under `links:` make one number of it (joint_compliance).",
    sketch: ["  ◯╌╌╌╌╌╌╌ without weight", "   ╲ turns in the joint", "    ╲━━━━━▼ how heavy?"],
    build: |setting: &Setting<'_>| {
        let joint = setting.joint()?;
        if setting.slides(joint) {
            return Err(setting.unusable(
                "acts on a joint that turns; a slide gives along its way, as link_sag of what carries it",
            ));
        }
        let links = (setting.model.chain.len() - joint).min(LINKS);
        let names =
            (1..=links).flat_map(|link| ["x", "y", "z"].map(|part| format!("link_{link}_{part}_deg")));
        let parameters = names.map(|name| Parameter::new(&name, Unit::DEG, (-GREATEST, GREATEST))).collect();
        Ok(Box::new(GravityFlexure { joint, links, parameters }))
    },
    candidates: |context| match !context.has_weight() && context.summary.measures_points {
        true => context.every_turning_joint("gravity_flexure"),
        // With masses one compliance says it all; triggers and heights alone cannot distinguish so many terms from what a sensor does.
        // One number for each of up to nine terms.
        false => Vec::new(),
    },
};
