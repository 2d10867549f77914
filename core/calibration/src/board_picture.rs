//! The pose of a flat board from its corners in one picture, for tables that hold pixels in place of poses.
//!
//! A pinhole camera with the lens distortion of Brown (1971) as OpenCV numbers it: `k1, k2, p1, p2, k3`. The start is the homography between board and
//! picture (Hartley and Zisserman 2004, algorithm 4.2) taken apart after Zhang (2000), and its mirror image about the line of sight, for a board that is
//! seen small looks alike in both (Collins and Bartoli 2014); of both, refined by least squares of the pixels (Levenberg-Marquardt), the better is taken.

use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3, Vector6,
};
use plumb_estimation::{CAREFUL, NormalEquations, Problem, Progress, Settings, descend};
use thiserror::Error;

/// A camera's own numbers, px; without unit those of the lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraNumbers {
    /// Focal lengths along u and v.
    pub focal_px: [f64; 2],
    /// Where the line of sight meets the picture.
    pub principal_px: [f64; 2],
    /// `k1, k2, p1, p2, k3`.
    pub distortion: [f64; 5],
}

/// A chessboard or ChArUco board by its inner corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardCorners {
    /// Inner corners along x.
    pub columns: usize,
    /// Inner corners along y.
    pub rows: usize,
    /// The side of a square, mm.
    pub square_mm: f64,
}

/// A corner found in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Its number, from 0 along x, then y, as OpenCV counts them.
    pub number: usize,
    /// Column and row in the picture, px.
    pub at: [f64; 2],
}

/// A board's pose in the camera's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardPose {
    /// From the board's frame (origin at corner 0) to the camera's, mm.
    pub camera_from_board: Isometry3<f64>,
    /// Root mean square distance of the corners from where this pose would show them, px.
    pub off_px: f64,
}

/// Why a picture gives no pose.
#[derive(Debug, Error, PartialEq)]
pub enum BoardPictureError {
    /// Too few corners.
    #[error("{0} corners; the pose of a board needs four at least, not all on one line")]
    TooFew(usize),
    /// A corner the board does not have.
    #[error("there is no corner {number}; a board of {columns} x {rows} inner corners has 0 to {last}")]
    NoCorner {
        /// What was given.
        number: usize,
        /// Of the board.
        columns: usize,
        /// Of the board.
        rows: usize,
        /// Its last corner.
        last: usize,
    },
    /// The same corner twice.
    #[error("corner {0} is given twice")]
    Twice(usize),
    /// Corners on a line, or nowhere near a picture of a board.
    #[error(
        "the corners lie on one line, or show no board from before: see whether their numbers and the order of u and v are right"
    )]
    NoPlane,
}

/// Corners needed.
const FEWEST: usize = 4;

/// Steps of least squares at most; a few suffice from a homography.
const ROUNDS: usize = 50;

impl CameraNumbers {
    /// The pixel that shows a point of the camera's frame; nothing of a point behind it.
    fn pixel(&self, point: &Point3<f64>) -> Option<[f64; 2]> {
        // The camera's z looks ahead: the formula would show what is behind it upside down.
        if point.z <= 0.0 {
            return None;
        }
        let (x, y) = (point.x / point.z, point.y / point.z);
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        // Brown 1966, Decentering distortion of lenses, in the order of OpenCV's coefficients.
        let bent = [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ];
        Some([0, 1].map(|axis| self.focal_px[axis] * bent[axis] + self.principal_px[axis]))
    }

    /// The direction of a pixel, as x and y at z = 1, without the lens's bending: by going back and forth (as OpenCV's undistortPoints).
    fn direction(&self, at: [f64; 2]) -> [f64; 2] {
        let seen = [0, 1].map(|axis| (at[axis] - self.principal_px[axis]) / self.focal_px[axis]);
        let [k1, k2, p1, p2, k3] = self.distortion;
        let mut guess = seen;
        // A fixed point of bending: each round leaves a fraction of the order of the distortion itself.
        for _ in 0..20 {
            let [x, y] = guess;
            let r2 = x * x + y * y;
            let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            let aside =
                [2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y];
            guess = [0, 1].map(|axis| (seen[axis] - aside[axis]) / radial);
        }
        guess
    }
}

impl BoardCorners {
    /// Where a corner is on the board, mm.
    fn position(&self, number: usize) -> Point3<f64> {
        // Corners count along the rows, as OpenCV gives them.
        let (column, row) = (number % self.columns, number / self.columns);
        Point3::new(column as f64 * self.square_mm, row as f64 * self.square_mm, 0.0)
    }

    fn check(&self, corners: &[Corner]) -> Result<(), BoardPictureError> {
        if corners.len() < FEWEST {
            return Err(BoardPictureError::TooFew(corners.len()));
        }
        let (columns, rows) = (self.columns, self.rows);
        for (index, corner) in corners.iter().enumerate() {
            if corner.number >= columns * rows {
                let last = (columns * rows).saturating_sub(1);
                return Err(BoardPictureError::NoCorner { number: corner.number, columns, rows, last });
            }
            if corners.iter().take(index).any(|other| other.number == corner.number) {
                return Err(BoardPictureError::Twice(corner.number));
            }
        }
        Ok(())
    }

    /// The board's pose in one picture.
    ///
    /// # Errors
    /// [`BoardPictureError`]
    pub fn pose(&self, camera: &CameraNumbers, corners: &[Corner]) -> Result<BoardPose, BoardPictureError> {
        self.check(corners)?;
        let picture = Picture { board: self, camera, corners };
        let start = picture.by_homography().ok_or(BoardPictureError::NoPlane)?;
        // Seen from far off a small board looks alike from either side of the line of sight; the pixels decide, after each was refined
        // (Schweighofer and Pinz 2006, Robust pose estimation from a planar target).
        let refined = [start, mirrored(&start)].map(|start| picture.refined(&start));
        let better = refined.into_iter().flatten().min_by(|one, other| one.off_px.total_cmp(&other.off_px));
        better.ok_or(BoardPictureError::NoPlane)
    }
}

/// The other pose in which a small board looks alike: turned over about the line of sight.
fn mirrored(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let (Some(sight), normal) = (pose.translation.vector.try_normalize(1e-9), pose.rotation * Vector3::z())
    else {
        return *pose;
    };
    // Square to the line of sight both poses are one.
    let Some(axis) = nalgebra::Unit::try_new(normal.cross(&sight), 1e-9) else { return *pose };
    let lean = normal.cross(&sight).norm().atan2(normal.dot(&sight));
    // A normal that points at the camera leans by what is missing to half a turn.
    let by =
        if lean > std::f64::consts::FRAC_PI_2 { 2.0 * (lean - std::f64::consts::PI) } else { 2.0 * lean };
    Isometry3::from_parts(pose.translation, UnitQuaternion::from_axis_angle(&axis, by) * pose.rotation)
}

/// One picture of a board.
struct Picture<'p> {
    board: &'p BoardCorners,
    camera: &'p CameraNumbers,
    corners: &'p [Corner],
}

impl Picture<'_> {
    /// From the homography between board and picture.
    fn by_homography(&self) -> Option<Isometry3<f64>> {
        // The board is taken in units of its own size: the equations are then of one order.
        let size = self.board.square_mm * self.board.columns.max(self.board.rows) as f64;
        let mut equations = DMatrix::zeros((2 * self.corners.len()).max(9), 9);
        for (index, corner) in self.corners.iter().enumerate() {
            let position = self.board.position(corner.number) / size;
            let [x, y] = self.camera.direction(corner.at);
            // Direct linear transformation (Hartley and Zisserman 2004, section 4.1): two rows a corner, `h_part . m - seen h_3 . m = 0`.
            for (part, seen) in [x, y].into_iter().enumerate() {
                for (column, value) in [position.x, position.y, 1.0].into_iter().enumerate() {
                    equations[(2 * index + part, 3 * part + column)] = value;
                    equations[(2 * index + part, 6 + column)] = -seen * value;
                }
            }
        }
        let svd = equations.svd(false, true);
        let (v_t, values) = (svd.v_t?, svd.singular_values);
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|one, other| values[*one].total_cmp(&values[*other]));
        let (least, second, most) = (*order.first()?, *order.get(1)?, *order.last()?);
        if values[second] < ON_A_LINE * values[most] {
            return None;
        }
        let row = v_t.row(least);
        // The right singular vector of the least singular value, in rows.
        let homography = Matrix3::from_fn(|i, j| row[3 * i + j]);
        // The first two columns are unit vectors of a rotation, but for one scale and one sign: the board lies before the camera.
        let scale = 0.5 * (homography.column(0).norm() + homography.column(1).norm());
        let sign = homography[(2, 2)].signum();
        let parts = homography * (sign / scale);
        let (first, second) = (parts.column(0).into_owned(), parts.column(1).into_owned());
        // The third axis is square to both; the nearest rotation makes them square to each other (Kabsch 1976).
        let axes = Matrix3::from_columns(&[first, second, first.cross(&second)]);
        let svd = axes.svd(true, true);
        let rotation = Rotation3::from_matrix_unchecked(svd.u? * svd.v_t?);
        let position = parts.column(2) * size;
        let pose = Isometry3::from_parts(
            Translation3::from(position),
            UnitQuaternion::from_rotation_matrix(&rotation),
        );
        (rotation.matrix().determinant() > 0.0 && position.iter().all(|part| part.is_finite()))
            .then_some(pose)
    }

    /// Measured less shown pixels, one after the other; nothing if a corner would be behind the camera.
    fn residuals(&self, pose: &Isometry3<f64>) -> Option<Vec<f64>> {
        let mut all = Vec::with_capacity(2 * self.corners.len());
        for corner in self.corners {
            let shown = self.camera.pixel(&(pose * self.board.position(corner.number)))?;
            all.extend([corner.at[0] - shown[0], corner.at[1] - shown[1]]);
        }
        Some(all)
    }

    /// Least squares of the pixels from a start; nothing where a corner would be behind the camera there.
    fn refined(&self, start: &Isometry3<f64>) -> Option<BoardPose> {
        let settings = Settings { steps: ROUNDS, damping: CAREFUL };
        let found = descend(self, start, &[], settings, &Progress::unwatched()).ok()?;
        // Root mean square distance of corners, not of coordinates.
        let off_px = (found.normal.squares / self.corners.len() as f64).sqrt();
        off_px.is_finite().then_some(BoardPose { camera_from_board: found.state, off_px })
    }

    /// How the shown pixels move with each of the six numbers of a pose (rows), by differences.
    fn derivatives(&self, pose: &Isometry3<f64>) -> Option<DMatrix<f64>> {
        let mut derivatives = DMatrix::zeros(6, 2 * self.corners.len());
        for part in 0..6 {
            // Central differences: their error is of the second order in steps that are far above rounding.
            let small = if part < 3 { SMALL_MM } else { SMALL_RAD };
            let ahead = self.residuals(&moved(pose, &Vector6::ith(part, small)))?;
            let behind = self.residuals(&moved(pose, &Vector6::ith(part, -small)))?;
            for (column, (behind, ahead)) in behind.iter().zip(&ahead).enumerate() {
                derivatives[(part, column)] = (behind - ahead) / (2.0 * small);
            }
        }
        Some(derivatives)
    }
}

impl Problem for Picture<'_> {
    type State = Isometry3<f64>;

    /// A pose with a corner behind the camera is infinitely far off, so that no step is taken there.
    fn normal_equations(&self, pose: &Self::State) -> NormalEquations {
        let mut normal = NormalEquations::zeros(6);
        match (self.residuals(pose), self.derivatives(pose)) {
            (Some(residuals), Some(derivatives)) => normal.take(&residuals, &derivatives),
            _ => normal.squares = f64::INFINITY,
        }
        normal
    }

    fn stepped(&self, pose: &Self::State, change: &DVector<f64>) -> Self::State {
        moved(pose, &Vector6::from_iterator(change.iter().copied()))
    }

    fn is_finite(&self, pose: &Self::State) -> bool {
        pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|part| part.is_finite())
    }
}

/// Steps of derivatives: a thousandth of what a pixel shows.
const SMALL_MM: f64 = 1e-4;
const SMALL_RAD: f64 = 1e-6;

/// The second least singular value, as a fraction of the greatest, below which corners lie on a line.
const ON_A_LINE: f64 = 1e-6;

/// A pose shifted (camera's frame, mm) and turned about the board's origin (camera's axes, rad).
fn moved(pose: &Isometry3<f64>, step: &Vector6<f64>) -> Isometry3<f64> {
    let shift = step.fixed_rows::<3>(0).into_owned();
    let rotation = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(3).into_owned());
    Isometry3::from_parts(Translation3::from(pose.translation.vector + shift), rotation * pose.rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_estimation::Random;

    const CAMERA: CameraNumbers = CameraNumbers {
        focal_px: [800.0, 805.0],
        principal_px: [640.0, 360.0],
        distortion: [-0.12, 0.05, 0.001, -0.0008, 0.01],
    };
    const BOARD: BoardCorners = BoardCorners { columns: 9, rows: 6, square_mm: 20.0 };

    fn truth(roll: f64, pitch: f64, far: f64) -> Isometry3<f64> {
        let rotation = UnitQuaternion::from_euler_angles(roll, pitch, 0.7);
        Isometry3::from_parts(Translation3::new(-30.0, 20.0, far), rotation)
    }

    #[test]
    fn a_pose_is_moved_in_the_cameras_axes() {
        let pose = truth(0.3, -0.4, 600.0);
        let step = Vector6::new(1.0, -2.0, 3.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2);
        let found = moved(&pose, &step);
        assert!((found.translation.vector - Vector3::new(-29.0, 18.0, 603.0)).norm() < 1e-12);
        // A quarter turn about the camera's z takes its x to its y.
        let (before, after) = (pose.rotation * Vector3::x(), found.rotation * Vector3::x());
        assert!((after - Vector3::new(-before.y, before.x, before.z)).norm() < 1e-12);
    }

    #[test]
    fn the_mirrored_pose_leans_as_much_to_the_other_side_of_the_line_of_sight() {
        // Whether its normal points away from the camera or at it: the board turned by less and by more than a right angle.
        for (roll, pitch) in [(0.3, -0.4), (2.7, 0.2), (-0.5, 0.9)] {
            let pose = truth(roll, pitch, 600.0);
            let other = mirrored(&pose);
            let sight = pose.translation.vector.normalize();
            let (normal, turned) = (pose.rotation * Vector3::z(), other.rotation * Vector3::z());
            // The reflection of a direction about an axis: 2 (n . s) s - n.
            assert!((turned - (2.0 * normal.dot(&sight) * sight - normal)).norm() < 1e-9, "{roll} {pitch}");
            assert_eq!(other.translation, pose.translation);
            assert!((mirrored(&other).rotation.angle_to(&pose.rotation)) < 1e-9);
        }
        // Straight before the camera there is no other.
        let straight = Isometry3::from_parts(Translation3::new(0.0, 0.0, 500.0), UnitQuaternion::identity());
        assert_eq!(mirrored(&straight), straight);
    }

    fn corners(pose: &Isometry3<f64>, sigma: f64, random: &mut Random) -> Vec<Corner> {
        let seen = |number: usize| {
            let at = CAMERA.pixel(&(pose * BOARD.position(number))).unwrap();
            Corner { number, at: at.map(|part| part + sigma * random.normal()) }
        };
        (0..54).map(seen).collect()
    }

    #[test]
    fn a_pose_is_found_from_its_corners_however_the_board_leans() {
        let mut random = Random::seeded(2);
        for (roll, pitch) in [(0.0, 0.0), (0.5, -0.3), (-0.8, 0.2), (3.0, 0.4), (2.6, -0.2)] {
            for far in [250.0, 900.0] {
                let truth = truth(roll, pitch, far);
                let found = BOARD.pose(&CAMERA, &corners(&truth, 0.0, &mut random)).unwrap();
                let apart = (found.camera_from_board.translation.vector - truth.translation.vector).norm();
                assert!(apart < 1e-4 && found.off_px < 1e-5, "{roll} {pitch} {far}: {found:?}");
                assert!(found.camera_from_board.rotation.angle_to(&truth.rotation) < 1e-6);
                let noisy = BOARD.pose(&CAMERA, &corners(&truth, 0.2, &mut random)).unwrap();
                let off = noisy.camera_from_board.translation.vector - truth.translation.vector;
                assert!(off.norm() < 0.02 * far && (0.15..0.4).contains(&noisy.off_px), "{noisy:?}");
            }
        }
    }

    #[test]
    fn what_shows_no_board_is_refused() {
        let mut random = Random::seeded(3);
        let all = corners(&truth(0.2, 0.1, 300.0), 0.0, &mut random);
        let message = |corners: &[Corner]| BOARD.pose(&CAMERA, corners).unwrap_err().to_string();
        assert!(message(&all[..3]).starts_with("3 corners; the pose of a board needs four"));
        assert!(message(&all[..9]).contains("on one line"), "one row of the board");
        let strange = [Corner { number: 54, ..all[0] }, all[1], all[2], all[9]];
        assert!(
            message(&strange).contains("there is no corner 54; a board of 9 x 6 inner corners has 0 to 53")
        );
        assert!(message(&[all[0], all[1], all[0], all[9]]).contains("corner 0 is given twice"));
    }

    #[test]
    fn a_lens_bends_what_it_shows_as_brown_has_it_and_is_undone() {
        let camera = CameraNumbers {
            focal_px: [1000.0, 500.0],
            principal_px: [10.0, 20.0],
            distortion: [0.1, 0.2, 0.01, 0.02, 0.3],
        };
        // x = 0.5, y = 0.25: r^2 = 0.3125.
        let [u, v] = camera.pixel(&Point3::new(1.0, 0.5, 2.0)).unwrap();
        let r2 = 0.3125_f64;
        let radial = 1.0 + 0.1 * r2 + 0.2 * r2.powi(2) + 0.3 * r2.powi(3);
        let x = 0.5 * radial + 2.0 * 0.01 * 0.125 + 0.02 * (r2 + 2.0 * 0.25);
        let y = 0.25 * radial + 0.01 * (r2 + 2.0 * 0.0625) + 2.0 * 0.02 * 0.125;
        assert!((u - 1000.0 * x - 10.0).abs() < 1e-9 && (v - 500.0 * y - 20.0).abs() < 1e-9, "{u} {v}");
        let back = camera.direction([u, v]);
        assert!((back[0] - 0.5).abs() < 1e-6 && (back[1] - 0.25).abs() < 1e-6, "{back:?}");
        assert!(
            camera.pixel(&Point3::new(1.0, 0.5, 0.0)).is_none()
                && camera.pixel(&Point3::new(0.0, 0.0, -1.0)).is_none()
        );
    }

    #[test]
    fn corners_count_along_the_rows() {
        let board = BoardCorners { columns: 4, rows: 3, square_mm: 20.0 };
        assert_eq!(board.position(0), Point3::origin());
        assert_eq!(board.position(3), Point3::new(60.0, 0.0, 0.0));
        assert_eq!(board.position(9), Point3::new(20.0, 40.0, 0.0));
    }
}
