//! What all SVG pictures share.

use std::fmt::{Display, Formatter, Result, Write};

/// Text that cannot break the document.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Where a point leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Links {
    /// To the row of the page's table, `#line-N`.
    Rows,
    /// Nowhere: the picture is alone.
    Nowhere,
}

/// Ink of points and bars, of curves, of what is out of range, of the noise.
pub(crate) const POINT: &str = "#1f5fa0";
pub(crate) const CURVE: &str = "#c05a00";
pub(crate) const OUTSIDE: &str = "#c03030";
pub(crate) const NOISE: &str = "#cfe8cf";

/// A point that says which line of the table it is of, and leads there.
pub(crate) fn point(
    out: &mut String,
    (x, y): (f64, f64),
    radius: f64,
    style: &str,
    line: u32,
    links: Links,
) -> Result {
    let (begin, end) = match links {
        Links::Rows => (format!("<a href=\"#line-{line}\">"), "</a>"),
        Links::Nowhere => (String::new(), ""),
    };
    writeln!(
        out,
        "{begin}<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" stroke-width=\"0.8\" {style}><title>line {line}</title></circle>{end}"
    )
}

/// A number with few figures: the precision asked for counts figures, not decimals.
pub(crate) struct Short(pub(crate) f64);

impl Display for Short {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> Result {
        let figures = formatter.precision().unwrap_or(3) as f64;
        // A negative nothing is nothing.
        let value = if self.0.abs() < 1e-12 { 0.0 } else { self.0 };
        let size = value.abs().max(1e-12).log10().floor();
        let decimals = if value == 0.0 { 0.0 } else { (figures - 1.0 - size).clamp(0.0, 9.0) } as usize;
        write!(formatter, "{value:.decimals$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_numbers_keep_their_figures_and_nothing_is_0() {
        assert_eq!(format!("{:.2}", Short(0.0)), "0");
        assert_eq!(format!("{:.2}", Short(-1e-15)), "0");
        assert_eq!(format!("{:.2}", Short(-0.384)), "-0.38");
        assert_eq!(format!("{:.3}", Short(161.76)), "162");
    }
}
