//! A joint stops short in proportion to its speed.
//!
//! Its speed is that of the move from the row before. Where every pose is approached by a short move of its own, in which all joints go alike, it is play, and is named so.

use super::coordinate_change::coordinate_change;
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};

pub(super) const KIND: Kind = Kind {
    name: "joint_lag",
    family: Family::Joint,
    sites: SiteKind::Joints,
    geometry_group: false,
    // Two visits to one pose come after different moves.
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Speed,
    sentence: "The joint stops short in proportion to its speed in the last move, in which all joints started and stopped together.",
    how_to_see: "The same poses, gone to straight from the row before, after moves in which this joint has the longest way and after moves in which another has; a slower speed.",
    sketch: ["  speed ╱╲   fast: short", "       ╱  ╲┄ of the goal", "  ────╱    ╲─ slow: there"],
    build: |setting: &Setting<'_>| {
        // As for play: as much is seen by eye at the end of an arm. A controller that feeds forward too much goes beyond the goal, so the sign is open.
        let lag = setting.displacement(("at_full_speed_deg", 0.1), ("at_full_speed_mm", 10.0))?;
        // A drive that follows a ramp stays behind in proportion to its slope (the velocity error of a type 1 servo; Franklin, Powell and Emami-Naeini 2015,
        // section 4.2), and viscous friction winds its gear up so. What of it friction holds at rest, or has not died away, is read.
        coordinate_change(setting, lag, |sample, joint| -sample.speed_fraction(joint))
    },
    candidates: |context| {
        let mut ids = context.every_joint("joint_lag");
        ids.retain(|id| id.joint().is_some_and(|joint| context.summary.went_at_many_speeds(joint)));
        ids
    },
};
