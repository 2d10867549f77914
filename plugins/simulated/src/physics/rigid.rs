//! Vectors, rotations and rigid motions of this world. Written for it alone: nothing here is shared with the models that are judged by it.

use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A vector or point; lengths in mm unless the name says otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Vector {
    /// Component along x.
    pub x: f64,
    /// Component along y.
    pub y: f64,
    /// Component along z.
    pub z: f64,
}

impl Vector {
    /// No length at all.
    pub const ZERO: Vector = Vector::new(0.0, 0.0, 0.0);
    /// Unit vector along x.
    pub const X: Vector = Vector::new(1.0, 0.0, 0.0);
    /// Unit vector along y.
    pub const Y: Vector = Vector::new(0.0, 1.0, 0.0);
    /// Unit vector along z.
    pub const Z: Vector = Vector::new(0.0, 0.0, 1.0);

    /// A vector from its components.
    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self { x, y, z }
    }

    /// Scalar product.
    pub fn dot(self, other: Vector) -> f64 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Vector product.
    pub fn cross(self, other: Vector) -> Vector {
        Vector::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// Length.
    pub fn norm(self) -> f64 {
        self.dot(self).sqrt()
    }

    /// The part of this vector across the unit vector `direction`.
    pub fn across(self, direction: Vector) -> Vector {
        self - direction * self.dot(direction)
    }

    /// The vector of length one in the same direction; `None` for a vector without length.
    pub fn unit(self) -> Option<Vector> {
        let norm = self.norm();
        (norm > 0.0).then(|| self * (1.0 / norm))
    }
}

impl From<[f64; 3]> for Vector {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self::new(x, y, z)
    }
}

impl From<Vector> for [f64; 3] {
    fn from(vector: Vector) -> Self {
        [vector.x, vector.y, vector.z]
    }
}

impl Add for Vector {
    type Output = Vector;
    fn add(self, other: Vector) -> Vector {
        Vector::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl AddAssign for Vector {
    fn add_assign(&mut self, other: Vector) {
        *self = *self + other;
    }
}

impl Sub for Vector {
    type Output = Vector;
    fn sub(self, other: Vector) -> Vector {
        Vector::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl Neg for Vector {
    type Output = Vector;
    fn neg(self) -> Vector {
        Vector::new(-self.x, -self.y, -self.z)
    }
}

impl Mul<f64> for Vector {
    type Output = Vector;
    fn mul(self, factor: f64) -> Vector {
        Vector::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

/// A rotation, held as the images of the three unit vectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation {
    /// Where x goes.
    pub x: Vector,
    /// Where y goes.
    pub y: Vector,
    /// Where z goes.
    pub z: Vector,
}

impl Rotation {
    /// The rotation that leaves everything where it is.
    pub const IDENTITY: Rotation = Rotation { x: Vector::X, y: Vector::Y, z: Vector::Z };

    /// Turn by `angle` rad about the unit vector `axis` (Rodrigues).
    pub fn about(axis: Vector, angle: f64) -> Self {
        let (sine, cosine) = angle.sin_cos();
        let turned = |v: Vector| v * cosine + axis.cross(v) * sine + axis * (axis.dot(v) * (1.0 - cosine));
        Self { x: turned(Vector::X), y: turned(Vector::Y), z: turned(Vector::Z) }
    }

    /// Turn by the rotation vector `turn` (direction: axis, length: rad).
    pub fn by(turn: Vector) -> Self {
        match turn.unit() {
            Some(axis) => Self::about(axis, turn.norm()),
            None => Self::IDENTITY,
        }
    }

    /// Fixed-axis roll, pitch and yaw in rad: first about x, then y, then z.
    pub fn from_roll_pitch_yaw([roll, pitch, yaw]: [f64; 3]) -> Self {
        Self::about(Vector::Z, yaw) * Self::about(Vector::Y, pitch) * Self::about(Vector::X, roll)
    }

    /// The image of `vector`.
    pub fn apply(&self, vector: Vector) -> Vector {
        self.x * vector.x + self.y * vector.y + self.z * vector.z
    }

    /// The rotation back.
    pub fn inverse(&self) -> Self {
        Self {
            x: Vector::new(self.x.x, self.y.x, self.z.x),
            y: Vector::new(self.x.y, self.y.y, self.z.y),
            z: Vector::new(self.x.z, self.y.z, self.z.z),
        }
    }
}

impl Mul for Rotation {
    type Output = Rotation;
    fn mul(self, first: Rotation) -> Rotation {
        Rotation { x: self.apply(first.x), y: self.apply(first.y), z: self.apply(first.z) }
    }
}

/// A rigid motion: turn, then move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid {
    /// The turn.
    pub rotation: Rotation,
    /// The move, mm.
    pub translation: Vector,
}

impl Rigid {
    /// The motion that leaves everything where it is.
    pub const IDENTITY: Rigid = Rigid { rotation: Rotation::IDENTITY, translation: Vector::ZERO };

    /// A move without a turn.
    pub const fn moved(translation: Vector) -> Self {
        Self { rotation: Rotation::IDENTITY, translation }
    }

    /// A turn about the origin.
    pub const fn turned(rotation: Rotation) -> Self {
        Self { rotation, translation: Vector::ZERO }
    }

    /// A turn about `point`, then a move by `shift`.
    pub fn turned_about(point: Vector, rotation: Rotation, shift: Vector) -> Self {
        Self { rotation, translation: point - rotation.apply(point) + shift }
    }

    /// Where `point` ends up.
    pub fn apply(&self, point: Vector) -> Vector {
        self.rotation.apply(point) + self.translation
    }

    /// The motion back.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self { rotation, translation: -rotation.apply(self.translation) }
    }
}

impl Mul for Rigid {
    type Output = Rigid;
    fn mul(self, first: Rigid) -> Rigid {
        Rigid { rotation: self.rotation * first.rotation, translation: self.apply(first.translation) }
    }
}

/// The axis of a joint as a line in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Screw {
    /// Any point of the line, mm.
    pub point: Vector,
    /// Its direction, length one; positive turns follow the right hand.
    pub direction: Vector,
}

impl Screw {
    /// The exponential: the rigid motion of a turn by `angle` rad about the line.
    pub fn exponential(&self, angle: f64) -> Rigid {
        Rigid::turned_about(self.point, Rotation::about(self.direction, angle), Vector::ZERO)
    }

    /// The rigid motion of a slide by `length` mm along the line.
    pub fn slide(&self, length: f64) -> Rigid {
        Rigid::moved(self.direction * length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_screw_leaves_its_own_line_alone() {
        let screw = Screw { point: Vector::new(3.0, -2.0, 5.0), direction: Vector::new(0.6, 0.0, 0.8) };
        let on_the_line = screw.point + screw.direction * 7.0;
        assert!((screw.exponential(1.234).apply(on_the_line) - on_the_line).norm() < 1e-12);
    }

    #[test]
    fn a_motion_and_its_inverse_cancel() {
        let motion = Rigid::turned_about(
            Vector::new(1.0, 2.0, 3.0),
            Rotation::from_roll_pitch_yaw([0.3, -0.7, 2.1]),
            Vector::new(-4.0, 0.5, 9.0),
        );
        let point = Vector::new(11.0, -7.0, 0.25);
        assert!(((motion.inverse() * motion).apply(point) - point).norm() < 1e-12);
    }

    #[test]
    fn roll_comes_before_yaw() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let rotation = Rotation::from_roll_pitch_yaw([quarter, 0.0, quarter]);
        assert!((rotation.apply(Vector::Z) - Vector::X).norm() < 1e-12);
    }
}
