//! Stretches of light stripes: what the second table of a scan holds, put on the surfaces it was seen on.

/// A stretch of a stripe of light: neighbouring points of one picture on one flat or round surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// The picture: a row of the table.
    pub row: usize,
    /// The surface it lies on, by its index in the model.
    pub surface: usize,
    /// Column and row of its points in the picture, px, one after the other along it.
    pub pixels: Vec<[f64; 2]>,
    /// Standard uncertainty of each reading of it, mm.
    pub sigma: f64,
    /// The weight of each point in each of its readings.
    weights: Vec<Vec<f64>>,
}

/// Points of a stretch from which it shows how it lies, how it is turned, and how it bends.
const POINTS_THAT_SHOW: [usize; 3] = [3, 5, 9];

impl Stretch {
    /// A stretch of these points.
    pub fn new(row: usize, surface: usize, pixels: Vec<[f64; 2]>, sigma: f64) -> Self {
        let readings = POINTS_THAT_SHOW.iter().filter(|needed| pixels.len() >= **needed).count();
        let weights = (0..readings).map(|reading| weights(pixels.len(), reading)).collect();
        Self { row, surface, pixels, sigma, weights }
    }

    /// How many independent readings it is: at most three. Its points are more, and err alike.
    pub fn readings(&self) -> usize {
        self.weights.len()
    }

    /// The weight of each point in a reading: the mean (0), the slope (1) and the bend (2) along the stretch, orthogonal to each other over evenly spread points
    /// and each with the mean square of 1 (Gram's polynomials), so that points which scatter alike make readings that scatter alike.
    pub fn weights(&self, reading: usize) -> &[f64] {
        self.weights.get(reading).map_or(&[], Vec::as_slice)
    }
}

/// The weights of so many points in a reading.
fn weights(count: usize, reading: usize) -> Vec<f64> {
    // Positions of evenly spread points, from -1 to 1.
    let along: Vec<f64> =
        (0..count).map(|index| 2.0 * index as f64 / (count.max(2) - 1) as f64 - 1.0).collect();
    let square = mean(along.iter().map(|position| position.powi(2)));
    let raw: Vec<f64> = along
        .iter()
        .map(|position| match reading {
            0 => 1.0,
            1 => *position,
            // Less its own mean, so that it is orthogonal to the first; to the second it is by symmetry.
            _ => position.powi(2) - square,
        })
        .collect();
    let size = mean(raw.iter().map(|weight| weight.powi(2))).sqrt().max(f64::MIN_POSITIVE);
    raw.iter().map(|weight| weight / size / count as f64).collect()
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stretch(points: usize) -> Stretch {
        Stretch::new(0, 0, vec![[0.0; 2]; points], 1.0)
    }

    #[test]
    fn readings_are_orthogonal_and_scatter_alike() {
        let stretch = stretch(11);
        for one in 0..3 {
            for other in 0..3 {
                let product: f64 =
                    stretch.weights(one).iter().zip(stretch.weights(other)).map(|(a, b)| a * b).sum();
                let expected = if one == other { 1.0 / 11.0 } else { 0.0 };
                assert!((product - expected).abs() < 1e-12, "{one}, {other}: {product}");
            }
        }
    }

    #[test]
    fn a_short_stretch_determines_less() {
        assert_eq!([2, 3, 4, 5, 8, 9, 40].map(|points| stretch(points).readings()), [0, 1, 1, 2, 2, 3, 3]);
    }
}
