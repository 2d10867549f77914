//! `search`: a joint moves in pieces, after each of which the sensor is asked what it has seen up to that moment. When it has changed as
//! wanted, the arm has overshot by one piece at most; it backs off and approaches again, slowly, from the same side, and ends at the very
//! pose at which the sensor changed.

use plumb_plugin::{JointVector, ProximityEdge, Reading};
use plumb_record::Trigger;
use serde_json::{Map, Value, json};

use super::{Approach, SearchStep};
use crate::engine::Engine;
use crate::engine::believed::Source;
use crate::engine::joint_index::JointIndex;
use crate::engine::motion::joint_vector;
use crate::engine::scope::joints_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::Event;
use crate::in_words::{known_within, sentence_case, surface_called};

/// Where the result of a search keeps its circumstances.
pub(crate) const CIRCUMSTANCES: &str = "circumstances";

/// The first step of a drive without steps that creeps on towards its edge, rad or mm: far below what any pose is known to.
const FINEST_CREEP: f64 = 1e-12;

/// A search with its numbers, in the drive's units.
struct Search<'a> {
    step: &'a SearchStep,
    joint: JointIndex,
    /// +1 or -1.
    direction: f64,
    /// Where the searched joint may go at most.
    end: f64,
    /// It ends there because the joint goes no further.
    ends_at_limit: bool,
    back_off: f64,
}

impl Engine {
    pub(crate) fn execute_search(&mut self, step: &SearchStep, at: &StepContext) -> Result<Done, StepError> {
        let start = self.begin_search(step, at)?;
        let search = self.plan_search(step, at, &start)?;
        self.sensor(&step.sensor)?.link.arm().map_err(|error| self.device_error(error))?;
        let start = self.clear_start(&search, at, start)?;
        let Some(fast) = self.approach(&search, at, start, search.end, &step.fast, false)? else {
            return self.nothing_found(&search, start);
        };
        let behind = self.back_off(&search, at, &fast)?;
        let beyond = search.joint.value(&fast.joints)?
            + search.direction * (search.back_off + self.chunk(&search, &step.fast));
        let Some(fine) = self.approach(&search, at, behind, beyond, &step.slow, true)? else {
            return Err(self.not_there_again(&search, self.chunk(&search, &step.fast)));
        };
        self.return_to_trigger(&search, at, &fine)?;
        self.search_done(&search, at, &fine, &fast)
    }

    /// Where the search begins: where the arm is, or where an interrupted attempt began.
    fn begin_search(&mut self, step: &SearchStep, at: &StepContext) -> Result<JointVector, StepError> {
        let here = self.read_pose(&step.robot)?.joints;
        let earlier = at.intent.as_ref().and_then(|intent| joint_vector(intent.get("start")?));
        let start = match earlier {
            Some(start) if start != here => {
                self.allowed(&step.robot, &here, &start)?;
                self.journal.progress(&at.path, None, "back to where the search began".to_owned());
                self.move_arm(&step.robot, &here, &start, step.slow.speed.max(0.2), at)?
            }
            _ => here,
        };
        self.journal.record.note_intent(
            at.attempt.row,
            &json!({"robot": step.robot, "joint": step.joint, "start": start.as_slice()}),
        )?;
        Ok(start)
    }

    fn plan_search<'s>(
        &mut self,
        step: &'s SearchStep,
        at: &StepContext,
        start: &JointVector,
    ) -> Result<Search<'s>, StepError> {
        let travel = step.unit.to_internal(self.number(at.scope, &step.travel)?);
        let arm = self.arm(&step.robot)?;
        let joint = arm.joint(&step.joint)?;
        let (lower, upper) = arm.limits(joint);
        let from = joint.value(start)?;
        if travel == 0.0 {
            return Err(StepError::error(
                "the travel of the search is 0: give how far it may go, with the sign of the direction",
            ));
        }
        let requested = from + travel;
        let end = if travel > 0.0 { requested.min(upper.max(from)) } else { requested.max(lower.min(from)) };
        Ok(Search {
            step,
            joint,
            direction: travel.signum(),
            end,
            ends_at_limit: end != requested,
            back_off: step.unit.to_internal(step.back_off),
        })
    }

    fn chunk(&self, search: &Search<'_>, approach: &Approach) -> f64 {
        search.step.unit.to_internal(approach.chunk)
    }

    fn allowed(&mut self, robot: &str, from: &JointVector, to: &JointVector) -> Result<(), StepError> {
        self.arm(robot)?.check_move(from, to).map_err(|reason| StepError::error(reason.to_string()))
    }

    /// What the sensor has seen up to the moment at which the arm came to rest.
    fn look(&mut self, search: &Search<'_>) -> Result<Reading, StepError> {
        let state = self.read_pose(&search.step.robot)?;
        let sensor = search.step.sensor.as_str();
        let reading = self.read_sensor(sensor, state.time_ns, state.time_ns)?;
        let plugin = self.sensor(sensor)?.plugin.clone();
        let arm = self.arm(&search.step.robot)?;
        for edge in &reading.edges {
            let source = Source { device: sensor, plugin: &plugin };
            arm.check_edge(source, edge).map_err(StepError::Error)?;
        }
        if let Some(on) = reading.fired {
            let device = search.step.sensor.clone();
            self.journal.show(Event::Signal {
                device,
                signal: "fired".to_owned(),
                on,
                time_ns: reading.time_ns,
            });
        }
        Ok(reading)
    }

    /// Makes sure the sensor is not yet as wanted. Exactly at a threshold it may say so without meaning it: a small piece of the way shows it.
    fn clear_start(
        &mut self,
        search: &Search<'_>,
        at: &StepContext,
        start: JointVector,
    ) -> Result<JointVector, StepError> {
        let step = search.step;
        let mut here = start;
        if !self.is_there(search)? {
            return Ok(here);
        }
        if !step.back_off_first {
            let goal = search.joint.value(&here)? + search.direction * self.chunk(search, &step.slow);
            here = self.step_to(search, at, &here, goal, step.slow.speed)?;
            if !self.is_there(search)? {
                return Ok(here);
            }
            let (state, other) = if step.until_on { ("ON", "OFF") } else { ("OFF", "ON") };
            let towards = if search.direction < 0.0 { "greater" } else { "smaller" };
            let message = format!(
                "{} is already {state} at the start of the search. Move {}'s {} towards {towards} values until {} is {other}, then do the step again",
                step.sensor, step.robot, step.joint, step.sensor
            );
            return Err(StepError::error(message));
        }
        for _ in 0..50 {
            self.journal.progress(&at.path, None, format!("{} is there already: backing off", step.sensor));
            let goal = search.joint.value(&here)? - search.direction * search.back_off;
            here = self.step_to(search, at, &here, goal, step.fast.speed)?;
            if !self.is_there(search)? {
                return Ok(here);
            }
        }
        Err(StepError::error(format!("{} does not change however far {} backs off", step.sensor, step.joint)))
    }

    /// Whether the sensor is as the search wants it, now.
    fn is_there(&mut self, search: &Search<'_>) -> Result<bool, StepError> {
        let step = search.step;
        match self.look(search)?.fired {
            Some(fired) => Ok(fired == step.until_on),
            None => Err(StepError::error(format!(
                "{} does not say whether it has fired: it cannot be searched with",
                step.sensor
            ))),
        }
    }

    fn step_to(
        &mut self,
        search: &Search<'_>,
        at: &StepContext,
        here: &JointVector,
        coordinate: f64,
        speed: f64,
    ) -> Result<JointVector, StepError> {
        let mut target = *here;
        search.joint.set(&mut target, coordinate)?;
        self.allowed(&search.step.robot, here, &target)?;
        self.move_arm(&search.step.robot, here, &target, speed, at)
    }

    /// Moves in pieces until the sensor changes as wanted; gives the edge, or none when it came to the end without.
    fn approach(
        &mut self,
        search: &Search<'_>,
        at: &StepContext,
        start: JointVector,
        end: f64,
        approach: &Approach,
        fine: bool,
    ) -> Result<Option<ProximityEdge>, StepError> {
        let chunk = self.chunk(search, approach);
        let from = search.joint.value(&start)?;
        let resolution = self.arm(&search.step.robot)?.resolution(search.joint);
        let mut here = start;
        loop {
            let now = search.joint.value(&here)?;
            let left = (end - now) * search.direction;
            // A drive that moves in steps ends short of what is less than half a step away, and would for ever.
            if left <= resolution / 2.0 + 1e-9 {
                return Ok(None);
            }
            let goal = if left <= chunk { end } else { now + search.direction * chunk };
            here = self.step_to(search, at, &here, goal, approach.speed)?;
            let reading = self.look(search)?;
            let pace = if fine { "slowly" } else { "fast" };
            let fraction = ((goal - from) / (end - from)).clamp(0.0, 1.0);
            let arm = self.arm(&search.step.robot)?;
            let shown = arm.named_value(search.joint, search.joint.value(&here)? + arm.zero(search.joint));
            let text = format!("{pace}: {} at {:.2} {}", shown.name, shown.value, shown.unit);
            self.journal.progress(&at.path, Some(fraction), text);
            if let Some(edge) = reading.edges.iter().find(|edge| edge.has_fired() == search.step.until_on) {
                self.note_trigger(search, at, edge, fine)?;
                return Ok(Some(*edge));
            }
        }
    }

    /// The sensor did not change on the whole way: an error, unless the procedure wants to know just that.
    fn nothing_found(&mut self, search: &Search<'_>, start: JointVector) -> Result<Done, StepError> {
        let step = search.step;
        let unit = step.unit;
        let here = self.read_pose(&step.robot)?.joints;
        let arm = self.arm(&step.robot)?;
        let shown = |at: f64| arm.named_value(search.joint, at + arm.zero(search.joint)).value;
        let (from, to) = (shown(search.joint.value(&start)?), shown(search.joint.value(&here)?));
        let state = if step.until_on { "OFF" } else { "ON" };
        let why = match search.ends_at_limit {
            true => format!(", and {} goes no further", step.joint),
            false => String::new(),
        };
        let sought = step
            .finds
            .as_ref()
            .map(|finds| sentence_case(&format!("{} not found: ", surface_called(&finds.surface))));
        let what = format!(
            "{}{} stayed {state} while {} went from {from:.2} to {to:.2} {}{why}",
            sought.unwrap_or_default(),
            step.sensor,
            step.joint,
            unit.symbol()
        );
        if !step.may_find_nothing {
            let advice =
                "Move the arm nearer to what is sought and do the step again, or allow a longer travel";
            return Err(StepError::Failed(format!("{what}. {advice}")));
        }
        let joints = joints_value(&self.arm(&step.robot)?.named(&here));
        let half_width = format!("half_width_{}", unit.symbol());
        let result = json!({"found": false, "joints": joints, "fast_joints": joints, half_width: 0.0});
        Ok(Done { result, values: Vec::new(), message: what })
    }

    /// Goes back to where the sensor is as it was before, on the side the search came from.
    fn back_off(
        &mut self,
        search: &Search<'_>,
        at: &StepContext,
        edge: &ProximityEdge,
    ) -> Result<JointVector, StepError> {
        let step = search.step;
        let mut here = self.read_pose(&step.robot)?.joints;
        let trigger = search.joint.value(&edge.joints)?;
        for times in 1..=5 {
            let goal = trigger - search.direction * search.back_off * f64::from(times);
            here = self.step_to(search, at, &here, goal, step.fast.speed)?;
            if !self.is_there(search)? {
                return Ok(here);
            }
        }
        let message = format!(
            "{} stays as it is although {} backed off by {:.2} {}: give a larger back_off",
            step.sensor,
            step.joint,
            5.0 * step.back_off,
            step.unit.symbol()
        );
        Err(StepError::error(message))
    }

    /// Ends at the pose of the edge, coming from the same side as the search. There the sensor need not be again what it was: the light is
    /// unsteady, a drive moves in steps, play lets the arm end short. What comes next counts on it, so the arm then creeps on until the sensor
    /// is as wanted, no further than the fast approach may have overshot. The edge's own pose and half-width stay what is recorded.
    fn return_to_trigger(
        &mut self,
        search: &Search<'_>,
        at: &StepContext,
        edge: &ProximityEdge,
    ) -> Result<(), StepError> {
        let step = search.step;
        let trigger = search.joint.value(&edge.joints)?;
        let mut here = self.read_pose(&step.robot)?.joints;
        let overshoot = (search.joint.value(&here)? - trigger) * search.direction;
        if overshoot > 0.0 {
            let before = trigger - search.direction * search.back_off;
            here = self.step_to(search, at, &here, before, step.fast.speed)?;
        }
        let resolution = self.arm(&step.robot)?.resolution(search.joint);
        // The middle of a half-step is no position to be at, and which way a driver rounds it is its own affair: the far end is where the sensor
        // was seen to have changed.
        let half_width = search.joint.value(&edge.joints_half_width)?;
        let seen = trigger + search.direction * half_width.min(resolution / 2.0);
        here = self.step_to(search, at, &here, seen, step.slow.speed)?;
        let allowance = self.chunk(search, &step.fast).max(self.chunk(search, &step.slow));
        let furthest = trigger + search.direction * allowance;
        let mut creep = resolution.max(FINEST_CREEP);
        while !self.is_there(search)? {
            let now = search.joint.value(&here)?;
            let left = (furthest - now) * search.direction;
            if left < FINEST_CREEP.max(resolution / 2.0) {
                return Err(self.not_there_again(search, allowance));
            }
            here =
                self.step_to(search, at, &here, now + search.direction * creep.min(left), step.slow.speed)?;
            // A drive without steps looks for the way that is just enough, from nothing upwards.
            if resolution == 0.0 {
                creep *= 2.0;
            }
        }
        Ok(())
    }

    fn not_there_again(&self, search: &Search<'_>, allowance: f64) -> StepError {
        let step = search.step;
        let (was, is) = if step.until_on { ("came on", "stays off") } else { ("went off", "stays on") };
        StepError::error(format!(
            "{} {was} on {}'s slow approach, but {is} when it comes there again, even {:.2} {} further: something moves, or the light is too \
             unsteady for the sensor's hysteresis",
            step.sensor,
            step.joint,
            step.unit.from_internal(allowance),
            step.unit.symbol()
        ))
    }

    fn note_trigger(
        &mut self,
        search: &Search<'_>,
        at: &StepContext,
        edge: &ProximityEdge,
        fine: bool,
    ) -> Result<(), StepError> {
        let step = search.step;
        let height = step.finds.as_ref().and_then(|finds| finds.height_mm.as_ref());
        let height_mm = height.map(|height| self.number(at.scope, height)).transpose()?;
        let arm = self.arm(&step.robot)?;
        let recorded = arm.recorded(&edge.joints);
        let sides = arm.recorded_sides();
        let named = arm.named(&edge.joints);
        let half_width = arm.named_value(search.joint, search.joint.value(&edge.joints_half_width)?);
        let trigger = Trigger {
            device: &step.robot,
            sensor: &step.sensor,
            fired: edge.has_fired(),
            fine,
            time_ns: edge.time_ns,
            joint: &step.joint,
            joints: &recorded,
            half_width: half_width.value,
            unit: step.unit.symbol(),
            surface: step.finds.as_ref().map(|finds| finds.surface.as_str()),
            height_mm,
            direction: search.direction.signum() as i8,
            sides: &sides,
        };
        Ok(self.journal.trigger(&at.path, &trigger, named, half_width.clone())?)
    }

    /// Under which load and so on the sensor changed, by the columns of the measurement table; no return to a pose is 0, and left out.
    fn circumstances(
        &mut self,
        step: &SearchStep,
        at: &StepContext,
    ) -> Result<Map<String, Value>, StepError> {
        let mut entries = Map::new();
        for (column, value) in step.finds.iter().flat_map(|finds| &finds.circumstances) {
            let value = self.number(at.scope, value)?;
            if *column != "repeat" || value != 0.0 {
                entries.insert((*column).to_owned(), value.into());
            }
        }
        Ok(entries)
    }

    fn search_done(
        &mut self,
        search: &Search<'_>,
        at: &StepContext,
        fine: &ProximityEdge,
        fast: &ProximityEdge,
    ) -> Result<Done, StepError> {
        let step = search.step;
        let circumstances = self.circumstances(step, at)?;
        let arm = self.arm(&step.robot)?;
        let joints = arm.named(&fine.joints);
        let half_width = arm.named_value(search.joint, search.joint.value(&fine.joints_half_width)?).value;
        let unit = step.unit.symbol();
        let mut result = json!({"found": true, "joints": joints_value(&joints), "fast_joints": joints_value(&arm.named(&fast.joints))});
        if let Some(entries) = result.as_object_mut() {
            entries.insert(format!("half_width_{unit}"), half_width.into());
            entries.extend(
                (!circumstances.is_empty()).then(|| (CIRCUMSTANCES.to_owned(), circumstances.into())),
            );
        }
        let found = arm.named_value(search.joint, search.joint.value(&fine.joints)? + arm.zero(search.joint));
        let state = if step.until_on { "came on" } else { "went off" };
        let message = format!(
            "{} {state} with {} at {:.4} {unit} ({})",
            step.sensor,
            step.joint,
            found.value,
            known_within(half_width, unit)
        );
        Ok(Done { result, values: vec![found], message })
    }
}
