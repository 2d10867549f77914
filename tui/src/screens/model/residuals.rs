//! Residuals as the plots need them: the error of every measurement, and errors against all they could depend on.

use plumb_diagnosis::laboratory::{RowResidual, Series};

/// The residuals of a model against its table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Residuals {
    /// One a measurement.
    pub rows: Vec<RowResidual>,
    /// Errors against each joint, moment, condition.
    pub series: Vec<Series>,
}

/// A plane errors are looked at in: two of the axes x, y, z.
pub(crate) const PLANES: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// Names of the axes.
pub(crate) const AXES: [&str; 3] = ["x", "y", "z"];

impl Residuals {
    /// The typical error along one axis, in the unit of the table's readings, that few gross ones do not change: the median of the sizes over that of the
    /// size of a normal error in space (1.538 standard deviations).
    pub(crate) fn typical_mm(&self) -> f64 {
        let mut sizes: Vec<f64> =
            self.rows.iter().filter_map(|row| row.size).filter(|size| size.is_finite()).collect();
        sizes.sort_by(f64::total_cmp);
        sizes.get(sizes.len() / 2).map_or(0.0, |median| median / 1.538)
    }

    /// The rows in which anything is left, by their index in the table, the worst first.
    pub(crate) fn worst(&self) -> Vec<usize> {
        let sizes = self.rows.iter().filter_map(|row| Some((row.size?, row.row)));
        let mut rows: Vec<(f64, usize)> = sizes.filter(|(size, _)| size.is_finite() && *size > 0.0).collect();
        rows.sort_by(|one, other| other.0.total_cmp(&one.0));
        rows.into_iter().map(|(_, row)| row).collect()
    }

    /// Errors of all measurements in a plane, mm, with their rows.
    pub(crate) fn in_plane(&self, plane: [usize; 2]) -> impl Iterator<Item = (f64, f64, usize)> + '_ {
        self.rows.iter().filter_map(move |row| {
            let (across, up) = (*row.vector_mm.get(plane[0])?, *row.vector_mm.get(plane[1])?);
            (across.is_finite() && up.is_finite()).then_some((across, up, row.row))
        })
    }
}

/// What a series goes against, in the order in which the plots are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Subject {
    /// A joint's own coordinate.
    Joint,
    /// A moment of gravity.
    Moment,
    /// The side from which a joint arrived.
    Approach,
    /// The order of the rows.
    Order,
    /// Anything else: time, temperature, load, what else the table holds.
    Condition,
}

impl Subject {
    /// What this series goes against.
    pub(crate) fn of(series: &Series) -> Self {
        match (series.unit.as_str(), series.against.as_str()) {
            ("N m", _) => Self::Moment,
            ("side", _) => Self::Approach,
            ("row", _) => Self::Order,
            ("deg" | "mm", against) if !against.contains(' ') => Self::Joint,
            _ => Self::Condition,
        }
    }
}

/// A moment of gravity that varies less than this share of the greatest one is nothing but rounding.
const SMALL_MOMENT: f64 = 0.01;

/// Whether what a series goes against varies enough to be drawn beside the others.
pub(crate) fn varies(series: &Series, all: &[Series]) -> bool {
    let least = match Subject::of(series) {
        Subject::Moment => {
            let moments = all.iter().filter(|other| Subject::of(other) == Subject::Moment);
            SMALL_MOMENT * moments.map(width).fold(0.0, f64::max)
        }
        _ => 1e-3,
    };
    width(series) > least
}

/// How far what a series goes against varies, in its own unit.
fn width(series: &Series) -> f64 {
    let values = || series.points.iter().map(|point| point.0).filter(|value| value.is_finite());
    let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    if high > low { high - low } else { 0.0 }
}
