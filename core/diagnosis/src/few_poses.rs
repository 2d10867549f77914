//! Few poses measured often, as along an axis after ISO 230-2: no pose can be left out, and what goes with the pose may be anything. The classic test of lack of fit
//! (variance between poses against variance within: Draper & Smith 1998, section 2.1) says whether the pose matters; conditions are then asked about beside an error
//! of each pose's own.

use nalgebra::Vector3;

use crate::cross_validation::pose_groups;
use crate::fitted::Fitted;
use crate::found::Found;
use crate::laboratory::{Laboratory, LaboratoryError, StandardErrors};
use crate::outcome::{
    AcrossPoses, ConditionAtPoses, Diagnosis, FewPoses, Named, PoseFraction, Rest, Verdict,
};
use crate::pose_to_pose::{FromPoseToPose, point_residual};
use crate::thresholds::{FEW_POSES, FEW_POSES_RETURNS, LACK_OF_FIT_LEVEL};
use crate::verdict::effect_site;
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::{self, EffectId, Site};
use plumb_estimation::{Progress, f_tail};

impl PoseFraction {
    /// Of what a fit leaves in groups of rows that fraction a pose: points' residuals, mm.
    fn of(groups: &[Vec<Vector3<f64>>], axes: usize, parameters: usize) -> Option<Self> {
        let rows: usize = groups.iter().map(Vec::len).sum();
        let (mut between, mut within) = (0.0, 0.0);
        for group in groups {
            let mean = group.iter().sum::<Vector3<f64>>() / group.len().max(1) as f64;
            // The fit has taken the mean over all poses out: squares between poses are about zero.
            between += group.len() as f64 * mean.norm_squared();
            within += group.iter().map(|point| (point - mean).norm_squared()).sum::<f64>();
        }
        // One mean a pose and axis, less what was fitted to them.
        let above = (axes * groups.len()).checked_sub(parameters).filter(|freedom| *freedom > 0)? as f64;
        let below = (axes * rows.checked_sub(groups.len()).filter(|freedom| *freedom > 0)?) as f64;
        let ratio = (between / above) / (within / below).max(1e-300);
        Some(Self {
            fraction: between / (between + within).max(1e-300),
            p: f_tail(ratio, above, below),
            poses: groups.len(),
        })
    }

    /// Whether the pose matters.
    pub(crate) fn is_significant(&self) -> bool {
        self.p < LACK_OF_FIT_LEVEL
    }
}

impl Laboratory {
    /// Fitted rows by pose, where the poses are few and each was measured often.
    fn few_poses(&self) -> Option<Vec<Vec<usize>>> {
        let groups = pose_groups(self.table(), &self.measured_rows());
        let often = groups.iter().all(|rows| rows.len() >= FEW_POSES_RETURNS);
        (groups.len() > 1 && groups.len() < FEW_POSES && often).then_some(groups)
    }

    /// How much of what is left goes with the pose alone; nothing where poses are many, or were not measured often.
    fn pose_fraction(&self, fitted: &Fitted<'_>) -> Option<PoseFraction> {
        let mut measured = [false; 3];
        let mut point = |row: &usize| point_residual(fitted, *row, &mut measured);
        let groups = self.few_poses()?;
        let groups: Vec<Vec<Vector3<f64>>> =
            groups.iter().map(|rows| rows.iter().map(&mut point).collect()).collect();
        PoseFraction::of(&groups, measured.iter().filter(|axis| **axis).count().max(1), fitted.fit.rank())
    }

    /// The same with an error of its own for every pose.
    fn beside_pose_errors(&self, groups: &[Vec<usize>]) -> Self {
        let mut model = self.model().clone();
        let poses = groups.iter().filter_map(|rows| rows.first());
        model.pose_errors = poses.map(|row| self.table().q_of(*row).to_vec()).collect();
        self.with_model(model)
    }

    /// Where nothing is named, poses are few and were measured often, and what is left goes with the pose: the diagnosis of the conditions beside an error of each
    /// pose's own; else what was found already.
    pub(crate) fn ask_beside_poses(
        &self,
        (mut diagnosis, mut found): (Diagnosis, Found),
        progress: &Progress,
    ) -> Result<(Diagnosis, Found), LaboratoryError> {
        let unnamed = diagnosis.verdict.is_unnamed();
        let Some(groups) = self.few_poses().filter(|_| unnamed && self.model().pose_errors.is_empty()) else {
            return Ok((diagnosis, found));
        };
        let fitted = self.fit_with(&[], None, progress)?;
        let Some(fraction) = self.pose_fraction(&fitted).filter(PoseFraction::is_significant) else {
            return Ok((diagnosis, found));
        };
        let beside = self.beside_pose_errors(&groups);
        let (asked, conditions) = beside.diagnose_for(progress)?;
        let Some((effect, sized)) = beside.condition(conditions, progress)? else {
            diagnosis.remaining.covariates.insert(0, "pose".to_owned());
            diagnosis.remaining.shape = Some(Rest::PoseAlone(fraction));
            diagnosis.few_poses =
                Some(FewPoses { fraction, condition: None, curve: self.curve_of_the_axis() });
            return Ok((diagnosis, found));
        };
        let spread = beside.judged_from_pose_to_pose(
            &groups,
            (&effect, &sized),
            (&asked.floor, &asked.candidates),
            progress,
        )?;
        let (verdict, across) = match spread {
            FromPoseToPose::Same => (Verdict::Named, AcrossPoses::Same),
            FromPoseToPose::Differs { scatter_mm, .. } => {
                (Verdict::Named, AcrossPoses::Differs { scatter_mm })
            }
            FromPoseToPose::Tied { scatter_mm, .. } => (Verdict::Tied, AcrossPoses::Tied { scatter_mm }),
        };
        let condition = ConditionAtPoses { label: self.model().label(&effect.id), across };
        let few_poses = FewPoses { fraction, condition: Some(condition), curve: self.curve_of_the_axis() };
        let (sized, tied) = spread.of(sized);
        found.named = sized.is_some().then_some(effect);
        // What is left is said of the model itself, not of what was beside it to ask.
        let named = Diagnosis {
            verdict,
            named: sized,
            tied,
            few_poses: Some(few_poses),
            judged_mm: diagnosis.judged_mm,
            rms_mm: diagnosis.rms_mm,
            error_mm: diagnosis.error_mm,
            warnings: diagnosis.warnings,
            jumps: diagnosis.jumps,
            ..asked
        };
        Ok((named, found))
    }

    /// Where a slide alone was moved: the effect that holds its positioning error as a curve, with as many pieces as the positions show.
    fn curve_of_the_axis(&self) -> Option<String> {
        let summary = self.summary();
        let mut moved = summary.ranges.iter().enumerate().filter(|(_, (low, high))| high > low);
        let (joint, None) = (moved.next()?.0, moved.next()) else { return None };
        let positions = summary.positions.get(joint).map_or(0, Vec::len);
        let mut curves = (1..positions).rev().map(|pieces| EffectId {
            order: Some(pieces as f64),
            ..EffectId::at("positioning_error", Site::Joint(joint))
        });
        let id = curves.find(|id| {
            effect::build(id, self.model()).is_ok()
                && effect::not_at_these_positions(&self.context(), id).is_none()
        })?;
        Some(self.model().label(&id))
    }

    /// The condition that was named, or that passes all a name needs and is alone, with its size.
    fn condition(
        &self,
        found: Found,
        progress: &Progress,
    ) -> Result<Option<(AddedEffect, Named)>, LaboratoryError> {
        // Itself, and what is not listed.
        // A condition in which two effects do as well is reported as a tie by the diagnosis, not here.
        let alone = found.corrections.into_iter().next().filter(|first| first.may_be.len() <= 2);
        let effect = found
            .named
            .or(alone.map(|first| first.effect))
            .filter(|effect| effect::kind(&effect.id.name).is_some_and(|kind| kind.depends_on_conditions));
        let Some(effect) = effect else { return Ok(None) };
        let fitted = self.fit_with(std::slice::from_ref(&effect), None, progress)?;
        // What the rows of a pose share is judged by their means, from pose to pose.
        let errors = StandardErrors::of_the_fit(&fitted.problem, &fitted.fit);
        let value = self.effect_values(&errors).pop();
        let site = effect_site(&fitted.problem, &effect.id);
        Ok(value
            .map(|value| (effect, Named { effect: site, size: value.size, unit: value.unit, se: value.se })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_estimation::Random;

    /// Nine poses, ten returns each, which scatter by 1; each pose is off by `off`.
    fn groups(off: f64, seed: u64) -> Vec<Vec<Vector3<f64>>> {
        let mut random = Random::seeded(seed);
        (0..9)
            .map(|_| {
                let pose = off * random.normal();
                (0..10).map(|_| Vector3::new(pose + random.normal(), 0.0, 0.0)).collect()
            })
            .collect()
    }

    #[test]
    fn a_condition_that_passes_is_reported_where_it_is_alone_and_what_does_not_depend_on_one_is_not() {
        use crate::found::CorrectionCandidate;
        use crate::testing::{effect_at, sides_in_turn, two_links, with_table};
        let lab = with_table(&two_links(60, "joint_zero(*)", 0.05, 4, |_| [0.0; 2]), |table| {
            table.approach = Some(sides_in_turn(60));
        });
        let reported = |text: &str, may_be: usize| {
            let id = effect::parse(text, lab.model()).unwrap();
            let effect = AddedEffect { id, values: vec![0.0] };
            let may_be = (0..may_be).map(|one| format!("{one}")).collect();
            let candidate = CorrectionCandidate { effect, site: effect_at(text, "shoulder"), may_be };
            let found = Found { corrections: vec![candidate], ..Found::default() };
            lab.condition(found, &Progress::unwatched()).unwrap().map(|(_, named)| named.effect.effect)
        };
        // Itself, and what is not listed.
        assert_eq!(reported("joint_backlash(shoulder)", 2), Some("joint_backlash".to_owned()));
        assert_eq!(reported("joint_backlash(shoulder)", 3), None, "another does as well");
        assert_eq!(reported("joint_gain(shoulder)", 2), None, "a gain depends on the pose alone");
    }

    #[test]
    fn half_of_the_squares_may_lie_between_poses() {
        // Means 1 and -1 of two poses, each with two returns a unit to either side: 4 between, 4 within.
        let at = |x: f64| Vector3::new(x, 0.0, 0.0);
        let groups = [vec![at(0.0), at(2.0)], vec![at(-2.0), at(0.0)]];
        let found = PoseFraction::of(&groups, 1, 1).unwrap();
        assert!((found.fraction - 0.5).abs() < 1e-12);
        // F = (4 / 1) / (4 / 2) = 2 with 1 and 2 degrees of freedom: p = 0.2929.
        assert!((found.p - 0.292_893).abs() < 1e-5, "{}", found.p);
    }

    #[test]
    fn poses_that_are_off_are_distinguished_from_returns_that_scatter() {
        let found = PoseFraction::of(&groups(5.0, 1), 1, 1).unwrap();
        assert!(found.is_significant() && found.fraction > 0.9, "{found:?}");
        let noise = (0..200)
            .filter(|seed| PoseFraction::of(&groups(0.0, 100 + seed), 1, 0).unwrap().is_significant());
        assert!(noise.count() <= 3, "of 200 at a level of 0.002");
        assert!(PoseFraction::of(&groups(1.0, 2), 1, 9).is_none(), "as many numbers fitted as poses");
    }

    #[test]
    fn poses_are_few_from_two_on_and_below_the_limit_and_each_was_visited_often_enough() {
        let few = |poses: usize, visits: usize| {
            crate::testing::returned(poses, visits).few_poses().map(|all| all.len())
        };
        assert_eq!(few(2, FEW_POSES_RETURNS), Some(2));
        assert_eq!(few(1, 2 * FEW_POSES_RETURNS), None, "one pose has nothing to be compared with");
        assert_eq!(few(2, FEW_POSES_RETURNS - 1), None);
        assert_eq!(few(FEW_POSES - 1, FEW_POSES_RETURNS), Some(FEW_POSES - 1));
        assert_eq!(few(FEW_POSES, FEW_POSES_RETURNS), None);
    }

    #[test]
    fn without_returns_nothing_goes_with_the_pose_and_a_level_is_no_find() {
        let single = [vec![Vector3::x()], vec![-Vector3::x()], vec![Vector3::y()]];
        assert!(PoseFraction::of(&single, 3, 1).is_none());
        let at = |p: f64| PoseFraction { fraction: 0.5, p, poses: 3 }.is_significant();
        assert!(at(0.99 * LACK_OF_FIT_LEVEL) && !at(LACK_OF_FIT_LEVEL));
    }

    /// A slide measured at eight positions, six times from either side: `play` mm, and an error of position of its own.
    fn slide(play: f64, error: f64) -> Laboratory {
        slide_with(false, |_| play, error)
    }

    /// The same with play by the position, always from the least to the greatest, or in sweeps up and down.
    fn slide_with(in_sweeps: bool, play: impl Fn(i32) -> f64, error: f64) -> Laboratory {
        let model = "
arm: axis
convention: distal
joints:
  - {name: x, slides: true, limits_mm: [-5, 205]}
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 90, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
free: [joint_zero(x)]
";
        let mut random = Random::seeded(3);
        let mut text = "q1_mm,approach_q1,repeat,p1_x_mm\n".to_owned();
        for row in 0..96 {
            let (index, side) = (row % 8, if row / 8 % 2 == 0 { 1.0 } else { -1.0 });
            let position = if in_sweeps && side < 0.0 { 7 - index } else { index };
            let x = 25.0 * f64::from(position) + 4.0 * (1.7 * f64::from(position)).sin();
            let read = x + error * (x / 11.0).sin() - side * play(position) / 2.0 + 0.002 * random.normal();
            text.push_str(&format!("{x},{side},t{position},{read}\n"));
        }
        let model = plumb_calibration::arm_model::Model::parse("m.yaml", model).unwrap();
        let table = plumb_calibration::table::Table::parse("t.csv", &text).unwrap();
        let options = crate::laboratory::Options {
            holdout: crate::split::Holdout::None,
            ..crate::laboratory::Options::default()
        };
        Laboratory::new(model, table, options).unwrap()
    }

    #[test]
    fn the_play_of_a_slide_is_named_beside_an_error_of_each_position() {
        let lab = slide(0.006, 0.03);
        let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
        let named = diagnosis.named.unwrap();
        assert!((named.size - 0.006).abs() < 4.0 * named.se && named.se < 0.001, "{named:?}");
        assert_eq!((diagnosis.verdict, named.effect.effect.as_str()), (Verdict::Named, "joint_backlash"));
        let few = diagnosis.few_poses.unwrap();
        assert!(few.fraction.poses == 8 && few.fraction.fraction > 0.5 && few.fraction.is_significant());
        let condition = few.condition.unwrap();
        assert_eq!((condition.label.as_str(), condition.across), ("joint_backlash(x)", AcrossPoses::Same));
        // Eight positions hold a curve of seven pieces at most.
        let curve = few.curve.unwrap();
        assert!(curve.starts_with("positioning_error(x, "), "{curve}");
        // What is left is that of the model itself.
        let alone = lab.compare(&Progress::unwatched()).unwrap().rms_mm;
        assert!((diagnosis.rms_mm.fit - alone.fit).abs() < 1e-9, "{:?} {alone:?}", diagnosis.rms_mm);
    }

    #[test]
    fn what_goes_with_the_position_alone_is_said_so_and_of_scatter_nothing_is() {
        let diagnosis = slide(0.0, 0.03).diagnose(&Progress::unwatched()).unwrap();
        let few = diagnosis.few_poses.unwrap();
        assert!(diagnosis.named.is_none() && few.condition.is_none() && few.curve.is_some());
        assert_eq!(diagnosis.remaining.covariates.first().map(String::as_str), Some("pose"));
        assert_eq!(diagnosis.remaining.shape, Some(Rest::PoseAlone(few.fraction)));
        let sound = slide(0.0, 0.0).diagnose(&Progress::unwatched()).unwrap();
        assert!(sound.few_poses.is_none() && sound.named.is_none());
    }

    #[test]
    fn only_a_slide_that_moved_alone_has_a_curve() {
        let two = crate::testing::returned(4, FEW_POSES_RETURNS);
        assert_eq!(two.curve_of_the_axis(), None, "two joints moved");
        assert!(slide(0.0, 0.0).curve_of_the_axis().is_some());
    }

    /// What is said of play that differs by so much (mm) in turn from position to position, beside what settles.
    fn judged(in_sweeps: bool, differs: f64) -> FromPoseToPose {
        let play = |position: i32| 0.02 + if position % 2 == 0 { differs } else { -differs };
        let lab = slide_with(in_sweeps, play, 0.03);
        let groups = lab.few_poses().unwrap();
        let beside = lab.beside_pose_errors(&groups);
        let progress = Progress::unwatched();
        let effect = AddedEffect { id: EffectId::at("joint_backlash", Site::Joint(0)), values: vec![0.0] };
        let named = Named {
            effect: crate::testing::effect_at("joint_backlash", "x"),
            size: 0.02,
            unit: "mm".to_owned(),
            se: 0.001,
        };
        let fitted = beside.fit_with(&[], None, &progress).unwrap();
        let floor = crate::noise_floor::Floor::of(&fitted.problem, &fitted.fit, &beside.context());
        let candidates = ["joint_settling", "joint_gain"].map(|name| crate::testing::candidate(name, "x"));
        beside.judged_from_pose_to_pose(&groups, (&effect, &named), (&floor, &candidates), &progress).unwrap()
    }

    #[test]
    fn play_that_differs_from_pose_to_pose_says_so_and_is_tied_with_what_settles_where_that_does_as_well() {
        assert!(matches!(judged(false, 0.0), FromPoseToPose::Same));
        // Moves of any length and direction: a fraction of the last one is no play.
        match judged(false, 0.004) {
            FromPoseToPose::Differs { scatter_mm, wider } => {
                // Half of 0.004 mm on either side, six returns of 0.002 mm each.
                assert!((0.001..0.004).contains(&scatter_mm) && wider > 1.0, "{scatter_mm} {wider}");
            }
            _ => panic!("the play differs, and nothing else does as well"),
        }
        // Sweeps up and down in even steps: the last move goes with the side.
        match judged(true, 0.008) {
            FromPoseToPose::Tied { tied, .. } => {
                let names: Vec<&str> = tied.iter().map(|one| one.effect.as_str()).collect();
                assert_eq!(names, ["joint_backlash", "joint_settling"]);
            }
            _ => panic!("what settles does as well"),
        }
    }
}
