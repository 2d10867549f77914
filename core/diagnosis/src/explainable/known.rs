//! What is known of the rows of a table besides what was measured: pose, last move, order or time, conditions, sessions, further columns.

use super::functions::fourier_features;
use plumb_calibration::fit::ResidualModel;
use plumb_calibration::table::{MOST_LEVELS, Table};
use plumb_estimation::Random;
use plumb_kinematics::Motion;

/// Range of a turning joint from which its sine and cosine are taken, rad; below, its coordinate on its range, which would else hardly vary.
const WIDE: f64 = std::f64::consts::PI;

/// Further columns looked at, at most.
const MOST_COLUMNS: usize = 6;

/// A column of numbers, one a row; not a number where it is not known.
pub(super) struct Column {
    pub(super) name: String,
    pub(super) values: Vec<f64>,
    /// Whether it acts with the pose, as heat and loads do.
    pub(super) with_pose: bool,
    /// Whether it is the order of the rows.
    pub(super) in_order: bool,
}

impl Column {
    /// Of these rows of a column of all.
    fn of(name: &str, values: &[f64], rows: &[usize]) -> Self {
        let values = rows.iter().map(|row| values.get(*row).copied().unwrap_or(f64::NAN)).collect();
        Self { name: name.to_owned(), values, with_pose: false, in_order: false }
    }
}

/// What is known of some rows.
pub(super) struct Known {
    /// Distinct poses.
    pub(super) poses: usize,
    pub(super) numbers: Vec<Column>,
    /// Per column: its name, and the category of each row.
    pub(super) categories: Vec<(String, Vec<Option<usize>>)>,
    /// Rows by joints.
    coordinates: Vec<Vec<f64>>,
    moves: Vec<Vec<f64>>,
    /// Sides of approach, where they were logged.
    approach: Option<Vec<Vec<f64>>>,
    /// Rows by inputs.
    inputs: Vec<Vec<f64>>,
    /// Mean distance of two rows' inputs.
    extent: f64,
}

impl Known {
    /// Of these rows.
    pub(super) fn of(problem: &ResidualModel<'_>, rows: &[usize]) -> Self {
        let table = problem.table;
        let coordinates: Vec<Vec<f64>> = rows.iter().map(|row| table.q_of(*row).to_vec()).collect();
        let inputs = inputs(problem, &coordinates);
        let mut distinct: Vec<Vec<u64>> =
            coordinates.iter().map(|q| q.iter().map(|one| one.to_bits()).collect()).collect();
        distinct.sort_unstable();
        // Replicates of a pose say no more of how far poses lie apart.
        distinct.dedup();
        let approach = table.approach.as_ref().map(|_| {
            rows.iter()
                .map(|row| (0..table.joints).map(|joint| f64::from(table.approach_of(*row, joint))).collect())
                .collect()
        });
        Self {
            poses: distinct.len(),
            numbers: numbers(table, rows),
            categories: categories(table, rows),
            moves: last_moves(table, rows),
            approach,
            extent: extent(&inputs),
            coordinates,
            inputs,
        }
    }

    /// A joint's coordinate in every row, rad or mm.
    pub(super) fn coordinate(&self, joint: usize) -> Vec<f64> {
        of_joint(&self.coordinates, joint)
    }

    /// A joint's last move before every row, rad or mm.
    pub(super) fn last_move(&self, joint: usize) -> Vec<f64> {
        of_joint(&self.moves, joint)
    }

    /// From which side a joint arrived: by its last move, and as it was logged.
    pub(super) fn sides(&self, joint: usize) -> Vec<Vec<f64>> {
        // The sign of zero is one in floating point; a joint at rest came from neither side.
        let moves = self.last_move(joint).into_iter();
        let moved = moves.map(|moved| if moved == 0.0 { 0.0 } else { moved.signum() }).collect();
        let logged = self.approach.as_ref().map(|sides| of_joint(sides, joint));
        std::iter::once(moved).chain(logged).filter(|side: &Vec<f64>| varies(side)).collect()
    }

    /// Random smooth functions of the whole pose, of a length scale relative to the mean distance of two rows.
    pub(super) fn pose_functions(&self, scale: f64, count: usize, random: &mut Random) -> Vec<Vec<f64>> {
        if self.extent <= 0.0 {
            return Vec::new();
        }
        fourier_features(&self.inputs, scale * self.extent, count, random)
    }
}

fn of_joint(rows: &[Vec<f64>], joint: usize) -> Vec<f64> {
    rows.iter().map(|row| row.get(joint).copied().unwrap_or(0.0)).collect()
}

fn varies(values: &[f64]) -> bool {
    values.iter().any(|value| values.first().is_some_and(|first| (value - first).abs() > 1e-9))
}

/// The inputs of functions of the whole pose: sine and cosine of joints that turn far, else coordinates scaled to -1 .. 1.
fn inputs(problem: &ResidualModel<'_>, coordinates: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut inputs = vec![Vec::new(); coordinates.len()];
    for (joint, described) in problem.model.chain.joints.iter().enumerate() {
        let values = of_joint(coordinates, joint);
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let wide = described.motion == Motion::Turns && high - low >= WIDE;
        for (input, value) in inputs.iter_mut().zip(values) {
            match wide {
                true => input.extend([value.sin(), value.cos()]),
                false if high > low => input.push(2.0 * (value - low) / (high - low) - 1.0),
                false => {}
            }
        }
    }
    inputs
}

/// The root mean square distance of the inputs of two rows or poses.
pub(super) fn extent(inputs: &[Vec<f64>]) -> f64 {
    let count = inputs.len().max(1) as f64;
    let width = inputs.first().map_or(0, Vec::len);
    // The root mean square distance of two poses: a length scale needs no more than its order of size.
    let variances = (0..width).map(|column| {
        let values = inputs.iter().filter_map(|input| input.get(column));
        let mean = values.clone().sum::<f64>() / count;
        values.map(|value| (value - mean).powi(2)).sum::<f64>() / count
    });
    // The difference of two independent values has twice their variance.
    (2.0 * variances.sum::<f64>()).sqrt()
}

/// Each row's move since the row before it in the order of time, joint by joint; zero for the first.
fn last_moves(table: &Table, rows: &[usize]) -> Vec<Vec<f64>> {
    let order = table.order();
    let mut before = vec![None; table.len()];
    for (earlier, later) in order.iter().zip(order.iter().skip(1)) {
        if let Some(slot) = before.get_mut(*later) {
            *slot = Some(*earlier);
        }
    }
    let moves = rows.iter().map(|row| match before.get(*row).copied().flatten() {
        Some(earlier) => {
            table.q_of(*row).iter().zip(table.q_of(earlier)).map(|(now, then)| now - then).collect()
        }
        None => vec![0.0; table.joints],
    });
    moves.collect()
}

/// Order or time, conditions, and further columns of numbers, where they vary.
fn numbers(table: &Table, rows: &[usize]) -> Vec<Column> {
    let mut index = vec![0.0; table.len()];
    for (order, row) in table.order().into_iter().enumerate() {
        if let Some(slot) = index.get_mut(row) {
            *slot = order as f64;
        }
    }
    // Where time is logged the order says the same with less.
    let (name, values) = match &table.time {
        Some(times) => ("time", times),
        None => ("order", &index),
    };
    let mut columns = vec![Column { in_order: true, ..Column::of(name, values, rows) }];
    for (name, values) in [("temperature", &table.temperature), ("load", &table.payload)] {
        let column = values.iter().map(|values| Column::of(name, values, rows));
        columns.extend(column.map(|column| Column { with_pose: true, ..column }));
    }
    for covariate in table.covariates.iter().filter(|one| one.levels().is_empty()).take(MOST_COLUMNS) {
        let values: Vec<f64> = (0..table.len()).map(|row| covariate.number(row)).collect();
        columns.push(Column::of(&format!("`{}`", covariate.name), &values, rows));
    }
    columns.retain(|column| {
        varies(&column.values.iter().copied().filter(|value| value.is_finite()).collect::<Vec<_>>())
    });
    columns
}

/// Sessions and further columns of words, where they vary. A column of more words than [`MOST_LEVELS`] is left out.
fn categories(table: &Table, rows: &[usize]) -> Vec<(String, Vec<Option<usize>>)> {
    let mut columns = Vec::new();
    if (2..=MOST_LEVELS).contains(&table.session.names.len()) {
        let of_rows = rows.iter().map(|row| table.session.of_row.get(*row).copied().flatten());
        columns.push(("session".to_owned(), of_rows.map(|name| name.map(|name| name as usize)).collect()));
    }
    let words = table.covariates.iter().filter(|one| one.levels().len() > 1 && !one.has_too_many_levels());
    for covariate in words.take(MOST_COLUMNS) {
        let of_rows = rows.iter().map(|row| covariate.number(*row));
        let levels = of_rows.map(|level| level.is_finite().then_some(level as usize));
        columns.push((format!("`{}`", covariate.name), levels.collect()));
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links;

    #[test]
    fn of_a_joint_that_turned_far_sine_and_cosine_are_taken_of_another_its_place_in_its_range() {
        let lab = two_links(6, "", 0.1, 1, |_| [0.0; 2]);
        let problem = lab.problem(&[]).unwrap();
        let of = |poses: &[[f64; 2]]| inputs(&problem, &poses.iter().map(|q| q.to_vec()).collect::<Vec<_>>());
        // The shoulder turned by just over half a turn, the elbow by 0.5 rad.
        let found = of(&[[-1.6, 0.25], [0.5, 0.75], [1.6, 0.375]]);
        for (row, (q, position)) in found.iter().zip([(-1.6_f64, -1.0), (0.5, 1.0), (1.6, -0.5)]) {
            assert_eq!(row.len(), 3);
            let apart = [row[0] - q.sin(), row[1] - q.cos(), row[2] - position];
            assert!(apart.iter().all(|one| one.abs() < 1e-12), "{row:?}");
        }
        // By just under half a turn: its position in its range. A joint that did not move says nothing.
        assert_eq!(of(&[[-1.5, 0.2], [1.5, 0.2]]), [[-1.0], [1.0]]);
    }

    #[test]
    fn two_rows_lie_apart_by_the_root_of_twice_their_variances() {
        // 0 and 2 in one column: variance 1; 1 and 5 in the other: variance 4. The root of 2 (1 + 4).
        assert!((extent(&[vec![0.0, 1.0], vec![2.0, 5.0]]) - 10.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(extent(&[]), 0.0);
    }

    #[test]
    fn a_move_is_from_the_row_before_in_time_and_a_joint_at_rest_came_from_neither_side() {
        let text = "time_s,q1_deg,q2_deg,p1_x_mm\n20,30,10,1\n0,10,10,1\n10,15,10,1\n";
        let table = Table::parse("t.csv", text).unwrap();
        let moves = last_moves(&table, &[0, 1, 2]);
        for (moved, expected) in moves.iter().zip([15.0_f64, 0.0, 5.0]) {
            assert!((moved[0] - expected.to_radians()).abs() < 1e-12 && moved[1] == 0.0, "{moves:?}");
        }
    }

    #[test]
    fn conditions_act_with_the_pose_and_time_replaces_the_order() {
        let header = "time_s,temperature_c,payload_kg,q1_deg,q2_deg,p1_x_mm";
        let text = format!("{header}\n0,20,1,0,0,1\n5,21,1,1,1,1\n");
        let table = Table::parse("t.csv", &text).unwrap();
        let columns = numbers(&table, &[0, 1]);
        let listed: Vec<(&str, bool, bool)> =
            columns.iter().map(|one| (one.name.as_str(), one.with_pose, one.in_order)).collect();
        // The load does not vary.
        assert_eq!(listed, [("time", false, true), ("temperature", true, false)]);
        let plain = Table::parse("t.csv", "q1_deg,q2_deg,p1_x_mm\n0,0,1\n1,1,1\n2,2,1\n").unwrap();
        let columns = numbers(&plain, &[2, 0]);
        assert_eq!((columns[0].name.as_str(), columns[0].values.as_slice()), ("order", &[2.0, 0.0][..]));
        assert!(numbers(&plain, &[1]).is_empty(), "of one row nothing varies");
    }

    #[test]
    fn sessions_and_words_are_categories_where_there_are_two_at_least_and_not_too_many() {
        let columns_of = |sessions: usize, words: usize| {
            let rows: String =
                (0..28).map(|row| format!("{row},0,1,s{},w{}\n", row % sessions, row % words)).collect();
            let table =
                Table::parse("t.csv", &format!("q1_deg,q2_deg,p1_x_mm,session,fixture\n{rows}")).unwrap();
            categories(&table, &[0, 1, 13, 27])
        };
        let names = |sessions: usize, words: usize| {
            columns_of(sessions, words).into_iter().map(|(name, _)| name).collect::<Vec<_>>()
        };
        assert_eq!(names(2, 2), ["session", "`fixture`"]);
        assert!(names(1, 1).is_empty());
        assert_eq!(names(MOST_LEVELS, MOST_LEVELS), ["session", "`fixture`"]);
        assert!(names(MOST_LEVELS + 1, MOST_LEVELS + 1).is_empty());
        let found = columns_of(2, 3);
        assert_eq!(found[0].1, [Some(0), Some(1), Some(1), Some(1)]);
        assert_eq!(found[1].1, [Some(0), Some(1), Some(1), Some(0)]);
    }
}
