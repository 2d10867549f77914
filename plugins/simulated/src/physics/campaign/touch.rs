//! Touching: a ball on the arm is set into sockets, again and again from elsewhere, and only the joint angles are read.

use crate::physics::imperfection::Imperfection;
use crate::physics::link_frames::LinkFrames;
use crate::physics::machine::{Conditions, Machine, NoEquilibrium};
use crate::physics::random::Random;
use crate::physics::rigid::{Rigid, Vector};
use crate::physics::shape::{Arm, Shape};

use super::specification::Specification;
use super::visit::{Visit, anywhere, windows};

/// Sockets on the table.
const SOCKETS: usize = 6;
/// The operator stops jogging when the ball is this near to where it belongs, mm.
const SEATED: f64 = 2e-3;

/// Where the sockets are: positions that the arm on paper reaches, mm in the world.
pub(super) fn sockets(specification: &Specification, seed: u64) -> Vec<Vector> {
    let windows = windows(specification, &mut Random::new(seed, "poses"));
    let mut random = Random::new(seed, "sockets");
    let arm = Shape::nominal(&specification.arm).arm();
    (0..SOCKETS).map(|_| on_paper(&arm, &anywhere(&windows, &mut random)).target).collect()
}

/// Ways to reach the sockets, each with its socket (from 0): poses in degrees that put the arm on paper there. There may be fewer than asked.
pub(super) fn poses(specification: &Specification, seed: u64, random: &mut Random) -> Vec<(usize, Vec<f64>)> {
    let windows = windows(specification, &mut Random::new(seed, "poses"));
    let arm = Shape::nominal(&specification.arm).arm();
    let positions = sockets(specification, seed);
    let inside =
        |pose: &[f64]| pose.iter().zip(&windows).all(|(angle, [low, high])| (*low..=*high).contains(angle));
    let mut find = |socket: usize, goal: Vector| {
        (0..100).find_map(|_| {
            let start = anywhere(&windows, random).iter().map(|angle| angle.to_radians()).collect();
            let pose: Vec<f64> = reach(&arm, start, goal)?.iter().map(|angle| angle.to_degrees()).collect();
            inside(&pose).then_some((socket, pose))
        })
    };
    let requested = (0..specification.poses).filter_map(|index| {
        let socket = index % SOCKETS;
        find(socket, *positions.get(socket)?)
    });
    requested.collect()
}

/// Jogs an arm with these imperfections into its sockets, one visit after the other, each off by how badly the ball sits; the visits' commands become
/// what the operator then reads.
pub(super) fn seat(
    specification: &Specification,
    seed: u64,
    visits: &mut [Visit],
    imperfections: &[Imperfection],
    off: &[Vec<f64>],
) -> Result<(), NoEquilibrium> {
    let positions = sockets(specification, seed);
    let mut machine = Machine::new(&specification.arm, imperfections);
    machine.go(&vec![0.0; specification.arm.joints.len()], 0.0);
    for (visit, off) in visits.iter_mut().zip(off) {
        let Some(position) = visit.touch.and_then(|socket| positions.get(socket)) else { continue };
        let shift = |axis: usize| off.get(axis).copied().unwrap_or(0.0);
        let goal = *position + Vector::new(shift(0), shift(1), shift(2));
        for _ in 0..12 {
            let link_frames = equilibrium(&mut machine, visit)?;
            let missing = goal - link_frames.target;
            if missing.norm() < SEATED {
                break;
            }
            let steps = steps_towards(&link_frames, missing);
            let turns = specification.arm.joints.iter().zip(steps).map(|(joint, step)| joint.sign * step);
            let moved = visit.commanded.iter().zip(turns).map(|(angle, turn)| (angle + turn).to_degrees());
            let moved = moved.collect();
            visit.command(moved);
        }
        equilibrium(&mut machine, visit)?;
    }
    Ok(())
}

fn equilibrium(machine: &mut Machine, visit: &Visit) -> Result<LinkFrames, NoEquilibrium> {
    machine.go(&visit.beyond(), visit.time_s);
    machine.go(&visit.commanded, visit.time_s);
    let conditions =
        Conditions { time_s: visit.time_s, temperature_c: visit.temperature_c, payload_kg: visit.payload_kg };
    Ok(machine.equilibrium(&conditions)?.link_frames)
}

fn on_paper(arm: &Arm, pose_deg: &[f64]) -> LinkFrames {
    let angles: Vec<f64> = pose_deg.iter().map(|angle| angle.to_radians()).collect();
    arm.link_frames(&angles, &[], Rigid::IDENTITY)
}

/// Joint angles (rad) near `angles` that put the target at `goal`; `None` when the way there is barred.
fn reach(arm: &Arm, mut angles: Vec<f64>, goal: Vector) -> Option<Vec<f64>> {
    for _ in 0..60 {
        let link_frames = arm.link_frames(&angles, &[], Rigid::IDENTITY);
        let missing = goal - link_frames.target;
        if missing.norm() < 1e-6 {
            return Some(angles);
        }
        for ((angle, step), sign) in
            angles.iter_mut().zip(steps_towards(&link_frames, missing)).zip(&arm.signs)
        {
            *angle += sign * step;
        }
    }
    None
}

/// The smallest turns of the joints (rad about their axes) that move the target by `missing`, damped where the arm is near the edge of its reach, and
/// none above a fifth of a radian.
fn steps_towards(link_frames: &LinkFrames, missing: Vector) -> Vec<f64> {
    let moves: Vec<Vector> =
        link_frames.axes.iter().map(|axis| axis.direction.cross(link_frames.target - axis.point)).collect();
    // J J^T + 1 mm^2, column by column.
    let mut columns = [Vector::X, Vector::Y, Vector::Z];
    for one in &moves {
        columns[0] += *one * one.x;
        columns[1] += *one * one.y;
        columns[2] += *one * one.z;
    }
    let volume = columns[0].dot(columns[1].cross(columns[2]));
    let fraction = |a: usize, b: usize| missing.dot(columns[a].cross(columns[b])) / volume;
    let pull = Vector::new(fraction(1, 2), fraction(2, 0), fraction(0, 1));
    let steps: Vec<f64> = moves.iter().map(|one| one.dot(pull)).collect();
    let greatest = steps.iter().fold(0.0_f64, |most, step| most.max(step.abs()));
    let factor = if greatest > 0.2 { 0.2 / greatest } else { 1.0 };
    steps.into_iter().map(|step| step * factor).collect()
}
