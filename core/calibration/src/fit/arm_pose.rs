//! The arm in one row: its frames with all that the effects change, gravity in balance with what it bends.

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Vector3};
use plumb_kinematics::{Chain, Deviation, DhParameter, LinkFrames, Motion};

use super::response::Response;
use super::state::State;
use crate::arm_model::{Frame, MapEffect, RigNumber, StripeRig};
use crate::effect::{Channel, Contribution, Dof};

/// What the effects change of the arm in one row, before the instrument looks.
#[derive(Debug, Clone, Default)]
pub(crate) struct Changes {
    /// Of the joints' rows.
    pub(super) deviations: Vec<Deviation>,
    /// Of the base, frame of the measurements: mm, and rad about its own origin.
    base_shift: Vector3<f64>,
    base_rotation: Vector3<f64>,
    /// Shift of the base's origin and turn about it that bent links give everything beyond them, base frame.
    bend_shift: Vector3<f64>,
    bend_rotation: Vector3<f64>,
    /// Of the targets, flange frame, mm.
    target_shifts: Vec<Vector3<f64>>,
    /// Distance over a surface at which the arm's own sensor triggers, mm.
    trigger_height: f64,
    /// Of the numbers of the light stripe's rig.
    pub(super) rig: [f64; RigNumber::ALL.len()],
    /// What is added to each number that is read (mm or rad), and the fraction by which it is read too large.
    readings: [(f64, f64); Channel::COUNT],
}

impl Changes {
    /// Nothing changed, for so many joints and targets.
    pub(super) fn none(joints: usize, targets: usize) -> Self {
        Self {
            deviations: vec![Deviation::default(); joints],
            target_shifts: vec![Vector3::zeros(); targets],
            ..Self::default()
        }
    }

    /// The changes of `other` in place of its own.
    pub(super) fn begin_with(&mut self, other: &Self) {
        // Rows are worked out one after the other in the same memory.
        self.deviations.clone_from(&other.deviations);
        self.target_shifts.clone_from(&other.target_shifts);
        self.base_shift = other.base_shift;
        self.base_rotation = other.base_rotation;
        self.bend_shift = other.bend_shift;
        self.bend_rotation = other.bend_rotation;
        self.trigger_height = other.trigger_height;
        self.rig = other.rig;
        self.readings = other.readings;
    }

    pub(super) fn clear_bending(&mut self) {
        self.bend_shift = Vector3::zeros();
        self.bend_rotation = Vector3::zeros();
    }

    /// Shift of the base's origin and turn about it that bent links give everything beyond them, base frame.
    pub(super) fn carried(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.bend_shift, self.bend_rotation)
    }

    /// Whether joints' rows and what bent links carry are those of `other`, to within `most` (rad, mm).
    pub(super) fn bends_as(&self, other: &Self, most: f64) -> bool {
        let rows = self.deviations.iter().zip(&other.deviations).map(|(own, other)| {
            let [own, other] = [own, other].map(|row| [row.theta, row.alpha, row.beta, row.d, row.a]);
            own.iter().zip(other).map(|(own, other)| (own - other).abs()).fold(0.0, f64::max)
        });
        let carried = [self.bend_shift - other.bend_shift, self.bend_rotation - other.bend_rotation];
        rows.chain(carried.map(|off| off.amax())).all(|off| off <= most)
    }

    /// Adds what an effect does at these values of its parameters.
    pub(super) fn add(&mut self, contributions: &[Contribution], values: &[f64]) {
        for contribution in contributions {
            let amount = contribution.rate * values.get(contribution.parameter).copied().unwrap_or(0.0);
            self.add_one(&contribution.dof, amount);
        }
    }

    /// Adds what a residual map does, for a base that is turned so.
    pub(super) fn add_map(&mut self, mapped: &MapEffect, chain: &Chain, base: &Rotation3<f64>) {
        // The map was made in the frame of the base, in which the arm is the same wherever it is.
        self.base_shift += base * mapped.shift;
        for (deviation, (joint, amount)) in
            self.deviations.iter_mut().zip(chain.joints.iter().zip(&mapped.joints))
        {
            let dh_parameter =
                if joint.motion == Motion::Slides { DhParameter::D } else { DhParameter::Theta };
            deviation.add(dh_parameter, joint.sign * amount);
        }
    }

    fn add_one(&mut self, dof: &Dof, amount: f64) {
        let part = match *dof {
            Dof::Joint(joint, dh_parameter) => {
                if let Some(deviation) = self.deviations.get_mut(joint) {
                    deviation.add(dh_parameter, amount);
                }
                return;
            }
            Dof::Twist { shift, rotation, about, .. } => {
                // A turn about a point is a turn about the base's origin and a shift.
                self.bend_shift += (shift - rotation.cross(&about)) * amount;
                self.bend_rotation += rotation * amount;
                return;
            }
            Dof::Target(target, axis) => {
                self.target_shifts.get_mut(target).and_then(|shift| shift.get_mut(axis))
            }
            Dof::BaseShift(axis) => self.base_shift.get_mut(axis),
            Dof::BaseRotation(axis) => self.base_rotation.get_mut(axis),
            Dof::Trigger => Some(&mut self.trigger_height),
            Dof::Rig(number) => self.rig.get_mut(number.index()),
            Dof::ReadingZero(channel) => self.readings.get_mut(channel.index()).map(|(zero, _)| zero),
            Dof::ReadingScale(channel) => self.readings.get_mut(channel.index()).map(|(_, scale)| scale),
            // What the instrument reads and where a sensor meets an edge depend on the point: see `sensor.rs`.
            Dof::Reading(_) | Dof::Edge => None,
        };
        if let Some(part) = part {
            *part += amount;
        }
    }
}

impl ArmPose {
    /// What is added to a number that is read (mm or rad), and the fraction by which it is read too large.
    pub(super) fn reading(&self, channel: Option<Channel>) -> (f64, f64) {
        let known = channel.and_then(|channel| self.changes.readings.get(channel.index()));
        known.copied().unwrap_or_default()
    }
}

/// The arm in one row.
#[derive(Debug, Clone, Default)]
pub struct ArmPose {
    /// Its frames, base frame.
    pub(crate) link_frames: LinkFrames,
    /// Moments of gravity about the joints' axes, N m.
    pub(crate) moments: Vec<f64>,
    pub(super) changes: Changes,
    /// How what gravity bends answers to small changes; worked out where derivatives are.
    pub(super) response: Response,
    /// The rig of the light stripe, with all that effects change of it.
    pub(super) rig: Option<StripeRig>,
    /// Orientation and origin of the base in the frame of the measurements.
    pub(super) base: Matrix3<f64>,
    pub(super) origin: Vector3<f64>,
    /// From vectors of what hangs on the arm, base frame without what bent links add, to the frame of the measurements.
    pub(super) carried: Matrix3<f64>,
    /// By how much effects turn the base, and how a small change of that rotation vector turns it further: both nearly the identity,
    /// except where sessions have bases of their own.
    pub(super) rotated_base: Matrix3<f64>,
    pub(super) rotation_by_vector: Matrix3<f64>,
}

/// How a rotation turns further when its vector `turn` (rad) changes a little: the left Jacobian of the rotations (Chirikjian,
/// Stochastic Models, Information Theory, and Lie Groups, volume 2, 2011, equation 10.86).
fn left_jacobian(rotation: &Vector3<f64>) -> Matrix3<f64> {
    let angle = rotation.norm();
    if angle < SMALL_ROTATION {
        return Matrix3::identity();
    }
    let axis = rotation / angle;
    let (sine, cosine) = angle.sin_cos();
    // sin(t)/t I + (1 - sin(t)/t) a a' + (1 - cos(t))/t [a]x.
    Matrix3::identity() * (sine / angle)
        + axis * axis.transpose() * (1.0 - sine / angle)
        + axis.cross_matrix() * ((1.0 - cosine) / angle)
}

/// Below this angle (rad) rounding is larger than what the left Jacobian differs from the identity by.
const SMALL_ROTATION: f64 = 1e-9;

impl ArmPose {
    /// Places the base, which effects may have moved.
    pub(super) fn place_base(&mut self, believed: &IsometryMatrix3<f64>) {
        // Believed first, turned by effects after: in the order in which the derivatives take them.
        let rotation = Rotation3::new(self.changes.base_rotation);
        self.rotated_base = rotation.into_inner();
        self.rotation_by_vector = left_jacobian(&self.changes.base_rotation);
        self.base = (rotation * believed.rotation).into_inner();
        self.origin = believed.translation.vector + self.changes.base_shift;
        // What bends is small: its turn is added as a vector product, and not as a rotation.
        self.carried = self.base + self.base * self.changes.bend_rotation.cross_matrix();
    }

    /// A target's point in the frame of the measurements and in the base's frame, mm.
    pub(crate) fn point(&self, state: &State, target: usize) -> (Vector3<f64>, Vector3<f64>) {
        let tool = state.targets.get(target).copied().unwrap_or_else(Vector3::zeros);
        let shift = self.changes.target_shifts.get(target).copied().unwrap_or_else(Vector3::zeros);
        self.at_flange(tool + shift)
    }

    /// A point that is fixed to the flange (mm, flange's frame) in the frame of the measurements and in the base's frame, mm.
    pub(super) fn at_flange(&self, point: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let stiff = (self.link_frames.flange * Point3::from(point)).coords;
        let in_base = self.changes.bend_shift + stiff + self.changes.bend_rotation.cross(&stiff);
        (self.base * in_base + self.origin, in_base)
    }

    /// A small shift in the flange's frame, in the frame of the measurements.
    pub(crate) fn rotated_from_flange(&self, shift: Vector3<f64>) -> Vector3<f64> {
        self.carried * (self.link_frames.flange.rotation * shift)
    }

    /// Where a point (base frame, mm) would be without what bent links add.
    pub(super) fn without_bent_links(&self, in_base: Vector3<f64>) -> Vector3<f64> {
        let (shift, rotation) = self.changes.carried();
        if shift == Vector3::zeros() && rotation == Vector3::zeros() {
            return in_base;
        }
        let carried = Matrix3::identity() + rotation.cross_matrix();
        // One plus what turns about an axis has no eigenvalue of zero.
        carried.try_inverse().map_or(in_base - shift, |back| back * (in_base - shift))
    }

    /// Distance over a surface at which the arm's own sensor triggers by the effects of the row, mm.
    pub fn trigger_height(&self) -> f64 {
        self.changes.trigger_height
    }

    /// The flange, base frame, mm; without what bent links add.
    pub fn flange(&self) -> &IsometryMatrix3<f64> {
        &self.link_frames.flange
    }

    /// Axes of the flange in the frame of the measurements, with what bent links add.
    pub fn hand(&self) -> Rotation3<f64> {
        let base = Rotation3::from_matrix_unchecked(self.base);
        base * Rotation3::new(self.changes.bend_rotation) * self.link_frames.flange.rotation
    }

    /// The direction in which the hand looks, along the flange's z, in the frame of the measurements.
    pub fn look(&self) -> Vector3<f64> {
        self.base * self.link_frames.flange.rotation.matrix().column(2)
    }

    /// Axes of a frame of the arm in the frame of the measurements.
    pub fn attitude(&self, frame: Frame) -> Matrix3<f64> {
        let in_base = match frame {
            Frame::After(joint) => self
                .link_frames
                .joints
                .get(joint)
                .map_or_else(Matrix3::identity, |frame| frame.end.rotation.into_inner()),
            Frame::Base => Matrix3::identity(),
        };
        self.base * Rotation3::new(self.changes.bend_rotation).into_inner() * in_base
    }
}
