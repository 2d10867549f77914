//! What an operator measures with: an instrument that scatters and is read to its divisions.

use crate::chance::normal;

/// How well an instrument measures.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Instrument {
    /// Standard deviation of one reading, in the instrument's unit.
    pub error: f64,
    /// The smallest division it is read to; 0 for as fine as there are numbers.
    pub division: f64,
}

impl Instrument {
    /// What is read where `truth` is so; `occasion` counts the readings.
    pub fn read(&self, truth: f64, seed: u64, occasion: u64) -> f64 {
        let felt = truth + self.error * normal(seed ^ 0x0b5e_7fe5, occasion);
        if self.division > 0.0 { (felt / self.division).round() * self.division } else { felt }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_perfect_instrument_reads_the_truth() {
        assert_eq!(Instrument::default().read(1.234_567, 1, 1), 1.234_567);
    }

    #[test]
    fn readings_scatter_and_fall_on_divisions() {
        let ruler = Instrument { error: 0.3, division: 0.5 };
        let readings: Vec<f64> = (0..50).map(|occasion| ruler.read(8.1, 3, occasion)).collect();
        assert!(readings.iter().all(|reading| (reading * 2.0).fract() == 0.0));
        assert!(readings.iter().any(|reading| *reading != readings[0]));
        assert_eq!(ruler.read(8.1, 3, 7), readings[7]);
    }
}
