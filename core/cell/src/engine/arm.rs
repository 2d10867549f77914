//! A robot as the engine sees it: its drive, the zeros in force, and where it may go.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use nalgebra::IsometryMatrix3;
use plumb_calibration::prediction::Pose;
use plumb_kinematics::{LinkFrames, inverse};
use plumb_plugin::{JointState, JointUnit, JointVector, Motion, ProximityEdge, RobotDescription};
use plumb_record::{AppliedCorrection, JOINT_ZERO};
use serde_json::{Value, json};

use crate::deg_or_mm::DegOrMm;
use crate::device::{DeviceError, RobotLink, StartError};
use crate::engine::EventSender;
use crate::engine::believed::{self, RequestTimes, Source};
use crate::event::{Event, NamedValue, PlaneClearance};
use crate::prompt::Answer;
use crate::workcell::{BoundKeepOut, KeepOut, ModelFile, RobotSetting, Trespass};

use super::joint_index::{JointIndex, UnknownJoint};
use super::manual_motion::ManualMotion;

/// The zeros in force, one a joint, shared with who shows where the robot is.
pub(crate) type Zeros = Arc<Mutex<Vec<f64>>>;

/// A connected robot. Inside, joints are in the drive's order, rad or mm. What the drive says plus the zero in force is where a joint is
/// taken to be.
pub(crate) struct Arm {
    pub(crate) name: String,
    pub(crate) plugin: String,
    pub(crate) link: Box<dyn RobotLink>,
    pub(crate) description: RobotDescription,
    setting: RobotSetting,
    /// The joints that the cell file lists, in its order.
    listed: Vec<JointIndex>,
    keep_out: Option<BoundKeepOut>,
    /// The joints' zeros are known and trusted, so that it is known where the robot is.
    watches_planes: bool,
    zeros: Zeros,
    /// Which way each joint of the drive last went: 1, -1, or 0 for one that has not moved since this run took hold of the robot.
    sides: Vec<i8>,
    /// What was seen of the joints since somebody else may move them; nothing while only this program does.
    manual: Option<ManualMotion>,
    /// The latest time it reported, ns of the cell's clock.
    reported_ns: u64,
}

/// A point that is to be brought somewhere.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RequestedPoint<'a> {
    /// Where, mm, in the model's frame of measurements.
    pub(crate) xyz_mm: [f64; 3],
    /// Which of the model's targets; the first where none is named.
    pub(crate) target: Option<&'a str>,
    /// The joints that bring it there.
    pub(crate) by: &'a [JointIndex],
    /// What the hand carries, kg.
    pub(crate) payload_kg: f64,
}

/// Why a robot may not go somewhere. Nothing has moved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum NotAllowed {
    #[error("{joint} would go to {target:.3} {unit}; it goes from {lower:.3} to {upper:.3} {unit}")]
    Limit { joint: String, target: f64, lower: f64, upper: f64, unit: &'static str },
    #[error("{joint} would go to {target}, which is no number")]
    NoNumber { joint: String, target: f64 },
    #[error("nobody knows where {joint} is or where it would go")]
    NoValue { joint: String },
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
        let fail = |cause| DeviceError::start(&setting.device, StartError::Unsuitable(cause));
        let source = Source { device: &setting.device, plugin };
        believed::check_description(source, &description).map_err(fail)?;
        for (joint, unit) in &setting.joints {
            let known = description.joints.iter().find(|known| known.name == *joint).ok_or_else(|| {
                let names = description.joints.iter().map(|known| known.name.as_str());
                let there = plumb_document::one_of(names);
                fail(format!("the cell file names a joint `{joint}`, but of the robot's joints {there}"))
            })?;
            if unit_of(known.unit) != *unit {
                let unit = unit.symbol();
                return Err(fail(format!(
                    "the cell file gives joint `{joint}` in {unit}; the robot does not"
                )));
            }
        }
        let names = description.joints.iter().map(|known| known.name.as_str());
        let listed =
            setting.joints.iter().map(|(joint, _)| JointIndex::find(&setting.device, names.clone(), joint));
        let listed = listed.collect::<Result<Vec<_>, _>>().map_err(|error| fail(error.to_string()))?;
        let keep_out = keep_out.map(|check| check.bind(&description)).transpose().map_err(fail)?;
        Ok(Self {
            name: setting.device.clone(),
            plugin: plugin.to_owned(),
            zeros: Arc::new(Mutex::new(vec![0.0; description.joints.len()])),
            sides: vec![0; description.joints.len()],
            manual: None,
            reported_ns: 0,
            link,
            description,
            setting: setting.clone(),
            listed,
            keep_out,
            watches_planes: false,
        })
    }

    /// Takes over the zeros in force. Where they are not `trusted`, because the run is to find them, the keep-out planes are not watched:
    /// nobody knows where the robot is.
    pub(crate) fn set_zeros(&mut self, corrections: &[AppliedCorrection], trusted: bool) {
        let mut zeros = vec![0.0; self.description.joints.len()];
        let zero_of = |joint: &str| zero_in_force(corrections, joint);
        for ((name, unit), joint) in self.setting.joints.iter().zip(&self.listed) {
            if let Some(value) = zero_of(name) {
                zeros[joint.position()] = unit.to_internal(value);
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

    /// The joint of this name.
    ///
    /// # Errors
    /// [`UnknownJoint`] with the names of those there are.
    pub(crate) fn joint(&self, name: &str) -> Result<JointIndex, UnknownJoint> {
        JointIndex::find(&self.name, self.description.joints.iter().map(|known| known.name.as_str()), name)
    }

    /// All joints, in the drive's order.
    pub(crate) fn joints(&self) -> impl Iterator<Item = JointIndex> + use<> {
        JointIndex::all(self.description.joints.len())
    }

    /// The smallest step of a joint's drive, rad or mm; 0 for one that is continuous.
    pub(crate) fn resolution(&self, joint: JointIndex) -> f64 {
        self.description.joints[joint.position()].resolution
    }

    pub(crate) fn unit(&self, joint: JointIndex) -> DegOrMm {
        unit_of(self.description.joints[joint.position()].unit)
    }

    pub(crate) fn joint_name(&self, joint: JointIndex) -> &str {
        &self.description.joints[joint.position()].name
    }

    /// The joint's zero in force, rad or mm.
    pub(crate) fn zero(&self, joint: JointIndex) -> f64 {
        lock(&self.zeros)[joint.position()]
    }

    /// The corrected positions of all joints for what the drive reports, in the drive's order. A joint of which it reports nothing is not
    /// a number, and so is whatever is worked out from it.
    pub(crate) fn corrected(&self, drive: &JointVector) -> Vec<f64> {
        let corrected = |joint: JointIndex| match joint.value(drive) {
            Ok(value) => value + self.zero(joint),
            Err(_) => f64::NAN,
        };
        self.joints().map(corrected).collect()
    }

    /// Where the flange is in the base frame, for what the drive says.
    ///
    /// # Errors
    /// A sentence: without a model nobody knows.
    pub(crate) fn flange(&self, drive: &JointVector) -> Result<IsometryMatrix3<f64>, String> {
        let model = self.geometry()?;
        let sides = self.in_listed_order(&self.sides);
        Ok(flange_of(model, &self.in_listed_order(&self.corrected(drive)), &sides))
    }

    /// What the drive has to be commanded to bring the flange there from where it says it is. The whole model is undone, with its effects: play by the
    /// side the joints will arrive from.
    ///
    /// # Errors
    /// A sentence: out of reach, or there is no model.
    pub(crate) fn joints_for(
        &self,
        requested: &IsometryMatrix3<f64>,
        from: &JointVector,
    ) -> Result<JointVector, String> {
        let model = self.geometry()?;
        let mut target = *from;
        let mut start = self.in_listed_order(&self.corrected(from));
        let mut sides = self.sides.clone();
        for _ in 0..2 {
            let listed = self.in_listed_order(&sides);
            let found = inverse(|joints| flange_of(model, joints, &listed), requested, &start);
            let found = found.map_err(|error| error.to_string())?;
            for (joint, value) in self.listed.iter().zip(&found) {
                joint.set(&mut target, value - self.zero(*joint))?;
            }
            sides = self.sides_at(from, &target);
            start = found;
        }
        Ok(target)
    }

    /// The way in which each joint of the drive will have arrived (1: it grew) once it has gone from one position to another.
    pub(crate) fn sides_at(&self, from: &JointVector, target: &JointVector) -> Vec<i8> {
        let side = |(joint, before): (JointIndex, &i8)| match (joint.value(from), joint.value(target)) {
            (Ok(from), Ok(target)) => {
                let way = target - from;
                // Less than half a step is no way at all.
                if way.abs() <= self.resolution(joint) / 2.0 + 1e-9 { *before } else { way.signum() as i8 }
            }
            _ => 0,
        };
        self.joints().zip(&self.sides).map(side).collect()
    }

    /// Which way each joint of the drive last went: 1, -1, or 0 where that is not known.
    pub(crate) fn sides(&self) -> &[i8] {
        &self.sides
    }

    /// Which way each joint last went, by name, for the record.
    pub(crate) fn recorded_sides(&self) -> Value {
        let entry =
            |(joint, side): (JointIndex, &i8)| (self.joint_name(joint).to_owned(), Value::from(*side));
        Value::Object(self.joints().zip(&self.sides).map(entry).collect())
    }

    /// From here on somebody else may move the joints, which are at `here`.
    pub(crate) fn begin_manual(&mut self, here: &JointVector) {
        self.manual = Some(ManualMotion::from(here));
    }

    /// Somebody else may have moved the joints to `here`. From which side a joint has arrived that is elsewhere now, nobody knows; one that
    /// is where it was is taken to have stayed.
    pub(crate) fn saw_manual(&mut self, here: &JointVector) {
        let Some(manual) = &mut self.manual else {
            self.sides.fill(0);
            return;
        };
        for (joint, known) in JointIndex::all(self.sides.len()).zip(&self.description.joints) {
            if manual.has_left(joint, here, known.resolution) {
                self.sides[joint.position()] = 0;
            }
        }
        manual.saw(here);
    }

    /// Nobody else moves the joints any more. Each joint of `arrivals` (with 1 for from below or -1 for from above) was to be driven to
    /// where it is from that side.
    ///
    /// # Errors
    /// The first joint that was never seen on that side, so that it cannot have come from there.
    pub(crate) fn end_manual(
        &mut self,
        here: &JointVector,
        arrivals: &[(JointIndex, i8)],
    ) -> Result<(), JointIndex> {
        self.saw_manual(here);
        let came_from = |(joint, side): &(JointIndex, i8)| {
            let step = self.resolution(*joint);
            self.sides[joint.position()] == *side
                || self.manual.as_ref().is_some_and(|manual| manual.was_beyond(*joint, here, *side, step))
        };
        if let Some((joint, _)) = arrivals.iter().find(|arrival| !came_from(arrival)) {
            return Err(*joint);
        }
        for (joint, side) in arrivals {
            self.sides[joint.position()] = *side;
        }
        self.manual = None;
        Ok(())
    }

    pub(crate) fn model_pose(
        &self,
        model: &ModelFile,
        drive: &JointVector,
        sides: &[i8],
        payload: f64,
    ) -> Pose {
        Pose {
            q: model.model_joints(&self.in_listed_order(&self.corrected(drive))),
            approach: model.model_sides(&self.in_listed_order(sides), None),
            payload,
        }
    }

    pub(crate) fn geometry(&self) -> Result<&ModelFile, String> {
        let model = self.setting.model.as_ref();
        model.ok_or_else(|| format!("the cell names no model of {}: give `model:`", self.name))
    }

    /// Values of all joints, which come in the drive's order, as the cell file lists the joints.
    fn in_listed_order<T: Copy>(&self, values: &[T]) -> Vec<T> {
        self.listed.iter().map(|joint| values[joint.position()]).collect()
    }

    /// How far its nearest part is clear of each of its keep-out planes, by the zeros now believed.
    pub(crate) fn clearances(&self, drive: &JointVector) -> Vec<PlaneClearance> {
        self.keep_out.as_ref().map(|check| check.clearances(&self.corrected(drive))).unwrap_or_default()
    }

    /// Shows where the robot is while it moves.
    pub(crate) fn show_movement(&mut self, events: EventSender) {
        let (name, zeros) = (self.name.clone(), Arc::clone(&self.zeros));
        let keep_out = self.keep_out.clone();
        let joints: Vec<(String, DegOrMm)> =
            self.description.joints.iter().map(|joint| (joint.name.clone(), unit_of(joint.unit))).collect();
        self.link.watch(Box::new(move |state| {
            let zeros = lock(&zeros).clone();
            let shown = joints.iter().zip(state.joints.as_slice()).zip(&zeros).map(
                |(((name, unit), reported), zero)| NamedValue {
                    name: name.clone(),
                    value: unit.from_internal(reported + zero),
                    unit: unit.symbol().to_owned(),
                    uncertainty: None,
                },
            );
            let (time_ns, moving) = (state.time_ns, state.is_moving());
            events.send(Event::Joints { device: name.clone(), time_ns, moving, joints: shown.collect() });
            if let Some(check) = &keep_out {
                let corrected: Vec<f64> = state
                    .joints
                    .as_slice()
                    .iter()
                    .zip(&zeros)
                    .map(|(reported, zero)| reported + zero)
                    .collect();
                events.send(Event::Clearance { device: name.clone(), planes: check.clearances(&corrected) });
            }
        }));
    }

    /// As people read it, with the zeros in force.
    pub(crate) fn named(&self, drive: &JointVector) -> Vec<NamedValue> {
        self.joints()
            .zip(self.corrected(drive))
            .map(|(joint, value)| self.named_value(joint, value))
            .collect()
    }

    pub(crate) fn named_value(&self, joint: JointIndex, value: f64) -> NamedValue {
        let unit = self.unit(joint);
        let name = self.joint_name(joint).to_owned();
        NamedValue {
            name,
            value: unit.from_internal(value),
            unit: unit.symbol().to_owned(),
            uncertainty: None,
        }
    }

    /// The points its links run between where the drive is so, from its base to its flange, mm in its base frame; none without a model.
    pub(crate) fn outline(&self, drive: &JointVector) -> Option<Vec<[f64; 3]>> {
        let model = self.setting.model.as_ref()?;
        let joints = self.in_listed_order(&self.corrected(drive));
        let link_frames = LinkFrames::of(model.chain(), &model.model_joints(&joints), &[]);
        let ends = link_frames.joints.iter().map(|frame| frame.end.translation.vector.into());
        Some(std::iter::once([0.0; 3]).chain(ends).collect())
    }

    /// For the record: what the drive said and what it means.
    pub(crate) fn recorded(&self, drive: &JointVector) -> Value {
        let rows = self.joints().zip(self.named(drive)).zip(drive.as_slice()).map(|((joint, value), reported)| {
            json!({"name": value.name, "drive": self.unit(joint).from_internal(*reported), "value": value.value, "unit": value.unit})
        });
        Value::Array(rows.collect())
    }

    /// Whether a move to `target` (drive's numbers) keeps the limits and stays clear of the keep-out planes all the way.
    pub(crate) fn check_move(&self, from: &JointVector, target: &JointVector) -> Result<(), NotAllowed> {
        for joint in self.joints() {
            self.check_limits(joint, from, target)?;
        }
        self.check_planes(from, target)
    }

    fn check_limits(
        &self,
        joint: JointIndex,
        from: &JointVector,
        target: &JointVector,
    ) -> Result<(), NotAllowed> {
        let name = || self.joint_name(joint).to_owned();
        let (Ok(from), Ok(target)) = (joint.value(from), joint.value(target)) else {
            return Err(NotAllowed::NoValue { joint: name() });
        };
        if !target.is_finite() {
            return Err(NotAllowed::NoNumber { joint: name(), target });
        }
        let (lower, upper) = self.limits(joint);
        let beyond = |value: f64| (lower - value).max(value - upper).max(0.0);
        if from == target || beyond(target) <= beyond(from).max(1e-9) {
            return Ok(());
        }
        let unit = self.unit(joint);
        let shown = |value: f64| unit.from_internal(value + self.zero(joint));
        Err(NotAllowed::Limit {
            joint: name(),
            target: shown(target),
            lower: shown(lower),
            upper: shown(upper),
            unit: unit.symbol(),
        })
    }

    /// The drive's limits of a joint, narrowed by the cell's, in the drive's numbers.
    pub(crate) fn limits(&self, joint: JointIndex) -> (f64, f64) {
        let known = &self.description.joints[joint.position()];
        match self.setting.limits.iter().find(|(name, ..)| *name == known.name) {
            Some((_, least, most)) => {
                let zero = self.zero(joint);
                (known.lower.max(least - zero), known.upper.min(most - zero))
            }
            None => (known.lower, known.upper),
        }
    }

    /// What would pass a keep-out plane on the way, by the zeros now believed, while they are in question and the planes are not watched.
    pub(crate) fn believed_trespass(&self, from: &JointVector, target: &JointVector) -> Option<Trespass> {
        self.keep_out.as_ref().filter(|_| !self.watches_planes)?.check(from, target).err()
    }

    /// Where an answer that names a pose sends the drive from where it is; none for another answer.
    ///
    /// # Errors
    /// A sentence: the robot has no such joint, or its position is not known.
    pub(crate) fn pose_of_answer(
        &self,
        here: &JointVector,
        answer: &Answer,
    ) -> Result<Option<JointVector>, String> {
        let Answer::Pose { joints } = answer else { return Ok(None) };
        let mut target = *here;
        for named in joints {
            let joint = self.joint(&named.name)?;
            joint.set(&mut target, self.unit(joint).to_internal(named.value) - self.zero(joint))?;
        }
        Ok(Some(target))
    }

    /// Where one step of a jog, in the unit people write, sends the drive from where it is.
    ///
    /// # Errors
    /// A sentence: the robot has no such joint, or does not say where it is.
    pub(crate) fn jog_target(&self, here: &JointVector, joint: &str, by: f64) -> Result<JointVector, String> {
        let index = self.joint(joint)?;
        let from = index.value(here).ok().filter(|from| from.is_finite());
        let from = from.ok_or_else(|| format!("{} does not say where its {joint} is", self.name))?;
        let mut target = *here;
        index.set(&mut target, from + self.unit(index).to_internal(by))?;
        Ok(target)
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

    /// Looks at a state it reported. `between_ns` is when it was asked for and when it had come, where the cell's clock can be read.
    ///
    /// # Errors
    /// A sentence: it cannot be.
    pub(crate) fn believe_state(
        &mut self,
        state: &JointState,
        between_ns: Option<(u64, u64)>,
    ) -> Result<(), String> {
        let asked = RequestTimes { reported_before_ns: self.reported_ns, between_ns };
        believed::check_state(self.source(), &self.description, state, asked)?;
        self.reported_ns = state.time_ns;
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
        let asked = RequestTimes { reported_before_ns: self.reported_ns, between_ns };
        believed::check_end(self.source(), &self.description, target, end, asked)?;
        self.reported_ns = end.time_ns;
        Ok(())
    }

    /// Whether it is within its own limits.
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
        let ways = from.as_slice().iter().zip(target.as_slice()).map(|(from, target)| (from - target).abs());
        let slowest = self
            .description
            .joints
            .iter()
            .zip(ways)
            .map(|(joint, way)| way / (joint.max_speed.max(1e-6) * speed.max(1e-3)));
        Duration::from_secs_f64(slowest.fold(0.0, f64::max).clamp(0.0, 3600.0))
    }

    /// Moves the joints in which `target` differs from where the drive is.
    pub(crate) fn move_to(
        &mut self,
        from: &JointVector,
        target: &JointVector,
        speed: f64,
        limit: Duration,
    ) -> Result<JointState, DeviceError> {
        let mask = self
            .joints()
            .filter(|joint| joint.value(from) != joint.value(target))
            .fold(0_u32, |mask, joint| mask | (1 << joint.position()));
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
    match trespass {
        Trespass::Beyond { link, plane, depth_mm } => format!(
            "By the zeros believed now, which are in question, the end of link {link} would come {depth_mm:.1} mm past {plane}."
        ),
        Trespass::Unknown { link, plane } => {
            format!("Where the end of link {link} would come is not known: it may come past {plane}.")
        }
    }
}

/// The zero of a joint in force, in the unit people write.
pub(crate) fn zero_in_force(corrections: &[AppliedCorrection], joint: &str) -> Option<f64> {
    let found = corrections.iter().find(|known| known.key.quantity == JOINT_ZERO && known.key.site == joint);
    found.map(|known| known.value)
}

/// Where the flange is for the joints as the cell lists them, rad.
fn flange_of(model: &ModelFile, joints: &[f64], sides: &[i8]) -> IsometryMatrix3<f64> {
    model.forward.flange(&model.model_joints(joints), &model.model_sides(sides, None))
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
