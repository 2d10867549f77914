//! A joint lags behind its motor by half its play, towards where it came from.

use super::coordinate_change::coordinate_change;
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};

pub(super) const KIND: Kind = Kind {
    name: "joint_backlash",
    family: Family::Joint,
    sites: SiteKind::Joints,
    geometry_group: false,
    // The same pose reached from the other side is off by the whole play.
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::WayOfArrival,
    sentence: "The joint has play: it stops short, towards where it came from.",
    how_to_see: "The same poses reached from both sides, with `approach_q<n>` 1 where the coordinate grew on the way and -1 where it fell; without that column the way from the row before counts.",
    sketch: ["   ┃╲ ╱┃   the tooth", "   ┃ ▼ ┃   lies left or", "   → ← gap  right"],
    build: |setting: &Setting<'_>| {
        // A joint with play stays behind. A controller that takes out more play than there is makes it go too far, so the sign is open.
        let play = setting.displacement(("play_deg", 0.1), ("play_mm", 10.0))?;
        // The motor drives the flank it came on: coming from below the joint stays half the play behind, from above half ahead
        // (Nordin and Gutman 2002, Controlling mechanical systems with backlash).
        coordinate_change(setting, play, |sample, joint| -0.5 * sample.side_or_way(joint))
    },
    candidates: |context| {
        let mut ids = context.every_joint("joint_backlash");
        ids.retain(|id| id.joint().is_some_and(|joint| context.summary.came_both_ways(joint)));
        ids
    },
};
