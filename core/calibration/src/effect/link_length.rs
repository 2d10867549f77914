//! A link is longer or shorter than its drawing says.

use plumb_kinematics::Knob;

use super::kind::{Family, Kind, Places, Search, Setting};
use super::{Drive, Effect, Handle, Parameter, Situation, Unit};

#[derive(Debug)]
struct LinkLength {
    joint: usize,
    parameters: [Parameter; 1],
}

impl Effect for LinkLength {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn drive(&self, _: &Situation<'_>, drives: &mut Vec<Drive>) {
        drives.push(Drive { parameter: 0, handle: Handle::Joint(self.joint, Knob::A), rate: 1.0 });
    }
}

pub(super) const KIND: Kind = Kind {
    name: "link_length",
    family: Family::Geometry,
    places: Places::Joints,
    geometry_group: true,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    sentence: "The link between this joint's axis and the next is longer or shorter than the model says.",
    how_to_see: "Poses that turn the joints before and after the link through wide angles.",
    build: |setting: &Setting<'_>| {
        let parameters = [Parameter::new("length_mm", Unit::MM, (-20.0, 20.0))];
        Ok(Box::new(LinkLength { joint: setting.joint()?, parameters }))
    },
    candidates: |survey| survey.every_joint("link_length"),
};
