//! Surfaces of known form and unknown place.

use nalgebra::{Point3, Rotation3, Vector3};

/// A surface of known form.
#[derive(Debug, Clone, PartialEq)]
pub enum Surface {
    /// The outside of a convex body of planes, each free for itself: a plane has one, a pyramid four. Normals of length one, outward, and offsets, mm.
    Faces(Vec<(Vector3<f64>, f64)>),
    /// A ball, its middle and radius in mm.
    Sphere(Point3<f64>, f64),
}

/// How far a point is from a surface, and from which part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Away {
    pub(super) part: usize,
    pub(super) distance: f64,
    /// How much nearer this part is than the next of the same surface, mm.
    pub(super) lead: f64,
}

impl Surface {
    /// A plane.
    pub fn plane(normal: Vector3<f64>, offset_mm: f64) -> Self {
        Self::Faces(vec![(normal.normalize(), offset_mm)])
    }

    /// The faces of a pyramid on a square foot, by its apex, the foot's edge, its height (mm) and its turn about the vertical, rad.
    pub fn pyramid(apex: Point3<f64>, edge_mm: f64, height_mm: f64, yaw: f64) -> Self {
        let face = |side: u32| {
            let angle = yaw + f64::from(side) * std::f64::consts::FRAC_PI_2;
            let outward =
                Vector3::new(angle.cos() * height_mm, angle.sin() * height_mm, edge_mm / 2.0).normalize();
            (outward, outward.dot(&apex.coords))
        };
        Self::Faces((0..4).map(face).collect())
    }

    /// How many numbers place it.
    pub(super) fn freedoms(&self) -> usize {
        match self {
            Self::Faces(faces) => 3 * faces.len(),
            Self::Sphere(..) => 4,
        }
    }

    /// How far a point is outside.
    pub(super) fn away(&self, point: &Point3<f64>) -> Away {
        match self {
            Self::Faces(faces) => {
                let (mut part, mut first, mut second) = (0, f64::NEG_INFINITY, f64::NEG_INFINITY);
                for (place, (normal, offset)) in faces.iter().enumerate() {
                    let distance = normal.dot(&point.coords) - offset;
                    if distance > first {
                        (part, second, first) = (place, first, distance);
                    } else {
                        second = second.max(distance);
                    }
                }
                Away { part, distance: first, lead: first - second }
            }
            Self::Sphere(..) => Away { part: 0, distance: self.distance(0, point), lead: f64::INFINITY },
        }
    }

    /// How far a point is from one part.
    pub(super) fn distance(&self, part: usize, point: &Point3<f64>) -> f64 {
        match self {
            Self::Faces(faces) => {
                faces.get(part).map_or(0.0, |(normal, offset)| normal.dot(&point.coords) - offset)
            }
            Self::Sphere(centre, radius) => (point - centre).norm() - radius,
        }
    }

    /// Moves one of the numbers that place it: for each face two tilts about points near `about` (rad at 100 mm) and a shift, mm; for a ball its middle and
    /// radius, mm.
    pub(super) fn shift(&mut self, freedom: usize, by: f64, about: &Point3<f64>) {
        match self {
            Self::Faces(faces) => {
                let Some((normal, offset)) = faces.get_mut(freedom / 3) else { return };
                match freedom % 3 {
                    2 => *offset += by,
                    which => {
                        let other = if normal.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
                        let first = normal.cross(&other).normalize();
                        let axis = if which == 0 { first } else { normal.cross(&first) };
                        let out = normal.dot(&about.coords) - *offset;
                        let foot = about.coords - *normal * out;
                        *normal = Rotation3::new(axis * (by / 100.0)) * *normal;
                        *offset = normal.dot(&foot);
                    }
                }
            }
            Self::Sphere(centre, radius) => match freedom {
                3 => *radius += by,
                axis => {
                    if let Some(coordinate) = centre.coords.get_mut(axis) {
                        *coordinate += by;
                    }
                }
            },
        }
    }
}
