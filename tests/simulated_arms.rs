//! The simulated world's arms and the lab's chains share no code: here they are held against each other.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use plumb_kinematics::{Chain, Convention, Deviation, Joint, LinkFrames, Mass, Weights};
use plumb_simulated::physics::arms;
use plumb_simulated::physics::description::{self, ArmDescription};
use plumb_simulated::physics::imperfection::{Imperfection, Mechanism};
use plumb_simulated::physics::machine::{ArmState, Conditions, Machine};
use plumb_simulated::physics::random::Random;

const QUIET: Conditions = Conditions { time_s: 0.0, temperature_c: 20.0, payload_kg: 0.0 };

fn all_arms() -> Vec<ArmDescription> {
    arms::ARMS.iter().map(|(name, _)| arms::by_name(name).unwrap().unwrap()).collect()
}

fn chain(arm: &ArmDescription) -> Chain {
    let convention = match arm.convention {
        description::Convention::Distal => Convention::Distal,
        description::Convention::Proximal => Convention::Proximal,
    };
    let joint = |joint: &description::Joint| Joint {
        sign: joint.sign,
        ..Joint::turning(&joint.name, joint.length, joint.twist, joint.offset, joint.rest_angle)
    };
    Chain::new(convention, arm.joints.iter().map(joint).collect()).unwrap()
}

fn poses(arm: &ArmDescription) -> Vec<Vec<f64>> {
    let mut random = Random::new(17, &arm.name);
    (0..50).map(|_| arm.joints.iter().map(|_| random.between(-3.0, 3.0)).collect()).collect()
}

fn equilibrium(arm: &ArmDescription, imperfections: &[Imperfection], pose: &[f64]) -> ArmState {
    let mut machine = Machine::new(arm, imperfections);
    machine.go(pose, 0.0);
    machine.equilibrium(&QUIET).unwrap()
}

/// Greatest difference between the two flanges: mm, and of any direction cosine times a metre.
fn flanges_apart(arm_state: &ArmState, link_frames: &LinkFrames) -> f64 {
    let (world, lab) = (arm_state.link_frames.world_from_flange, link_frames.flange);
    let position: [f64; 3] = world.translation.into();
    let columns: [[f64; 3]; 3] = [world.rotation.x.into(), world.rotation.y.into(), world.rotation.z.into()];
    let mut apart = 0.0_f64;
    for row in 0..3 {
        apart = apart.max((position[row] - lab.translation.vector[row]).abs());
        for (column, axis) in columns.iter().enumerate() {
            apart = apart.max(1e3 * (axis[row] - lab.rotation.matrix()[(row, column)]).abs());
        }
    }
    apart
}

#[test]
fn ideal_poses_of_the_world_are_those_of_the_lab() {
    for arm in all_arms() {
        let chain = chain(&arm);
        for pose in poses(&arm) {
            let apart = flanges_apart(&equilibrium(&arm, &[], &pose), &LinkFrames::of(&chain, &pose, &[]));
            assert!(apart < 1e-9, "{} at {pose:?}: {apart} mm", arm.name);
        }
    }
}

#[test]
fn a_row_that_is_off_moves_both_arms_alike() {
    for arm in all_arms() {
        let chain = chain(&arm);
        let pose = poses(&arm).swap_remove(0);
        for joint in 0..arm.joints.len() {
            let (small, turn) = (0.7, 0.01);
            let zero = Deviation { theta: chain.joints[joint].sign * turn, ..Deviation::default() };
            for (mechanism, size, deviation) in [
                (Mechanism::JointZero { joint }, turn, zero),
                (Mechanism::LinkLength { joint }, small, Deviation { a: small, ..Deviation::default() }),
                (Mechanism::LinkOffset { joint }, small, Deviation { d: small, ..Deviation::default() }),
                (Mechanism::LinkTwist { joint }, turn, Deviation { alpha: turn, ..Deviation::default() }),
                (Mechanism::AxisSkew { joint }, turn, Deviation { beta: turn, ..Deviation::default() }),
            ] {
                let mut deviations = vec![Deviation::default(); arm.joints.len()];
                deviations[joint] = deviation;
                let arm_state =
                    equilibrium(&arm, &[Imperfection { mechanism: mechanism.clone(), size }], &pose);
                let apart = flanges_apart(&arm_state, &LinkFrames::of(&chain, &pose, &deviations));
                assert!(apart < 1e-9, "{}, {mechanism:?}: {apart} mm", arm.name);
            }
        }
    }
}

#[test]
fn gravity_pulls_both_arms_alike() {
    for arm in all_arms() {
        let chain = chain(&arm);
        let masses: Vec<Mass> = arm
            .weights
            .iter()
            .map(|weight| Mass {
                after: weight.after,
                mass: weight.mass,
                centre: <[f64; 3]>::from(weight.centre).into(),
            })
            .collect();
        for pose in poses(&arm) {
            let arm_state = equilibrium(&arm, &[], &pose);
            let link_frames = LinkFrames::of(&chain, &pose, &[]);
            let mut lab = Vec::new();
            let weights = Weights { masses: &masses, payload: 0.0, down: [0.0, 0.0, -1.0].into() };
            weights.moments(&link_frames, &mut lab);
            for (joint, ((world, lab), row)) in
                arm_state.moments.iter().zip(&lab).zip(&chain.joints).enumerate()
            {
                let apart = world - row.sign * lab;
                assert!(apart.abs() < 1e-9, "{}, joint {joint}: {world} and {lab} N m", arm.name);
            }
        }
    }
}
