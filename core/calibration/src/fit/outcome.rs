//! A fit from start to finish: first guess, descent, weights, rank, covariance, and whether it really arrived.

use nalgebra::DMatrix;
use thiserror::Error;

use super::FitOptions;
use super::align::align;
use super::doubt::{FitDoubt, Prior, out_of_range, range_doubts, undetermined, worse_than_plain};
use super::gauge::Gauge;
use super::residual_model::ResidualModel;
use super::robust::Distances;
use super::state::{FreeParameter, State};
use super::tangent::Tangent;
use plumb_estimation::INDISTINCT;
use plumb_estimation::NormalEquations;
use plumb_estimation::RankRevealingCholesky;
use plumb_estimation::{
    CAREFUL, CLOSE, Descent, NEAR, Settings, descend, descend_from, full_step, huber_variance,
};
use plumb_estimation::{Cancelled, Problem, Progress};

/// Whether a fit arrived at its optimum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Steps taken in all.
    pub steps: usize,
    /// RMS reached, in sigmas.
    pub reached: f64,
    /// RMS of the linear problem at that place: what one more full step promises.
    pub promised: f64,
    /// Whether the two agree.
    pub arrived: bool,
}

/// Fraction of the RMS that another step may promise after a single one: weights of rows change where the scatter does by more than that.
const LEFT_TO_GO: f64 = 0.1;

impl Convergence {
    /// Whether another step would leave about as much.
    pub(super) fn is_near(&self) -> bool {
        // Written so that what is not a number is not near.
        self.promised >= (1.0 - LEFT_TO_GO) * self.reached
    }
}

/// What a fit found.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Values of everything.
    pub state: State,
    /// Residuals of all equations of the table (also of rows that were held out), mm and rad.
    pub residuals: Vec<f64>,
    /// Weight of each row, 1 for those inside the others' scatter.
    pub weights: Vec<f64>,
    /// Rows that were fitted.
    pub rows: Vec<usize>,
    /// Scatter of the residuals in declared sigmas (in mm or rad where none was declared).
    pub scale: f64,
    /// Freedoms that were held.
    pub gauges: Vec<Gauge>,
    /// Free parameters, by their indices, that did not move to the end: what the rows do not determine, or hardly.
    pub held: Vec<usize>,
    /// Covariance of the free parameters, internal units; zero for held ones.
    pub covariance: DMatrix<f64>,
    /// Whether it arrived.
    pub convergence: Convergence,
    /// Variance of one equation in the weighted metric, declared sigmas squared.
    pub variance: f64,
    /// The normal equations of the fit.
    pub normal: NormalEquations,
    /// Their factor.
    pub factor: RankRevealingCholesky,
    /// What went wrong on the way, and what was done about it.
    pub doubts: Vec<FitDoubt>,
}

/// Why nothing could be fitted.
#[derive(Debug, Error, PartialEq)]
pub enum FitError {
    /// No rows to fit.
    #[error("{table}: no rows are left to fit; lock fewer away (`--holdout none`) or measure more")]
    NoRows {
        /// The table.
        table: String,
    },
    /// Fewer numbers than unknowns.
    #[error(
        "{table}: {equations} measured numbers cannot settle {parameters} free ones; measure more poses, or free fewer (`--free none`)"
    )]
    TooFewRows {
        /// The table.
        table: String,
        /// Numbers measured.
        equations: usize,
        /// Independent unknowns.
        parameters: usize,
    },
    /// A single row.
    #[error("{table}: line {line}: only one row is left to fit; measure more poses")]
    OneRow {
        /// The table.
        table: String,
        /// Line of the file.
        line: u32,
    },
    /// Every row has the same pose.
    #[error("{table}: all {rows} rows have the same pose; a fit needs different ones")]
    OnePose {
        /// The table.
        table: String,
        /// Rows.
        rows: usize,
    },
    /// Numbers left the finite.
    #[error("the fit left the finite numbers; check units and the starting values of base and targets")]
    Diverged,
    /// It was asked to end.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Fit {
    /// Independent parameters.
    pub fn rank(&self) -> usize {
        self.factor.rank()
    }
}

pub(super) fn fit(
    problem: &ResidualModel<'_>,
    start: &State,
    mask: &[bool],
    options: FitOptions,
    progress: &Progress,
) -> Result<Fit, FitError> {
    let used = mask.iter().enumerate().filter(|(_, used)| **used).map(|(row, _)| row);
    // A row in which nothing was measured says nothing, and would count as a pose.
    let rows: Vec<usize> = used.filter(|row| !problem.observations.range(*row).is_empty()).collect();
    check(problem, &rows)?;
    let start = align(problem, start, &rows, progress)?;
    let ones = vec![1.0; problem.observations.rows()];
    fit_from(problem, (&start, CAREFUL), (&rows, ones), &[], options, progress)
}

/// Where a fit begins.
struct Start {
    state: State,
    /// The normal equations of the rows there, at the weights to begin with and without plausible ranges.
    normal: NormalEquations,
    /// Damping of the first step: by how near the minimum may be.
    damping: f64,
}

impl Start {
    fn at(
        problem: &ResidualModel<'_>,
        (state, damping): (State, f64),
        (rows, weights): (&[usize], &[f64]),
    ) -> Self {
        let normal = problem.normal(&state, rows, weights, &[]);
        Self { state, normal, damping }
    }

    fn factor(&self) -> RankRevealingCholesky {
        RankRevealingCholesky::new(&self.normal.matrix)
    }
}

/// Fits again from a near place; the parameters in `holding` do not move.
pub(super) fn refit(
    problem: &ResidualModel<'_>,
    start: &State,
    rows_and_weights: (&[usize], Vec<f64>),
    holding: &[usize],
    options: FitOptions,
    progress: &Progress,
) -> Result<Fit, FitError> {
    fit_from(problem, (start, CLOSE), rows_and_weights, holding, options, progress)
}

/// Fits from a place with this damping of the first step. Where the rows hardly determine a number of the geometry, or it leaves the range that a machine can have, the ranges count as weak prior
/// knowledge: where such a number runs to is no result.
fn fit_from(
    problem: &ResidualModel<'_>,
    (start, damping): (&State, f64),
    (rows, weights): (&[usize], Vec<f64>),
    holding: &[usize],
    options: FitOptions,
    progress: &Progress,
) -> Result<Fit, FitError> {
    let again = |from: &Start, weights: Vec<f64>, prior: Option<&Prior>| {
        descend_robustly(problem, from, (rows, weights), (options, prior, holding), progress)
    };
    let mut start = Start::at(problem, (start.clone(), damping), (rows, &weights));
    let factor = start.factor();
    let start_scale = Distances::of(problem, &problem.residuals(&start.state)).scale(rows, factor.rank());
    // What the rows cannot determine at all stays where the model file has it, as ever.
    let mut prior = Prior { variance: start_scale * start_scale, spared: factor.dependent.clone() };
    let mut far = undetermined(problem, &factor, start_scale);
    if !far.is_empty() {
        // From far off the scatter is no measure: they are asked again where a bounded fit arrives.
        let bounded = again(&start, weights.clone(), Some(&prior))?;
        start = Start::at(problem, (bounded.state.clone(), CLOSE), (rows, &weights));
        far = undetermined(problem, &start.factor(), bounded.scale);
        if !far.is_empty() && prior.is_weighed_as_by(bounded.scale) {
            return Ok(with_range_doubts(problem, &far, bounded));
        }
        prior.variance = bounded.scale * bounded.scale;
    }
    if far.is_empty() {
        let free = again(&start, weights.clone(), None)?;
        far = out_of_range(problem, &free.state);
        if far.is_empty() {
            return Ok(free);
        }
        // Where a fit has run away to is neither a place to begin nor a scatter to go by.
        prior.variance = prior.variance.min(free.scale * free.scale);
    }
    let mut fit = again(&start, weights, Some(&prior))?;
    if !prior.is_weighed_as_by(fit.scale) {
        prior.variance = fit.scale * fit.scale;
        start = Start::at(problem, (fit.state, CLOSE), (rows, &fit.weights));
        fit = again(&start, fit.weights, Some(&prior))?;
    }
    Ok(with_range_doubts(problem, &far, fit))
}

/// A fit, with what is to be said of numbers that were found far out.
fn with_range_doubts(problem: &ResidualModel<'_>, far: &[(usize, f64)], mut fit: Fit) -> Fit {
    fit.doubts.extend(range_doubts(problem, far, &fit.state));
    fit
}

/// Damping of a single robust step, relative to the scales of the numbers (Marquardt 1963). Along what the rows determine by less than a three-hundredth (its root) of what they
/// determine one number by, an undamped step leads as far as the noise says, and far off no surroundings are flat.
const ONE_STEP_DAMPING: f64 = 1e-5;

/// Where one robust step on the tangent at a start leads; nothing where that leaves more than staying, where the table is too large for it, or the rows are too few.
pub(super) fn one_step(
    problem: &ResidualModel<'_>,
    start: &State,
    rows: &[usize],
    weights: Vec<f64>,
) -> Result<Option<Fit>, FitError> {
    let Some(tangent) = Tangent::at(problem, start, rows, None) else { return Ok(None) };
    let normal = tangent.normal(&weights);
    let factor = RankRevealingCholesky::new(&normal.matrix);
    if factor.rank() >= normal.equations {
        return Ok(None);
    }
    let damped = tangent.damped(&(normal.matrix.diagonal() * ONE_STEP_DAMPING));
    let (step, weights) = damped.settle(weights, &factor.dependent, factor.rank());
    let state = start.stepped(problem.free_parameters(), step.as_slice());
    if !state.is_finite() {
        return Ok(None);
    }
    let normal = problem.normal(&state, rows, &weights, &[]);
    // Written so that what is not a number is no better.
    let is_better = normal.squares <= damped.squares(&weights);
    if !is_better {
        return Ok(None);
    }
    let descent = Descent { state, normal, steps: 1, converged: true };
    let fit = finish(problem, descent, rows.to_vec(), weights, 1)?;
    Ok(Some(Fit { held: factor.dependent, ..fit }))
}

/// Share of a number's effect on the rows (squared) that the numbers before it must leave for it to move from the first step on: a thousandth of its length. Of axes that are
/// parallel to a milliradian, as machines are built, the offsets and the places of the common normals leave less (Hayati and Mirmirani 1985, J. Robotic Systems 2, 397-413).
const HARDLY_DISTINCT: f64 = 1e-6;

/// Rounds of weighing and descending at most.
const WEIGHINGS: usize = 20;

/// Change of a weight below which the weights count as settled: the constant that cuts them is a convention, known no better (Huber 1981, section 4.5).
const SETTLED: f64 = 1e-2;

/// Fraction of the sum of squares that one more full step may promise where a fit has arrived: a thousandth changes no standard error visibly.
const LEFT_UNDONE: f64 = 1e-3;

/// Rounds in which numbers that were held may be let go because the place reached shows them.
const ROUNDS: usize = 4;

/// Gain, in one measurement's variances, that every number let go must promise on average: what an information criterion asks of a parameter (Akaike 1974).
const RELEASED: f64 = 2.0;

/// The numbers of which those before them leave no more than a fraction, and the spared ones; ascending.
fn dependent(normal: &NormalEquations, fraction: f64, spared: &[usize]) -> Vec<usize> {
    let mut dependent = RankRevealingCholesky::leaving_out(&normal.matrix, fraction).dependent;
    dependent.extend(spared);
    dependent.sort_unstable();
    dependent.dedup();
    dependent
}

/// Of the numbers held at a start those that are held to the end: the spared ones, and all that are no effect's. Where a target sits that cannot be distinguished from where the base is, what an
/// effect does to both is no measure of it: it would go metres away for the sake of an effect that comes to nothing there.
pub(super) fn kept(problem: &ResidualModel<'_>, held: &[usize], spared: &[usize]) -> Vec<usize> {
    held.iter().filter(|number| !is_of_an_effect(problem, **number)).chain(spared).copied().collect()
}

fn is_of_an_effect(problem: &ResidualModel<'_>, number: usize) -> bool {
    matches!(problem.free_parameters().get(number), Some(FreeParameter::Effect(..)))
}

/// One fit, with plausible ranges as prior knowledge or without.
fn descend_robustly(
    problem: &ResidualModel<'_>,
    start: &Start,
    (rows, weights): (&[usize], Vec<f64>),
    (options, prior, holding): (FitOptions, Option<&Prior>, &[usize]),
    progress: &Progress,
) -> Result<Fit, FitError> {
    // What cannot be distinguished from the rest stays where it is from the first step on. Let go, it would drift, and where it drifts
    // to other numbers look alike.
    let mut first = start.normal.clone();
    if let Some(prior) = prior {
        prior.add(problem, &start.state, &mut first);
    }
    let parameters = RankRevealingCholesky::new(&first.matrix).rank();
    // With as many numbers as equations everything fits, and nothing is known of the scatter.
    if parameters >= first.equations {
        let table = problem.table.source.clone();
        return Err(FitError::TooFewRows { table, equations: first.equations, parameters });
    }
    let mut spared = prior.map_or_else(Vec::new, |prior| prior.spared.clone());
    spared.extend(holding);
    // Nor does what hardly can be distinguished move until that is seen to help: offsets along axes that are nearly parallel would go far for next to nothing.
    let mut held = dependent(&first, HARDLY_DISTINCT, &spared);
    let first = (start.state.clone(), first);
    let settings = Settings { steps: options.steps, damping: start.damping };
    let mut descent =
        descend_from(&problem.over(rows, &weights).knowing(prior), first, &held, settings, progress)?;
    let mut steps = descent.steps;
    for _ in 1..ROUNDS {
        // Numbers that look alike at the start (offsets along axes that should be parallel) may matter at the end.
        let normal = &descent.normal;
        let fewer = dependent(normal, INDISTINCT, &kept(problem, &held, &spared));
        let gain = normal.gradient.dot(&full_step(normal, &fewer));
        let released = held.iter().filter(|number| !fewer.contains(number)).count();
        let variance = normal.squares / normal.equations.max(1) as f64;
        if released == 0 || gain <= RELEASED * released as f64 * variance {
            break;
        }
        held = fewer;
        let reached = (descent.state, descent.normal);
        let close = Settings { steps: options.steps, damping: CLOSE };
        descent =
            descend_from(&problem.over(rows, &weights).knowing(prior), reached, &held, close, progress)?;
        steps += descent.steps;
    }
    // From the plain minimum on: robust weights from a far start would throw out whatever the start misses.
    let mut robust = Weighed { descent, weights, steps, doubts: Vec::new() };
    if options.robust {
        robust.weigh(problem, rows, (options, prior), (&held, parameters), progress)?;
    }
    let Weighed { descent, weights, steps, doubts } = robust;
    Ok(Fit { doubts, held, ..finish(problem, descent, rows.to_vec(), weights, steps)? })
}

/// A descent with the weights of its rows.
struct Weighed {
    descent: Descent<State>,
    weights: Vec<f64>,
    steps: usize,
    doubts: Vec<FitDoubt>,
}

impl Weighed {
    /// Weighs far rows down and descends again until the weights stay; back to where it began if that misses the trusted rows by more.
    fn weigh(
        &mut self,
        problem: &ResidualModel<'_>,
        rows: &[usize],
        (options, prior): (FitOptions, Option<&Prior>),
        (held, parameters): (&[usize], usize),
        progress: &Progress,
    ) -> Result<(), FitError> {
        let plain = (self.descent.clone(), self.weights.clone());
        for _ in 0..WEIGHINGS {
            let residuals = problem.residuals(&self.descent.state);
            let distances = Distances::of(problem, &residuals);
            let fresh = distances.weights(distances.scale(rows, parameters));
            let moved = rows.iter().map(|row| difference(&self.weights, &fresh, *row)).fold(0.0, f64::max);
            // The weights that are returned are those of the last descent: its normal equations, from which rows are taken out again, are of these weights.
            if moved < SETTLED {
                break;
            }
            self.weights = fresh;
            let settled = self.settled(problem, rows, prior, (held, parameters));
            let near = Settings { steps: options.steps, damping: NEAR };
            self.descent = match settled {
                Some((reached, weights)) => {
                    self.weights = weights;
                    let weighted = problem.over(rows, &self.weights).knowing(prior);
                    descend_from(&weighted, reached, held, near, progress)?
                }
                None => {
                    let weighted = problem.over(rows, &self.weights).knowing(prior);
                    descend(&weighted, &self.descent.state, held, near, progress)?
                }
            };
            self.steps += self.descent.steps;
        }
        let reached = (&self.descent.state, self.weights.as_slice());
        if let Some(doubt) = worse_than_plain(problem, reached, &plain.0.state, rows) {
            (self.descent, self.weights) = plain;
            self.doubts.push(doubt);
        }
        Ok(())
    }
}

impl Weighed {
    /// Where the weights settle if the surroundings are flat, and these weights; nothing where that leaves more than staying: the surroundings are not flat then,
    /// and the weights of a place that no fit reaches would come and go for ever.
    fn settled(
        &self,
        problem: &ResidualModel<'_>,
        rows: &[usize],
        prior: Option<&Prior>,
        (held, parameters): (&[usize], usize),
    ) -> Option<((State, NormalEquations), Vec<f64>)> {
        let here = &self.descent.state;
        let tangent = Tangent::at(problem, here, rows, prior)?;
        let (step, weights) = tangent.settle(self.weights.clone(), held, parameters);
        let moved = here.stepped(problem.free_parameters(), step.as_slice());
        if !moved.is_finite() {
            return None;
        }
        let normal = problem.over(rows, &weights).knowing(prior).normal_equations(&moved);
        (normal.squares <= tangent.squares(&weights)).then_some(((moved, normal), weights))
    }
}

fn difference(left: &[f64], right: &[f64], row: usize) -> f64 {
    let [left, right] = [left, right].map(|values| values.get(row).copied().unwrap_or(1.0));
    (left - right).abs()
}

fn check(problem: &ResidualModel<'_>, rows: &[usize]) -> Result<(), FitError> {
    let table = problem.table.source.clone();
    let Some(first) = rows.first() else { return Err(FitError::NoRows { table }) };
    if rows.len() == 1 {
        let line = problem.table.lines.get(*first).copied().unwrap_or(0);
        return Err(FitError::OneRow { table, line });
    }
    if rows.iter().all(|row| problem.table.q_of(*row) == problem.table.q_of(*first)) {
        return Err(FitError::OnePose { table, rows: rows.len() });
    }
    Ok(())
}

fn finish(
    problem: &ResidualModel<'_>,
    descent: Descent<State>,
    rows: Vec<usize>,
    weights: Vec<f64>,
    steps: usize,
) -> Result<Fit, FitError> {
    let Descent { state, normal, converged, .. } = descent;
    if !state.is_finite() || !normal.squares.is_finite() {
        return Err(FitError::Diverged);
    }
    let residuals = problem.residuals(&state);
    let factor = RankRevealingCholesky::new(&normal.matrix);
    let equations = rows.iter().flat_map(|row| {
        let weight = weights.get(*row).copied().unwrap_or(1.0);
        let own = residuals.get(problem.observations.range(*row)).unwrap_or(&[]);
        let equations = own.iter().zip(problem.observations.of_row(*row));
        equations.map(move |(residual, equation)| (weight, residual / equation.sigma))
    });
    let scatter = huber_variance(equations, factor.rank());
    // A scatter smaller than what stripes are known by is chance.
    let variance = scatter.max(problem.least_variance());
    // Of the independent numbers; rows and columns of held ones are zero.
    let covariance = factor.inverse() * variance;
    let gauges = problem.gauges(&normal.matrix, &factor);
    // What one more step would take away of the sum of squares, were the problem linear: g' N^-1 g.
    let gain = normal.gradient.dot(&factor.solve(&normal.gradient)).max(0.0);
    let equations = normal.equations.max(1) as f64;
    let reached = (normal.squares / equations).sqrt();
    let promised = ((normal.squares - gain).max(0.0) / equations).sqrt();
    // Where a descent ran out of steps, what it left undone may still be nothing beside the noise.
    let arrived = converged || gain <= LEFT_UNDONE * normal.squares;
    let distances = Distances::of(problem, &residuals);
    let scale = distances.scale(&rows, factor.rank());
    Ok(Fit {
        state,
        residuals,
        weights,
        rows,
        scale,
        gauges,
        held: Vec::new(),
        covariance,
        convergence: Convergence { steps, reached, promised, arrived },
        variance,
        normal,
        factor,
        doubts: Vec::new(),
    })
}
