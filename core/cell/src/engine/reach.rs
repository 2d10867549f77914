//! Where the drive has to go so that the model's point comes to a place, by three of its joints: within their limits, and by the branch that is nearest.

use nalgebra::{DMatrix, DVector};
use plumb_model::prediction;
use plumb_plugin::JointVector;

use super::arm::{Arm, WantedPoint};
use crate::read_context::DegOrMm;
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
    point: &'a WantedPoint<'a>,
    wanted: DVector<f64>,
    /// Where the arm stands: it decides from which side the joints arrive.
    from: &'a JointVector,
    by: &'a [usize],
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
    /// What the drive has to be told so that a point of the model comes to where it is wanted by its joints, the rest going from `from` to where
    /// `others` has them: by the whole model, with everything that was found and added to it, the side from which each joint will arrive and the load with
    /// it. Of several ways the one nearest to `others` is taken; none leaves a joint's limits.
    ///
    /// # Errors
    /// A sentence: out of reach, within the limits of a joint that it names, or there is no model.
    pub(crate) fn joints_for_point(
        &self,
        point: &WantedPoint<'_>,
        from: &JointVector,
        others: &JointVector,
    ) -> Result<JointVector, String> {
        let by = point.by;
        let scale = |column: &usize| match self.unit(*column) {
            DegOrMm::Deg => 1.0,
            DegOrMm::Mm => MM_PER_RADIAN,
        };
        let reach = Reach {
            arm: self,
            model: self.geometry()?,
            point,
            wanted: DVector::from_column_slice(&point.xyz_mm),
            from,
            by,
            scales: by.iter().map(scale).collect(),
            limits: by.iter().map(|column| self.limits(*column)).collect(),
        };
        let near = reach.descend(others, true)?;
        if near.short < AT_POINT {
            return Ok(near.target);
        }
        let mut shortest = near.short;
        for start in reach.other_starts(others) {
            let ended = reach.descend(&start, true)?;
            if ended.short < AT_POINT {
                return Ok(ended.target);
            }
            shortest = shortest.min(ended.short);
        }
        Err(reach.why_not(others, shortest))
    }
}

impl Reach<'_> {
    /// Goes towards the point from a start, within the limits if it is `bounded`.
    fn descend(&self, start: &JointVector, bounded: bool) -> Result<Ended, String> {
        let mut target = *start;
        if bounded {
            self.clamp(&mut target);
        }
        let (mut left, mut slope) = self.look(&target)?;
        for _ in 0..STEPS {
            let short = left.norm();
            if short < AT_POINT {
                break;
            }
            let mut step = self.step(&target, &left, &slope, bounded);
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
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            let mut there = *target;
            for ((column, scale), by) in self.by.iter().zip(&self.scales).zip(step.iter()) {
                there.set(*column, there.get(*column).unwrap_or(0.0) + share * by * scale);
            }
            if bounded {
                self.clamp(&mut there);
            }
            let looked = self.look(&there)?;
            if looked.0.norm() < short {
                return Ok(Some((there, looked)));
            }
            share *= 0.5;
        }
        Ok(None)
    }

    /// The step of least squares; a joint that stands at its limit and would go further stays.
    fn step(
        &self,
        target: &JointVector,
        left: &DVector<f64>,
        slope: &DMatrix<f64>,
        bounded: bool,
    ) -> DVector<f64> {
        let mut held = vec![false; self.by.len()];
        loop {
            let mut free = slope.clone();
            for (column, _) in held.iter().enumerate().filter(|(_, held)| **held) {
                free.column_mut(column).fill(0.0);
            }
            let largest = free.amax().max(f64::MIN_POSITIVE);
            let step = free.svd(true, true).solve(left, 1e-9 * largest);
            let step = step.unwrap_or_else(|_| DVector::zeros(self.by.len()));
            let against = |place: &usize| bounded && self.is_at_limit(target, *place, step[*place]);
            match (0..self.by.len()).find(|place| !held[*place] && against(place)) {
                Some(place) => held[place] = true,
                None => return step,
            }
        }
    }

    fn is_at_limit(&self, target: &JointVector, place: usize, step: f64) -> bool {
        let Some(((column, (lower, upper)), scale)) =
            self.by.get(place).zip(self.limits.get(place)).zip(self.scales.get(place))
        else {
            return false;
        };
        let value = target.get(*column).unwrap_or(0.0);
        let close = NUDGE * scale;
        (step < 0.0 && value <= lower + close) || (step > 0.0 && value >= upper - close)
    }

    fn clamp(&self, target: &mut JointVector) {
        for (column, (lower, upper)) in self.by.iter().zip(&self.limits) {
            let value = target.get(*column).unwrap_or(0.0);
            target.set(*column, value.max(*lower).min(*upper));
        }
    }

    /// What is left to the point, mm, and how it changes with the scaled coordinates.
    fn look(&self, target: &JointVector) -> Result<Looked, String> {
        let sides = self.arm.sides_at(self.from, target);
        let mut tried = vec![*target];
        for (column, scale) in self.by.iter().zip(&self.scales) {
            let mut nudged = *target;
            nudged.set(*column, target.get(*column).unwrap_or(0.0) + NUDGE * scale);
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
        Ok((&self.wanted - DVector::from_column_slice(here.as_slice()), DMatrix::from_columns(&columns)))
    }

    /// Other places to begin at, the nearest first: another branch leads from there.
    fn other_starts(&self, others: &JointVector) -> Vec<JointVector> {
        let mut starts = vec![*others];
        for (column, limits) in self.by.iter().zip(&self.limits) {
            let places: Vec<f64> = STARTS.iter().map(|share| at_share(*limits, *share)).collect();
            let with = |start: &JointVector, place: &f64| {
                let mut start = *start;
                start.set(*column, *place);
                start
            };
            starts = starts
                .iter()
                .flat_map(|start| places.iter().map(|place| with(start, place)).collect::<Vec<_>>())
                .collect();
        }
        starts.sort_by(|a, b| self.way(others, a).total_cmp(&self.way(others, b)));
        starts
    }

    /// The longest way of a joint from one place to another, in the scaled coordinates.
    fn way(&self, from: &JointVector, to: &JointVector) -> f64 {
        let ways = self.by.iter().zip(&self.scales).map(|(column, scale)| {
            (to.get(*column).unwrap_or(0.0) - from.get(*column).unwrap_or(0.0)).abs() / scale
        });
        ways.fold(0.0, f64::max)
    }

    /// Which limit is in the way, if it is one; else how near it comes.
    fn why_not(&self, others: &JointVector, shortest: f64) -> String {
        let names: Vec<&str> = self.by.iter().map(|column| self.arm.joint_name(*column)).collect();
        let names = names.join(", ");
        let name = &self.arm.name;
        let near = format!(
            "{name} cannot bring its point there with {names} within their limits: it comes no nearer than {shortest:.2} mm"
        );
        let Ok(free) = self.descend(others, false) else { return near };
        if free.short >= AT_POINT {
            return near;
        }
        let beyond = self.by.iter().zip(&self.limits).find_map(|(column, (lower, upper))| {
            let value = free.target.get(*column).unwrap_or(0.0);
            let unit = self.arm.unit(*column);
            let shown = |value: f64| unit.from_internal(value + self.arm.zero(*column));
            (value < *lower || value > *upper).then(|| {
                format!(
                    "{} would have to go to {:.3} {unit}; it goes from {:.3} to {:.3} {unit}",
                    self.arm.joint_name(*column),
                    shown(value),
                    shown(*lower),
                    shown(*upper),
                    unit = unit.symbol()
                )
            })
        });
        match beyond {
            Some(beyond) => format!("{near}. {beyond}"),
            None => near,
        }
    }
}

/// A share of a range; of one without an end, of a turn either way about 0.
fn at_share((lower, upper): (f64, f64), share: f64) -> f64 {
    let lower = if lower.is_finite() { lower } else { -std::f64::consts::PI };
    let upper = if upper.is_finite() { upper } else { std::f64::consts::PI };
    lower + share * (upper - lower)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use plumb_plugin::{
        JogState, JointDescription, JointState, JointUnit, Motion, RobotCapabilities, RobotDescription,
    };

    use super::*;
    use crate::device::{DeviceError, RobotLink};
    use crate::expression::Calculator;
    use crate::run_handle::StopAction;
    use crate::workcell::load_workcell;

    /// Two turns, a slide straight down, a turn of the hand.
    const MODEL: &str = "arm: quill
convention: distal
joints:
  - {name: shoulder, a_mm: 225, alpha_deg: 0, d_mm: 320, theta_deg: 0, limits_deg: [-130, 130]}
  - {name: elbow, a_mm: 175, alpha_deg: 180, d_mm: 0, theta_deg: 0, limits_deg: [-145, 145]}
  - {name: quill, a_mm: 0, alpha_deg: 0, d_mm: 0, theta_deg: 0, slides: true, limits_mm: [0, 180]}
  - {name: spin, a_mm: 0, alpha_deg: 0, d_mm: 0, theta_deg: 0, limits_deg: [-180, 180]}
targets: {p1: {xyz_mm: [0, 0, 30], free: true}}
free: [joint_zero(*)]
measured_from: world
";

    const CELL: &str = "cell: quill
devices:
  arm: {plugin: simulated}
robots:
  arm: {joints: {shoulder: deg, elbow: deg, quill: mm, spin: deg}, model: model.yaml}
procedures: []
";

    struct Still(RobotDescription);

    impl RobotLink for Still {
        fn description(&self) -> &RobotDescription {
            &self.0
        }
        fn activate(&mut self) -> Result<(), DeviceError> {
            Ok(())
        }
        fn deactivate(&mut self) -> Result<(), DeviceError> {
            Ok(())
        }
        fn read_joints(&mut self) -> Result<JointState, DeviceError> {
            Ok(JointState::default())
        }
        fn move_joints(&mut self, _motion: &Motion, _limit: Duration) -> Result<JointState, DeviceError> {
            Ok(JointState::default())
        }
        fn jog(&mut self, _on: bool) -> Result<JogState, DeviceError> {
            Ok(JogState::default())
        }
        fn stop_action(&self) -> StopAction {
            Box::new(|| ())
        }
    }

    fn arm() -> Arm {
        let place = tempfile::tempdir().unwrap();
        std::fs::write(place.path().join("model.yaml"), MODEL).unwrap();
        std::fs::write(place.path().join("cell.yaml"), CELL).unwrap();
        let cell = load_workcell(&place.path().join("cell.yaml"), &Calculator::new());
        let cell = cell.unwrap_or_else(|problems| {
            panic!("{}", problems.iter().map(ToString::to_string).collect::<String>())
        });
        let joint = |name: &str, unit, lower: f64, upper: f64| JointDescription {
            name: name.to_owned(),
            unit,
            lower,
            upper,
            resolution: 0.0,
            max_speed: 1.0,
            home: 0.0,
        };
        let turn =
            |name: &str, most: f64| joint(name, JointUnit::Radian, -most.to_radians(), most.to_radians());
        let description = RobotDescription {
            model: "quill".to_owned(),
            joints: vec![
                turn("shoulder", 130.0),
                turn("elbow", 145.0),
                joint("quill", JointUnit::Millimetre, 0.0, 180.0),
                turn("spin", 180.0),
            ],
            inputs: Vec::new(),
            outputs: Vec::new(),
            capabilities: RobotCapabilities::default(),
        };
        Arm::new(Box::new(Still(description)), "quill", cell.robot("arm").unwrap(), None).unwrap()
    }

    fn drive(values: [f64; 4]) -> JointVector {
        let [shoulder, elbow, quill, spin] = values;
        JointVector::from_slice(&[shoulder.to_radians(), elbow.to_radians(), quill, spin.to_radians()])
            .unwrap()
    }

    /// Where the point is: by the geometry, not by the model.
    fn point([shoulder, elbow, quill, _]: [f64; 4]) -> [f64; 3] {
        let (first, both) = (shoulder.to_radians(), (shoulder + elbow).to_radians());
        [
            225.0 * first.cos() + 175.0 * both.cos(),
            225.0 * first.sin() + 175.0 * both.sin(),
            320.0 - quill - 30.0,
        ]
    }

    fn found(from: [f64; 4], wanted: [f64; 3]) -> Result<[f64; 4], String> {
        let here = drive(from);
        let point = WantedPoint { xyz_mm: wanted, target: None, by: &[0, 1, 2], payload_kg: 0.0 };
        let target = arm().joints_for_point(&point, &here, &here)?;
        let value = |column: usize| target.get(column).unwrap();
        Ok([value(0).to_degrees(), value(1).to_degrees(), value(2), value(3).to_degrees()])
    }

    fn assert_there(from: [f64; 4], wanted: [f64; 3]) -> [f64; 4] {
        let target = found(from, wanted).unwrap();
        let there = point(target);
        for (axis, wanted) in there.iter().zip(wanted) {
            assert!((axis - wanted).abs() < 1e-5, "{target:?} is at {there:?}, not at {wanted:?}");
        }
        // The last bit may change where degrees become radians and back.
        assert!((target[3] - from[3]).abs() < 1e-12, "what takes no part stays: {target:?}");
        target
    }

    #[test]
    fn a_slide_goes_as_far_as_it_has_to() {
        let target = assert_there([20.0, 30.0, 10.0, 15.0], point([35.0, 40.0, 170.0, 0.0]));
        assert!((target[2] - 170.0).abs() < 1e-5, "{target:?}");
    }

    #[test]
    fn the_other_elbow_is_taken_where_a_limit_is_in_the_way_of_the_near_one() {
        // With the elbow to the left the shoulder would have to go to 140 deg.
        let wanted = {
            let reach =
                f64::hypot(225.0 + 175.0 * 60.0_f64.to_radians().cos(), 175.0 * 60.0_f64.to_radians().sin());
            let turned =
                (175.0 * 60.0_f64.to_radians().sin()).atan2(225.0 + 175.0 * 60.0_f64.to_radians().cos());
            let direction = -140.0_f64.to_radians() + turned;
            [reach * direction.cos(), reach * direction.sin(), 250.0]
        };
        let target = assert_there([-120.0, 60.0, 40.0, 0.0], wanted);
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
    fn places_all_over_the_reach_are_found_from_any_start() {
        for shoulder in [-100.0, -20.0, 80.0] {
            for elbow in [-120.0, 40.0, 100.0] {
                for quill in [5.0, 175.0] {
                    let wanted = point([shoulder, elbow, quill, 0.0]);
                    for from in [[0.0, 1.0, 0.0, 0.0], [120.0, -140.0, 180.0, 0.0], [-120.0, 60.0, 90.0, 0.0]]
                    {
                        assert_there(from, wanted);
                    }
                }
            }
        }
    }
}
