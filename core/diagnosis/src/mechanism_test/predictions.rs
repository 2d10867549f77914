//! How rows that are left out are predicted with an effect beside the flexible part, and by that part alone; and how its size differs from block to block.

use super::bench::{Bench, Weighed};
use crate::cross_validation::{joint_blocks, pose_groups, region_blocks, session_blocks};
use crate::explainable::MixedFit;
use crate::predictive_gain::Gain;

/// What blocks of rows say of one effect.
pub(super) struct Predictions {
    /// Whether in every way of leaving blocks out the rows are predicted better with it than by the flexible part alone.
    pub(super) predicts: bool,
    /// The effect without the flexible part.
    pub(super) plain: MixedFit,
    /// Its values without each region, beside the flexible part and without it.
    pub(super) values: Vec<Vec<f64>>,
    pub(super) plain_values: Vec<Vec<f64>>,
}

impl Predictions {
    /// Nothing where what is left without a block does not determine what is fitted.
    pub(super) fn of(bench: &Bench<'_>, best: &Weighed<'_>) -> Option<Self> {
        let table = bench.stage.fitted.machine.table;
        let stiff = vec![f64::INFINITY; bench.nothing.ratios.len()];
        let plain = bench.mixed.fit(&best.suspect.parameters, Some(&stiff))?;
        let mut ways = vec![region_blocks(table, &bench.rows)];
        ways.extend(best.suspect.id.joint().map(|joint| joint_blocks(table, &bench.rows, joint)));
        ways.extend(session_blocks(table, &bench.rows));
        let mut told = Self { predicts: true, plain, values: Vec::new(), plain_values: Vec::new() };
        for (number, blocks) in ways.iter().enumerate() {
            let equations = blocks.iter().map(|block| bench.equations_of(block)).collect();
            let mut falls = vec![0.0; bench.mixed.equations()];
            for left_out in bench.mixed.leave_out(equations)? {
                let (before, _) = bench.mixed.predict(&bench.nothing, &left_out)?;
                let (after, values) = bench.mixed.predict(&best.fit, &left_out)?;
                for ((equation, before), (_, after)) in before.into_iter().zip(after) {
                    falls[equation] = before * before - after * after;
                }
                if number == 0 {
                    told.values.push(values);
                    told.plain_values.push(bench.mixed.predict(&told.plain, &left_out)?.1);
                }
            }
            let of_pose =
                |rows: &Vec<usize>| bench.equations_of(rows).into_iter().map(|one| falls[one]).sum();
            let falls: Vec<f64> = pose_groups(table, &bench.rows).iter().map(of_pose).collect();
            told.predicts &= Gain::over(&falls).is_some_and(|gain| gain.counts());
        }
        Some(told)
    }
}

impl Bench<'_> {
    /// Equations of some of the rows.
    fn equations_of(&self, rows: &[usize]) -> Vec<usize> {
        let place = |row: &usize| self.rows.binary_search(row).ok();
        rows.iter()
            .filter_map(place)
            .filter_map(|place| self.features.equations.get(place).cloned())
            .flatten()
            .collect()
    }
}

/// The jackknife's standard error of a number, from its values without each of some blocks (Efron & Tibshirani 1993, section 11.5).
pub(super) fn jackknife(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let count = values.len() as f64;
    if count < 2.0 {
        return 0.0;
    }
    let mean = values.iter().sum::<f64>() / count;
    ((count - 1.0) / count * values.iter().map(|one| (one - mean).powi(2)).sum::<f64>()).sqrt()
}
