//! A pyramid laid into a cloud: its apex is where its faces meet.

use nalgebra::{DMatrix, DVector, Point3, Vector3};

use crate::cloud::Cloud;
use crate::surface::{FitError, plane_through, rms};

/// A pyramid of four faces.
#[derive(Debug, Clone, PartialEq)]
pub struct PyramidFit {
    /// Where the faces meet best, mm.
    pub apex: Point3<f64>,
    /// The faces: normals of length one, outward and upward, and offsets, mm.
    pub faces: Vec<(Vector3<f64>, f64)>,
    /// Root mean square distance of each point from its face, mm.
    pub rms_mm: f64,
}

/// Points nearer to an edge than this are of no certain face, mm.
const EDGE_MM: f64 = 1.5;

/// Rounds at most.
const ROUNDS: usize = 30;

impl Cloud {
    /// Lays a pyramid of four faces into the points that rise over the table: each point to the face it is under, each face through its
    /// points, again until nothing changes. Points near the edges and those that fit no face are left out.
    ///
    /// # Errors
    /// [`FitError`]
    pub fn fit_pyramid(&self) -> Result<PyramidFit, FitError> {
        let lowest = percentile(self.points.iter().map(|point| point.position.z), 0.02);
        let raised: Vec<Point3<f64>> =
            self.points.iter().map(|point| point.position).filter(|point| point.z > lowest + 6.0).collect();
        let too_few = |points| FitError::TooFew { points, what: "the four faces of a pyramid" };
        if raised.len() < 60 {
            return Err(too_few(raised.len()));
        }
        let mut best: Option<PyramidFit> = None;
        // The turn about the vertical is not known: several beginnings, of which the best is kept.
        for start in 0..6 {
            let turn = f64::from(start) * std::f64::consts::FRAC_PI_2 / 6.0;
            if let Some(found) = from_turn(&raised, turn)
                && best.as_ref().is_none_or(|best| found.rms_mm < best.rms_mm)
            {
                best = Some(found);
            }
        }
        best.ok_or_else(|| too_few(raised.len()))
    }
}

fn percentile(values: impl Iterator<Item = f64>, fraction: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get((fraction * values.len() as f64) as usize).copied().unwrap_or(0.0)
}

fn from_turn(raised: &[Point3<f64>], turn: f64) -> Option<PyramidFit> {
    let top = raised.iter().max_by(|a, b| a.z.total_cmp(&b.z))?;
    let mut faces: Vec<(Vector3<f64>, f64)> = (0..4)
        .map(|side| {
            let angle = turn + f64::from(side) * std::f64::consts::FRAC_PI_2;
            let normal = Vector3::new(angle.cos(), angle.sin(), 1.0).normalize();
            (normal, normal.dot(&top.coords))
        })
        .collect();
    let mut limit = 8.0_f64;
    let mut last = None;
    for _ in 0..ROUNDS {
        let mut members: [Vec<Point3<f64>>; 4] = Default::default();
        for point in raised {
            let mut distances: Vec<(usize, f64)> = faces
                .iter()
                .enumerate()
                .map(|(face, (normal, offset))| (face, normal.dot(&point.coords) - offset))
                .collect();
            // A point of a convex body lies on the face it is outermost of.
            distances.sort_by(|a, b| b.1.total_cmp(&a.1));
            let [(face, first), (_, second), ..] = distances.as_slice() else { return None };
            if first.abs() < limit
                && first - second > EDGE_MM
                && let Some(members) = members.get_mut(*face)
            {
                members.push(*point);
            }
        }
        faces = members.iter().map(|members| outward(plane_through(members)?)).collect::<Option<_>>()?;
        let distances: Vec<f64> = members
            .iter()
            .zip(&faces)
            .flat_map(|(members, (normal, offset))| {
                members.iter().map(move |point| normal.dot(&point.coords) - offset)
            })
            .collect();
        let rms_mm = rms(&distances);
        let apex = meeting(&faces)?;
        let found = PyramidFit { apex, faces: faces.clone(), rms_mm };
        let settled = last.as_ref().is_some_and(|last: &PyramidFit| (last.apex - apex).norm() < 1e-6);
        last = Some(found);
        limit = (4.0 * rms_mm).max(0.3).min(limit);
        if settled {
            break;
        }
    }
    // Four faces, each to another side, or it was no pyramid.
    let apart = |found: &PyramidFit| {
        found.faces.iter().enumerate().all(|(index, (one, _))| {
            found.faces.iter().skip(index + 1).all(|(other, _)| one.dot(other) < 0.95)
        })
    };
    last.filter(apart)
}

/// A plane with its normal upward; one that is upright belongs to no pyramid.
fn outward((normal, offset): (Vector3<f64>, f64)) -> Option<(Vector3<f64>, f64)> {
    (normal.z.abs() > 0.1).then(|| if normal.z < 0.0 { (-normal, -offset) } else { (normal, offset) })
}

/// Where planes meet, in the sense of least squares.
fn meeting(faces: &[(Vector3<f64>, f64)]) -> Option<Point3<f64>> {
    let normals =
        DMatrix::from_fn(faces.len(), 3, |row, column| faces.get(row).map_or(0.0, |face| face.0[column]));
    let offsets = DVector::from_iterator(faces.len(), faces.iter().map(|face| face.1));
    let found = normals.tr_mul(&normals).lu().solve(&normals.tr_mul(&offsets))?;
    Some(Point3::new(found[0], found[1], found[2]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::CloudPoint;

    fn cloud(points: impl Iterator<Item = Point3<f64>>) -> Cloud {
        let point = |position| CloudPoint { position, stripe: 0, seen: Default::default() };
        Cloud { points: points.map(point).collect(), ..Cloud::default() }
    }

    /// Points of a pyramid of 60 mm height and 90 mm edge on a table, as a scan has them, with noise of 0.1 mm.
    fn pyramid(turn: f64, apex: Point3<f64>) -> Cloud {
        let mut chance = 1_u64;
        let mut noise = move || {
            chance = chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((chance >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 0.35
        };
        let mut points = Vec::new();
        for x in -20..=20 {
            for y in -60..=60 {
                let (x, y) = (f64::from(x) * 3.0, f64::from(y));
                let (sine, cosine) = turn.sin_cos();
                let out = (x * cosine + y * sine).abs().max((y * cosine - x * sine).abs());
                let z = (60.0 - out * 60.0 / 45.0).max(0.0) + noise();
                points.push(Point3::new(apex.x + x, apex.y + y, apex.z - 60.0 + z));
            }
        }
        cloud(points.into_iter())
    }

    #[test]
    fn the_apex_is_found_whatever_the_turn() {
        let apex = Point3::new(400.0, -30.0, 10.0);
        for turn in [0.0, 0.2, 0.5, 0.9, 1.3] {
            let found = pyramid(turn, apex).fit_pyramid().unwrap();
            assert!((found.apex - apex).norm() < 0.1, "turned by {turn}: {}", found.apex);
            assert!(found.rms_mm < 0.12);
        }
    }

    #[test]
    fn a_plain_table_has_no_apex() {
        let flat = cloud((0..400).map(|at| Point3::new(f64::from(at % 20), f64::from(at / 20), 0.0)));
        let message = flat.fit_pyramid().unwrap_err().to_string();
        assert!(message.contains("too few"), "{message}");
    }

    #[test]
    fn a_ball_and_a_plane_are_found() {
        let ball = cloud((0..600).map(|at| {
            let (turn, rise) = (f64::from(at % 40) * 0.157, 0.2 + f64::from(at / 40) * 0.09);
            Point3::new(
                10.0 + 25.0 * rise.cos() * turn.cos(),
                25.0 * rise.cos() * turn.sin(),
                25.0 + 25.0 * rise.sin(),
            )
        }));
        let found = ball.fit_sphere().unwrap();
        assert!(
            (found.radius_mm - 25.0).abs() < 1e-6
                && (found.centre - Point3::new(10.0, 0.0, 25.0)).norm() < 1e-6
        );
        let plane =
            cloud((0..400).map(|at| {
                Point3::new(f64::from(at % 20), f64::from(at / 20), 5.0 + 0.1 * f64::from(at % 20))
            }));
        let found = plane.fit_plane().unwrap();
        assert!(found.rms_mm < 1e-9 && (found.normal.x + 0.1 * found.normal.z).abs() < 1e-9);
    }
}
