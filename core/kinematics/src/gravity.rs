//! What gravity does to an arm: moments about its joints, and how it would bend its links.

use std::ops::AddAssign;

use nalgebra::{Point3, Vector3};

use crate::link_frames::{JointFrame, LinkFrames};

/// Standard acceleration of free fall, m/s2.
pub const GRAVITY: f64 = 9.806_65;

/// Sine of the angle below which two axes count as parallel: what is left of it is an error of the arm.
const PARALLEL: f64 = 0.05;

/// Distance of two axes below which they count as one, mm.
const SHORT: f64 = 1e-3;

/// Where the common normal of two axes meets the second, base frame, mm; nothing where they count as parallel.
fn foot(first: &JointFrame, second: &JointFrame) -> Option<Vector3<f64>> {
    let cosine = first.axis.dot(&second.axis);
    let sine = first.axis.cross(&second.axis).norm();
    let apart = first.axis_point - second.axis_point;
    let along = (second.axis - first.axis * cosine).dot(&apart);
    (sine > PARALLEL).then(|| second.axis_point + second.axis * (along / (sine * sine)))
}

/// A mass fixed in the frame after one joint's row.
#[derive(Debug, Clone, PartialEq)]
pub struct Mass {
    /// Index of the joint it moves with.
    pub after: usize,
    /// kg.
    pub mass: f64,
    /// Its centre in that joint's frame, mm.
    pub centre: Vector3<f64>,
}

/// Everything with weight: the links' masses, and a load at the flange.
#[derive(Debug, Clone, Copy)]
pub struct Weights<'a> {
    /// Of the links.
    pub masses: &'a [Mass],
    /// At the flange, kg.
    pub payload: f64,
    /// Direction of gravity in the base frame, unit length.
    pub down: Vector3<f64>,
}

/// Weights that act together. All point the same way, so that one force with the sum of their first moments stands for them (Hibbeler 2013, Engineering Mechanics: Statics,
/// section 4.8, parallel forces).
#[derive(Debug, Clone, Copy)]
struct Load {
    /// N.
    weight: f64,
    /// The sum of each weight times its position, base frame, N mm.
    first_moment: Vector3<f64>,
}

impl Load {
    /// A weight (N) at a position (base frame, mm).
    fn at(weight: f64, position: Vector3<f64>) -> Self {
        Self { weight, first_moment: position * weight }
    }

    /// Its moment about a point (base frame, mm), N m, base frame; `down` is a unit vector.
    fn moment_about(&self, point: &Vector3<f64>, down: &Vector3<f64>) -> Vector3<f64> {
        (self.first_moment - point * self.weight).cross(down) * 1e-3
    }
}

impl AddAssign for Load {
    fn add_assign(&mut self, other: Self) {
        self.weight += other.weight;
        self.first_moment += other.first_moment;
    }
}

/// How a link bends for a flexibility of one: its far end's shift (mm per 1/(N m2)) and turn (rad per 1/(N m2)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sag {
    /// Of the far end, base frame.
    pub shift: Vector3<f64>,
    /// About the far end, base frame.
    pub rotation: Vector3<f64>,
    /// The far end, base frame, mm.
    pub end: Vector3<f64>,
}

impl Weights<'_> {
    /// No weight at all: for what depends on an arm's shape alone.
    pub const WITHOUT: Weights<'static> =
        Weights { masses: &[], payload: 0.0, down: Vector3::new(0.0, 0.0, -1.0) };

    /// The joint it moves with, weight (N) and position (base frame, mm) of everything that moves with a joint at or beyond `first`; of the load at the flange
    /// the joint is `usize::MAX`.
    pub fn beyond<'p>(
        &'p self,
        link_frames: &'p LinkFrames,
        first: usize,
    ) -> impl Iterator<Item = (usize, f64, Vector3<f64>)> + 'p {
        let masses = self.masses.iter().filter(move |mass| mass.after >= first).filter_map(|mass| {
            let link = link_frames.joints.get(mass.after)?;
            Some((mass.after, mass.mass * GRAVITY, (link.end * Point3::from(mass.centre)).coords))
        });
        let carried = (self.payload != 0.0).then_some((
            usize::MAX,
            self.payload * GRAVITY,
            link_frames.flange.translation.vector,
        ));
        masses.chain(carried)
    }

    /// The moment of gravity about each joint's axis, N m, positive in the axis's sense, into `moments` (cleared first). For
    /// a sliding joint it is still the moment about its axis. Where a later joint keeps its attitude, what rests on it does not rest on the drive
    /// before it: that one bears the moment it would have to do work against.
    pub fn moments(&self, link_frames: &LinkFrames, moments: &mut Vec<f64>) {
        moments.clear();
        moments.resize(link_frames.joints.len(), 0.0);
        // From the flange inwards, each joint carries its own masses and all that the next one does.
        let mut load = Load::at(self.payload * GRAVITY, link_frames.flange.translation.vector);
        for ((index, joint), moment) in link_frames.joints.iter().enumerate().zip(&mut *moments).rev() {
            for mass in self.masses.iter().filter(|mass| mass.after == index) {
                load += Load::at(mass.mass * GRAVITY, (joint.end * Point3::from(mass.centre)).coords);
            }
            *moment = joint.axis.dot(&load.moment_about(&joint.axis_point, &self.down));
        }
        link_frames.about_drives(moments);
    }

    /// The moment of gravity about the base's origin, N m, base frame: what would tip the arm over.
    pub fn overturning(&self, link_frames: &LinkFrames) -> Vector3<f64> {
        self.beyond(link_frames, 0)
            .map(|(_, weight, position)| position.cross(&(self.down * weight)) * 1e-3)
            .sum()
    }

    /// Where the link after a joint begins and ends, base frame, mm: from the joint's axis to the next, or to the flange, each where the common normal of two axes meets it, so
    /// that it does not matter where along an axis a row or a URDF puts its origin. Where the two axes are parallel they have no one common normal: the link then runs straight
    /// across, at the height of its own mass, or, without one, where its row arrives.
    pub fn link(&self, link_frames: &LinkFrames, joint: usize) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let here = link_frames.joints.get(joint)?;
        let start = self.begins(link_frames, joint)?;
        let Some(next) = link_frames.joints.get(joint + 1) else {
            return Some((start, link_frames.flange.translation.vector));
        };
        if let Some(end) = foot(here, next) {
            return Some((start, end));
        }
        let end = next.axis_point;
        let across = end - start - here.axis * here.axis.dot(&(end - start));
        if across.norm() < SHORT {
            return Some((start, end));
        }
        let own = || self.masses.iter().filter(move |mass| mass.after == joint && mass.mass > 0.0);
        let mass: f64 = own().map(|mass| mass.mass).sum();
        let centre = |mass: &Mass| (here.end * Point3::from(mass.centre)).coords * mass.mass;
        let at = if mass > 0.0 { own().map(centre).sum::<Vector3<f64>>() / mass } else { end };
        let start = start + here.axis * here.axis.dot(&(at - start));
        Some((start, start + across))
    }

    /// Where the link after a joint begins on the joint's axis: where the link before arrives, of the first joint at the point nearest to the base's origin.
    fn begins(&self, link_frames: &LinkFrames, joint: usize) -> Option<Vector3<f64>> {
        let here = link_frames.joints.get(joint)?;
        let Some(before) = joint.checked_sub(1) else {
            return Some(here.axis_point - here.axis * here.axis.dot(&here.axis_point));
        };
        match foot(link_frames.joints.get(before)?, here) {
            Some(foot) => Some(foot),
            None => self.link(link_frames, before).map(|(_, end)| end),
        }
    }

    /// How the link after a joint bends, as a beam clamped at the joint's end (Bernoulli): by the weight beyond its far end,
    /// and by its own where that sits along it. Nothing for a link without length.
    pub fn sag(&self, link_frames: &LinkFrames, joint: usize) -> Option<Sag> {
        let (start, end) = self.link(link_frames, joint)?;
        let along = end - start;
        let length = along.norm() * 1e-3;
        let direction = along.try_normalize(1e-6)?;
        let (mut shift, mut rotation) = (Vector3::zeros(), Vector3::zeros());
        let mut bend = |at: f64, load: &Load| {
            let force = self.down * load.weight;
            // The moment about the point of the beam at which the load acts.
            let moment = load.moment_about(&(start + direction * (at * 1e3)), &self.down);
            let bending = moment - direction * direction.dot(&moment);
            let shear = direction.cross(&force);
            let turned = bending * at + shear * (at * at / 2.0);
            let moved =
                bending.cross(&direction) * (at * at / 2.0) + shear.cross(&direction) * (at.powi(3) / 3.0);
            rotation += turned;
            // Beyond the load the link stays straight.
            shift += moved + turned.cross(&direction) * (length - at);
        };
        let mut carried = Load::at(0.0, end);
        for (after, weight, position) in self.beyond(link_frames, joint) {
            let load = Load::at(weight, position);
            match after == joint {
                // The link's own weight acts at its position along the link; all that hangs on the far end acts there.
                true => bend(((position - start).dot(&direction) * 1e-3).clamp(0.0, length), &load),
                false => carried += load,
            }
        }
        bend(length, &carried);
        Some(Sag { shift: shift * 1e3, rotation, end })
    }
}
