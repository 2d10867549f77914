//! A joint creeps into place: it stops short by a fraction of its last move.

use super::coordinate_change::coordinate_change;
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Parameter, Unit};

pub(super) const KIND: Kind = Kind {
    name: "joint_settling",
    family: Family::Joint,
    sites: SiteKind::Joints,
    geometry_group: false,
    // Two visits to one pose come after different moves.
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::LastMove,
    sentence: "The joint stops short by a fraction of its last move, as if it had not yet come to rest.",
    how_to_see: "The same poses after short and after long moves; a wait before reading.",
    sketch: ["  ──╮ asked", "     ╲", "      ╰─── creeps in"],
    build: |setting: &Setting<'_>| {
        // A twentieth of the way is seen by eye.
        let fraction = Parameter::new("share", Unit::RATIO, (-0.05, 0.05));
        // What has not settled is a fraction of the way that it still had to go: an exponential approach, read at one time after each move.
        coordinate_change(setting, fraction, |sample, joint| -sample.last_move(joint))
    },
    candidates: |context| context.every_joint("joint_settling"),
};
