//! What is predictable is reported, what is noise is not: known functions and plain noise, on small made-up arms.

use super::*;
use crate::laboratory::Laboratory;
use crate::testing::two_links;

fn ask(lab: &Laboratory) -> Explainable {
    lab.explainable(&Progress::unwatched()).unwrap().unwrap()
}

#[test]
fn of_noise_nothing_is_predictable_and_nothing_is_made_worse() {
    let mut structured = 0;
    for seed in 0..30 {
        let explained = ask(&two_links(80, "joint_zero(*)", 0.1, seed, |_| [0.0; 2]));
        structured += usize::from(explained.is_structured());
        assert!(explained.not_predictable_mm <= explained.left_mm, "seed {seed}: {explained:?}");
        assert!(explained.to_name_mm < 3.0 * explained.scatter_mm + 1e-9, "seed {seed}: {explained:?}");
    }
    assert!(structured <= 2, "{structured} of 30 tables of noise");
}

#[test]
fn a_function_of_the_pose_is_predicted_down_to_the_noise() {
    // A bend of the elbow's coordinate by 2 mrad at 150 mm, in noise of 0.05 mm an axis: 0.087 mm a point.
    let explained =
        ask(&two_links(200, "joint_zero(*)", 0.05, 3, |q| [0.0, 0.004 * (2.0 * q[1] + 0.4).sin()]));
    assert!(explained.left_mm > 0.3, "{explained:?}");
    assert!(explained.not_predictable_mm < 1.15 * 0.05 * 3.0_f64.sqrt(), "{explained:?}");
    assert_eq!(explained.kinds(), ["pose"], "{explained:?}");
}

#[test]
fn the_side_of_approach_is_distinguished_from_the_pose() {
    // The side from which the shoulder came is known from the row before: the made-up arm lags by 1 mrad.
    let before = std::cell::Cell::new(0.0);
    let lab = two_links(150, "joint_zero(*)", 0.05, 5, |q| {
        let moved = q[0] - before.replace(q[0]);
        [0.002 * moved.signum(), 0.0]
    });
    let explained = ask(&lab);
    assert_eq!(explained.kinds(), ["last move"], "{explained:?}");
    assert!(explained.not_predictable_mm < 1.25 * 0.05 * 3.0_f64.sqrt(), "{explained:?}");
    let last_move = explained.groups.iter().find(|group| group.group == "last move").unwrap();
    assert!(last_move.beyond_others_mm > 0.1, "{explained:?}");
}

#[test]
fn a_drift_is_reported_as_one_of_order() {
    let row = std::cell::Cell::new(0.0);
    let lab = two_links(150, "joint_zero(*)", 0.05, 7, |_| {
        row.set(row.get() + 1.0);
        [0.002 * (row.get() / 40.0_f64).sin(), 0.0]
    });
    let explained = ask(&lab);
    assert_eq!(explained.kinds(), ["order"], "{explained:?}");
}

#[test]
fn nothing_is_said_of_few_poses() {
    let lab = two_links(FEWEST_POSES - 1, "joint_zero(*)", 0.05, 9, |_| [0.0; 2]);
    assert!(lab.explainable(&Progress::unwatched()).unwrap().is_none());
}

#[test]
fn of_many_rows_a_random_part_is_looked_at_whole_poses_and_the_same_each_time() {
    let lab = two_links(60, "joint_zero(*)", 0.05, 72, |_| [0.0; 2]);
    let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
    let chosen = |most: usize| chosen_rows(&fitted.problem, &fitted.fit, most);
    assert_eq!(chosen(60), fitted.fit.rows);
    let some = chosen(25);
    assert_eq!((some.len(), &some), (25, &chosen(25)));
    assert!(some.windows(2).all(|pair| pair[0] < pair[1]) && some != (0..25).collect::<Vec<usize>>());
}

#[test]
fn the_error_of_a_root_mean_square_follows_from_that_of_the_sum_of_squares() {
    // d(rms) = d(squares / points) / (2 rms): 3 / 6 / (2 * 0.25).
    let gain = Some(Gain { total: 9.0, error: 3.0 });
    assert!((rms_error(gain, 0.25, 6) - 1.0).abs() < 1e-12);
    assert_eq!(rms_error(None, 0.25, 6), 0.0);
    assert!(counts(Some(Gain { total: 1.01 * EXPLAINABLE_ERRORS, error: 1.0 })));
    assert!(!counts(Some(Gain { total: 0.99 * EXPLAINABLE_ERRORS, error: 1.0 })) && !counts(None));
}

#[test]
fn a_fall_of_just_the_limit_is_chance_and_as_many_poses_as_are_needed_are_enough() {
    assert!(!counts(Some(Gain { total: EXPLAINABLE_ERRORS, error: 1.0 })));
    let asked = |poses: usize| {
        let lab = two_links(poses, "joint_zero(*)", 0.05, 6, |_| [0.0; 2]);
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        explainable(&fitted.problem, &fitted.fit, &Progress::unwatched()).unwrap().is_some()
    };
    assert!(asked(FEWEST_POSES) && !asked(FEWEST_POSES - 1));
}
