#![allow(clippy::unwrap_used)]
//! Frames against plain homogeneous matrices, and twists and moments against finite differences.

use nalgebra::{Matrix4, Vector3, Vector4};
use plumb_kinematics::{Chain, Convention, Deviation, DhParameter, Joint, LinkFrames, Mass, Motion, Weights};
use proptest::prelude::*;

fn puma() -> Chain {
    let rows = [
        (0.0, -90.0, 0.0),
        (431.8, 0.0, 149.09),
        (-20.32, 90.0, 0.0),
        (0.0, -90.0, 433.07),
        (0.0, 90.0, 0.0),
        (0.0, 0.0, 56.25),
    ];
    chain(Convention::Distal, &rows)
}

fn panda() -> Chain {
    let rows = [
        (0.0, 0.0, 333.0),
        (0.0, -90.0, 0.0),
        (0.0, 90.0, 316.0),
        (82.5, 90.0, 0.0),
        (-82.5, -90.0, 384.0),
        (0.0, 90.0, 0.0),
        (88.0, 90.0, 0.0),
    ];
    chain(Convention::Proximal, &rows)
}

fn chain(convention: Convention, rows: &[(f64, f64, f64)]) -> Chain {
    let joints = rows
        .iter()
        .enumerate()
        .map(|(index, (a, alpha, d))| Joint::turning(&format!("j{index}"), *a, alpha.to_radians(), *d, 0.0))
        .collect();
    Chain::new(convention, joints).unwrap()
}

fn turn(axis: usize, angle: f64) -> Matrix4<f64> {
    let (s, c) = angle.sin_cos();
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut matrix = Matrix4::identity();
    matrix[(u, u)] = c;
    matrix[(v, v)] = c;
    matrix[(v, u)] = s;
    matrix[(u, v)] = -s;
    matrix
}

fn shift(axis: usize, length: f64) -> Matrix4<f64> {
    let mut matrix = Matrix4::identity();
    matrix[(axis, 3)] = length;
    matrix
}

fn flange_by_matrices(chain: &Chain, q: &[f64], deviations: &[Deviation]) -> Matrix4<f64> {
    let mut flange = Matrix4::identity();
    for ((joint, q), deviation) in chain.joints.iter().zip(q).zip(deviations) {
        let (a, alpha, d) = (joint.a + deviation.a, joint.alpha + deviation.alpha, joint.d + deviation.d);
        let theta = joint.theta + joint.sign * q + deviation.theta;
        flange *= match chain.convention {
            Convention::Distal => {
                turn(1, deviation.beta) * turn(2, theta) * shift(2, d) * shift(0, a) * turn(0, alpha)
            }
            Convention::Proximal => {
                turn(0, alpha) * shift(0, a) * turn(1, deviation.beta) * turn(2, theta) * shift(2, d)
            }
        };
    }
    flange
}

fn deviations(values: &[f64]) -> Vec<Deviation> {
    values
        .chunks(5)
        .map(|v| Deviation { theta: 0.02 * v[0], d: v[1], a: v[2], alpha: 0.02 * v[3], beta: 0.02 * v[4] })
        .collect()
}

proptest! {
    #[test]
    fn the_flange_is_the_product_of_the_rows(q in prop::collection::vec(-3.0..3.0f64, 7), v in prop::collection::vec(-1.0..1.0f64, 35)) {
        for chain in [puma(), panda()] {
            let deviations = deviations(&v);
            let flange = LinkFrames::of(&chain, &q, &deviations).flange.to_homogeneous();
            prop_assert!((flange - flange_by_matrices(&chain, &q, &deviations)).norm() < 1e-9);
        }
    }

    #[test]
    fn frames_are_the_same_whatever_they_were_before(q in prop::collection::vec(-3.0..3.0f64, 7), v in prop::collection::vec(-1.0..1.0f64, 35)) {
        let mut link_frames = LinkFrames::default();
        let halved: Vec<f64> = v.iter().map(|number| number / 2.0).collect();
        let (first, second) = (deviations(&v), deviations(&halved));
        // Only the pose changes, only the deviations, then the arm, which has a joint more or less.
        for (chain, deviations, turned) in
            [(puma(), &first, 0.0), (puma(), &first, 0.1), (puma(), &second, 0.1), (panda(), &second, 0.1), (puma(), &first, 0.1)]
        {
            let q: Vec<f64> = q.iter().map(|angle| angle + turned).collect();
            link_frames.update(&chain, &q, deviations);
            let flange = link_frames.flange.to_homogeneous();
            prop_assert!((flange - flange_by_matrices(&chain, &q, deviations)).norm() < 1e-9);
            prop_assert_eq!(link_frames.joints.len(), chain.len());
        }
    }

    #[test]
    fn every_twist_is_the_derivative_of_the_tip(q in prop::collection::vec(-3.0..3.0f64, 7), v in prop::collection::vec(-1.0..1.0f64, 35)) {
        let tool = Vector4::new(40.0, -10.0, 120.0, 1.0);
        for chain in [puma(), panda()] {
            let deviations = deviations(&v);
            let tip_of = |d: &[Deviation]| (flange_by_matrices(&chain, &q, d) * tool).xyz();
            let link_frames = LinkFrames::of(&chain, &q, &deviations);
            let tip: Vector3<f64> = tip_of(&deviations);
            for joint in 0..chain.len() {
                for dh_parameter in [DhParameter::Theta, DhParameter::D, DhParameter::A, DhParameter::Alpha, DhParameter::Beta] {
                    let step = 1e-5;
                    let (mut up, mut down) = (deviations.clone(), deviations.clone());
                    up[joint].add(dh_parameter, step);
                    down[joint].add(dh_parameter, -step);
                    let numeric = (tip_of(&up) - tip_of(&down)) / (2.0 * step);
                    let twist = link_frames.twist(joint, dh_parameter, &tip);
                    prop_assert!((twist.linear - numeric).norm() < 1e-4, "joint {joint} {dh_parameter:?}: {} against {numeric}", twist.linear);
                }
            }
        }
    }

    #[test]
    fn a_gravity_moment_is_the_fall_of_potential_energy(q in prop::collection::vec(-3.0..3.0f64, 6)) {
        let chain = puma();
        let masses = [
            Mass { after: 1, mass: 17.4, centre: Vector3::new(-363.8, 6.0, 77.4) },
            Mass { after: 2, mass: 4.8, centre: Vector3::new(14.0, 0.0, 70.0) },
            Mass { after: 5, mass: 1.14, centre: Vector3::new(0.0, 0.0, 60.0) },
        ];
        let down = Vector3::new(0.1, -0.2, -0.97).normalize();
        let payload = 1.5;
        let fallen = |q: &[f64]| {
            let link_frames = LinkFrames::of(&chain, q, &[]);
            let carried: f64 = masses.iter().map(|m| m.mass * (link_frames.joints[m.after].end * nalgebra::Point3::from(m.centre)).coords.dot(&down)).sum();
            (carried + payload * link_frames.flange.translation.vector.dot(&down)) * 9.80665e-3
        };
        let link_frames = LinkFrames::of(&chain, &q, &[]);
        let mut computed = Vec::new();
        Weights { masses: &masses, payload, down }.moments(&link_frames, &mut computed);
        for joint in 0..6 {
            let step = 1e-5;
            let (mut up, mut down_q) = (q.clone(), q.clone());
            up[joint] += step;
            down_q[joint] -= step;
            let numeric = (fallen(&up) - fallen(&down_q)) / (2.0 * step);
            prop_assert!((computed[joint] - numeric).abs() < 1e-5, "joint {joint}: {} against {numeric}", computed[joint]);
        }
    }
}

#[test]
fn val_poses_of_the_puma_agree_as_the_paper_needs() {
    let chain = puma();
    let flange = |q: [f64; 6]| LinkFrames::of(&chain, &q.map(f64::to_radians), &[]).flange;
    let (first, second) =
        (flange([90.0, 0.0, -180.0, 90.0, 0.0, 45.0]), flange([-51.656, -180.0, 0.0, -51.656, 0.0, 45.0]));
    assert!(first.rotation.angle_to(&second.rotation) < 1e-9);
    let wrist = |pose: nalgebra::IsometryMatrix3<f64>| (pose * nalgebra::Point3::new(0.0, 0.0, -56.25)).z;
    assert!((wrist(first) + 433.07).abs() < 1e-9 && (wrist(second) + 433.07).abs() < 1e-9);
    let ready = flange([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    assert!((ready.rotation * Vector3::z() - Vector3::z()).norm() < 1e-9);
}

#[test]
fn a_sliding_joint_moves_the_tip_along_its_axis() {
    let mut joints =
        vec![Joint::turning("turn", 300.0, 0.0, 0.0, 0.0), Joint::turning("slide", 0.0, 0.0, 50.0, 0.0)];
    joints[1].motion = Motion::Slides;
    joints[1].sign = -1.0;
    let chain = Chain::new(Convention::Distal, joints).unwrap();
    let tip = LinkFrames::of(&chain, &[0.0, 20.0], &[]).flange.translation.vector;
    assert!((tip - Vector3::new(300.0, 0.0, 30.0)).norm() < 1e-12);
}

#[test]
fn a_chain_with_a_name_used_twice_is_refused() {
    let joints =
        vec![Joint::turning("waist", 0.0, 0.0, 0.0, 0.0), Joint::turning("waist", 0.0, 0.0, 0.0, 0.0)];
    let error = Chain::new(Convention::Distal, joints).unwrap_err();
    assert_eq!(error.to_string(), "joint `waist` is named twice; joint names must differ");
}

#[test]
fn a_level_link_sags_as_the_textbook_says() {
    // A beam of 1 m along x, clamped at the joint, with 2 kg at its end and 3 kg at its middle: w L^3 / 3 and 5 w L^3 / 48.
    let chain = Chain::new(Convention::Distal, vec![Joint::turning("root", 1000.0, 0.0, 0.0, 0.0)]).unwrap();
    let masses = [Mass { after: 0, mass: 3.0, centre: Vector3::new(-500.0, 0.0, 0.0) }];
    let weights = Weights { masses: &masses, payload: 2.0, down: -Vector3::z() };
    let sag = weights.sag(&LinkFrames::of(&chain, &[0.0], &[]), 0).unwrap();
    let g = 9.806_65;
    let expected = -(2.0 * g / 3.0 + 5.0 * 3.0 * g / 48.0) * 1e3;
    assert!(
        (sag.shift - Vector3::new(0.0, 0.0, expected)).norm() < 1e-9,
        "{} against {expected}",
        sag.shift.z
    );
    let turned = 2.0 * g / 2.0 + 3.0 * g / 8.0;
    assert!((sag.rotation - Vector3::new(0.0, turned, 0.0)).norm() < 1e-12, "{}", sag.rotation);
}

#[test]
fn a_link_sags_under_several_weights_by_the_sum_of_what_it_sags_under_each() {
    // Of a linear beam deflections add up (Timoshenko 1955, superposition).
    let chain = puma();
    let link_frames = LinkFrames::of(&chain, &[0.3, -0.4, 0.9, 0.2, -0.7, 0.1], &[]);
    let masses = [
        Mass { after: 2, mass: 4.8, centre: Vector3::new(14.0, 20.0, 70.0) },
        Mass { after: 5, mass: 1.14, centre: Vector3::new(0.0, -30.0, 60.0) },
    ];
    let down = Vector3::new(0.1, -0.2, -0.97).normalize();
    let under = |masses: &[Mass], payload| Weights { masses, payload, down }.sag(&link_frames, 1).unwrap();
    let all = under(&masses, 1.5);
    let each = [under(&masses[..1], 0.0), under(&masses[1..], 0.0), under(&[], 1.5)];
    let shift: Vector3<f64> = each.iter().map(|sag| sag.shift).sum();
    let turn: Vector3<f64> = each.iter().map(|sag| sag.rotation).sum();
    assert!(shift.norm() > 1.0 && (all.shift - shift).norm() < 1e-9, "{} against {shift}", all.shift);
    assert!(turn.norm() > 1e-3 && (all.rotation - turn).norm() < 1e-12, "{} against {turn}", all.rotation);
}

/// The TeachMover's structure: the drive keeps the attitudes of forearm and hand. One of its joints counts the other way.
fn attitude_keeping() -> Chain {
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut joints = vec![
        Joint::turning("waist", 0.0, quarter, 195.0, 0.0),
        Joint::turning("shoulder", 177.8, 0.0, 0.0, 0.0),
        Joint::turning("elbow", 177.8, 0.0, 0.0, 0.0),
        Joint::turning("wrist", 0.0, quarter, 0.0, quarter),
        Joint::turning("roll", 0.0, 0.0, 109.0, 0.0),
    ];
    joints[2].less = Some(1);
    joints[3].less = Some(2);
    Chain::new(Convention::Distal, joints).unwrap()
}

#[test]
fn a_drive_that_keeps_attitudes_turns_the_upper_arm_alone() {
    let chain = attitude_keeping();
    let tip = |q: [f64; 5]| LinkFrames::of(&chain, &q, &[]).flange.translation.vector;
    let (a, b, pitch) = (0.6_f64, -1.4_f64, -1.5_f64);
    let radius = 177.8 * a.cos() + 177.8 * b.cos() + 109.0 * pitch.cos();
    let height = 195.0 + 177.8 * a.sin() + 177.8 * b.sin() + 109.0 * pitch.sin();
    let computed = tip([0.0, a, b, pitch, 0.0]);
    assert!((computed - Vector3::new(radius, 0.0, height)).norm() < 1e-9, "{computed}");
}

proptest! {
    #[test]
    fn frames_worked_out_anew_from_a_joint_on_are_those_worked_out_whole(
        q in prop::collection::vec(-1.4..1.4f64, 5),
        changed in 0usize..5,
        by in -0.2..0.2f64,
    ) {
        let chain = attitude_keeping();
        let mut deviations = vec![Deviation::default(); 5];
        let mut link_frames = LinkFrames::of(&chain, &q, &deviations);
        deviations[changed] = Deviation { theta: by, d: 3.0, a: -2.0, alpha: 0.5 * by, beta: -by };
        link_frames.update_from(changed, &chain, &q, &deviations);
        let whole = LinkFrames::of(&chain, &q, &deviations);
        prop_assert_eq!(link_frames.flange, whole.flange);
        for joint in 0..5 {
            prop_assert_eq!(link_frames.joints[joint].end, whole.joints[joint].end);
            for dh_parameter in [DhParameter::Theta, DhParameter::Alpha] {
                let tip = whole.flange.translation.vector;
                let [anew, whole] = [&link_frames, &whole].map(|frames| frames.twist(joint, dh_parameter, &tip));
                prop_assert_eq!(anew, whole);
            }
        }
    }

    #[test]
    fn what_a_drive_turns_and_bears_counts_the_attitudes_it_keeps(q in prop::collection::vec(-1.4..1.4f64, 5)) {
        let mut chain = attitude_keeping();
        chain.joints[2].sign = -1.0;
        let masses = [
            Mass { after: 1, mass: 0.9, centre: Vector3::new(-88.9, 0.0, 0.0) },
            Mass { after: 2, mass: 0.5, centre: Vector3::new(-88.9, 0.0, 0.0) },
            Mass { after: 4, mass: 0.4, centre: Vector3::new(0.0, 0.0, -54.5) },
        ];
        let down = -Vector3::z();
        let link_frames = LinkFrames::of(&chain, &q, &[]);
        let tip = link_frames.flange.translation.vector;
        let mut moments = Vec::new();
        Weights { masses: &masses, payload: 0.3, down }.moments(&link_frames, &mut moments);
        let fallen = |deviations: &[Deviation]| {
            let link_frames = LinkFrames::of(&chain, &q, deviations);
            let carried: f64 = masses.iter().map(|m| m.mass * (link_frames.joints[m.after].end * nalgebra::Point3::from(m.centre)).coords.dot(&down)).sum();
            (carried + 0.3 * link_frames.flange.translation.vector.dot(&down)) * 9.80665e-3
        };
        for joint in 0..5 {
            let step = 1e-5;
            let nudged = |by: f64| {
                let mut all = vec![Deviation::default(); 5];
                all[joint].theta = by;
                all
            };
            let at = |by: f64| LinkFrames::of(&chain, &q, &nudged(by)).flange.translation.vector;
            let numeric = (at(step) - at(-step)) / (2.0 * step);
            let twist = link_frames.twist(joint, DhParameter::Theta, &tip);
            prop_assert!((twist.linear - numeric).norm() < 1e-4, "joint {joint}: {} against {numeric}", twist.linear);
            let moment = (fallen(&nudged(step)) - fallen(&nudged(-step))) / (2.0 * step);
            prop_assert!((moments[joint] - moment).abs() < 1e-5, "joint {joint}: {} against {moment}", moments[joint]);
            let mut turned = q.clone();
            turned[joint] += step;
            let by_coordinate = LinkFrames::of(&chain, &turned, &[]).flange.translation.vector;
            let by_deviation = at(step * chain.joints[joint].sign);
            prop_assert!((by_coordinate - by_deviation).norm() < 1e-9);
        }
    }
}

/// A SCARA's upper arm and forearm, 320 mm over the floor, its forearm's axis drawn as far up as `drawn` says: base, row of the shoulder, row of the elbow, mm.
fn scara(drawn: [f64; 3]) -> (Chain, f64, Vec<Mass>) {
    let [base, shoulder, elbow] = drawn;
    let joints = vec![
        Joint::turning("shoulder", 300.0, 0.0, shoulder, 0.0),
        Joint::turning("elbow", 250.0, 0.0, elbow, 0.0),
    ];
    let chain = Chain::new(Convention::Distal, joints).unwrap();
    // The masses are where they are, whatever the rows: in the frames after them their heights differ.
    let masses = vec![
        Mass { after: 0, mass: 4.0, centre: Vector3::new(-140.0, 10.0, 320.0 - base - shoulder) },
        Mass { after: 1, mass: 3.0, centre: Vector3::new(-100.0, 0.0, 300.0 - base - shoulder - elbow) },
    ];
    (chain, base, masses)
}

#[test]
fn how_a_link_bends_does_not_depend_on_where_along_parallel_axes_the_rows_are() {
    let bent = |drawn: [f64; 3], position: Vector3<f64>| {
        let (chain, base, masses) = scara(drawn);
        let weights = Weights { masses: &masses, payload: 0.0, down: -Vector3::z() };
        let sag = weights.sag(&LinkFrames::of(&chain, &[0.4, -1.1], &[]), 0).unwrap();
        let here = position - Vector3::z() * base;
        sag.shift + sag.rotation.cross(&(here - sag.end))
    };
    for position in [Vector3::new(300.0, 200.0, 320.0), Vector3::new(420.0, -50.0, 150.0)] {
        let metal = bent([320.0, 0.0, 0.0], position);
        assert!(metal.norm() > 10.0, "{metal}");
        for drawn in [[0.0, 0.0, 0.0], [0.0, 320.0, 0.0], [0.0, 0.0, 320.0], [-50.0, 150.0, 77.0]] {
            let other = bent(drawn, position);
            assert!((other - metal).norm() < 1e-9 * metal.norm(), "{drawn:?}: {other} {metal}");
        }
    }
}

#[test]
fn where_along_parallel_axes_rows_put_their_origins_says_nothing_of_the_links() {
    // Joints two and three of a PUMA turn about parallel axes; a part of the offset may as well be the next row's.
    let published = puma();
    let mut moved = puma();
    moved.joints[1].d += 70.0;
    moved.joints[2].d -= 70.0;
    let own = |height: f64| [Mass { after: 1, mass: 5.0, centre: Vector3::new(-200.0, 10.0, height) }];
    for q in [[0.3, -0.7, 1.1, 0.2, -0.4], [-2.0, 0.4, -1.5, 1.0, 0.9]] {
        let links = [(&published, own(20.0)), (&moved, own(-50.0))].map(|(chain, masses)| {
            let link_frames = LinkFrames::of(chain, &q, &[]);
            let weights = Weights { masses: &masses, payload: 1.0, down: -Vector3::z() };
            [0, 1, 2, 3].map(|joint| weights.link(&link_frames, joint).unwrap())
        });
        for (link, (as_published, as_moved)) in links[0].iter().zip(&links[1]).enumerate() {
            let off = (as_published.0 - as_moved.0).norm() + (as_published.1 - as_moved.1).norm();
            assert!(off < 1e-9, "link {link}: {as_published:?} {as_moved:?}");
        }
        // One link begins where the one before ends.
        assert!((links[0][1].1 - links[0][2].0).norm() < 1e-9);
    }
}
