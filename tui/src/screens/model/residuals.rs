//! Residuals as the plots need them: one row a measurement, its error in mm by direction, and all it could depend on.

/// The residuals of a model against its table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Residuals {
    /// The directions errors are given in, as `x`, `y`, `z` or `height`.
    pub directions: Vec<String>,
    /// What the errors can be held against, as joints, order and temperature.
    pub against: Vec<Abscissa>,
    /// One a measurement.
    pub rows: Vec<ResidualRow>,
}

/// Something errors can be held against.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Abscissa {
    /// Its name.
    pub name: String,
    /// Its unit; empty where it has none.
    pub unit: String,
}

/// The error of one measurement.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ResidualRow {
    /// Measured minus modelled in each direction, mm; none where it was not measured.
    pub error_mm: Vec<Option<f64>>,
    /// The value of each abscissa; none where it was not recorded.
    pub against: Vec<Option<f64>>,
    /// Where the target was measured, mm, where it was measured whole.
    pub position_mm: Option<[f64; 3]>,
}

impl Residuals {
    /// All errors in one direction, mm.
    pub(crate) fn errors(&self, direction: usize) -> impl Iterator<Item = f64> + '_ {
        self.rows.iter().filter_map(move |row| row.error_mm.get(direction).copied().flatten())
    }

    /// Errors in one direction against one abscissa.
    pub(crate) fn points(&self, abscissa: usize, direction: usize) -> Vec<(f64, f64)> {
        self.rows
            .iter()
            .filter_map(|row| {
                let against = row.against.get(abscissa).copied().flatten()?;
                let error = row.error_mm.get(direction).copied().flatten()?;
                (against.is_finite() && error.is_finite()).then_some((against, error))
            })
            .collect()
    }

    /// The typical size of an error in mm, all directions together, that few gross ones do not change: the median of the
    /// sizes over that of a normal distribution.
    pub(crate) fn typical_mm(&self) -> f64 {
        let mut sizes: Vec<f64> =
            self.rows.iter().flat_map(|row| row.error_mm.iter().flatten()).map(|error| error.abs()).collect();
        sizes.retain(|size| size.is_finite());
        sizes.sort_by(f64::total_cmp);
        sizes.get(sizes.len() / 2).map_or(0.0, |median| median / 0.6745)
    }
}
