//! A link sits shifted along its joint's axis.

use plumb_kinematics::Knob;

use super::kind::{Family, Kind, Places, Search, Setting};
use super::{Drive, Effect, Handle, Parameter, Situation, Unit};

#[derive(Debug)]
struct LinkOffset {
    joint: usize,
    parameters: [Parameter; 1],
}

impl Effect for LinkOffset {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn drive(&self, _: &Situation<'_>, drives: &mut Vec<Drive>) {
        drives.push(Drive { parameter: 0, handle: Handle::Joint(self.joint, Knob::D), rate: 1.0 });
    }
}

pub(super) const KIND: Kind = Kind {
    name: "link_offset",
    family: Family::Geometry,
    places: Places::Joints,
    geometry_group: true,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    sentence: "The link is shifted along the joint's axis.",
    how_to_see: "Poses that tip the joint's axis into different directions.",
    build: |setting: &Setting<'_>| {
        let parameters = [Parameter::new("offset_mm", Unit::MM, (-20.0, 20.0))];
        Ok(Box::new(LinkOffset { joint: setting.joint()?, parameters }))
    },
    candidates: |survey| survey.every_joint("link_offset"),
};
