//! The adjustment: everything at once, by least squares.

use nalgebra::{DMatrix, DVector, Isometry3, Point3};
use plumb_kinematics::{Deviation, Posture, Weights};

use super::surface::Away;
use super::{RigParameter, StripePixel, StripeRig, Surface, View};
use crate::effect::{self, Effect, EffectId, EffectNameError, Handle, Situation};
use crate::file::Model;

/// What is adjusted, beside the surfaces' places.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Numbers of the rig.
    pub rig: Vec<RigParameter>,
    /// Effects of the library that act in joints.
    pub effects: Vec<EffectId>,
}

/// Why there is no adjustment.
#[derive(Debug, thiserror::Error)]
pub enum AdjustError {
    /// An effect cannot act in this model.
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    /// Too few points lie near any surface.
    #[error(
        "only {near} of {all} points lie near a surface, for {unknowns} unknowns: do the surfaces stand about where they are said to?"
    )]
    TooFew {
        /// Points near a surface.
        near: usize,
        /// All points.
        all: usize,
        /// Numbers sought.
        unknowns: usize,
    },
    /// It does not come to an end.
    #[error("the adjustment does not settle; adjust fewer things at once")]
    Diverged,
}

/// A number that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// What: an effect with its parameter, or a number of the rig.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// How much it is beyond where it began.
    pub value: f64,
    /// Its standard error.
    pub sigma: f64,
}

/// What an adjustment has found.
#[derive(Debug, Clone)]
pub struct Adjustment {
    /// Every number, in the order of the options.
    pub found: Vec<Found>,
    /// The rig.
    pub rig: StripeRig,
    /// The surfaces, in their places.
    pub surfaces: Vec<Surface>,
    /// Distance of the points from their surfaces, root mean square, mm.
    pub rms_mm: f64,
    /// The weighted sum of squares.
    pub chi_square: f64,
    /// Points that took part.
    pub points: usize,
    /// Numbers sought, the surfaces' among them.
    pub unknowns: usize,
    /// Combinations of numbers that no stripe could tell, in words.
    pub not_observable: Vec<String>,
    values: Vec<f64>,
    effects: Vec<EffectId>,
}

/// A point at an edge could be of either side: it is left out, mm.
const EDGE_MM: f64 = 1.5;

/// What a surface is rough by, and what else no model knows, mm.
const ROUGH_MM: f64 = 0.02;

/// Rounds of choosing points' surfaces anew.
const ROUNDS: usize = 4;

/// Steps in a round.
const STEPS: usize = 12;

/// A direction whose eigenvalue is so small a share of the largest cannot be told.
const SINGULAR: f64 = 1e-10;

/// A point with the surface it lies on.
struct Member {
    pixel: StripePixel,
    surface: usize,
    part: usize,
    sigma_mm: f64,
}

/// Everything that is sought, at some values.
struct State {
    rig: StripeRig,
    surfaces: Vec<Surface>,
    values: Vec<f64>,
}

struct Problem<'a> {
    model: &'a Model,
    views: &'a [View],
    options: &'a Options,
    effects: Vec<Box<dyn Effect>>,
    /// The parameters of all effects: effect, parameter.
    effect_parameters: Vec<(usize, usize)>,
    members: Vec<Member>,
    middles: Vec<Point3<f64>>,
}

/// Adjusts rig, effects and the surfaces' places together, from about right ones.
///
/// # Errors
/// [`AdjustError`]
pub fn adjust(
    model: &Model,
    rig: &StripeRig,
    surfaces: &[Surface],
    views: &[View],
    pixels: &[StripePixel],
    options: &Options,
) -> Result<Adjustment, AdjustError> {
    let effects = built(model, &options.effects)?;
    let parameters = effects
        .iter()
        .enumerate()
        .flat_map(|(place, effect)| (0..effect.parameters().len()).map(move |parameter| (place, parameter)))
        .collect::<Vec<_>>();
    let mut state =
        State { rig: rig.clone(), surfaces: surfaces.to_vec(), values: vec![0.0; parameters.len()] };
    let mut problem = Problem {
        model,
        views,
        options,
        effects,
        effect_parameters: parameters,
        members: Vec::new(),
        middles: Vec::new(),
    };
    let mut rig_values = vec![0.0; options.rig.len()];
    let mut limit = 12.0;
    for round in 0..ROUNDS {
        problem.choose(&state, pixels, limit)?;
        problem.settle(&mut state, &mut rig_values)?;
        let rms = problem.rms_mm(&state);
        limit = if round == 0 { (6.0 * rms).clamp(1.0, 8.0) } else { (4.0 * rms).clamp(0.3, limit) };
    }
    Ok(problem.told(state, &rig_values))
}

fn built(model: &Model, ids: &[EffectId]) -> Result<Vec<Box<dyn Effect>>, EffectNameError> {
    ids.iter().map(|id| effect::build(id, model)).collect()
}

/// Where the flange is in a view under these values of effects.
fn base_from_flange(
    model: &Model,
    effects: &[Box<dyn Effect>],
    values: &[f64],
    view: &View,
    skew_s: f64,
) -> Isometry3<f64> {
    let q: Vec<f64> = view
        .q
        .iter()
        .enumerate()
        .map(|(joint, q)| q + skew_s * view.speed.get(joint).copied().unwrap_or(0.0))
        .collect();
    let mut deviations = vec![Deviation::default(); model.chain.len()];
    if !effects.is_empty() {
        let posture = Posture::of(&model.chain, &q, &[]);
        let weights =
            Weights { masses: &model.masses, payload: 0.0, down: model.down(&model.base.pose.rotation) };
        let mut moments = Vec::new();
        weights.moments(&posture, &mut moments);
        let situation = Situation {
            chain: &model.chain,
            q: &q,
            previous: None,
            approach: &view.approach,
            time: f64::NAN,
            clock: f64::NAN,
            temperature: f64::NAN,
            moments: &moments,
            weights,
            posture: &posture,
            point: posture.flange.translation.vector,
            hand: posture.flange.rotation.into_inner(),
            trigger: None,
        };
        let mut drives = Vec::new();
        let mut first = 0;
        for effect in effects {
            drives.clear();
            effect.drive(&situation, &mut drives);
            for drive in &drives {
                let value = values.get(first + drive.parameter).copied().unwrap_or(0.0);
                if let Handle::Joint(joint, knob) = drive.handle
                    && let Some(deviation) = deviations.get_mut(joint)
                {
                    deviation.add(knob, drive.rate * value);
                }
            }
            first += effect.parameters().len();
        }
    }
    let flange = Posture::of(&model.chain, &q, &deviations).flange;
    Isometry3::from_parts(flange.translation, flange.rotation.into())
}

impl Problem<'_> {
    fn flanges(&self, rig: &StripeRig, values: &[f64]) -> Vec<Isometry3<f64>> {
        let flange =
            |view: &View| base_from_flange(self.model, &self.effects, values, view, rig.clock_skew_s);
        self.views.iter().map(flange).collect()
    }

    /// Gives every point near one surface, and no other, to it.
    fn choose(&mut self, state: &State, pixels: &[StripePixel], limit: f64) -> Result<(), AdjustError> {
        let flanges = self.flanges(&state.rig, &state.values);
        self.members.clear();
        let mut sums = vec![(nalgebra::Vector3::zeros(), 0.0); state.surfaces.len()];
        for pixel in pixels {
            let (Some(flange), Some(seen)) =
                (flanges.get(pixel.view), state.rig.point(pixel.u_px, pixel.v_px))
            else {
                continue;
            };
            let point = flange * seen;
            let mut near: Vec<(usize, Away)> =
                state.surfaces.iter().map(|surface| surface.away(&point)).enumerate().collect();
            near.sort_by(|a, b| a.1.distance.abs().total_cmp(&b.1.distance.abs()));
            let Some((surface, away)) = near.first().copied() else { continue };
            let rival = near.get(1).map_or(f64::INFINITY, |(_, other)| other.distance.abs());
            let certain = away.lead > EDGE_MM && rival - away.distance.abs() > EDGE_MM;
            if away.distance.abs() > limit || !certain {
                continue;
            }
            let aside = state.rig.point(pixel.u_px + 0.5, pixel.v_px);
            let per_px = aside.map_or(1.0, |aside| 2.0 * (aside - seen).norm());
            let sigma_mm = (per_px * pixel.sigma_px).hypot(ROUGH_MM);
            self.members.push(Member { pixel: *pixel, surface, part: away.part, sigma_mm });
            if let Some((sum, count)) = sums.get_mut(surface) {
                *sum += point.coords;
                *count += 1.0;
            }
        }
        self.middles = sums.iter().map(|(sum, count)| Point3::from(sum / f64::max(*count, 1.0))).collect();
        let unknowns = self.unknowns(state);
        if self.members.len() < 3 * unknowns {
            return Err(AdjustError::TooFew { near: self.members.len(), all: pixels.len(), unknowns });
        }
        Ok(())
    }

    fn unknowns(&self, state: &State) -> usize {
        let places: usize = state.surfaces.iter().map(Surface::freedoms).sum();
        self.options.rig.len() + self.effect_parameters.len() + places
    }

    fn distances(&self, state: &State) -> Vec<f64> {
        let flanges = self.flanges(&state.rig, &state.values);
        let distance = |member: &Member| {
            let seen = state.rig.point(member.pixel.u_px, member.pixel.v_px)?;
            let surface = state.surfaces.get(member.surface)?;
            Some(surface.distance(member.part, &(flanges.get(member.pixel.view)? * seen)))
        };
        self.members.iter().map(|member| distance(member).unwrap_or(0.0)).collect()
    }

    fn rms_mm(&self, state: &State) -> f64 {
        let squares: f64 = self.distances(state).iter().map(|distance| distance * distance).sum();
        (squares / self.members.len().max(1) as f64).sqrt()
    }

    /// Residuals over their sigmas, each brought in by Huber's weight.
    fn residuals(&self, state: &State) -> DVector<f64> {
        let distances = self.distances(state);
        let scaled = distances.iter().zip(&self.members).map(|(distance, member)| distance / member.sigma_mm);
        DVector::from_iterator(self.members.len(), scaled)
    }

    /// Moves the unknown of a number; the unknowns are the rig's, the effects', the surfaces'.
    fn moved(&self, state: &State, unknown: usize, by: f64) -> State {
        let mut moved =
            State { rig: state.rig.clone(), surfaces: state.surfaces.clone(), values: state.values.clone() };
        if let Some(parameter) = self.options.rig.get(unknown) {
            moved.rig = state.rig.moved(*parameter, by);
            return moved;
        }
        let mut place = unknown - self.options.rig.len();
        if let Some(value) = moved.values.get_mut(place) {
            *value += by;
            return moved;
        }
        place -= moved.values.len();
        for (surface, middle) in moved.surfaces.iter_mut().zip(&self.middles) {
            if place < surface.freedoms() {
                surface.shift(place, by, middle);
                break;
            }
            place -= surface.freedoms();
        }
        moved
    }

    fn small(&self, unknown: usize) -> f64 {
        if let Some(parameter) = self.options.rig.get(unknown) {
            return parameter.small();
        }
        let place = unknown - self.options.rig.len();
        match self.effect_parameters.get(place) {
            Some((effect, parameter)) => {
                let range = self
                    .effects
                    .get(*effect)
                    .and_then(|effect| effect.parameters().get(*parameter))
                    .map_or((0.0, 1.0), |parameter| parameter.range);
                (range.1 - range.0).abs().min(1.0) * 1e-4
            }
            None => 0.01,
        }
    }

    fn jacobian(&self, state: &State) -> DMatrix<f64> {
        let unknowns = self.unknowns(state);
        let mut jacobian = DMatrix::zeros(self.members.len(), unknowns);
        for unknown in 0..unknowns {
            let small = self.small(unknown);
            let ahead = self.residuals(&self.moved(state, unknown, small));
            let behind = self.residuals(&self.moved(state, unknown, -small));
            jacobian.set_column(unknown, &((ahead - behind) / (2.0 * small)));
        }
        jacobian
    }

    fn settle(&self, state: &mut State, rig_values: &mut [f64]) -> Result<(), AdjustError> {
        let cost = |residuals: &DVector<f64>| residuals.iter().map(|residual| huber(*residual)).sum::<f64>();
        let mut residuals = self.residuals(state);
        let mut damping = 1e-6;
        for _ in 0..STEPS {
            let mut jacobian = self.jacobian(state);
            let mut weighted = residuals.clone();
            for (row, residual) in residuals.iter().enumerate() {
                let weight = (HUBER / residual.abs().max(HUBER)).sqrt();
                jacobian.row_mut(row).scale_mut(weight);
                if let Some(value) = weighted.get_mut(row) {
                    *value *= weight;
                }
            }
            let normal = jacobian.tr_mul(&jacobian);
            let toward = jacobian.tr_mul(&weighted);
            let before = cost(&residuals);
            let mut gained = false;
            for _ in 0..8 {
                let mut damped = normal.clone();
                for place in 0..damped.nrows() {
                    damped[(place, place)] += damping * normal[(place, place)].max(1e-12);
                }
                let Some(step) = damped.cholesky().map(|factor| factor.solve(&toward)) else {
                    damping *= 100.0;
                    continue;
                };
                let mut tried = self.moved(state, 0, 0.0);
                for (unknown, by) in step.iter().enumerate() {
                    tried = self.moved(&tried, unknown, -by);
                }
                let left = self.residuals(&tried);
                if cost(&left) <= before {
                    for (value, by) in rig_values.iter_mut().zip(step.iter()) {
                        *value -= by;
                    }
                    gained = before - cost(&left) > 1e-7 * before;
                    *state = tried;
                    residuals = left;
                    damping = (damping * 0.1).max(1e-9);
                    break;
                }
                damping *= 30.0;
            }
            if !gained {
                break;
            }
        }
        if residuals.iter().all(|residual| residual.is_finite()) {
            Ok(())
        } else {
            Err(AdjustError::Diverged)
        }
    }

    fn told(&self, state: State, rig_values: &[f64]) -> Adjustment {
        let residuals = self.residuals(&state);
        let jacobian = self.jacobian(&state);
        let chi_square: f64 = residuals.iter().map(|residual| huber(*residual)).sum();
        let unknowns = jacobian.ncols();
        let names = self.names();
        let (sigmas, not_observable) =
            spread(&jacobian, &names, chi_square / (self.members.len() - unknowns).max(1) as f64);
        let values = rig_values.iter().chain(&state.values);
        let found = names.iter().zip(values).zip(&sigmas).map(|(((name, unit), value), sigma)| Found {
            name: name.clone(),
            unit: unit.clone(),
            value: *value,
            sigma: *sigma,
        });
        Adjustment {
            found: found.collect(),
            rms_mm: self.rms_mm(&state),
            chi_square,
            points: self.members.len(),
            unknowns,
            not_observable,
            rig: state.rig,
            surfaces: state.surfaces,
            values: state.values,
            effects: self.options.effects.clone(),
        }
    }

    /// Names and units of what is sought, the surfaces' places left out.
    fn names(&self) -> Vec<(String, String)> {
        let rig = self.options.rig.iter().map(|parameter| (parameter.name(), parameter.unit().to_owned()));
        let effects = self.effect_parameters.iter().map(|(effect, parameter)| {
            let id = self.options.effects.get(*effect).map(|id| id.label(self.model)).unwrap_or_default();
            let several = self.effects.get(*effect).is_some_and(|effect| effect.parameters().len() > 1);
            let known = self.effects.get(*effect).and_then(|effect| effect.parameters().get(*parameter));
            let name = known.map_or(String::new(), |known| known.name.clone());
            // Values are the internal ones, rad and mm.
            let unit = known.map_or(String::new(), |known| known.unit.name.replace("deg", "rad"));
            (if several { format!("{id} {name}") } else { id }, unit)
        });
        rig.chain(effects).collect()
    }
}

/// Residuals beyond so many sigmas count linearly.
const HUBER: f64 = 3.0;

fn huber(residual: f64) -> f64 {
    let size = residual.abs();
    if size <= HUBER { size * size } else { 2.0 * HUBER * size - HUBER * HUBER }
}

/// Standard errors, and what cannot be told, from the scaled normal matrix's eigenvectors.
fn spread(jacobian: &DMatrix<f64>, names: &[(String, String)], variance: f64) -> (Vec<f64>, Vec<String>) {
    let normal = jacobian.tr_mul(jacobian);
    let scales: Vec<f64> =
        (0..normal.nrows()).map(|place| normal[(place, place)].sqrt().max(1e-300)).collect();
    let scaled = DMatrix::from_fn(normal.nrows(), normal.ncols(), |row, column| {
        normal[(row, column)] / (scales[row] * scales[column])
    });
    let eigen = scaled.symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let mut variances = vec![0.0; normal.nrows()];
    let mut hidden = Vec::new();
    for (which, value) in eigen.eigenvalues.iter().enumerate() {
        let direction = eigen.eigenvectors.column(which);
        if *value <= SINGULAR * largest {
            hidden.extend(in_words(direction.as_slice(), names));
            continue;
        }
        for ((sum, part), scale) in variances.iter_mut().zip(direction.iter()).zip(&scales) {
            *sum += part * part / value / (scale * scale);
        }
    }
    (variances.iter().map(|sum| (sum * variance).sqrt()).collect(), hidden)
}

/// A direction nothing depends on, by the names of its greatest parts.
fn in_words(direction: &[f64], names: &[(String, String)]) -> Option<String> {
    let mut parts: Vec<(f64, &str)> =
        direction.iter().zip(names).map(|(part, (name, _))| (part.abs(), name.as_str())).collect();
    parts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let greatest = parts.first()?.0;
    // A direction that only moves surfaces is none of the machine.
    if greatest < 0.02 {
        return None;
    }
    let named: Vec<&str> =
        parts.iter().take_while(|(part, _)| *part > 0.25 * greatest).take(4).map(|(_, name)| *name).collect();
    Some(match named.as_slice() {
        [one] => format!("{one}: the surfaces move with it, whatever it is"),
        several => format!("{}: only together, not apart", several.join(", ")),
    })
}

impl Adjustment {
    /// Where the flange is under what was found.
    ///
    /// # Errors
    /// As [`adjust`], for another model than it was adjusted with.
    pub fn flange(&self, model: &Model, view: &View) -> Result<Isometry3<f64>, AdjustError> {
        let effects = built(model, &self.effects)?;
        Ok(base_from_flange(model, &effects, &self.values, view, self.rig.clock_skew_s))
    }

    /// The Bayesian information criterion: less is better, and a difference of 10 is beyond doubt.
    pub fn bic(&self) -> f64 {
        self.chi_square + self.unknowns as f64 * (self.points as f64).ln()
    }
}
