//! A joint's axis leans in the plane of the link before it: Hayati's parameter, which the four of Denavit and Hartenberg
//! lack at parallel axes.

use plumb_kinematics::Knob;

use super::kind::{Family, Kind, Places, Search, Setting};
use super::{Drive, Effect, Handle, Parameter, Situation, Unit};

#[derive(Debug)]
struct AxisSkew {
    joint: usize,
    parameters: [Parameter; 1],
}

impl Effect for AxisSkew {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn drive(&self, _: &Situation<'_>, drives: &mut Vec<Drive>) {
        drives.push(Drive { parameter: 0, handle: Handle::Joint(self.joint, Knob::Beta), rate: 1.0 });
    }
}

pub(super) const KIND: Kind = Kind {
    name: "axis_skew",
    family: Family::Geometry,
    places: Places::Joints,
    geometry_group: true,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    sentence: "The joint's axis leans in the plane of the link before it, so that nominally parallel axes are not.",
    how_to_see: "Wide turns of the joint, at several angles of the one before.",
    build: |setting: &Setting<'_>| {
        let parameters = [Parameter::new("skew_deg", Unit::DEG, (-0.1, 0.1))];
        Ok(Box::new(AxisSkew { joint: setting.joint()?, parameters }))
    },
    candidates: |survey| survey.every_joint("axis_skew"),
};
