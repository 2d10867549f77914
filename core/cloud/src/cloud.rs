//! Points of a scan.

use nalgebra::Point3;
use plumb_plugin::StripePoint;

/// A point of a cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudPoint {
    /// Where, mm in the robot's base frame.
    pub position: Point3<f64>,
    /// The stripe it is of.
    pub stripe: u32,
    /// How it was seen.
    pub seen: StripePoint,
}

/// What a scan has made.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cloud {
    /// The points.
    pub points: Vec<CloudPoint>,
    /// The joints at each stripe, as the drive's with the zeros in force, rad.
    pub poses: Vec<Vec<f64>>,
    /// When each stripe was exposed, by the cell's clock, s.
    pub times: Vec<f64>,
    /// The side each joint had arrived from at each stripe, -1, 0 (not known) or 1.
    pub approaches: Vec<Vec<i8>>,
    /// How fast each joint went at each stripe, rad/s or mm/s.
    pub speeds: Vec<Vec<f64>>,
}
