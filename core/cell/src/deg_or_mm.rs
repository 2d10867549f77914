//! Units in which people write the numbers of joints.

/// How people write a joint's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DegOrMm {
    /// A turning joint, in degrees.
    Deg,
    /// A sliding joint or a gripper's opening, in millimetres.
    Mm,
}

impl DegOrMm {
    /// `deg` or `mm`.
    pub fn symbol(self) -> &'static str {
        match self {
            DegOrMm::Deg => "deg",
            DegOrMm::Mm => "mm",
        }
    }

    /// From what people write to the unit inside: rad or mm.
    pub fn to_internal(self, value: f64) -> f64 {
        match self {
            DegOrMm::Deg => value.to_radians(),
            DegOrMm::Mm => value,
        }
    }

    /// From rad or mm to what people read.
    pub fn from_internal(self, value: f64) -> f64 {
        match self {
            DegOrMm::Deg => value.to_degrees(),
            DegOrMm::Mm => value,
        }
    }
}
