//! Whether the springs of an arm could carry it at all.

use super::super::drive::{AXES, Joint};
use super::check::Checker;
use super::raw::{self, Number};
use crate::physics::machine::Machine;

/// By how much a joint of an arm stretched out level may yield to the arm's own weight, deg: a real TeachMover yields by about one; much beyond this no equilibrium
/// is found in some poses, and arms go through the table.
const MOST_YIELDING_DEG: f64 = 10.0;

/// The least moment that is a weight and not the rounding of one, N m.
const LEAST_MOMENT: f64 = 1e-9;

impl Checker<'_> {
    /// The arm's own weight must not bend a joint further than a real one would let it. Not asked while other numbers are wrong.
    pub(super) fn require_firm(&self, machine: &Machine, raw: &raw::Droop) {
        if !self.typed.problems.is_empty() {
            return;
        }
        let moments = machine.stiff(&[0.0; AXES]).moments;
        let given = [
            (Joint::Shoulder, "shoulder", &raw.shoulder_deg_per_nm),
            (Joint::Elbow, "elbow", &raw.elbow_deg_per_nm),
            (Joint::WristPitch, "wrist_pitch", &raw.wrist_pitch_deg_per_nm),
        ];
        for (joint, name, give) in given {
            // A spring that the file leaves out has the size of a real one; moments are of all axes, these three among them.
            let (Some(give), Some(moment)) = (give, moments.get(joint.index()).map(|moment| moment.abs()))
            else {
                continue;
            };
            if moment > LEAST_MOMENT && give.value * moment > MOST_YIELDING_DEG {
                self.typed.wrong(give.span, &too_soft(name, give, moment));
            }
        }
    }
}

/// What is wrong with a spring under a moment, N m, and what would be right.
fn too_soft(name: &str, give: &Number, moment: f64) -> String {
    format!(
        "`{name}_deg_per_nm` is {}: stretched out level the arm's own weight, {moment:.2} N m, would bend that joint by {:.1} deg; give at most {:.2} deg/(N m), so \
         that it yields by no more than {MOST_YIELDING_DEG} deg (a TeachMover's cables yield by about 0.1 to 0.5 deg/(N m)), or less weight",
        give.value,
        give.value * moment,
        (100.0 * MOST_YIELDING_DEG / moment).floor() / 100.0
    )
}
