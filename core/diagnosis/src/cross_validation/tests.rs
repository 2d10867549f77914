//! Left-out rows are predicted by a fit that has not seen them: held against fits made without them.

use super::*;
use crate::testing::two_links;
use plumb_calibration::fit::FitOptions;
use plumb_estimation::Progress;

/// Squared residuals of some rows when everything is fitted anew to the others, mm2.
fn refitted_without(problem: &ResidualModel<'_>, fit: &Fit, block: &[usize]) -> Vec<f64> {
    let rest: Vec<usize> = fit.rows.iter().filter(|row| !block.contains(row)).copied().collect();
    let options = FitOptions { robust: false, ..FitOptions::default() };
    let other = problem.refit(&fit.state, &rest, &fit.weights, options, &Progress::unwatched()).unwrap();
    let residuals = problem.residuals_apart(&other.state, block, &[]);
    block.iter().map(|row| point_squares(problem, &residuals, *row).into_iter().sum()).collect()
}

#[test]
fn a_left_out_row_is_predicted_by_a_fit_that_has_not_seen_it() {
    let lab = two_links(20, "joint_zero(*), joint_gain(*)", 0.5, 3, |_| [0.0; 2]);
    let problem = lab.problem(&[]).unwrap();
    let seen = lab.fit(&problem, &Progress::unwatched()).unwrap();
    let options = FitOptions { robust: false, ..FitOptions::default() };
    let ones = vec![1.0; 20];
    let fit = problem.refit(&seen.state, &seen.rows, &ones, options, &Progress::unwatched()).unwrap();
    let blocks = region_blocks(problem.table, &fit.rows);
    assert_eq!(blocks.len(), VALIDATION_BLOCKS);
    let predicted = left_out(&problem, &fit, &blocks).unwrap();
    let (mut in_sample, mut out_of_sample) = (0.0, 0.0);
    for block in &blocks {
        for (row, expected) in block.iter().zip(refitted_without(&problem, &fit, block)) {
            let square: f64 = predicted[*row].as_ref().unwrap().squares.iter().sum();
            assert!((square - expected).abs() < 0.02 * expected.max(0.05), "{square} against {expected}");
            in_sample += point_squares(&problem, &fit.residuals, *row).into_iter().sum::<f64>();
            out_of_sample += square;
        }
    }
    // Four parameters of 60 equations: left-out rows are predicted worse than seen ones, by some 2 x 4 / 60.
    assert!(out_of_sample > 1.05 * in_sample, "{out_of_sample} {in_sample}");
}

#[test]
fn both_ways_to_gather_the_equations_agree() {
    let lab = two_links(20, "joint_zero(*)", 0.5, 4, |_| [0.0; 2]);
    let problem = lab.problem(&[]).unwrap();
    let fit = lab.fit(&problem, &Progress::unwatched()).unwrap();
    let blocks = region_blocks(problem.table, &fit.rows);
    let one = left_out(&problem, &fit, &blocks).unwrap();
    let other = Derivatives::of(&problem, &fit).left_out(&fit, &blocks).unwrap();
    for (one, other) in one.iter().flatten().zip(other.iter().flatten()) {
        assert!(one.squares.iter().zip(&other.squares).all(|(one, other)| (one - other).abs() < 1e-9));
    }
}

#[test]
fn every_row_is_in_one_block_and_nothing_is_said_where_too_little_is_left() {
    let lab = two_links(20, "joint_zero(*)", 0.5, 5, |_| [0.0; 2]);
    let problem = lab.problem(&[]).unwrap();
    let fit = lab.fit(&problem, &Progress::unwatched()).unwrap();
    for blocks in [region_blocks(problem.table, &fit.rows), joint_blocks(problem.table, &fit.rows, 1)] {
        let mut rows: Vec<usize> = blocks.iter().flatten().copied().collect();
        rows.sort_unstable();
        assert_eq!(rows, fit.rows);
    }
    let all = vec![fit.rows.clone(), Vec::new()];
    assert!(left_out(&problem, &fit, &all).is_none(), "nothing is left to fit");
    assert!(left_out(&problem, &fit, &all[..1]).is_none(), "one block is no cross-validation");
    assert_eq!(session_blocks(problem.table, &fit.rows), None);
}

#[test]
fn ranges_of_a_joint_do_not_overlap() {
    let lab = two_links(40, "joint_zero(*)", 0.5, 6, |_| [0.0; 2]);
    let table = lab.table();
    let rows: Vec<usize> = (0..40).collect();
    let ends: Vec<(f64, f64)> = joint_blocks(table, &rows, 0)
        .iter()
        .map(|block| {
            let q = block.iter().map(|row| table.q_of(*row)[0]);
            q.fold((f64::MAX, f64::MIN), |(low, high), q| (low.min(q), high.max(q)))
        })
        .collect();
    assert!(ends.windows(2).all(|pair| pair[0].1 <= pair[1].0), "{ends:?}");
}

#[test]
fn sessions_are_blocks_of_their_own_where_there_are_several() {
    let rows = ["mon", "tue", "mon", "wed"].iter().enumerate();
    let rows: String = rows.map(|(row, session)| format!("{row},0,{session}\n")).collect();
    let table = Table::parse("table.csv", &format!("q1_deg,p1_x_mm,session\n{rows}")).unwrap();
    assert_eq!(session_blocks(&table, &[0, 1, 2, 3]), Some(vec![vec![0, 2], vec![1], vec![3]]));
    assert_eq!(session_blocks(&table, &[0, 1, 2]), Some(vec![vec![0, 2], vec![1]]), "one was not fitted");
    assert_eq!(session_blocks(&table, &[0, 2]), None, "one block is no cross-validation");
}

#[test]
fn sessions_are_blocks_from_two_on() {
    let table = |sessions: &[&str]| {
        let rows: String = sessions.iter().map(|name| format!("0,0,1,{name}\n")).collect();
        Table::parse("t.csv", &format!("q1_deg,q2_deg,p1_x_mm,session\n{rows}")).unwrap()
    };
    let all = [0, 1, 2, 3];
    assert_eq!(session_blocks(&table(&["a", "b", "a", ""]), &all), Some(vec![vec![0, 2], vec![1]]));
    assert_eq!(session_blocks(&table(&["a", "b", "c", "a"]), &all), Some(vec![vec![0, 3], vec![1], vec![2]]));
    assert_eq!(
        session_blocks(&table(&["a", "b", "a", ""]), &[0, 2, 3]),
        None,
        "all that are fitted lie in one"
    );
    assert_eq!(session_blocks(&table(&["a"; 4]), &all), None);
    assert_eq!(session_blocks(&table(&[""; 4]), &all), None);
}

#[test]
fn a_fit_without_some_rows_is_solved_from_what_the_others_add_a_little_damped() {
    let normal = |square: f64, product: f64, equations: usize| {
        let mut one = NormalEquations::zeros(1);
        (one.matrix[(0, 0)], one.gradient[0], one.equations) = (square, product, equations);
        one
    };
    let (all, own) = (normal(5.0, 7.0, 6), normal(2.0, 1.0, 4));
    let without = Without::of(&all, 1, &own).unwrap();
    assert!((without.step[0] * 3.0 * (1.0 + DAMPING) - 6.0).abs() < 1e-12, "{:?}", without.step);
    assert!(Without::of(&all, 2, &own).is_none(), "two equations for two numbers leave nothing over");
}

#[test]
fn rows_are_cut_as_they_are_held_out_each_once_and_returns_together() {
    let lab = crate::testing::returned(20, 3);
    let lab = crate::testing::with_table(&lab, |table| {
        table.session.names = ["mon", "tue", "wed"].map(str::to_owned).to_vec();
        table.session.of_row = (0..60).map(|row| Some(row / 20)).collect();
    });
    let rows: Vec<usize> = (0..60).filter(|row| *row != 7).collect();
    let blocks = |holdout: Holdout| holdout_blocks(lab.table(), &rows, holdout);
    let random = blocks(Holdout::Random { fraction: 0.3, seed: 2 });
    for blocks in [&random, &blocks(Holdout::Time { fraction: 0.2 }), &blocks(Holdout::Session)] {
        let mut all = blocks.concat();
        all.sort_unstable();
        assert_eq!(all, rows);
    }
    assert_eq!(random.len(), VALIDATION_BLOCKS);
    for row in 0..60 {
        let of = |row: usize| random.iter().position(|block| block.contains(&row));
        assert!(
            of(row) == of(row - row % 3) || row == 7,
            "row {row} is a return to the pose of {}",
            row - row % 3
        );
    }
    assert!(random.iter().any(|block| block.windows(2).any(|pair| pair[1] < pair[0])), "drawn at random");
    let stretches = blocks(Holdout::Time { fraction: 0.2 });
    assert!(stretches.iter().all(|block| block.windows(2).all(|pair| pair[0] < pair[1])));
    assert!(stretches.windows(2).all(|pair| pair[0].last() < pair[1].first()), "one after the other");
    assert_eq!(blocks(Holdout::Session).len(), 3);
    assert_eq!(blocks(Holdout::Regions), region_blocks(lab.table(), &rows));
    let alone = crate::testing::returned(20, 3);
    let unknown = holdout_blocks(alone.table(), &rows, Holdout::Session);
    assert_eq!(unknown, region_blocks(alone.table(), &rows), "there are no sessions");
}
