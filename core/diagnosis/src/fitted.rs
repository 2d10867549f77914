//! A residual model with its fit, and refits of it with more effects in.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::cross_validation::pose_groups;
use crate::laboratory::{Laboratory, LaboratoryError, point_squares};
use crate::score_test::{Probe, Score};
use crate::thresholds::INLIER_QUANTILE;
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::{EffectId, kind};
use plumb_calibration::fit::{Distances, Fit, FitOptions, ResidualModel, State};
use plumb_estimation::{Progress, chi_squared_quantile, huber_constant};

/// A residual model with its fit.
pub(crate) struct Fitted<'a> {
    pub(crate) problem: ResidualModel<'a>,
    pub(crate) fit: Fit,
}

impl Fitted<'_> {
    /// Numbers that the rows determine once `freedom` more are fitted, counted as the linear model counts them. What a refit itself counts depends on its way: one that
    /// begins near its end frees weakly determined numbers that a fit from afar holds, and each of them is `ln n` of the criterion by which candidates are compared.
    pub(crate) fn parameters_with(&self, freedom: usize) -> f64 {
        (self.fit.rank() + freedom) as f64
    }

    /// The same of a refit with one effect more. An event makes known besides what does not differ while nothing was re-set, which is counted at the refit.
    pub(crate) fn parameters_in(&self, refit: &Fitted<'_>, id: &EffectId, freedom: usize) -> f64 {
        match kind(&id.name).is_some_and(|kind| kind.is_event) {
            true => refit.fit.rank() as f64,
            false => self.parameters_with(freedom),
        }
    }

    /// Huber's loss over the fitted rows, squared sigmas, for a scatter of `scale` sigmas.
    pub(crate) fn loss(&self, scale: f64) -> f64 {
        let distances = Distances::of(&self.problem, &self.fit.residuals);
        let fitted = self.fit.rows.iter().filter_map(|row| distances.rows.get(*row));
        let losses = fitted.map(|(norm, equations)| {
            let edge = scale * huber_constant(*equations);
            // Huber's function (Huber 1964; of a regression, Huber 1981, section 7.3), here of a row's whole length: a square inside, its tangent outside.
            if *norm <= edge { norm * norm } else { 2.0 * edge * norm - edge * edge }
        });
        losses.sum()
    }

    /// Residuals of the fitted rows, in sigmas: rows by their equations.
    pub(crate) fn row_residuals(&self) -> Vec<Vec<f64>> {
        let (observations, residuals) = (self.problem.observations, &self.fit.residuals);
        let rows = self.fit.rows.iter().map(|row| {
            let own = residuals.get(observations.range(*row)).unwrap_or(&[]);
            let equations = own.iter().zip(observations.of_row(*row));
            equations.map(|(residual, equation)| residual / equation.sigma).collect()
        });
        rows.collect()
    }

    /// Squared errors of the fitted rows, in sigmas.
    #[cfg(test)]
    fn row_squares(&self) -> Vec<f64> {
        self.row_residuals().iter().map(|row| row.iter().map(|one| one * one).sum()).collect()
    }

    /// Fitted rows that are not outliers.
    pub(crate) fn inliers(&self) -> Vec<usize> {
        let distances = Distances::of(&self.problem, &self.fit.residuals);
        // A quantile costs more than a row, and rows have few different numbers of equations.
        let mut edges: BTreeMap<usize, f64> = BTreeMap::new();
        let mut inliers = self.fit.rows.clone();
        inliers.retain(|row| {
            distances.rows.get(*row).is_some_and(|(norm, equations)| {
                let edge = edges.entry(*equations).or_insert_with(|| {
                    chi_squared_quantile(INLIER_QUANTILE, (*equations).max(1) as f64).sqrt()
                });
                // A fit through every row leaves no scatter, and rows without any error.
                *norm <= self.fit.scale * *edge || *norm == 0.0
            })
        });
        inliers
    }
}

/// By how much the squared errors of rows that were not fitted fall from one fit to another of the same table, summed over the rows of each pose, mm2. Replicates
/// share what a model does wrong at their pose, so that poses, not rows, are independent.
pub(crate) fn reductions_by_pose((before, after): (&Fitted<'_>, &Fitted<'_>), rows: &[usize]) -> Vec<f64> {
    let [old, new] = [before, after].map(|fitted| {
        let residuals = fitted.problem.residuals_apart(&fitted.fit.state, rows, &fitted.fit.rows);
        let all = 0..fitted.problem.table.len();
        let squares = all.map(|row| point_squares(&fitted.problem, &residuals, row).into_iter().sum());
        squares.collect::<Vec<f64>>()
    });
    let poses = pose_groups(before.problem.table, rows);
    let reductions = poses.iter().map(|rows| rows.iter().map(|row| old[*row] - new[*row]).sum());
    reductions.collect()
}

/// An earlier fit's state for another problem: effects both share keep their values, the others start where they were
/// put.
fn start_near(problem: &ResidualModel<'_>, near: &Fitted<'_>) -> State {
    let mut start = near.fit.state.clone();
    start.effects = problem.start().effects;
    for (index, part) in problem.parts.iter().enumerate() {
        let same = near.problem.parts.iter().position(|other| other.id == part.id);
        let known = same.and_then(|same| near.fit.state.effects.get(same));
        if let (Some(entry), Some(known)) = (start.effects.get_mut(index), known) {
            entry.clone_from(known);
        }
    }
    start
}

/// A start moved to where a score expects the fitted parameters beside the last effect: what the two problems have in common comes
/// first in both.
fn beside(problem: &ResidualModel<'_>, start: &State, beside: &[f64]) -> State {
    let known = beside.len().min(problem.free_parameters().len());
    let moved = start.stepped(problem.free_parameters().get(..known).unwrap_or(&[]), beside);
    // Derivatives at a fold of the arm can promise a step to nowhere.
    if moved.is_finite() { moved } else { start.clone() }
}

/// Times that a step which makes the fit worse is halved. A thousandth of the step follows the derivatives wherever these mean anything.
const HALVINGS: i32 = 10;

/// Where a fit with more effects than an earlier one begins: at the end of the step that a score expects, or of that part of it (a half, a quarter, ...) with which the
/// rows fit better than at the earlier fit. Where rows hardly determine a number the whole step may lead far away, and a descent from there may end in another valley
/// (a Gauss-Newton step with halving: Björck 1996, Numerical Methods for Least Squares Problems, section 9.2).
fn start_toward(
    problem: &ResidualModel<'_>,
    near: &Fitted<'_>,
    moved: &[f64],
    (rows, weights): (&[usize], &[f64]),
) -> State {
    let whole = start_near(problem, near);
    let mut start = beside(problem, &whole, moved);
    let stay = part_of(problem, near, (&whole, moved), 0.0);
    let squares = problem.squares(&stay, rows, weights);
    for halvings in 1..=HALVINGS {
        // Written so that what is not a number is no better.
        if problem.squares(&start, rows, weights) < squares {
            return start;
        }
        start = part_of(problem, near, (&whole, moved), 0.5_f64.powi(halvings));
    }
    stay
}

/// A fraction of the step from an earlier fit to `whole`, with what was fitted then moved by `moved`: effects that the earlier fit did not have begin at nothing.
fn part_of(
    problem: &ResidualModel<'_>,
    near: &Fitted<'_>,
    (whole, moved): (&State, &[f64]),
    fraction: f64,
) -> State {
    let mut start = whole.clone();
    for (values, part) in start.effects.iter_mut().zip(&problem.parts) {
        if !near.problem.parts.iter().any(|known| known.id == part.id) {
            values.iter_mut().for_each(|value| *value *= fraction);
        }
    }
    let fractions: Vec<f64> = moved.iter().map(|one| fraction * one).collect();
    beside(problem, &start, &fractions)
}

impl Laboratory {
    /// The model with more effects than an earlier fit has, and the state that is expected there: the effects at the values they
    /// are put in with, and what was fitted earlier moved so far.
    pub(crate) fn expected<'a>(
        &'a self,
        more: &[AddedEffect],
        near: &Fitted<'_>,
        moved: &[f64],
    ) -> Result<(ResidualModel<'a>, State), LaboratoryError> {
        let problem = self.problem(more)?;
        let start = beside(&problem, &start_near(&problem, near), moved);
        Ok((problem, start))
    }

    /// Fits the model with more effects than an earlier fit has to the same rows with the same weights, from where everything is expected, or from as far toward it
    /// as the rows fit better.
    pub(crate) fn fit_beside<'a>(
        &'a self,
        more: &[AddedEffect],
        near: &Fitted<'_>,
        moved: &[f64],
        options: FitOptions,
        progress: &Progress,
    ) -> Result<Fitted<'a>, LaboratoryError> {
        let rows = (near.fit.rows.as_slice(), near.fit.weights.as_slice());
        self.fit_toward(more, near, (moved, &[]), rows, options, progress)
    }

    /// The same to compare the last effect with none, and with others in its place: what the earlier fit held stays held, as numbers are counted for it
    /// ([`Fitted::parameters_with`]). Let go with one candidate and not with another, weakly determined numbers would be a difference that is no effect's, and a
    /// descent along such a valley takes a hundred steps. An event makes known what does not differ while nothing was re-set: with it nothing is held.
    pub(crate) fn fit_to_compare<'a>(
        &'a self,
        more: &[AddedEffect],
        near: &Fitted<'_>,
        moved: &[f64],
        options: FitOptions,
        progress: &Progress,
    ) -> Result<Fitted<'a>, LaboratoryError> {
        let is_event = more.last().and_then(|last| kind(&last.id.name)).is_some_and(|kind| kind.is_event);
        let holding = if is_event { &[] } else { near.fit.held.as_slice() };
        let rows = (near.fit.rows.as_slice(), near.fit.weights.as_slice());
        self.fit_toward(more, near, (moved, holding), rows, options, progress)
    }

    /// Fits the model with more effects than an earlier fit has to some rows, from where that fit's numbers moved so far are, those in `holding` excepted, which stay.
    fn fit_toward<'a>(
        &'a self,
        more: &[AddedEffect],
        near: &Fitted<'_>,
        (moved, holding): (&[f64], &[usize]),
        (rows, weights): (&[usize], &[f64]),
        options: FitOptions,
        progress: &Progress,
    ) -> Result<Fitted<'a>, LaboratoryError> {
        let problem = self.problem(more)?.after(&near.problem);
        let moved = moved.iter().enumerate();
        let moved: Vec<f64> =
            moved.map(|(number, by)| if holding.contains(&number) { 0.0 } else { *by }).collect();
        let start = start_toward(&problem, near, &moved, (rows, weights));
        let fit = problem.refit_holding(&start, (rows, weights), holding, options, progress)?;
        Ok(Fitted { problem, fit })
    }

    /// Fits the model with `more` effects to some rows with these weights, starting from an earlier fit's state, with as much of the effects' values as makes the rows
    /// fit better.
    pub(crate) fn fit_near<'a>(
        &'a self,
        more: &[AddedEffect],
        near: &Fitted<'_>,
        rows_and_weights: (&[usize], &[f64]),
        options: FitOptions,
        progress: &Progress,
    ) -> Result<Fitted<'a>, LaboratoryError> {
        // Nothing is known of how far the rest moves beside them: the values alone may miss by more than nothing does.
        self.fit_toward(more, near, (&[], &[]), rows_and_weights, options, progress)
    }

    /// Fits the model with `more` effects and a probe, robustly, to all rows that are not held out, by one step from where its score expects the fit: which rows
    /// lie outside the scatter does not depend on the last digits.
    pub(crate) fn fit_probe<'a>(
        &'a self,
        more: &[AddedEffect],
        (probe, score): (&Probe, &Score),
        near: &Fitted<'_>,
        progress: &Progress,
    ) -> Result<Fitted<'a>, LaboratoryError> {
        let mut problem = self.problem(more)?;
        problem.admit(probe.id.clone(), Arc::clone(&probe.effect), score.values.clone());
        let problem = problem.after(&near.problem);
        let (rows, ones) = (self.measured_rows(), vec![1.0; self.table().len()]);
        let start = start_toward(&problem, near, &score.beside, (&rows, &ones));
        let fit = problem.refit_by_one_step(&start, &rows, &ones, self.options().fit, progress)?;
        Ok(Fitted { problem, fit })
    }

    /// Fits the model with `more` effects, starting from an earlier fit's state where there is one.
    pub(crate) fn fit_with<'a>(
        &'a self,
        more: &[AddedEffect],
        near: Option<&Fitted<'_>>,
        progress: &Progress,
    ) -> Result<Fitted<'a>, LaboratoryError> {
        match near {
            // Rows that an earlier stage left out come back: what is an outlier is judged anew.
            Some(near) => {
                let ones = vec![1.0; self.table().len()];
                self.fit_near(more, near, (&self.measured_rows(), &ones), self.options().fit, progress)
            }
            None => {
                let problem = self.problem(more)?;
                let fit = self.fit(&problem, progress)?;
                Ok(Fitted { problem, fit })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{two_links, two_links_with};
    use plumb_calibration::effect::{EffectId, Site};

    #[test]
    fn a_refit_counts_the_numbers_of_the_fit_before_and_its_own_and_one_with_an_event_what_it_determines() {
        let lab = two_links(40, "joint_zero(*)", 0.05, 31, |_| [0.0; 2]);
        let added = |name: &str, joint: usize| AddedEffect {
            id: EffectId::at(name, Site::Joint(joint)),
            values: vec![0.0],
        };
        let fit = |more: &[AddedEffect]| lab.fit_with(more, None, &Progress::unwatched()).unwrap();
        let before = fit(&[]);
        // One that determines a number besides its own.
        let refit = fit(&[added("joint_gain", 0), added("joint_gain", 1)]);
        assert_eq!((before.fit.rank(), refit.fit.rank()), (2, 4));
        assert_eq!(before.parameters_in(&refit, &added("joint_gain", 1).id, 1), 3.0);
        assert_eq!(before.parameters_in(&refit, &added("joint_step", 1).id, 1), 4.0);
    }

    #[test]
    fn to_compare_an_effect_what_the_fit_without_it_held_stays_held_and_for_an_event_nothing() {
        let lab = two_links(40, "joint_zero(*)", 0.05, 31, |_| [0.002, 0.0]);
        let mut near = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        // As if the rows hardly determined the shoulder's zero.
        near.fit.held = vec![0];
        near.fit.state.effects[0] = vec![0.0];
        let options = FitOptions { robust: false, ..lab.options().fit };
        let zero_beside = |name: &str, inner: Option<f64>| {
            let id = EffectId { inner, ..EffectId::at(name, Site::Joint(1)) };
            let more = [AddedEffect { id, values: vec![0.0] }];
            let with =
                lab.fit_to_compare(&more, &near, &[0.01, 0.0], options, &Progress::unwatched()).unwrap();
            with.fit.state.effects[0][0]
        };
        assert_eq!(zero_beside("joint_gain", None), 0.0);
        assert!((zero_beside("joint_step", Some(20.0)) - 0.002).abs() < 5e-4);
    }

    #[test]
    fn a_row_counts_by_its_square_up_to_the_corner_and_along_a_tangent_beyond() {
        let lab = two_links_with("free: []\nnoise: {p1_mm: 0.05}", 12, 0.05, 91, |_| [0.0; 2]);
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let squares = fitted.row_squares();
        let plain: f64 = squares.iter().sum();
        assert!((fitted.loss(1e6) - plain).abs() < 1e-9 * plain, "a wide scatter has no corner");
        // Far beyond every corner: 2 k |r| - k^2 a row.
        let edge = 1e-3 * huber_constant(3);
        let along: f64 = squares.iter().map(|square| 2.0 * edge * square.sqrt() - edge * edge).sum();
        assert!((fitted.loss(1e-3) - along).abs() < 1e-9, "{} {along}", fitted.loss(1e-3));
    }

    #[test]
    fn a_row_is_an_inlier_up_to_its_quantile_of_the_scatter() {
        let lab = two_links_with("free: []\nnoise: {p1_mm: 0.05}", 30, 0.05, 92, |_| [0.0; 2]);
        let mut fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        assert_eq!(fitted.inliers().len(), 30);
        // The scatter at which just the farthest row is an outlier.
        let farthest = fitted.row_squares().into_iter().fold(0.0, f64::max).sqrt();
        let edge = farthest / chi_squared_quantile(INLIER_QUANTILE, 3.0).sqrt();
        fitted.fit.scale = 1.001 * edge;
        assert_eq!(fitted.inliers().len(), 30);
        fitted.fit.scale = 0.999 * edge;
        assert_eq!(fitted.inliers().len(), 29);
    }

    #[test]
    fn a_fit_with_one_effect_more_begins_where_the_rows_fit_better_than_without() {
        let lab = two_links(20, "", 0.01, 94, |q| [0.0, 0.01 * q[1]]);
        let near = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let (rows, weights) = (near.fit.rows.as_slice(), near.fit.weights.as_slice());
        let before = near.fit.normal.squares;
        // One that helps is taken whole. One five times too long is halved twice: half of it would not help. One that helps at no length is not taken.
        for (step, taken, least, most) in
            [(0.01, 0.01, 0.0, 0.2), (0.05, 0.0125, 0.0, 0.2), (-0.01, 0.0, 0.999, 1.001)]
        {
            let gain = AddedEffect { id: EffectId::at("joint_gain", Site::Joint(1)), values: vec![step] };
            let problem = lab.problem(&[gain]).unwrap();
            let start = start_toward(&problem, &near, &[], (rows, weights));
            assert_eq!(start.effects.last().unwrap(), &[taken]);
            let part = problem.squares(&start, rows, weights) / before;
            assert!((least..=most).contains(&part), "{step}: {part} of the squares");
        }
    }

    #[test]
    fn squares_fall_pose_by_pose_by_what_an_effect_takes_away() {
        let lab = two_links(20, "", 0.01, 93, |q| [0.0, 0.01 * q[1]]);
        let gain = AddedEffect { id: EffectId::at("joint_gain", Site::Joint(1)), values: vec![0.0] };
        let before = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let after = lab.fit_with(&[gain], None, &Progress::unwatched()).unwrap();
        let rows = [3, 7, 11];
        let reductions = reductions_by_pose((&before, &after), &rows);
        assert_eq!(reductions.len(), 3);
        for (reduction, row) in reductions.iter().zip(rows) {
            // The elbow is off by a hundredth of its angle, at 150 mm.
            let error = 1.5 * lab.table().q_of(row)[1];
            assert!((reduction - error * error).abs() < 0.1 * error * error + 0.1, "{reduction} {error}");
        }
        assert_eq!(before.row_squares().len(), 20);
    }
}
