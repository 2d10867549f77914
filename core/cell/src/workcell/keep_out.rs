//! Planes no part of a robot may pass.

/// The points p with normal . p < offset are out of bounds. In the robot's base frame.
#[derive(Debug, Clone, PartialEq)]
pub struct KeepOutPlane {
    /// What people call it.
    pub name: String,
    /// The robot it is for.
    pub robot: String,
    /// Unit length; points to the side that is free.
    pub normal: [f64; 3],
    /// mm along the normal.
    pub offset_mm: f64,
}

impl KeepOutPlane {
    /// How far a point (mm) is on the free side, mm; negative when it is out of bounds.
    pub fn clearance(&self, point: [f64; 3]) -> f64 {
        let along: f64 = self.normal.iter().zip(point).map(|(n, p)| n * p).sum();
        along - self.offset_mm
    }
}
