//! The operator brings the arm somewhere: with its pendant, or joint by joint from here.
//!
//! A jog moves the arm at once or not at all. At most one step is in flight; whatever comes meanwhile is dropped, an answer with words. So the arm
//! is at rest at most one step after the key is let go.

use plumb_plugin::{JointVector, Reading};
use serde_json::{Value, json};

use super::pendant::Pendant;
use super::{JOG_SPEED, SimulatedAct};
use crate::device::Act;
use crate::engine::arm::believed_trespass_in_words;
use crate::engine::journal::Question as Asked;
use crate::engine::prompting::Received;
use crate::engine::scope::joints_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::engine::{Engine, interrupted};
use crate::event::{Event, StepPath};
use crate::in_words::with_decimals;
use crate::prompt::{Answer, ChoiceOption, JogGoal, Prompt, PromptKind};
use crate::step::question::{Arrival, PromptQuestion};
use crate::workcell::Trespass;

/// Said of an answer that came while the arm was on its way.
const STILL_MOVING: &str =
    "the arm was still moving when you answered: look where it is now, and answer again";

/// One `jog_to` prompt while it is open.
struct Jogging<'a> {
    robot: &'a str,
    /// As it is declared.
    declared: &'a PromptQuestion,
    /// What a simulated operator does.
    simulated: Option<&'a SimulatedAct>,
    at: &'a StepContext,
    /// As it is asked, and asked again after a warning.
    question: Asked<'a>,
    goals: Vec<JogGoal>,
    /// The sides from which joints have to come.
    arrivals: &'a [Arrival],
    /// The prompt on the screens; none once it is answered or withdrawn.
    open: Option<Prompt>,
    pendant: Pendant,
    /// Where the robot was when it was asked.
    before: JointVector,
    /// The operator was warned that the arm seems to pass a keep-out plane, and went on.
    may_pass_planes: bool,
    /// A sensor that is read meanwhile, until it cannot be.
    sensor: Option<String>,
    /// The simulated instrument that is read meanwhile: the spirit level to whose bubble the arm is driven, else a ruler.
    instrument: Option<Act>,
}

/// The reading of the level to which a simulated operator would drive the arm.
fn level_reading(simulated: Option<&SimulatedAct>) -> Option<Act> {
    let SimulatedAct { words, .. } = simulated.filter(|act| act.act == "drive_to_level")?;
    let words = words.iter().filter(|(key, _)| key == "at" || key == "turned").cloned().collect();
    Some(Act { name: "read_level".to_owned(), numbers: Vec::new(), words })
}

/// The reading of a ruler that is beside the arm where it is driven anywhere else.
fn ruler_reading() -> Act {
    Act { name: RULER.to_owned(), numbers: Vec::new(), words: Vec::new() }
}

/// How the simulated operator reads a ruler.
const RULER: &str = "read_ruler";

/// What came of a jog.
enum Jogged {
    /// The arm moved, or the operator was shown why it did not.
    Over,
    /// By the zeros now believed it would pass a plane: nothing moved.
    Trespass(Trespass),
}

impl Engine {
    /// Waits until the operator says that the arm is where it should.
    pub(crate) fn jog_to(
        &mut self,
        declared: &PromptQuestion,
        simulated: Option<&SimulatedAct>,
        question: Asked<'_>,
        at: &StepContext,
    ) -> Result<Done, StepError> {
        let PromptQuestion::JogTo { robot, arrivals, .. } = declared else {
            return Err(StepError::error("this prompt asks for no place of a robot"));
        };
        let before = self.read_pose_anywhere(robot)?.joints;
        self.arm(robot)?.begin_manual(&before);
        let (goals, sensor) = match &question.kind {
            PromptKind::JogTo { goals, sensor, .. } => (goals.clone(), sensor.clone()),
            _ => (Vec::new(), None),
        };
        let prompt = self.journal.ask(question.clone())?;
        if let Some((answer, by)) = self.answer_of_nobody(&prompt, at)? {
            self.simulate_unless_moved(robot, simulated, &before, &answer, at)?;
            self.refuse_unattended_trespass(robot, &answer)?;
            let here = self.bring_to(robot, &answer, at)?;
            self.goals_met(robot, &here, &goals).map_err(StepError::Error)?;
            self.end_manual(robot, &here, arrivals).map_err(StepError::Error)?;
            self.journal.answered(&prompt, &answer, &by)?;
            return self.jog_done(robot, &here);
        }
        let pendant = Pendant::for_robot(&self.arm(robot)?.description.capabilities);
        let open = Some(prompt);
        let mut jogging = Jogging {
            robot,
            declared,
            simulated,
            at,
            question,
            goals,
            arrivals,
            open,
            pendant,
            before,
            may_pass_planes: false,
            sensor,
            instrument: Some(level_reading(simulated).unwrap_or_else(ruler_reading)),
        };
        self.look_while_jogging(&mut jogging)?;
        self.read_while_jogging(&mut jogging);
        let done = self.jog_until_done(&mut jogging);
        if let (Err(_), Some(prompt)) = (&done, jogging.open.take()) {
            // A prompt that nobody waits for any more must not look as if it were.
            self.journal.withdrawn(&prompt)?;
        }
        done
    }

    fn jog_until_done(&mut self, jogging: &mut Jogging<'_>) -> Result<Done, StepError> {
        loop {
            let Some(prompt) = jogging.open.clone() else {
                let kind =
                    self.prompt_kind(jogging.declared, jogging.at)?.with_offers_of(&jogging.question.kind);
                jogging.open = Some(self.journal.ask(Asked { kind, ..jogging.question.clone() })?);
                continue;
            };
            match self.receive(&prompt, jogging.at) {
                Ok(Received::Answer(answer, by)) => {
                    if let Some(done) = self.take_jog_answer(jogging, &prompt, &answer, &by)? {
                        return Ok(done);
                    }
                }
                Ok(Received::Jog { joint, by }) => {
                    let jogged = match self.take_back(jogging.robot, &mut jogging.pendant) {
                        Ok(()) => self.jog_joint(jogging, &prompt, &joint, by)?,
                        Err(StepError::Error(reason)) => {
                            self.refuse(&prompt, &reason);
                            Jogged::Over
                        }
                        Err(other) => return Err(other),
                    };
                    self.read_while_jogging(jogging);
                    self.drop_what_came_meanwhile(&prompt)?;
                    if let Jogged::Trespass(trespass) = jogged {
                        self.journal.withdrawn(&prompt)?;
                        jogging.open = None;
                        jogging.may_pass_planes = self.warn_of_trespass(jogging, &trespass)?;
                    }
                }
                Ok(Received::HandOver) => self.hand_over(jogging.robot, &mut jogging.pendant, &prompt)?,
                Ok(Received::Silence) => {
                    self.look_on(jogging.robot, &mut jogging.pendant, &prompt)?;
                    self.look_while_jogging(jogging)?;
                }
                Err(error) => {
                    // It was withdrawn already. What ends the prompt counts, not whether the pendant gives the robot back.
                    jogging.open = None;
                    let _ = self.take_back(jogging.robot, &mut jogging.pendant);
                    return Err(error);
                }
            }
        }
    }

    /// The end of the prompt, if the answer can be taken.
    fn take_jog_answer(
        &mut self,
        jogging: &mut Jogging<'_>,
        prompt: &Prompt,
        answer: &Answer,
        by: &str,
    ) -> Result<Option<Done>, StepError> {
        let (robot, at) = (jogging.robot, jogging.at);
        let brought = self
            .take_back(robot, &mut jogging.pendant)
            .and_then(|()| self.simulate_unless_moved(robot, jogging.simulated, &jogging.before, answer, at))
            .and_then(|()| self.bring_to(robot, answer, at));
        let here = match brought {
            Ok(here) => here,
            Err(StepError::Error(reason)) => {
                self.refuse(prompt, &reason);
                return Ok(None);
            }
            Err(other) => return Err(other),
        };
        let met = self.goals_met(robot, &here, &jogging.goals);
        if let Err(reason) = met.and_then(|()| self.end_manual(robot, &here, jogging.arrivals)) {
            self.refuse(prompt, &reason);
            return Ok(None);
        }
        self.journal.answered(prompt, answer, by)?;
        jogging.open = None;
        self.jog_done(robot, &here).map(Some)
    }

    /// Anyone who says it is done without having moved the arm leaves the driving to the simulated operator, who has the pendant in the hand
    /// where there is one to be had.
    fn simulate_unless_moved(
        &mut self,
        robot: &str,
        simulated: Option<&SimulatedAct>,
        before: &JointVector,
        answer: &Answer,
        at: &StepContext,
    ) -> Result<(), StepError> {
        if simulated.is_none() || *answer != Answer::Done || self.read_pose_anywhere(robot)?.joints != *before
        {
            return Ok(());
        }
        let mut pendant = Pendant::for_robot(&self.arm(robot)?.description.capabilities);
        if matches!(pendant, Pendant::Shared) {
            self.jog(robot, true)?;
        }
        let done = self.simulate(simulated, at);
        self.take_back(robot, &mut pendant)?;
        done.map(drop)
    }

    /// Shows whether the sensor has fired where the arm is now. One that cannot be read is not asked again: the step that needs it will say why.
    fn look_while_jogging(&mut self, jogging: &mut Jogging<'_>) -> Result<(), StepError> {
        let Some(sensor) = jogging.sensor.clone() else { return Ok(()) };
        let looked = self
            .read_pose_anywhere(jogging.robot)
            .and_then(|state| self.read_sensor(&sensor, state.time_ns, state.time_ns));
        match looked {
            Ok(Reading { fired: Some(on), time_ns, .. }) => {
                self.journal.show(Event::Signal { device: sensor, signal: "fired".to_owned(), on, time_ns });
            }
            Err(error @ (StepError::Record(_) | StepError::Interrupted { .. })) => return Err(error),
            Ok(_) | Err(_) => jogging.sensor = None,
        }
        Ok(())
    }

    /// Shows what the instrument of a simulated cell shows where the arm is now. No world, no simulated instrument.
    fn read_while_jogging(&mut self, jogging: &mut Jogging<'_>) {
        let Some(act) = &jogging.instrument else { return };
        let is_ruler = act.name == RULER;
        let value = match self.links.simulate(act) {
            Ok(Some(value)) => Some(value),
            // A level refuses to be read where its bubble is at an end. A ruler can be read anywhere, or not at all.
            Err(_) if !is_ruler => None,
            Ok(None) | Err(_) => return jogging.instrument = None,
        };
        let unit = if is_ruler { "mm" } else { "deg" };
        let step = jogging.at.path.clone();
        self.journal.show(Event::InstrumentRead { step, value, unit: unit.to_owned() });
    }

    /// Moves one joint by one step.
    fn jog_joint(
        &mut self,
        jogging: &Jogging<'_>,
        prompt: &Prompt,
        joint: &str,
        by: f64,
    ) -> Result<Jogged, StepError> {
        let robot = jogging.robot;
        let here = self.read_pose_anywhere(robot)?.joints;
        let arm = self.arm(robot)?;
        let target = match arm.jog_target(&here, joint, by) {
            Ok(target) => target,
            Err(reason) => {
                self.refuse(prompt, &reason);
                return Ok(Jogged::Over);
            }
        };
        if let Err(reason) = arm.check_move(&here, &target) {
            self.refuse(prompt, &reason.to_string());
            return Ok(Jogged::Over);
        }
        match arm.believed_trespass(&here, &target).filter(|_| !jogging.may_pass_planes) {
            Some(trespass) => Ok(Jogged::Trespass(trespass)),
            None => {
                self.move_arm(robot, &here, &target, JOG_SPEED, jogging.at)?;
                // Where it is now is known to the record even if this program is killed before the prompt is answered.
                self.note_poses()?;
                Ok(Jogged::Over)
            }
        }
    }

    /// Jogs that came during a jog are dropped without a word: a key is held down. An answer is refused.
    fn drop_what_came_meanwhile(&mut self, prompt: &Prompt) -> Result<(), StepError> {
        if self.inbox.drop_what_came_during_a_jog(prompt.id).map_err(interrupted)? {
            self.refuse(prompt, STILL_MOVING);
        }
        if let Some(offer) = self.journal.record.offer_to(prompt.id.0)? {
            self.offered = Some((prompt.id, offer.id));
            self.refuse(prompt, STILL_MOVING);
        }
        Ok(())
    }

    /// Asks whether to go on although the arm seems to pass a keep-out plane. While the zeros are in question that may be an error of the zeros.
    fn warn_of_trespass(&mut self, jogging: &Jogging<'_>, trespass: &Trespass) -> Result<bool, StepError> {
        // A path of its own: what was answered to a warning is never taken for an answer to the step.
        let path = StepPath(format!("{}.keep_out", jogging.at.path));
        let option = |key: &str, label: &str| ChoiceOption { key: key.to_owned(), label: label.to_owned() };
        let question = Asked {
            step: &path,
            title: "Is the way free?",
            text: format!(
                "{} Nothing has moved. Look at {}: go on only if you see that the way is free.",
                believed_trespass_in_words(trespass),
                jogging.robot
            ),
            help: Some(
                "Jogging goes on without asking again until this prompt is answered. The height is shown under the joints.".to_owned(),
            ),
            kind: PromptKind::Choice {
                options: vec![
                    option("stay", "Stay where it is"),
                    option("go_on", "I see that the way is free: let me jog on"),
                ],
                default: Some("stay".to_owned()),
            },
            simulated: false,
        };
        let prompt = self.journal.ask(question)?;
        loop {
            match self.receive(&prompt, jogging.at)? {
                Received::Answer(answer, by) => {
                    self.journal.answered(&prompt, &answer, &by)?;
                    return Ok(answer == Answer::Choice { key: "go_on".to_owned() });
                }
                Received::Jog { .. } | Received::HandOver => {
                    self.refuse(&prompt, "choose first: nothing moves until then")
                }
                Received::Silence => {}
            }
        }
    }

    /// Nobody is there to see whether the way is free.
    fn refuse_unattended_trespass(&mut self, robot: &str, answer: &Answer) -> Result<(), StepError> {
        let here = self.read_pose_anywhere(robot)?.joints;
        let arm = self.arm(robot)?;
        let target = arm.pose_of_answer(&here, answer).map_err(StepError::Error)?;
        let Some(target) = target else { return Ok(()) };
        match arm.believed_trespass(&here, &target) {
            None => Ok(()),
            Some(trespass) => Err(StepError::NeedsOperator(format!(
                "{} Nothing has moved. Somebody has to look whether the way is free: run it without --headless, or give another pose in the answers",
                believed_trespass_in_words(&trespass)
            ))),
        }
    }

    /// For an answer that names a pose, the arm goes there; else it is where it is.
    fn bring_to(&mut self, robot: &str, answer: &Answer, at: &StepContext) -> Result<JointVector, StepError> {
        let here = self.read_pose_anywhere(robot)?.joints;
        self.moved.insert(robot.to_owned(), here);
        let arm = self.arm(robot)?;
        let target = arm.pose_of_answer(&here, answer).map_err(StepError::Error)?;
        let Some(target) = target else { return Ok(here) };
        arm.check_move(&here, &target).map_err(|reason| StepError::error(reason.to_string()))?;
        self.move_arm(robot, &here, &target, JOG_SPEED, at)
    }

    fn goals_met(&mut self, robot: &str, here: &JointVector, goals: &[JogGoal]) -> Result<(), String> {
        let joints = self.arm(robot).map(|arm| arm.named(here)).unwrap_or_default();
        for goal in goals {
            let position =
                joints.iter().find(|joint| joint.name == goal.joint).map_or(f64::NAN, |joint| joint.value);
            if !(goal.minimum..=goal.maximum).contains(&position) {
                return Err(format!(
                    "{} is at {position:.2} {unit}; it has to be between {:.2} and {:.2} {unit}",
                    goal.joint,
                    goal.minimum,
                    goal.maximum,
                    unit = goal.unit
                ));
            }
        }
        Ok(())
    }

    /// The operator is done: from now on only this program moves the robot, and it is known from which side the joints of `arrivals` have come.
    fn end_manual(&mut self, robot: &str, here: &JointVector, arrivals: &[Arrival]) -> Result<(), String> {
        let Ok(arm) = self.arm(robot) else { return Ok(()) };
        let mut joints = Vec::new();
        for arrival in arrivals {
            joints.push((arm.joint(&arrival.joint)?, arrival.from.side()));
        }
        arm.end_manual(here, &joints).map_err(|joint| {
            let joint = arm.joint_name(joint).to_owned();
            let arrival = arrivals.iter().find(|arrival| arrival.joint == joint);
            let from = arrival.map_or("the side asked for", |arrival| arrival.from.in_words());
            format!(
                "{joint} has not come from {from}, as it has to (play would falsify the reading): drive it back some degrees, and come again from there"
            )
        })
    }

    fn jog_done(&mut self, robot: &str, here: &JointVector) -> Result<Done, StepError> {
        let joints = self.arm(robot)?.named(here);
        let positions = joints
            .iter()
            .map(|joint| format!("{} {} {}", joint.name, with_decimals(joint.value, 2), joint.unit));
        let message = format!("at {}", positions.collect::<Vec<_>>().join(", "));
        let result: Value = json!({"joints": joints_value(&joints)});
        Ok(Done { result, values: joints, message })
    }
}
