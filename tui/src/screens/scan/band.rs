//! The plane most of a cloud lies in, and how thick the cloud looks along it: Agin's random error.

use nalgebra::{Point3, Vector3};
use plumb_cloud::{Cloud, CloudPoint};

/// A plane and what lies about it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Band {
    /// Of length one, upward.
    pub normal: Vector3<f64>,
    /// mm.
    pub offset: f64,
    /// In the plane.
    pub along: Vector3<f64>,
    /// The middle of what lies in it.
    pub middle: Point3<f64>,
    /// Root mean square distance from it, mm.
    pub rms: f64,
    /// Where the band of 95 % begins and ends, mm from the plane.
    pub edges: (f64, f64),
    /// Points in it.
    pub points: usize,
}

/// Planes that are tried.
const TRIES: usize = 200;
/// Points that are looked at to choose between them.
const LOOKED_AT: usize = 1500;
/// Rounds of leaving out what lies elsewhere.
const ROUNDS: usize = 20;

/// What is thicker than this share of its length is no plane, but a body of several faces. The thickest band of a plane that simulated scans have
/// left, of a rig with everything wrong with it, is 5 mm on 100.
const THICKEST: f64 = 0.15;

impl Band {
    /// The plane most points lie in; none where they lie in a line, or are too few.
    pub(crate) fn of(points: &[CloudPoint]) -> Option<Self> {
        let mut cloud = Cloud { points: points.to_vec(), ..Cloud::default() };
        let mut plane = cloud.fit_plane().ok()?;
        if let Some((normal, offset_mm)) = through_most(points) {
            (plane.normal, plane.offset_mm) = (normal, offset_mm);
        }
        for _ in 0..ROUNDS {
            let away =
                |point: &CloudPoint| (plane.normal.dot(&point.position.coords) - plane.offset_mm).abs();
            let mut distances: Vec<f64> = points.iter().map(away).collect();
            distances.sort_by(f64::total_cmp);
            let median = distances.get(distances.len() / 2).copied().unwrap_or(0.0);
            let limit = (4.0 * 1.4826 * median).max(1e-3);
            let inside: Vec<CloudPoint> =
                points.iter().filter(|point| away(point) <= limit).copied().collect();
            if inside == cloud.points {
                break;
            }
            cloud.points = inside;
            plane = cloud.fit_plane().ok()?;
        }
        let residual = |point: &CloudPoint| plane.normal.dot(&point.position.coords) - plane.offset_mm;
        let mut residuals: Vec<f64> = cloud.points.iter().map(residual).collect();
        residuals.sort_by(f64::total_cmp);
        let at = |fraction: f64| {
            residuals.get((fraction * residuals.len() as f64) as usize).copied().unwrap_or(0.0)
        };
        let count = cloud.points.len() as f64;
        let middle =
            cloud.points.iter().fold(Vector3::zeros(), |sum, point| sum + point.position.coords) / count;
        // Along the first stripe-like direction: what of x lies in the plane, or of y where x is upright on it.
        let in_plane = |axis: Vector3<f64>| axis - plane.normal * plane.normal.dot(&axis);
        let along =
            if in_plane(Vector3::x()).norm() > 0.5 { in_plane(Vector3::x()) } else { in_plane(Vector3::y()) };
        let reach = cloud.points.iter().map(|point| (point.position.coords - middle).norm());
        let is_band = at(0.975) - at(0.025) <= THICKEST * 2.0 * reach.fold(0.0, f64::max);
        is_band.then(|| Self {
            normal: plane.normal,
            offset: plane.offset_mm,
            along: along.normalize(),
            middle: middle.into(),
            rms: plane.rms_mm,
            edges: (at(0.025), at(0.975)),
            points: cloud.points.len(),
        })
    }

    /// How far a point lies from the plane, mm; above is positive.
    pub(crate) fn away(&self, position: &Point3<f64>) -> f64 {
        self.normal.dot(&position.coords) - self.offset
    }

    /// Its thickness, mm.
    pub(crate) fn thickness(&self) -> f64 {
        self.edges.1 - self.edges.0
    }
}

/// Of many planes through three points each, the one whose median distance from all points is the least (Rousseeuw 1984): whatever holds less than half of
/// the points does not draw it away.
fn through_most(points: &[CloudPoint]) -> Option<(Vector3<f64>, f64)> {
    let positions: Vec<Vector3<f64>> = points
        .iter()
        .step_by(points.len().div_ceil(LOOKED_AT).max(1))
        .map(|point| point.position.coords)
        .collect();
    let mut chance = 1_u32;
    let mut any = || {
        chance = chance.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        positions.get((chance >> 8) as usize % positions.len().max(1)).copied()
    };
    let mut best: Option<(f64, Vector3<f64>, f64)> = None;
    for _ in 0..TRIES {
        let (Some(a), Some(b), Some(c)) = (any(), any(), any()) else { break };
        let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-6) else { continue };
        let offset = normal.dot(&a);
        let mut distances: Vec<f64> =
            positions.iter().map(|position| (normal.dot(position) - offset).abs()).collect();
        let middle = distances.len() / 2;
        let median = *distances.select_nth_unstable_by(middle, f64::total_cmp).1;
        if best.is_none_or(|(least, ..)| median < least) {
            best = Some((median, normal, offset));
        }
    }
    best.map(|(_, normal, offset)| if normal.z < 0.0 { (-normal, -offset) } else { (normal, offset) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_plugin::StripePoint;

    #[test]
    fn a_pyramid_lies_in_no_plane() {
        let mut points = Vec::new();
        for row in -30..=30 {
            for column in -30..=30 {
                let (x, y) = (f64::from(column), f64::from(row));
                let position = Point3::new(x, y, 40.0 * (1.0 - x.abs().max(y.abs()) / 30.0));
                points.push(CloudPoint { position, stripe: 0, seen: StripePoint::default() });
            }
        }
        assert_eq!(Band::of(&points), None);
    }

    #[test]
    fn the_band_is_that_of_the_plane_whatever_is_on_it() {
        let point = |x: f64, y: f64, z: f64| CloudPoint {
            position: Point3::new(x, y, z),
            stripe: 0,
            seen: StripePoint::default(),
        };
        let mut points = Vec::new();
        for row in 0..60 {
            for column in 0..60 {
                let (x, y) = (f64::from(column), f64::from(row));
                let jitter = 0.1 * f64::from((row * 7 + column * 13) % 11 - 5) / 5.0;
                points.push(point(x, y, 0.2 * x - 300.0 + jitter));
            }
        }
        points.extend((0..900).map(|index| point(f64::from(index % 30), f64::from(index / 30), -250.0)));
        let band = Band::of(&points).unwrap();
        assert_eq!(band.points, 3600);
        assert!((band.normal.x / band.normal.z + 0.2).abs() < 1e-3, "{band:?}");
        assert!((0.17..0.21).contains(&band.thickness()), "{}", band.thickness());
        assert!(Band::of(&points[..2]).is_none());
    }
}
