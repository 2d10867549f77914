//! The base is tilted in the frame of the measurements.

use nalgebra::{DMatrix, Vector3};
use plumb_kinematics::{LinkFrames, Motion};

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::tool_offset::length_of;
use super::{Contribution, Dof, Effect, EffectId, LooksAt, Parameter, Sample, Site, Size, Unit};
use crate::arm_model::Model;

#[derive(Debug)]
struct BaseTilt {
    /// The base's own axes, in the frame of the measurements.
    axes: Vec<Vector3<f64>>,
    parameters: Vec<Parameter>,
}

impl Effect for BaseTilt {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Nothing
    }

    fn contribute(&self, _: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        for (parameter, axis) in self.axes.iter().enumerate() {
            contributions.extend(axis.iter().enumerate().map(|(part, rate)| Contribution {
                parameter,
                dof: Dof::BaseRotation(part),
                rate: *rate,
            }));
        }
    }

    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        let size = length_of(values, covariance);
        Size {
            value: size.value * Unit::DEG.factor,
            unit: Unit::DEG.name,
            error: size.error * Unit::DEG.factor,
        }
    }
}

/// Whether the first joint turns about the base's z: its zero is then the base's heading, and bears that name.
fn first_joint_is_heading(model: &Model) -> bool {
    let turns = model.chain.joints.first().is_some_and(|joint| joint.motion == Motion::Turns);
    let link_frames = LinkFrames::of(&model.chain, &[], &[]);
    // A thousandth of a radian: a first axis that leans by more has a heading that can be distinguished from its zero.
    turns && link_frames.joints.first().is_some_and(|joint| joint.axis.cross(&Vector3::z()).norm() < 1e-3)
}

pub(super) const KIND: Kind = Kind {
    name: "base_tilt",
    family: Family::Geometry,
    sites: SiteKind::Base,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The base is tilted in the frame of the measurements (a wrong heading is the first joint's zero).",
    how_to_see: "Poses all around the arm.",
    sketch: ["        ┃  ╱", "     ╱━━┻━━", "  ╌╌╱╌╌╌╌╌╌╌ level"],
    build: |setting: &Setting<'_>| {
        // A heading that is the first joint's zero would be one freedom under two names.
        let count = if first_joint_is_heading(setting.model) { 2 } else { 3 };
        // About the base's own axes, by name: the frame of the measurements may be turned in any way.
        let base = setting.model.base.pose.rotation;
        let axes = (0..count).map(|axis| base * Vector3::ith(axis, 1.0)).collect();
        let names = ["x_deg", "y_deg", "z_deg"].into_iter().take(count);
        let parameters = names.map(|name| Parameter::new(name, Unit::DEG, (-0.35, 0.35))).collect();
        Ok(Box::new(BaseTilt { axes, parameters }))
    },
    candidates: |context| match context.model.base.free {
        // A base that is free turns anyhow.
        true => Vec::new(),
        false => vec![EffectId::at("base_tilt", Site::Base)],
    },
};
