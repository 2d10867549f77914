//! A sheet as SVG, a unit a millimetre.

use std::fmt::Write as _;

use super::page::{Mark, Page};

/// The drawing.
pub(super) fn document(page: &Page) -> Vec<u8> {
    let [width, height] = page.size;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\">\n\
         <title>{}</title>\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n",
        escaped(&page.title)
    );
    for mark in &page.marks {
        text.push_str(&element(mark, height));
    }
    text.push_str("</svg>\n");
    text.into_bytes()
}

fn element(mark: &Mark, height: f64) -> String {
    match mark {
        Mark::Black(points) => format!("<polygon points=\"{}\" fill=\"black\"/>\n", listed(points, height)),
        Mark::Line { points, width, dashed } => format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"black\" stroke-width=\"{width}\"{}/>\n",
            listed(points, height),
            if *dashed { " stroke-dasharray=\"1.5 1.5\"" } else { "" }
        ),
        Mark::Text { at: [x, y], height: size, text } => format!(
            "<text x=\"{x:.3}\" y=\"{:.3}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"{size}\">{}</text>\n",
            height - y,
            escaped(text)
        ),
    }
}

/// The points, with y downwards as SVG has it.
fn listed(points: &[[f64; 2]], height: f64) -> String {
    let mut text = String::new();
    for [x, y] in points {
        // Writing into a text does not fail.
        let _ = write!(text, "{x:.4},{:.4} ", height - y);
    }
    text.trim_end().to_owned()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
