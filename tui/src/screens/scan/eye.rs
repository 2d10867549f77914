//! The virtual camera: from where a cloud is looked at, and where its points then lie in the view.

use nalgebra::{Point3, Vector3};

/// From where a cloud is looked at. A view's units: half of its shorter side is 1, the middle 0, x to the right and y up.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Eye {
    /// The point in the middle of the view, mm.
    pub target: Point3<f64>,
    /// How it is placed.
    pub viewpoint: Viewpoint,
    /// Its opening across the view's shorter side, rad; 0 sees all rays parallel.
    pub opening: f64,
    /// What the shorter side shows at the target, mm.
    pub span: f64,
}

/// How an eye is placed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Viewpoint {
    /// Anywhere around the cloud.
    Around {
        /// About the vertical, rad; at 0 it looks along y, with x to the right.
        yaw: f64,
        /// Up from the horizontal, rad.
        pitch: f64,
        /// About the line of sight, rad.
        roll: f64,
    },
    /// Along a plane, whose thickness is drawn larger than the rest.
    EdgeOn {
        /// The plane's normal, up in the view.
        normal: Vector3<f64>,
        /// A direction in the plane, to the right in the view.
        along: Vector3<f64>,
        /// How many times larger what is along the normal is drawn.
        stretch: f64,
    },
}

/// Where a point lies in a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// To the right.
    pub x: f64,
    /// Up.
    pub y: f64,
    /// Behind the target, mm.
    pub depth: f64,
}

/// The steepest an eye is over or under a cloud.
const STEEPEST: f64 = std::f64::consts::FRAC_PI_2;
/// An eye goes back at most so often to see all.
const MOST_STEPS_BACK: usize = 40;
/// The widest opening, rad.
const WIDEST: f64 = 2.0;
/// What the shorter side shows at least and at most, mm.
const SPANS: (f64, f64) = (1e-3, 1e6);

impl Eye {
    /// One that sees all of these points, from before and above.
    pub(crate) fn around(points: impl Iterator<Item = Point3<f64>>) -> Self {
        let viewpoint =
            Viewpoint::Around { yaw: -30.0_f64.to_radians(), pitch: 30.0_f64.to_radians(), roll: 0.0 };
        let mut eye =
            Self { target: Point3::origin(), viewpoint, opening: 30.0_f64.to_radians(), span: 100.0 };
        eye.see_all(points);
        eye
    }

    /// Moves so that all of these are seen, from the same direction.
    pub(crate) fn see_all(&mut self, points: impl Iterator<Item = Point3<f64>>) {
        let mut corners: Option<(Point3<f64>, Point3<f64>)> = None;
        for point in points {
            let (low, high) = corners.unwrap_or((point, point));
            corners = Some((low.inf(&point), high.sup(&point)));
        }
        let Some((low, high)) = corners else { return };
        self.target = nalgebra::center(&low, &high);
        let [right, up, _] = self.axes();
        let half = (high - low) / 2.0;
        let reach = |axis: Vector3<f64>| axis.abs().dot(&half);
        // Views are wider than high.
        self.span = (2.2 * reach(up).max(reach(right) / 1.2)).clamp(1.0, SPANS.1);
        // What comes nearer in perspective takes more room.
        for _ in 0..MOST_STEPS_BACK {
            let corners = (0..8_u8).map(|corner| {
                let axis = |axis: usize| if corner >> axis & 1 == 1 { high[axis] } else { low[axis] };
                Point3::new(axis(0), axis(1), axis(2))
            });
            let room = corners
                .map(|corner| self.see(&corner).map_or(2.0, |seen| seen.y.abs().max(seen.x.abs() / 1.2)));
            let most = room.fold(0.0, f64::max);
            if most <= 1.0 {
                break;
            }
            self.span = (self.span * most.clamp(1.02, 1.5)).clamp(1.0, SPANS.1);
        }
    }

    /// To the right, up, and toward the eye.
    fn axes(&self) -> [Vector3<f64>; 3] {
        match &self.viewpoint {
            Viewpoint::Around { yaw, pitch, roll } => {
                let ((sy, cy), (sp, cp), (sr, cr)) = (yaw.sin_cos(), pitch.sin_cos(), roll.sin_cos());
                let back = Vector3::new(cp * sy, -cp * cy, sp);
                let level = Vector3::new(cy, sy, 0.0);
                let up = back.cross(&level);
                [level * cr + up * sr, up * cr - level * sr, back]
            }
            Viewpoint::EdgeOn { normal, along, .. } => [*along, *normal, along.cross(normal)],
        }
    }

    fn stretch(&self) -> f64 {
        if let Viewpoint::EdgeOn { stretch, .. } = self.viewpoint { stretch } else { 1.0 }
    }

    /// Where a point lies in the view; none when it lies behind the eye.
    pub(crate) fn see(&self, position: &Point3<f64>) -> Option<Seen> {
        let [right, up, back] = self.axes();
        let away = position - self.target;
        let (x, y, near) = (away.dot(&right), away.dot(&up) * self.stretch(), away.dot(&back));
        let half = self.span / 2.0;
        let is_parallel = self.opening <= 0.0 || matches!(self.viewpoint, Viewpoint::EdgeOn { .. });
        let scale = if is_parallel {
            1.0
        } else {
            let distance = half / (self.opening / 2.0).tan();
            let ahead = distance - near;
            if ahead < 0.02 * distance {
                return None;
            }
            distance / ahead
        };
        Some(Seen { x: x * scale / half, y: y * scale / half, depth: -near })
    }

    /// Turns by these angles, rad; over an edge the plane is turned, and its thickness drawn larger or smaller.
    pub(crate) fn turn(&mut self, to_right: f64, upward: f64) {
        match &mut self.viewpoint {
            Viewpoint::Around { yaw, pitch, .. } => {
                *yaw = (*yaw + to_right).rem_euclid(std::f64::consts::TAU);
                *pitch = (*pitch + upward).clamp(-STEEPEST, STEEPEST);
            }
            Viewpoint::EdgeOn { normal, along, stretch } => {
                let turned =
                    nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(*normal), to_right);
                *along = turned * *along;
                *stretch = (*stretch * (2.0 * upward).exp()).clamp(1.0, 1e6);
            }
        }
    }

    /// Rolls about the line of sight, rad.
    pub(crate) fn roll(&mut self, by: f64) {
        if let Viewpoint::Around { roll, .. } = &mut self.viewpoint {
            *roll =
                (*roll + by + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        }
    }

    /// Moves to the right and up, in units of the view.
    pub(crate) fn shift(&mut self, to_right: f64, upward: f64) {
        let [right, up, _] = self.axes();
        let half = self.span / 2.0;
        self.target += right * (to_right * half) + up * (upward * half / self.stretch());
    }

    /// Goes nearer: below 1 the view shows less, larger.
    pub(crate) fn zoom(&mut self, by: f64) {
        self.span = (self.span * by).clamp(SPANS.0, SPANS.1);
    }

    /// Opens wider or less wide, rad; what is in the middle stays as large as it is.
    pub(crate) fn open(&mut self, by: f64) {
        self.opening = (self.opening + by).clamp(0.0, WIDEST);
    }

    /// The same a little to one side, for one eye of two: both look at the target.
    pub(crate) fn beside(&self, angle: f64) -> Self {
        let mut other = self.clone();
        other.turn(angle, 0.0);
        other
    }

    /// What it is set to, in words.
    pub(crate) fn describe(&self) -> String {
        let degrees = |angle: f64| angle.to_degrees().round() + 0.0;
        let [x, y, z] = self.target.coords.into();
        let position = format!("at [{x:.1}, {y:.1}, {z:.1}] mm, {:.4} mm high", Short(self.span));
        match &self.viewpoint {
            Viewpoint::Around { yaw, pitch, roll } => {
                let lens = if self.opening > 0.0 {
                    format!("{} deg", degrees(self.opening))
                } else {
                    "parallel".to_owned()
                };
                let around = format!("turn {} deg, up {} deg", degrees(*yaw), degrees(*pitch));
                let roll =
                    if *roll == 0.0 { String::new() } else { format!(", roll {} deg", degrees(*roll)) };
                format!("{around}{roll}, opening {lens}, {position}")
            }
            Viewpoint::EdgeOn { stretch, .. } => format!("edge-on, thickness x {:.0}, {position}", stretch),
        }
    }
}

/// A number with as many digits as it deserves.
pub(crate) struct Short(pub f64);

impl std::fmt::Display for Short {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = if self.0.abs() >= 100.0 {
            0
        } else if self.0.abs() >= 1.0 {
            1
        } else {
            4
        };
        write!(formatter, "{:.digits$}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from_before() -> Eye {
        Eye {
            target: Point3::new(10.0, 20.0, 30.0),
            viewpoint: Viewpoint::Around { yaw: 0.0, pitch: 0.0, roll: 0.0 },
            opening: 0.0,
            span: 100.0,
        }
    }

    fn seen(eye: &Eye, x: f64, y: f64, z: f64) -> (f64, f64, f64) {
        let seen = eye.see(&Point3::new(x, y, z)).unwrap();
        let rounded = |value: f64| (value * 1e6).round() / 1e6 + 0.0;
        (rounded(seen.x), rounded(seen.y), rounded(seen.depth))
    }

    #[test]
    fn from_before_x_is_to_the_right_z_is_up_and_y_is_behind() {
        let mut eye = from_before();
        assert_eq!(seen(&eye, 60.0, 20.0, 30.0), (1.0, 0.0, 0.0));
        assert_eq!(seen(&eye, 10.0, 20.0, 80.0), (0.0, 1.0, 0.0));
        assert_eq!(seen(&eye, 10.0, 70.0, 30.0), (0.0, 0.0, 50.0));
        eye.turn(0.0, STEEPEST);
        assert_eq!(seen(&eye, 10.0, 70.0, 30.0), (0.0, 1.0, 0.0), "from above, y is up");
        eye.turn(0.0, 1.0);
        assert_eq!(
            eye.viewpoint,
            Viewpoint::Around { yaw: 0.0, pitch: STEEPEST, roll: 0.0 },
            "never over the top"
        );
    }

    #[test]
    fn a_lens_makes_what_is_near_larger_and_leaves_out_what_is_behind_it() {
        let eye = Eye { opening: 1.0, ..from_before() };
        let (near, _, _) = seen(&eye, 20.0, 0.0, 30.0);
        let (far, _, _) = seen(&eye, 20.0, 40.0, 30.0);
        assert!(near > 0.2 && 0.2 > far, "{near} {far}");
        assert!(eye.see(&Point3::new(10.0, -100.0, 30.0)).is_none());
    }

    #[test]
    fn it_moves_with_the_view_and_sees_all() {
        let mut eye = from_before();
        eye.shift(0.5, -0.5);
        assert_eq!(eye.target, Point3::new(35.0, 20.0, 5.0));
        let corners = [[0.0, 0.0, 0.0], [200.0, 300.0, 40.0]].map(Point3::from);
        let mut eye = Eye::around(corners.into_iter());
        for _ in 0..20 {
            for corner in &corners {
                let seen = eye.see(corner).unwrap();
                assert!(seen.x.abs() <= 1.2001 && seen.y.abs() <= 1.0001, "{seen:?}");
            }
            eye.turn(0.3, 0.05);
            eye.see_all(corners.into_iter());
        }
    }

    #[test]
    fn edge_on_thickness_is_drawn_larger() {
        let viewpoint = Viewpoint::EdgeOn { normal: Vector3::z(), along: Vector3::x(), stretch: 100.0 };
        let mut eye = Eye { viewpoint, ..from_before() };
        assert_eq!(seen(&eye, 60.0, 20.0, 30.5), (1.0, 1.0, 0.0));
        eye.turn(STEEPEST, 0.0);
        assert_eq!(seen(&eye, 10.0, 70.0, 30.0).0.abs(), 1.0);
    }
}
