//! A sheet as PDF 1.4 (ISO 32000-1): one page, one font of those that every reader has, and the wish that it be printed at its own size.

use std::fmt::Write as _;

use super::page::{Mark, Page};

/// Points of PDF in a millimetre.
const POINTS: f64 = 72.0 / 25.4;

/// The drawing.
pub(super) fn document(page: &Page) -> Vec<u8> {
    let content = content(page);
    let [width, height] = page.size.map(|side| side * POINTS);
    let objects = [
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>".to_owned(),
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".to_owned(),
        format!(
            "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width:.3} {height:.3}] /Contents 4 0 R /Resources << /Font << /F1 5 0 R >> >> >>"
        ),
        format!("<< /Length {} >>\nstream\n{content}endstream", content.len()),
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>".to_owned(),
        format!("<< /Title ({}) /Producer (plumb) >>", escaped(&page.title)),
    ];
    let mut text = String::from("%PDF-1.4\n");
    let mut offsets = Vec::new();
    for (index, object) in objects.iter().enumerate() {
        offsets.push(text.len());
        // Writing into a text does not fail.
        let _ = write!(text, "{} 0 obj\n{object}\nendobj\n", index + 1);
    }
    let table = text.len();
    let count = objects.len() + 1;
    let _ = write!(text, "xref\n0 {count}\n0000000000 65535 f \n");
    for offset in offsets {
        // Each entry is twenty bytes.
        let _ = writeln!(text, "{offset:010} 00000 n ");
    }
    let _ = write!(text, "trailer\n<< /Size {count} /Root 1 0 R /Info 6 0 R >>\nstartxref\n{table}\n%%EOF\n");
    text.into_bytes()
}

/// What is drawn, in millimetres from the lower left corner.
fn content(page: &Page) -> String {
    let mut text = format!("{POINTS:.8} 0 0 {POINTS:.8} 0 0 cm\n0 g 0 G\n");
    for mark in &page.marks {
        let _ = match mark {
            Mark::Black(points) => writeln!(text, "{}h f", path(points)),
            Mark::Line { points, width, dashed } => {
                let dashes = if *dashed { "[1.5 1.5]" } else { "[]" };
                writeln!(text, "{width} w {dashes} 0 d\n{}S", path(points))
            }
            Mark::Text { at: [x, y], height, text: words } => {
                writeln!(text, "BT /F1 {height} Tf {x:.3} {y:.3} Td ({}) Tj ET", escaped(words))
            }
        };
    }
    text
}

fn path(points: &[[f64; 2]]) -> String {
    let mut text = String::new();
    for (index, [x, y]) in points.iter().enumerate() {
        let _ = write!(text, "{x:.4} {y:.4} {} ", if index == 0 { "m" } else { "l" });
    }
    text
}

/// A text of PDF: brackets and backslashes behind a backslash, and nothing but ASCII.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for letter in text.chars() {
        match letter {
            '(' | ')' | '\\' => escaped.extend(['\\', letter]),
            ' '..='~' => escaped.push(letter),
            _ => escaped.push('?'),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_object_lies_where_the_table_says() {
        let line = Mark::Line { points: vec![[0.0, 0.0], [1.0, 2.0]], width: 0.1, dashed: true };
        let words = Mark::Text { at: [1.0, 1.0], height: 3.0, text: "a (b) \\ \u{e9}".to_owned() };
        let page = Page { size: [210.0, 297.0], title: "T (1)".to_owned(), marks: vec![line, words] };
        let text = String::from_utf8(document(&page)).expect("ASCII");
        assert!(
            text.is_ascii() && text.contains("(a \\(b\\) \\\\ ?) Tj") && text.contains("(T \\(1\\))"),
            "{text}"
        );
        let table = text.find("xref\n").expect("a table");
        let begins: Vec<usize> = text[table..]
            .lines()
            .filter(|line| line.ends_with(" n "))
            .map(|line| line[..10].parse().expect("an offset"))
            .collect();
        assert_eq!(begins.len(), 6);
        for (index, begin) in begins.iter().enumerate() {
            assert!(text[*begin..].starts_with(&format!("{} 0 obj\n", index + 1)));
        }
        assert!(text.contains(&format!("startxref\n{table}\n%%EOF")));
        assert!(text.contains("/MediaBox [0 0 595.276 841.890]"), "A4");
    }
}
