//! Columns of one number a row that kinds of measurement read: `height_mm`, `distance_mm`. A new one is a line in `SCALARS`: how its header and its
//! cells are read, how it is written, and its key of `noise:` follow from it.

/// What a column of one number is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScalarUnit {
    /// Lengths: in tables mm, m or in; inside mm.
    Length,
    /// Angles: in tables deg or rad; inside rad.
    Angle,
}

/// A number that a kind of measurement reads.
#[derive(Debug, PartialEq, Eq)]
pub struct Scalar {
    /// The column's header without its unit.
    pub name: &'static str,
    /// What it is in.
    pub unit: ScalarUnit,
    /// Whether it may be below zero.
    pub is_signed: bool,
}

/// Height of p1 over the surface named in `on`.
pub static HEIGHT: Scalar = Scalar { name: "height", unit: ScalarUnit::Length, is_signed: true };

/// Distance of p1 to the point named in `distance_to`.
pub static DISTANCE: Scalar = Scalar { name: "distance", unit: ScalarUnit::Length, is_signed: false };

/// All of them, in the order in which they are written.
pub(crate) static SCALARS: &[&Scalar] = &[&HEIGHT, &DISTANCE];

impl Scalar {
    /// Its column as it is written, which is also its key of `noise:`: `height_mm`.
    pub fn header(&self) -> String {
        let unit = match self.unit {
            ScalarUnit::Length => "mm",
            ScalarUnit::Angle => "deg",
        };
        format!("{}_{unit}", self.name)
    }

    /// An inner value (mm or rad) in the unit of its header.
    pub fn shown(&self, value: f64) -> f64 {
        match self.unit {
            ScalarUnit::Length => value,
            ScalarUnit::Angle => value.to_degrees(),
        }
    }

    /// A value in the unit of its header as an inner one, mm or rad.
    pub fn inner(&self, shown: f64) -> f64 {
        match self.unit {
            ScalarUnit::Length => shown,
            ScalarUnit::Angle => shown.to_radians(),
        }
    }
}

/// One such column of a table: mm or rad, not a number where it was not measured.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalarColumn {
    /// What it holds.
    pub scalar: &'static Scalar,
    /// Its values, a row each.
    pub values: Vec<f64>,
}

impl ScalarColumn {
    /// A column without rows.
    pub fn empty(scalar: &'static Scalar) -> Self {
        Self { scalar, values: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_has_a_column_of_its_own() {
        for (index, scalar) in SCALARS.iter().enumerate() {
            assert!(SCALARS.iter().skip(index + 1).all(|other| other.name != scalar.name), "{}", scalar.name);
        }
        assert_eq!([&HEIGHT, &DISTANCE].map(Scalar::header), ["height_mm", "distance_mm"]);
    }

    #[test]
    fn angles_are_written_in_degrees_and_kept_in_radians() {
        let lean = Scalar { name: "lean", unit: ScalarUnit::Angle, is_signed: true };
        assert_eq!(lean.header(), "lean_deg");
        assert!((lean.shown(lean.inner(30.0)) - 30.0).abs() < 1e-12);
        assert!((lean.inner(180.0) - std::f64::consts::PI).abs() < 1e-12);
        assert_eq!((HEIGHT.shown(2.5), HEIGHT.inner(2.5)), (2.5, 2.5));
    }
}
