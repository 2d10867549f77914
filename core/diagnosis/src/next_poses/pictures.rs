//! Poses for a light stripe, a laser line sensor or a camera on the hand: beside pictures that were taken, where the stripe falls on the same surfaces or the board is
//! seen again.

use plumb_calibration::measurement::Observations;
use plumb_calibration::table::{Stretch, Table};
use plumb_estimation::Random;

use crate::laboratory::Laboratory;

/// By how much a joint differs from that of a picture which was taken, at first, rad: the hand then moves by some centimetres.
const BESIDE: f64 = 0.05;

/// The same where a camera sees a board, which fills less of its picture.
const BESIDE_A_BOARD: f64 = 0.25;

/// How far from its surface a stripe may seem to fall (where the pixels of the nearest picture are taken for those to come), mm: it is then on it, some
/// pixels aside.
const FALLS_WITHIN: f64 = 25.0;

/// The joints of a picture that was taken, each a little different.
pub(super) fn beside_a_picture(lab: &Laboratory, rng: &mut Random) -> Option<Vec<f64>> {
    let rows = lab.measured_rows();
    let row = *rows.get(rng.below(rows.len().max(1)))?;
    let of_a_line = lab.table().is_of_stripes() || !lab.table().profiles.is_empty();
    let beside = if of_a_line { BESIDE } else { BESIDE_A_BOARD };
    Some(lab.table().q_of(row).iter().map(|q| q + beside * rng.normal()).collect())
}

/// The stretches that pictures from these poses would show: those of the nearest picture that was taken.
pub(super) fn stretches(lab: &Laboratory, poses: &Table) -> Vec<Stretch> {
    let known = lab.table();
    let rows = lab.measured_rows();
    let mut all = Vec::new();
    for pose in 0..poses.len() {
        let q = poses.q_of(pose);
        let Some(nearest) = nearest(known, q, rows.iter()) else { continue };
        let shown = known.stretches.get(known.stretches_of(*nearest)).unwrap_or(&[]);
        all.extend(
            shown
                .iter()
                .map(|stretch| Stretch::new(pose, stretch.surface, stretch.pixels.clone(), stretch.sigma)),
        );
    }
    all
}

/// Of some rows the one whose joints are nearest to these, in rad (mm of a slide); the first of equals.
fn nearest<'r>(table: &Table, q: &[f64], rows: impl Iterator<Item = &'r usize>) -> Option<&'r usize> {
    let apart =
        rows.map(|row| (table.q_of(*row).iter().zip(q).map(|(a, b)| (a - b).powi(2)).sum::<f64>(), row));
    apart.min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, row)| row)
}

/// The board that a camera on the hand would see from a pose to come, by its number among the table's names: that of the nearest picture that was taken.
pub(super) fn board(lab: &Laboratory, q: &[f64]) -> Option<u32> {
    nearest_board(lab.table(), &lab.measured_rows(), q)
}

fn nearest_board(known: &Table, rows: &[usize], q: &[f64]) -> Option<u32> {
    let nearest = nearest(known, q, rows.iter().filter(|row| known.sees_a_board_in(**row)))?;
    known.board_seen.of_row.get(*nearest).copied().flatten()
}

/// Adds to a table of poses to come the points that a laser line sensor would see from this one: those of the nearest profile that was taken. Says what it lies on.
pub(super) fn profile<'l>(lab: &'l Laboratory, q: &[f64], table: &mut Table) -> Option<&'l str> {
    let known = lab.table();
    let rows = lab.measured_rows();
    let nearest = nearest(known, q, rows.iter().filter(|row| known.has_profile(**row)));
    for (columns, known) in table.profiles.iter_mut().zip(&known.profiles) {
        let point = nearest.and_then(|row| known.xz.get(*row)).copied();
        columns.xz.push(point.unwrap_or([f64::NAN; 2]));
    }
    known.on.name(*nearest?)
}

/// Whether the stripe or the profile of a row falls on the surfaces it is to fall on; `residuals` are the row's, in sigmas.
pub(super) fn falls_on_its_surfaces(observations: &Observations, row: usize, residuals: &[f64]) -> bool {
    let equations = observations.of_row(row).iter().zip(residuals);
    let mut means = equations.filter(|(equation, _)| equation.measurand.component == 0);
    means.all(|(equation, residual)| (residual * equation.sigma).abs() <= FALLS_WITHIN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_of_some_rows_is_nearest_in_all_joints_and_the_first_of_equals() {
        let table = Table::parse("t.csv", "q1_deg,q2_deg,p1_x_mm\n0,0,1\n10,40,1\n30,10,1\n0,0,1\n").unwrap();
        let to = |q: [f64; 2], rows: &[usize]| nearest(&table, &q.map(f64::to_radians), rows.iter()).copied();
        assert_eq!(to([12.0, 2.0], &[0, 1, 2, 3]), Some(0));
        assert_eq!(to([25.0, 20.0], &[0, 1, 2, 3]), Some(2), "5 and 10 deg are nearer than 15 and 20");
        assert_eq!(to([25.0, 20.0], &[0, 1]), Some(1));
        assert_eq!(to([0.0; 2], &[3, 0]), Some(3));
        assert_eq!(to([0.0; 2], &[]), None);
    }

    #[test]
    fn a_pose_to_come_sees_the_board_of_the_nearest_picture() {
        let table = "q1_deg,q2_deg,board_x_mm,board_y_mm,board_z_mm,board\n0,0,1,2,300,floor\n10,40,1,2,300,wall\n12,40,,,,floor\n";
        let table = Table::parse("t.csv", table).unwrap();
        let seen = |q: [f64; 2], rows: &[usize]| nearest_board(&table, rows, &q.map(f64::to_radians));
        assert_eq!(seen([1.0, 3.0], &[0, 1, 2]), Some(0));
        assert_eq!(seen([12.0, 40.0], &[0, 1, 2]), Some(1), "in the third row no board is seen");
        assert_eq!((seen([12.0, 40.0], &[0, 2]), seen([0.0, 0.0], &[2])), (Some(0), None));
    }

    /// How far poses are drawn beside those of a table, rad: the spread of a joint.
    fn spread_beside(lab: &Laboratory) -> f64 {
        let mut rng = Random::seeded(8);
        let mut squares = 0.0;
        for _ in 0..200 {
            let q = beside_a_picture(lab, &mut rng).unwrap();
            assert_eq!(q.len(), 2);
            let row = nearest(lab.table(), &q, (0..5).collect::<Vec<_>>().iter()).copied().unwrap();
            squares += lab.table().q_of(row).iter().zip(&q).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        }
        // Two joints, each by a normal number of this spread.
        (squares / 400.0).sqrt()
    }

    #[test]
    fn poses_are_drawn_beside_those_that_were_measured() {
        let spread = spread_beside(&crate::testing::two_links(5, "", 0.05, 3, |_| [0.0; 2]));
        assert!((spread / BESIDE_A_BOARD - 1.0).abs() < 0.1, "{spread}");
    }

    #[test]
    fn poses_of_a_laser_line_are_drawn_nearer_for_it_must_fall_on_the_same_surface_again() {
        let model =
            crate::testing::TWO_LINKS.replace("measured_from", "profile: {seen_by: p1}\nmeasured_from");
        let model =
            format!("{model}surfaces: {{table: {{plane: {{normal: [0, 0, 1], offset_mm: 0}}}}}}\nfree: []\n");
        let mut text = "q1_deg,q2_deg,profile1_x_mm,profile1_z_mm,on\n".to_owned();
        for row in 0..5 {
            text.push_str(&format!("{},{},{},100,table\n", 40 * row - 80, 30 * row - 60, 2 * row));
        }
        let model = plumb_calibration::arm_model::Model::parse("model.yaml", &model).unwrap();
        let options = crate::laboratory::Options {
            holdout: crate::split::Holdout::None,
            ..crate::laboratory::Options::default()
        };
        let lab = Laboratory::new(model, Table::parse("t.csv", &text).unwrap(), options).unwrap();
        let spread = spread_beside(&lab);
        assert!((spread / BESIDE - 1.0).abs() < 0.1, "{spread}");
    }

    #[test]
    fn a_stripe_falls_on_its_surface_where_its_mean_lies_near_whatever_its_slope() {
        let lab = crate::testing::two_links_with("free: []\nnoise: {p1_mm: 0.5}", 2, 0.05, 3, |_| [0.0; 2]);
        // The first number of a row is taken for the mean; 25 mm are 50 sigmas.
        let falls = |first: f64| falls_on_its_surfaces(lab.observations(), 1, &[first, 1e6, -1e6]);
        assert!(falls(50.0) && falls(-50.0) && falls(0.0));
        assert!(!falls(50.1) && !falls(-50.1));
    }
}
