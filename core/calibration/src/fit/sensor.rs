//! What a row's instruments add: circumstances of a row as effects are given them, the arm's own sensor, the instrument.

use nalgebra::{Matrix3, Vector3};
use plumb_kinematics::{LinkFrames, Weights};

use super::arm_pose::ArmPose;
use super::residual_model::ResidualModel;
use super::state::State;
use super::view_of_table::ViewOfTable;
use crate::effect::{Contribution, Dof, LooksAt, Sample, Trigger};
use crate::measurement::SensorShift;

/// By how much the sensor is lifted to see how an edge's place depends on its height, mm: small beside a spot of some mm,
/// large beside rounding.
const PROBE_HEIGHT: f64 = 0.002;

/// A row's number in a column; nothing where the table has no such column.
fn cell(column: &Option<Vec<f64>>, row: usize) -> Option<f64> {
    column.as_ref().and_then(|column| column.get(row)).copied()
}

impl ResidualModel<'_> {
    /// What effects are given of a row, with its point where that is known.
    pub(super) fn sample<'s>(
        &'s self,
        state: &State,
        row: usize,
        link_frames: &'s LinkFrames,
        moments: &'s [f64],
        point: Option<Vector3<f64>>,
    ) -> Sample<'s> {
        let joints = self.table.joints;
        let time = cell(&self.table.time, row);
        let approach =
            self.table.approach.as_deref().and_then(|sides| sides.get(row * joints..(row + 1) * joints));
        // Effects that look at conditions alone are asked before the arm is: they are given no hand.
        let hand = point.map_or_else(Matrix3::identity, |_| {
            state.base.rotation.matrix() * link_frames.flange.rotation.matrix()
        });
        Sample {
            chain: &self.model.chain,
            q: self.table.q_of(row),
            previous: self.previous.get(row).copied().flatten().map(|before| self.table.q_of(before)),
            approach: approach.unwrap_or(&[]),
            speed: self.table.speed_of(row),
            time: time.map_or(f64::NAN, |time| time - self.first_time),
            clock: time.unwrap_or(row as f64),
            epoch: self.epoch(row),
            temperature: cell(&self.table.temperature, row).unwrap_or(f64::NAN),
            weights: self.weights(state, row),
            moments,
            link_frames,
            point: point.unwrap_or_else(Vector3::zeros),
            hand,
            trigger: self.trigger(state, row, point, hand.column(2).into_owned()),
        }
    }

    /// Everything with weight in a row.
    pub(super) fn weights(&self, state: &State, row: usize) -> Weights<'_> {
        let load = cell(&self.table.payload, row);
        let payload = load.filter(|load| load.is_finite()).unwrap_or(0.0);
        Weights { masses: &self.model.masses, payload, down: self.down(state) }
    }

    /// What steps in time are dated by in a row; nothing where a logged time is not finite.
    pub fn clock(&self, row: usize) -> Option<f64> {
        let clock = self.table.time.as_ref().map_or(Some(row as f64), |time| time.get(row).copied());
        clock.filter(|clock| clock.is_finite())
    }

    /// What the arm's own sensor did in a row, if it triggered there looking in the direction `look`.
    fn trigger(
        &self,
        state: &State,
        row: usize,
        point: Option<Vector3<f64>>,
        look: Vector3<f64>,
    ) -> Option<Trigger> {
        // A row triggers over one surface at most.
        let measurands = self.observations.of_row(row).iter().map(|equation| equation.measurand);
        let surface = measurands.filter(|what| what.kind.is_trigger()).map(|what| what.index()).next()?;
        let known = self.model.surfaces.get(surface)?;
        let edge = known.shape.is_edge();
        let sensor = self.model.sensor;
        let distance = match (sensor, point) {
            // At an edge it works over the table; over anything else, over that.
            (Some(sensor), Some(point)) if edge => {
                sensor.working + ViewOfTable::new(state).ahead(&point, &look)
            }
            (Some(sensor), Some(point)) => {
                let shape = state.surfaces.get(surface);
                sensor.working + shape.map_or(0.0, |shape| shape.distance(&point, &Vector3::z()).0)
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
    pub(super) fn sensor_shift(
        &self,
        state: &State,
        row: usize,
        point: Vector3<f64>,
        pose: &ArmPose,
        contributions: &mut Vec<Contribution>,
    ) -> SensorShift {
        if self.model.sensor.is_none() {
            return SensorShift::default();
        }
        let (above, left) = self.seen(state, row, point, pose, contributions);
        // The width of the spot's edge goes by the height: by a difference, for the sensor's law has no handy derivative.
        let higher = point + ViewOfTable::new(state).normal * PROBE_HEIGHT;
        let (_, left_of_higher) = self.seen(state, row, higher, pose, contributions);
        SensorShift { above, left, left_by_height: (left_of_higher - left) / PROBE_HEIGHT }
    }

    /// How far above a surface, and how far left of an edge, the sensor triggers at a point, mm.
    fn seen(
        &self,
        state: &State,
        row: usize,
        point: Vector3<f64>,
        pose: &ArmPose,
        contributions: &mut Vec<Contribution>,
    ) -> (f64, f64) {
        let sample = self.sample(state, row, &pose.link_frames, &pose.moments, Some(point));
        let (mut above, mut left) = match sample.trigger {
            Some(Trigger { edge: true, light, came_on, distance, sensor: Some(sensor), .. }) => {
                (0.0, light * 0.5 * sensor.spot * sensor.early(came_on, distance, sensor.hysteresis))
            }
            Some(Trigger { edge: false, came_on, sensor: Some(sensor), .. }) => {
                (sensor.above(came_on, sensor.hysteresis), 0.0)
            }
            _ => (0.0, 0.0),
        };
        self.each_change_at_the_point(state, &sample, contributions, |dof, amount| match dof {
            Dof::Trigger => above += amount,
            Dof::Edge => left += amount,
            _ => {}
        });
        (above, left)
    }

    /// What the instrument adds to a point's coordinates, mm, frame of the measurements.
    pub(super) fn reading_shift(
        &self,
        state: &State,
        row: usize,
        point: Vector3<f64>,
        pose: &ArmPose,
        contributions: &mut Vec<Contribution>,
    ) -> Vector3<f64> {
        let mut shift = Vector3::zeros();
        // Most models have no effect of the instrument.
        if self.parts.iter().all(|part| part.looks_at != LooksAt::Point) {
            return shift;
        }
        let sample = self.sample(state, row, &pose.link_frames, &pose.moments, Some(point));
        self.each_change_at_the_point(state, &sample, contributions, |dof, amount| {
            if let Dof::Reading(axis) = dof
                && let Some(component) = shift.get_mut(axis)
            {
                *component += amount;
            }
        });
        shift
    }

    /// Hands over, one by one, what the effects of instrument and sensor change at their present values.
    fn each_change_at_the_point(
        &self,
        state: &State,
        sample: &Sample<'_>,
        contributions: &mut Vec<Contribution>,
        mut take: impl FnMut(Dof, f64),
    ) {
        for (part, values) in self.parts.iter().zip(&state.effects) {
            if part.looks_at != LooksAt::Point {
                continue;
            }
            for contribution in sample.contributions_of(part.effect.as_ref(), contributions) {
                take(
                    contribution.dof,
                    contribution.rate * values.get(contribution.parameter).copied().unwrap_or(0.0),
                );
            }
        }
    }
}
