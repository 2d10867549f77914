//! The plane in which errors are drawn.

use super::residuals::AXES;

/// The plane as `x across, z up`.
pub(super) fn plane_name(plane: [usize; 2]) -> String {
    let axis = |index: usize| AXES.get(index).copied().unwrap_or("");
    format!("{} across, {} up", axis(plane[0]), axis(plane[1]))
}

/// Least and greatest of what is finite.
pub(super) fn span(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|value| value.is_finite()).fold(None, |span, value| match span {
        None => Some((value, value)),
        Some((low, high)) => Some((f64::min(low, value), f64::max(high, value))),
    })
}
