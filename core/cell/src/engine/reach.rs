//! Where the drive has to go so that the model's point comes to a position, by three of its joints: within their limits, and by the branch that is nearest.

use nalgebra::{DMatrix, DVector};
use plumb_calibration::prediction;
use plumb_plugin::JointVector;

use super::arm::{Arm, RequestedPoint};
use super::joint_index::JointIndex;
use crate::deg_or_mm::DegOrMm;
use crate::workcell::ModelFile;

/// As near to a point is there, mm.
const AT_POINT: f64 = 1e-6;

/// Steps toward a point from one start at most. A step that halves the distance needs 40 from 1 m.
const STEPS: usize = 80;

/// The longest step, in the scaled coordinates: 0.25 rad, within which the sine of a joint is a line to 1 %.
const LONGEST_STEP: f64 = 0.25;

/// How often a step that leads away is halved.
const HALVINGS: usize = 10;

/// A slide of this length counts as much as a turn of one radian, mm: what a turn moves at the end of an arm of that length.
const MM_PER_RADIAN: f64 = 200.0;

/// A little way of one joint, in the scaled coordinates.
const NUDGE: f64 = 1e-6;

/// Other starts for each joint, as shares of its range.
const STARTS: [f64; 3] = [0.2, 0.5, 0.8];

/// The three joints and what they may do.
struct Reach<'a> {
    arm: &'a Arm,
    model: &'a ModelFile,
    point: &'a RequestedPoint<'a>,
    requested: DVector<f64>,
    /// Where the arm is: it decides from which side the joints arrive.
    from: &'a JointVector,
    by: &'a [JointIndex],
    /// Radians, or millimetres, of one scaled coordinate, for each joint of `by`.
    scales: Vec<f64>,
    limits: Vec<(f64, f64)>,
}

/// What is left to the point, mm, and how it changes with the scaled coordinates.
type Looked = (DVector<f64>, DMatrix<f64>);

/// Where a search for the point ended.
struct Ended {
    target: JointVector,
    /// How far the point is from where it is wanted, mm.
    short: f64,
}

impl Arm {
    /// What the drive has to be commanded so that a point of the model comes to where it is wanted by its joints, the rest going from `from` to where
    /// `others` has them: by the whole model, with everything that was found and added to it, the side from which each joint will arrive and the load with
    /// it. Of several ways the one nearest to `others` is taken; none leaves a joint's limits.
    ///
    /// # Errors
    /// A sentence: out of reach, within the limits of a joint that it names, or there is no model.
    pub(crate) fn joints_for_point(
        &self,
        point: &RequestedPoint<'_>,
        from: &JointVector,
        others: &JointVector,
    ) -> Result<JointVector, String> {
        let by = point.by;
        let scale = |joint: &JointIndex| match self.unit(*joint) {
            DegOrMm::Deg => 1.0,
            DegOrMm::Mm => MM_PER_RADIAN,
        };
        let reach = Reach {
            arm: self,
            model: self.geometry()?,
            point,
            requested: DVector::from_column_slice(&point.xyz_mm),
            from,
            by,
            scales: by.iter().map(scale).collect(),
            limits: by.iter().map(|joint| self.limits(*joint)).collect(),
        };
        let near = reach.descend(others, true)?;
        let mut shortest = near.short;
        let mut refused = None;
        if near.short < AT_POINT {
            match reach.holds(&near.target) {
                Ok(()) => return Ok(near.target),
                Err(reason) => refused = Some(reason),
            }
        }
        for start in reach.other_starts(others)? {
            let ended = reach.descend(&start, true)?;
            if ended.short < AT_POINT {
                match reach.holds(&ended.target) {
                    Ok(()) => return Ok(ended.target),
                    Err(reason) => refused = refused.or(Some(reason)),
                }
            }
            shortest = shortest.min(ended.short);
        }
        match refused {
            Some(reason) => Err(format!("{} is not sent there: {reason}", self.name)),
            None => Err(reach.why_not(others, shortest)?),
        }
    }
}

impl Reach<'_> {
    /// Whether the model may be trusted there: one with corrections or a residual map holds only where it was measured.
    fn holds(&self, target: &JointVector) -> Result<(), String> {
        let sides = self.arm.sides_at(self.from, target);
        let pose = self.arm.model_pose(self.model, target, &sides, self.point.payload_kg);
        self.model.model.holds_at(&pose.q)
    }

    /// Goes towards the point from a start, within the limits if it is `bounded`.
    fn descend(&self, start: &JointVector, bounded: bool) -> Result<Ended, String> {
        let mut target = *start;
        if bounded {
            self.clamp(&mut target)?;
        }
        let (mut left, mut slope) = self.look(&target)?;
        for _ in 0..STEPS {
            let short = left.norm();
            if short < AT_POINT {
                break;
            }
            let mut step = self.step(&target, &left, &slope, bounded)?;
            let longest = step.amax();
            if longest > LONGEST_STEP {
                step *= LONGEST_STEP / longest;
            }
            let Some((better, looked)) = self.shortened(&target, &step, short, bounded)? else { break };
            target = better;
            (left, slope) = looked;
        }
        Ok(Ended { target, short: left.norm() })
    }

    /// The step, or a part of it, that leads nearer.
    fn shortened(
        &self,
        target: &JointVector,
        step: &DVector<f64>,
        short: f64,
        bounded: bool,
    ) -> Result<Option<(JointVector, Looked)>, String> {
        let mut fraction = 1.0;
        for _ in 0..HALVINGS {
            let mut there = *target;
            for ((joint, scale), by) in self.by.iter().zip(&self.scales).zip(step.iter()) {
                joint.set(&mut there, joint.value(target)? + fraction * by * scale)?;
            }
            if bounded {
                self.clamp(&mut there)?;
            }
            let looked = self.look(&there)?;
            if looked.0.norm() < short {
                return Ok(Some((there, looked)));
            }
            fraction *= 0.5;
        }
        Ok(None)
    }

    /// The step of least squares; a joint that is at its limit and would go further stays.
    fn step(
        &self,
        target: &JointVector,
        left: &DVector<f64>,
        slope: &DMatrix<f64>,
        bounded: bool,
    ) -> Result<DVector<f64>, String> {
        let mut held = vec![false; self.by.len()];
        loop {
            let mut free = slope.clone();
            for (column, _) in held.iter().enumerate().filter(|(_, held)| **held) {
                free.column_mut(column).fill(0.0);
            }
            let largest = free.amax().max(f64::MIN_POSITIVE);
            let step = free.svd(true, true).solve(left, 1e-9 * largest)?;
            match self.against_limit(target, &held, &step, bounded)? {
                Some(row) => held[row] = true,
                None => return Ok(step),
            }
        }
    }

    /// The first joint that is not held and would go further against its limit, by its row in `by`.
    fn against_limit(
        &self,
        target: &JointVector,
        held: &[bool],
        step: &DVector<f64>,
        bounded: bool,
    ) -> Result<Option<usize>, String> {
        if !bounded {
            return Ok(None);
        }
        let rows = self.by.iter().zip(&self.limits).zip(&self.scales).zip(held).zip(step.iter());
        for (row, ((((joint, (lower, upper)), scale), held), step)) in rows.enumerate() {
            let value = joint.value(target)?;
            let close = NUDGE * scale;
            let against = (*step < 0.0 && value <= lower + close) || (*step > 0.0 && value >= upper - close);
            if against && !held {
                return Ok(Some(row));
            }
        }
        Ok(None)
    }

    fn clamp(&self, target: &mut JointVector) -> Result<(), String> {
        for (joint, (lower, upper)) in self.by.iter().zip(&self.limits) {
            let value = joint.value(target)?;
            joint.set(target, value.max(*lower).min(*upper))?;
        }
        Ok(())
    }

    /// What is left to the point, mm, and how it changes with the scaled coordinates.
    fn look(&self, target: &JointVector) -> Result<Looked, String> {
        let sides = self.arm.sides_at(self.from, target);
        let mut tried = vec![*target];
        for (joint, scale) in self.by.iter().zip(&self.scales) {
            let mut nudged = *target;
            joint.set(&mut nudged, joint.value(target)? + NUDGE * scale)?;
            tried.push(nudged);
        }
        let poses: Vec<_> = tried
            .iter()
            .map(|drive| self.arm.model_pose(self.model, drive, &sides, self.point.payload_kg))
            .collect();
        let points = prediction::points(&self.model.model, self.point.target, &poses)
            .map_err(|error| error.to_string())?;
        let (here, nudged) = points.split_first().ok_or_else(|| "the model has no point".to_owned())?;
        let columns: Vec<DVector<f64>> = nudged
            .iter()
            .map(|there| DVector::from_column_slice((there - here).as_slice()) / NUDGE)
            .collect();
        Ok((&self.requested - DVector::from_column_slice(here.as_slice()), DMatrix::from_columns(&columns)))
    }

    /// Other positions to begin at, the nearest first: another branch leads from there.
    fn other_starts(&self, others: &JointVector) -> Result<Vec<JointVector>, String> {
        let mut starts = vec![*others];
        for (joint, limits) in self.by.iter().zip(&self.limits) {
            let mut more = Vec::new();
            for start in &starts {
                for fraction in STARTS {
                    let mut start = *start;
                    joint.set(&mut start, at_fraction(*limits, fraction))?;
                    more.push(start);
                }
            }
            starts = more;
        }
        let mut by_distance = Vec::new();
        for start in starts {
            by_distance.push((self.longest_way(others, &start)?, start));
        }
        by_distance.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(by_distance.into_iter().map(|(_, start)| start).collect())
    }

    /// The longest way of a joint from one position to another, in the scaled coordinates.
    fn longest_way(&self, from: &JointVector, to: &JointVector) -> Result<f64, String> {
        let mut longest = 0.0_f64;
        for (joint, scale) in self.by.iter().zip(&self.scales) {
            longest = longest.max((joint.value(to)? - joint.value(from)?).abs() / scale);
        }
        Ok(longest)
    }

    /// Which limit is in the way, if it is one; else how near it comes.
    fn why_not(&self, others: &JointVector, shortest: f64) -> Result<String, String> {
        let names: Vec<&str> = self.by.iter().map(|joint| self.arm.joint_name(*joint)).collect();
        let names = names.join(", ");
        let name = &self.arm.name;
        let near = format!(
            "{name} cannot bring its point there with {names} within their limits: it comes no nearer than {shortest:.2} mm"
        );
        let Ok(free) = self.descend(others, false) else { return Ok(near) };
        if free.short >= AT_POINT {
            return Ok(near);
        }
        for (joint, (lower, upper)) in self.by.iter().zip(&self.limits) {
            let value = joint.value(&free.target)?;
            if (*lower..=*upper).contains(&value) {
                continue;
            }
            let unit = self.arm.unit(*joint);
            let shown = |value: f64| unit.from_internal(value + self.arm.zero(*joint));
            return Ok(format!(
                "{near}. {} would have to go to {:.3} {unit}; it goes from {:.3} to {:.3} {unit}",
                self.arm.joint_name(*joint),
                shown(value),
                shown(*lower),
                shown(*upper),
                unit = unit.symbol()
            ));
        }
        Ok(near)
    }
}

/// A fraction of a range; of one without an end, of a turn either way about 0.
fn at_fraction((lower, upper): (f64, f64), fraction: f64) -> f64 {
    let lower = if lower.is_finite() { lower } else { -std::f64::consts::PI };
    let upper = if upper.is_finite() { upper } else { std::f64::consts::PI };
    lower + fraction * (upper - lower)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::test_arm::{CELL, MODEL, arm, arm_with, drive};

    /// Where the point is: by the geometry, not by the model.
    fn point([shoulder, elbow, quill, _]: [f64; 4]) -> [f64; 3] {
        let (first, both) = (shoulder.to_radians(), (shoulder + elbow).to_radians());
        [
            225.0 * first.cos() + 175.0 * both.cos(),
            225.0 * first.sin() + 175.0 * both.sin(),
            320.0 - quill - 30.0,
        ]
    }

    fn found(from: [f64; 4], requested: [f64; 3]) -> Result<[f64; 4], String> {
        let here = drive(from);
        let arm = arm();
        let by = ["shoulder", "elbow", "quill"].map(|joint| arm.joint(joint).unwrap());
        let point = RequestedPoint { xyz_mm: requested, target: None, by: &by, payload_kg: 0.0 };
        let target = arm.joints_for_point(&point, &here, &here)?;
        let value = |column: usize| target.get(column).unwrap();
        Ok([value(0).to_degrees(), value(1).to_degrees(), value(2), value(3).to_degrees()])
    }

    fn assert_there(from: [f64; 4], requested: [f64; 3]) -> [f64; 4] {
        let target = found(from, requested).unwrap();
        let there = point(target);
        for (axis, requested) in there.iter().zip(requested) {
            assert!((axis - requested).abs() < 1e-5, "{target:?} is at {there:?}, not at {requested:?}");
        }
        // The last bit may change where degrees become radians and back.
        assert!((target[3] - from[3]).abs() < 1e-12, "what takes no part stays: {target:?}");
        target
    }

    #[test]
    fn corrections_and_residual_maps_command_only_where_was_measured() {
        let region = "measured_region: {ranges: {shoulder: [0, 60], elbow: [10, 80], quill: [0, 100], spin: [-180, 180]}, reach: 9, poses: [[30, 40, 50, 0]]}\n";
        let map = "residual_map: {not_understood: 0.5, along: [{joint: elbow, weights: [0.2]}, {joint: quill, weights: [1.5]}]}\n";
        let correction = "effects: [{effect: joint_gain, where: shoulder, values: {gain: 0.001}, claim: correction, may_be: []}]\n";
        for (more, sentence) in [
            (map, "the residual map of the model holds"),
            (correction, "the correction joint_gain(shoulder) of the model holds"),
        ] {
            let arm = arm_with(CELL, &format!("{MODEL}{region}{more}"));
            let by = ["shoulder", "elbow", "quill"].map(|joint| arm.joint(joint).unwrap());
            let here = drive([30.0, 40.0, 50.0, 0.0]);
            let sent = |requested: [f64; 3]| {
                let point = RequestedPoint { xyz_mm: requested, target: None, by: &by, payload_kg: 0.0 };
                arm.joints_for_point(&point, &here, &here)
            };
            let inside = point([35.0, 45.0, 60.0, 0.0]);
            let target = sent(inside).unwrap();
            let commanded = [0, 1].map(|joint| target.get(joint).unwrap().to_degrees());
            let reached = point([commanded[0], commanded[1], target.get(2).unwrap(), 0.0]);
            let moved: f64 =
                reached.iter().zip(inside).map(|(there, requested)| (there - requested).powi(2)).sum();
            assert!(
                moved.sqrt() > 0.05,
                "the drive is commanded otherwise than by the plain geometry: {commanded:?}"
            );
            let refused = sent(point([35.0, 45.0, 140.0, 0.0])).unwrap_err();
            assert!(
                refused.contains("quill would be at 140.000 mm, and was measured from 0.000 to 100.000 mm")
                    && refused.contains(sentence),
                "{refused}"
            );
        }
    }

    #[test]
    fn a_slide_goes_as_far_as_it_has_to() {
        let target = assert_there([20.0, 30.0, 10.0, 15.0], point([35.0, 40.0, 170.0, 0.0]));
        assert!((target[2] - 170.0).abs() < 1e-5, "{target:?}");
    }

    #[test]
    fn the_other_elbow_is_taken_where_a_limit_is_in_the_way_of_the_near_one() {
        // With the elbow to the left the shoulder would have to go to 140 deg.
        let requested = {
            let reach =
                f64::hypot(225.0 + 175.0 * 60.0_f64.to_radians().cos(), 175.0 * 60.0_f64.to_radians().sin());
            let turned =
                (175.0 * 60.0_f64.to_radians().sin()).atan2(225.0 + 175.0 * 60.0_f64.to_radians().cos());
            let direction = -140.0_f64.to_radians() + turned;
            [reach * direction.cos(), reach * direction.sin(), 250.0]
        };
        let target = assert_there([-120.0, 60.0, 40.0, 0.0], requested);
        assert!(target[1] < 0.0, "the other elbow: {target:?}");
        assert!(target[0].abs() <= 130.0 + 1e-9, "{target:?}");
    }

    #[test]
    fn a_limit_that_is_in_the_way_of_every_branch_is_named() {
        let message = found([20.0, 30.0, 10.0, 0.0], point([20.0, 30.0, 200.0, 0.0])).unwrap_err();
        assert!(message.contains("comes no nearer than 20.00 mm"), "{message}");
        assert!(
            message.contains("quill would have to go to 200.000 mm; it goes from 0.000 to 180.000 mm"),
            "{message}"
        );
    }

    #[test]
    fn what_is_out_of_reach_altogether_says_how_near_it_comes() {
        let message = found([20.0, 30.0, 10.0, 0.0], [500.0, 0.0, 250.0]).unwrap_err();
        assert!(message.contains("comes no nearer than 100.0"), "{message}");
        assert!(!message.contains("would have to go"), "{message}");
    }

    #[test]
    fn points_all_over_the_reach_are_found_from_any_start() {
        for shoulder in [-100.0, -20.0, 80.0] {
            for elbow in [-120.0, 40.0, 100.0] {
                for quill in [5.0, 175.0] {
                    let requested = point([shoulder, elbow, quill, 0.0]);
                    for from in [[0.0, 1.0, 0.0, 0.0], [120.0, -140.0, 180.0, 0.0], [-120.0, 60.0, 90.0, 0.0]]
                    {
                        assert_there(from, requested);
                    }
                }
            }
        }
    }

    /// Does something with the shoulder, the elbow and the slide of an arm that is to bring its point to a position.
    fn with_reach<R>(xyz_mm: [f64; 3], act: impl FnOnce(&Reach<'_>) -> R) -> R {
        let (arm, from) = (arm(), drive([0.0; 4]));
        let by = ["shoulder", "elbow", "quill"].map(|joint| arm.joint(joint).unwrap());
        let point = RequestedPoint { xyz_mm, target: None, by: &by, payload_kg: 0.0 };
        act(&Reach {
            arm: &arm,
            model: arm.geometry().unwrap(),
            point: &point,
            requested: DVector::from_column_slice(&xyz_mm),
            from: &from,
            by: &by,
            scales: vec![1.0, 1.0, MM_PER_RADIAN],
            limits: by.iter().map(|joint| arm.limits(*joint)).collect(),
        })
    }

    #[test]
    fn a_joint_at_its_limit_is_held_where_it_would_go_further() {
        with_reach([300.0, 0.0, 200.0], |reach| {
            let against = |at: [f64; 3], step: [f64; 3], held: [bool; 3], bounded: bool| {
                let target = drive([at[0], at[1], at[2], 0.0]);
                let step = DVector::from_column_slice(&step);
                reach.against_limit(&target, &held, &step, bounded).unwrap()
            };
            let free = [false; 3];
            assert_eq!(against([0.0, 0.0, 50.0], [1.0, -1.0, 1.0], free, true), None);
            assert_eq!(against([130.0, 0.0, 50.0], [1.0, 0.0, 0.0], free, true), Some(0));
            assert_eq!(
                against([130.0, 0.0, 50.0], [-1.0, 0.0, 0.0], free, true),
                None,
                "it goes away from it"
            );
            assert_eq!(against([130.0, 0.0, 50.0], [0.0, 0.0, 0.0], free, true), None, "it stays");
            assert_eq!(against([-130.0, 0.0, 50.0], [-1.0, 0.0, 0.0], free, true), Some(0));
            assert_eq!(against([-130.0, 0.0, 50.0], [1.0, 0.0, 0.0], free, true), None);
            assert_eq!(
                against([130.0, 0.0, 50.0], [1.0, 0.0, 0.0], [true, false, false], true),
                None,
                "it is held"
            );
            assert_eq!(against([130.0, 0.0, 50.0], [1.0, 0.0, 0.0], free, false), None, "nothing bounds it");
            assert_eq!(against([130.0, 0.0, 0.0], [1.0, 0.0, -1.0], [true, false, false], true), Some(2));
            // A nudge before its limit, 1e-6 of its scale, a joint counts as at it.
            let near = |by: f64| against([0.0, 0.0, 180.0 - by], [0.0, 0.0, 1.0], free, true);
            assert_eq!((near(1e-4), near(3e-4)), (Some(2), None));
            let near = |by: f64| against([0.0, 0.0, by], [0.0, 0.0, -1.0], free, true);
            assert_eq!((near(1e-4), near(3e-4)), (Some(2), None));
        });
    }

    #[test]
    fn what_is_beyond_a_limit_is_brought_to_it() {
        with_reach([300.0, 0.0, 200.0], |reach| {
            let mut target = drive([150.0, -150.0, 190.0, 15.0]);
            reach.clamp(&mut target).unwrap();
            let expected = drive([130.0, -145.0, 180.0, 15.0]);
            for (found, expected) in target.as_slice().iter().zip(expected.as_slice()) {
                assert!((found - expected).abs() < 1e-12, "{target:?}");
            }
        });
    }

    #[test]
    fn what_is_left_to_the_point_and_how_it_changes_is_that_of_the_geometry() {
        let (here, requested) = ([20.0, 30.0, 40.0, 0.0], [300.0, 100.0, 200.0]);
        with_reach(requested, |reach| {
            let (left, slope) = reach.look(&drive(here)).unwrap();
            let there = point(here);
            for axis in 0..3 {
                assert!((left[axis] - (requested[axis] - there[axis])).abs() < 1e-9, "{left}");
            }
            // The shoulder turns the point about the base, the elbow about the elbow, the slide lowers it, 200 mm for one.
            let (x, y) = (there[0], there[1]);
            let elbow = (225.0 * 20.0_f64.to_radians().cos(), 225.0 * 20.0_f64.to_radians().sin());
            let expected = [[-y, x, 0.0], [elbow.1 - y, x - elbow.0, 0.0], [0.0, 0.0, -MM_PER_RADIAN]];
            for (column, expected) in expected.iter().enumerate() {
                for (axis, expected) in expected.iter().enumerate() {
                    assert!((slope[(axis, column)] - expected).abs() < 1e-3, "{slope}");
                }
            }
        });
    }

    #[test]
    fn other_starts_are_every_mixture_of_shares_of_the_ranges_the_nearest_first() {
        let others = drive([0.0, 0.0, 90.0, 25.0]);
        with_reach([300.0, 0.0, 200.0], |reach| {
            let starts = reach.other_starts(&others).unwrap();
            assert_eq!(starts.len(), 27);
            let ways: Vec<f64> =
                starts.iter().map(|start| reach.longest_way(&others, start).unwrap()).collect();
            assert!(ways.is_sorted(), "{ways:?}");
            let first = starts[0].as_slice();
            assert!(
                first[0].abs() < 1e-9 && first[1].abs() < 1e-9 && (first[2] - 90.0).abs() < 1e-9,
                "{first:?}"
            );
            // The elbow's 0.2 to 0.8 of 290 degrees are 87 degrees away.
            assert!((ways[26] - 87.0_f64.to_radians()).abs() < 1e-9, "{ways:?}");
            assert!(starts.iter().all(|start| (start.as_slice()[3] - 25.0_f64.to_radians()).abs() < 1e-12));
            let way = reach.longest_way(&others, &drive([0.0, 0.0, 10.0, 0.0])).unwrap();
            assert!(
                (way - 80.0 / MM_PER_RADIAN).abs() < 1e-12,
                "a slide of 200 mm counts as one radian: {way}"
            );
        });
    }

    #[test]
    fn a_share_of_a_range_without_an_end_is_one_of_half_a_turn_either_way() {
        assert_eq!(at_fraction((-2.0, 6.0), 0.25), 0.0);
        let turn = std::f64::consts::PI;
        assert!((at_fraction((f64::NEG_INFINITY, f64::INFINITY), 0.75) - 0.5 * turn).abs() < 1e-12);
        assert!((at_fraction((f64::NEG_INFINITY, 0.0), 0.5) + 0.5 * turn).abs() < 1e-12);
        assert!((at_fraction((0.0, f64::INFINITY), 0.5) - 0.5 * turn).abs() < 1e-12);
    }
}
