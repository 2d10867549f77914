//! The machine as a function: from a state to what would be read in every row, and how that moves with every free
//! number.

use std::sync::Arc;

use nalgebra::{DMatrix, Matrix3, Vector3};
use plumb_kinematics::{Deviation, Knob, Posture, Weights};

use super::observations::{Equation, Observations, Reading};
use super::state::{Slot, State, square_to, surface_freedoms};
use crate::effect::{self, Drive, Effect, EffectId, EffectNameError, Handle, LooksAt, Situation, Trigger};
use crate::file::{AddedEffect, Frame, Model, SurfaceShape};
use crate::table::Table;

/// An effect that takes part in a fit.
#[derive(Debug)]
pub(crate) struct Part {
    pub(crate) id: EffectId,
    pub(crate) effect: Arc<dyn Effect>,
}

/// A model and a table, ready to be compared.
#[derive(Debug)]
pub struct Machine<'a> {
    pub(crate) model: &'a Model,
    pub(crate) table: &'a Table,
    pub(crate) observations: &'a Observations,
    pub(crate) parts: Vec<Part>,
    pub(crate) slots: Vec<Slot>,
    start_values: Vec<Vec<f64>>,
    previous: Vec<Option<usize>>,
    first_time: f64,
}

/// Residuals and derivatives of a few rows. `jacobian` is slots by equations; both are divided by each equation's
/// sigma and multiplied by the root of the row's weight.
pub(crate) struct RowBlock {
    pub(crate) residuals: Vec<f64>,
    pub(crate) jacobian: DMatrix<f64>,
}

/// Room for one row's computation.
#[derive(Default)]
pub(crate) struct Scratch {
    posture: Posture,
    deviations: Vec<Deviation>,
    moments: Vec<f64>,
    drives: Vec<Drive>,
    base_shift: Vector3<f64>,
    base_turn: Vector3<f64>,
    /// Shift of the base's origin and turn about it that bent links give everything beyond them, base frame.
    bend_shift: Vector3<f64>,
    bend_turn: Vector3<f64>,
    target_shifts: Vec<Vector3<f64>>,
    /// Distance over a surface at which the sensor triggers, mm; and how it (at an edge: the place left of it) grows per slot and probe.
    trigger_height: f64,
    triggers: Vec<f64>,
    /// What the sensor itself adds to where it triggers: over a surface, and left of an edge, mm; and how the latter grows with its height.
    seen_above: f64,
    seen_left: f64,
    left_by_height: f64,
    linear: Vec<Vector3<f64>>,
    angular: Vec<Vector3<f64>>,
    /// How the subject moves when a joint turns, one a joint.
    turned: Vec<(Vector3<f64>, Vector3<f64>)>,
}

/// What an equation is of: a target's point, or the level's frame.
#[derive(Clone, Copy, PartialEq)]
enum Subject {
    Target(usize),
    Level(usize),
}

/// An equation's prediction and how it changes with its subject's point and attitude.
struct Prediction {
    value: f64,
    by_point: Vector3<f64>,
    by_turn: Vector3<f64>,
}

impl<'a> Machine<'a> {
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
        let mut parts = Vec::new();
        let mut start_values = Vec::new();
        for added in effects {
            let built = effect::build(&added.id, model)?;
            let mut values = added.values.clone();
            values.resize(built.parameters().len(), 0.0);
            parts.push(Part { id: added.id.clone(), effect: Arc::from(built) });
            start_values.push(values);
        }
        let order = table.order();
        let mut previous = vec![None; table.len()];
        for pair in order.windows(2) {
            if let [before, after] = pair
                && let Some(slot) = previous.get_mut(*after)
            {
                *slot = Some(*before);
            }
        }
        let times = table.time.iter().flatten().copied().filter(|time| time.is_finite());
        let first_time = times.fold(f64::INFINITY, f64::min);
        let mut machine = Self {
            model,
            table,
            observations,
            parts,
            slots: Vec::new(),
            start_values,
            previous,
            first_time: if first_time.is_finite() { first_time } else { 0.0 },
        };
        machine.slots = machine.free_slots();
        Ok(machine)
    }

    /// Lets one more effect take part, from these values on.
    pub(crate) fn admit(&mut self, id: EffectId, effect: Arc<dyn Effect>, values: Vec<f64>) {
        self.parts.push(Part { id, effect });
        self.start_values.push(values);
        self.slots = self.free_slots();
    }

    fn free_slots(&self) -> Vec<Slot> {
        let mut slots = Vec::new();
        if self.model.base.free {
            slots.extend((0..3).map(Slot::BaseShift));
            slots.extend((0..3).map(Slot::BaseTurn));
        }
        for (index, target) in self.model.targets.iter().enumerate().filter(|(_, target)| target.free) {
            let _ = target;
            slots.extend((0..3).map(|axis| Slot::Target(index, axis)));
        }
        for place in 0..self.observations.places.len() {
            slots.extend((0..3).map(|axis| Slot::Place(place, axis)));
        }
        for (index, surface) in self.model.surfaces.iter().enumerate().filter(|(_, surface)| surface.free) {
            slots.extend((0..surface_freedoms(&surface.shape)).map(|which| Slot::Surface(index, which)));
        }
        for (index, part) in self.parts.iter().enumerate() {
            slots.extend((0..part.effect.parameters().len()).map(|parameter| Slot::Effect(index, parameter)));
        }
        slots
    }

    /// The free numbers, in the order of steps and covariances.
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// The effects that take part.
    pub fn effects(&self) -> impl Iterator<Item = &EffectId> {
        self.parts.iter().map(|part| &part.id)
    }

    /// The state a fit starts from.
    pub fn start(&self) -> State {
        State::nominal(self.model, self.observations.places.len(), self.start_values.clone())
    }

    /// Direction of gravity in the base's frame.
    fn down(&self, state: &State) -> Vector3<f64> {
        self.model.down(&state.base.rotation)
    }

    /// Upwards in the measurements' frame.
    fn up(&self, state: &State) -> Vector3<f64> {
        -(state.base.rotation * self.down(state))
    }

    fn situation<'s>(
        &'s self,
        state: &State,
        row: usize,
        posture: &'s Posture,
        moments: &'s [f64],
        point: Option<Vector3<f64>>,
    ) -> Situation<'s> {
        let joints = self.table.joints;
        let cell = |column: &Option<Vec<f64>>| column.as_ref().and_then(|column| column.get(row)).copied();
        let approach =
            self.table.approach.as_deref().and_then(|sides| sides.get(row * joints..(row + 1) * joints));
        let hand = point.map_or_else(Matrix3::identity, |_| {
            state.base.rotation.matrix() * posture.flange.rotation.matrix()
        });
        Situation {
            chain: &self.model.chain,
            q: self.table.q_of(row),
            previous: self.previous.get(row).copied().flatten().map(|before| self.table.q_of(before)),
            approach: approach.unwrap_or(&[]),
            time: cell(&self.table.time).map_or(f64::NAN, |time| time - self.first_time),
            clock: cell(&self.table.time).unwrap_or(row as f64),
            temperature: cell(&self.table.temperature).unwrap_or(f64::NAN),
            weights: self.weights(state, row),
            moments,
            posture,
            point: point.unwrap_or_else(Vector3::zeros),
            hand,
            trigger: self.trigger(state, row, point, hand.column(2).into_owned()),
        }
    }

    /// What the arm's own sensor did in a row, if it triggered there looking in the direction `look`.
    fn trigger(
        &self,
        state: &State,
        row: usize,
        point: Option<Vector3<f64>>,
        look: Vector3<f64>,
    ) -> Option<Trigger> {
        let over = self.observations.of_row(row).iter().find_map(|equation| match equation.reading {
            Reading::Trigger(surface) => Some(usize::from(surface)),
            _ => None,
        });
        let surface = over?;
        let known = self.model.surfaces.get(surface)?;
        let edge = matches!(known.shape, SurfaceShape::Line { .. });
        let sensor = self.model.sensor;
        let distance = match (sensor, point) {
            // At an edge it works over the table; over anything else, over that.
            (Some(sensor), Some(point)) if edge => sensor.working + ahead(state, &point, &look),
            (Some(sensor), Some(point)) => {
                let shape = state.surfaces.get(surface);
                sensor.working + shape.map_or(0.0, |shape| away_from(shape, &point, &Vector3::z()).0)
            }
            _ => f64::NAN,
        };
        Some(Trigger {
            surface,
            edge,
            light: known.light.unwrap_or(0.0),
            // Where it is not logged, a sensor comes on over something and goes off at an edge.
            came_on: self.table.came_on(row).unwrap_or(!edge),
            distance,
            sensor,
        })
    }

    /// What the sensor adds to where it triggers, by its data sheet and by the effects that take part.
    fn see(&self, state: &State, row: usize, point: Vector3<f64>, scratch: &mut Scratch) {
        if self.model.sensor.is_none() {
            return;
        }
        (scratch.seen_above, scratch.seen_left) = self.seen(state, row, point, scratch);
        let higher = point + up_from_table(state) * PROBE_HEIGHT;
        let (_, left) = self.seen(state, row, higher, scratch);
        scratch.left_by_height = (left - scratch.seen_left) / PROBE_HEIGHT;
    }

    fn seen(&self, state: &State, row: usize, point: Vector3<f64>, scratch: &mut Scratch) -> (f64, f64) {
        let mut drives = std::mem::take(&mut scratch.drives);
        let situation = self.situation(state, row, &scratch.posture, &scratch.moments, Some(point));
        let (mut above, mut left) = match situation.trigger {
            Some(Trigger { edge: true, light, came_on, distance, sensor: Some(sensor), .. }) => {
                (0.0, light * 0.5 * sensor.spot * sensor.early(came_on, distance, sensor.hysteresis))
            }
            Some(Trigger { edge: false, came_on, sensor: Some(sensor), .. }) => {
                (sensor.above(came_on, sensor.hysteresis), 0.0)
            }
            _ => (0.0, 0.0),
        };
        for (part, values) in self.parts.iter().zip(&state.effects) {
            if part.effect.looks_at() == LooksAt::Point {
                drives.clear();
                part.effect.drive(&situation, &mut drives);
                for drive in &drives {
                    let amount = drive.rate * values.get(drive.parameter).copied().unwrap_or(0.0);
                    match drive.handle {
                        Handle::Trigger => above += amount,
                        Handle::Edge => left += amount,
                        _ => {}
                    }
                }
            }
        }
        scratch.drives = drives;
        (above, left)
    }

    /// What steps in time are dated by in a row; nothing where a logged time is not finite.
    pub(crate) fn clock(&self, row: usize) -> Option<f64> {
        let clock = self.table.time.as_ref().map_or(Some(row as f64), |time| time.get(row).copied());
        clock.filter(|clock| clock.is_finite())
    }

    /// Everything with weight in a row.
    fn weights(&self, state: &State, row: usize) -> Weights<'_> {
        let load = self.table.payload.as_ref().and_then(|loads| loads.get(row)).copied();
        let payload = load.filter(|load| load.is_finite()).unwrap_or(0.0);
        Weights { masses: &self.model.masses, payload, down: self.down(state) }
    }

    /// Brings the arm into a row's pose: deviations of all effects in, gravity in balance with what it bends.
    fn assume(&self, state: &State, row: usize, scratch: &mut Scratch) {
        let joints = self.model.chain.len();
        scratch.deviations.clear();
        scratch.deviations.resize(joints, Deviation::default());
        scratch.base_shift = Vector3::zeros();
        scratch.base_turn = Vector3::zeros();
        scratch.bend_shift = Vector3::zeros();
        scratch.bend_turn = Vector3::zeros();
        scratch.trigger_height = 0.0;
        scratch.target_shifts.clear();
        scratch.target_shifts.resize(state.targets.len(), Vector3::zeros());
        let mut drives = std::mem::take(&mut scratch.drives);
        let idle = Posture::default();
        let situation = self.situation(state, row, &idle, &[], None);
        for (part, values) in self.parts.iter().zip(&state.effects) {
            if part.effect.looks_at() == LooksAt::Conditions {
                drives.clear();
                part.effect.drive(&situation, &mut drives);
                apply(&drives, values, scratch);
            }
        }
        if self.parts.iter().any(|part| part.effect.looks_at() == LooksAt::Gravity) {
            self.balance(state, row, &mut drives, scratch);
        }
        scratch.drives = drives;
        scratch.posture.update(&self.model.chain, self.table.q_of(row), &scratch.deviations);
        self.weights(state, row).moments(&scratch.posture, &mut scratch.moments);
    }

    /// What bends under its own weight changes the moments that bend it: a few rounds settle it.
    fn balance(&self, state: &State, row: usize, drives: &mut Vec<Drive>, scratch: &mut Scratch) {
        let stiff = scratch.deviations.clone();
        for _ in 0..3 {
            scratch.posture.update(&self.model.chain, self.table.q_of(row), &scratch.deviations);
            self.weights(state, row).moments(&scratch.posture, &mut scratch.moments);
            let mut posture = std::mem::take(&mut scratch.posture);
            let moments = std::mem::take(&mut scratch.moments);
            scratch.deviations.clone_from(&stiff);
            scratch.bend_shift = Vector3::zeros();
            scratch.bend_turn = Vector3::zeros();
            let situation = self.situation(state, row, &posture, &moments, None);
            for (part, values) in self.parts.iter().zip(&state.effects) {
                if part.effect.looks_at() == LooksAt::Gravity {
                    drives.clear();
                    part.effect.drive(&situation, drives);
                    apply(drives, values, scratch);
                }
            }
            std::mem::swap(&mut scratch.posture, &mut posture);
            scratch.moments = moments;
        }
    }

    fn subject(&self, reading: Reading) -> Subject {
        match reading {
            Reading::Position(target, _) => Subject::Target(usize::from(target)),
            Reading::Touch(..) => {
                let name = self.model.touch.as_ref().map_or("p1", |touch| touch.target.as_str());
                Subject::Target(self.model.target_position(name).unwrap_or(0))
            }
            Reading::Surface(_) | Reading::Trigger(_) | Reading::Distance(_) => Subject::Target(0),
            Reading::Tilt(level, _) => Subject::Level(usize::from(level)),
        }
    }

    /// The base's pose with what effects do to it in this row.
    fn base(&self, state: &State, scratch: &Scratch) -> (Matrix3<f64>, Vector3<f64>) {
        let turned = nalgebra::Rotation3::new(scratch.base_turn) * state.base.rotation;
        (turned.into_inner(), state.base.translation.vector + scratch.base_shift)
    }

    /// A target's point in the measurements' frame and in the base's frame.
    fn point(&self, state: &State, target: usize, scratch: &Scratch) -> (Vector3<f64>, Vector3<f64>) {
        let tool = state.targets.get(target).copied().unwrap_or_else(Vector3::zeros);
        let shift = scratch.target_shifts.get(target).copied().unwrap_or_else(Vector3::zeros);
        let stiff = (scratch.posture.flange * nalgebra::Point3::from(tool + shift)).coords;
        let in_base = stiff + scratch.bend_shift + scratch.bend_turn.cross(&stiff);
        let (rotation, origin) = self.base(state, scratch);
        (rotation * in_base + origin, in_base)
    }

    /// What the instrument adds to a point's coordinates.
    fn reading_shift(
        &self,
        state: &State,
        row: usize,
        point: Vector3<f64>,
        scratch: &mut Scratch,
    ) -> Vector3<f64> {
        if self.parts.iter().all(|part| part.effect.looks_at() != LooksAt::Point) {
            return Vector3::zeros();
        }
        let mut shift = Vector3::zeros();
        let mut drives = std::mem::take(&mut scratch.drives);
        let situation = self.situation(state, row, &scratch.posture, &scratch.moments, Some(point));
        for (part, values) in self.parts.iter().zip(&state.effects) {
            if part.effect.looks_at() == LooksAt::Point {
                drives.clear();
                part.effect.drive(&situation, &mut drives);
                for drive in &drives {
                    if let Handle::Reading(axis) = drive.handle
                        && let Some(component) = shift.get_mut(axis)
                    {
                        *component += drive.rate * values.get(drive.parameter).copied().unwrap_or(0.0);
                    }
                }
            }
        }
        scratch.drives = drives;
        shift
    }

    fn predict(
        &self,
        state: &State,
        equation: &Equation,
        point: &Vector3<f64>,
        up: &Vector3<f64>,
        scratch: &Scratch,
    ) -> Prediction {
        let of_point =
            |value: f64, by_point: Vector3<f64>| Prediction { value, by_point, by_turn: Vector3::zeros() };
        let unit = |axis: u8| Vector3::ith(usize::from(axis.min(2)), 1.0);
        match equation.reading {
            Reading::Position(_, axis) => of_point(point.dot(&unit(axis)), unit(axis)),
            Reading::Touch(place, axis) => {
                let place = state.places.get(place as usize).copied().unwrap_or_else(Vector3::zeros);
                of_point((point - place).dot(&unit(axis)), unit(axis))
            }
            Reading::Surface(surface) | Reading::Trigger(surface) => {
                let away = |point: &Vector3<f64>| {
                    let shape = state.surfaces.get(usize::from(surface));
                    shape.map_or_else(|| (0.0, Vector3::zeros()), |shape| away_from(shape, point, up))
                };
                let (value, normal) = away(point);
                match self.trigger_handle(equation.reading) {
                    Some(Handle::Edge) => {
                        if self.model.sensor.is_none() {
                            return of_point(value, normal);
                        }
                        // A hand that tilts looks aside: what counts is the place on the table at which the sensor looks.
                        let (base, _) = self.base(state, scratch);
                        let look = base * scratch.posture.flange.rotation.matrix().column(2);
                        let (far, table) = (ahead(state, point, &look), up_from_table(state));
                        let (value, normal) = away(&(point + look * far));
                        // The further it looks, the earlier or later a spot of some width meets the edge.
                        let by_height = table * scratch.left_by_height;
                        let beside = normal - table * (normal.dot(&look) / steepness(&look, &table));
                        Prediction {
                            value: value - scratch.seen_left,
                            by_point: beside - by_height,
                            by_turn: look.cross(&(beside - by_height)) * far,
                        }
                    }
                    Some(_) => of_point(value - scratch.trigger_height - scratch.seen_above, normal),
                    None => of_point(value, normal),
                }
            }
            Reading::Distance(surface) => {
                let place = match state.surfaces.get(usize::from(surface)) {
                    Some(SurfaceShape::Point { point } | SurfaceShape::Line { point, .. }) => *point,
                    Some(SurfaceShape::Sphere { centre, .. }) => *centre,
                    Some(SurfaceShape::Plane { normal, offset }) => normal * *offset,
                    None => Vector3::zeros(),
                };
                let offset = point - place;
                let length = offset.norm();
                of_point(length, if length > 1e-9 { offset / length } else { Vector3::zeros() })
            }
            Reading::Tilt(level, axis) => self.tilt(state, (usize::from(level), axis), up, scratch),
        }
    }

    /// What says where a sensor triggers: over a plane or ball its height, at an edge how far beside it.
    fn trigger_handle(&self, reading: Reading) -> Option<Handle> {
        let Reading::Trigger(surface) = reading else { return None };
        match self.model.surfaces.get(usize::from(surface)).map(|surface| &surface.shape)? {
            SurfaceShape::Plane { .. } | SurfaceShape::Sphere { .. } => Some(Handle::Trigger),
            SurfaceShape::Line { .. } => Some(Handle::Edge),
            SurfaceShape::Point { .. } => None,
        }
    }

    fn tilt(
        &self,
        state: &State,
        (level, axis): (usize, u8),
        up: &Vector3<f64>,
        scratch: &Scratch,
    ) -> Prediction {
        let (base, _) = self.base(state, scratch);
        let level = self.model.levels.get(level);
        let frame = match level.map(|level| level.frame) {
            Some(Frame::After(joint)) => scratch
                .posture
                .joints
                .get(joint)
                .map_or_else(Matrix3::identity, |frame| frame.end.rotation.into_inner()),
            Some(Frame::Base) | None => Matrix3::identity(),
        };
        let bent = nalgebra::Rotation3::new(scratch.bend_turn).into_inner();
        let attitude =
            base * bent * frame * level.map_or_else(Matrix3::identity, |level| level.rotation.into_inner());
        let column = |index: usize| attitude.column(index).into_owned();
        let (side, sense) = if axis == 0 { (1, 1.0) } else { (0, -1.0) };
        let (across, along) = (sense * column(side).dot(up), column(2).dot(up));
        let scale = (across * across + along * along).max(1e-30);
        let turn = |index: usize| column(index).cross(up);
        let by_turn = (turn(side) * (sense * along) - turn(2) * across) / scale;
        Prediction { value: across.atan2(along), by_point: Vector3::zeros(), by_turn }
    }

    /// Residuals (measured less predicted, mm and rad) of one row's equations, appended to `out`.
    pub(crate) fn row_residuals(&self, state: &State, row: usize, scratch: &mut Scratch, out: &mut Vec<f64>) {
        self.assume(state, row, scratch);
        let up = self.up(state);
        let mut known: Option<(usize, Vector3<f64>)> = None;
        for equation in self.observations.of_row(row) {
            let point = match self.subject(equation.reading) {
                Subject::Level(_) => Vector3::zeros(),
                Subject::Target(target) => match known {
                    Some((same, point)) if same == target => point,
                    _ => {
                        let (point, _) = self.point(state, target, scratch);
                        let point = point + self.reading_shift(state, row, point, scratch);
                        self.see(state, row, point, scratch);
                        known = Some((target, point));
                        point
                    }
                },
            };
            out.push(equation.measured - self.predict(state, equation, &point, &up, scratch).value);
        }
    }

    /// Works every formula of the model out in every row, so that none fails later.
    ///
    /// # Errors
    /// A formula gives no finite number somewhere.
    pub(crate) fn check_formulas(&self) -> Result<(), Box<crate::effect::DefinitionError>> {
        let state = self.start();
        for definition in &self.model.definitions {
            definition.check(self.table, &|row, look| {
                let mut scratch = Scratch::default();
                self.assume(&state, row, &mut scratch);
                let (point, _) = self.point(&state, 0, &scratch);
                look(&self.situation(&state, row, &scratch.posture, &scratch.moments, Some(point)));
            })?;
        }
        Ok(())
    }

    /// The flange in a row's pose, base frame.
    pub(crate) fn flange(
        &self,
        state: &State,
        row: usize,
        scratch: &mut Scratch,
    ) -> nalgebra::IsometryMatrix3<f64> {
        self.assume(state, row, scratch);
        scratch.posture.flange
    }

    /// Where a row's first target is believed to be, mm, frame of the measurements.
    pub(crate) fn believed_point(&self, state: &State, row: usize) -> Vector3<f64> {
        self.believed_target(state, 0, row)
    }

    /// Where a target of the model (by its place in the file, from 0) is believed to be in a row, mm, frame of the measurements.
    pub(crate) fn believed_target(&self, state: &State, target: usize, row: usize) -> Vector3<f64> {
        let mut scratch = Scratch::default();
        self.assume(state, row, &mut scratch);
        self.point(state, target, &scratch).0
    }

    /// Whether every joint, the flange and every target stay clear of some half-spaces (base frame) in a row's pose.
    pub(crate) fn stays_clear(
        &self,
        state: &State,
        row: usize,
        keep_out: &[crate::diagnosis::KeepOut],
    ) -> bool {
        let mut scratch = Scratch::default();
        self.assume(state, row, &mut scratch);
        let flange = scratch.posture.flange;
        let targets = state.targets.iter().map(|target| (flange * nalgebra::Point3::from(*target)).coords);
        let joints = scratch.posture.joints.iter().skip(1).map(|joint| joint.axis_point);
        let clear = |point: Vector3<f64>| {
            keep_out.iter().all(|plane| Vector3::from(plane.normal).dot(&point) >= plane.offset)
        };
        joints.chain([flange.translation.vector]).chain(targets).all(clear)
    }

    /// The points along the arm in a row, from the base's origin to the first target, mm, frame of the measurements.
    pub(crate) fn points_along(&self, state: &State, row: usize) -> Vec<Vector3<f64>> {
        let mut scratch = Scratch::default();
        self.assume(state, row, &mut scratch);
        let (turn, origin) = self.base(state, &scratch);
        let ends = scratch.posture.joints.iter().map(|joint| origin + turn * joint.end.translation.vector);
        let tip = self.point(state, 0, &scratch).0;
        std::iter::once(origin).chain(ends).chain([tip]).collect()
    }

    /// Moments of gravity of a row, and how its first target moves with each joint.
    pub(crate) fn row_details(&self, state: &State, row: usize) -> RowDetails {
        let mut scratch = Scratch::default();
        self.assume(state, row, &mut scratch);
        let (_, in_base) = self.point(state, 0, &scratch);
        let (base, _) = self.base(state, &scratch);
        let by_joint = (0..self.model.chain.len())
            .map(|joint| base * scratch.posture.twist(joint, Knob::Theta, &in_base).linear)
            .collect();
        RowDetails { moments: scratch.moments, by_joint }
    }

    /// How the subject's point and attitude move with one handle.
    fn handle_motion(
        &self,
        handle: Handle,
        subject: Subject,
        frames: &Frames<'_>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        match handle {
            Handle::Joint(joint, knob) => {
                if frames.carried_by.is_some_and(|carrier| joint > carrier) {
                    return (Vector3::zeros(), Vector3::zeros());
                }
                match (knob, frames.turned.get(joint)) {
                    // Most effects turn joints: that is worked out once a row.
                    (Knob::Theta, Some(turned)) => *turned,
                    _ => frames.moved(joint, knob),
                }
            }
            Handle::Target(target, axis) if subject == Subject::Target(target) => {
                (frames.base * frames.posture.flange.rotation.matrix().column(axis.min(2)), Vector3::zeros())
            }
            Handle::Target(..) => (Vector3::zeros(), Vector3::zeros()),
            Handle::BaseShift(axis) => (Vector3::ith(axis.min(2), 1.0), Vector3::zeros()),
            Handle::BaseTurn(axis) => {
                let axis = Vector3::ith(axis.min(2), 1.0);
                (axis.cross(&(frames.point - frames.origin)), axis)
            }
            Handle::Reading(axis) => (Vector3::ith(axis.min(2), 1.0), Vector3::zeros()),
            Handle::Trigger | Handle::Edge => (Vector3::zeros(), Vector3::zeros()),
            Handle::Twist { after, shift, turn, about } => {
                if frames.carried_by.is_some_and(|carrier| after > carrier) {
                    return (Vector3::zeros(), Vector3::zeros());
                }
                (frames.base * (shift + turn.cross(&(frames.in_base - about))), frames.base * turn)
            }
        }
    }

    /// Residuals and derivatives of the given rows, for the free slots, followed by the parameters of `probes`
    /// (effects that do not take part, at zero). Rows are scaled by sigma and the root of their weight.
    pub(crate) fn block(
        &self,
        state: &State,
        rows: &[usize],
        weights: &[f64],
        probes: &[&dyn Effect],
    ) -> RowBlock {
        self.block_and_rates(state, rows, weights, probes, &[]).0
    }

    /// The same, and how fast the parameters of further effects drive what they drive: parameters by rows. For effects that
    /// change one joint's coordinate and nothing else.
    pub(crate) fn block_and_rates(
        &self,
        state: &State,
        rows: &[usize],
        weights: &[f64],
        probes: &[&dyn Effect],
        driving: &[&dyn Effect],
    ) -> (RowBlock, DMatrix<f64>) {
        let equations: usize = rows.iter().map(|row| self.observations.range(*row).len()).sum();
        let probe_parameters: usize = probes.iter().map(|probe| probe.parameters().len()).sum();
        let width = self.slots.len() + probe_parameters;
        let mut block =
            RowBlock { residuals: Vec::with_capacity(equations), jacobian: DMatrix::zeros(width, equations) };
        let driven: usize = driving.iter().map(|effect| effect.parameters().len()).sum();
        let mut rates = DMatrix::zeros(driven, rows.len());
        let mut scratch = Scratch::default();
        let mut column = 0;
        for (row, mut rates) in rows.iter().zip(rates.column_iter_mut()) {
            let weight = weights.get(*row).copied().unwrap_or(1.0).sqrt();
            column = self.row_block(state, *row, weight, probes, &mut scratch, &mut block, column);
            self.rates(state, *row, driving, &mut scratch, rates.as_mut_slice());
        }
        (block, rates)
    }

    /// How fast every parameter of some effects drives what it drives, in a row whose posture is known.
    fn rates(
        &self,
        state: &State,
        row: usize,
        driving: &[&dyn Effect],
        scratch: &mut Scratch,
        rates: &mut [f64],
    ) {
        let mut drives = std::mem::take(&mut scratch.drives);
        let situation = self.situation(state, row, &scratch.posture, &scratch.moments, None);
        let mut first = 0;
        for effect in driving {
            drives.clear();
            effect.drive(&situation, &mut drives);
            for drive in &drives {
                if let Some(rate) = rates.get_mut(first + drive.parameter) {
                    *rate += drive.rate;
                }
            }
            first += effect.parameters().len();
        }
        scratch.drives = drives;
    }

    #[allow(
        clippy::too_many_arguments,
        reason = "one inner loop of the fit; a struct for its six parts would only be unpacked here"
    )]
    fn row_block(
        &self,
        state: &State,
        row: usize,
        weight: f64,
        probes: &[&dyn Effect],
        scratch: &mut Scratch,
        block: &mut RowBlock,
        mut column: usize,
    ) -> usize {
        self.assume(state, row, scratch);
        let up = self.up(state);
        let mut known: Option<Subject> = None;
        let mut point = Vector3::zeros();
        for equation in self.observations.of_row(row) {
            let subject = self.subject(equation.reading);
            if known != Some(subject) {
                point = self.motions(state, row, subject, probes, scratch);
                known = Some(subject);
            }
            let prediction = self.predict(state, equation, &point, &up, scratch);
            let scale = weight / equation.sigma;
            block.residuals.push((equation.measured - prediction.value) * scale);
            if let Some(mut entries) =
                (column < block.jacobian.ncols()).then(|| block.jacobian.column_mut(column))
            {
                let (by_point, by_turn) = (prediction.by_point * scale, prediction.by_turn * scale);
                let above = if self.trigger_handle(equation.reading).is_some() { scale } else { 0.0 };
                for (((entry, linear), angular), trigger) in
                    entries.iter_mut().zip(&scratch.linear).zip(&scratch.angular).zip(&scratch.triggers)
                {
                    *entry = by_point.dot(linear) + by_turn.dot(angular) - above * trigger;
                }
                self.own_freedoms(state, equation, &point, &up, scale, &mut entries);
            }
            column += 1;
        }
        column
    }

    /// Fills `scratch.linear` and `scratch.angular` with the subject's motion per slot and probe; returns its point.
    fn motions(
        &self,
        state: &State,
        row: usize,
        subject: Subject,
        probes: &[&dyn Effect],
        scratch: &mut Scratch,
    ) -> Vector3<f64> {
        let target = if let Subject::Target(target) = subject { target } else { 0 };
        let (point, in_base) = self.point(state, target, scratch);
        let read = point + self.reading_shift(state, row, point, scratch);
        self.see(state, row, read, scratch);
        let triggered = self.observations.of_row(row).iter().find_map(|one| self.trigger_handle(one.reading));
        let (base, origin) = self.base(state, scratch);
        let level_frame = match subject {
            Subject::Level(level) => self.model.levels.get(level).map(|level| level.frame),
            Subject::Target(_) => None,
        };
        let carried_by = level_frame.map(|frame| if let Frame::After(joint) = frame { joint } else { 0 });
        let on_base = level_frame == Some(Frame::Base);
        let mut linear = std::mem::take(&mut scratch.linear);
        let mut angular = std::mem::take(&mut scratch.angular);
        let mut drives = std::mem::take(&mut scratch.drives);
        let mut triggers = std::mem::take(&mut scratch.triggers);
        linear.clear();
        angular.clear();
        triggers.clear();
        let mut turned = std::mem::take(&mut scratch.turned);
        turned.clear();
        {
            let mut frames =
                Frames { posture: &scratch.posture, base, origin, point, in_base, carried_by, turned: &[] };
            turned.extend((0..self.model.chain.len()).map(|joint| frames.moved(joint, Knob::Theta)));
            frames.turned = &turned;
            let situation = self.situation(state, row, &scratch.posture, &scratch.moments, Some(point));
            let mut motion = |handle: Option<Handle>| {
                let still = on_base && matches!(handle, Some(Handle::Joint(..)));
                let (moved, turned) = match handle {
                    Some(handle) if !still => self.handle_motion(handle, subject, &frames),
                    _ => (Vector3::zeros(), Vector3::zeros()),
                };
                linear.push(moved);
                angular.push(turned);
            };
            for slot in &self.slots {
                match *slot {
                    Slot::BaseShift(axis) => motion(Some(Handle::BaseShift(axis))),
                    Slot::BaseTurn(axis) => motion(Some(Handle::BaseTurn(axis))),
                    Slot::Target(target, axis) => motion(Some(Handle::Target(target, axis))),
                    Slot::Place(..) | Slot::Surface(..) => motion(None),
                    Slot::Effect(..) => {}
                }
            }
            let taking_part = self.parts.iter().map(|part| part.effect.as_ref());
            for effect in taking_part.chain(probes.iter().copied()) {
                drives.clear();
                effect.drive(&situation, &mut drives);
                let first = linear.len();
                let width = first + effect.parameters().len();
                linear.resize(width, Vector3::zeros());
                angular.resize(width, Vector3::zeros());
                triggers.resize(width, 0.0);
                for drive in &drives {
                    if triggered == Some(drive.handle)
                        && let Some(trigger) = triggers.get_mut(first + drive.parameter)
                    {
                        *trigger += drive.rate;
                    }
                    if on_base && matches!(drive.handle, Handle::Joint(..)) {
                        continue;
                    }
                    let (moved, turned) = self.handle_motion(drive.handle, subject, &frames);
                    if let (Some(linear), Some(angular)) =
                        (linear.get_mut(first + drive.parameter), angular.get_mut(first + drive.parameter))
                    {
                        *linear += moved * drive.rate;
                        *angular += turned * drive.rate;
                    }
                }
            }
        }
        triggers.resize(linear.len(), 0.0);
        scratch.triggers = triggers;
        scratch.linear = linear;
        scratch.angular = angular;
        scratch.turned = turned;
        scratch.drives = drives;
        read
    }

    /// Derivatives by the free numbers of the place or surface an equation refers to.
    fn own_freedoms(
        &self,
        state: &State,
        equation: &Equation,
        point: &Vector3<f64>,
        up: &Vector3<f64>,
        scale: f64,
        entries: &mut nalgebra::DVectorViewMut<'_, f64>,
    ) {
        let mut set = |wanted: Slot, value: f64| {
            if let Some(entry) =
                self.slots.iter().position(|slot| *slot == wanted).and_then(|index| entries.get_mut(index))
            {
                *entry = value * scale;
            }
        };
        match equation.reading {
            Reading::Touch(place, axis) => set(Slot::Place(place as usize, usize::from(axis)), -1.0),
            Reading::Surface(surface) | Reading::Trigger(surface) => {
                let index = usize::from(surface);
                let free = self.model.surfaces.get(index).is_some_and(|surface| surface.free);
                if let (true, Some(shape)) = (free, state.surfaces.get(index)) {
                    for which in 0..surface_freedoms(shape) {
                        set(Slot::Surface(index, which), surface_derivative(shape, which, point, up));
                    }
                }
            }
            Reading::Distance(surface) => {
                let index = usize::from(surface);
                let free = self.model.surfaces.get(index).is_some_and(|surface| surface.free);
                if let (
                    true,
                    Some(SurfaceShape::Point { point: place } | SurfaceShape::Sphere { centre: place, .. }),
                ) = (free, state.surfaces.get(index))
                {
                    let away = (point - place).try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
                    for which in 0..3 {
                        set(Slot::Surface(index, which), -away.get(which).copied().unwrap_or(0.0));
                    }
                }
            }
            Reading::Position(..) | Reading::Tilt(..) => {}
        }
    }
}

/// What plots are drawn against.
pub(crate) struct RowDetails {
    /// N m.
    pub(crate) moments: Vec<f64>,
    /// Motion of the first target per turn of each joint, mm/rad, frame of the measurements.
    pub(crate) by_joint: Vec<Vector3<f64>>,
}

/// The frames one row's derivatives are taken in.
struct Frames<'a> {
    posture: &'a Posture,
    base: Matrix3<f64>,
    origin: Vector3<f64>,
    point: Vector3<f64>,
    in_base: Vector3<f64>,
    /// For a level, the joint that carries it: what lies beyond does not turn it.
    carried_by: Option<usize>,
    /// How the subject moves when a joint turns, where that has been worked out.
    turned: &'a [(Vector3<f64>, Vector3<f64>)],
}

impl Frames<'_> {
    /// How the subject moves, and turns, with one number of one joint's row.
    fn moved(&self, joint: usize, knob: Knob) -> (Vector3<f64>, Vector3<f64>) {
        let twist = self.posture.twist(joint, knob, &self.in_base);
        (self.base * twist.linear, self.base * twist.angular)
    }
}

fn apply(drives: &[Drive], values: &[f64], scratch: &mut Scratch) {
    for drive in drives {
        let amount = drive.rate * values.get(drive.parameter).copied().unwrap_or(0.0);
        let part = match drive.handle {
            Handle::Joint(joint, knob) => {
                if let Some(deviation) = scratch.deviations.get_mut(joint) {
                    deviation.add(knob, amount);
                }
                continue;
            }
            Handle::Target(target, axis) => {
                scratch.target_shifts.get_mut(target).and_then(|shift| shift.get_mut(axis))
            }
            Handle::BaseShift(axis) => scratch.base_shift.get_mut(axis),
            Handle::BaseTurn(axis) => scratch.base_turn.get_mut(axis),
            Handle::Trigger => Some(&mut scratch.trigger_height),
            Handle::Reading(_) | Handle::Edge => continue,
            Handle::Twist { shift, turn, about, .. } => {
                scratch.bend_shift += (shift - turn.cross(&about)) * amount;
                scratch.bend_turn += turn * amount;
                continue;
            }
        };
        if let Some(part) = part {
            *part += amount;
        }
    }
}

/// By how much the sensor is lifted to see how an edge's place depends on its height, mm.
const PROBE_HEIGHT: f64 = 0.002;

/// The first plane of the model, which the sensor works over.
fn table_of(state: &State) -> Option<(Vector3<f64>, f64)> {
    state.surfaces.iter().find_map(|shape| match shape {
        SurfaceShape::Plane { normal, offset } => Some((*normal, *offset)),
        _ => None,
    })
}

fn up_from_table(state: &State) -> Vector3<f64> {
    table_of(state).map_or_else(Vector3::z, |(normal, _)| normal)
}

/// How high a point is over the plane the sensor works over, mm; 0 without one.
fn height_of(state: &State, point: &Vector3<f64>) -> f64 {
    table_of(state).map_or(0.0, |(normal, offset)| normal.dot(point) - offset)
}

/// How steeply a direction goes down to a table whose normal is `table`: its component along the normal, -1 straight down. What hardly goes down does
/// not see the table, and is taken as if it went down at 15 degrees.
fn steepness(look: &Vector3<f64>, table: &Vector3<f64>) -> f64 {
    look.dot(table).min(-0.26)
}

/// How far ahead of a point, seen in the direction `look`, the plane lies that the sensor works over, mm.
fn ahead(state: &State, point: &Vector3<f64>, look: &Vector3<f64>) -> f64 {
    -height_of(state, point) / steepness(look, &up_from_table(state))
}

/// How far a point is from a surface (mm, positive outside) and in which direction that grows.
fn away_from(shape: &SurfaceShape, point: &Vector3<f64>, up: &Vector3<f64>) -> (f64, Vector3<f64>) {
    match shape {
        SurfaceShape::Plane { normal, offset } => (normal.dot(point) - offset, *normal),
        SurfaceShape::Line { point: through, direction } => {
            let sideways = up.cross(direction).try_normalize(1e-9).unwrap_or_else(|| square_to(direction).0);
            (sideways.dot(&(point - through)), sideways)
        }
        SurfaceShape::Sphere { centre, radius } => {
            let offset = point - centre;
            let length = offset.norm();
            (length - radius, if length > 1e-9 { offset / length } else { Vector3::zeros() })
        }
        SurfaceShape::Point { point: place } => {
            let offset = point - place;
            let length = offset.norm();
            (length, if length > 1e-9 { offset / length } else { Vector3::zeros() })
        }
    }
}

fn surface_derivative(shape: &SurfaceShape, which: usize, point: &Vector3<f64>, up: &Vector3<f64>) -> f64 {
    match shape {
        SurfaceShape::Plane { normal, .. } => {
            let (first, second) = square_to(normal);
            match which {
                0 => -1.0,
                1 => first.dot(point),
                _ => second.dot(point),
            }
        }
        SurfaceShape::Line { point: through, direction } => match which {
            0 => -1.0,
            _ => -direction.dot(&(point - through)),
        },
        SurfaceShape::Sphere { .. } | SurfaceShape::Point { .. } => {
            let (_, away) = away_from(shape, point, up);
            -away.get(which).copied().unwrap_or(0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{Spot, build};

    const ARM: &str = "
arm: folded
convention: distal
joints:
  - {name: waist, a_mm: 0, alpha_deg: 90, d_mm: 195, theta_deg: 0}
  - {name: shoulder, a_mm: 177.8, alpha_deg: 0, d_mm: 0, theta_deg: 0}
  - {name: elbow, a_mm: 177.8, alpha_deg: 0, d_mm: 0, theta_deg: 0, less: shoulder}
  - {name: pitch, a_mm: 0, alpha_deg: 90, d_mm: 0, theta_deg: 90, less: elbow}
  - {name: roll, a_mm: 0, alpha_deg: 0, d_mm: 109, theta_deg: 0}
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 8], free: false}}
surfaces:
  table: {plane: {normal: [0, 0, 1], offset_mm: 0}, free: false}
  line_b: {line: {point_mm: [140, 0, 0], direction: [0, 1, 0], light: right}, free: false}
measured_from: world
sensor: {working_mm: 8, peak_mm: 5, spot_mm: 3, hysteresis_percent: 10, dark_percent: 7}
noise: {on_mm: 1}
";

    /// The hand tilted outward and 2 mm lower than where it fires.
    const EDGE: &str = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,on,signal\n12,24.9,-112,-65,0,line_b,off\n";

    #[test]
    fn a_tilted_hand_meets_an_edge_where_it_looks_and_its_derivatives_say_so() {
        let model = Model::parse("arm.yaml", ARM).unwrap();
        let table = Table::parse("edge.csv", EDGE).unwrap();
        let observations = Observations::new(&model, &table).unwrap();
        let zeros: Vec<AddedEffect> = (0..4)
            .map(|joint| AddedEffect {
                id: EffectId::at("joint_zero", Spot::Joint(joint)),
                values: vec![0.0],
            })
            .collect();
        assert!(zeros.iter().all(|zero| build(&zero.id, &model).is_ok()));
        let machine = Machine::new(&model, &table, &observations, &zeros).unwrap();
        let residual = |state: &State| machine.block(state, &[0], &[1.0], &[]).residuals[0];
        let start = machine.start();

        let point = machine.believed_point(&start, 0);
        let look_outward = 65_f64.to_radians().tan().recip();
        let seen = point.x + point.z * look_outward * 12_f64.to_radians().cos();
        assert!(point.z.abs() > 1.0, "the point is not on the table: {point}");
        let early = {
            let sensor = machine.model.sensor.unwrap();
            let distance = sensor.working + point.z / 65_f64.to_radians().sin();
            -0.5 * sensor.spot * sensor.early(false, distance, sensor.hysteresis)
        };
        // Left of a line along y, seen from above, is towards -x.
        let expected = -(-(seen - 140.0) - early);
        assert!((residual(&start) - expected).abs() < 1e-6, "{} {expected}", residual(&start));

        let jacobian = machine.block(&start, &[0], &[1.0], &[]).jacobian;
        for joint in 0..4 {
            let at = |by: f64| {
                let mut state = start.clone();
                state.effects[joint][0] += by;
                residual(&state)
            };
            let slope = (at(-1e-5) - at(1e-5)) / 2e-5;
            assert!(
                (jacobian[(joint, 0)] - slope).abs() < 0.05 + 2e-3 * slope.abs(),
                "{joint}: {slope} {jacobian}"
            );
        }
    }
}
