//! What the uncertainty of a predicted position is made of, effect by effect: the GUM (JCGM 100:2008), clause 5.
//!
//! The position that a calibrated model predicts is a function of the numbers that were fitted. With the covariance `V` of these (from the fit) and the
//! sensitivities `c` (derivatives of the prediction), its variance is `c' V c` (GUM 5.2.2, equation 13). The part of one effect is `c_e' V_ee c_e`; what is
//! left of the sum are the covariances between effects, which may be negative. On top come the scatter of a single positioning (pooled from the returns, GUM 4.2)
//! and what the model leaves of the means, for which no number of the model accounts.

use nalgebra::{DMatrix, DVector};
use plumb_calibration::arm_model::{AddedEffect, Model};
use plumb_calibration::effect::{self, EffectNameError};
use plumb_calibration::fit::{Fit, FitError, FitOptions, FreeParameter, ResidualModel};
use plumb_calibration::measurement::{Equation, Observations, ObservationsError};
use plumb_calibration::table::Table;
use plumb_estimation::Progress;
use serde::Serialize;
use thiserror::Error;

use crate::axis_run::Unit;

/// Of which positions a budget is made.
#[derive(Debug, Clone, Copy)]
pub struct Question<'a> {
    /// The reading: `p1_x`, `distance`; or a target, `p1`, for all its axes together.
    pub reading: &'a str,
    /// Unit of the reading.
    pub unit: Unit,
    /// Rows of the table, one a position and way of approach.
    pub rows: &'a [usize],
}

/// One line of a budget.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Component {
    /// What it is of: an effect as people write it, the base, a target.
    pub name: String,
    /// Its contribution to the standard uncertainty of the position.
    pub standard: f64,
    /// Its variance as a fraction of the combined one.
    #[serde(rename = "share")]
    pub fraction: f64,
}

/// An uncertainty budget.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Budget {
    /// Which guide.
    pub guide: &'static str,
    /// Unit of everything.
    pub unit: Unit,
    /// Line of the table with the position that is least well known.
    pub line: u32,
    /// Commanded joints there, deg or mm.
    pub commanded: Vec<f64>,
    /// Contributions, the greatest first.
    pub components: Vec<Component>,
    /// Covariances between effects: their sum, as a variance; may be negative.
    pub covariances: f64,
    /// Combined standard uncertainty of one positioning at that position.
    pub combined: f64,
    /// Expanded uncertainty.
    pub expanded: f64,
    /// Coverage factor.
    pub k: f64,
    /// Least and greatest combined standard uncertainty over all positions.
    pub over_positions: [f64; 2],
}

/// Why there is no budget.
#[derive(Debug, Error)]
pub enum BudgetError {
    /// Model and table do not go together.
    #[error(transparent)]
    Observations(#[from] ObservationsError),
    /// An effect of the model.
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    /// The fit.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The model does not predict the reading.
    #[error("{table}: the model says nothing of `{reading}`, so it has no uncertainty budget")]
    NotPredicted {
        /// The table.
        table: String,
        /// The reading.
        reading: String,
    },
}

/// Coverage factor of the expanded uncertainty: about 95 % of a normal distribution (GUM 6.3.3).
const COVERAGE: f64 = 2.0;

/// Variances below this share of the combined one are not listed.
const LISTED: f64 = 1e-6;

/// The budget of the predicted position where it is least well known.
///
/// # Errors
/// [`BudgetError`].
pub fn budget(model: &Model, table: &Table, question: &Question<'_>) -> Result<Budget, BudgetError> {
    let observations = Observations::new(model, table)?;
    let problem = ResidualModel::new(model, table, &observations, &effects(model)?)?;
    let everything = vec![true; table.len()];
    // Plain least squares: in a test after a standard every approach counts alike.
    let plain = FitOptions { robust: false, ..FitOptions::default() };
    let fit = problem.fit(&problem.start(), &everything, plain, &Progress::unwatched())?;
    let asked = |equation: &Equation| is_asked(model, equation, question.reading);
    let scatter = Scatter::of(&problem, &fit, &asked);
    let parts: Vec<Parts> =
        question.rows.iter().filter_map(|row| Parts::of(&problem, &fit, *row, &asked)).collect();
    let combined = |parts: &Parts| parts.total + scatter.single + scatter.unexplained;
    let worst = parts.iter().max_by(|one, other| combined(one).total_cmp(&combined(other)));
    let Some(worst) = worst else {
        let (table, reading) = (table.source.clone(), question.reading.to_owned());
        return Err(BudgetError::NotPredicted { table, reading });
    };
    let roots = |pick: fn(f64, f64) -> f64, start: f64| {
        shown(question.unit, parts.iter().map(combined).fold(start, pick).sqrt())
    };
    let over_positions = [roots(f64::min, f64::INFINITY), roots(f64::max, 0.0)];
    Ok(written(model, table, question, worst, &scatter, over_positions))
}

/// mm, or rad in the unit of the question.
fn shown(unit: Unit, value: f64) -> f64 {
    match unit {
        Unit::Mm => value,
        Unit::Deg => value.to_degrees(),
    }
}

/// The budget at one position, in its unit.
fn written(
    model: &Model,
    table: &Table,
    question: &Question<'_>,
    at: &Parts,
    scatter: &Scatter,
    over_positions: [f64; 2],
) -> Budget {
    let unit = question.unit;
    let all = at.total + scatter.single + scatter.unexplained;
    let extra = [
        ("repeatability of one positioning", scatter.single),
        ("not explained by the model", scatter.unexplained),
    ];
    let variances =
        at.groups.iter().cloned().chain(extra.map(|(name, variance)| (name.to_owned(), variance)));
    let mut components: Vec<Component> = variances
        .filter(|(_, variance)| *variance > LISTED * all)
        .map(|(name, variance)| Component {
            name,
            standard: shown(unit, variance.sqrt()),
            fraction: if all > 0.0 { variance / all } else { 0.0 },
        })
        .collect();
    components.sort_by(|one, other| other.standard.total_cmp(&one.standard));
    let own: f64 = at.groups.iter().map(|(_, variance)| variance).sum();
    let combined = shown(unit, all.sqrt());
    let joints = table.q_of(at.row).iter().enumerate();
    Budget {
        guide: "GUM (JCGM 100:2008)",
        unit,
        line: table.lines.get(at.row).copied().unwrap_or(0),
        commanded: joints.map(|(joint, q)| if model.slides(joint) { *q } else { q.to_degrees() }).collect(),
        components,
        // A variance: the unit counts twice.
        covariances: shown(unit, shown(unit, at.total - own)),
        combined,
        expanded: COVERAGE * combined,
        k: COVERAGE,
        over_positions,
    }
}

/// The effects that are fitted: those the model leaves free, at their last values, and those that were added.
fn effects(model: &Model) -> Result<Vec<AddedEffect>, EffectNameError> {
    let mut effects = model.effects.clone();
    for pattern in &model.free {
        for id in effect::expand(pattern, model)? {
            if effects.iter().any(|known| known.id.same_as(&id)) {
                continue;
            }
            let known = model.fitted.iter().find(|known| known.id.same_as(&id));
            effects
                .push(AddedEffect { values: known.map_or_else(Vec::new, |known| known.values.clone()), id });
        }
    }
    Ok(effects)
}

/// Whether an equation is of the reading that was asked for.
fn is_asked(model: &Model, equation: &Equation, reading: &str) -> bool {
    let what = equation.measurand;
    let axis = ["x", "y", "z"].get(what.axis()).copied().unwrap_or("?");
    match what.kind.name() {
        "position" => model
            .targets
            .get(what.index())
            .is_some_and(|target| target.name == reading || format!("{}_{axis}", target.name) == reading),
        "tilt" => format!("tilt_{axis}") == reading,
        other => other == reading,
    }
}

/// Variances of a prediction in one row: group by group, and all together. mm or rad, squared.
struct Parts {
    row: usize,
    groups: Vec<(String, f64)>,
    total: f64,
}

impl Parts {
    /// Nothing where the row has no such reading.
    fn of(
        problem: &ResidualModel<'_>,
        fit: &Fit,
        row: usize,
        asked: &impl Fn(&Equation) -> bool,
    ) -> Option<Self> {
        let ones = vec![1.0; problem.table.len()];
        let block = problem.block(&fit.state, &[row], &ones, &[]);
        let names: Vec<String> = problem
            .free_parameters()
            .iter()
            .map(|free_parameter| name_of(problem, *free_parameter))
            .collect();
        let mut groups: Vec<(String, f64)> = Vec::new();
        for name in &names {
            if !groups.iter().any(|(known, _)| known == name) {
                groups.push((name.clone(), 0.0));
            }
        }
        let mut total = None;
        let equations = problem.observations.of_row(row).iter().enumerate();
        for (column, equation) in equations.filter(|(_, equation)| asked(equation)) {
            let sensitivity: DVector<f64> = block.jacobian.column(column) * equation.sigma;
            *total.get_or_insert(0.0) += variance(&sensitivity, &fit.covariance, |_| true);
            for (name, sum) in &mut groups {
                *sum += variance(&sensitivity, &fit.covariance, |free_parameter| {
                    names.get(free_parameter) == Some(name)
                });
            }
        }
        total.map(|total: f64| Self { row, groups, total: total.max(0.0) })
    }
}

/// `c' V c` over the slots that belong to it.
fn variance(sensitivity: &DVector<f64>, covariance: &DMatrix<f64>, belongs: impl Fn(usize) -> bool) -> f64 {
    let kept = DVector::from_fn(sensitivity.len(), |free_parameter, _| {
        if belongs(free_parameter) { sensitivity[free_parameter] } else { 0.0 }
    });
    (covariance * &kept).dot(&kept).max(0.0)
}

/// What a fitted number belongs to, as people say it.
fn name_of(problem: &ResidualModel<'_>, free_parameter: FreeParameter) -> String {
    let model = problem.model;
    match free_parameter {
        FreeParameter::BaseShift(_) | FreeParameter::BaseRotation(_) => "place of the base".to_owned(),
        FreeParameter::Target(target, _) => {
            let name = model.targets.get(target).map_or("?", |target| target.name.as_str());
            format!("place of {name} on the flange")
        }
        FreeParameter::TargetRotation(target, _) => {
            let name = model.targets.get(target).map_or("?", |target| target.name.as_str());
            format!("turn of {name} on the flange")
        }
        FreeParameter::BoardShift(board, _) | FreeParameter::BoardRotation(board, _) => {
            match model.board_name(board) {
                "board" => "place of the board".to_owned(),
                name => format!("place of the board {name}"),
            }
        }
        FreeParameter::Place(..) => "touched places".to_owned(),
        FreeParameter::Surface(surface, _) => {
            let name = model.surfaces.get(surface).map_or("?", |surface| surface.name.as_str());
            format!("place of {name}")
        }
        FreeParameter::Effect(effect, _) => {
            problem.parts.get(effect).map_or_else(String::new, |part| model.label(&part.id))
        }
    }
}

/// Variances that no number of the model accounts for, mm or rad, squared, all asked axes together.
struct Scatter {
    /// Of a single positioning about the mean of its returns, pooled.
    single: f64,
    /// Of these means about the prediction, beyond what the scatter of single positionings makes of them.
    unexplained: f64,
}

impl Scatter {
    fn of(problem: &ResidualModel<'_>, fit: &Fit, asked: &impl Fn(&Equation) -> bool) -> Self {
        let table = problem.table;
        let sides =
            |row: usize| (0..table.joints).map(|joint| table.approach_of(row, joint)).collect::<Vec<i8>>();
        let mut groups: Vec<(usize, Vec<Vec<f64>>)> = Vec::new();
        for row in 0..table.len() {
            let range = problem.observations.range(row);
            let all = fit.residuals.get(range).unwrap_or(&[]).iter().zip(problem.observations.of_row(row));
            let own: Vec<f64> =
                all.filter(|(_, equation)| asked(equation)).map(|(residual, _)| *residual).collect();
            if own.is_empty() {
                continue;
            }
            let same = |first: usize| table.q_of(first) == table.q_of(row) && sides(first) == sides(row);
            match groups.iter_mut().find(|(first, _)| same(*first)) {
                Some((_, rows)) => rows.push(own),
                None => groups.push((row, vec![own])),
            }
        }
        let axes = groups.iter().flat_map(|(_, rows)| rows).map(Vec::len).max().unwrap_or(0);
        let parts = (0..axes).map(|axis| scatter_of_axis(&groups, axis));
        let (single, unexplained) = parts.fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
        Self { single, unexplained }
    }
}

/// Pooled variance within groups of returns, and variance of their means beyond it.
fn scatter_of_axis(groups: &[(usize, Vec<Vec<f64>>)], axis: usize) -> (f64, f64) {
    let (mut squares, mut freedom, mut between, mut expected) = (0.0, 0.0, 0.0, Vec::new());
    for (_, rows) in groups {
        let values: Vec<f64> = rows.iter().filter_map(|row| row.get(axis)).copied().collect();
        let count = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / count;
        squares += values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        freedom += count - 1.0;
        between += mean * mean;
        expected.push(1.0 / count);
    }
    let single = if freedom > 0.0 { squares / freedom } else { 0.0 };
    let count = expected.len().max(1) as f64;
    let by_chance = single * expected.iter().sum::<f64>() / count;
    (single, (between / count - by_chance).max(0.0))
}
