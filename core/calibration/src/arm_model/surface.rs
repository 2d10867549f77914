//! The shape of a surface, edge or point that measurements refer to: distance, gradient and free numbers.

use nalgebra::{Unit, Vector3};

/// Below this length (mm, or of a vector of unit size) a direction is undefined and taken as none.
const NO_DIRECTION: f64 = 1e-9;

/// The free number of a ball that is its radius.
const RADIUS: usize = 3;

/// What something lies on, in the frame of the measurements.
#[derive(Debug, Clone, PartialEq)]
pub enum SurfaceShape {
    /// All points with `normal . x = offset`; unit normal, mm.
    Plane {
        /// Unit length.
        normal: Vector3<f64>,
        /// mm.
        offset: f64,
    },
    /// A straight edge.
    Line {
        /// mm.
        point: Vector3<f64>,
        /// Unit length.
        direction: Vector3<f64>,
    },
    /// A ball.
    Sphere {
        /// mm.
        centre: Vector3<f64>,
        /// mm.
        radius: f64,
        /// Whether fits may change the radius as well: of a ball that nobody measured.
        free_radius: bool,
    },
    /// A point, for `distance_to`.
    Point {
        /// mm.
        point: Vector3<f64>,
    },
}

/// Two unit vectors square to `normal` and to each other.
pub fn square_to(normal: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    // Whichever axis is far enough from the normal: the product with one along it would be nothing.
    let helper = if normal.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let first = Unit::new_normalize(normal.cross(&helper)).into_inner();
    (first, normal.cross(&first))
}

/// The direction of an offset and its length; the zero vector where it has no direction.
fn direction_and_length(offset: Vector3<f64>) -> (Vector3<f64>, f64) {
    let length = offset.norm();
    (if length > NO_DIRECTION { offset / length } else { Vector3::zeros() }, length)
}

/// The horizontal normal of an edge, to its left seen from above; `up` is upwards.
fn left_of(direction: &Vector3<f64>, up: &Vector3<f64>) -> Vector3<f64> {
    // An edge that is upright has no left: any direction square to it will do.
    up.cross(direction).try_normalize(NO_DIRECTION).unwrap_or_else(|| square_to(direction).0)
}

/// The unit vectors square to a line: to its left seen from above, horizontal, and over it.
fn across_line(direction: &Vector3<f64>, up: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let left = left_of(direction, up);
    (left, direction.cross(&left))
}

impl SurfaceShape {
    /// Whether it is an edge, beside which a sensor triggers rather than over which.
    pub fn is_edge(&self) -> bool {
        matches!(self, Self::Line { .. })
    }

    /// The signed distance of a point (mm; positive outside, above, or left of an edge seen from above) and its gradient, a unit vector. `up` is upwards in the
    /// frame of the measurements.
    pub fn distance(&self, point: &Vector3<f64>, up: &Vector3<f64>) -> (f64, Vector3<f64>) {
        match self {
            Self::Plane { normal, offset } => (normal.dot(point) - offset, *normal),
            Self::Line { point: through, direction } => {
                let left = left_of(direction, up);
                (left.dot(&(point - through)), left)
            }
            Self::Sphere { centre, radius, .. } => {
                let (away, length) = direction_and_length(point - centre);
                (length - radius, away)
            }
            Self::Point { point: position } => {
                let (away, length) = direction_and_length(point - position);
                (length, away)
            }
        }
    }

    /// The point that `distance_to` measures from: a point or a ball's centre; of a line the point it is given by, of a plane the one nearest the origin.
    pub fn reference_point(&self) -> Vector3<f64> {
        match self {
            Self::Point { point } | Self::Line { point, .. } => *point,
            Self::Sphere { centre, .. } => *centre,
            Self::Plane { normal, offset } => normal * *offset,
        }
    }

    /// Whether [`Self::reference_point`] is the very thing that its free numbers move.
    pub fn is_located_by_its_reference_point(&self) -> bool {
        matches!(self, Self::Point { .. } | Self::Sphere { .. })
    }

    /// How many numbers of it may be fitted: offset and two tilts of a plane, sideways shift and turn of a line, three coordinates of a ball or point, and the
    /// radius of a ball that nobody measured.
    pub fn freedoms(&self) -> usize {
        match self {
            Self::Line { .. } => 2,
            Self::Sphere { free_radius: true, .. } => 4,
            Self::Plane { .. } | Self::Sphere { .. } | Self::Point { .. } => 3,
        }
    }

    /// The same where what lies on it is measured in space and not only beside it: a line may also be raised and tilted.
    pub fn freedoms_in_space(&self) -> usize {
        match self {
            Self::Line { .. } => 4,
            _ => self.freedoms(),
        }
    }

    /// Where a point lies beside a line: the distances to the left of it and over it (mm), each with its gradient, a unit vector; the point is on the line where both
    /// are zero. Nothing of what is no line.
    pub fn beside_line(&self, point: &Vector3<f64>, up: &Vector3<f64>) -> Option<[(f64, Vector3<f64>); 2]> {
        let Self::Line { point: through, direction } = self else { return None };
        let (left, over) = across_line(direction, up);
        let away = point - through;
        Some([(left.dot(&away), left), (over.dot(&away), over)])
    }

    /// Derivative of one of the distances of [`Self::beside_line`] by a free number, as [`Self::shift`] moves it. Nothing of what is no line.
    ///
    /// A turn `t` of the direction `d` (square to it) turns left `l` and over `o` by `-(t . l) d + s o` and `-(t . o) d - s l`: they stay square to `d`, and spin about it
    /// by `s = (k x t) . o / |k x d|` because left stays horizontal (`k` upwards).
    pub fn line_derivative(
        &self,
        part: usize,
        which: usize,
        point: &Vector3<f64>,
        up: &Vector3<f64>,
    ) -> Option<f64> {
        let Self::Line { point: through, direction } = self else { return None };
        let (left, over) = across_line(direction, up);
        let away = point - through;
        let (own, other, sense) = if part == 0 { (left, over, 1.0) } else { (over, left, -1.0) };
        let axis = match which {
            0 => return Some(-own.dot(&left)),
            1 => left,
            2 => return Some(-own.dot(&over)),
            _ => over,
        };
        let level = up.cross(direction).norm();
        let spin = if level > NO_DIRECTION { up.cross(&axis).dot(&over) / level } else { 0.0 };
        Some(-axis.dot(&own) * direction.dot(&away) + sense * spin * other.dot(&away))
    }

    /// Moves one free number by an amount (mm, or rad for tilts and turns).
    pub fn shift(&mut self, which: usize, amount: f64, up: &Vector3<f64>) {
        match self {
            Self::Plane { normal, offset } => {
                let (first, second) = square_to(normal);
                match which {
                    0 => *offset += amount,
                    1 => *normal = (*normal + first * amount).normalize(),
                    _ => *normal = (*normal + second * amount).normalize(),
                }
            }
            Self::Line { point, direction } => {
                let (left, over) = across_line(direction, up);
                match which {
                    0 => *point += left * amount,
                    1 => *direction = (*direction + left * amount).normalize(),
                    2 => *point += over * amount,
                    _ => *direction = (*direction + over * amount).normalize(),
                }
            }
            Self::Sphere { radius, .. } if which == RADIUS => *radius += amount,
            Self::Sphere { centre: position, .. } | Self::Point { point: position } => {
                if let Some(part) = position.get_mut(which) {
                    *part += amount;
                }
            }
        }
    }

    /// Derivative of the distance of a point by a free number, as [`Self::shift`] moves it: mm/mm or mm/rad.
    pub fn derivative(&self, which: usize, point: &Vector3<f64>, up: &Vector3<f64>) -> f64 {
        match self {
            Self::Plane { normal, .. } => {
                let (first, second) = square_to(normal);
                match which {
                    0 => -1.0,
                    1 => first.dot(point),
                    _ => second.dot(point),
                }
            }
            Self::Line { .. } => self.line_derivative(0, which, point, up).unwrap_or(0.0),
            Self::Sphere { .. } if which == RADIUS => -1.0,
            Self::Sphere { .. } | Self::Point { .. } => {
                let (_, away) = self.distance(point, up);
                -away.get(which).copied().unwrap_or(0.0)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes() -> [SurfaceShape; 4] {
        [
            SurfaceShape::Plane { normal: Vector3::new(0.1, -0.2, 1.0).normalize(), offset: 12.0 },
            SurfaceShape::Line {
                point: Vector3::new(100.0, 20.0, 3.0),
                direction: Vector3::new(0.3, 1.0, 0.0).normalize(),
            },
            SurfaceShape::Sphere {
                centre: Vector3::new(150.0, -40.0, 30.0),
                radius: 25.0,
                free_radius: true,
            },
            SurfaceShape::Point { point: Vector3::new(-20.0, 60.0, 10.0) },
        ]
    }

    const POINT: Vector3<f64> = Vector3::new(130.0, 45.0, 22.0);

    #[test]
    fn distances_are_those_of_the_textbook() {
        let up = Vector3::z();
        let [plane, line, sphere, point] = shapes().map(|shape| shape.distance(&POINT, &up).0);
        let root = 1.05_f64.sqrt();
        assert!((plane - ((13.0 - 9.0 + 22.0) / root - 12.0)).abs() < 1e-12);
        // The left of a line along +y, seen from above, is -x; the foot on the line is 25 mm along y further.
        let left = Vector3::new(-1.0, 0.3, 0.0).normalize();
        assert!((line - left.dot(&Vector3::new(30.0, 25.0, 19.0))).abs() < 1e-12 && line < 0.0);
        assert!((sphere - ((400.0_f64 + 7225.0 + 64.0).sqrt() - 25.0)).abs() < 1e-12);
        assert!((point - (22500.0_f64 + 225.0 + 144.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn gradients_agree_with_differences() {
        let up = Vector3::z();
        for shape in shapes() {
            let (_, gradient) = shape.distance(&POINT, &up);
            for axis in 0..3 {
                let step = Vector3::ith(axis, 1e-5);
                let slope =
                    (shape.distance(&(POINT + step), &up).0 - shape.distance(&(POINT - step), &up).0) / 2e-5;
                assert!((gradient[axis] - slope).abs() < 1e-6, "{shape:?} axis {axis}");
            }
            assert!((gradient.norm() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn derivatives_by_the_free_numbers_agree_with_differences() {
        let up = Vector3::z();
        for shape in shapes() {
            for which in 0..shape.freedoms() {
                let at = |amount: f64| {
                    let mut shifted = shape.clone();
                    shifted.shift(which, amount, &up);
                    shifted.distance(&POINT, &up).0
                };
                let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
                assert!(
                    (shape.derivative(which, &POINT, &up) - slope).abs() < 1e-4,
                    "{shape:?} number {which}"
                );
            }
        }
    }

    #[test]
    fn a_line_in_space_has_two_distances_that_together_are_the_distance_and_derivatives_that_agree_with_differences()
     {
        let up = Vector3::z();
        for direction in
            [Vector3::new(0.3, 1.0, 0.0), Vector3::new(0.3, -0.8, 0.6), Vector3::new(-0.1, 0.2, 1.0)]
        {
            let line = SurfaceShape::Line {
                point: Vector3::new(100.0, 20.0, 3.0),
                direction: direction.normalize(),
            };
            let [(left, _), (over, _)] = line.beside_line(&POINT, &up).unwrap();
            // The distance by the textbook: of the cross product.
            let away = (POINT - Vector3::new(100.0, 20.0, 3.0)).cross(&direction.normalize()).norm();
            assert!((left.hypot(over) - away).abs() < 1e-10, "{left} {over} {away}");
            assert_eq!((line.freedoms(), line.freedoms_in_space()), (2, 4));
            for part in 0..2 {
                for which in 0..4 {
                    let at = |amount: f64| {
                        let mut shifted = line.clone();
                        shifted.shift(which, amount, &up);
                        shifted.beside_line(&POINT, &up).unwrap()[part].0
                    };
                    let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
                    let derivative = line.line_derivative(part, which, &POINT, &up).unwrap();
                    assert!(
                        (derivative - slope).abs() < 1e-5,
                        "{direction} part {part} number {which}: {derivative} {slope}"
                    );
                }
            }
        }
        assert!(SurfaceShape::Point { point: POINT }.beside_line(&POINT, &up).is_none());
    }

    #[test]
    fn an_upright_edge_and_a_point_upon_itself_have_finite_distances() {
        let up = Vector3::z();
        let upright = SurfaceShape::Line { point: Vector3::zeros(), direction: up };
        assert!((upright.distance(&POINT, &up).1.norm() - 1.0).abs() < 1e-12);
        let here = SurfaceShape::Point { point: POINT };
        assert_eq!(here.distance(&POINT, &up), (0.0, Vector3::zeros()));
    }

    #[test]
    fn square_vectors_are_square_whichever_way_the_normal_points() {
        for normal in [
            Vector3::z(),
            -Vector3::z(),
            Vector3::x(),
            Vector3::new(0.6, 0.0, 0.8),
            Vector3::new(0.1, 0.2, 0.97).normalize(),
        ] {
            let (first, second) = square_to(&normal);
            assert!(
                first.dot(&normal).abs() < 1e-12
                    && second.dot(&normal).abs() < 1e-12
                    && first.dot(&second).abs() < 1e-12
            );
            assert!((first.norm() - 1.0).abs() < 1e-12 && (second.norm() - 1.0).abs() < 1e-12);
        }
    }
}
