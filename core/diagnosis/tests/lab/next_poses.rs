//! Poses to measure next: within limits, clear of what is kept out, and distinguishing what the data cannot.

use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_diagnosis::{NextPoses, Requested};
use plumb_estimation::Progress;
use plumb_kinematics::HalfSpace;
use plumb_report::{instead_in_words, next_poses_sentence};

use super::made_up::{TWO_LINKS, Xorshift, laboratory, two_links_tip};

/// The elbow is held near 60 degrees: an error of its zero looks like one of its gain.
fn narrow() -> String {
    let mut rng = Xorshift::seeded(41);
    let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for _ in 0..30 {
        let (shoulder, elbow) = (rng.between(-100.0, 100.0), rng.between(59.0, 61.0));
        let (x, y) = two_links_tip(shoulder, elbow + 0.5);
        let (x, y) = (x + rng.noise(0.05), y + rng.noise(0.05));
        text.push_str(&format!("{shoulder:.4},{elbow:.4},{x:.4},{y:.4},{:.4}\n", rng.noise(0.05)));
    }
    text
}

fn next(model: &str, keep_out: Vec<HalfSpace>) -> NextPoses {
    let options = Options { holdout: Holdout::None, ..Options::default() };
    let laboratory = laboratory(&format!("{model}noise: {{p1_mm: 0.05}}\n"), &narrow(), options);
    let expected = Requested { count: 4, keep_out, payloads: Vec::new() };
    laboratory.next_poses(&expected, &Progress::unwatched()).unwrap()
}

#[test]
fn poses_reach_for_what_the_data_lack_and_end_with_two_returns() {
    let poses = next(TWO_LINKS, Vec::new());
    assert_eq!(poses.next.len(), 6, "{poses:?}");
    assert!(poses.between.iter().any(|label| label == "joint_zero(elbow)"), "{:?}", poses.between);
    assert!(poses.between.len() >= 2, "{:?}", poses.between);
    assert!(poses.separation > 10.0 && poses.instead.is_none(), "{poses:?}");
    assert!(poses.next.iter().any(|pose| (pose.q_deg[1] - 60.0).abs() > 40.0), "{:?}", poses.next);
    for pose in &poses.next {
        // On a limit itself an arm whose zeros are off may refuse to stand.
        assert!(pose.q_deg[0].abs() <= 165.0 && pose.q_deg[1].abs() <= 145.0, "{pose:?}");
        assert!(poses.between.iter().all(|label| pose.predicted.contains_key(label)), "{pose:?}");
    }
    assert_eq!(poses.next[0].q_deg, poses.next[4].q_deg);
    assert_eq!(poses.next[1].q_deg, poses.next[5].q_deg);
    let sentence = next_poses_sentence(&poses);
    assert!(sentence.contains("standard errors apart"), "{sentence}");
}

#[test]
fn nothing_of_the_arm_crosses_a_plane_that_is_kept_out() {
    let poses = next(TWO_LINKS, vec![HalfSpace { normal: [0.0, 1.0, 0.0], offset: 0.0 }]);
    for pose in &poses.next {
        let (_, y) = two_links_tip(pose.q_deg[0], pose.q_deg[1]);
        assert!(y > -6.0, "{pose:?} stands at {y}");
        assert!(pose.q_deg[0].to_radians().sin() > -0.02, "{pose:?}: the elbow is beyond the plane");
    }
}

#[test]
fn where_no_pose_distinguishes_them_it_says_so_and_what_would() {
    let tight = TWO_LINKS.replace("[-150, 150]", "[59, 61]");
    let poses = next(&tight, Vec::new());
    assert!(poses.separation < 3.0, "{poses:?}");
    let instead = poses.instead.as_ref().map(instead_in_words);
    let instead = instead.expect("something else is proposed, or it is said that nothing would do");
    let sentence = next_poses_sentence(&poses);
    assert!(sentence.starts_with("No pose within reach distinguishes "), "{sentence}");
    assert!(sentence.contains(&instead), "{sentence}");
}
