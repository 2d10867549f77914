//! The closed-form inverses against forward kinematics: every configuration, random poses, and the poses at which a solution is not unique.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector3;
use plumb_kinematics::closed_form::{
    NoSolution, PumaConfiguration, PumaGeometry, Side, TeachMoverConfiguration, TeachMoverGeometry,
    TeachMoverPose, Wrist,
};
use plumb_kinematics::{Chain, Convention, Joint, LinkFrames};
use proptest::prelude::*;

const ARM: PumaGeometry = PumaGeometry::PUMA_560;
const TEACHMOVER: TeachMoverGeometry =
    TeachMoverGeometry { shoulder_height: 195.0, upper_arm: 177.8, forearm: 177.8, hand: 109.0 };

fn puma() -> Chain {
    let row = |(name, a, alpha, d): (&str, f64, f64, f64)| Joint::turning(name, a, alpha, d, 0.0);
    let rows = [
        ("waist", 0.0, -FRAC_PI_2, 0.0),
        ("shoulder", 431.8, 0.0, 149.09),
        ("elbow", -20.32, FRAC_PI_2, 0.0),
        ("roll", 0.0, -FRAC_PI_2, 433.07),
        ("bend", 0.0, FRAC_PI_2, 0.0),
        ("flange", 0.0, 0.0, 56.25),
    ];
    Chain::new(Convention::Distal, rows.map(row).to_vec()).unwrap()
}

fn apart(left: f64, right: f64) -> f64 {
    let turn = (left - right).rem_euclid(2.0 * PI);
    turn.min(2.0 * PI - turn)
}

proptest! {
    #[test]
    fn the_puma_comes_back_to_the_joints_it_was_at(q in prop::array::uniform6(-3.1..3.1f64)) {
        let flange = LinkFrames::of(&puma(), &q, &[]).flange;
        let joints = ARM.inverse(&flange, ARM.configuration(&q), q[3]).unwrap();
        // Where the arm is stretched or the wrist straight, two solutions meet and the angles are only as good as the root of the rounding.
        let bent = apart(q[2], 433.07_f64.atan2(-20.32)).min(apart(q[2], 433.07_f64.atan2(-20.32) + PI));
        let clear = bent > 1e-3 && q[4].abs() > 1e-3 && (PI - q[4].abs()) > 1e-3;
        if clear {
            for (found, original) in joints.iter().zip(&q) {
                prop_assert!(apart(*found, *original) < 1e-6, "{joints:?} for {q:?}");
            }
        }
        let there = LinkFrames::of(&puma(), &joints, &[]).flange;
        prop_assert!((there.translation.vector - flange.translation.vector).norm() < 1e-6);
        prop_assert!((there.rotation.matrix() - flange.rotation.matrix()).norm() < 1e-6);
    }

    #[test]
    fn every_configuration_of_the_puma_reaches_the_pose_and_is_what_it_says(q in prop::array::uniform6(-3.1..3.1f64)) {
        let flange = LinkFrames::of(&puma(), &q, &[]).flange;
        for configuration in PumaConfiguration::all() {
            let joints = ARM.inverse(&flange, configuration, 0.0).unwrap();
            let there = LinkFrames::of(&puma(), &joints, &[]).flange;
            prop_assert!((there.translation.vector - flange.translation.vector).norm() < 1e-6, "{configuration:?}");
            prop_assert!((there.rotation.matrix() - flange.rotation.matrix()).norm() < 1e-6, "{configuration:?}");
            let bent = apart(joints[2], 433.07_f64.atan2(-20.32));
            if joints[4].abs() > 1e-6 && bent > 1e-6 && PI - bent > 1e-6 {
                prop_assert_eq!(ARM.configuration(&joints), configuration);
            }
        }
    }

    #[test]
    fn every_configuration_of_the_teachmover_reaches_the_pose(
        radius in 60.0..330.0f64, around in -3.0..3.0f64, height in 20.0..300.0f64, pitch in -1.8..0.3f64, roll in -1.5..1.5f64,
    ) {
        let pose = TeachMoverPose { point: Vector3::new(radius * around.cos(), radius * around.sin(), height), pitch, roll };
        for configuration in TeachMoverConfiguration::ALL {
            // What reaches over its back holds its hand the other way.
            let pitch = if configuration.side == Side::Forward { pitch } else { -PI - pitch };
            let pose = TeachMoverPose { pitch, ..pose };
            match TEACHMOVER.inverse(&pose, configuration) {
                Ok(joints) => {
                    let there = TEACHMOVER.forward(&joints);
                    prop_assert!((there.point - pose.point).norm() < 1e-9, "{configuration:?}");
                }
                Err(NoSolution::OutOfReach { away_mm }) => prop_assert!(away_mm > 0.0),
                Err(other) => prop_assert!(false, "{other}"),
            }
        }
    }
}

#[test]
fn a_straight_wrist_keeps_its_first_turn() {
    let q = [0.3, -0.4, 0.2, 0.7, 0.0, -0.2];
    let flange = LinkFrames::of(&puma(), &q, &[]).flange;
    let configuration = PumaConfiguration { wrist: Wrist::NoFlip, ..ARM.configuration(&q) };
    let joints = ARM.inverse(&flange, configuration, 0.7).unwrap();
    assert!((joints[3] - 0.7).abs() < 1e-12 && (joints[5] + 0.2).abs() < 1e-9, "{joints:?}");
    let there = LinkFrames::of(&puma(), &joints, &[]).flange;
    assert!((there.rotation.matrix() - flange.rotation.matrix()).norm() < 1e-9);
}

#[test]
fn a_stretched_puma_reaches_and_one_too_short_says_by_how_much() {
    let chain = puma();
    let stretched = 433.07_f64.atan2(-20.32);
    let q = [0.0, -0.3, stretched, 0.1, 0.5, 0.2];
    let mut flange = LinkFrames::of(&chain, &q, &[]).flange;
    for configuration in PumaConfiguration::all().filter(|one| one.shoulder == ARM.configuration(&q).shoulder)
    {
        let joints = ARM.inverse(&flange, configuration, 0.1).unwrap();
        let there = LinkFrames::of(&chain, &joints, &[]).flange;
        assert!((there.translation.vector - flange.translation.vector).norm() < 1e-3, "{configuration:?}");
    }
    let outward = flange.translation.vector.normalize();
    flange.translation.vector += outward * 50.0;
    let error = ARM.inverse(&flange, ARM.configuration(&q), 0.0).unwrap_err();
    let NoSolution::OutOfReach { away_mm } = error else { panic!("{error}") };
    assert!((30.0..60.0).contains(&away_mm), "{error}");
}

#[test]
fn over_the_first_axis_both_arms_say_so() {
    let mut flange = LinkFrames::of(&puma(), &[0.0; 6], &[]).flange;
    flange.translation.vector = Vector3::new(0.0, 100.0, 300.0) + flange.rotation * Vector3::z() * 56.25;
    let configuration = ARM.configuration(&[0.0; 6]);
    assert!(matches!(ARM.inverse(&flange, configuration, 0.0), Err(NoSolution::OnFirstAxis { .. })));
    let pose = TeachMoverPose { point: Vector3::new(0.0, 0.0, 300.0), pitch: -FRAC_PI_2, roll: 0.0 };
    let error = TEACHMOVER.inverse(&pose, TeachMoverConfiguration::ALL[0]).unwrap_err();
    assert!(error.to_string().contains("first joint's axis"), "{error}");
}

#[test]
fn agins_two_poses_are_distinguished_as_left_and_right() {
    // Section 3.3 of the paper: the same hand attitude and wrist height by two configurations of the arm.
    let first = [90.0, 0.0, -180.0, 90.0, 0.0, 45.0_f64].map(f64::to_radians);
    let second = [-51.656, -180.0, 0.0, -51.656, 0.0, 45.0_f64].map(f64::to_radians);
    assert_ne!(ARM.configuration(&first).shoulder, ARM.configuration(&second).shoulder);
}
