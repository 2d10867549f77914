//! A joint's zero was found anew between two stretches of rows.

use plumb_kinematics::DhParameter;

use super::epoch_steps::{EpochSteps, Step};
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Dof, Unit};
use crate::arm_model::Epochs;

/// Greatest plausible change of a zero, rad; mm of a slide.
const MOST_RAD: f64 = 0.35;
const MOST_MM: f64 = 20.0;

pub(super) const KIND: Kind = Kind {
    name: "joint_zero_reset",
    family: Family::Epoch,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: true,
    is_event: true,
    search: Search::Nothing,
    driven_by: DrivenBy::RowOrder,
    sentence: "The joint's zero changed at some row: it was found anew, or a coupling slipped.",
    how_to_see: "The same few poses again after every pause.",
    sketch: ["      ╭──╮   ╭── zero", "  ────╯  ╰───╯", "  found anew each time"],
    build: |setting: &Setting<'_>| {
        let joint = setting.joint()?;
        let row = setting.model.chain.joints.get(joint);
        // The row turns by it in the coordinate's sense.
        let rate = row.map_or(1.0, |row| row.sign);
        let (number, name, unit, most) = match setting.slides(joint) {
            false => (DhParameter::Theta, "deg", Unit::DEG, MOST_RAD),
            true => (DhParameter::D, "mm", Unit::MM, MOST_MM),
        };
        let step = Step { dof: Dof::Joint(joint, number), rate, name, unit, most };
        Ok(Box::new(EpochSteps::new(setting, vec![step], 1)?))
    },
    // One jump of one joint is `joint_step`.
    candidates: |context| match context.model.epochs {
        Some(Epochs::Rows(ref starts)) if starts.len() < 2 => Vec::new(),
        Some(Epochs::Times(ref starts)) if starts.len() < 2 => Vec::new(),
        None => Vec::new(),
        Some(_) => context.every_joint("joint_zero_reset"),
    },
};
