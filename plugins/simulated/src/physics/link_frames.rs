//! An arm at rest in some pose: where everything is, and how gravity pulls on it.

use super::description::{GRAVITY, Motion};
use super::rigid::{Rigid, Screw, Vector};
use super::shape::Arm;

/// An arm at rest, in the world frame.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkFrames {
    /// The joints' axes where they now are.
    pub axes: Vec<Screw>,
    /// Carries a point of each link from home (base frame) to where it is; the link's own bending not included.
    pub world_from_home: Vec<Rigid>,
    /// The flange.
    pub world_from_flange: Rigid,
    /// The target, mm.
    pub target: Vector,
}

/// What hangs beyond some point of the arm: its mass, and its mass times its centre.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// kg.
    pub mass: f64,
    /// kg mm, world frame.
    pub first_moment: Vector,
}

impl Load {
    /// Adds a point mass.
    pub fn hang(&mut self, mass: f64, centre: Vector) {
        self.mass += mass;
        self.first_moment += centre * mass;
    }

    /// Its weight, N.
    pub fn weight(&self) -> Vector {
        Vector::Z * (-GRAVITY * self.mass)
    }

    /// Moment of its weight about `point`, N m.
    pub fn moment_about(&self, point: Vector) -> Vector {
        let lever = self.first_moment - point * self.mass;
        lever.cross(Vector::Z) * (-GRAVITY * 1e-3)
    }
}

impl Arm {
    /// The arm with its joints moved by `angles` (as read, rad, or mm of a slide) and each link displaced by `bends` at its far end (motions in the base frame at
    /// home; missing ones are none), on a base moved by `rocking` in the world.
    pub fn link_frames(&self, angles: &[f64], bends: &[Rigid], rocking: Rigid) -> LinkFrames {
        let mut motion = rocking * self.world_from_base;
        let mut axes = Vec::with_capacity(self.screws.len());
        let mut world_from_home = Vec::with_capacity(self.screws.len());
        for (joint, screw) in self.screws.iter().enumerate() {
            axes.push(Screw {
                point: motion.apply(screw.point),
                direction: motion.rotation.apply(screw.direction),
            });
            let angle =
                self.signs.get(joint).copied().unwrap_or(1.0) * angles.get(joint).copied().unwrap_or(0.0);
            motion = motion
                * match self.motions.get(joint) {
                    Some(Motion::Slides) => screw.slide(angle),
                    _ => screw.exponential(angle),
                };
            world_from_home.push(motion);
            if let Some(bend) = bends.get(joint) {
                motion = motion * *bend;
            }
        }
        LinkFrames {
            world_from_flange: motion * self.base_from_flange,
            target: motion.apply(self.target),
            axes,
            world_from_home,
        }
    }

    /// What hangs beyond each joint, the link after it included, with `payload` kg at the target.
    pub fn loads(&self, link_frames: &LinkFrames, payload: f64) -> Vec<Load> {
        let mut loads = vec![Load::default(); self.screws.len()];
        for weight in &self.weights {
            if let (Some(load), Some(motion)) =
                (loads.get_mut(weight.after), link_frames.world_from_home.get(weight.after))
            {
                load.hang(weight.mass, motion.apply(weight.centre));
            }
        }
        if let Some(last) = loads.last_mut() {
            last.hang(payload, link_frames.target);
        }
        let mut beyond = Load::default();
        for load in loads.iter_mut().rev() {
            beyond.mass += load.mass;
            beyond.first_moment += load.first_moment;
            *load = beyond;
        }
        loads
    }

    /// The moment with which gravity turns each joint, N m, or the force with which it pulls a slide along, N; positive towards greater readings.
    pub fn gravity_moments(&self, link_frames: &LinkFrames, loads: &[Load]) -> Vec<f64> {
        let joints = link_frames.axes.iter().zip(loads).zip(&self.signs);
        let along = |(((axis, load), sign), motion): (((&Screw, &Load), &f64), &Motion)| match motion {
            Motion::Turns => sign * axis.direction.dot(load.moment_about(axis.point)),
            Motion::Slides => sign * axis.direction.dot(load.weight()),
        };
        joints.zip(&self.motions).map(along).collect()
    }
}
