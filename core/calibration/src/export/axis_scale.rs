//! What a controller can hold of a joint's errors that knows a scale for each axis and no table: FluidNC has `steps_per_mm`, and neither a table nor a
//! compensation of play or skew (bdring/FluidNC, FluidNC/docs/config_items.yaml; issues 405 and 1153).

use super::Compensation;

/// The straight line nearest to a joint's errors, by least squares over its travel and both directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisScale {
    /// How far the joint really goes for one mm, or one degree, that is commanded.
    pub slope: f64,
    /// Where it really is when 0 is commanded; mm or degrees.
    pub zero: f64,
    /// By how much the line misses the joint at most, mm or degrees: play, waves, maps.
    pub off: f64,
}

/// The line through a table's means of both directions (least squares in one variable; Draper & Smith 1998, 1.2).
pub fn axis_scale(table: &Compensation) -> AxisScale {
    let count = table.lines.len() as f64;
    let commanded = table.lines.iter().map(|line| line[0]).sum::<f64>() / count;
    let reached = table.lines.iter().map(mean_reached).sum::<f64>() / count;
    let square: f64 = table.lines.iter().map(|line| (line[0] - commanded).powi(2)).sum();
    let products = table.lines.iter().map(|line| (line[0] - commanded) * (mean_reached(line) - reached));
    let slope = products.sum::<f64>() / square;
    let zero = reached - slope * commanded;
    let off = table.lines.iter().map(|line| greatest_miss(line, zero + slope * line[0])).fold(0.0, f64::max);
    AxisScale { slope, zero, off }
}

/// The mean of where a joint arrives from below and from above.
fn mean_reached([_, forward, reverse]: &[f64; 3]) -> f64 {
    f64::midpoint(*forward, *reverse)
}

/// By how much either way of arrival misses a place.
fn greatest_miss([_, forward, reverse]: &[f64; 3], coordinate: f64) -> f64 {
    (forward - coordinate).abs().max((reverse - coordinate).abs())
}

/// The part of FluidNC's configuration that holds it: fewer steps by the factor by which the joint goes further than commanded.
pub fn fluidnc(axis: &str, scale: &AxisScale, steps_per_mm: f64) -> String {
    format!("axes:\n  {axis}:\n    steps_per_mm: {:.6}\n", steps_per_mm / scale.slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(lines: Vec<[f64; 3]>) -> Compensation {
        Compensation { lines, unit: "mm", left_out: Vec::new(), between: 0.0 }
    }

    #[test]
    fn a_scale_and_a_zero_are_found_and_play_is_what_a_line_misses() {
        // Reached: 0.5 + 1.002 q, 0.03 mm less or more by the way of arrival.
        let line = |q: f64| [q, 0.5 + 1.002 * q - 0.03, 0.5 + 1.002 * q + 0.03];
        let scale = axis_scale(&table([0.0, 100.0, 400.0].map(line).to_vec()));
        assert!((scale.slope - 1.002).abs() < 1e-12 && (scale.zero - 0.5).abs() < 1e-10, "{scale:?}");
        assert!((scale.off - 0.03).abs() < 1e-10, "{scale:?}");
        // 80 steps moved it 1.002 mm.
        assert_eq!(fluidnc("x", &scale, 80.0), "axes:\n  x:\n    steps_per_mm: 79.840319\n");
    }
}
