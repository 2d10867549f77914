//! A family of harmonics taken in at one go, and a table without one.

use super::*;
use crate::testing::two_links;

/// Joint (from 0), periods a turn, amplitude in rad.
const WAVES: [(usize, f64, f64); 4] = [(0, 9.0, 8e-4), (0, 20.0, 5e-4), (1, 7.0, 1e-3), (1, 12.0, 7e-4)];

fn waves(q: [f64; 2]) -> [f64; 2] {
    let mut off = [0.0; 2];
    for (joint, order, amplitude) in WAVES {
        off[joint] += amplitude * (order * q[joint] + 0.4).sin();
    }
    off
}

#[test]
fn every_wave_of_a_family_is_found_with_its_size_and_the_error_falls_from_one_to_the_next() {
    let lab = two_links(BATCH_ROWS + 40, "joint_zero(*)", 0.02, 41, waves);
    let batch = lab.batch(false, &Progress::unwatched()).unwrap().unwrap();
    for (joint, order, amplitude) in WAVES {
        let place = ["shoulder", "elbow"][joint];
        let own = batch
            .steps
            .iter()
            .find(|step| step.added.effect.place == place && step.added.effect.n == Some(order));
        let own = own.unwrap_or_else(|| panic!("{place} {order}: {:?}", batch.steps));
        assert!(
            (own.added.size.to_radians() - amplitude).abs() < 4.0 * own.added.se.to_radians(),
            "{:?}",
            own.added
        );
    }
    assert!(batch.steps.len() <= WAVES.len() + 1, "{:?}", batch.steps);
    let fits: Vec<f64> = batch.steps.iter().map(|step| step.rms_mm.fit).collect();
    assert!(fits.windows(2).all(|pair| pair[1] < pair[0]), "{fits:?}");
    let last = batch.steps.last().unwrap();
    // Three readings of 0.02 mm make a point.
    assert!(
        (0.03..0.04).contains(&last.rms_mm.fit) && last.rms_mm.cv.unwrap() >= last.rms_mm.fit,
        "{last:?}"
    );
    let left_out: Vec<f64> = batch.steps.iter().filter_map(|step| step.rms_mm.cv).collect();
    assert_eq!(left_out.len(), batch.steps.len());
    assert!(left_out.windows(2).all(|pair| pair[1] < pair[0]), "{left_out:?}");
    assert!(
        last.model.is_some() && batch.steps[..batch.steps.len() - 1].iter().all(|step| step.model.is_none())
    );
    assert_eq!(batch.laboratory.model().effects.len(), batch.steps.len());
    assert!(batch.laboratory.batch(true, &Progress::unwatched()).unwrap().is_none(), "nothing is left");
}

#[test]
fn an_effect_with_a_name_of_its_own_comes_in_beside_the_family() {
    let with_gain = |q: [f64; 2]| {
        let off = waves(q);
        [off[0], off[1] + 0.003 * q[1]]
    };
    let lab = two_links(BATCH_ROWS + 40, "joint_zero(*)", 0.02, 44, with_gain);
    let batch = lab.batch(false, &Progress::unwatched()).unwrap().unwrap();
    let gain = batch.steps.iter().find(|step| step.label == "joint_gain(elbow)");
    let gain = gain.unwrap_or_else(|| panic!("{:?}", batch.steps));
    assert!((gain.added.size - 0.003).abs() < 4.0 * gain.added.se, "{:?}", gain.added);
}

#[test]
fn small_tables_and_those_without_a_family_are_left_to_the_search_one_by_one() {
    let small = two_links(BATCH_ROWS - 1, "joint_zero(*)", 0.02, 42, waves);
    assert!(small.batch(false, &Progress::unwatched()).unwrap().is_none());
    let plain = two_links(BATCH_ROWS, "joint_zero(*)", 0.02, 43, |q| [0.0, 0.002 * q[1]]);
    assert!(plain.batch(false, &Progress::unwatched()).unwrap().is_none());
}
