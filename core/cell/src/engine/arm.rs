//! A robot as the engine sees it: its drive, the zeros in force, and where it may go.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use nalgebra::IsometryMatrix3;
use plumb_kinematics::{Posture, inverse};
use plumb_model::prediction::Pose;
use plumb_plugin::{JointState, JointUnit, JointVector, Motion, ProximityEdge, RobotDescription};
use plumb_record::AppliedCorrection;
use serde_json::{Value, json};

use crate::device::{DeviceError, RobotLink};
use crate::engine::EventSender;
use crate::engine::believed::{self, Asked, Source};
use crate::event::{Event, NamedValue};
use crate::prompt::Answer;
use crate::read_context::DegOrMm;
use crate::workcell::{BoundKeepOut, KeepOut, ModelFile, RobotSetting, Trespass};

use super::manual_motion::ManualMotion;

/// The zeros in force, one a joint, shared with who shows where the robot is.
pub(crate) type Zeros = Arc<Mutex<Vec<f64>>>;

/// Name of the correction that shifts a joint's zero.
pub(crate) const JOINT_ZERO: &str = "joint_zero";

/// A connected robot. Inside, joints are in the drive's order, rad or mm. What the drive says plus the zero in force is where a joint is
/// taken to stand.
pub(crate) struct Arm {
    pub(crate) name: String,
    pub(crate) plugin: String,
    pub(crate) link: Box<dyn RobotLink>,
    pub(crate) description: RobotDescription,
    setting: RobotSetting,
    keep_out: Option<BoundKeepOut>,
    /// The joints' zeros are known and trusted, so that it is known where the robot is.
    watches_planes: bool,
    zeros: Zeros,
    /// Which way each joint of the drive last went: 1, -1, or 0 for one that has not moved since this run took hold of the robot.
    sides: Vec<i8>,
    /// What was seen of the joints since somebody else may move them; nothing while only this program does.
    manual: Option<ManualMotion>,
    /// The latest time it told, ns of the cell's clock.
    told_ns: u64,
}

/// A point that is to be brought somewhere.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WantedPoint<'a> {
    /// Where, mm, in the model's frame of measurements.
    pub(crate) xyz_mm: [f64; 3],
    /// Which of the model's targets; the first where none is named.
    pub(crate) target: Option<&'a str>,
    /// The columns of the joints that bring it there.
    pub(crate) by: &'a [usize],
    /// What the hand carries, kg.
    pub(crate) payload_kg: f64,
}

/// Why a robot may not go somewhere. Nothing has moved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum NotAllowed {
    #[error("{joint} would go to {target:.3} {unit}; it goes from {lower:.3} to {upper:.3} {unit}")]
    Limit { joint: String, target: f64, lower: f64, upper: f64, unit: &'static str },
    #[error("{joint} would go to {target}, which is no place")]
    NoNumber { joint: String, target: f64 },
    #[error(transparent)]
    KeepOut(Trespass),
}

impl Arm {
    /// Fits a connected robot to what the cell says about it.
    pub(crate) fn new(
        link: Box<dyn RobotLink>,
        plugin: &str,
        setting: &RobotSetting,
        keep_out: Option<&KeepOut>,
    ) -> Result<Self, DeviceError> {
        let description = link.description().clone();
        let fail = |cause: String| DeviceError::Start { device: setting.device.clone(), cause };
        let source = Source { device: &setting.device, plugin };
        believed::check_description(source, &description).map_err(fail)?;
        for (joint, unit) in &setting.joints {
            let known = description.joints.iter().find(|known| known.name == *joint).ok_or_else(|| {
                let names = description.joints.iter().map(|known| known.name.as_str());
                let there = crate::yaml::one_of(names);
                fail(format!("the cell file names a joint `{joint}`, but of the robot's joints {there}"))
            })?;
            if unit_of(known.unit) != *unit {
                let unit = unit.symbol();
                return Err(fail(format!(
                    "the cell file gives joint `{joint}` in {unit}; the robot does not"
                )));
            }
        }
        let keep_out = keep_out.map(|check| check.bind(&description)).transpose().map_err(fail)?;
        Ok(Self {
            name: setting.device.clone(),
            plugin: plugin.to_owned(),
            zeros: Arc::new(Mutex::new(vec![0.0; description.joints.len()])),
            sides: vec![0; description.joints.len()],
            manual: None,
            told_ns: 0,
            link,
            description,
            setting: setting.clone(),
            keep_out,
            watches_planes: false,
        })
    }

    /// Takes over the zeros in force. Where they are not `trusted`, because the run is to find them, the keep-out planes are not watched:
    /// nobody knows where the robot is.
    pub(crate) fn set_zeros(&mut self, corrections: &[AppliedCorrection], trusted: bool) {
        let mut zeros = vec![0.0; self.description.joints.len()];
        let zero_of = |joint: &str| zero_in_force(corrections, joint);
        for (joint, unit) in &self.setting.joints {
            if let (Some(value), Some(column)) = (zero_of(joint), self.column(joint))
                && let Some(zero) = zeros.get_mut(column)
            {
                *zero = unit.to_internal(value);
            }
        }
        *lock(&self.zeros) = zeros;
        let known = self.setting.initialize.iter().all(|joint| zero_of(joint).is_some());
        self.watches_planes = known && trusted;
        if let Some(keep_out) = &mut self.keep_out {
            keep_out.set_zeros(|joint| {
                let unit = self.setting.unit(joint).unwrap_or(DegOrMm::Deg);
                zero_of(joint).map_or(0.0, |value| unit.to_internal(value))
            });
        }
    }

    /// A joint's place in the drive's order.
    pub(crate) fn column(&self, joint: &str) -> Option<usize> {
        self.description.joints.iter().position(|known| known.name == joint)
    }

    /// The smallest step of a joint's drive, rad or mm; 0 for one that is continuous.
    pub(crate) fn resolution(&self, column: usize) -> f64 {
        self.description.joints.get(column).map_or(0.0, |joint| joint.resolution)
    }

    pub(crate) fn unit(&self, column: usize) -> DegOrMm {
        self.description.joints.get(column).map_or(DegOrMm::Deg, |joint| unit_of(joint.unit))
    }

    pub(crate) fn joint_name(&self, column: usize) -> &str {
        self.description.joints.get(column).map_or("", |joint| joint.name.as_str())
    }

    pub(crate) fn zero(&self, column: usize) -> f64 {
        lock(&self.zeros).get(column).copied().unwrap_or(0.0)
    }

    /// Where the joints are taken to stand, for what the drive says.
    pub(crate) fn corrected(&self, drive: &JointVector) -> Vec<f64> {
        drive.as_slice().iter().enumerate().map(|(column, value)| value + self.zero(column)).collect()
    }

    /// Where the flange is in the base frame, for what the drive says.
    ///
    /// # Errors
    /// A sentence: without a model nobody knows.
    pub(crate) fn flange(&self, drive: &JointVector) -> Result<IsometryMatrix3<f64>, String> {
        let model = self.geometry()?;
        let sides = self.cell_joints(&self.sides, 0);
        Ok(flange_of(model, &self.cell_joints(&self.corrected(drive), 0.0), &sides))
    }

    /// What the drive has to be told to bring the flange there from where it says it stands. The whole model is undone, with its effects: play by the
    /// side the joints will arrive from.
    ///
    /// # Errors
    /// A sentence: out of reach, or there is no model.
    pub(crate) fn joints_for(
        &self,
        wanted: &IsometryMatrix3<f64>,
        from: &JointVector,
    ) -> Result<JointVector, String> {
        let model = self.geometry()?;
        let mut target = *from;
        let mut start = self.cell_joints(&self.corrected(from), 0.0);
        let mut sides = self.sides.clone();
        for _ in 0..2 {
            let listed = self.cell_joints(&sides, 0);
            let found = inverse(|joints| flange_of(model, joints, &listed), wanted, &start);
            let found = found.map_err(|error| error.to_string())?;
            for ((joint, _), value) in self.setting.joints.iter().zip(&found) {
                if let Some(column) = self.column(joint) {
                    target.set(column, value - self.zero(column));
                }
            }
            sides = self.sides_at(from, &target);
            start = found;
        }
        Ok(target)
    }

    /// The side from which each joint of the drive will have arrived once it has gone from one place to another.
    pub(super) fn sides_at(&self, from: &JointVector, target: &JointVector) -> Vec<i8> {
        let side = |(column, before): (usize, &i8)| {
            let way = target.get(column).unwrap_or(0.0) - from.get(column).unwrap_or(0.0);
            // Less than half a step is no way at all.
            if way.abs() <= self.resolution(column) / 2.0 + 1e-9 { *before } else { way.signum() as i8 }
        };
        self.sides.iter().enumerate().map(side).collect()
    }

    /// Which way each joint of the drive last went: 1, -1, or 0 where that is not known.
    pub(crate) fn sides(&self) -> &[i8] {
        &self.sides
    }

    /// Which way each joint last went, by name, for the record.
    pub(crate) fn recorded_sides(&self) -> Value {
        let entry = |(column, side): (usize, &i8)| (self.joint_name(column).to_owned(), Value::from(*side));
        Value::Object(self.sides.iter().enumerate().map(entry).collect())
    }

    /// From here on somebody else may move the joints, which stand at `here`.
    pub(crate) fn begin_manual(&mut self, here: &JointVector) {
        self.manual = Some(ManualMotion::from(here));
    }

    /// Somebody else may have moved the joints to `here`. From which side a joint has arrived that stands elsewhere now, nobody knows; one that
    /// stands where it stood is taken to have stayed.
    pub(crate) fn saw_manual(&mut self, here: &JointVector) {
        let Some(manual) = &mut self.manual else {
            self.sides.fill(0);
            return;
        };
        for (column, side) in self.sides.iter_mut().enumerate() {
            let step = self.description.joints.get(column).map_or(0.0, |joint| joint.resolution);
            if manual.has_left(column, here, step) {
                *side = 0;
            }
        }
        manual.saw(here);
    }

    /// Nobody else moves the joints any more. Each joint of `arrivals` (its column, and 1 for from below or -1 for from above) was to be driven to
    /// where it stands from that side.
    ///
    /// # Errors
    /// The first joint that was never seen on that side, so that it cannot have come from there.
    pub(crate) fn end_manual(&mut self, here: &JointVector, arrivals: &[(usize, i8)]) -> Result<(), usize> {
        self.saw_manual(here);
        let came_from = |(column, side): &(usize, i8)| {
            let step = self.resolution(*column);
            self.sides.get(*column) == Some(side)
                || self.manual.as_ref().is_some_and(|manual| manual.was_beyond(*column, here, *side, step))
        };
        if let Some((column, _)) = arrivals.iter().find(|arrival| !came_from(arrival)) {
            return Err(*column);
        }
        for (column, side) in arrivals {
            if let Some(known) = self.sides.get_mut(*column) {
                *known = *side;
            }
        }
        self.manual = None;
        Ok(())
    }

    pub(super) fn model_pose(
        &self,
        model: &ModelFile,
        drive: &JointVector,
        sides: &[i8],
        payload: f64,
    ) -> Pose {
        Pose {
            q: model.model_joints(&self.cell_joints(&self.corrected(drive), 0.0)),
            approach: model.model_sides(&self.cell_joints(sides, 0), None),
            payload,
        }
    }

    pub(super) fn geometry(&self) -> Result<&ModelFile, String> {
        let model = self.setting.model.as_ref();
        model.ok_or_else(|| format!("the cell names no model of {}: give `model:`", self.name))
    }

    /// Values in the drive's order as the cell lists the joints.
    fn cell_joints<T: Copy>(&self, values: &[T], none: T) -> Vec<T> {
        let value = |joint: &str| self.column(joint).and_then(|column| values.get(column)).copied();
        self.setting.joints.iter().map(|(joint, _)| value(joint).unwrap_or(none)).collect()
    }

    /// How far its nearest part is clear of each of its keep-out planes, mm, by the zeros now believed; negative beyond one.
    pub(crate) fn clearances(&self, drive: &JointVector) -> Vec<NamedValue> {
        self.keep_out.as_ref().map(|check| clearances_of(check, &self.corrected(drive))).unwrap_or_default()
    }

    /// Shows where the robot is while it moves.
    pub(crate) fn show_movement(&mut self, events: EventSender) {
        let (name, zeros) = (self.name.clone(), Arc::clone(&self.zeros));
        let keep_out = self.keep_out.clone();
        let joints: Vec<(String, DegOrMm)> =
            self.description.joints.iter().map(|joint| (joint.name.clone(), unit_of(joint.unit))).collect();
        self.link.watch(Box::new(move |state| {
            let zeros = lock(&zeros).clone();
            let shown =
                joints.iter().zip(state.joints.as_slice()).zip(&zeros).map(|(((name, unit), said), zero)| {
                    NamedValue {
                        name: name.clone(),
                        value: unit.from_internal(said + zero),
                        unit: unit.symbol().to_owned(),
                        uncertainty: None,
                    }
                });
            let (time_ns, moving) = (state.time_ns, state.is_moving());
            events.send(Event::Joints { device: name.clone(), time_ns, moving, joints: shown.collect() });
            if let Some(check) = &keep_out {
                let corrected: Vec<f64> =
                    state.joints.as_slice().iter().zip(&zeros).map(|(said, zero)| said + zero).collect();
                events.send(Event::Clearance {
                    device: name.clone(),
                    planes: clearances_of(check, &corrected),
                });
            }
        }));
    }

    /// As people read it, with the zeros in force.
    pub(crate) fn named(&self, drive: &JointVector) -> Vec<NamedValue> {
        let corrected = self.corrected(drive);
        let joint = |column: usize| corrected.get(column).map(|value| self.named_value(column, *value));
        (0..self.description.joints.len()).filter_map(joint).collect()
    }

    pub(crate) fn named_value(&self, column: usize, value: f64) -> NamedValue {
        let unit = self.unit(column);
        let name = self.joint_name(column).to_owned();
        NamedValue {
            name,
            value: unit.from_internal(value),
            unit: unit.symbol().to_owned(),
            uncertainty: None,
        }
    }

    /// The points its links run between where the drive stands so, from its base to its flange, mm in its base frame; none without a model.
    pub(crate) fn outline(&self, drive: &JointVector) -> Option<Vec<[f64; 3]>> {
        let model = self.setting.model.as_ref()?;
        let corrected = self.corrected(drive);
        let in_order = self.setting.joints.iter().map(|(joint, _)| {
            let column = self.column(joint)?;
            corrected.get(column).copied()
        });
        let in_order: Option<Vec<f64>> = in_order.collect();
        let posture = Posture::of(model.chain(), &model.model_joints(&in_order?), &[]);
        let ends = posture.joints.iter().map(|frame| frame.end.translation.vector.into());
        Some(std::iter::once([0.0; 3]).chain(ends).collect())
    }

    /// For the record: what the drive said and what it means.
    pub(crate) fn recorded(&self, drive: &JointVector) -> Value {
        let rows = self.named(drive).into_iter().zip(drive.as_slice()).enumerate().map(|(column, (value, said))| {
            json!({"name": value.name, "drive": self.unit(column).from_internal(*said), "value": value.value, "unit": value.unit})
        });
        Value::Array(rows.collect())
    }

    /// Whether a move to `target` (drive's numbers) keeps the limits and stays clear of the keep-out planes all the way.
    pub(crate) fn check_move(&self, from: &JointVector, target: &JointVector) -> Result<(), NotAllowed> {
        for column in 0..self.description.joints.len() {
            self.check_limits(column, from, target)?;
        }
        self.check_planes(from, target)
    }

    fn check_limits(
        &self,
        column: usize,
        from: &JointVector,
        target: &JointVector,
    ) -> Result<(), NotAllowed> {
        let (Some(from), Some(target)) = (from.get(column), target.get(column)) else { return Ok(()) };
        if !target.is_finite() {
            return Err(NotAllowed::NoNumber { joint: self.joint_name(column).to_owned(), target });
        }
        let (lower, upper) = self.limits(column);
        let beyond = |value: f64| (lower - value).max(value - upper).max(0.0);
        if from == target || beyond(target) <= beyond(from).max(1e-9) {
            return Ok(());
        }
        let unit = self.unit(column);
        let shown = |value: f64| unit.from_internal(value + self.zero(column));
        Err(NotAllowed::Limit {
            joint: self.joint_name(column).to_owned(),
            target: shown(target),
            lower: shown(lower),
            upper: shown(upper),
            unit: unit.symbol(),
        })
    }

    /// The drive's limits of a joint, narrowed by the cell's, in the drive's numbers.
    pub(crate) fn limits(&self, column: usize) -> (f64, f64) {
        let Some(joint) = self.description.joints.get(column) else {
            return (f64::NEG_INFINITY, f64::INFINITY);
        };
        match self.setting.limits.iter().find(|(name, ..)| *name == joint.name) {
            Some((_, least, most)) => {
                let zero = self.zero(column);
                (joint.lower.max(least - zero), joint.upper.min(most - zero))
            }
            None => (joint.lower, joint.upper),
        }
    }

    /// What would pass a keep-out plane on the way, by the zeros now believed, while they are in question and the planes are not watched.
    pub(crate) fn believed_trespass(&self, from: &JointVector, target: &JointVector) -> Option<Trespass> {
        self.keep_out.as_ref().filter(|_| !self.watches_planes)?.check(from, target).err()
    }

    /// Where an answer that names a pose sends the drive from where it stands; none for another answer.
    pub(crate) fn pose_of_answer(&self, here: &JointVector, answer: &Answer) -> Option<JointVector> {
        let Answer::Pose { joints } = answer else { return None };
        let mut target = *here;
        for joint in joints {
            if let Some(column) = self.column(&joint.name) {
                target.set(column, self.unit(column).to_internal(joint.value) - self.zero(column));
            }
        }
        Some(target)
    }

    fn check_planes(&self, from: &JointVector, target: &JointVector) -> Result<(), NotAllowed> {
        match self.keep_out.as_ref().filter(|_| self.watches_planes) {
            Some(keep_out) => keep_out.check(from, target).map_err(NotAllowed::KeepOut),
            None => Ok(()),
        }
    }

    fn source(&self) -> Source<'_> {
        Source { device: &self.name, plugin: &self.plugin }
    }

    /// Looks at a state it told. `between_ns` is when it was asked for and when it had come, where the cell's clock can be read.
    ///
    /// # Errors
    /// A sentence: it cannot be.
    pub(crate) fn believe_state(
        &mut self,
        state: &JointState,
        between_ns: Option<(u64, u64)>,
    ) -> Result<(), String> {
        let asked = Asked { told_before_ns: self.told_ns, between_ns };
        believed::check_state(self.source(), &self.description, state, asked)?;
        self.told_ns = state.time_ns;
        Ok(())
    }

    /// Looks at the state in which a move to `target` ended.
    ///
    /// # Errors
    /// A sentence: it did not end there, or has not ended.
    pub(crate) fn believe_end(
        &mut self,
        target: &JointVector,
        end: &JointState,
        between_ns: Option<(u64, u64)>,
    ) -> Result<(), String> {
        let asked = Asked { told_before_ns: self.told_ns, between_ns };
        believed::check_end(self.source(), &self.description, target, end, asked)?;
        self.told_ns = end.time_ns;
        Ok(())
    }

    /// Whether it stands within its own limits.
    ///
    /// # Errors
    /// A sentence: it does not.
    pub(crate) fn check_own_limits(&self, joints: &JointVector) -> Result<(), String> {
        believed::check_limits(self.source(), &self.description, joints)
    }

    /// Whether an edge names a pose it can have been in.
    ///
    /// # Errors
    /// A sentence that names the sensor and its plugin: it does not.
    pub(crate) fn check_edge(&self, sensor: Source<'_>, edge: &ProximityEdge) -> Result<(), String> {
        believed::check_edge(sensor, &self.description, edge)
    }

    /// How long a move may take before something must be wrong, and how long it should take.
    pub(crate) fn expected_time(&self, from: &JointVector, target: &JointVector, speed: f64) -> Duration {
        let slowest = self.description.joints.iter().enumerate().map(|(column, joint)| {
            let way = (from.get(column).unwrap_or(0.0) - target.get(column).unwrap_or(0.0)).abs();
            way / (joint.max_speed.max(1e-6) * speed.max(1e-3))
        });
        Duration::from_secs_f64(slowest.fold(0.0, f64::max).clamp(0.0, 3600.0))
    }

    /// Moves the joints in which `target` differs from where the drive stands.
    pub(crate) fn move_to(
        &mut self,
        from: &JointVector,
        target: &JointVector,
        speed: f64,
        limit: Duration,
    ) -> Result<JointState, DeviceError> {
        let mask = (0..self.description.joints.len())
            .filter(|column| from.get(*column) != target.get(*column))
            .fold(0_u32, |mask, column| mask | (1 << column));
        let motion = Motion::absolute(*target, speed).only(mask);
        self.sides = self.sides_at(from, target);
        let patience = self.expected_time(from, target, speed) * 3 + Duration::from_secs(10);
        let arrived = self.link.move_joints(&motion, patience.min(limit))?;
        if let Some(manual) = &mut self.manual {
            manual.saw(&arrived.joints);
        }
        Ok(arrived)
    }
}

/// A warning, for who is to look.
pub(crate) fn believed_trespass_in_words(trespass: &Trespass) -> String {
    format!(
        "By the zeros believed now, which are in question, the end of link {} would come {:.1} mm past {}.",
        trespass.link, trespass.depth_mm, trespass.plane
    )
}

/// The zero of a joint in force, in the unit people write.
pub(crate) fn zero_in_force(corrections: &[AppliedCorrection], joint: &str) -> Option<f64> {
    let found = corrections.iter().find(|known| known.key.quantity == JOINT_ZERO && known.key.place == joint);
    found.map(|known| known.value)
}

/// Where the flange is for the joints as the cell lists them, rad.
fn flange_of(model: &ModelFile, joints: &[f64], sides: &[i8]) -> IsometryMatrix3<f64> {
    model.forward.flange(&model.model_joints(joints), &model.model_sides(sides, None))
}

fn clearances_of(check: &BoundKeepOut, corrected: &[f64]) -> Vec<NamedValue> {
    let clearances = check.clearances(corrected).into_iter();
    clearances
        .map(|(plane, value)| NamedValue { name: plane, value, unit: "mm".to_owned(), uncertainty: None })
        .collect()
}

fn lock(zeros: &Zeros) -> MutexGuard<'_, Vec<f64>> {
    zeros.lock().unwrap_or_else(PoisonError::into_inner)
}

fn unit_of(unit: JointUnit) -> DegOrMm {
    match unit {
        JointUnit::Radian => DegOrMm::Deg,
        JointUnit::Millimetre => DegOrMm::Mm,
    }
}
