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
    /// The part, by its index among the model's surfaces.
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
        let faces = (0..4).map(|side| {
            let angle = yaw + f64::from(side) * std::f64::consts::FRAC_PI_2;
            // A face falls by the height over half the edge; its normal leans outward by as much.
            let (across, up) = (height_mm, edge_mm / 2.0);
            let outward = Vector3::new(angle.cos() * across, angle.sin() * across, up).normalize();
            (outward, outward.dot(&apex.coords))
        });
        Self::Faces(faces.collect())
    }

    /// Its parts as surfaces of a model, each free to move: the faces of a body for themselves, a ball with its radius.
    pub(super) fn parts(&self, name: &str) -> Vec<arm_model::Surface> {
        let shapes: Vec<SurfaceShape> = match self {
            Self::Faces(faces) => {
                let planes = faces.iter().map(|(normal, offset)| (*normal, *offset));
                planes.map(|(normal, offset)| SurfaceShape::Plane { normal, offset }).collect()
            }
            Self::Sphere(centre, radius) => {
                vec![SurfaceShape::Sphere { centre: centre.coords, radius: *radius, free_radius: true }]
            }
        };
        let alone = shapes.len() == 1;
        let parts = shapes.into_iter().enumerate().map(|(part, shape)| {
            let name = if alone { name.to_owned() } else { format!("{name} {}", part + 1) };
            arm_model::Surface { name, shape, free: true, light: None }
        });
        parts.collect()
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

#[cfg(test)]
mod surface_tests {
    use super::*;

    #[test]
    fn of_a_convex_body_the_part_farthest_below_a_point_is_nearest_and_leads_by_what_the_next_lies_behind() {
        let planes = [(Vector3::z(), 10.0), (Vector3::x(), 4.0), (Vector3::y(), 5.0)];
        let shapes = planes.map(|(normal, offset)| SurfaceShape::Plane { normal, offset });
        // 2 mm over the first, 1 mm within the second, 5 mm within the third.
        let point = Vector3::new(3.0, 0.0, 12.0);
        assert_eq!(away(&shapes, &(0..3), &point), Some(Away { part: 0, distance: 2.0, lead: 3.0 }));
        assert_eq!(away(&shapes, &(1..3), &point), Some(Away { part: 1, distance: -1.0, lead: 4.0 }));
        assert_eq!(
            away(&shapes, &(2..3), &point),
            Some(Away { part: 2, distance: -5.0, lead: f64::INFINITY })
        );
        assert_eq!(away(&shapes, &(3..3), &point), None);
    }

    #[test]
    fn the_parts_of_a_body_are_numbered_and_a_single_one_has_the_bodys_name() {
        let names = |surface: Surface| -> Vec<String> {
            surface.parts("thing").into_iter().map(|part| part.name).collect()
        };
        assert_eq!(names(Surface::plane(Vector3::z(), 5.0)), ["thing"]);
        assert_eq!(names(Surface::Sphere(Point3::origin(), 5.0)), ["thing"]);
        let pyramid = Surface::pyramid(Point3::new(10.0, 20.0, 30.0), 40.0, 30.0, 0.2);
        let Surface::Faces(faces) = &pyramid else { panic!("a pyramid has faces") };
        for (normal, offset) in faces {
            assert!((normal.norm() - 1.0).abs() < 1e-12);
            assert!(
                (normal.dot(&Vector3::new(10.0, 20.0, 30.0)) - offset).abs() < 1e-9,
                "the apex lies on every face"
            );
        }
        // The middle of the foot's edge that faces 0.2 rad lies on the first face, half an edge out and a height down.
        let foot = Vector3::new(10.0 + 20.0 * 0.2_f64.cos(), 20.0 + 20.0 * 0.2_f64.sin(), 0.0);
        assert!((faces[0].0.dot(&foot) - faces[0].1).abs() < 1e-9);
        assert_eq!(names(pyramid), ["thing 1", "thing 2", "thing 3", "thing 4"]);
    }
}
