//! Before anything is fitted: can the points of profiles be in the unit their headers say?

use nalgebra::{Matrix3, Vector3};
use plumb_calibration::arm_model::{Model, SurfaceShape};
use plumb_calibration::table::Table;

use super::plausible::ImplausibleError;

/// No laser line sensor has a line shorter than this, mm: the smallest sold have 5 to 10 mm. Points that all lie nearer to each other are metres under a header of mm.
const SHORTEST_LINE: f64 = 1.0;

/// None sees further than this, mm.
const FARTHEST: f64 = 5000.0;

/// How many times larger than the ball the circles in the profiles may seem, in the middle of the rows: a short arc with noise shows a radius badly.
const LARGER_THAN_THE_BALL: f64 = 1.2;

/// Fewest points that show a circle, and fewest rows whose middle counts.
const POINTS_OF_A_CIRCLE: usize = 5;
const ROWS_WITH_CIRCLES: usize = 3;

/// The points of one row.
fn points(table: &Table, row: usize) -> Vec<[f64; 2]> {
    let all = table.profiles.iter().filter_map(|columns| columns.xz.get(row)).copied();
    all.filter(|[x, z]| x.is_finite() && z.is_finite()).collect()
}

/// The radius of the circle through some points, mm (least squares, linear: Kasa, IEEE Transactions on Instrumentation and Measurement 25, 1976).
fn radius(points: &[[f64; 2]]) -> Option<f64> {
    let count = points.len() as f64;
    // About their mean, or the far centre of a short arc would be lost in rounding.
    let [mx, mz] = [0, 1].map(|part| points.iter().map(|point| point[part]).sum::<f64>() / count);
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for [x, z] in points {
        let row = Vector3::new(x - mx, z - mz, 1.0);
        matrix += row * row.transpose();
        right += row * (row.x * row.x + row.y * row.y);
    }
    let found = matrix.try_inverse()? * right;
    let square = found.z + (found.x * found.x + found.y * found.y) / 4.0;
    (square > 0.0).then(|| square.sqrt())
}

/// Refuses profiles that no sensor can have seen.
pub(super) fn check(model: &Model, table: &Table) -> Result<(), ImplausibleError> {
    let rows: Vec<Vec<[f64; 2]>> = (0..table.len()).map(|row| points(table, row)).collect();
    let all: Vec<f64> = rows.iter().flatten().flatten().copied().collect();
    if all.is_empty() {
        return Ok(());
    }
    let farthest = all.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let (seen, as_what) = if farthest < SHORTEST_LINE {
        (format!("all of them lie within {farthest:.4} mm of the sensor's origin"), "m")
    } else if farthest > FARTHEST {
        (format!("one lies {farthest:.0} mm from the sensor's origin"), "something smaller than mm")
    } else {
        return balls(model, table, &rows);
    };
    Err(ImplausibleError::ProfileUnit { table: table.source.clone(), seen, as_what })
}

/// A ball shows circles no larger than itself.
fn balls(model: &Model, table: &Table, rows: &[Vec<[f64; 2]>]) -> Result<(), ImplausibleError> {
    for surface in &model.surfaces {
        let SurfaceShape::Sphere { radius: known, .. } = surface.shape else { continue };
        let own = (0..table.len()).filter(|row| table.on.name(*row) == Some(surface.name.as_str()));
        let seen = own.filter_map(|row| rows.get(row)).filter(|points| points.len() >= POINTS_OF_A_CIRCLE);
        let mut circles: Vec<f64> = seen.filter_map(|points| radius(points)).collect();
        // The middle one: a profile across the ball's edge, or a few stray points, shows any radius.
        circles.sort_by(f64::total_cmp);
        let Some(middle) =
            circles.get(circles.len() / 2).copied().filter(|_| circles.len() >= ROWS_WITH_CIRCLES)
        else {
            continue;
        };
        if middle > LARGER_THAN_THE_BALL * known {
            return Err(ImplausibleError::ProfileOnBall {
                table: table.source.clone(),
                ball: surface.name.clone(),
                seen: middle,
                radius: known,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_radius_of_an_arc_is_that_of_its_circle_and_a_straight_line_has_none_to_speak_of() {
        let arc: Vec<[f64; 2]> = (-3..=3)
            .map(|step| f64::from(step) * 0.2)
            .map(|rotation| [7.0 + 12.0 * rotation.sin(), 150.0 - 12.0 * rotation.cos()])
            .collect();
        assert!((radius(&arc).unwrap() - 12.0).abs() < 1e-9);
        let line: Vec<[f64; 2]> = (0..6).map(|step| [f64::from(step), 3.0 + 0.5 * f64::from(step)]).collect();
        assert!(radius(&line).is_none_or(|radius| radius > 1e4));
    }

    /// Profiles of circles of these radii on a ball of 10 mm, each of so many points.
    fn on_a_ball(radii: &[f64], points: usize) -> Result<(), ImplausibleError> {
        let model = "arm: one\nconvention: distal\njoints: [{name: turn, a_mm: 100}]\ntargets: {p1: {}}\nprofile: {seen_by: p1}\nsurfaces:\n  ball: {sphere: {centre_mm: [0, 0, 0], radius_mm: 10}}\n  plate: {plane: {normal: [0, 0, 1], offset_mm: 0}}\n";
        let header: String =
            (1..=points).map(|point| format!(",profile{point}_x_mm,profile{point}_z_mm")).collect();
        let row = |(row, radius): (usize, &f64)| {
            let turns = (0..points).map(|point| 0.2 * point as f64 - 0.5);
            let cells: String = turns
                .map(|rotation| format!(",{},{}", radius * rotation.sin(), 90.0 - radius * rotation.cos()))
                .collect();
            format!("{row},ball{cells}\n")
        };
        let rows: String = radii.iter().enumerate().map(row).collect();
        let table = Table::parse("t.csv", &format!("q1_deg,on{header}\n{rows}")).unwrap();
        check(&Model::parse("m.yaml", model).unwrap(), &table)
    }

    #[test]
    fn circles_larger_than_their_ball_are_refused_where_enough_rows_show_them() {
        assert_eq!(on_a_ball(&[9.0, 10.0, 11.0], 6), Ok(()));
        assert_eq!(on_a_ball(&[9.0, 11.9, 30.0], 6), Ok(()), "the middle one counts: 1.19 of the ball");
        let Err(ImplausibleError::ProfileOnBall { ball, seen, radius, .. }) =
            on_a_ball(&[9.0, 12.1, 30.0], 6)
        else {
            panic!("1.21 of the ball");
        };
        assert!(ball == "ball" && (seen - 12.1).abs() < 1e-6 && radius == 10.0, "{ball} {seen} {radius}");
        assert!(on_a_ball(&[9.0, 10.0, 12.1, 30.0, 31.0], 6).is_err(), "of five the third");
        assert_eq!(on_a_ball(&[20.0, 20.0], 6), Ok(()), "two rows are too few");
        assert!(on_a_ball(&[20.0; 3], 5).is_err());
        assert_eq!(on_a_ball(&[20.0; 3], 4), Ok(()), "four points are no circle");
    }

    #[test]
    fn profiles_end_where_no_sensor_sees_and_are_no_shorter_than_the_shortest_line() {
        let model = "arm: one\nconvention: distal\njoints: [{name: turn, a_mm: 100}]\ntargets: {p1: {}}\nprofile: {seen_by: p1}\nsurfaces:\n  plate: {plane: {normal: [0, 0, 1], offset_mm: 0}}\n";
        let reaching = |far: f64| {
            let text =
                format!("q1_deg,on,profile1_x_mm,profile1_z_mm\n0,plate,0,{}\n1,plate,0,{far}\n", 0.5 * far);
            let checked =
                check(&Model::parse("m.yaml", model).unwrap(), &Table::parse("t.csv", &text).unwrap());
            checked.map_err(|error| match error {
                ImplausibleError::ProfileUnit { as_what, .. } => as_what,
                other => panic!("{other:?}"),
            })
        };
        assert_eq!((reaching(FARTHEST), reaching(-FARTHEST)), (Ok(()), Ok(())));
        assert_eq!(reaching(-1.001 * FARTHEST), Err("something smaller than mm"));
        assert_eq!((reaching(SHORTEST_LINE), reaching(-SHORTEST_LINE)), (Ok(()), Ok(())));
        assert_eq!(reaching(0.999 * SHORTEST_LINE), Err("m"));
    }

    #[test]
    fn a_circle_through_points_all_about_it_and_one_far_from_the_origin_has_its_radius() {
        let circle = [[3.0, 4.0], [-4.0, 3.0], [0.0, -5.0], [5.0, 0.0], [4.0, 3.0]];
        for [x, z] in [[0.0, 0.0], [-70.0, 240.0]] {
            let moved = circle.map(|point| [point[0] + x, point[1] + z]);
            assert!((radius(&moved).unwrap() - 5.0).abs() < 1e-9);
        }
        assert_eq!(radius(&circle[..1]), None, "one point has no circle");
    }

    #[test]
    fn a_point_counts_where_both_its_numbers_were_read() {
        let text = "q1_deg,on,profile1_x_mm,profile1_z_mm,profile2_x_mm,profile2_z_mm,profile3_x_mm,profile3_z_mm\n0,plate,1,90,2,91,3,92\n";
        let mut table = Table::parse("t.csv", text).unwrap();
        assert_eq!(points(&table, 0), [[1.0, 90.0], [2.0, 91.0], [3.0, 92.0]]);
        table.profiles[0].xz[0][0] = f64::NAN;
        table.profiles[2].xz[0][1] = f64::INFINITY;
        assert_eq!(points(&table, 0), [[2.0, 91.0]]);
    }
}
