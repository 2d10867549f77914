//! Surfaces of known form and unknown place.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use plumb_calibration::arm_model;
use plumb_calibration::arm_model::SurfaceShape;

/// A surface of known form.
#[derive(Debug, Clone, PartialEq)]
pub enum Surface {
    /// The outside of a convex body of planes, each free for itself: a plane has one, a pyramid four. Normals of length one, outward, and offsets, mm.
    Faces(Vec<(Vector3<f64>, f64)>),
    /// A ball, its middle and radius in mm.
    Sphere(Point3<f64>, f64),
}

/// How far a point is from a body, and from which part of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Away {
    /// The part, by its place among the model's surfaces.
    pub(super) part: usize,
    /// mm, outside positive.
    pub(super) distance: f64,
    /// How much nearer this part is than the next of the same body, mm.
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

    /// Its parts as surfaces of a model, each free to move: the faces of a body for themselves, a ball with its radius.
    pub(super) fn parts(&self, name: &str) -> Vec<arm_model::Surface> {
        let part = |name: String, shape| arm_model::Surface { name, shape, free: true, light: None };
        match self {
            Self::Faces(faces) => {
                let shapes = faces
                    .iter()
                    .map(|(normal, offset)| SurfaceShape::Plane { normal: *normal, offset: *offset });
                match faces.len() {
                    1 => shapes.map(|shape| part(name.to_owned(), shape)).collect(),
                    _ => shapes
                        .enumerate()
                        .map(|(face, shape)| part(format!("{name} {}", face + 1), shape))
                        .collect(),
                }
            }
            Self::Sphere(centre, radius) => {
                let shape =
                    SurfaceShape::Sphere { centre: centre.coords, radius: *radius, free_radius: true };
                vec![part(name.to_owned(), shape)]
            }
        }
    }
}

/// How far a point is outside the body that these parts bound; nothing of a body without parts.
pub(super) fn away(shapes: &[SurfaceShape], body: &Range<usize>, point: &Vector3<f64>) -> Option<Away> {
    let mut nearest: Option<Away> = None;
    for (part, shape) in shapes.iter().enumerate().take(body.end).skip(body.start) {
        let (distance, _) = shape.distance(point, &Vector3::z());
        nearest = Some(match nearest {
            None => Away { part, distance, lead: f64::INFINITY },
            Some(known) if distance > known.distance => {
                Away { part, distance, lead: distance - known.distance }
            }
            Some(known) => Away { lead: known.lead.min(known.distance - distance), ..known },
        });
    }
    nearest
}
