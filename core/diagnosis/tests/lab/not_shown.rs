//! What the rows cannot show is said before a model is called at the floor.

use plumb_diagnosis::laboratory::{Laboratory, Options};
use plumb_diagnosis::split::Holdout;
use plumb_diagnosis::{Diagnosis, NotShown, Requested, Verdict};
use plumb_estimation::Progress;
use plumb_report::{diagnosis_sentence, next_poses_sentence};

use super::made_up::{TWO_LINKS, Xorshift, laboratory, try_laboratory, two_links_tip};

/// Measurements of an arm with nothing wrong but its zeros, the elbow between two angles; 0.05 mm of noise.
fn measured(low: f64, high: f64, rows: usize) -> String {
    let mut rng = Xorshift::seeded(7);
    let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for _ in 0..rows {
        let (shoulder, elbow) = (rng.between(-150.0, 150.0), rng.between(low, high));
        let (x, y) = two_links_tip(shoulder + 0.2, elbow - 0.3);
        let (x, y) = (x + rng.noise(0.05), y + rng.noise(0.05));
        text.push_str(&format!("{shoulder:.4},{elbow:.4},{x:.4},{y:.4},{:.4}\n", rng.noise(0.05)));
    }
    text
}

fn lab(low: f64, high: f64, rows: usize, more: &str) -> Laboratory {
    let model = TWO_LINKS.replace("free: []", "free: [joint_zero(*)]");
    let options = Options { holdout: Holdout::None, ..Options::default() };
    laboratory(&format!("{model}noise: {{p1_mm: 0.05}}\n{more}"), &measured(low, high, rows), options)
}

fn diagnosed(lab: &Laboratory) -> Diagnosis {
    let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
    assert_eq!(diagnosis.verdict, Verdict::AtFloor, "{}", diagnosis_sentence(&diagnosis));
    diagnosis
}

fn of<'d>(diagnosis: &'d Diagnosis, label: &str) -> Option<&'d NotShown> {
    diagnosis.not_shown.iter().find(|one| one.label == label)
}

#[test]
fn an_elbow_that_hardly_moved_hides_its_gain_and_poses_are_asked_for_that_would_show_it() {
    let lab = lab(59.0, 61.0, 40, "");
    let diagnosis = diagnosed(&lab);
    let gain =
        of(&diagnosis, "joint_gain(elbow)").unwrap_or_else(|| panic!("{}", diagnosis_sentence(&diagnosis)));
    assert!(gain.up_to_mm.is_none_or(|most| most > 1.0), "{gain:?}");
    assert!(
        diagnosis_sentence(&diagnosis).contains("for what these rows can show"),
        "{}",
        diagnosis_sentence(&diagnosis)
    );
    assert!(
        diagnosis_sentence(&diagnosis).contains("side of approach, time or temperature"),
        "{}",
        diagnosis_sentence(&diagnosis)
    );
    assert_eq!(diagnosis.next.len(), 4);
    let expected = Requested { count: 4, keep_out: Vec::new(), payloads: Vec::new() };
    let poses = lab.next_poses(&expected, &Progress::unwatched()).unwrap();
    assert!(poses.between.contains(&"joint_gain(elbow)".to_owned()), "{:?}", poses.between);
    let sentence = next_poses_sentence(&poses);
    assert!(sentence.contains("they would show"), "{sentence}");
    assert!(poses.next.iter().any(|pose| (pose.q_deg[1] - 60.0).abs() > 40.0), "{:?}", poses.next);
}

#[test]
fn poses_all_over_the_range_show_what_narrow_ones_do_not() {
    let diagnosis = diagnosed(&lab(-140.0, 140.0, 120, ""));
    for label in ["joint_gain(elbow)", "joint_gain(shoulder)", "link_length(shoulder)", "link_length(elbow)"]
    {
        assert!(of(&diagnosis, label).is_none(), "{label}: {:?}", of(&diagnosis, label));
    }
}

#[test]
fn where_the_arm_works_in_part_of_its_reach_only_what_matters_there_is_reported() {
    // Within the elbow's narrow range the tip lies between 300 and 310 mm out, whatever the shoulder does.
    let narrow = "working_volume: {x_mm: [-310, 310], y_mm: [-310, 310], z_mm: [-1, 1]}\n";
    let (whole, part) = (diagnosed(&lab(59.0, 61.0, 40, "")), diagnosed(&lab(59.0, 61.0, 40, narrow)));
    assert!(of(&whole, "joint_gain(elbow)").is_some() && of(&part, "joint_gain(elbow)").is_some());
    let nowhere = "working_volume: {x_mm: [900, 910], y_mm: [0, 10], z_mm: [-1, 1]}\n";
    let refused = lab(59.0, 61.0, 40, nowhere).diagnose(&Progress::unwatched()).unwrap_err().to_string();
    assert!(refused.contains("working_volume"), "{refused}");
}

#[test]
fn a_working_volume_that_is_none_is_refused_with_its_place() {
    let model = format!("{TWO_LINKS}working_volume: {{x_mm: [3, 2], y_mm: [0, 1], z_mm: [0, 1]}}\n");
    let message = try_laboratory(&model, &measured(0.0, 60.0, 10), Options::default()).err().unwrap();
    assert!(message.contains(":11:17: ") && message.contains("a least and a greater number"), "{message}");
}
