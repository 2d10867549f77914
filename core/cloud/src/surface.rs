//! Planes and balls laid into clouds.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, Vector3};

use crate::cloud::Cloud;

/// Why a surface cannot be laid into a cloud.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FitError {
    /// Too few points, or all in one point or line.
    #[error("{points} points are too few, or lie too much in one line, for {what}; scan more of it")]
    TooFew {
        /// How many there are.
        points: usize,
        /// What was to be found.
        what: &'static str,
    },
}

/// A plane: normal . p = offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneFit {
    /// Of length one, upward.
    pub normal: Vector3<f64>,
    /// mm.
    pub offset_mm: f64,
    /// Root mean square distance from it, mm.
    pub rms_mm: f64,
    /// How thick the cloud looks edge-on: between the 2.5th and the 97.5th percentile, mm.
    pub thickness_mm: f64,
}

/// A ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereFit {
    /// Its middle, mm.
    pub centre: Point3<f64>,
    /// mm.
    pub radius_mm: f64,
    /// Root mean square distance from its surface, mm.
    pub rms_mm: f64,
}

/// The best plane through points: normal and offset. None for fewer than three or points in a line.
pub(crate) fn plane_through(points: &[Point3<f64>]) -> Option<(Vector3<f64>, f64)> {
    if points.len() < 3 {
        return None;
    }
    let count = points.len() as f64;
    let middle = points.iter().fold(Vector3::zeros(), |sum, point| sum + point.coords) / count;
    let spread = points.iter().fold(Matrix3::zeros(), |sum, point| {
        let away = point.coords - middle;
        sum + away * away.transpose()
    });
    let eigen = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let [least, second, _] = order;
    if eigen.eigenvalues[second] / count < 1e-6 {
        return None;
    }
    let normal = eigen.eigenvectors.column(least).into_owned();
    let normal = if normal.z < 0.0 { -normal } else { normal };
    Some((normal, normal.dot(&middle)))
}

pub(crate) fn rms(distances: &[f64]) -> f64 {
    (distances.iter().map(|distance| distance * distance).sum::<f64>() / distances.len().max(1) as f64).sqrt()
}

impl Cloud {
    fn positions(&self) -> Vec<Point3<f64>> {
        self.points.iter().map(|point| point.position).collect()
    }

    /// Lays a plane into all points.
    ///
    /// # Errors
    /// [`FitError`]
    pub fn fit_plane(&self) -> Result<PlaneFit, FitError> {
        let positions = self.positions();
        let (normal, offset_mm) =
            plane_through(&positions).ok_or(FitError::TooFew { points: positions.len(), what: "a plane" })?;
        let mut distances: Vec<f64> =
            positions.iter().map(|position| normal.dot(&position.coords) - offset_mm).collect();
        let rms_mm = rms(&distances);
        distances.sort_by(f64::total_cmp);
        let at = |fraction: f64| {
            distances.get((fraction * distances.len() as f64) as usize).copied().unwrap_or(0.0)
        };
        Ok(PlaneFit { normal, offset_mm, rms_mm, thickness_mm: at(0.975) - at(0.025) })
    }

    /// Lays a ball into the points that do not lie on the table below it.
    ///
    /// # Errors
    /// [`FitError`]
    pub fn fit_sphere(&self) -> Result<SphereFit, FitError> {
        let lowest = self.points.iter().fold(f64::INFINITY, |least, point| least.min(point.position.z));
        let mut positions: Vec<Point3<f64>> =
            self.positions().into_iter().filter(|position| position.z > lowest + 5.0).collect();
        let mut found = None;
        // A few rounds: what lies far from the ball is of something else.
        for _ in 0..6 {
            let too_few = FitError::TooFew { points: positions.len(), what: "a ball" };
            let (centre, radius) = ball_through(&positions).ok_or(too_few)?;
            let away = |position: &Point3<f64>| (position - centre).norm() - radius;
            let distances: Vec<f64> = positions.iter().map(away).collect();
            let rms_mm = rms(&distances);
            found = Some(SphereFit { centre, radius_mm: radius, rms_mm });
            let limit = (3.0 * rms_mm).max(0.05);
            let before = positions.len();
            positions.retain(|position| away(position).abs() <= limit);
            if positions.len() == before {
                break;
            }
        }
        found.ok_or(FitError::TooFew { points: 0, what: "a ball" })
    }
}

/// The ball of least squares: |p|^2 = 2 p.c + (r^2 - c^2) is linear in what is sought.
fn ball_through(positions: &[Point3<f64>]) -> Option<(Point3<f64>, f64)> {
    if positions.len() < 6 {
        return None;
    }
    let middle = positions.iter().fold(Vector3::zeros(), |sum, position| sum + position.coords)
        / positions.len() as f64;
    let rows = DMatrix::from_fn(positions.len(), 4, |row, column| {
        let away = positions.get(row).map_or(Vector3::zeros(), |position| position.coords - middle);
        if column < 3 { 2.0 * away[column] } else { 1.0 }
    });
    let squares = DVector::from_iterator(
        positions.len(),
        positions.iter().map(|position| (position.coords - middle).norm_squared()),
    );
    let found = (rows.tr_mul(&rows)).lu().solve(&rows.tr_mul(&squares))?;
    let centre = Vector3::new(found[0], found[1], found[2]);
    let square = found[3] + centre.norm_squared();
    (square > 0.0).then(|| (Point3::from(centre + middle), square.sqrt()))
}
