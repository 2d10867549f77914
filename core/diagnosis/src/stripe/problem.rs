//! What an adjustment minimizes: how far the points lie from their surfaces, as a function of everything that is sought.

use nalgebra::{DMatrix, DVector, Isometry3, Point3};

use super::options::{AdjustError, Options};
use super::surface::Away;
use super::{RigParameter, StripePixel, StripeRig, Surface, View};
use plumb_calibration::arm_model::Model;
use plumb_calibration::effect::{self, Effect, EffectId, EffectNameError};
use plumb_calibration::forward;

/// A point at an edge could be of either side: it is left out, mm.
const EDGE_MM: f64 = 1.5;

/// What a surface is rough by, and what else no model knows, mm.
const ROUGH_MM: f64 = 0.02;

/// A point with the surface it lies on.
#[derive(Clone)]
pub(super) struct Member {
    pub(super) pixel: StripePixel,
    pub(super) surface: usize,
    pub(super) part: usize,
    pub(super) sigma_mm: f64,
}

/// Everything that is sought, at some values.
#[derive(Clone)]
pub(super) struct State {
    pub(super) rig: StripeRig,
    /// How far the rig's numbers have been moved.
    pub(super) rig_values: Vec<f64>,
    pub(super) surfaces: Vec<Surface>,
    /// The parameters of all effects.
    pub(super) values: Vec<f64>,
}

/// Where arm and points are in a state.
pub(super) struct Here {
    flanges: Vec<Isometry3<f64>>,
    /// In the flange's frame.
    seen: Vec<Option<Point3<f64>>>,
    /// In the base's frame.
    points: Vec<Option<Point3<f64>>>,
}

/// The one joint whose coordinate an effect changes, and the rate of each of its parameters in every view.
pub(super) type JointRates = (usize, Vec<Vec<f64>>);

pub(super) struct Problem<'a> {
    pub(super) model: &'a Model,
    pub(super) views: &'a [View],
    pub(super) options: Options,
    effects: Vec<Box<dyn Effect>>,
    /// The parameters of all effects: effect, parameter.
    effect_parameters: Vec<(usize, usize)>,
    pub(super) members: Vec<Member>,
    middles: Vec<Point3<f64>>,
}

pub(super) fn built(model: &Model, ids: &[EffectId]) -> Result<Vec<Box<dyn Effect>>, EffectNameError> {
    ids.iter().map(|id| effect::build(id, model)).collect()
}

/// Where the flange is in a view under these values of effects.
pub(super) fn base_from_flange(
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
    let mut first = 0;
    let with_values = effects.iter().map(|effect| {
        let own = values.get(first..first + effect.parameters().len()).unwrap_or_default();
        first += effect.parameters().len();
        (effect.as_ref(), own)
    });
    let flange = forward::flange(model, with_values, &q, &view.approach);
    Isometry3::from_parts(flange.translation, flange.rotation.into())
}

impl<'a> Problem<'a> {
    /// A problem without points yet.
    pub(super) fn new(
        model: &'a Model,
        views: &'a [View],
        options: Options,
    ) -> Result<Self, EffectNameError> {
        let effects = built(model, &options.effects)?;
        let counts: Vec<usize> = effects.iter().map(|effect| effect.parameters().len()).collect();
        let of_effect =
            |(place, count): (usize, &usize)| (0..*count).map(move |parameter| (place, parameter));
        let effect_parameters = counts.iter().enumerate().flat_map(of_effect).collect();
        Ok(Self {
            model,
            views,
            options,
            effects,
            effect_parameters,
            members: Vec::new(),
            middles: Vec::new(),
        })
    }

    /// The same with more to be sought, and the same points; the state with it.
    pub(super) fn with(&self, state: &State, more: &Options) -> Result<(Self, State), EffectNameError> {
        let mut options = self.options.clone();
        options.rig.extend(&more.rig);
        options.effects.extend(more.effects.iter().cloned());
        let mut problem = Self::new(self.model, self.views, options)?;
        problem.members.clone_from(&self.members);
        problem.middles.clone_from(&self.middles);
        let mut state = state.clone();
        state.rig_values.resize(problem.options.rig.len(), 0.0);
        state.values.resize(problem.effect_parameters.len(), 0.0);
        Ok((problem, state))
    }

    /// The beginning: this rig, these surfaces, no effect.
    pub(super) fn beginning(&self, rig: &StripeRig, surfaces: &[Surface]) -> State {
        State {
            rig: rig.clone(),
            rig_values: vec![0.0; self.options.rig.len()],
            surfaces: surfaces.to_vec(),
            values: vec![0.0; self.effect_parameters.len()],
        }
    }

    pub(super) fn flanges(&self, rig: &StripeRig, values: &[f64]) -> Vec<Isometry3<f64>> {
        let flange =
            |view: &View| base_from_flange(self.model, &self.effects, values, view, rig.clock_skew_s);
        self.views.iter().map(flange).collect()
    }

    /// Gives every point near one surface, and no other, to it.
    pub(super) fn choose(
        &mut self,
        state: &State,
        pixels: &[StripePixel],
        limit: f64,
    ) -> Result<(), AdjustError> {
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

    /// How many numbers the effects have together.
    pub(super) fn effect_values(&self) -> usize {
        self.effect_parameters.len()
    }

    pub(super) fn unknowns(&self, state: &State) -> usize {
        let places: usize = state.surfaces.iter().map(Surface::freedoms).sum();
        self.options.rig.len() + self.effect_parameters.len() + places
    }

    /// What is computed once for all unknowns of a state.
    pub(super) fn here(&self, state: &State) -> Here {
        let (flanges, seen) = (self.flanges(&state.rig, &state.values), self.seen(&state.rig));
        let points = self.points(&flanges, &seen);
        Here { flanges, seen, points }
    }

    /// The members' points in the flange's frame.
    fn seen(&self, rig: &StripeRig) -> Vec<Option<Point3<f64>>> {
        self.members.iter().map(|member| rig.point(member.pixel.u_px, member.pixel.v_px)).collect()
    }

    /// The members' points in the base's frame.
    fn points(&self, flanges: &[Isometry3<f64>], seen: &[Option<Point3<f64>>]) -> Vec<Option<Point3<f64>>> {
        let each = self.members.iter().zip(seen);
        each.map(|(member, seen)| Some(flanges.get(member.pixel.view)? * (*seen)?)).collect()
    }

    /// The members' points in a state, in the base's frame.
    pub(super) fn points_in(&self, state: &State) -> Vec<Option<Point3<f64>>> {
        self.here(state).points
    }

    fn distance(&self, member: &Member, surfaces: &[Surface], point: &Option<Point3<f64>>) -> f64 {
        let distance = |point: &Point3<f64>| Some(surfaces.get(member.surface)?.distance(member.part, point));
        point.as_ref().and_then(distance).unwrap_or(0.0)
    }

    pub(super) fn rms_mm(&self, state: &State) -> f64 {
        let each = self.members.iter().zip(self.here(state).points);
        let squares: f64 =
            each.map(|(member, point)| self.distance(member, &state.surfaces, &point).powi(2)).sum();
        (squares / self.members.len().max(1) as f64).sqrt()
    }

    /// Scatter of neighbouring points of one stripe on one surface, mm, from second differences: what changes evenly along a stripe is not in it.
    pub(super) fn noise_mm(&self, state: &State) -> f64 {
        let here = self.here(state);
        let away: Vec<f64> = self
            .members
            .iter()
            .zip(&here.points)
            .map(|(member, point)| self.distance(member, &state.surfaces, point))
            .collect();
        let same = |one: &Member, other: &Member| {
            one.pixel.view == other.pixel.view && one.surface == other.surface && one.part == other.part
        };
        let three = self.members.windows(3).zip(away.windows(3));
        let bends = three.filter_map(|(members, away)| match (members, away) {
            ([first, middle, last], [before, at, after]) if same(first, middle) && same(middle, last) => {
                Some(before - 2.0 * at + after)
            }
            _ => None,
        });
        let (sum, count) = bends.fold((0.0, 0.0), |(sum, count), bend| (sum + bend * bend, count + 1.0));
        // A second difference has six times the variance of one point.
        (sum / 6.0 / f64::max(count, 1.0)).sqrt()
    }

    /// The joint whose coordinate alone these effects change, if it is one; and the rate of each of their parameters in every view.
    pub(super) fn rates(&self, id: &EffectId) -> Result<Option<JointRates>, EffectNameError> {
        let effect = effect::build(id, self.model)?;
        let Some(joint) = effect.changes_coordinate() else { return Ok(None) };
        let rates = |view: &View| forward::rates(self.model, effect.as_ref(), &view.q, &view.approach);
        Ok(Some((joint, self.views.iter().map(rates).collect())))
    }

    /// Residuals over their sigmas.
    pub(super) fn residuals(&self, state: &State) -> DVector<f64> {
        self.residuals_at(&state.surfaces, &self.here(state).points)
    }

    fn residuals_at(&self, surfaces: &[Surface], points: &[Option<Point3<f64>>]) -> DVector<f64> {
        let each = self.members.iter().zip(points);
        let scaled = each.map(|(member, point)| self.distance(member, surfaces, point) / member.sigma_mm);
        DVector::from_iterator(self.members.len(), scaled)
    }

    /// Moves the unknown of a number; the unknowns are the rig's, the effects', the surfaces'.
    pub(super) fn moved(&self, state: &State, unknown: usize, by: f64) -> State {
        let mut moved = state.clone();
        if let Some(parameter) = self.options.rig.get(unknown) {
            moved.rig = state.rig.moved(*parameter, by);
            if let Some(value) = moved.rig_values.get_mut(unknown) {
                *value += by;
            }
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

    pub(super) fn jacobian(&self, state: &State) -> DMatrix<f64> {
        let here = self.here(state);
        let columns: Vec<DVector<f64>> =
            (0..self.unknowns(state)).map(|unknown| self.slope(state, unknown, &here)).collect();
        DMatrix::from_columns(&columns)
    }

    /// How the residuals change with one of the unknowns; `here` is the state's. What the unknown does not move is not computed anew.
    pub(super) fn slope(&self, state: &State, unknown: usize, here: &Here) -> DVector<f64> {
        let small = self.small(unknown);
        let of_rig = self.options.rig.get(unknown);
        let first_surface = self.options.rig.len() + self.effect_values();
        let moves_arm = of_rig.map_or(unknown < first_surface, |rig| *rig == RigParameter::ClockSkew);
        let residuals = |by: f64| {
            let moved = self.moved(state, unknown, by);
            if moves_arm {
                let points = self.points(&self.flanges(&moved.rig, &moved.values), &here.seen);
                self.residuals_at(&moved.surfaces, &points)
            } else if of_rig.is_some() {
                self.residuals_at(&moved.surfaces, &self.points(&here.flanges, &self.seen(&moved.rig)))
            } else {
                self.residuals_at(&moved.surfaces, &here.points)
            }
        };
        (residuals(small) - residuals(-small)) / (2.0 * small)
    }

    /// Names and units of what is sought, the surfaces' places left out.
    pub(super) fn names(&self) -> Vec<(String, String)> {
        let rig = self.options.rig.iter().map(|parameter| (parameter.name(), parameter.unit().to_owned()));
        let effects = self.effect_parameters.iter().map(|(effect, parameter)| {
            let id = self.options.effects.get(*effect).map(|id| self.model.label(id)).unwrap_or_default();
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
