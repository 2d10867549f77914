//! Profiles of a laser line sensor, point by point, as the columns `profile1_x_mm` ... of a measurement table: a few points each that say as much as all.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

use crate::board_table::{BoardTableError, NamedText, csv_line};

/// Why a table of points and a table of poses do not make one.
#[derive(Debug, Error)]
pub enum ProfileTableError {
    /// One of the two is no such table.
    #[error(transparent)]
    Table(#[from] BoardTableError),
    /// A profile without joints.
    #[error(
        "{file}: profile `{profile}` has points and no pose: the table of poses has no row with it in its column `profile`"
    )]
    NoPose {
        /// The file of the points.
        file: String,
        /// Which profile.
        profile: String,
    },
}

const OF_POINTS: &str =
    "a table of points has the columns profile, x_mm (along the sensor's line), z_mm (away from the sensor)";
const OF_POSES: &str = "it says which profile was taken in each row, by its name in the table of points";

/// Points of a part of a profile from which it is smoothed by a parabola; of fewer the middle one is kept.
const FEWEST_FOR_A_PARABOLA: usize = 5;

/// A point farther from the parabola than this many times the median distance is left out, and the parabola drawn anew: a glint, or the end of the surface.
const OUTLYING: f64 = 6.0;

/// The points of each profile, in the order along its line.
fn profiles(points: &NamedText<'_>) -> Result<BTreeMap<String, Vec<[f64; 2]>>, BoardTableError> {
    let (header, rows) = points.rows()?;
    let index_of = |column| points.column(&header, column, OF_POINTS);
    let (name, x, z) = (index_of("profile")?, index_of("x_mm")?, index_of("z_mm")?);
    let mut found: BTreeMap<String, Vec<[f64; 2]>> = BTreeMap::new();
    for row in &rows {
        let cell = |index: usize| row.get(index).unwrap_or("");
        // Sensors leave what they did not see empty, or call it not a number.
        let unseen = |text: &str| text.is_empty() || text.eq_ignore_ascii_case("nan");
        let number = |column: &'static str, index: usize| {
            let value = cell(index).parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| BoardTableError::Cell {
                file: points.name.to_owned(),
                line: row.position().map_or(0, csv::Position::line),
                column,
                cell: cell(index).to_owned(),
                what: "a length in mm",
            })
        };
        let own = found.entry(cell(name).to_owned()).or_default();
        if !unseen(cell(x)) && !unseen(cell(z)) {
            own.push([number("x_mm", x)?, number("z_mm", z)?]);
        }
    }
    for points in found.values_mut() {
        points.sort_by(|one, other| one[0].total_cmp(&other[0]));
    }
    Ok(found)
}

/// The parabola through some points about their middle: its height there; nothing of points that are all one above the other.
fn height(points: &[[f64; 2]], middle: f64) -> Option<Vector3<f64>> {
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for [x, z] in points {
        let along = x - middle;
        let row = Vector3::new(1.0, along, along * along);
        matrix += row * row.transpose();
        right += row * *z;
    }
    matrix.try_inverse().map(|inverse| inverse * right)
}

/// Where the middle of some points is along the profile, mm.
fn mean_x(points: &[[f64; 2]]) -> f64 {
    points.iter().map(|point| point[0]).sum::<f64>() / points.len() as f64
}

/// One point for a part of a profile: on the parabola through its points, where their middle is. What a plane, a ball or a cylinder is within so small a part a
/// parabola follows to far less than the noise; a mean would cut the corner of what bends.
fn one_point(part: &[[f64; 2]]) -> Option<[f64; 2]> {
    let median = *part.get(part.len() / 2)?;
    if part.len() < FEWEST_FOR_A_PARABOLA {
        return Some(median);
    }
    let middle = mean_x(part);
    let Some(parabola) = height(part, middle) else { return Some(median) };
    let off = |[x, z]: &[f64; 2]| {
        let along = x - middle;
        (z - parabola.dot(&Vector3::new(1.0, along, along * along))).abs()
    };
    // What belongs to something else, a burr or a stray reflection, lies far from the parabola of the rest.
    let mut sizes: Vec<f64> = part.iter().map(off).collect();
    sizes.sort_by(f64::total_cmp);
    let limit = OUTLYING * sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    let kept: Vec<[f64; 2]> = part.iter().copied().filter(|point| off(point) <= limit).collect();
    let middle = mean_x(&kept);
    let found = (kept.len() >= FEWEST_FOR_A_PARABOLA).then(|| height(&kept, middle)).flatten();
    Some(found.map_or(median, |parabola| [middle, parabola.x]))
}

/// At most `keep` points of a profile, spread evenly over its points.
fn thinned(points: &[[f64; 2]], keep: usize) -> Vec<[f64; 2]> {
    if points.len() <= keep {
        return points.to_vec();
    }
    let end = |part: usize| part * points.len() / keep;
    (0..keep).filter_map(|part| one_point(points.get(end(part)..end(part + 1))?)).collect()
}

/// The table of poses with at most `keep` points of the profile of each row. Rows whose profile has no point are left empty there.
///
/// # Errors
/// [`ProfileTableError`]
pub fn with_profiles(
    poses: NamedText<'_>,
    points: NamedText<'_>,
    keep: usize,
) -> Result<String, ProfileTableError> {
    let profiles = profiles(&points)?;
    let (header, rows) = poses.rows()?;
    let index = poses.column(&header, "profile", OF_POSES)?;
    if let Some(lost) =
        profiles.keys().find(|name| !rows.iter().any(|row| row.get(index) == Some(name.as_str())))
    {
        return Err(ProfileTableError::NoPose { file: points.name.to_owned(), profile: lost.clone() });
    }
    let headers: Vec<String> = (1..=keep).map(|n| format!("profile{n}_x_mm,profile{n}_z_mm")).collect();
    let mut text = format!("{},{}\n", csv_line(&header), headers.join(","));
    for row in &rows {
        let seen = row.get(index).and_then(|name| profiles.get(name)).map_or(&[][..], Vec::as_slice);
        let mut kept: Vec<String> =
            thinned(seen, keep).iter().map(|[x, z]| format!("{x:.5},{z:.5}")).collect();
        kept.resize(keep, ",".to_owned());
        text.push_str(&format!("{},{}\n", csv_line(row), kept.join(",")));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Table;

    fn made(poses: &str, points: &str, keep: usize) -> Result<String, ProfileTableError> {
        let [poses, points] =
            [("poses.csv", poses), ("points.csv", points)].map(|(name, text)| NamedText { name, text });
        with_profiles(poses, points, keep)
    }

    #[test]
    fn a_thousand_points_of_a_ball_become_five_that_lie_on_it_and_a_glint_is_left_out() {
        let mut text = "profile,x_mm,z_mm\n".to_owned();
        for step in -500..=500 {
            let x = f64::from(step) * 0.02;
            let z = if step == 100 { 120.0 } else { 150.0 - (400.0 - x * x).sqrt() };
            text.push_str(&format!("a,{x},{z}\n"));
        }
        text.push_str("a,3.3,nan\nb,1,2\n");
        let made = made("q1_deg,profile,on\n10,a,ball\n20,b,ball\n30,c,ball\n", &text, 5).unwrap();
        let table = Table::parse("made.csv", &made).unwrap();
        assert_eq!(table.profiles.len(), 5);
        for columns in &table.profiles {
            let [x, z] = columns.xz[0];
            assert!((x.hypot(z - 150.0) - 20.0).abs() < 1e-4, "{x} {z}");
        }
        // Each is in the middle of its fifth.
        for (columns, middle) in table.profiles.iter().zip([-8.0, -4.0, 0.0, 4.0, 8.0]) {
            assert!((columns.xz[0][0] - middle).abs() < 0.1, "{:?}", columns.xz[0]);
        }
        assert!(table.has_profile(1) && !table.has_profile(2) && table.profiles[1].xz[1][0].is_nan());
    }

    #[test]
    fn what_does_not_go_together_is_reported_with_file_line_and_profile() {
        for (poses, points, part) in [
            ("q1_deg\n1\n", "profile,x_mm,z_mm\na,1,2\n", "poses.csv: there is no column `profile`"),
            ("q1_deg,profile\n1,a\n", "profile,x_mm\na,1\n", "there is no column `z_mm`"),
            (
                "q1_deg,profile\n1,a\n",
                "profile,x_mm,z_mm\na,1,far\n",
                "line 2, column `z_mm`: `far` is not a length",
            ),
            ("q1_deg,profile\n1,a\n", "profile,x_mm,z_mm\nb,1,2\n", "profile `b` has points and no pose"),
        ] {
            let message = made(poses, points, 5).unwrap_err().to_string();
            assert!(message.contains(part), "{part}: {message}");
        }
    }
}
