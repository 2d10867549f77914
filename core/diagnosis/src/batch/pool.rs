//! Normal equations of everything fitted and of every candidate, by region of pose space and by random fold, from one pass
//! over the rows. Selection, significance and cross-validation cost no further pass.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::candidates;
use crate::cross_validation::{pose_groups, region_blocks};
use crate::fitted::Fitted;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::score_test::Probe;
use crate::thresholds::{BATCH_EFFECTS, BATCH_LEFT, BATCH_PARSIMONY, HIGH_ORDER, NAMING_LEVEL, TIE_BIC};
use plumb_calibration::arm_model::{AddedEffect, ValuePrior};
use plumb_calibration::effect::{Effect, Search};
use plumb_estimation::{NormalEquations, Progress, Random, RankRevealingCholesky, f_tail, for_each};

/// Random folds.
const FOLDS: usize = 4;

/// Rows handled at once.
const CHUNK: usize = 128;

/// Part of a sum of squares that is left at least, whatever is taken away: rounding of the normal equations, which are never gathered anew.
const LEAST_LEFT: f64 = 1e-6;

/// Rounds in which the variance of a joint's waves is estimated: it converges from round to round by about the part of the numbers that the rows do not determine.
const VARIANCE_ROUNDS: usize = 12;

/// Damping of a fit without some rows, relative to the diagonal.
const DAMPING: f64 = 1e-6;

/// Normal equations of the fitted numbers and of all candidates, by cell of pose space and fold.
pub(super) struct Pool {
    pub(super) probes: Vec<Probe>,
    ranges: Vec<std::ops::Range<usize>>,
    free_parameters: usize,
    regions: Vec<NormalEquations>,
    folds: Vec<NormalEquations>,
    total: NormalEquations,
    rank: usize,
}

/// What all candidates would do beyond what is taken in.
struct Beyond {
    left: DMatrix<f64>,
    gradient: DVector<f64>,
    squares: f64,
}

/// A candidate taken in.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Pick {
    /// Which of the pool's candidates.
    pub(super) probe: usize,
}

fn sum<'n>(size: usize, parts: impl Iterator<Item = &'n NormalEquations>) -> NormalEquations {
    let mut total = NormalEquations::zeros(size);
    parts.for_each(|part| total.add(part));
    total
}

impl Pool {
    pub(super) fn gather(
        lab: &Laboratory,
        fitted: &Fitted<'_>,
        progress: &Progress,
    ) -> Result<Self, LaboratoryError> {
        let mut probes = candidates::probes(lab);
        // What is searched for inside an effect would need a column for every value it may have.
        probes.retain(|probe| probe.search == Search::Nothing);
        let free_parameters = fitted.problem.free_parameters().len();
        let mut first = free_parameters;
        let ranges: Vec<std::ops::Range<usize>> = probes
            .iter()
            .map(|probe| {
                let range = first..first + probe.effect.parameters().len();
                first = range.end;
                range
            })
            .collect();
        let cells = cells(fitted);
        progress.report(0.2, "weighing all candidates")?;
        let normals = gather_cells(fitted, &cells, &probes, first);
        progress.check()?;
        let regions = cells.len() / FOLDS;
        let mut total = sum(first, normals.iter());
        // What is known of the fitted numbers besides the rows stays known whichever rows are left out.
        fitted.problem.known_besides_rows(&fitted.fit.state, &fitted.fit.rows, &mut total);
        Ok(Self {
            ranges,
            free_parameters,
            regions: normals.chunks(FOLDS).take(regions).map(|own| sum(first, own.iter())).collect(),
            folds: (0..FOLDS).map(|fold| sum(first, normals.iter().skip(fold).step_by(FOLDS))).collect(),
            total,
            rank: fitted.fit.rank(),
            probes,
        })
    }

    /// Whether a pick is one of the large family of harmonics of high order.
    pub(super) fn is_high_order(&self, pick: &Pick) -> bool {
        self.probes
            .get(pick.probe)
            .is_some_and(|probe| probe.id.order.is_some_and(|order| order > HIGH_ORDER))
    }

    /// Whether a candidate is an effect with a name of its own, and no wave of a family.
    pub(super) fn has_own_name(&self, probe: usize) -> bool {
        self.probes.get(probe).is_some_and(|probe| probe.id.order.is_none())
    }

    /// All candidates' normal equations with some columns projected out.
    fn beyond(&self, columns: &[usize]) -> Beyond {
        let (free_parameters, count) =
            (self.free_parameters, self.total.matrix.nrows() - self.free_parameters);
        let taken = self.total.matrix.select_columns(columns);
        let factor = RankRevealingCholesky::new(&taken.select_rows(columns));
        let shadow = factor.whiten(&taken.rows(free_parameters, count).transpose());
        let own = self.total.gradient.select_rows(columns);
        let known = factor.whiten(&DMatrix::from_column_slice(columns.len(), 1, own.as_slice()));
        Beyond {
            left: self.total.matrix.view((free_parameters, free_parameters), (count, count))
                - shadow.tr_mul(&shadow),
            gradient: self.total.gradient.rows(free_parameters, count) - shadow.tr_mul(&known).column(0),
            squares: self.total.squares - known.norm_squared(),
        }
    }

    /// Candidates of another name or site that would do as well as a pick with all the other picks in, the likeliest first; nothing of a pick that the others swallow
    /// whole, or that is implausible beside them.
    pub(super) fn rivals(&self, picks: &[Pick], index: usize) -> Option<Vec<usize>> {
        let own = picks.get(index)?;
        let others: Vec<Pick> = picks.iter().filter(|pick| pick.probe != own.probe).copied().collect();
        let beyond = self.beyond(&self.columns(&others));
        let mine = self.worth(own.probe, &beyond)?;
        let open = (0..self.probes.len()).filter(|index| picks.iter().all(|pick| pick.probe != *index));
        let mut rivals: Vec<(f64, usize)> = open
            .filter_map(|index| Some((self.worth(index, &beyond)?, index)))
            .filter(|(other, _)| *other > mine - TIE_BIC)
            .collect();
        rivals.sort_by(|one, other| other.0.total_cmp(&one.0));
        Some(rivals.into_iter().map(|(_, index)| index).collect())
    }

    /// By how much a candidate betters Schwarz's criterion beyond what is taken in; nothing where it cannot be seen, or is implausible.
    fn worth(&self, index: usize, beyond: &Beyond) -> Option<f64> {
        let equations = self.total.equations as f64;
        let (gain, values) = self.gain(index, &beyond.left, &beyond.gradient)?;
        let probe = self.probes.get(index).filter(|probe| plausible(probe.effect.as_ref(), &values))?;
        let after = (beyond.squares - gain).max(beyond.squares * LEAST_LEFT);
        let price = values.len() as f64 * equations.ln() + probe.search_cost;
        Some(equations * (beyond.squares / after).ln() - price)
    }

    /// Takes in the best candidate again and again, as long as it is worth its price and beyond chance.
    pub(super) fn select(&self, closed: &[usize]) -> Vec<Pick> {
        let Beyond { mut left, mut gradient, mut squares } =
            self.beyond(&(0..self.free_parameters).collect::<Vec<_>>());
        let equations = self.total.equations as f64;
        let mut rank = self.rank as f64;
        let mut picks: Vec<Pick> = Vec::new();
        let mut open: Vec<bool> = (0..self.probes.len()).map(|index| !closed.contains(&index)).collect();
        while picks.len() < BATCH_EFFECTS {
            let mut best: Option<(f64, usize, f64)> = None;
            for (index, probe) in self.probes.iter().enumerate().filter(|(index, _)| open[*index]) {
                let Some((gain, values)) = self.gain(index, &left, &gradient) else { continue };
                if !plausible(probe.effect.as_ref(), &values) {
                    continue;
                }
                let freedom = values.len() as f64;
                let after = (squares - gain).max(squares * LEAST_LEFT);
                let worth = equations * (squares / after).ln() - freedom * equations.ln() - probe.search_cost;
                let chance = by_chance((gain, freedom), after, equations - rank - freedom);
                // Bonferroni over the pool, and Schwarz's criterion beyond a tie: a batch names a hundred effects without a look at each.
                let passes = worth > TIE_BIC && chance * (self.probes.len() as f64) < NAMING_LEVEL;
                if passes && best.is_none_or(|(most, _, _)| worth > most) {
                    best = Some((worth, index, gain));
                }
            }
            let Some((_, index, gain)) = best else { break };
            open[index] = false;
            let range = self.local(index);
            let own = left.view((range.start, range.start), (range.len(), range.len())).into_owned();
            let Some(inverse) = own.try_inverse() else { continue };
            // The candidate is swept out of all others (Beaton 1964, less the part of the pivot, which is not asked again): what is left of each is then what it
            // adds beside it.
            let columns = left.columns(range.start, range.len()).into_owned();
            let carried = &columns * inverse;
            let own_gradient = gradient.rows(range.start, range.len()).into_owned();
            gradient -= &carried * own_gradient;
            left.gemm(-1.0, &carried, &columns.transpose(), 1.0);
            squares -= gain;
            rank += range.len() as f64;
            picks.push(Pick { probe: index });
        }
        picks
    }

    /// What the waves of each joint show of one another: their numbers are normally distributed about zero, with one variance a joint, by which the rows are likeliest
    /// (random effects; MacKay 1992, Neural Computation 4, 415-447). One over the variance, in units of the variance of one equation, for each of the
    /// columns; zero where nothing is known.
    pub(super) fn precisions(&self, picks: &[Pick]) -> Vec<f64> {
        let columns = self.columns(picks);
        let (matrix, gradient) = picked(&self.total, &columns);
        let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        let mut first = self.free_parameters;
        for pick in picks {
            let (id, width) = (&self.probes[pick.probe].id, self.ranges[pick.probe].len());
            if let (Some(joint), true) = (id.joint(), id.order.is_some()) {
                groups.entry(joint).or_default().extend(first..first + width);
            }
            first += width;
        }
        let mut precisions = vec![0.0; columns.len()];
        for _ in 0..VARIANCE_ROUNDS {
            let factor = RankRevealingCholesky::new(&(&matrix + diagonal(&precisions)));
            let (values, inverse) = (factor.solve(&gradient), factor.inverse());
            let left = self.total.squares - 2.0 * values.dot(&gradient) + values.dot(&(&matrix * &values));
            let freedom = (self.total.equations as f64 - factor.rank() as f64).max(1.0);
            let variance = (left / freedom).max(f64::MIN_POSITIVE);
            for own in groups.values() {
                // As many numbers as the rows determine, not the prior.
                let determined: f64 = own.iter().map(|at| 1.0 - precisions[*at] * inverse[(*at, *at)]).sum();
                let squares: f64 = own.iter().map(|at| values[*at] * values[*at]).sum();
                let next = determined * variance / squares;
                if next.is_finite() && next > 0.0 {
                    own.iter().for_each(|at| precisions[*at] = next);
                }
            }
        }
        precisions
    }

    /// The same as what a model keeps.
    pub(super) fn priors(&self, picks: &[Pick], precisions: &[f64]) -> Vec<ValuePrior> {
        let mut first = self.free_parameters;
        let priors = picks.iter().map(|pick| {
            let own = first..first + self.ranges[pick.probe].len();
            first = own.end;
            let known = precisions.get(own).unwrap_or_default().iter();
            let sd = known.map(|one| (*one > 0.0).then_some(one.sqrt().recip())).collect();
            ValuePrior { id: self.probes[pick.probe].id.clone(), sd }
        });
        priors.filter(|prior| prior.sd.iter().any(Option::is_some)).collect()
    }

    /// The picks as effects, at the values all of them have together, and how the fitted numbers move beside them.
    pub(super) fn effects(&self, picks: &[Pick], precisions: &[f64]) -> (Vec<AddedEffect>, Vec<f64>) {
        let values = self.values(&self.columns(picks), precisions);
        let mut first = self.free_parameters;
        let effects = picks.iter().map(|pick| {
            let width = self.ranges[pick.probe].len();
            let own = values.rows(first, width).as_slice().to_vec();
            first += width;
            AddedEffect { id: self.probes[pick.probe].id.clone(), values: own }
        });
        (effects.collect(), values.rows(0, self.free_parameters).as_slice().to_vec())
    }

    /// A candidate's columns, counted from the first candidate's.
    fn local(&self, index: usize) -> std::ops::Range<usize> {
        let range = &self.ranges[index];
        range.start - self.free_parameters..range.end - self.free_parameters
    }

    fn gain(&self, index: usize, left: &DMatrix<f64>, gradient: &DVector<f64>) -> Option<(f64, Vec<f64>)> {
        let range = self.local(index);
        let full = self.ranges[index].clone();
        let seen = range
            .clone()
            .zip(full)
            .all(|(own, all)| left[(own, own)] > BATCH_LEFT * self.total.matrix[(all, all)]);
        // A pivot that has shrunk so far is rounding: what is taken in explains the candidate already.
        if !seen {
            return None;
        }
        let own = left.view((range.start, range.start), (range.len(), range.len())).into_owned();
        let score = gradient.rows(range.start, range.len()).into_owned();
        let values = own.cholesky()?.solve(&score);
        Some((score.dot(&values).max(0.0), values.as_slice().to_vec()))
    }

    /// The columns of what is fitted and of these picks.
    pub(super) fn columns(&self, picks: &[Pick]) -> Vec<usize> {
        let picked = picks.iter().flat_map(|pick| self.ranges[pick.probe].clone());
        (0..self.free_parameters).chain(picked).collect()
    }

    /// The values of everything, with these columns free; of each it may be known beforehand how near zero it is.
    pub(super) fn values(&self, columns: &[usize], precisions: &[f64]) -> DVector<f64> {
        let (matrix, gradient) = picked(&self.total, columns);
        RankRevealingCholesky::new(&(matrix + diagonal(precisions))).solve(&gradient)
    }

    /// The same without each region in turn.
    pub(super) fn values_without_regions(&self, columns: &[usize], precisions: &[f64]) -> Vec<DVector<f64>> {
        self.values_without(columns, precisions, &self.regions)
    }

    fn values_without(
        &self,
        columns: &[usize],
        precisions: &[f64],
        blocks: &[NormalEquations],
    ) -> Vec<DVector<f64>> {
        let (matrix, gradient) = picked(&self.total, columns);
        blocks
            .iter()
            .map(|block| {
                let (own, own_gradient) = picked(block, columns);
                let mut rest = &matrix - &own + diagonal(precisions);
                // Without a region a harmonic may be seen over a part of a period only: a little damping keeps its amplitude at home.
                for index in 0..rest.nrows() {
                    rest[(index, index)] *= 1.0 + DAMPING;
                }
                RankRevealingCholesky::new(&rest).solve(&(&gradient - &own_gradient))
            })
            .collect()
    }

    /// Weighted squares of rows predicted without their own block.
    fn left_out(&self, columns: &[usize], blocks: &[NormalEquations]) -> f64 {
        let steps = self.values_without(columns, &vec![0.0; columns.len()], blocks);
        let errors = blocks.iter().zip(steps).map(|(block, step)| {
            let (own, own_gradient) = picked(block, columns);
            block.squares - 2.0 * step.dot(&own_gradient) + step.dot(&(own * &step))
        });
        errors.sum()
    }

    /// The fewest picks that predict rows left out at random all but as well as the best number of them would.
    pub(super) fn enough(&self, picks: &[Pick]) -> usize {
        let tried: Vec<usize> =
            // Every fourth number: the curve of the error is flat about its least, and each point costs a factorisation a fold.
            (0..=picks.len()).filter(|count| count % 4 == 0 || *count == picks.len()).collect();
        let errors: Vec<(usize, f64)> = tried
            .into_iter()
            .map(|count| (count, self.left_out(&self.columns(&picks[..count]), &self.folds)))
            .collect();
        let least = errors.iter().map(|(_, error)| *error).fold(f64::INFINITY, f64::min);
        errors.iter().find(|(_, error)| *error <= BATCH_PARSIMONY * least).map_or(0, |(count, _)| *count)
    }

    /// Picks that still matter when all the others are in.
    pub(super) fn needed(&self, mut picks: Vec<Pick>) -> Vec<Pick> {
        let equations = self.total.equations as f64;
        loop {
            let columns = self.columns(&picks);
            let matrix = self.total.matrix.select_rows(&columns).select_columns(&columns);
            let gradient = self.total.gradient.select_rows(&columns);
            let factor = RankRevealingCholesky::new(&matrix);
            let values = factor.solve(&gradient);
            let inverse = factor.inverse();
            let squares = (self.total.squares - gradient.dot(&values)).max(1e-300);
            let freedom = (equations - factor.rank() as f64).max(1.0);
            let mut first = self.free_parameters;
            let mut weakest: Option<(f64, usize)> = None;
            for (index, pick) in picks.iter().enumerate() {
                let width = self.ranges[pick.probe].len();
                let own = values.rows(first, width).into_owned();
                let covariance = inverse.view((first, first), (width, width)).into_owned();
                first += width;
                let gain = covariance.cholesky().map_or(0.0, |factor| own.dot(&factor.solve(&own)));
                let chance = f_tail(gain / width as f64 / (squares / freedom), width as f64, freedom);
                let sound = plausible(self.probes[pick.probe].effect.as_ref(), own.as_slice());
                let chance = if sound { chance } else { 1.0 };
                // Of those that are not needed only the weakest goes at a time: without it another may be needed.
                if chance * self.probes.len() as f64 > NAMING_LEVEL
                    && weakest.is_none_or(|(most, _)| chance > most)
                {
                    weakest = Some((chance, index));
                }
            }
            match weakest {
                Some((_, index)) => picks.remove(index),
                None => return picks,
            };
        }
    }
}

/// A matrix with these on its diagonal.
fn diagonal(entries: &[f64]) -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVector::from_column_slice(entries))
}

fn picked(normal: &NormalEquations, columns: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
    (normal.matrix.select_rows(columns).select_columns(columns), normal.gradient.select_rows(columns))
}

/// Probability of such a gain of so many numbers by chance, where so many squares are `left` on the degrees of freedom of the `rest`.
fn by_chance((gain, freedom): (f64, f64), left: f64, rest: f64) -> f64 {
    // A family of as many numbers as equations leaves no rest; one degree of freedom keeps it from looking certain.
    let rest = rest.max(1.0);
    f_tail(gain / freedom / (left / rest), freedom, rest)
}

/// Whether the values could be those of a real machine.
fn plausible(effect: &dyn Effect, values: &[f64]) -> bool {
    effect.plausible(values)
}

/// Fitted rows by region and random fold: cell `region * FOLDS + fold`.
fn cells(fitted: &Fitted<'_>) -> Vec<Vec<usize>> {
    let poses = pose_groups(fitted.problem.table, &fitted.fit.rows);
    let mut order: Vec<usize> = (0..poses.len()).collect();
    Random::seeded(1).shuffle(&mut order);
    let mut fold_of = vec![0; fitted.problem.table.len()];
    for (index, pose) in order.into_iter().enumerate() {
        for row in poses.get(pose).into_iter().flatten() {
            // Replicates of a pose go into one fold: in two, each would foretell the other.
            fold_of[*row] = index % FOLDS;
        }
    }
    let regions = region_blocks(fitted.problem.table, &fitted.fit.rows);
    let mut cells = vec![Vec::new(); regions.len() * FOLDS];
    for (region, rows) in regions.iter().enumerate() {
        for row in rows {
            cells[region * FOLDS + fold_of[*row]].push(*row);
        }
    }
    cells
}

/// Normal equations of every cell, on all cores.
fn gather_cells(
    fitted: &Fitted<'_>,
    cells: &[Vec<usize>],
    probes: &[Probe],
    size: usize,
) -> Vec<NormalEquations> {
    let effects: Vec<&dyn Effect> = probes.iter().map(|probe| probe.effect.as_ref()).collect();
    for_each(cells, |rows| {
        let mut normal = NormalEquations::zeros(size);
        for chunk in rows.chunks(CHUNK) {
            let block = fitted.problem.block(&fitted.fit.state, chunk, &fitted.fit.weights, &effects);
            normal.take(&block.residuals, &block.jacobian);
        }
        normal
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links;

    #[test]
    fn a_gain_is_held_against_what_it_leaves() {
        // P(F with 2 and 10 degrees > f) = (1 + f / 5)^-5: 6 squares by two numbers, 10 left on 10 degrees, are F = 3.
        assert!((by_chance((6.0, 2.0), 10.0, 10.0) - 1.6_f64.powi(-5)).abs() < 1e-9);
        // Without a rest one degree is assumed: P(F with 2 and 1 > f) = (1 + 2 f)^-1/2.
        assert!((by_chance((6.0, 2.0), 10.0, -3.0) - 1.6_f64.powf(-0.5)).abs() < 1e-9);
    }

    /// A pool of the small arm, whose elbow has a gain that is wrong, and the index of a candidate in it.
    fn pool(lab: &Laboratory) -> Pool {
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        Pool::gather(lab, &fitted, &Progress::unwatched()).unwrap()
    }

    #[test]
    fn regions_and_folds_each_hold_every_equation_once() {
        let lab = two_links(60, "joint_zero(*)", 0.02, 45, |q| [0.0, 0.01 * q[1]]);
        let pool = pool(&lab);
        for parts in [&pool.regions, &pool.folds] {
            assert_eq!(parts.iter().map(|part| part.equations).sum::<usize>(), 180);
            let squares: f64 = parts.iter().map(|part| part.squares).sum();
            assert!((squares / pool.total.squares - 1.0).abs() < 1e-9);
        }
        // Fifteen poses a fold, as they are dealt.
        assert!(pool.folds.len() == FOLDS && pool.folds.iter().all(|fold| fold.equations == 45));
        assert!(pool.regions.len() > 1 && pool.regions.iter().all(|region| region.equations > 0));
    }

    #[test]
    fn the_wrong_gain_alone_is_selected_with_its_size_and_is_enough() {
        let lab = two_links(60, "joint_zero(*)", 0.02, 45, |q| [0.0, 0.01 * q[1]]);
        let pool = pool(&lab);
        let picks = pool.select(&[]);
        let (effects, moved) = pool.effects(&picks, &pool.precisions(&picks));
        assert_eq!((lab.model().label(&effects[0].id).as_str(), moved.len()), ("joint_gain(elbow)", 2));
        assert!((effects[0].values[0] - 0.01).abs() < 2e-4, "{effects:?}");
        assert_eq!(picks.len(), 1, "{effects:?}");
        assert!(pool.needed(picks.clone()).first() == picks.first());
        // With it the rows that are left out are predicted to the noise, without it not.
        let left = |picks: &[Pick]| pool.left_out(&pool.columns(picks), &pool.folds);
        assert!(left(&picks[..1]) < 0.05 * left(&[]), "{} {}", left(&picks[..1]), left(&[]));
        assert_eq!(pool.enough(&picks[..1]), 1);
        assert_eq!(pool.enough(&[]), 0);
        let closed = pool.select(&[picks[0].probe]);
        assert!(!closed.contains(&picks[0]), "what is closed is not taken");
    }

    #[test]
    fn the_variance_of_a_joints_waves_is_the_one_by_which_the_rows_are_likeliest() {
        // Twelve waves whose numbers are drawn with 0.4 mrad; a shoulder without any.
        let mut random = Random::seeded(8);
        let drawn: Vec<[f64; 2]> =
            (0..12).map(|_| [4e-4 * random.normal(), 4e-4 * random.normal()]).collect();
        let off = |q: f64| {
            let waves = drawn.iter().zip(5_u8..);
            waves.map(|([a, b], n)| a * (f64::from(n) * q).sin() + b * (f64::from(n) * q).cos()).sum()
        };
        let lab = two_links(300, "joint_zero(*)", 0.02, 48, |q| [0.0, off(q[1])]);
        let pool = pool(&lab);
        let waves = (0..pool.probes.len()).filter(|probe| {
            let id = &pool.probes[*probe].id;
            id.joint() == Some(1) && id.order.is_some_and(|order| (5.0..17.0).contains(&order))
        });
        let mut picks: Vec<Pick> = waves.map(|probe| Pick { probe }).collect();
        picks.push(Pick {
            probe: pool.probes.iter().position(|probe| probe.id.name == "joint_gain").unwrap(),
        });
        let precisions = pool.precisions(&picks);
        assert_eq!(precisions.len(), 2 + 24 + 1);
        assert!(precisions[..2].iter().chain(&precisions[26..]).all(|one| *one == 0.0), "{precisions:?}");
        // The root of their mean square, for rows of unit variance: here they scatter by 0.02 of the undeclared mm.
        let mean_square = drawn.iter().flatten().map(|one| one * one).sum::<f64>() / 24.0;
        let sd = precisions[2].sqrt().recip();
        let values = pool.values(&pool.columns(&picks), &precisions);
        let left = pool.total.squares - values.dot(&pool.total.gradient.select_rows(&pool.columns(&picks)));
        let one_equation = (left / (900.0 - 29.0)).sqrt();
        assert!((sd * one_equation / mean_square.sqrt() - 1.0).abs() < 0.1, "{sd} {one_equation}");
        // As the model keeps it: of the waves alone.
        let priors = pool.priors(&picks, &precisions);
        assert_eq!(priors.len(), 12);
        assert_eq!(priors[3].id, pool.probes[picks[3].probe].id);
        assert!(priors.iter().all(|prior| prior.sd == [Some(sd), Some(sd)]), "{priors:?}");
        // Where the rows say little the values are drawn to zero, and without a prior they are not.
        let free = pool.values(&pool.columns(&picks), &vec![0.0; precisions.len()]);
        let strong =
            pool.values(&pool.columns(&picks), &precisions.iter().map(|one| one * 1e9).collect::<Vec<_>>());
        assert!(free.rows(2, 24).norm() >= values.rows(2, 24).norm());
        assert!(strong.rows(2, 24).norm() < 1e-3 * free.rows(2, 24).norm());
    }

    #[test]
    fn of_noise_nothing_is_selected_and_what_is_not_needed_goes() {
        let lab = two_links(60, "joint_zero(*)", 0.02, 46, |_| [0.0; 2]);
        let pool = pool(&lab);
        assert!(pool.select(&[]).is_empty());
        assert!(pool.needed(vec![Pick { probe: 0 }, Pick { probe: 3 }]).is_empty());
    }

    #[test]
    fn a_candidate_is_worth_what_schwarz_gives_less_its_numbers_and_its_search() {
        let lab = two_links(60, "joint_zero(*)", 0.02, 45, |q| [0.0, 0.01 * q[1]]);
        let mut pool = pool(&lab);
        let label = |probe: &Probe| lab.model().label(&probe.id);
        let gain = pool.probes.iter().position(|probe| label(probe) == "joint_gain(elbow)").unwrap();
        let beyond = pool.beyond(&(0..pool.free_parameters).collect::<Vec<_>>());
        let worth = pool.worth(gain, &beyond).unwrap();
        // What is left with it in is the noise of 180 readings, less three numbers.
        let fitted = lab
            .fit_with(
                &[AddedEffect { id: pool.probes[gain].id.clone(), values: vec![0.0] }],
                None,
                &Progress::unwatched(),
            )
            .unwrap();
        let expected = 180.0 * (beyond.squares / fitted.fit.normal.squares).ln() - 180.0_f64.ln();
        assert!((worth / expected - 1.0).abs() < 0.02, "{worth} {expected}");
        pool.probes[gain].search_cost += 7.0;
        assert!((worth - pool.worth(gain, &beyond).unwrap() - 7.0).abs() < 1e-9, "a search has its price");
        // With it in, nothing is left for it to explain.
        let taken = pool.columns(&[Pick { probe: gain }]);
        assert!(pool.worth(gain, &pool.beyond(&taken)).is_none());
    }

    /// Two gains in a pool beside one fitted number, with products and gradients as given, on a unit of squares.
    fn by_hand(equations: usize, rank: usize, (with_other, gradient): (f64, [f64; 2])) -> Pool {
        let lab = two_links(20, "joint_zero(*)", 0.02, 45, |_| [0.0; 2]);
        let mut pool = pool(&lab);
        pool.probes.retain(|probe| probe.id.name == "joint_gain");
        assert_eq!(pool.probes.len(), 2);
        pool.probes.iter_mut().for_each(|probe| probe.search_cost = 0.0);
        // Gains of some thousandths, as real arms have them.
        let scale = 1e4;
        let mut total = NormalEquations::zeros(3);
        total.matrix = DMatrix::from_row_slice(
            3,
            3,
            &[1.0, 0.0, 0.0, 0.0, scale, with_other * scale, 0.0, with_other * scale, scale],
        );
        total.gradient = DVector::from_row_slice(&[0.0, 100.0 * gradient[0], 100.0 * gradient[1]]);
        (total.squares, total.equations) = (1.0, equations);
        Pool { ranges: vec![1..2, 2..3], free_parameters: 1, total, rank, ..pool }
    }

    /// Which of the two are selected.
    fn selected(pool: &Pool) -> Vec<usize> {
        pool.select(&[]).iter().map(|pick| pick.probe).collect()
    }

    #[test]
    fn a_candidate_is_selected_where_chance_hardly_does_as_much() {
        // With two degrees left a gain of g^2 of a unit has P = 1 - g; of two candidates each may have half of 0.003.
        let with = |g: f64, rank: usize| selected(&by_hand(30, rank, (0.0, [g, 0.0])));
        assert_eq!(with(1.0 - 0.0014, 27), [0]);
        assert_eq!(with(1.0 - 0.0016, 27), [0_usize; 0]);
        assert_eq!(with(1.0 - 0.0016, 26), [0], "three degrees");
        // The second is held against what the first leaves, on a degree less.
        let second = |g: f64| selected(&by_hand(30, 26, (0.0, [0.999_f64.sqrt(), 0.001_f64.sqrt() * g])));
        assert_eq!(second(1.0 - 0.0014), [0, 1]);
        assert_eq!(second(1.0 - 0.0016), [0]);
    }

    #[test]
    fn a_candidate_is_selected_where_it_betters_schwarz_by_more_than_a_tie() {
        let mut pool = by_hand(100, 1, (0.0, [0.0, 0.5_f64.sqrt()]));
        let price = 100.0 * 2.0_f64.ln() - 100.0_f64.ln() - TIE_BIC;
        pool.probes[1].search_cost = price - 0.01;
        assert_eq!(selected(&pool), [1]);
        pool.probes[1].search_cost = price + 0.01;
        assert_eq!(selected(&pool), [0_usize; 0]);
    }

    #[test]
    fn the_better_candidate_is_taken_first_and_what_the_other_shares_with_it_counts_once() {
        assert_eq!(selected(&by_hand(1000, 1, (0.0, [0.5, 0.6]))), [1, 0]);
        // Alike by 0.6: all that the second shows is the first's.
        assert_eq!(selected(&by_hand(1000, 1, (0.6, [0.8, 0.48]))), [0]);
        assert_eq!(selected(&by_hand(1000, 1, (0.6, [0.8, 0.48 + 0.3]))), [0, 1]);
        assert_eq!(selected(&by_hand(1000, 1, (0.6, [0.8, 0.48 - 0.3]))), [0, 1]);
        // A gain of seven percent is no error of a real arm.
        assert_eq!(selected(&by_hand(1000, 1, (0.0, [7.0, 0.6]))), [1]);
    }

    /// Which of some picks are needed.
    fn needed(pool: &Pool, picks: &[usize]) -> Vec<usize> {
        let picks = picks.iter().map(|probe| Pick { probe: *probe }).collect();
        pool.needed(picks).iter().map(|pick| pick.probe).collect()
    }

    #[test]
    fn a_pick_is_needed_where_chance_hardly_does_as_much_beside_the_others() {
        // Four equations less two numbers leave two degrees: as for a selection.
        let alone = |g: f64| needed(&by_hand(4, 1, (0.0, [g, 0.0])), &[0]);
        assert_eq!(alone(1.0 - 0.0014), [0]);
        assert_eq!(alone(1.0 - 0.0016), [0_usize; 0]);
        // Five less three leave two as well: the second takes g^2 of what the first leaves.
        let beside = |g: f64| needed(&by_hand(5, 1, (0.0, [0.9_f64.sqrt(), 0.1_f64.sqrt() * g])), &[0, 1]);
        assert_eq!(beside(1.0 - 0.0014), [0, 1]);
        assert!(!beside(1.0 - 0.0016).contains(&1));
        // A gain of seven percent is none of a real arm, however clear.
        let mut scattered = by_hand(1000, 1, (0.0, [7.0, 0.5]));
        scattered.total.squares = 100.0;
        assert!(!needed(&scattered, &[0, 1]).contains(&0));
    }

    #[test]
    fn of_two_picks_that_do_nearly_the_same_the_weaker_alone_goes() {
        let c = 0.999;
        assert_eq!(needed(&by_hand(1000, 1, (c, [0.5, 0.5 * c])), &[0, 1]), [0]);
        assert_eq!(needed(&by_hand(1000, 1, (c, [0.5 * c, 0.5])), &[0, 1]), [1]);
        assert_eq!(needed(&by_hand(1000, 1, (0.0, [0.5, 0.5])), &[0, 1]), [0, 1]);
    }

    #[test]
    fn a_pick_is_rivalled_by_what_is_worth_as_much_within_a_tie() {
        let rivalled = |cost: f64| {
            let mut pool = by_hand(1000, 1, (0.0, [0.5, 0.5]));
            pool.probes[1].search_cost = cost;
            pool.rivals(&[Pick { probe: 0 }], 0).unwrap()
        };
        assert_eq!(rivalled(5.9), [1]);
        assert!(rivalled(6.1).is_empty());
    }
}
