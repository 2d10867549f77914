//! The calibration of a light stripe and its arm from stripes alone: zeros, rig and what is added, by least squares, and the laboratory that asks what is left.

use std::ops::Range;

use plumb_calibration::arm_model::{AddedEffect, Model, StripeRig};
use plumb_calibration::effect::{self, EffectId, EffectNameError, Search, Site};
use plumb_calibration::fit::{Fit, FitError, FitOptions, FreeParameter, ResidualModel, State};
use plumb_calibration::measurement::{Observations, ObservationsError};
use plumb_calibration::table::Table;
use plumb_estimation::{Cancelled, Progress};

use super::assign::{Member, assigned, floor_mm, noise_mm, rms_mm, stretches};
use super::prepare::{free_effects, prepared};
use super::surface::Surface;
use super::table::Scans;
use crate::laboratory::{Laboratory, LaboratoryError, Options, StandardErrors};
use crate::noise_floor::Floor;

/// An arm with a light stripe, what is under it, and scans of that.
#[derive(Debug, Clone, Copy)]
pub struct StripeScene<'a> {
    /// The arm; its own effects do not count.
    pub model: &'a Model,
    /// The rig as its file has it.
    pub rig: &'a StripeRig,
    /// What is there, by name, about where.
    pub surfaces: &'a [(String, Surface)],
    /// What was seen.
    pub scans: &'a Scans,
}

/// Why there is no adjustment.
#[derive(Debug, thiserror::Error)]
pub enum AdjustError {
    /// An effect cannot act in this model.
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    /// The stripes do not go with the model.
    #[error(transparent)]
    Observations(#[from] ObservationsError),
    /// Nothing can be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// Too few points lie near any surface.
    #[error(
        "only {near} of {all} points lie near a surface, for {unknowns} unknowns: are the surfaces about where they are said to be?"
    )]
    TooFew {
        /// Points near a surface.
        near: usize,
        /// All points.
        all: usize,
        /// Numbers sought.
        unknowns: usize,
    },
    /// What is searched for inside an effect cannot be found.
    #[error(transparent)]
    Laboratory(#[from] Box<LaboratoryError>),
    /// It was asked to end.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl AdjustError {
    /// Whether it is only that the adjustment was asked to end.
    pub fn is_cancelled(&self) -> bool {
        match self {
            Self::Fit(error) => matches!(error, FitError::Cancelled(_)),
            Self::Laboratory(error) => error.is_cancelled(),
            Self::Cancelled(_) => true,
            Self::Effect(_) | Self::Observations(_) | Self::TooFew { .. } => false,
        }
    }
}

impl From<LaboratoryError> for AdjustError {
    fn from(error: LaboratoryError) -> Self {
        Self::Laboratory(Box::new(error))
    }
}

/// A number that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// What: an effect, with its parameter where it has several.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// How much it is beyond where it began.
    pub value: f64,
    /// Its standard error.
    pub sigma: f64,
}

/// What an adjustment has found.
#[derive(Debug, Clone)]
pub struct Adjustment {
    /// Every number: those that are always adjusted, then those that were added.
    pub found: Vec<Found>,
    /// The rig.
    pub rig: StripeRig,
    /// Distance of the points from their surfaces, root mean square, mm.
    pub rms_mm: f64,
    /// Scatter of neighbouring points of one stripe on one surface, mm: what no effect of arm or rig makes, for these change smoothly along a stripe.
    pub noise_mm: f64,
    /// Root mean square distance that the pictures' noise alone would leave, mm.
    pub floor_mm: f64,
    /// Points that took part.
    pub points: usize,
    /// Combinations of numbers that no stripe could determine, in words.
    pub not_observable: Vec<String>,
    /// The effects with their values, free and added.
    pub effects: Vec<AddedEffect>,
    /// The model that was adjusted, and the stripes as its table.
    model: Model,
    table: Table,
}

/// Points farther away than this from every surface are none of them at first, mm.
const FAR_MM: f64 = 12.0;

/// Points within this distance of a surface may always be of it, mm.
const NEAR_MM: f64 = 0.5;

/// Points belong to a surface within so many times what is left in the mean: an effect that is not in the model moves some stripes much farther than most.
const REACH: f64 = 8.0;

/// Rounds of giving points to surfaces anew at most.
const ROUNDS: usize = 4;

/// Adjusts zeros, rig, the surfaces' places and `added` together, from about right ones. What is searched for inside an effect (the moment at which a joint
/// stiffens) is set to what explains the stripes best.
///
/// # Errors
/// [`AdjustError`]
pub fn adjust(
    scene: StripeScene<'_>,
    added: &[EffectId],
    progress: &Progress,
) -> Result<Adjustment, AdjustError> {
    let mut known: Vec<EffectId> = Vec::new();
    for id in added {
        let searched = effect::kind(&id.name).is_some_and(|kind| kind.search != Search::Nothing);
        let id = match searched && id.inner.is_none() {
            true => with_effects(scene, &known, progress)?.laboratory()?.searched(id.clone(), progress)?,
            false => id.clone(),
        };
        known.push(id);
    }
    with_effects(scene, &known, progress)
}

/// The parts of each body among the model's surfaces.
fn bodies(surfaces: &[(String, Surface)]) -> Vec<Range<usize>> {
    let mut first = 0;
    let bodies = surfaces.iter().map(|(name, surface)| {
        let range = first..first + surface.parts(name).len();
        first = range.end;
        range
    });
    bodies.collect()
}

/// One number a joint, zero where there are none.
fn padded<T: Copy + Default>(numbers: &[T], joints: usize) -> impl Iterator<Item = T> {
    (0..joints).map(|joint| numbers.get(joint).copied().unwrap_or_default())
}

/// The views as rows of a table, nothing measured in them yet.
fn table_of(scans: &Scans, joints: usize) -> Table {
    let views = &scans.views;
    let moves = views.iter().any(|view| !view.speed.is_empty());
    let knows_sides = views.iter().any(|view| !view.approach.is_empty());
    let sides = views.iter().flat_map(|view| padded(&view.approach, joints));
    let mut table = Table {
        source: "stripes".to_owned(),
        joints,
        q: views.iter().flat_map(|view| padded(&view.q, joints)).collect(),
        lines: (1..=views.len() as u32).collect(),
        approach: knows_sides.then(|| sides.collect()),
        // Only where every picture is dated.
        time: views.iter().map(|view| view.time_s).collect(),
        speed: moves.then(|| views.iter().flat_map(|view| padded(&view.speed, joints)).collect()),
        ..Table::default()
    };
    for _ in views {
        table.note(None, None);
    }
    table
}

fn with_effects(
    scene: StripeScene<'_>,
    added: &[EffectId],
    progress: &Progress,
) -> Result<Adjustment, AdjustError> {
    let StripeScene { scans, surfaces, .. } = scene;
    let model = prepared(scene.model, scene.rig, surfaces);
    let bodies = bodies(surfaces);
    let mut effects: Vec<AddedEffect> = Vec::new();
    for id in free_effects(&model)?.iter().chain(added) {
        if effects.iter().any(|known| known.id.same_as(id)) {
            continue;
        }
        let parameters = effect::build(id, &model)?.parameters().len();
        effects.push(AddedEffect { id: id.clone(), values: vec![0.0; parameters] });
    }
    let mut table = table_of(scans, model.chain.len());
    let nothing = Observations::without_readings(table.len());
    let mut state = ResidualModel::new(&model, &table, &nothing, &effects)?.start();
    let mut limit = FAR_MM;
    let mut before = 0;
    for round in 0..ROUNDS {
        progress.report(round as f64 / (ROUNDS + 1) as f64, "adjusting zeros and rig to the stripes")?;
        let problem = ResidualModel::new(&model, &table, &nothing, &effects)?;
        let members = assigned(&problem, &state, &bodies, scans, limit);
        let unknowns = problem.free_parameters().len();
        // Three points a number: fewer leave no scatter by which to say how sure the numbers are.
        if members.len() < 3 * unknowns {
            return Err(AdjustError::TooFew { near: members.len(), all: scans.pixels.len(), unknowns });
        }
        table.stretches = stretches(&members);
        // Without robust weights at first: a stripe that is far off because of what is sought must pull.
        state = fitted((&model, &table), &effects, &state, false, progress)?.state;
        // The reach only shrinks: a point that was given to a surface by mistake must not widen it again.
        limit = (REACH * rms_mm(&members)).clamp(NEAR_MM, limit);
        if members.len() == before {
            break;
        }
        before = members.len();
    }
    // What is left is said of the points within reach of the state that was reached; far pictures are weighed down now that it is known which are far.
    let problem = ResidualModel::new(&model, &table, &nothing, &effects)?;
    table.stretches = stretches(&assigned(&problem, &state, &bodies, scans, limit));
    let fit = fitted((&model, &table), &effects, &state, true, progress)?;
    let problem = ResidualModel::new(&model, &table, &nothing, &effects)?;
    let members = assigned(&problem, &fit.state, &bodies, scans, limit);
    to_adjusted(model, table, effects, &fit, &members)
}

/// The fit of everything to the stretches of a table, from a state on.
fn fitted(
    (model, table): (&Model, &Table),
    effects: &[AddedEffect],
    start: &State,
    robust: bool,
    progress: &Progress,
) -> Result<Fit, AdjustError> {
    let observations = Observations::new(model, table)?;
    let problem = ResidualModel::new(model, table, &observations, effects)?;
    let all = vec![true; table.len()];
    let options = FitOptions { robust, ..FitOptions::default() };
    Ok(problem.fit(start, &all, options, progress)?)
}

/// What a fit says of itself.
fn to_adjusted(
    mut model: Model,
    table: Table,
    mut effects: Vec<AddedEffect>,
    fit: &Fit,
    members: &[Member],
) -> Result<Adjustment, AdjustError> {
    let observations = Observations::new(&model, &table)?;
    let problem = ResidualModel::new(&model, &table, &observations, &effects)?;
    let found = found(&StandardErrors::of(&problem, fit, &Floor::among(&problem, None)));
    let not_observable = fit.gauges.iter().map(|gauge| match gauge.same_as.is_empty() {
        true => format!("{} not estimated: it changes nothing that was seen", gauge.held),
        false => format!("{} not estimated: same effect as {}", gauge.held, gauge.same_as.join(", ")),
    });
    let not_observable = not_observable.collect();
    let rig = problem.rig(&fit.state).or_else(|| model.stripe_rig.clone());
    let rig = rig.ok_or_else(|| ObservationsError::Incomplete {
        table: table.source.clone(),
        reason: "there is no rig".to_owned(),
    })?;
    for (effect, values) in effects.iter_mut().zip(&fit.state.effects) {
        effect.values.clone_from(values);
    }
    for (surface, shape) in model.surfaces.iter_mut().zip(&fit.state.surfaces) {
        surface.shape.clone_from(shape);
    }
    let free = free_effects(&model)?;
    (model.fitted, model.effects) =
        effects.iter().cloned().partition(|effect| free.iter().any(|id| id.same_as(&effect.id)));
    Ok(Adjustment {
        found,
        rig,
        rms_mm: rms_mm(members),
        noise_mm: noise_mm(members),
        floor_mm: floor_mm(members),
        points: members.len(),
        not_observable,
        effects,
        model,
        table,
    })
}

/// Every number of the effects that were fitted, in shown units.
fn found(errors: &StandardErrors<'_>) -> Vec<Found> {
    let StandardErrors { problem, fit, covariance } = errors;
    let numbers = problem.free_parameters().iter().enumerate().filter_map(|(index, free_parameter)| {
        let FreeParameter::Effect(part, which) = *free_parameter else { return None };
        let parameter = problem.parts.get(part)?.effect.parameters().get(which)?.clone();
        let value = *fit.state.effects.get(part)?.get(which)?;
        let variance = covariance.get((index, index)).copied().unwrap_or(0.0);
        Some(Found {
            name: problem.parameter_name(*free_parameter),
            unit: if parameter.unit.name == "1" { "" } else { parameter.unit.name },
            value: value * parameter.unit.factor,
            sigma: variance.max(0.0).sqrt() * parameter.unit.factor,
        })
    });
    numbers.collect()
}

impl Adjustment {
    /// The laboratory in which what is left is asked about: the stripes as a table, with the model that was adjusted to them.
    ///
    /// # Errors
    /// The stripes cannot be asked.
    pub fn laboratory(&self) -> Result<Laboratory, LaboratoryError> {
        Laboratory::new(self.model.clone(), self.table.clone(), Options::default())
    }

    /// The effects of the arm alone, as a model file keeps them; those of the rig go into the rig's file.
    pub fn of_arm(&self) -> Vec<AddedEffect> {
        let of_arm = self.effects.iter().filter(|effect| effect.id.site != Site::Sensor);
        of_arm.cloned().collect()
    }

    /// How much later than their times say the pictures were exposed, s; 0 where that was not asked.
    pub fn late_s(&self) -> f64 {
        let skew = self.effects.iter().find(|effect| effect.id.name == "clock_skew");
        skew.and_then(|effect| effect.values.first()).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_adjustment_that_was_asked_to_end_is_distinguished_from_one_that_failed() {
        assert!(AdjustError::from(Cancelled).is_cancelled());
        assert!(AdjustError::Fit(FitError::Cancelled(Cancelled)).is_cancelled());
        assert!(AdjustError::Laboratory(Box::new(LaboratoryError::from(Cancelled))).is_cancelled());
        assert!(!AdjustError::TooFew { near: 3, all: 9, unknowns: 5 }.is_cancelled());
        assert!(!AdjustError::Fit(FitError::NoRows { table: "t".to_owned() }).is_cancelled());
    }

    #[test]
    fn what_was_found_is_shown_in_degrees_with_the_root_of_its_variance() {
        let lab = crate::testing::two_links(12, "joint_zero(*)", 0.05, 7, |_| [0.0; 2]);
        let mut fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        fitted.fit.state.effects[1][0] = 0.01;
        fitted.fit.covariance[(1, 1)] = 4e-6;
        let found = found(&StandardErrors::of_the_fit(&fitted.problem, &fitted.fit));
        assert_eq!((found.len(), found[1].unit), (2, "deg"));
        assert!((found[1].value - 0.01_f64.to_degrees()).abs() < 1e-12);
        assert!((found[1].sigma - 0.002_f64.to_degrees()).abs() < 1e-12, "{}", found[1].sigma);
    }
}
