//! What a light stripe sees in a row: the points its pixels show, and how the numbers of its rig move them.

use nalgebra::Vector3;

use super::arm_pose::ArmPose;
use crate::arm_model::{RigNumber, StripeRig};
use crate::table::Stretch;

/// Where a ray that misses the sheet is taken to end, mm from the flange: so far off that no step of a fit that leads there is taken.
const MISSED: f64 = 1e5;

/// The step of a derivative, as a fraction of what is worth a hundredth of a millimetre: large beside rounding (1e-13 mm), small beside what bends.
const STEP: f64 = 1e-3;

/// The points of one stretch, and how they move.
#[derive(Default)]
pub(crate) struct Seen {
    /// Frame of the measurements, mm.
    pub(super) points: Vec<Vector3<f64>>,
    /// The same in the flange's frame.
    in_flange: Vec<Vector3<f64>>,
    /// How they move with a number of the rig, flange's frame, mm a unit of it.
    by_rig: Vec<(RigNumber, Vec<Vector3<f64>>)>,
    /// The rig with each number a little more, and the rig these are of: it is the same from row to row.
    nearby: [Option<StripeRig>; RigNumber::ALL.len()],
    nearby_of: Option<StripeRig>,
}

/// The point of the sheet that a pixel shows, flange's frame, mm.
fn in_flange(rig: &StripeRig, [u, v]: [f64; 2]) -> Vector3<f64> {
    // No step that leads there is taken, so that it may stay finite.
    rig.point(u, v).map_or_else(|| Vector3::repeat(MISSED), |point| point.coords)
}

impl Seen {
    /// Looks at a stretch; its mean point in the frame of the measurements and in the base's frame.
    pub(super) fn look(&mut self, stretch: Option<&Stretch>, pose: &ArmPose) -> (Vector3<f64>, Vector3<f64>) {
        self.points.clear();
        self.in_flange.clear();
        self.by_rig.clear();
        let (Some(stretch), Some(rig)) = (stretch, &pose.rig) else { return Default::default() };
        self.in_flange.extend(stretch.pixels.iter().map(|pixel| in_flange(rig, *pixel)));
        self.points.extend(self.in_flange.iter().map(|point| pose.at_flange(*point).0));
        pose.at_flange(self.in_flange.iter().sum::<Vector3<f64>>() / self.in_flange.len().max(1) as f64)
    }

    /// Works out how the points move with these numbers of the rig, by differences.
    pub(super) fn move_by(
        &mut self,
        numbers: impl Iterator<Item = RigNumber>,
        stretch: Option<&Stretch>,
        pose: &ArmPose,
    ) {
        let (Some(stretch), Some(rig)) = (stretch, &pose.rig) else { return };
        // The rig is the same in every row unless effects by epoch change it.
        if self.nearby_of.as_ref() != Some(rig) {
            self.nearby = Default::default();
            self.nearby_of = Some(rig.clone());
        }
        for number in numbers {
            if self.by_rig.iter().any(|(known, _)| *known == number) {
                continue;
            }
            let small = STEP * number.small();
            let more = self.nearby[number.index()].get_or_insert_with(|| rig.moved(number, small));
            // One-sided: the middle point is there already, so that a number costs one look and not two.
            let points = stretch.pixels.iter().zip(&self.in_flange);
            let moved = points.map(|(pixel, here)| (in_flange(more, *pixel) - here) / small);
            self.by_rig.push((number, moved.collect()));
        }
    }

    /// How the points move with a number of the rig, flange's frame.
    pub(super) fn moved(&self, number: RigNumber) -> &[Vector3<f64>] {
        self.by_rig.iter().find(|(known, _)| *known == number).map_or(&[], |(_, moved)| moved)
    }
}
