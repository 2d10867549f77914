//! Where points, noise and axes are drawn, held against the places that follow from the ranges.

use std::collections::HashSet;

use super::*;
use crate::testing::two_links;
use plumb_diagnosis::laboratory::Comparison;
use plumb_estimation::Progress;

/// A panel from 10 to 30 across and from -2 to 2 up, with its middle and its corners; and one point beyond.
fn panel() -> Panel {
    let coordinates = [(20.0, 0.0), (10.0, 2.0), (30.0, -2.0), (30.0, 5.0)];
    let points =
        (1..).zip(coordinates).map(|(line, (across, up))| Dot { across, up, held_out: line == 2, line });
    Panel {
        title: "elbow".to_owned(),
        across_title: "elbow, deg".to_owned(),
        up_title: "residual, mm".to_owned(),
        across: (10.0, 30.0),
        up: (-2.0, 2.0),
        one_scale: false,
        floor: Some(0.5),
        points: points.collect(),
        curve: vec![(10.0, -2.0), (30.0, 2.0)],
    }
}

/// The number behind a key of an element, such as `cx`.
fn number(element: &str, key: &str) -> f64 {
    let (_, rest) = element.split_once(&format!(" {key}=\"")).unwrap_or_else(|| panic!("{key} in {element}"));
    rest.split_once('"').unwrap().0.parse().unwrap()
}

fn elements<'s>(svg: &'s str, of: &str) -> Vec<&'s str> {
    svg.match_indices(&format!("<{of} ")).map(|(at, _)| svg[at..].split_once('>').unwrap().0).collect()
}

#[test]
fn the_corners_of_the_ranges_are_the_corners_of_the_frame() {
    let drawn = grid(&[panel()], &[], Links::Nowhere);
    let frame = elements(&drawn, "rect")[1];
    let [left, top, width, height] = ["x", "y", "width", "height"].map(|key| number(frame, key));
    let circles = elements(&drawn, "circle");
    let centres: Vec<(f64, f64)> = circles.iter().map(|one| (number(one, "cx"), number(one, "cy"))).collect();
    let (right, bottom) = (left + width, top + height);
    let expected = [(0.5 * (left + right), 0.5 * (top + bottom)), (left, top), (right, bottom), (right, top)];
    for (centre, expected) in centres.iter().zip(expected) {
        assert!(
            (centre.0 - expected.0).abs() < 0.11 && (centre.1 - expected.1).abs() < 0.11,
            "{centre:?} {expected:?}"
        );
    }
    assert!(
        circles[0].contains("fill=\"#1f5fa0\"") && circles[1].contains("fill=\"white\""),
        "held out: hollow"
    );
    assert!(
        circles[3].contains("fill=\"none\" stroke=\"#c03030\""),
        "beyond the range: on the rim, in another colour"
    );
    // The noise of 0.5 about zero takes a quarter of the range of 4.
    let band = elements(&drawn, "rect")[2];
    assert!(
        (number(band, "height") - 0.25 * height).abs() < 0.11 && number(band, "width") == width,
        "{band}"
    );
    assert!((number(band, "y") - (top + 0.375 * height)).abs() < 0.11, "{band}");
    let curve = drawn.split("class=\"curve\" points=\"").nth(1).unwrap().split('"').next().unwrap();
    assert_eq!(curve, format!("{left:.1},{bottom:.1} {right:.1},{top:.1}"));
    let middle = format!("{:.1})", top + 0.5 * height);
    let title = drawn.split("rotate(-90 ").nth(1).unwrap().split('"').next().unwrap();
    assert!(title.ends_with(&middle), "the vertical axis's title is at its middle: {title}");
    let sides: Vec<f64> =
        drawn.split('"').nth(3).unwrap().split(' ').map(|side| side.parse().unwrap()).collect();
    assert!(sides[3] > bottom + 26.0, "the horizontal axis's title is within the picture: {sides:?}");
    for axis in
        [">10.0</text>", ">30.0</text>", ">2.0</text>", ">-2.0</text>", ">0</text>", ">elbow, deg</text>"]
    {
        assert!(drawn.contains(axis), "{axis} in {drawn}");
    }
    assert!(!drawn.contains("href") && grid(&[panel()], &[], Links::Rows).contains("<a href=\"#line-3\">"));
}

#[test]
fn panels_are_side_by_side_under_their_heading() {
    let drawn = grid(&[panel(), panel(), panel(), panel()], &["arm & table".to_owned()], Links::Nowhere);
    let frames: Vec<(f64, f64)> = elements(&drawn, "rect")
        .into_iter()
        .filter(|one| one.contains("#fafafa"))
        .map(|one| (number(one, "x"), number(one, "y")))
        .collect();
    assert_eq!(frames.len(), 4);
    assert!(frames[0].1 == frames[1].1 && frames[0].0 < frames[1].0, "{frames:?}");
    assert!(frames[3].1 > frames[0].1 && frames[3].0 == frames[0].0, "{frames:?}");
    assert!(drawn.contains(">arm &amp; table</text>"));
}

#[test]
fn where_both_axes_are_errors_they_have_one_scale_and_the_noise_is_a_ring() {
    let target = Panel { across: (-2.0, 2.0), one_scale: true, curve: Vec::new(), ..panel() };
    let drawn = grid(&[target], &[], Links::Nowhere);
    let frame = elements(&drawn, "rect")[1];
    let circles = elements(&drawn, "circle");
    let ring = circles[0];
    // A quarter of half the height, for the noise is a quarter of the range from zero up.
    assert!((number(ring, "r") - 0.125 * number(frame, "height")).abs() < 0.11, "{ring}");
    assert!((number(ring, "cx") - number(frame, "x") - 0.5 * number(frame, "width")).abs() < 0.11, "{ring}");
}

fn compared() -> Comparison {
    two_links(14, "free: []", 0.05, 5, |_| [0.002, 0.0]).compare(&Progress::unwatched()).unwrap()
}

#[test]
fn in_space_a_whisker_is_the_error_many_times_as_large_and_both_views_agree() {
    let comparison = compared();
    let shown: HashSet<u32> = comparison.rows.iter().map(|row| row.line).collect();
    let drawn = space(&comparison, &shown, Links::Nowhere).unwrap();
    let whiskers: Vec<[f64; 4]> = drawn
        .match_indices("<path d=\"M")
        .filter_map(|(at, _)| {
            let (path, _) = drawn[at + 10..].split_once('"')?;
            let (from, by) = path.split_once('l')?;
            let numbers: Vec<f64> =
                from.split(' ').chain(by.split(' ')).filter_map(|one| one.parse().ok()).collect();
            numbers.try_into().ok()
        })
        .collect();
    assert_eq!(whiskers.len(), 28, "a whisker a row and view");
    let times = whiskers[0][2] / comparison.rows[0].vector_mm[0];
    for (index, [_, _, dx, dy]) in whiskers.iter().enumerate() {
        let up = if index < 14 { 1 } else { 2 };
        let error = comparison.rows[index % 14].vector_mm;
        assert!((dx - times * error[0]).abs() < 0.11 && (dy + times * error[up]).abs() < 0.11, "{index}");
    }
    // Seen from above and from the side a point has the same x, a view apart.
    for (above, aside) in whiskers.iter().zip(&whiskers[14..]) {
        assert!((aside[0] - above[0] - 440.0).abs() < 0.11, "{above:?} {aside:?}");
    }
    // Higher up in the measurements is higher up in the picture, by the same scale as across.
    let apart = |axis: usize| comparison.rows[1].point_mm[axis] - comparison.rows[0].point_mm[axis];
    let px = (whiskers[1][0] - whiskers[0][0]) / apart(0);
    assert!(px > 0.0 && (whiskers[1][1] - whiskers[0][1] + px * apart(1)).abs() < 0.3, "{px}");
    assert!(space(&comparison, &HashSet::new(), Links::Nowhere).is_none(), "nothing is to be shown");
}

#[test]
fn all_points_of_a_view_are_within_it() {
    let comparison = compared();
    let shown: HashSet<u32> = comparison.rows.iter().map(|row| row.line).collect();
    let drawn = space(&comparison, &shown, Links::Nowhere).unwrap();
    for (index, circle) in elements(&drawn, "circle").into_iter().enumerate() {
        let left = if index < 14 { 0.0 } else { 440.0 };
        let (x, y) = (number(circle, "cx") - left, number(circle, "cy"));
        assert!((44.0..=396.0).contains(&x) && (44.0..=396.0).contains(&y), "{circle}");
    }
}

/// The dots (columns from the left, rows from the top) of one panel drawn as text.
fn dots(text: &str) -> Vec<(usize, usize)> {
    const BITS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
    let mut found = Vec::new();
    for (line, cells) in text.lines().filter(|line| line.contains(['\u{253c}', '\u{2502}'])).enumerate() {
        for (cell, letter) in cells.chars().skip(8).enumerate() {
            let set = (letter as u32).wrapping_sub(0x2800);
            for (row, bits) in BITS.iter().enumerate() {
                let own = bits.iter().enumerate().filter(|(_, bit)| set < 0x100 && set & **bit != 0);
                found.extend(own.map(|(column, _)| (2 * cell + column, 4 * line + row)));
            }
        }
    }
    found
}

#[test]
fn on_a_terminal_a_rising_row_of_errors_rises_from_left_to_right() {
    let mut comparison = compared();
    comparison.rows.iter_mut().for_each(|row| row.vector_mm = [0.0; 3]);
    comparison.series.truncate(1);
    comparison.floor.sigma_mm = None;
    comparison.series[0].of_size = false;
    comparison.series[0].points = (0..=8).map(|step| (f64::from(step), f64::from(step) - 4.0, 0)).collect();
    let drawn = terminal(&comparison, 59);
    let mut dots = dots(&drawn);
    dots.sort_unstable();
    assert_eq!(dots.len(), 9, "{drawn}");
    assert!(dots.windows(2).all(|pair| pair[1].0 > pair[0].0 && pair[1].1 < pair[0].1), "{drawn}");
    assert_eq!(dots[0].0, 0, "the least at the left edge");
    let steps: Vec<usize> = dots.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    assert!(steps.iter().max().unwrap() - steps.iter().min().unwrap() <= 1, "evenly: {steps:?}");
    assert!(drawn.lines().all(|line| line.chars().count() <= 59), "{drawn}");
    // The greatest error is written at the top, nought in the middle, the least at the bottom.
    let label = |line: usize| drawn.lines().nth(line).unwrap().chars().take(7).collect::<String>();
    let [top, zero, bottom] = [1, 5, 8].map(|line| label(line).trim().parse::<f64>().unwrap());
    assert!(top > 0.0 && zero == 0.0 && bottom == -top, "{drawn}");
    assert!([2, 3, 4, 6, 7].iter().all(|line| label(*line).trim().is_empty()), "{drawn}");
    let two = Comparison { series: vec![comparison.series[0].clone(); 2], ..comparison };
    // A panel has a title, eight lines of dots and an axis. Below 60 columns panels are one under the other.
    let height = |width: usize| terminal(&two, width).lines().count();
    assert_eq!((height(59), height(60), height(120)), (20, 10, 10));
    assert!(terminal(&two, 120).lines().any(|line| line.chars().count() > 60), "two panels side by side");
}

#[test]
fn a_long_title_beside_a_panel_takes_two_lines_and_one_over_it_is_cut() {
    let titled = |beside: &str, over: &str| {
        let panel = Panel { up_title: beside.to_owned(), title: over.to_owned(), ..panel() };
        grid(&[panel], &[], Links::Nowhere)
    };
    let (short, long) = ("residual along its way, of it a", "a");
    let thirty: String = short.chars().take(30).collect();
    assert!(titled(&thirty, long).contains(&format!(">{thirty}</text>")), "thirty letters fit");
    let two = titled(short, long);
    assert!(
        two.contains(">residual along</tspan>") && two.contains(" dy=\"10\">its way, of it a</tspan>"),
        "{two}"
    );
    let word = "x".repeat(31);
    assert!(titled(&word, long).contains(&format!(">{word}</text>")), "one word is not broken");
    let over = |count: usize| titled("mm", &"y".repeat(count));
    assert!(over(48).contains(&format!(">{}</text>", "y".repeat(48))));
    assert!(over(49).contains(&format!(">{}\u{2026}</text>", "y".repeat(47))));
}

#[test]
fn each_line_of_a_heading_pushes_the_panels_down_by_its_height() {
    let top = |heading: &[String]| {
        let drawn = grid(&[panel()], heading, Links::Nowhere);
        let lines = elements(&drawn, "text").into_iter().take(heading.len()).map(|one| number(one, "y"));
        (
            lines.collect::<Vec<_>>(),
            number(elements(&drawn, "rect")[1], "y"),
            number(elements(&drawn, "rect")[0], "height"),
        )
    };
    let (_, bare, low) = top(&[]);
    let (lines, two, high) = top(&["one".to_owned(), "two".to_owned()]);
    assert_eq!(lines, [22.0, 40.0]);
    // A heading has room for three panels, one panel alone for itself; ten to spare.
    let width =
        |heading: &[String]| number(elements(&grid(&[panel()], heading, Links::Nowhere), "rect")[0], "width");
    assert_eq!((width(&["one".to_owned()]), width(&[])), (970.0, 330.0));
    assert!(
        (two - bare - 36.0).abs() < 1e-9 && (high - low - 36.0).abs() < 1e-9,
        "{bare} {two} {low} {high}"
    );
}
