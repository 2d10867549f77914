//! Curves over an axis, as an SVG picture and as a table.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use plotters::prelude::*;

/// One line of a figure: its name and its points (x, y) in the units of the axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// As the legend names it.
    pub name: String,
    /// Its points; those without a value are left out.
    pub points: Vec<(f64, f64)>,
}

/// One figure: what it shows, its axes with units, its curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// The name of its files, without the ending.
    pub file_name: String,
    /// Over the picture.
    pub title: String,
    /// What the horizontal axis shows, with the unit.
    pub across: String,
    /// What the vertical axis shows, with the unit.
    pub up: String,
    /// The curves.
    pub curves: Vec<Curve>,
    /// Drawn as points, not as lines.
    pub scattered: bool,
}

/// Why there is no figure.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// A file could not be written.
    #[error("cannot write {}: {cause}; name a folder you may write to with --output", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        cause: io::Error,
    },
    /// A figure could not be drawn.
    #[error("cannot draw {figure}: {cause}")]
    Draw {
        /// The figure.
        figure: String,
        /// The error of the drawing library.
        cause: String,
    },
}

const SIZE: (u32, u32) = (800, 480);
const INK: [RGBColor; 4] =
    [RGBColor(0, 90, 160), RGBColor(190, 80, 0), RGBColor(60, 130, 60), RGBColor(120, 60, 140)];

/// The smallest and largest of `values` with a margin of a twentieth on both sides; something to draw on where there are none, or all are alike:
/// ticks between ends that are one number, or none, would be looked for without end.
fn range(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if !low.is_finite() || !high.is_finite() {
        return -1.0..1.0;
    }
    if high - low <= 1e-9 * low.abs().max(high.abs()) {
        return low - 1.0..high + 1.0;
    }
    let margin = (high - low) / 20.0;
    low - margin..high + margin
}

/// The figure as one SVG document.
///
/// # Errors
/// What the drawing library reports, in its words.
pub fn svg(figure: &Figure) -> Result<String, String> {
    let mut document = String::new();
    draw(figure, &mut document).map_err(|error| error.to_string())?;
    Ok(document)
}

fn draw(figure: &Figure, document: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::with_string(document, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let points = || figure.curves.iter().flat_map(|curve| &curve.points);
    let mut chart = ChartBuilder::on(&area)
        .caption(&figure.title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(72)
        .build_cartesian_2d(range(points().map(|point| point.0)), range(points().map(|point| point.1)))?;
    chart.configure_mesh().light_line_style(WHITE).x_desc(&figure.across).y_desc(&figure.up).draw()?;
    for (curve, colour) in figure.curves.iter().zip(INK.into_iter().cycle()) {
        let drawn = if figure.scattered {
            let points = curve.points.iter().map(|point| Circle::new(*point, 3, colour.filled()));
            chart.draw_series(points)?
        } else {
            chart.draw_series(LineSeries::new(curve.points.iter().copied(), colour.stroke_width(2)))?
        };
        drawn
            .label(&curve.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    if figure.curves.len() > 1 {
        chart.configure_series_labels().background_style(WHITE).border_style(BLACK).draw()?;
    }
    area.present()?;
    Ok(())
}

/// The figure as CSV: a row a point, with the curve it belongs to.
pub fn csv(figure: &Figure) -> String {
    let mut text = format!("curve,\"{}\",\"{}\"\n", figure.across, figure.up);
    for curve in &figure.curves {
        for (x, y) in &curve.points {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{},{x},{y}", curve.name);
        }
    }
    text
}

/// Writes a figure as SVG and as CSV.
///
/// # Errors
/// It cannot be drawn, or the folder cannot be written.
pub fn write(folder: &Path, figure: &Figure) -> Result<(), FigureError> {
    let drawing =
        svg(figure).map_err(|cause| FigureError::Draw { figure: figure.file_name.clone(), cause })?;
    for (ending, content) in [("svg", drawing), ("csv", csv(figure))] {
        write_file(folder, &format!("{}.{ending}", figure.file_name), &content)?;
    }
    Ok(())
}

/// Writes a file into a folder, which is made where there is none.
///
/// # Errors
/// The folder cannot be written.
pub fn write_file(folder: &Path, name: &str, content: &str) -> Result<(), FigureError> {
    let path = folder.join(name);
    fs::create_dir_all(folder)
        .and_then(|()| fs::write(&path, content))
        .map_err(|cause| FigureError::Write { path, cause })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_something_to_draw_on_whatever_the_values() {
        assert_eq!(range([].into_iter()), -1.0..1.0);
        assert_eq!(range([5.0, 5.0].into_iter()), 4.0..6.0);
        let alike = range([5.0, 5.0 + 1e-14].into_iter());
        assert!(alike.start < 4.5 && alike.end > 5.5, "{alike:?}");
        assert_eq!(range([0.0, 20.0].into_iter()), -1.0..21.0);
        assert_eq!(range([1.0, f64::INFINITY].into_iter()), -1.0..1.0);
    }
}
