//! What is kept of the numbers of a field.

/// What is kept of the numbers of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Statistic {
    Last,
    Mean,
    StandardDeviation,
    Minimum,
    Maximum,
    Count,
}

impl Statistic {
    /// All there are.
    pub(super) const ALL: [Self; 6] =
        [Self::Last, Self::Mean, Self::StandardDeviation, Self::Minimum, Self::Maximum, Self::Count];

    /// As files name it.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Last => "last",
            Self::Mean => "mean",
            Self::StandardDeviation => "standard_deviation",
            Self::Minimum => "minimum",
            Self::Maximum => "maximum",
            Self::Count => "count",
        }
    }
}

/// The numbers of one field, added up as they come: mean and squares of deviations as Welford (Technometrics 4, 1962, p. 419) has them, so that small
/// deviations of large numbers are kept.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Numbers {
    count: u64,
    last: f64,
    mean: f64,
    squares: f64,
    minimum: f64,
    maximum: f64,
}

impl Numbers {
    pub(super) fn add(&mut self, number: f64) {
        let is_first = self.count == 0;
        self.count += 1;
        let before = number - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (number - self.mean);
        self.last = number;
        self.minimum = if is_first { number } else { self.minimum.min(number) };
        self.maximum = if is_first { number } else { self.maximum.max(number) };
    }

    /// One of the statistics; none where too few numbers came for it.
    pub(super) fn value(&self, statistic: Statistic) -> Option<f64> {
        match statistic {
            Statistic::Count => Some(self.count as f64),
            _ if self.count == 0 => None,
            Statistic::Last => Some(self.last),
            Statistic::Mean => Some(self.mean),
            Statistic::Minimum => Some(self.minimum),
            Statistic::Maximum => Some(self.maximum),
            Statistic::StandardDeviation if self.count < 2 => None,
            Statistic::StandardDeviation => Some((self.squares / (self.count - 1) as f64).sqrt()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_deviations_of_large_numbers_are_kept() {
        let mut numbers = Numbers::default();
        for number in [1e9 + 4.0, 1e9 + 7.0, 1e9 + 13.0, 1e9 + 16.0] {
            numbers.add(number);
        }
        let value = |statistic| numbers.value(statistic).expect("enough numbers");
        assert!((value(Statistic::Mean) - (1e9 + 10.0)).abs() < 1e-6);
        assert!((value(Statistic::StandardDeviation) - 30.0_f64.sqrt()).abs() < 1e-6);
        assert_eq!(
            [Statistic::Last, Statistic::Minimum, Statistic::Maximum, Statistic::Count].map(value),
            [1e9 + 16.0, 1e9 + 4.0, 1e9 + 16.0, 4.0]
        );
    }

    #[test]
    fn one_number_has_no_standard_deviation_and_none_has_nothing() {
        let mut numbers = Numbers::default();
        assert_eq!(
            Statistic::ALL.map(|statistic| numbers.value(statistic)),
            [None, None, None, None, None, Some(0.0)]
        );
        numbers.add(-3.0);
        assert_eq!(numbers.value(Statistic::StandardDeviation), None);
        assert_eq!(numbers.value(Statistic::Maximum), Some(-3.0));
    }
}
