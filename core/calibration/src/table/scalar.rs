//! Columns of one number a row that kinds of measurement read: `height_mm`, `distance_mm`. A new one is a line in `SCALARS`: how its header and its
//! cells are read, what its cells may hold, how it is written, and its key of `noise:` follow from it.

/// What a column of one number is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScalarUnit {
    /// Lengths: in tables mm, m or in; inside mm.
    Length,
    /// Angles: in tables deg or rad; inside rad.
    Angle,
}

/// A number that a kind of measurement reads.
#[derive(Debug, PartialEq)]
pub struct Scalar {
    /// The column's header without its target and its unit.
    pub name: &'static str,
    /// What it is in.
    pub unit: ScalarUnit,
    /// Whether each target has a column of its own, whose header begins with the target's name: `p1_azimuth_deg`. Else it is of p1.
    pub is_of_target: bool,
    /// Least and greatest value it can have, mm or deg.
    pub range: [f64; 2],
    /// What is said of a value beyond that, after "cannot be": what would be right. Empty where that is plain.
    pub hint: &'static str,
}

/// No limit on either side.
const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Height of p1 over the surface named in `on`.
pub static HEIGHT: Scalar =
    Scalar { name: "height", unit: ScalarUnit::Length, is_of_target: false, range: ANY, hint: "" };

/// Distance of p1 to the point named in `distance_to`.
pub static DISTANCE: Scalar = Scalar {
    name: "distance",
    unit: ScalarUnit::Length,
    is_of_target: false,
    range: [0.0, f64::INFINITY],
    hint: "",
};

/// Azimuth of a target, seen from the origin of the measurements' frame: about its +z, from +x towards +y.
pub static AZIMUTH: Scalar = Scalar {
    name: "azimuth",
    unit: ScalarUnit::Angle,
    is_of_target: true,
    range: [-360.0, 360.0],
    hint: ": it is from -360 to 360 deg",
};

/// Elevation of a target over the plane of x and y of the measurements' frame, seen from its origin.
pub static ELEVATION: Scalar = Scalar {
    name: "elevation",
    unit: ScalarUnit::Angle,
    is_of_target: true,
    range: [-90.0, 90.0],
    hint: ": it is from -90 to 90 deg, from the horizontal plane; of a zenith angle it is 90 deg less that",
};

/// All of them, in the order in which they are written.
pub(crate) static SCALARS: &[&Scalar] = &[&HEIGHT, &DISTANCE, &AZIMUTH, &ELEVATION];

impl Scalar {
    /// Its key of `noise:`, which is also the header of its column where that is of no target of its own: `height_mm`.
    pub fn key(&self) -> String {
        format!("{}_{}", self.name, self.unit_name())
    }

    /// The header of its column, of p1 where each target has one: `height_mm`, `p1_azimuth_deg`.
    pub fn header(&self) -> String {
        self.header_of(self.is_of_target.then_some(0))
    }

    /// The header of its column for a target, by its number from 0.
    fn header_of(&self, target: Option<usize>) -> String {
        target.map_or_else(|| self.key(), |target| format!("p{}_{}", target + 1, self.key()))
    }

    /// The unit of tables and model files: mm or deg.
    fn unit_name(&self) -> &'static str {
        match self.unit {
            ScalarUnit::Length => "mm",
            ScalarUnit::Angle => "deg",
        }
    }

    /// What is wrong with an inner value (mm or rad), if anything is.
    ///
    /// # Errors
    /// In words: what it was taken for, and what would be right.
    pub(crate) fn check(&self, value: f64) -> Result<(), String> {
        // The last digits of a conversion from radians are no reason to refuse a limit itself.
        const ROUNDING: f64 = 1e-9;
        let shown = self.shown(value);
        let [least, most] = self.range;
        if (least - ROUNDING..=most + ROUNDING).contains(&shown) {
            return Ok(());
        }
        let unit = self.unit_name();
        let article = if self.name.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
        Err(format!("{article} {} of {shown} {unit} cannot be{}", self.name, self.hint))
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
    /// Of which target, by its number from 0, where each target has a column of its own.
    pub target: Option<usize>,
    /// Its values, a row each.
    pub values: Vec<f64>,
}

impl ScalarColumn {
    /// A column without rows, of a number that is of no target of its own.
    pub fn empty(scalar: &'static Scalar) -> Self {
        Self { scalar, target: None, values: Vec::new() }
    }

    /// The same column without rows.
    pub fn without_rows(&self) -> Self {
        Self { scalar: self.scalar, target: self.target, values: Vec::new() }
    }

    /// Its header as it is written.
    pub(crate) fn header(&self) -> String {
        self.scalar.header_of(self.target)
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
    fn a_number_of_a_target_has_its_name_in_the_header_and_not_in_the_key_of_noise() {
        let lean = Scalar { name: "lean", unit: ScalarUnit::Angle, is_of_target: true, ..HEIGHT };
        assert_eq!((lean.header(), lean.key()), ("p1_lean_deg".to_owned(), "lean_deg".to_owned()));
        let column = ScalarColumn { target: Some(2), ..ScalarColumn::empty(&HEIGHT) };
        assert_eq!(column.header(), "p3_height_mm");
        assert_eq!(column.without_rows(), column);
    }

    #[test]
    fn a_value_beyond_the_range_is_refused_in_the_unit_of_files() {
        let lean = Scalar {
            name: "easing",
            unit: ScalarUnit::Angle,
            range: [-90.0, 90.0],
            hint: ": less is more",
            ..HEIGHT
        };
        for sound in [-90.0_f64, 0.0, 90.0] {
            assert_eq!(lean.check(sound.to_radians()), Ok(()), "{sound}");
        }
        assert_eq!(
            lean.check(lean.inner(90.5)),
            Err("an easing of 90.5 deg cannot be: less is more".to_owned())
        );
        assert!(lean.check(lean.inner(-90.001)).is_err());
        assert_eq!(DISTANCE.check(-2.0), Err("a distance of -2 mm cannot be".to_owned()));
        assert_eq!((DISTANCE.check(0.0), HEIGHT.check(-2.0)), (Ok(()), Ok(())));
    }

    #[test]
    fn angles_are_written_in_degrees_and_kept_in_radians() {
        let lean = Scalar { name: "lean", unit: ScalarUnit::Angle, ..HEIGHT };
        assert_eq!(lean.header(), "lean_deg");
        assert!((lean.shown(lean.inner(30.0)) - 30.0).abs() < 1e-12);
        assert!((lean.inner(180.0) - std::f64::consts::PI).abs() < 1e-12);
        assert_eq!((HEIGHT.shown(2.5), HEIGHT.inner(2.5)), (2.5, 2.5));
    }
}
