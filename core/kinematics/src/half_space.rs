//! Half-spaces nothing of an arm may enter.

/// A half-space nothing of the arm may enter: points with `normal . x < offset` are forbidden; base frame, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpace {
    /// Unit normal, away from what is forbidden.
    pub normal: [f64; 3],
    /// mm.
    pub offset: f64,
}

impl HalfSpace {
    /// Whether a point (base frame, mm) lies outside the forbidden half.
    pub fn allows(&self, point: [f64; 3]) -> bool {
        self.normal.iter().zip(point).map(|(normal, part)| normal * part).sum::<f64>() >= self.offset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_forbids_what_is_below_it_and_allows_its_surface() {
        let table = HalfSpace { normal: [0.0, 0.0, 1.0], offset: 20.0 };
        assert!(table.allows([500.0, -3.0, 20.0]) && table.allows([0.0, 0.0, 21.0]));
        assert!(!table.allows([0.0, 0.0, 19.9]));
    }
}
