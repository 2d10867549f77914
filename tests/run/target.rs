//! `plumb target`: the T target of a cell, to be printed at its own size.

use std::fs;

use crate::lab::Lab;

/// The coordinates of every polygon of an SVG drawing.
fn polygons(svg: &str) -> Vec<Vec<[f64; 2]>> {
    let number = |text: &str| text.parse::<f64>().unwrap();
    let points = |list: &str| {
        let pairs = list.split_whitespace().map(|pair| pair.split_once(',').unwrap());
        pairs.map(|(x, y)| [number(x), number(y)]).collect()
    };
    svg.split("<polygon points=\"").skip(1).map(|rest| points(rest.split('"').next().unwrap())).collect()
}

#[test]
fn the_t_is_drawn_at_its_own_size_with_a_ruler_and_nothing_on_the_white() {
    let lab = Lab::new();
    let drawn = lab.plumb(&["target", "cell.yaml", "-o", "t.svg"]);
    assert_eq!(drawn.code(), 0, "{}", drawn.all());
    assert!(drawn.out().contains("print it at 100 %"), "{}", drawn.out());
    let svg = fs::read_to_string(lab.path("t.svg")).unwrap();
    assert!(
        svg.contains("width=\"210mm\" height=\"297mm\" viewBox=\"0 0 210 297\""),
        "a unit is a millimetre"
    );
    for words in ["T target of teachmover", "line A", "line B", "white side", "waist's axis"] {
        assert!(svg.contains(words), "{words}");
    }
    let [head, body] = polygons(&svg).try_into().unwrap();
    let extent = |points: &[[f64; 2]], axis: usize| {
        let values = points.iter().map(|point| point[axis]);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    assert!((extent(&head, 0) - 120.0).abs() < 1e-3 && (extent(&head, 1) - 25.0).abs() < 1e-3, "{head:?}");
    // The body begins on line A, on its way from the waist's axis 115 mm to 210 mm out.
    let expected = 210.0 * 8_f64.to_radians().cos() - 115.0 * 20_f64.to_radians().cos();
    assert!((extent(&body, 1) - expected).abs() < 1e-3, "{body:?}");

    assert_eq!(lab.plumb(&["target", "cell.yaml", "-o", "t.pdf", "--paper", "a3"]).code(), 0);
    let pdf = fs::read(lab.path("t.pdf")).unwrap();
    assert!(pdf.starts_with(b"%PDF-1.4") && pdf.ends_with(b"%%EOF\n"));
    assert!(String::from_utf8(pdf).unwrap().contains("/MediaBox [0 0 841.890 1190.551]"), "A3");
}

#[test]
fn a_target_that_cannot_be_drawn_is_refused_with_what_would_be_right() {
    let lab = Lab::new();
    let refused = lab.plumb(&["target", "cell.yaml", "-o", "t.png"]);
    assert_eq!(refused.code(), 2);
    assert!(refused.err().contains("ends in `.pdf` or `.svg`"), "{}", refused.err());

    let line_b = "line_b: {distance_mm: 140, offset_deg: 8}";
    lab.edit(
        "cell.yaml",
        line_b,
        "line_b: {distance_mm: 140, offset_deg: 8}\n    head: {depth_mm: 25, width_mm: 300}",
    );
    let refused = lab.plumb(&["target", "cell.yaml", "-o", "t.svg"]);
    assert_eq!(refused.code(), 2);
    assert!(refused.err().contains("choose another --paper"), "{}", refused.err());

    lab.edit("cell.yaml", line_b, "line_b: {distance_mm: 140, offset_deg: 0}");
    let refused = lab.plumb(&["check", "cell.yaml"]);
    assert_eq!(refused.code(), 2);
    assert!(
        refused.all().contains("`offset_deg` is 0") && refused.all().contains("which side of line A"),
        "{}",
        refused.all()
    );

    let other = Lab::of("puma");
    let refused = other.plumb(&["target", "cell.yaml", "-o", "t.svg"]);
    assert_eq!(refused.code(), 2);
    assert!(refused.err().contains("cell.yaml describes no target"), "{}", refused.err());
    assert!(!other.path("t.svg").exists() && !lab.path("t.svg").exists());
}
