//! The residual model: from a state to what would be read in every row, less what was read, and how that changes with
//! every free number.

use std::sync::Arc;

use nalgebra::{DMatrix, DVectorViewMut, Vector3};
use plumb_kinematics::LinkFrames;

use super::arm_pose::Changes;
use super::bend_slopes::KeptSlopes;
use super::scratch::Scratch;
use super::state::{FreeParameter, State};
use crate::arm_model::{AddedEffect, MapEffect, Model};
use crate::effect::{self, Contribution, Effect, EffectId, EffectNameError, LooksAt};
use crate::measurement::{Equation, Measurand, Observations, Prediction, RowContext, SensorShift, Subject};
use crate::table::Table;

/// An effect that takes part in a fit.
#[derive(Debug)]
pub struct Part {
    /// Which effect, and where.
    pub id: EffectId,
    /// Its formula.
    pub effect: Arc<dyn Effect>,
    /// What it looks at: asked for row by row, many times.
    pub(super) looks_at: LooksAt,
    /// What it contributes in every row alike; nothing of an effect that looks at something.
    pub(super) constant: Vec<Contribution>,
}

/// A model and a table, ready to be compared.
#[derive(Debug)]
pub struct ResidualModel<'a> {
    /// The arm model.
    pub model: &'a Model,
    /// The measurements.
    pub table: &'a Table,
    /// The equations that the measurements make.
    pub observations: &'a Observations,
    /// The effects whose values may be fitted.
    pub parts: Vec<Part>,
    pub(super) free_parameters: Vec<FreeParameter>,
    start_values: Vec<Vec<f64>>,
    /// The row before each in the order of time.
    pub(super) previous: Vec<Option<usize>>,
    /// The first time that was logged, s.
    pub(super) first_time: f64,
    /// The epoch of each row, from 0.
    pub(super) epochs: Vec<usize>,
    /// What the model's residual map does in each row; empty without one.
    pub(super) mapped: Vec<Option<MapEffect>>,
    /// How what gravity bends changes with the configuration, as far as it was worked out.
    pub(super) kept_slopes: Arc<KeptSlopes>,
}

/// Residuals and derivatives of a few rows. `jacobian` is free parameters by equations; both are divided by each equation's
/// sigma and multiplied by the root of the row's weight.
pub struct RowBlock {
    /// Measured less predicted, divided by the sigmas and weighted.
    pub residuals: Vec<f64>,
    /// Derivatives of the predictions, likewise; one row a parameter, one column an equation.
    pub jacobian: DMatrix<f64>,
}

impl<'a> ResidualModel<'a> {
    /// Sets up the comparison with these effects taking part, at these starting values; each is free.
    ///
    /// # Errors
    /// An effect cannot act in this model.
    pub fn new(
        model: &'a Model,
        table: &'a Table,
        observations: &'a Observations,
        effects: &[AddedEffect],
    ) -> Result<Self, EffectNameError> {
        let mut model = Self {
            model,
            table,
            observations,
            parts: Vec::new(),
            free_parameters: Vec::new(),
            start_values: Vec::new(),
            previous: table.rows_before(),
            first_time: first_time(table),
            epochs: model.epochs.as_ref().map_or_else(Vec::new, |epochs| {
                (0..table.len()).map(|row| epochs.of_row(table, row)).collect()
            }),
            mapped: mapped_rows(model, table),
            kept_slopes: Arc::default(),
        };
        for added in effects {
            let effect = effect::build(&added.id, model.model)?;
            let mut values = added.values.clone();
            // Values that a file leaves out begin at zero.
            values.resize(effect.parameters().len(), 0.0);
            model.parts.push(model.part(added.id.clone(), Arc::from(effect)));
            model.start_values.push(values);
        }
        model.free_parameters = model.all_free_parameters();
        model.kept_slopes = model.no_slopes();
        Ok(model)
    }

    /// Lets one more effect take part, from these values on.
    pub fn admit(&mut self, id: EffectId, effect: Arc<dyn Effect>, values: Vec<f64>) {
        self.parts.push(self.part(id, effect));
        self.start_values.push(values);
        self.free_parameters = self.all_free_parameters();
        self.kept_slopes = self.no_slopes();
    }

    /// Room for slopes of every row, where gravity bends something.
    fn no_slopes(&self) -> Arc<KeptSlopes> {
        let bends = self.parts.iter().any(|part| part.looks_at == LooksAt::Gravity);
        Arc::new(KeptSlopes::for_rows(if bends { self.table.len() } else { 0 }))
    }

    fn part(&self, id: EffectId, effect: Arc<dyn Effect>) -> Part {
        let looks_at = effect.looks_at();
        let mut constant = Vec::new();
        if looks_at == LooksAt::Nothing {
            // Any row would do.
            let start = State::nominal(self.model, 0, Vec::new());
            effect.contribute(&self.sample(&start, 0, &LinkFrames::default(), &[], None), &mut constant);
        }
        Part { id, effect, looks_at, constant }
    }

    /// Uses what an earlier fit worked out of how gravity bends the arm, where that is of the same model and table, and the same bends in both.
    pub fn after(mut self, earlier: &ResidualModel<'_>) -> Self {
        let is_same = std::ptr::eq(self.model, earlier.model) && std::ptr::eq(self.table, earlier.table);
        let bending = |problem: &ResidualModel<'_>| -> Vec<(usize, EffectId)> {
            let parts = problem.parts.iter().enumerate();
            let bending = parts.filter(|(_, part)| part.looks_at == LooksAt::Gravity);
            bending.map(|(index, part)| (index, part.id.clone())).collect()
        };
        let own = bending(&self);
        if is_same && !own.is_empty() && own == bending(earlier) {
            self.kept_slopes = Arc::new(KeptSlopes::after(&earlier.kept_slopes));
        }
        self
    }

    fn all_free_parameters(&self) -> Vec<FreeParameter> {
        let mut free_parameters = Vec::new();
        if self.model.base.free {
            free_parameters.extend((0..3).map(FreeParameter::BaseShift));
            // About the base's own origin: shift and turn stay apart.
            free_parameters.extend((0..3).map(FreeParameter::BaseRotation));
        }
        for (index, _) in self.model.targets.iter().enumerate().filter(|(_, target)| target.free) {
            free_parameters.extend((0..3).map(|axis| FreeParameter::Target(index, axis)));
        }
        free_parameters.extend(self.free_rotations());
        // A touched place is always free: nobody knows where it is.
        for place in 0..self.observations.places.len() {
            free_parameters.extend((0..3).map(|axis| FreeParameter::Place(place, axis)));
        }
        for (index, surface) in self.model.surfaces.iter().enumerate().filter(|(_, surface)| surface.free) {
            let freedoms = match self.table.profiles.is_empty() {
                true => surface.shape.freedoms(),
                false => surface.shape.freedoms_in_space(),
            };
            free_parameters.extend((0..freedoms).map(|which| FreeParameter::Surface(index, which)));
        }
        for (index, part) in self.parts.iter().enumerate() {
            free_parameters.extend(
                (0..part.effect.parameters().len()).map(|parameter| FreeParameter::Effect(index, parameter)),
            );
        }
        free_parameters
    }

    /// The free turns of bodies and cameras, and the board's free place and turn, where the table measures them.
    fn free_rotations(&self) -> Vec<FreeParameter> {
        let mut free_parameters = Vec::new();
        for (index, target) in
            self.model.targets.iter().enumerate().filter(|(_, target)| target.rotation_free)
        {
            // A camera's turn shows in what it sees of the board, a body's in what is seen of it.
            let is_camera = self.model.boards.iter().any(|board| board.camera == index);
            let is_seen = self.table.orientations_of(&target.name).is_some();
            let is_line_sensor = self.model.profile_sensor == Some(index) && !self.table.profiles.is_empty();
            if is_seen || is_line_sensor || (is_camera && self.table.sees_a_board()) {
                free_parameters.extend((0..3).map(|axis| FreeParameter::TargetRotation(index, axis)));
            }
        }
        let seen = self.boards_named();
        for (index, _) in
            self.model.boards.iter().enumerate().filter(|(index, board)| board.free && seen.contains(index))
        {
            free_parameters.extend((0..3).map(|axis| FreeParameter::BoardShift(index, axis)));
            free_parameters.extend((0..3).map(|axis| FreeParameter::BoardRotation(index, axis)));
        }
        free_parameters
    }

    /// Variance of one equation at least, declared sigmas squared. Stripes of neighbouring pictures err alike: how little they scatter about a fit does not say how
    /// well anything is known by them; what they are uncertain by does. Other readings scatter each for itself.
    pub fn least_variance(&self) -> f64 {
        if self.neighbours_err_alike() { 1.0 } else { 0.0 }
    }

    /// Whether readings next to each other err alike: those of stripes do.
    pub fn neighbours_err_alike(&self) -> bool {
        self.table.is_of_stripes()
    }

    /// The epoch of a row, from 0.
    pub fn epoch(&self, row: usize) -> usize {
        self.epochs.get(row).copied().unwrap_or(0)
    }

    /// The free numbers, in the order of steps and covariances.
    pub fn free_parameters(&self) -> &[FreeParameter] {
        &self.free_parameters
    }

    /// The effects that take part.
    pub fn effects(&self) -> impl Iterator<Item = &EffectId> {
        self.parts.iter().map(|part| &part.id)
    }

    /// The state a fit starts from.
    pub fn start(&self) -> State {
        State::nominal(self.model, self.observations.places.len(), self.start_values.clone())
    }

    /// Room for the computation of rows in a state.
    pub(crate) fn scratch<'s>(&self, state: &'s State) -> Scratch<'s> {
        let mut constant = Changes::none(self.model.chain.len(), state.targets.len());
        for (part, values) in self.parts.iter().zip(&state.effects) {
            constant.add(&part.constant, values);
        }
        Scratch::new(state, constant)
    }

    /// Direction of gravity in the base's frame.
    pub(super) fn down(&self, state: &State) -> Vector3<f64> {
        self.model.down(&state.base.rotation)
    }

    /// Upwards in the measurements' frame.
    fn up(&self, state: &State) -> Vector3<f64> {
        // Against gravity, whichever frame it is given in.
        -(state.base.rotation * self.down(state))
    }

    /// What predictions of a row are made from.
    fn context<'s>(
        &'s self,
        row: usize,
        scratch: &'s Scratch<'_>,
        (point, sensor): (Vector3<f64>, SensorShift),
    ) -> RowContext<'s> {
        let Scratch { state, pose, seen, .. } = scratch;
        let (model, table, up) = (self.model, self.table, self.up(state));
        RowContext { model, table, row, state, pose, point, seen: &seen.points, up, sensor }
    }

    /// What an equation is of.
    fn subject(&self, equation: &Equation) -> Subject {
        equation.measurand.kind.subject(self.model, equation.measurand)
    }

    /// A subject's point as the instrument reads it, and what the sensor adds to where it triggers there.
    fn read_point(
        &self,
        row: usize,
        subject: Subject,
        scratch: &mut Scratch<'_>,
    ) -> (Vector3<f64>, SensorShift) {
        let Scratch { state, pose, contributions, seen, .. } = scratch;
        let target = match subject {
            Subject::Target(target) | Subject::Body(target) => target,
            Subject::Camera(camera) => return (pose.point(state, camera).0, SensorShift::default()),
            Subject::Stretch(_) => {
                return (seen.look(self.stretch(subject), pose).0, SensorShift::default());
            }
            Subject::Frame(_) => return (Vector3::zeros(), SensorShift::default()),
        };
        let (point, _) = pose.point(state, target);
        let point = point + self.reading_shift(state, row, point, pose, contributions);
        (point, self.sensor_shift(state, row, point, pose, contributions))
    }

    /// Residuals (measured less predicted, mm and rad) of one row's equations, appended to `out`.
    pub(crate) fn row_residuals(&self, row: usize, scratch: &mut Scratch<'_>, out: &mut Vec<f64>) {
        self.assume(row, scratch);
        let mut known = None;
        for equation in self.observations.of_row(row) {
            let subject = self.subject(equation);
            let read = match known {
                Some((same, read)) if same == subject => read,
                _ => self.read_point(row, subject, scratch),
            };
            known = Some((subject, read));
            let context = self.context(row, scratch, read);
            let what = equation.measurand;
            let (zero, scale) = scratch.pose.reading(what.kind.channel(what));
            out.push(equation.measured - what.kind.predict(what, &context).value * (1.0 + scale) - zero);
        }
    }

    /// Residuals and derivatives of the given rows, for the free parameters, followed by the parameters of `probes`
    /// (effects that do not take part, at zero). Rows are scaled by sigma and the root of their weight.
    pub fn block(&self, state: &State, rows: &[usize], weights: &[f64], probes: &[&dyn Effect]) -> RowBlock {
        self.block_and_rates(state, rows, weights, probes, &[]).0
    }

    /// The same, and the contributions of further effects by their parameters: parameters by rows. For effects that
    /// change one joint's coordinate and nothing else.
    pub fn block_and_rates(
        &self,
        state: &State,
        rows: &[usize],
        weights: &[f64],
        probes: &[&dyn Effect],
        driving: &[&dyn Effect],
    ) -> (RowBlock, DMatrix<f64>) {
        let equations: usize = rows.iter().map(|row| self.observations.range(*row).len()).sum();
        let probe_parameters: usize = probes.iter().map(|probe| probe.parameters().len()).sum();
        let width = self.free_parameters.len() + probe_parameters;
        let mut block =
            RowBlock { residuals: Vec::with_capacity(equations), jacobian: DMatrix::zeros(width, equations) };
        let driven: usize = driving.iter().map(|effect| effect.parameters().len()).sum();
        let mut rates = DMatrix::zeros(driven, rows.len());
        let mut scratch = self.scratch(state);
        let mut column = 0;
        for (row, mut rates) in rows.iter().zip(rates.column_iter_mut()) {
            // The root: least squares squares it again.
            let weight = weights.get(*row).copied().unwrap_or(1.0).sqrt();
            column = self.row_block(*row, weight, probes, &mut scratch, &mut block, column);
            self.rates(*row, driving, &mut scratch, rates.as_mut_slice());
        }
        (block, rates)
    }

    /// The rate at which every parameter of some effects contributes, in a row whose configuration is known.
    fn rates(&self, row: usize, driving: &[&dyn Effect], scratch: &mut Scratch<'_>, rates: &mut [f64]) {
        let Scratch { state, pose, contributions, .. } = scratch;
        let sample = self.sample(state, row, &pose.link_frames, &pose.moments, None);
        let mut first = 0;
        for effect in driving {
            for contribution in sample.contributions_of(*effect, contributions) {
                if let Some(rate) = rates.get_mut(first + contribution.parameter) {
                    *rate += contribution.rate;
                }
            }
            first += effect.parameters().len();
        }
    }

    /// One row's part of a block, from `column` on; returns the column after it.
    fn row_block(
        &self,
        row: usize,
        weight: f64,
        probes: &[&dyn Effect],
        scratch: &mut Scratch<'_>,
        block: &mut RowBlock,
        mut column: usize,
    ) -> usize {
        self.assume(row, scratch);
        self.response(row, scratch);
        let mut known = None;
        for equation in self.observations.of_row(row) {
            let subject = self.subject(equation);
            let read = match known {
                Some((same, read)) if same == subject => read,
                _ => self.motions(row, subject, probes, scratch),
            };
            known = Some((subject, read));
            let context = self.context(row, scratch, read);
            let prediction = equation.measurand.kind.predict(equation.measurand, &context);
            let channel = equation.measurand.kind.channel(equation.measurand);
            let (zero, stretch) = scratch.pose.reading(channel);
            // In declared sigmas, so that mm and rad may be beside each other.
            let scale = weight / equation.sigma;
            block.residuals.push((equation.measured - prediction.value * (1.0 + stretch) - zero) * scale);
            if column < block.jacobian.ncols() {
                let what = equation.measurand;
                let entries = block.jacobian.column_mut(column);
                self.derivatives(what, (&context, prediction), (scale, stretch), scratch, entries);
            }
            column += 1;
        }
        column
    }

    /// One equation's derivatives by all free numbers and probes, times `scale`; `stretch` is the fraction by which it is read too large.
    fn derivatives(
        &self,
        what: Measurand,
        (context, prediction): (&RowContext<'_>, Prediction),
        (scale, stretch): (f64, f64),
        scratch: &Scratch<'_>,
        mut entries: DVectorViewMut<'_, f64>,
    ) {
        // Chain rule: the prediction by the subject's point and attitude, these by each number.
        let (by_point, by_rotation) = (prediction.by_point * scale, prediction.by_rotation * scale);
        let motion = &scratch.motion;
        let entries = entries.as_mut_slice();
        for (entry, linear) in entries.iter_mut().zip(&motion.linear) {
            *entry = by_point.dot(linear) * (1.0 + stretch);
        }
        // Coordinates of a point do not depend on how its subject is turned, and most equations are coordinates.
        if by_rotation != Vector3::zeros() {
            for (entry, angular) in entries.iter_mut().zip(&motion.angular) {
                *entry += by_rotation.dot(angular) * (1.0 + stretch);
            }
        }
        // What the sensor adds is subtracted from the distance: its derivative is minus one.
        if what.kind.sensor_dof(self.model, what).is_some() {
            for (entry, sensor) in entries.iter_mut().zip(&motion.sensor) {
                *entry -= scale * sensor;
            }
        }
        let channel = what.kind.channel(what);
        for rates in motion.readings.iter().filter(|rates| channel == Some(rates.channel)) {
            // Read is `predicted (1 + scale) + zero`: by the scale it grows by the prediction, by the zero by one.
            if let Some(entry) = entries.get_mut(rates.index) {
                *entry += (rates.zero + rates.scale * prediction.value) * scale;
            }
        }
        for (index, number, rate) in &motion.rig {
            let moved = scratch.seen.moved(*number);
            if let Some(entry) = entries.get_mut(*index) {
                *entry += rate * what.kind.by_seen_points(what, context, moved) * scale;
            }
        }
        // Surfaces and places are moved by no twist of the arm: their kind says what they do, and overwrites.
        what.kind.own_derivatives(what, context, &mut |requested, value| {
            let index = self.free_parameters.iter().position(|free_parameter| *free_parameter == requested);
            if let Some(entry) = index.and_then(|index| entries.get_mut(index)) {
                *entry = value * scale;
            }
        });
    }
}

/// What a model's residual map does in each row of a table; nothing where it does not hold.
fn mapped_rows(model: &Model, table: &Table) -> Vec<Option<MapEffect>> {
    let (Some(map), Some(region)) = (&model.residual_map, &model.measured_region) else { return Vec::new() };
    (0..table.len())
        .map(|row| {
            let sides: Vec<i8> = (0..table.joints).map(|joint| table.approach_of(row, joint)).collect();
            map.at(region, table.q_of(row), &sides)
        })
        .collect()
}

/// The first finite time in a table, s; 0 where none is logged.
fn first_time(table: &Table) -> f64 {
    let times = table.time.iter().flatten().copied().filter(|time| time.is_finite());
    let first = times.fold(f64::INFINITY, f64::min);
    if first.is_finite() { first } else { 0.0 }
}
