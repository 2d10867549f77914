//! Two axes are twisted against each other, about their common normal.

use plumb_kinematics::Knob;

use super::kind::{Family, Kind, Places, Search, Setting};
use super::{Drive, Effect, Handle, Parameter, Situation, Unit};

#[derive(Debug)]
struct LinkTwist {
    joint: usize,
    parameters: [Parameter; 1],
}

impl Effect for LinkTwist {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn drive(&self, _: &Situation<'_>, drives: &mut Vec<Drive>) {
        drives.push(Drive { parameter: 0, handle: Handle::Joint(self.joint, Knob::Alpha), rate: 1.0 });
    }
}

pub(super) const KIND: Kind = Kind {
    name: "link_twist",
    family: Family::Geometry,
    places: Places::Joints,
    geometry_group: true,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    sentence: "The next axis is twisted about the link's own length.",
    how_to_see: "Wide turns of the next joint, at several angles of this one.",
    build: |setting: &Setting<'_>| {
        let parameters = [Parameter::new("twist_deg", Unit::DEG, (-0.1, 0.1))];
        Ok(Box::new(LinkTwist { joint: setting.joint()?, parameters }))
    },
    candidates: |survey| survey.every_joint("link_twist"),
};
