//! Units as people read them.

use plumb_calibration::effect::Unit;

/// A unit as people read it; a plain ratio has none.
pub(crate) fn shown_unit(unit: &str) -> &str {
    if unit == Unit::RATIO.name { "" } else { unit }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_is_shown_without_a_unit() {
        assert_eq!(shown_unit("1"), "");
        assert_eq!(shown_unit("rad/(N m)"), "rad/(N m)");
    }
}
