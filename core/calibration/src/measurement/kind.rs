//! What a kind of measurement has to say of itself, and what it is given.

use std::fmt;

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::error::ObservationsError;
use super::row::RowReader;
use crate::arm_model::SurfaceShape;
use crate::arm_model::{Frame, Model};
use crate::effect::{Channel, Dof};
use crate::fit::{ArmPose, FreeParameter, State};
use crate::table::Table;

/// A kind of measurement: its columns, its equation and its derivatives.
pub trait MeasurementKind: fmt::Debug + Sync {
    /// Its name, one of a kind.
    fn name(&self) -> &'static str;

    /// The columns it reads, as messages and help name them: `p1_x_mm ...`.
    fn columns(&self) -> &'static str;

    /// Whether it is in millimetres (else radians).
    fn is_length(&self) -> bool {
        true
    }

    /// Whether it is a number of the rotation between what was measured and what is believed, which is zero where both are the same.
    fn is_orientation(&self) -> bool {
        false
    }

    /// Which coordinate of a point it is (0 x, 1 y, 2 z, frame of the measurements), if it is one.
    fn coordinate(&self, _what: Measurand) -> Option<usize> {
        None
    }

    /// The instrument that reads it: kinds that fraction one share its scatter.
    fn instrument(&self) -> &'static str {
        self.name()
    }

    /// The key under `noise:` in a model file that declares its noise: readings of one key have one noise.
    fn noise_key(&self, _model: &Model, _what: Measurand) -> String {
        format!("{}_{}", self.name(), if self.is_length() { "mm" } else { "deg" })
    }

    /// The number of an instrument that it is, if an instrument reads it out.
    fn channel(&self, _what: Measurand) -> Option<Channel> {
        None
    }

    /// The target whose coordinate an instrument saw, where that is what was measured: from three of them base and targets
    /// are placed before the first step of a fit.
    fn seen_target(&self, _what: Measurand) -> Option<usize> {
        None
    }

    /// The touched place it is measured against, whose start is where the arm believes it to be.
    fn touched_place(&self, _what: Measurand) -> Option<usize> {
        None
    }

    /// Whether the arm's own sensor triggered: the measurand's index is then the surface's.
    fn is_trigger(&self) -> bool {
        false
    }

    /// Says what a model lacks for a table's columns, before any row is read.
    ///
    /// # Errors
    /// See [`ObservationsError`].
    fn check(&self, _model: &Model, _table: &Table) -> Result<(), ObservationsError> {
        Ok(())
    }

    /// Appends the equations of one row.
    ///
    /// # Errors
    /// The model lacks what the row refers to.
    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError>;

    /// What of the arm it is of.
    fn subject(&self, _model: &Model, _what: Measurand) -> Subject {
        Subject::Target(0)
    }

    /// The predicted value, and how it changes with the subject's point and attitude.
    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction;

    /// The sensor's own number that is subtracted from the predicted value, where there is one.
    fn sensor_dof(&self, _model: &Model, _what: Measurand) -> Option<Dof> {
        None
    }

    /// How the predicted value changes when the points that a light stripe sees move so, flange's frame.
    fn by_seen_points(&self, _what: Measurand, _context: &RowContext<'_>, _moved: &[Vector3<f64>]) -> f64 {
        0.0
    }

    /// Derivatives of the predicted value by the free numbers of what is measured against (places, surfaces), handed to `set`.
    fn own_derivatives(
        &self,
        _what: Measurand,
        _context: &RowContext<'_>,
        _set: &mut dyn FnMut(FreeParameter, f64),
    ) {
    }
}

/// What one equation compares: a kind of measurement, of which thing, and which component of it.
#[derive(Debug, Clone, Copy)]
pub struct Measurand {
    /// The kind.
    pub kind: &'static dyn MeasurementKind,
    /// Which target, touched place, surface or level, by its index in the model (places: in the table).
    pub index: u32,
    /// Which component: an axis, for kinds that have several.
    pub component: u8,
}

impl PartialEq for Measurand {
    fn eq(&self, other: &Self) -> bool {
        self.kind.name() == other.kind.name()
            && self.index == other.index
            && self.component == other.component
    }
}

impl Measurand {
    /// Whether the equation is in millimetres (else radians).
    pub fn is_length(self) -> bool {
        self.kind.is_length()
    }

    /// Which coordinate of a point it is (0 x, 1 y, 2 z, frame of the measurements), if it is one.
    pub fn coordinate(self) -> Option<usize> {
        self.kind.coordinate(self)
    }

    /// The index, for lists.
    pub fn index(self) -> usize {
        self.index as usize
    }

    /// The component as an axis.
    pub fn axis(self) -> usize {
        usize::from(self.component.min(2))
    }
}

/// One equation: what is measured, its value, and its declared sigma.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equation {
    /// What is compared.
    pub measurand: Measurand,
    /// mm or rad; zero for touching and lying on a surface.
    pub measured: f64,
    /// What its residual is divided by, mm or rad: the declared sigma (1 standard deviation), else 1.
    pub sigma: f64,
    /// Whether the sigma was declared.
    pub is_declared: bool,
}

impl Equation {
    /// An equation with the sigma that was declared for it, if one was.
    pub fn new(measurand: Measurand, measured: f64, declared: Option<f64>) -> Self {
        Self { measurand, measured, sigma: declared.unwrap_or(1.0), is_declared: declared.is_some() }
    }
}

/// What of the arm an equation is of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Subject {
    /// A target's point, by its index in the model.
    Target(usize),
    /// A target's orientation, by its index in the model.
    Body(usize),
    /// A target that is a camera, its place and its orientation: what it sees no other instrument reads.
    Camera(usize),
    /// A stretch of a light stripe, by its index in the table: points that move with the flange as one piece.
    Stretch(usize),
    /// The attitude of a frame.
    Frame(Frame),
}

/// A predicted value (mm or rad) and how it changes with its subject.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// mm or rad.
    pub value: f64,
    /// Gradient by the subject's point, per mm, frame of the measurements.
    pub by_point: Vector3<f64>,
    /// Gradient by a small turn of the subject about the axes of the measurements, per rad.
    pub by_rotation: Vector3<f64>,
}

impl Prediction {
    /// Of a value that depends on the point alone.
    pub fn of_point(value: f64, by_point: Vector3<f64>) -> Self {
        Self { value, by_point, by_rotation: Vector3::zeros() }
    }
}

/// What the arm's own sensor adds to where it triggers, by its data sheet and the effects that take part.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensorShift {
    /// Over a surface: how much higher, mm.
    pub above: f64,
    /// At an edge: how far left of it, seen along its direction from above, mm.
    pub left: f64,
    /// How `left` grows with the sensor's height, mm/mm.
    pub left_by_height: f64,
}

/// One row, the arm in it, and the point that was measured: what predictions are made from.
#[derive(Debug, Clone, Copy)]
pub struct RowContext<'a> {
    /// The model.
    pub model: &'a Model,
    /// The table the row is of.
    pub table: &'a Table,
    /// The row.
    pub row: usize,
    /// Values of everything that can be fitted.
    pub state: &'a State,
    /// The arm in this row.
    pub pose: &'a ArmPose,
    /// The subject's point as the instrument reads it, mm, frame of the measurements; zero for a frame's attitude.
    pub point: Vector3<f64>,
    /// The points of a stretch of a light stripe, mm, frame of the measurements; their mean is `point`.
    pub seen: &'a [Vector3<f64>],
    /// Upwards, unit length, frame of the measurements.
    pub up: Vector3<f64>,
    /// What the sensor adds to where it triggers.
    pub sensor: SensorShift,
}

impl RowContext<'_> {
    /// A surface as it is believed to be now.
    pub fn surface(&self, what: Measurand) -> Option<&SurfaceShape> {
        self.state.surfaces.get(what.index())
    }

    /// A surface that fits may move, as it is believed to be now.
    pub fn free_surface(&self, what: Measurand) -> Option<&SurfaceShape> {
        let free = self.model.surfaces.get(what.index()).is_some_and(|surface| surface.free);
        self.surface(what).filter(|_| free)
    }

    /// The signed distance of a point from a surface (mm), and its gradient.
    pub fn distance_from(&self, what: Measurand, point: &Vector3<f64>) -> (f64, Vector3<f64>) {
        self.surface(what).map_or_else(|| (0.0, Vector3::zeros()), |shape| shape.distance(point, &self.up))
    }

    /// Derivatives of the distance from a surface by the surface's own free numbers.
    pub fn surface_derivatives(&self, what: Measurand, set: &mut dyn FnMut(FreeParameter, f64)) {
        if let Some(shape) = self.free_surface(what) {
            for which in 0..shape.freedoms() {
                set(
                    FreeParameter::Surface(what.index(), which),
                    shape.derivative(which, &self.point, &self.up),
                );
            }
        }
    }

    /// A small shift in the flange's frame, in the frame of the measurements.
    pub fn rotated_from_flange(&self, shift: Vector3<f64>) -> Vector3<f64> {
        self.pose.rotated_from_flange(shift)
    }

    /// Axes of a target in the frame of the measurements.
    pub fn body(&self, target: usize) -> Rotation3<f64> {
        let rotation = self.state.rotations.get(target).copied().unwrap_or_else(Rotation3::identity);
        self.pose.hand() * rotation
    }

    /// Axes of a frame of the arm in the frame of the measurements.
    pub fn attitude(&self, frame: Frame) -> Matrix3<f64> {
        self.pose.attitude(frame)
    }
}
