//! A model file whose arm is described in a URDF file: the file's joints become distal rows, and the model file says the rest.

use std::path::Path;

use plumb_document::Span;
use plumb_kinematics::urdf::UrdfArm;
use plumb_kinematics::{Chain, Motion};

use super::raw::{RawConvention, RawJoint, RawModel};
use super::validate::{Checked, Checker};
use crate::suggestion::suggestion;

impl Checker<'_> {
    /// The arm of the URDF file a model file names, if it names one.
    pub(super) fn described(&self, raw: &RawModel) -> Checked<Option<UrdfArm>> {
        let at = &raw.convention.span;
        let (file, tip, at): (&str, Option<&str>, &Span) = match (&raw.convention.value, &raw.urdf) {
            (RawConvention::Urdf { file: Some(file), tip }, None) => (file, tip.as_deref(), at),
            (RawConvention::Urdf { file: None, tip }, Some(file)) => {
                (&file.value, tip.as_deref(), &file.span)
            }
            (RawConvention::Urdf { file: Some(_), .. }, Some(twice)) => {
                return self.fail(&twice.span, "the URDF file is named twice");
            }
            (RawConvention::Urdf { .. }, None) => {
                let reason =
                    "which URDF file? write `convention: {urdf: arm.urdf}`, its path from this file's folder";
                return self.fail(at, reason);
            }
            (_, Some(urdf)) => {
                let reason = "`urdf:` goes with `convention: urdf`; with another convention the rows go under `joints:`";
                return self.fail(&urdf.span, reason);
            }
            (_, None) => {
                return match &raw.tip {
                    Some(tip) => self.fail(&tip.span, "`tip:` goes with `convention: urdf`"),
                    None => Ok(None),
                };
            }
        };
        let tip = raw.tip.as_ref().map(|tip| tip.value.as_str()).or(tip);
        let path = Path::new(self.path).parent().unwrap_or_else(|| Path::new("")).join(file);
        let shown = path.display();
        let text = match plumb_document::read_text(&path, plumb_document::FileKind::URDF) {
            Ok(text) => text,
            Err(error) => {
                let reason = format!("{shown}: {error}; the path counts from this file's folder");
                return self.fail(at, reason);
            }
        };
        match UrdfArm::parse(&text, tip) {
            Ok(arm) => Ok(Some(arm)),
            Err(error) => self.fail(at, format!("{shown}: {error}")),
        }
    }

    /// The arm's rows with what the model file adds to them: limits, sign and gear ratio.
    pub(super) fn described_chain(&self, raw: &RawModel, arm: &UrdfArm) -> Checked<Chain> {
        let mut joints = arm.chain.joints.clone();
        for typed in &raw.joints {
            let name = &typed.name;
            let Some(joint) = joints.iter_mut().find(|joint| joint.name == name.value) else {
                let names = arm.chain.joints.iter().map(|joint| joint.name.as_str());
                let reason = format!(
                    "there is no joint `{}` that moves between `{}` and `{}`{}",
                    name.value,
                    arm.ends.0,
                    arm.ends.1,
                    suggestion(&name.value, names)
                );
                return self.fail(&name.span, reason);
            };
            let placed = [typed.a_mm, typed.alpha_deg, typed.d_mm, typed.theta_deg];
            if placed.iter().any(|number| *number != 0.0) || typed.less.is_some() || typed.slides {
                let reason = format!(
                    "the URDF file says where joint `{}` is and how it moves; here it may have limits, a sign and a gear ratio",
                    name.value
                );
                return self.fail(&name.span, reason);
            }
            // The file says whether it slides: its limits are read in that unit.
            let whole = RawJoint { slides: joint.motion == Motion::Slides, ..typed.clone() };
            let read = self.joint(&whole)?;
            if typed.limits_deg.is_some() || typed.limits_mm.is_some() {
                joint.limits = read.limits;
            }
            joint.sign = read.sign;
            joint.gear_ratio = read.gear_ratio;
            joint.screw_pitch = read.screw_pitch;
        }
        Chain::new(arm.chain.convention, joints)
            .or_else(|error| self.fail(&raw.convention.span, error.to_string()))
    }
}
