//! A small drawing of an arm for prompts, in characters: from the side it reaches to, and from above.

/// Columns of one view.
const WIDTH: usize = 30;
/// Rows of one view.
const HEIGHT: usize = 9;
/// How much higher than wide a character is.
const ASPECT: f64 = 2.0;

/// An arm by the points its links run between, from its base to its flange, mm in its base frame: two views beside each other.
pub(crate) fn two_views(points: &[[f64; 3]]) -> String {
    let furthest = points.iter().map(|point| (point[0].hypot(point[1]), point));
    let towards = furthest.max_by(|(one, _), (other, _)| one.total_cmp(other));
    let (x, y) = match towards {
        Some((reach, point)) if reach > 1.0 => (point[0] / reach, point[1] / reach),
        _ => (1.0, 0.0),
    };
    let side: Vec<[f64; 2]> = points.iter().map(|point| [point[0] * x + point[1] * y, point[2]]).collect();
    let above: Vec<[f64; 2]> = points.iter().map(|point| [point[0], point[1]]).collect();
    let mut lines = vec![format!("{:<WIDTH$}   {}", "from the side", "from above")];
    for (left, right) in view(&side).into_iter().zip(view(&above)) {
        lines.push(format!("{left:<WIDTH$}   {right}").trim_end().to_owned());
    }
    lines.push("o joint   @ base   # flange".to_owned());
    lines.join("\n")
}

fn view(points: &[[f64; 2]]) -> Vec<String> {
    let range = |axis: usize| {
        let values = points.iter().filter_map(|point| point.get(axis).copied());
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| {
            (least.min(value), most.max(value))
        })
    };
    let ((left, right), (low, high)) = (range(0), range(1));
    let per_column =
        ((right - left) / (WIDTH - 1) as f64).max((high - low) / ASPECT / (HEIGHT - 1) as f64).max(1.0);
    let (middle, centre) = ((left + right) / 2.0, (low + high) / 2.0);
    let cell = |point: &[f64; 2]| {
        let column = (point[0] - middle) / per_column + (WIDTH - 1) as f64 / 2.0;
        let row = (centre - point[1]) / per_column / ASPECT + (HEIGHT - 1) as f64 / 2.0;
        (
            column.round().clamp(0.0, (WIDTH - 1) as f64) as usize,
            row.round().clamp(0.0, (HEIGHT - 1) as f64) as usize,
        )
    };
    let mut grid = vec![vec![' '; WIDTH]; HEIGHT];
    let mut mark = |(column, row): (usize, usize), sign: char| {
        if let Some(character) = grid.get_mut(row).and_then(|line| line.get_mut(column)) {
            *character = sign;
        }
    };
    for pair in points.windows(2) {
        let [from, to] = pair else { continue };
        for step in 0..=2 * WIDTH {
            let fraction = step as f64 / (2 * WIDTH) as f64;
            mark(
                cell(&[from[0] + (to[0] - from[0]) * fraction, from[1] + (to[1] - from[1]) * fraction]),
                '.',
            );
        }
    }
    points.iter().for_each(|point| mark(cell(point), 'o'));
    points.last().into_iter().for_each(|point| mark(cell(point), '#'));
    points.first().into_iter().for_each(|point| mark(cell(point), '@'));
    grid.into_iter().map(|line| line.into_iter().collect::<String>().trim_end().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arm_stretched_sideways_lies_flat_from_the_side_and_goes_up_from_above() {
        let drawn = two_views(&[[0.0, 0.0, 0.0], [0.0, 430.0, 0.0], [0.0, 900.0, 0.0]]);
        let lines: Vec<&str> = drawn.lines().collect();
        assert_eq!(lines.len(), 2 + HEIGHT);
        let flat = lines.iter().find(|line| line.starts_with('@')).copied().unwrap_or_default();
        let side: String = flat.chars().take(WIDTH).collect();
        assert!(side.starts_with("@....") && side.ends_with('#') && side.contains('o'), "{drawn}");
        let above = |line: usize| lines[line].chars().skip(WIDTH + 3).collect::<String>();
        assert_eq!((above(1).trim(), above(HEIGHT).trim()), ("#", "@"), "{drawn}");
    }

    #[test]
    fn an_arm_that_is_in_one_point_is_drawn_without_harm() {
        assert!(two_views(&[[0.0; 3]; 4]).contains('@'));
        assert!(two_views(&[]).contains("from the side"));
    }
}
