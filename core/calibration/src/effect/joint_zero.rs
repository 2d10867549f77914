//! A joint's zero is not where its encoder says.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Effect, LooksAt, Parameter, Sample};

#[derive(Debug)]
struct JointZero {
    joint: usize,
    parameters: [Parameter; 1],
}

impl Effect for JointZero {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Nothing
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // In the coordinate's own sense: a row that counts the other way turns the other way.
        contributions.push(sample.contribute_to_joint(self.joint, 0, 1.0));
    }
}

pub(super) const KIND: Kind = Kind {
    name: "joint_zero",
    family: Family::Geometry,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Coordinate,
    sentence: "The joint is off by a constant angle: its zero is not where the controller believes.",
    how_to_see: "Any poses that turn the joints before and after it.",
    sketch: ["     ╱ where it is", "    ╱ ↕", "   ◯╌╌╌╌ where it says"],
    build: |setting: &Setting<'_>| {
        let joint = setting.joint()?;
        // 20 degrees, or 20 mm: a coupling that was put on wrongly. What is further off is a wrong row of the model file.
        let parameter = setting.displacement(("zero_deg", 0.35), ("zero_mm", 20.0))?;
        Ok(Box::new(JointZero { joint, parameters: [parameter] }))
    },
    candidates: |context| context.every_joint("joint_zero"),
};
