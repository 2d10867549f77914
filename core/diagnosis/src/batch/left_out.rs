//! How rows that are left out are predicted with an effect and without it, from one look at the rows: around the state that is
//! expected, everything is taken as flat. A refit for each effect would find the same, a hundred times as slowly.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector};

use crate::cross_validation::{
    Derivatives, Without, joint_blocks, pose_groups, region_blocks, session_blocks,
};
use crate::predictive_gain::Gain;
use crate::score_test::Noise;
use plumb_calibration::fit::{FreeParameter, ResidualModel, State};
use plumb_estimation::{Cancelled, Progress};
use plumb_estimation::{NormalEquations, RankRevealingCholesky, for_each, huber_variance};

/// Rows at a state, and what is foretold of them when their region, their part of a joint's range or their session is left out.
pub(super) struct LeftOutPredictions<'m> {
    problem: &'m ResidualModel<'m>,
    state: &'m State,
    weights: &'m [f64],
    derivatives: Derivatives<'m>,
    total: NormalEquations,
    rows: &'m [usize],
    poses: Vec<Vec<usize>>,
    ways: Vec<Way>,
}

/// A way of leaving rows out that every effect is asked in, or only those of one joint.
struct Way {
    joint: Option<usize>,
    /// Nothing where too little would be left to fit.
    blocks: Option<Vec<Block>>,
}

/// Rows left out together.
struct Block {
    rows: Vec<usize>,
    without: Without,
}

impl Block {
    /// Of these rows, and the fit of all others; nothing where that would be of too few. Rows that it says nothing of are left out of it.
    fn of(
        problem: &ResidualModel<'_>,
        derivatives: &Derivatives<'_>,
        (total, rank): (&NormalEquations, usize),
        rows: &[usize],
    ) -> Option<Self> {
        let without = Without::of(total, rank, &derivatives.normal(rows))?;
        let columns: Vec<usize> = rows.iter().flat_map(|row| derivatives.equations_of(*row)).collect();
        let undetermined =
            without.undetermined(problem, rows, || derivatives.jacobian.select_columns(&columns));
        let rows = rows.iter().filter(|row| !undetermined.contains(row)).copied().collect();
        Some(Self { rows, without })
    }
}

impl<'m> LeftOutPredictions<'m> {
    /// Looks at these rows, in which the problem's last effects were put at the values they are expected at; gains are to be asked
    /// of effects at these joints.
    pub(super) fn of(
        problem: &'m ResidualModel<'m>,
        state: &'m State,
        (rows, weights): (&'m [usize], &'m [f64]),
        joints: &BTreeSet<usize>,
        progress: &Progress,
    ) -> Result<Self, Cancelled> {
        let table = problem.table;
        let derivatives = Derivatives::at(problem, state, rows, weights);
        let mut total = derivatives.normal(rows);
        problem.known_besides_rows(state, rows, &mut total);
        progress.check()?;
        // Once for all blocks: what all rows cannot determine no part of them can.
        let rank = RankRevealingCholesky::new(&total.matrix).rank();
        let mut ways = vec![(None, region_blocks(table, rows))];
        ways.extend(joints.iter().map(|joint| (Some(*joint), joint_blocks(table, rows, *joint))));
        ways.extend(session_blocks(table, rows).map(|blocks| (None, blocks)));
        let ways = for_each(&ways, |(joint, blocks)| {
            // With a single block nothing would be left to fit.
            let blocks = if blocks.len() < 2 {
                None
            } else {
                let each = blocks.iter().map(|rows| Block::of(problem, &derivatives, (&total, rank), rows));
                each.collect()
            };
            Way { joint: *joint, blocks }
        });
        progress.check()?;
        let poses = pose_groups(table, rows);
        Ok(Self { problem, state, weights, derivatives, total, rows, poses, ways })
    }

    /// What is left with everything in.
    pub(super) fn noise(&self) -> Noise {
        let factor = RankRevealingCholesky::new(&self.total.matrix);
        let step = factor.solve(&self.total.gradient);
        let equations = self.rows.iter().flat_map(|row| {
            let weight = self.weight(*row);
            self.left(*row, &step).map(move |left| (weight, left / weight.sqrt()))
        });
        let variance = huber_variance(equations, factor.rank());
        Noise { variance, freedom: (self.total.equations as f64 - factor.rank() as f64).max(1.0) }
    }

    /// How much better rows that are left out are predicted with an effect (counted among the problem's) in, beside all the
    /// others: by region, by range of its joint, by session.
    pub(super) fn gains(&self, effect: usize) -> Vec<Gain> {
        let free_parameters = self.problem.free_parameters().iter().enumerate();
        let own = free_parameters.filter(|(_, free_parameter)| matches!(free_parameter, FreeParameter::Effect(index, _) if *index == effect));
        let columns: Vec<usize> = own.map(|(column, _)| column).collect();
        let joint = self.problem.parts.get(effect).and_then(|part| part.id.joint());
        let asked = self.ways.iter().filter(|way| way.joint.is_none() || way.joint == joint);
        let ways = asked.filter_map(|way| way.blocks.as_ref());
        ways.filter_map(|blocks| self.gain(blocks, effect, &columns)).collect()
    }

    fn gain(&self, blocks: &[Block], effect: usize, columns: &[usize]) -> Option<Gain> {
        let mut reductions = vec![0.0; self.problem.table.len()];
        for block in blocks {
            let with = DVector::from_column_slice(&block.without.step);
            let without = &with - self.taken_out(&block.without, effect, columns);
            for row in &block.rows {
                let [without, with] =
                    [&without, &with].map(|step| self.left(*row, step).map(|left| left * left).sum::<f64>());
                if let Some(reduction) = reductions.get_mut(*row) {
                    *reduction = (without - with) / self.weight(*row);
                }
            }
        }
        // Replicates to one pose share what the model does wrong there: they count as one.
        let of_poses = self.poses.iter().map(|rows| rows.iter().filter_map(|row| reductions.get(*row)).sum());
        Gain::over(&of_poses.collect::<Vec<f64>>())
    }

    /// How a fit steps back when an effect's parameters are held at zero: Lagrange's way of holding them, with the factor of the
    /// fit in which they are free. Zero if that fit cannot determine them.
    fn taken_out(&self, fit: &Without, effect: usize, columns: &[usize]) -> DVector<f64> {
        let size = fit.step.len();
        let pulled: Vec<DVector<f64>> = columns
            .iter()
            .map(|column| {
                let mut unit = DVector::zeros(size);
                unit[*column] = 1.0;
                fit.factor.solve(&unit)
            })
            .collect();
        let count = columns.len();
        // The part of the inverse that belongs to its columns: how far each moves for a unit of pull on the others.
        let stiffness = DMatrix::from_fn(count, count, |row, column| pulled[column][columns[row]]);
        let values = self.state.effects.get(effect).map_or(&[][..], Vec::as_slice);
        let reached = DVector::from_fn(count, |index, _| {
            values.get(index).copied().unwrap_or(0.0) + fit.step[columns[index]]
        });
        let Some(holding) = stiffness.cholesky().map(|factor| factor.solve(&reached)) else {
            return DVector::zeros(size);
        };
        let sides = pulled.iter().zip(holding.iter());
        sides.fold(DVector::zeros(size), |sum, (pulled, force)| sum + pulled * *force)
    }

    /// What is left of a row's equations after a step, in declared sigmas times the root of the row's weight.
    fn left(&self, row: usize, step: &DVector<f64>) -> impl Iterator<Item = f64> {
        self.derivatives.equations_of(row).map(|equation| {
            let residual = self.derivatives.residuals.get(equation).copied().unwrap_or(0.0);
            residual - self.derivatives.jacobian.column(equation).dot(step)
        })
    }

    fn weight(&self, row: usize) -> f64 {
        self.weights.get(row).copied().unwrap_or(1.0)
    }
}
