//! Turning one joint drags another: a drive that runs through it, a belt around it.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Effect, EffectId, EffectNameError, Parameter, Sample, Unit};

#[derive(Debug)]
struct JointCoupling {
    joint: usize,
    driver: usize,
    parameters: [Parameter; 1],
}

impl Effect for JointCoupling {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // A belt or a cable that runs over the driving joint's axis winds by its turn (Craig 2005: actuator space and joint space).
        contributions.push(sample.contribute_to_joint(self.joint, 0, sample.coordinate(self.driver)));
    }

    fn changes_coordinate(&self) -> Option<usize> {
        Some(self.joint)
    }
}

pub(super) const KIND: Kind = Kind {
    name: "joint_coupling",
    family: Family::Joint,
    sites: SiteKind::JointPairs,
    geometry_group: false,
    depends_on_conditions: false,
    // Where two joints move together the driver's coordinate is any function of the joint's own.
    imitates_anything: true,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::OtherJoint,
    sentence: "Turning another joint drags this one along by a small fraction.",
    how_to_see: "Poses that turn the other joint far while this one stays.",
    sketch: ["  ↻ ◯━━━━◯ ↻", "  one joint turns,", "  the other turns along"],
    build: |setting: &Setting<'_>| {
        let joint = setting.joint()?;
        let driver = setting.id.with.filter(|driver| *driver != joint && *driver < setting.model.chain.len());
        let driver = driver.ok_or_else(|| EffectNameError::Malformed {
            text: setting.model.label(setting.id),
            example:
                "joint_coupling(wrist_bend, wrist_roll): the joint that is dragged, and the one that drags"
                    .to_owned(),
        })?;
        // A fifth of the other's turn: the ratios of designed couplings are larger and belong into the model.
        let parameters = [Parameter::new("ratio", Unit::RATIO, (-0.2, 0.2))];
        Ok(Box::new(JointCoupling { joint, driver, parameters }))
    },
    candidates: |context| {
        let joints = context.model.chain.len();
        let pairs = (0..joints).flat_map(|joint| (0..joints).map(move |driver| (joint, driver)));
        pairs
            // Millimetres drag no angle by a ratio without a unit.
            .filter(|(joint, driver)| joint != driver && context.turns(*joint) && context.turns(*driver))
            .map(|(joint, driver)| EffectId {
                with: Some(driver),
                ..EffectId::at("joint_coupling", super::Site::Joint(joint))
            })
            .collect()
    },
};
