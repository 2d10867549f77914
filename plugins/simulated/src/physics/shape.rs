//! The true shape of an arm: the rows of its description with whatever deviates from paper, and the screws that follow from them.

use super::description::{ArmDescription, Convention, Motion, Weight};
use super::rigid::{Rigid, Rotation, Screw, Vector};

/// One joint and link as they really are.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Whether the joint turns or slides.
    pub motion: Motion,
    /// What lies between the row before and this one, beside its own numbers.
    mounted: Rigid,
    /// Length of the common normal, mm.
    pub length: f64,
    /// Twist about the common normal, rad.
    pub twist: f64,
    /// Offset along the axis, mm.
    pub offset: f64,
    /// Angle of the common normal at reading zero, rad.
    pub rest_angle: f64,
    /// Lean of the joint's axis about the y of the frame it turns in, rad; zero on paper.
    pub skew: f64,
    /// +1 or -1: sense of the reading.
    pub sign: f64,
}

/// The body of an arm, as built rather than as drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    convention: Convention,
    /// One row a joint, from the base outwards.
    pub rows: Vec<Row>,
    weights: Vec<Weight>,
    /// Where the base is.
    pub world_from_base: Rigid,
    /// The flange in the frame of the last row.
    flange: Rigid,
    /// Target in the flange's frame, mm.
    pub target: Vector,
}

/// A weight where it is when every joint reads zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarriedWeight {
    /// Joint that carries it.
    pub after: usize,
    /// kg.
    pub mass: f64,
    /// Centre at home, mm, base frame.
    pub centre: Vector,
}

/// An arm as a product of exponentials: all lines and points in the base frame at home, where every joint reads zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// The joints' axes at home.
    pub screws: Vec<Screw>,
    /// Sense of each joint's reading.
    pub signs: Vec<f64>,
    /// How each joint moves.
    pub motions: Vec<Motion>,
    /// Far end of each link at home: a point of the next axis, or the flange.
    pub link_ends: Vec<Vector>,
    /// What weighs.
    pub weights: Vec<CarriedWeight>,
    /// The flange at home.
    pub base_from_flange: Rigid,
    /// The target at home.
    pub target: Vector,
    /// Where the base is.
    pub world_from_base: Rigid,
}

impl Row {
    /// Moves the position where the joint reads zero by so much (rad, or mm of a slide), in the sense of its reading.
    pub fn shift_zero(&mut self, by: f64) {
        match self.motion {
            Motion::Turns => self.rest_angle += self.sign * by,
            Motion::Slides => self.offset += self.sign * by,
        }
    }
}

impl Shape {
    /// The shape on paper.
    pub fn nominal(description: &ArmDescription) -> Self {
        let rows = description.joints.iter().map(|joint| Row {
            motion: joint.motion,
            mounted: joint.mounted,
            length: joint.length,
            twist: joint.twist,
            offset: joint.offset,
            rest_angle: joint.rest_angle,
            skew: 0.0,
            sign: joint.sign,
        });
        Self {
            convention: description.convention,
            rows: rows.collect(),
            weights: description.weights.clone(),
            world_from_base: Rigid {
                rotation: Rotation::from_roll_pitch_yaw(description.base_orientation),
                translation: description.base_position,
            },
            flange: description.flange,
            target: description.target,
        }
    }

    /// The screws of this shape.
    pub fn arm(&self) -> Arm {
        let mut frame = Rigid::IDENTITY;
        let mut screws = Vec::with_capacity(self.rows.len());
        let mut base_from_row = Vec::with_capacity(self.rows.len());
        for row in &self.rows {
            let normal = Rigid::moved(Vector::X * row.length);
            let twist = Rigid::turned(Rotation::about(Vector::X, row.twist));
            let skew = Rigid::turned(Rotation::about(Vector::Y, row.skew));
            let rest = Rigid {
                rotation: Rotation::about(Vector::Z, row.rest_angle),
                translation: Vector::Z * row.offset,
            };
            let before = if self.convention == Convention::Proximal { twist * normal * skew } else { skew };
            frame = frame * row.mounted * before;
            screws.push(Screw { point: frame.translation, direction: frame.rotation.z });
            frame = frame * rest;
            if self.convention == Convention::Distal {
                frame = frame * normal * twist;
            }
            base_from_row.push(frame);
        }
        let base_from_flange = frame * self.flange;
        let mut link_ends: Vec<Vector> = screws.iter().skip(1).map(|screw| screw.point).collect();
        link_ends.push(base_from_flange.translation);
        let weights = self.weights.iter().filter_map(|weight| {
            let row = base_from_row.get(weight.after)?;
            Some(CarriedWeight { after: weight.after, mass: weight.mass, centre: row.apply(weight.centre) })
        });
        Arm {
            signs: self.rows.iter().map(|row| row.sign).collect(),
            motions: self.rows.iter().map(|row| row.motion).collect(),
            weights: weights.collect(),
            target: base_from_flange.apply(self.target),
            base_from_flange,
            world_from_base: self.world_from_base,
            screws,
            link_ends,
        }
    }
}
