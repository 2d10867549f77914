//! The noise floor: how far returns to one pose scatter once side of approach, time, temperature and load are allowed
//! for; else what was declared; else unknown.

mod replicates;
mod sample;
mod scatter;

pub(crate) use replicates::{Replicates, SIDE_OF_APPROACH};
pub(crate) use scatter::Scatter;

use serde::Serialize;

use crate::thresholds::{CONDITION_LEVEL, FLOOR_FREEDOM, MOST_CONDITIONS};
use plumb_calibration::effect::CandidateContext;
use plumb_calibration::fit::{Fit, ResidualModel};
use plumb_estimation::{f_tail, holm};

/// Where a floor comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FloorSource {
    /// Replicates to the same poses.
    Repeats,
    /// The model file's `noise:` or the table's `std_*`.
    Declared,
    /// Nobody knows.
    Unknown,
}

/// The noise floor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Floor {
    /// One sigma of a reading (a coordinate of a point), in the unit of the table's readings; nothing if unknown.
    pub sigma_mm: Option<f64>,
    /// Where it comes from.
    pub source: FloorSource,
    /// Degrees of freedom it rests on; 0 if declared or unknown.
    pub dof: usize,
    /// Scatter relative to the declared sigmas (to 1 mm where none is declared): what residuals are divided by.
    #[serde(skip)]
    pub scale: Option<f64>,
    /// Effects of conditions that had to be allowed for among the returns, as written.
    #[serde(skip)]
    pub allowed_for: Vec<String>,
}

/// Scatter of returns, in declared sigmas (in mm where none is declared), below which it is that of sums of equal numbers: readings a metre long are summed to
/// 1e-13 mm, and no instrument resolves a millionth of a micrometre.
const ROUNDING: f64 = 1e-9;

impl Floor {
    /// The floor of the data a model was fitted to.
    pub(crate) fn of(problem: &ResidualModel<'_>, fit: &Fit, context: &CandidateContext<'_>) -> Self {
        Self::among(problem, Replicates::gather(problem, fit, context).as_ref())
    }

    /// The floor these returns show, else what was declared.
    pub(crate) fn among(problem: &ResidualModel<'_>, returns: Option<&Replicates>) -> Self {
        returns
            .and_then(|returns| Self::from_returns(problem, returns))
            .unwrap_or_else(|| Self::declared(problem))
    }

    /// From returns; nothing if they are too few.
    fn from_returns(problem: &ResidualModel<'_>, returns: &Replicates) -> Option<Self> {
        let (chosen, scatter) = allow(returns);
        // Rounded readings may return to the very same number: a floor of zero would make every model miss.
        if scatter.freedom < FLOOR_FREEDOM || scatter.sigma < ROUNDING {
            return None;
        }
        Some(Self {
            sigma_mm: Some(scatter.sigma * typical_sigma(problem)),
            source: FloorSource::Repeats,
            dof: scatter.freedom,
            scale: Some(scatter.sigma),
            allowed_for: chosen
                .iter()
                .filter_map(|index| returns.candidates.get(*index).map(|(id, _)| problem.model.label(id)))
                .collect(),
        })
    }

    fn declared(problem: &ResidualModel<'_>) -> Self {
        let known = problem.observations.declared;
        Self {
            sigma_mm: known.then(|| typical_sigma(problem)),
            source: if known { FloorSource::Declared } else { FloorSource::Unknown },
            dof: 0,
            scale: known.then_some(1.0),
            allowed_for: Vec::new(),
        }
    }
}

/// The root mean square of the declared sigmas, in the unit of the table's readings; 1 where nothing was read.
pub(crate) fn typical_sigma(problem: &ResidualModel<'_>) -> f64 {
    let unit = problem.observations.unit();
    let (mut sum, mut count) = (0.0, 0);
    for equation in &problem.observations.equations {
        if let Some(factor) = equation.factor_in(unit) {
            sum += (equation.sigma * factor).powi(2);
            count += 1;
        }
    }
    if count == 0 { 1.0 } else { (sum / f64::from(count)).sqrt() }
}

/// Chooses, one by one, the effects of conditions without which the returns cannot be understood. Replicates their places
/// in the list of candidates and what scatter is left.
pub(crate) fn allow(returns: &Replicates) -> (Vec<usize>, Scatter) {
    let mut chosen: Vec<usize> = Vec::new();
    let mut requested: Vec<usize> = Vec::new();
    let mut scatter = returns.scatter(&requested);
    while chosen.len() < MOST_CONDITIONS && scatter.freedom > FLOOR_FREEDOM {
        let gains = returns.gains(&scatter, &requested);
        let squares = scatter.squares;
        let p_values: Vec<f64> = gains
            .iter()
            .map(|(gain, used)| {
                let below = scatter.freedom.saturating_sub(*used) as f64;
                if *used == 0 || below < 1.0 {
                    return 1.0;
                }
                // A few replicates can be explained to nothing by as many numbers; F would then be infinite.
                let left = (squares - gain).max(squares * 1e-6) / below;
                f_tail(gain / *used as f64 / left, *used as f64, below)
            })
            .collect();
        let adjusted = holm(&p_values, &vec![1.0; p_values.len()]);
        // A gap that differs from pose to pose has so many numbers that a few joints' gaps would explain anything.
        let has_gap = chosen.iter().any(|index| returns.is_gap(*index));
        let best = (0..p_values.len())
            .filter(|index| !(has_gap && returns.is_gap(*index)))
            .min_by(|left, right| p_values[*left].total_cmp(&p_values[*right]));
        match best.filter(|best| adjusted[*best] < CONDITION_LEVEL && !chosen.contains(best)) {
            Some(index) => {
                chosen.push(index);
                requested.extend(returns.candidates.get(index).map_or(0..0, |(_, range)| range.clone()));
                scatter = returns.scatter(&requested);
            }
            None => break,
        }
    }
    (chosen, scatter)
}

#[cfg(test)]
mod tests;
