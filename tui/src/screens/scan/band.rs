//! The plane most of a cloud lies in, and how thick the cloud looks along it: Agin's random error.

use nalgebra::{Point3, Vector3};
use plumb_cell::cloud::{Cloud, CloudPoint};

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

/// Rounds of leaving out what lies elsewhere.
const ROUNDS: usize = 20;

impl Band {
    /// The plane most points lie in; none where they lie in a line, or are too few.
    pub(crate) fn of(points: &[CloudPoint]) -> Option<Self> {
        let mut cloud = Cloud { points: points.to_vec(), ..Cloud::default() };
        let mut plane = cloud.fit_plane().ok()?;
        for _ in 0..ROUNDS {
            let away = |point: &CloudPoint| (plane.normal.dot(&point.place.coords) - plane.offset_mm).abs();
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
        let residual = |point: &CloudPoint| plane.normal.dot(&point.place.coords) - plane.offset_mm;
        let mut residuals: Vec<f64> = cloud.points.iter().map(residual).collect();
        residuals.sort_by(f64::total_cmp);
        let at =
            |share: f64| residuals.get((share * residuals.len() as f64) as usize).copied().unwrap_or(0.0);
        let count = cloud.points.len() as f64;
        let middle =
            cloud.points.iter().fold(Vector3::zeros(), |sum, point| sum + point.place.coords) / count;
        // Along the first stripe-like direction: what of x lies in the plane, or of y where x stands upright on it.
        let in_plane = |axis: Vector3<f64>| axis - plane.normal * plane.normal.dot(&axis);
        let along =
            if in_plane(Vector3::x()).norm() > 0.5 { in_plane(Vector3::x()) } else { in_plane(Vector3::y()) };
        Some(Self {
            normal: plane.normal,
            offset: plane.offset_mm,
            along: along.normalize(),
            middle: middle.into(),
            rms: plane.rms_mm,
            edges: (at(0.025), at(0.975)),
            points: cloud.points.len(),
        })
    }

    /// How far a place lies from the plane, mm; above is positive.
    pub(crate) fn away(&self, place: &Point3<f64>) -> f64 {
        self.normal.dot(&place.coords) - self.offset
    }

    /// Its thickness, mm.
    pub(crate) fn thickness(&self) -> f64 {
        self.edges.1 - self.edges.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_plugin::StripePoint;

    #[test]
    fn the_band_is_that_of_the_plane_whatever_stands_on_it() {
        let point = |x: f64, y: f64, z: f64| CloudPoint {
            place: Point3::new(x, y, z),
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
        points.extend((0..900).map(|place| point(f64::from(place % 30), f64::from(place / 30), -250.0)));
        let band = Band::of(&points).unwrap();
        assert_eq!(band.points, 3600);
        assert!((band.normal.x / band.normal.z + 0.2).abs() < 1e-3, "{band:?}");
        assert!((0.17..0.21).contains(&band.thickness()), "{}", band.thickness());
        assert!(Band::of(&points[..2]).is_none());
    }
}
