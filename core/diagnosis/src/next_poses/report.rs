//! Chosen poses as people see them.

use serde_json::{Map, Value, json};

use super::choose::Chooser;
use super::design::{Design, PoseRequest, Sensing};
use super::outcome::{Instead, OtherWay};
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::noise_floor::typical_sigma;
use crate::outcome::NextPose;
use crate::thresholds::{INSEPARABLE, SETTLES};
use plumb_estimation::Progress;

/// Load that is proposed beyond the heaviest of the table, kg.
const MORE_LOAD: f64 = 2.0;

/// Poses with which another way of measuring is tried.
const FEW: usize = 4;

/// Other ways of measuring that might separate the rivals: which, what is read, and the loads.
fn other_ways(lab: &Laboratory) -> Vec<(OtherWay, Sensing, Vec<f64>)> {
    let loads = lab.table().payload.iter().flatten().copied().filter(|load| load.is_finite());
    let load = loads.fold(0.0, f64::max) + MORE_LOAD;
    let mut ways = vec![(OtherWay::Load(load), Sensing::AsBefore, vec![0.0, load])];
    if lab.table().positions.is_empty() {
        ways.push((OtherWay::WholePositions, Sensing::WholePoints, Vec::new()));
    }
    ways.push((OtherWay::SecondPoint, Sensing::SecondPoint, Vec::new()));
    ways
}

/// What would separate the rivals if poses alone do not; `now` is how far the poses separate them.
pub(super) fn what_would(
    chooser: &mut Chooser<'_>,
    request: PoseRequest<'_>,
    now: f64,
    progress: &Progress,
) -> Result<Instead, LaboratoryError> {
    let mut best: Option<(f64, OtherWay)> = None;
    for (way, sensing, payloads) in other_ways(chooser.designer.lab) {
        chooser.sensing = sensing;
        // Whether another way of measuring helps shows after a few poses; the user chooses the way, and asks for poses again.
        let few = PoseRequest { count: request.count.min(FEW), payloads: &payloads, ..request };
        // The least of all pairs: a way that leaves two alike settles nothing.
        let separation = chooser.choose(few, progress)?.least();
        if best.as_ref().is_none_or(|(most, _)| separation > *most) {
            best = Some((separation, way));
        }
    }
    chooser.sensing = Sensing::AsBefore;
    Ok(advice(best, now, request.count.min(FEW)))
}

/// The best other way, where it separates the rivals and clearly better than the poses do.
fn advice(best: Option<(f64, OtherWay)>, now: f64, poses: usize) -> Instead {
    match best {
        // Twice as far apart as now is worth another instrument; a little more is not.
        Some((separation, way)) if separation > SETTLES.max(2.0 * now) => {
            Instead::Way { way, separation, poses }
        }
        _ if now < INSEPARABLE => Instead::Same,
        _ => Instead::BelowNoise,
    }
}

/// A number to three decimals.
fn to_thousandths(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}

impl Chooser<'_> {
    /// The poses with what every rival predicts there.
    pub(super) fn to_poses(&self, designs: &[Design]) -> Vec<NextPose> {
        let lab = self.designer.lab;
        let unit = lab.problem(&[]).map_or(1.0, |problem| typical_sigma(&problem));
        let forecast = self.forecast(designs, PoseRequest { count: 0, keep_out: &[], payloads: &[] }).ok();
        let poses = designs.iter().enumerate().map(|(index, design)| {
            let mut predicted = Map::new();
            let readings = forecast.iter().flat_map(|forecast| self.rivals.iter().zip(&forecast.rivals));
            for (rival, all) in readings {
                let values = all[index].0.iter().map(|value| json!((value * unit * 1e4).round() / 1e4));
                predicted.insert(rival.label.clone(), Value::Array(values.collect()));
            }
            if design.wait > 0.0 {
                predicted.insert("after_waiting_s".to_owned(), json!(design.wait));
            }
            let shown = design.q.iter().enumerate().map(|(joint, q)| {
                let slides = lab.model().slides(joint);
                to_thousandths(if slides { *q } else { q.to_degrees() })
            });
            NextPose {
                q_deg: shown.collect(),
                approach: design.approach.clone(),
                payload_kg: design.payload,
                on: self.designer.surface.clone(),
                predicted,
            }
        });
        poses.collect()
    }
}

/// The same pose, arrived at from the other side.
pub(super) fn approached_from_the_other_side(pose: &NextPose) -> NextPose {
    NextPose { approach: pose.approach.iter().map(|side| -side).collect(), ..pose.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_load_and_a_second_point_are_tried_and_whole_positions_where_none_were_measured() {
        let lab = crate::testing::two_links(8, "", 0.05, 73, |_| [0.0; 2]);
        let ways = other_ways(&lab);
        assert_eq!(ways.iter().map(|(_, sensing, _)| *sensing).collect::<Vec<_>>().len(), 2);
        assert!(
            ways[0].1 == Sensing::AsBefore
                && ways[0].2 == [0.0, MORE_LOAD]
                && ways[0].0 == OtherWay::Load(MORE_LOAD)
        );
        assert!(ways[1].1 == Sensing::SecondPoint);
    }

    #[test]
    fn a_chosen_pose_is_reported_in_degrees_with_its_wait_and_what_each_rival_predicts() {
        let lab = crate::testing::two_links(8, "", 0.05, 73, |_| [0.0; 2]);
        let chooser = Chooser::new(&lab, Vec::new(), 1.0).unwrap();
        let design = |wait: f64| Design { q: vec![0.5, -1.0], approach: vec![1, -1], payload: 2.0, wait };
        let poses = chooser.to_poses(&[design(0.0), design(600.0)]);
        assert_eq!(poses[0].q_deg, [28.648, -57.296], "to a thousandth of a degree");
        assert_eq!((poses[0].payload_kg, poses[0].approach.as_slice()), (2.0, &[1, -1][..]));
        assert!(poses[0].predicted.is_empty(), "there is nothing to wait for");
        assert_eq!(poses[1].predicted["after_waiting_s"], 600.0);
        assert_eq!(approached_from_the_other_side(&poses[0]).approach, [-1, 1]);
    }

    #[test]
    fn another_way_is_advised_only_where_it_settles_the_question_and_is_clearly_better() {
        let way = OtherWay::Load(3.0);
        let load = |separation: f64| Some((separation, way));
        let separation = 1.1 * SETTLES;
        assert_eq!(advice(load(separation), 0.4, 4), Instead::Way { way, separation, poses: 4 });
        assert_eq!(advice(load(0.9 * SETTLES), 0.4, 4), Instead::Same);
        assert_eq!(advice(load(0.9 * SETTLES), 1.1 * INSEPARABLE, 4), Instead::BelowNoise);
        assert_eq!(advice(load(separation), 0.6 * SETTLES, 4), Instead::BelowNoise);
    }

    #[test]
    fn a_return_comes_from_the_other_side_of_every_joint() {
        let pose = NextPose {
            q_deg: vec![10.0, 20.0, 30.0],
            approach: vec![1, 0, -1],
            payload_kg: 0.0,
            on: None,
            predicted: Map::new(),
        };
        let back = approached_from_the_other_side(&pose);
        assert_eq!((back.approach, back.q_deg), (vec![-1, 0, 1], pose.q_deg));
    }

    #[test]
    fn of_other_ways_the_one_that_puts_the_rivals_farthest_apart_is_advised() {
        let lines = "free: [joint_zero(*)]\nnoise: {p1_mm: 0.05}\ngravity: [0, -1, 0]";
        let lab = crate::testing::two_links_with(lines, 20, 0.05, 73, |_| [0.0; 2]);
        let watch = Progress::unwatched();
        let fitted = lab.fit_with(&[], None, &watch).unwrap();
        // The elbow gives way by so much under a newton metre: without a load there is nothing to see.
        let id = plumb_calibration::effect::parse("joint_compliance(elbow)", lab.model()).unwrap();
        let soft = vec![plumb_calibration::arm_model::AddedEffect { id, values: vec![0.001] }];
        let with = lab.fit_with(&soft, None, &watch).unwrap();
        let mut second = super::super::rivals::Rival::of("soft".to_owned(), soft, &with);
        second.state.effects.iter_mut().skip(2).for_each(|values| values.fill(0.001));
        let first = super::super::rivals::Rival::of("stiff".to_owned(), Vec::new(), &fitted);
        let mut chooser = Chooser::new(&lab, vec![first, second], 1.0).unwrap();
        let request = || PoseRequest { count: 6, keep_out: &[], payloads: &[] };
        let mut apart = Vec::new();
        for (way, sensing, payloads) in other_ways(&lab) {
            chooser.sensing = sensing;
            let few = PoseRequest { count: FEW, payloads: &payloads, ..request() };
            apart.push((way, chooser.choose(few, &watch).unwrap().least()));
        }
        assert!(apart[0].1 > 3.0 * apart[1].1.max(1.0), "a load shows it: {apart:?}");
        let advised = what_would(&mut chooser, request(), 0.0, &watch).unwrap();
        assert_eq!(advised, Instead::Way { way: apart[0].0, separation: apart[0].1, poses: FEW });
        assert!(chooser.sensing == Sensing::AsBefore);
    }
}
