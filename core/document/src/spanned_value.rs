//! Checks of values that know their position.

use std::ops::RangeInclusive;

use crate::{Problems, Spanned};

impl Spanned<f64> {
    /// The number if it is within the range (in `unit`), or NaN after an error. No error is made of a stand-in, or where the range
    /// itself rests on one.
    #[must_use]
    pub fn between(&self, what: &str, range: RangeInclusive<f64>, unit: &str, problems: &Problems) -> f64 {
        let (least, most) = (*range.start(), *range.end());
        if range.contains(&self.value) || least.is_nan() || most.is_nan() {
            return self.value;
        }
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        problems.add(
            self.span,
            format!("{what} is {}", self.value),
            format!("it lies between {least} and {most}{unit}"),
        );
        f64::NAN
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Span;

    #[test]
    fn a_number_out_of_range_is_reported_once_and_what_rests_on_it_is_not_accused() {
        let problems = Problems::default();
        let number = |value, line| Spanned { span: Span { line, column: 1, length: 1 }, value };
        assert_eq!(number(3.0, 1).between("`a`", 0.0..=5.0, "mm", &problems), 3.0);
        assert!(problems.is_empty());
        let broken = number(6.0, 2).between("`b`", 0.0..=5.0, "mm", &problems);
        assert!(broken.is_nan());
        assert_eq!(number(9.0, 3).between("`c`", 0.0..=broken, "mm", &problems), 9.0);
        let stand_in = Spanned { span: Span::NONE, value: f64::NAN };
        assert!(stand_in.between("`d`", 0.0..=5.0, "mm", &problems).is_nan());
        assert_eq!(problems.len(), 1);
    }
}
