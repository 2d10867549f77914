//! What an adjustment says of its own numbers: how well each is known, and what no stripe could tell.

use nalgebra::DMatrix;

/// A direction whose eigenvalue is so small a share of the largest cannot be told.
const SINGULAR: f64 = 1e-10;

/// Standard errors, and what cannot be told, from the scaled normal matrix's eigenvectors.
pub(super) fn spread(
    jacobian: &DMatrix<f64>,
    names: &[(String, String)],
    variance: f64,
) -> (Vec<f64>, Vec<String>) {
    let normal = jacobian.tr_mul(jacobian);
    let scales: Vec<f64> =
        (0..normal.nrows()).map(|place| normal[(place, place)].sqrt().max(1e-300)).collect();
    let scaled = DMatrix::from_fn(normal.nrows(), normal.ncols(), |row, column| {
        let scale = |place: usize| scales.get(place).copied().unwrap_or(1.0);
        normal[(row, column)] / (scale(row) * scale(column))
    });
    let eigen = scaled.symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let mut variances = vec![0.0; normal.nrows()];
    let mut hidden = Vec::new();
    for (which, value) in eigen.eigenvalues.iter().enumerate() {
        let direction = eigen.eigenvectors.column(which);
        if *value <= SINGULAR * largest {
            hidden.extend(in_words(direction.as_slice(), names));
            continue;
        }
        for ((sum, part), scale) in variances.iter_mut().zip(direction.iter()).zip(&scales) {
            *sum += part * part / value / (scale * scale);
        }
    }
    (variances.iter().map(|sum| (sum * variance).sqrt()).collect(), hidden)
}

/// A direction nothing depends on, by the names of its greatest parts.
fn in_words(direction: &[f64], names: &[(String, String)]) -> Option<String> {
    let mut parts: Vec<(f64, &str)> =
        direction.iter().zip(names).map(|(part, (name, _))| (part.abs(), name.as_str())).collect();
    parts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let greatest = parts.first()?.0;
    // A direction that only moves surfaces is none of the machine.
    if greatest < 0.02 {
        return None;
    }
    let named: Vec<&str> =
        parts.iter().take_while(|(part, _)| *part > 0.25 * greatest).take(4).map(|(_, name)| *name).collect();
    Some(match named.as_slice() {
        [one] => format!("{one}: the surfaces move with it, whatever it is"),
        several => format!("{}: only together, not apart", several.join(", ")),
    })
}
