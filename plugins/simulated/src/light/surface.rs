//! Surfaces light falls on.

use crate::physics::rigid::{Rigid, Vector};

/// A surface that scatters light evenly.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Its form.
    pub form: Form,
    /// How much light it sends back, 0 to 1.
    pub reflectance: f64,
    /// Part of it that differs, if any.
    pub spot: Option<Spot>,
}

/// A round spot of another reflectance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Its middle, mm.
    pub centre: Vector,
    /// mm.
    pub radius: f64,
    /// 0 to 1.
    pub reflectance: f64,
}

/// The form of a surface.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// A plane without end, seen from the side its normal points to.
    Plane {
        /// A point of it, mm.
        point: Vector,
        /// Of length one.
        normal: Vector,
    },
    /// What lies behind all of these planes: boxes and pyramids.
    Polyhedron {
        /// Each a point and an outward normal of length one.
        faces: Vec<(Vector, Vector)>,
    },
    /// A ball.
    Sphere {
        /// mm.
        centre: Vector,
        /// mm.
        radius: f64,
    },
    /// A ball that is not round, its axes level and upright: the bowl of a spoon, the bottom of a cup.
    Ellipsoid {
        /// mm.
        centre: Vector,
        /// Half of its extent along its own x, y and z, mm.
        halves: [f64; 3],
        /// How far it is turned about the vertical, rad.
        yaw: f64,
    },
    /// An upright tube, open at its ends, thin-walled: the wall of a cup.
    Tube {
        /// The middle of its foot, mm.
        foot: Vector,
        /// mm.
        radius: f64,
        /// mm.
        height: f64,
    },
}

/// Where a ray falls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// From where the ray began, mm.
    pub distance: f64,
    /// Of the surface there, toward where the ray came from, length one.
    pub normal: Vector,
    /// Of the surface there.
    pub reflectance: f64,
    /// Which surface, and which face of it.
    pub patch: (usize, usize),
}

/// Nearer than this a ray does not fall on the surface it began on, mm.
const SKIN: f64 = 1e-6;

impl Form {
    /// A box that is upright, turned about the vertical, by its centre and its edges, mm and rad.
    pub fn block(centre: Vector, edges: [f64; 3], yaw: f64) -> Form {
        let (sine, cosine) = yaw.sin_cos();
        let along = [Vector::new(cosine, sine, 0.0), Vector::new(-sine, cosine, 0.0), Vector::Z];
        let faces = along.iter().zip(edges).flat_map(|(axis, edge)| {
            [1.0, -1.0].map(|side| (centre + *axis * (side * edge / 2.0), *axis * side))
        });
        Form::Polyhedron { faces: faces.collect() }
    }

    /// A pyramid on a square foot, turned about the vertical, by its apex, its foot's edge and its height, mm and rad.
    pub fn pyramid(apex: Vector, edge: f64, height: f64, yaw: f64) -> Form {
        let steep = (edge / 2.0).hypot(height);
        let mut faces: Vec<(Vector, Vector)> = (0..4)
            .map(|side| {
                let (sine, cosine) = (yaw + f64::from(side) * std::f64::consts::FRAC_PI_2).sin_cos();
                let outward =
                    Vector::new(cosine, sine, 0.0) * (height / steep) + Vector::Z * (edge / 2.0 / steep);
                (apex, outward)
            })
            .collect();
        faces.push((apex - Vector::Z * height, -Vector::Z));
        Form::Polyhedron { faces }
    }

    /// Where a ray first falls on it from outside: the distance, the normal and the face.
    fn meet(&self, from: Vector, toward: Vector) -> Option<Meeting> {
        match self {
            Form::Plane { point, normal } => {
                let falling = toward.dot(*normal);
                let distance = (*point - from).dot(*normal) / falling;
                (falling < 0.0 && distance > SKIN).then_some((distance, *normal, 0))
            }
            Form::Polyhedron { faces } => meet_polyhedron(faces, from, toward),
            Form::Sphere { centre, radius } => meet_sphere(*centre, *radius, from, toward),
            Form::Ellipsoid { centre, halves, yaw } => meet_ellipsoid((*centre, *halves, *yaw), from, toward),
            Form::Tube { foot, radius, height } => meet_tube((*foot, *radius, *height), from, toward),
        }
    }
}

/// Where a ray meets a form: the distance, the normal and the face.
type Meeting = (f64, Vector, usize);

/// The ray enters a convex body where it has passed the last of the faces that it falls on, if it has not left through another by then.
fn meet_polyhedron(faces: &[(Vector, Vector)], from: Vector, toward: Vector) -> Option<Meeting> {
    let (mut enters, mut leaves) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut through = None;
    for (face, (point, normal)) in faces.iter().enumerate() {
        let falling = toward.dot(*normal);
        let outside = (from - *point).dot(*normal);
        if falling == 0.0 {
            if outside > 0.0 {
                return None;
            }
            continue;
        }
        let distance = -outside / falling;
        if falling > 0.0 {
            leaves = leaves.min(distance);
        } else if distance > enters {
            enters = distance;
            through = Some((*normal, face));
        }
    }
    let (normal, face) = through?;
    (enters < leaves && enters > SKIN).then_some((enters, normal, face))
}

fn meet_sphere(centre: Vector, radius: f64, from: Vector, toward: Vector) -> Option<Meeting> {
    let to_centre = centre - from;
    let nearest = to_centre.dot(toward);
    let inside = radius * radius - (to_centre.dot(to_centre) - nearest * nearest);
    let distance = nearest - inside.max(0.0).sqrt();
    let normal = (from + toward * distance - centre) * (1.0 / radius);
    (inside > 0.0 && distance > SKIN).then_some((distance, normal, 0))
}

/// Of an ellipsoid by its centre, its half axes and its turn about the vertical: met where it is a ball of radius 1.
fn meet_ellipsoid(
    (centre, [a, b, c], yaw): (Vector, [f64; 3], f64),
    from: Vector,
    toward: Vector,
) -> Option<Meeting> {
    let (sine, cosine) = yaw.sin_cos();
    let own = |vector: Vector| {
        Vector::new(vector.x * cosine + vector.y * sine, vector.y * cosine - vector.x * sine, vector.z)
    };
    // Where it is a ball of radius 1.
    let round = |vector: Vector| Vector::new(vector.x / a, vector.y / b, vector.z / c);
    let (start, way) = (round(own(from - centre)), round(own(toward)));
    let (square, along, outside) = (way.dot(way), start.dot(way), start.dot(start) - 1.0);
    let inside = along * along - square * outside;
    let distance = (-along - inside.max(0.0).sqrt()) / square;
    let steep = round(start + way * distance);
    let normal = Vector::new(steep.x * cosine - steep.y * sine, steep.x * sine + steep.y * cosine, steep.z);
    (inside > 0.0 && distance > SKIN).then_some((distance, normal.unit()?, 0))
}

/// Of an upright tube by the middle of its foot, its radius and its height.
fn meet_tube((foot, radius, height): (Vector, f64, f64), from: Vector, toward: Vector) -> Option<Meeting> {
    let flat = |vector: Vector| Vector::new(vector.x, vector.y, 0.0);
    let (start, way) = (flat(from - foot), flat(toward));
    let (a, b, c) = (way.dot(way), start.dot(way), start.dot(start) - radius * radius);
    let root = (b * b - a * c).max(0.0).sqrt();
    if a <= 0.0 || b * b <= a * c {
        return None;
    }
    // The outside of the near wall, or over its rim the inside of the far one.
    [(-b - root) / a, (-b + root) / a].into_iter().enumerate().find_map(|(face, distance)| {
        let point = from + toward * distance - foot;
        let normal = flat(point) * (1.0 / radius);
        let facing = if normal.dot(toward) < 0.0 { normal } else { -normal };
        (distance > SKIN && (0.0..=height).contains(&point.z)).then_some((distance, facing, face))
    })
}

/// Where a ray (of a direction of length one) falls first.
pub fn first_hit(surfaces: &[Surface], from: Vector, toward: Vector) -> Option<Hit> {
    let mut first: Option<Hit> = None;
    for (index, surface) in surfaces.iter().enumerate() {
        let Some((distance, normal, face)) = surface.form.meet(from, toward) else { continue };
        if first.is_none_or(|first| distance < first.distance) {
            let point = from + toward * distance;
            let spot = surface.spot.filter(|spot| (point - spot.centre).norm() < spot.radius);
            let reflectance = spot.map_or(surface.reflectance, |spot| spot.reflectance);
            first = Some(Hit { distance, normal, reflectance, patch: (index, face) });
        }
    }
    first
}

/// Whether nothing is between a point on a surface and another.
pub fn is_clear(surfaces: &[Surface], from: Vector, to: Vector) -> bool {
    let way = to - from;
    let length = way.norm();
    let toward = way * (1.0 / length);
    surfaces.iter().all(|surface| {
        surface.form.meet(from, toward).is_none_or(|(distance, ..)| distance < 1e-3 || distance >= length)
    })
}

/// A pose from a position and fixed-axis roll, pitch and yaw, mm and rad.
pub fn pose(position: [f64; 3], turn: [f64; 3]) -> Rigid {
    Rigid {
        rotation: crate::physics::rigid::Rotation::from_roll_pitch_yaw(turn),
        translation: position.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hit(form: Form, from: [f64; 3], toward: [f64; 3]) -> Option<(f64, Vector)> {
        let surface = Surface { form, reflectance: 1.0, spot: None };
        let toward = Vector::from(toward).unit()?;
        first_hit(&[surface], from.into(), toward).map(|hit| (hit.distance, hit.normal))
    }

    #[test]
    fn rays_fall_on_forms_where_drawings_say() {
        let down = [0.0, 0.0, -1.0];
        let block = Form::block(Vector::new(0.0, 0.0, 10.0), [40.0, 20.0, 20.0], 0.0);
        assert_eq!(hit(block.clone(), [5.0, 5.0, 100.0], down), Some((80.0, Vector::Z)));
        assert_eq!(hit(block, [5.0, 11.0, 100.0], down), None);
        let pyramid = Form::pyramid(Vector::new(0.0, 0.0, 60.0), 120.0, 60.0, 0.0);
        let (distance, normal) = hit(pyramid, [30.0, 5.0, 100.0], down).unwrap();
        assert!((distance - 70.0).abs() < 1e-9 && (normal.x - 0.5_f64.sqrt()).abs() < 1e-9);
        let ball = Form::Sphere { centre: Vector::new(0.0, 0.0, 25.0), radius: 25.0 };
        assert_eq!(hit(ball, [0.0, 0.0, 100.0], down), Some((50.0, Vector::Z)));
        let bowl = Form::Ellipsoid {
            centre: Vector::new(0.0, 0.0, 5.0),
            halves: [20.0, 10.0, 5.0],
            yaw: std::f64::consts::FRAC_PI_2,
        };
        let (distance, normal) = hit(bowl.clone(), [0.0, 0.0, 100.0], down).unwrap();
        assert!((distance - 90.0).abs() < 1e-9 && normal == Vector::Z, "{distance}");
        assert_eq!(hit(bowl.clone(), [11.0, 0.0, 100.0], down), None, "its long side lies along y");
        let (distance, normal) = hit(bowl, [0.0, 16.0, 100.0], down).unwrap();
        assert!((distance - 92.0).abs() < 1e-9, "{distance}");
        // Of x^2/a^2 + z^2/c^2 = 1 at (16, 3): toward (16/400, 3/25).
        assert!((normal.y / normal.z - (16.0 / 400.0) / (3.0 / 25.0)).abs() < 1e-9, "{normal:?}");
        let cup = Form::Tube { foot: Vector::ZERO, radius: 40.0, height: 90.0 };
        let (inside, normal) = hit(cup.clone(), [0.0, 0.0, 120.0], [1.0, 0.0, -1.0]).unwrap();
        assert!((inside - 40.0 * 2.0_f64.sqrt()).abs() < 1e-9 && normal.x < 0.0);
        let (outside, _) = hit(cup, [100.0, 0.0, 50.0], [-1.0, 0.0, 0.0]).unwrap();
        assert!((outside - 60.0).abs() < 1e-9);
    }
}
