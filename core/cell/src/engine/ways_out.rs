//! Ways out of a step that failed, besides trying it again as things are, leaving it out and ending the run: the arm is moved by hand, an answer is given
//! again, or the run goes back to the step that placed the arm.

use plumb_document::Span;
use plumb_record::{RecordError, StoredCorrection};

use super::Engine;
use super::applied::{in_words, is_kept};
use super::journal::{Attempt, AttemptEnd, Question};
use super::plan::{Entry, Work};
use super::step_context::StepContext;
use super::step_error::StepError;
use crate::event::{Event, LogLevel, StepOutcome, StepPath};
use crate::in_words::sentence_case;
use crate::prompt::{Decision, PromptKind};
use crate::step::{PromptQuestion, Searched, StepQuestion};

/// What a person can do about a step that failed.
pub(crate) struct WaysOut {
    /// The entry of the plan from which a check is done again: the first step that found what it judges. None where the step alone is done again.
    pub(crate) again_from: Option<usize>,
    /// The entry of the plan to go back to.
    pub(crate) back_to: Option<usize>,
    /// What going back there takes back.
    undone: Vec<StoredCorrection>,
    /// The robot to be moved by hand.
    robot: Option<String>,
    /// The joint the step moves.
    joint: Option<String>,
    /// The sensor it watches.
    sensor: Option<String>,
}

impl Engine {
    /// What a person can do about this step. With a device lost nothing can be moved: the step is tried again first, which starts the device.
    pub(crate) fn ways_out(&self, entry: &Entry) -> Result<WaysOut, RecordError> {
        let again_from = self.first_that_found(entry);
        let before = again_from.unwrap_or(entry.index);
        let asked = |requested: fn(&PromptQuestion) -> bool| {
            let is_requested = |earlier: &&Entry| matches!(earlier.step.action.question(), Some(StepQuestion::Prompt(question)) if requested(question));
            self.before(entry, before).find(is_requested).map(|earlier| earlier.index)
        };
        let placed = asked(|question| matches!(question, PromptQuestion::JogTo { .. }));
        let back_to = placed.or_else(|| asked(|_| true));
        let searched = entry.step.action.searched();
        let robot = entry.step.action.moved_robots().into_iter().next();
        let robot = robot.or_else(|| self.placed_robot(placed)).or_else(|| match self.arms.as_slice() {
            [arm] => Some(arm.name.clone()),
            _ => None,
        });
        let is_there = |name: &String| self.arms.iter().any(|arm| arm.name == *name);
        let undone = match back_to {
            Some(first) => self.applied_between(first, entry.index)?,
            None => Vec::new(),
        };
        Ok(WaysOut {
            again_from,
            back_to,
            undone,
            robot: robot.filter(|robot| self.lost.is_empty() && is_there(robot)),
            joint: searched.map(|Searched { joint, .. }| joint.to_owned()),
            sensor: searched.map(|Searched { sensor, .. }| sensor.to_owned()),
        })
    }

    /// The steps before the entry `before` that were carried out and that `entry` sees: those of its own procedure and turn, and of what they are
    /// in. The nearest first.
    fn before<'a>(&'a self, entry: &'a Entry, before: usize) -> impl Iterator<Item = &'a Entry> {
        let earlier = self.plan.entries.get(..before).unwrap_or_default().iter().rev();
        let is_seen = |earlier: &&Entry| {
            let (outside, _) = earlier.path.0.rsplit_once('.').unwrap_or_default();
            matches!(earlier.work, Work::Leaf) && (outside.is_empty() || is_inside(&entry.path.0, outside))
        };
        earlier.filter(is_seen).filter(|earlier| self.with_results.contains(&earlier.index))
    }

    /// The first step that found what a step judges, directly or by way of what is worked out from it.
    fn first_that_found(&self, entry: &Entry) -> Option<usize> {
        let mut judged = entry.step.action.judged();
        let mut first = None;
        for earlier in self.before(entry, entry.index).filter(|earlier| earlier.scope == entry.scope) {
            if judged.iter().any(|expression| names(expression, &earlier.step.id)) {
                first = Some(earlier.index);
                judged.extend(earlier.step.action.judged());
            }
        }
        first
    }

    /// The robot that a prompt asked to place.
    fn placed_robot(&self, prompt: Option<usize>) -> Option<String> {
        match self.plan.entries.get(prompt?)?.step.action.question()? {
            StepQuestion::Prompt(PromptQuestion::JogTo { robot, .. }) => Some(robot.clone()),
            _ => None,
        }
    }

    /// What is offered, and in the same order what each does.
    pub(crate) fn offered_decisions(&self, ways_out: &WaysOut) -> (Vec<Decision>, Vec<String>) {
        let title = |index: usize| self.plan.entries.get(index).map(|entry| entry.step.title.as_str());
        let asks = |index: &usize| {
            self.plan.entries.get(*index).is_some_and(|entry| entry.step.action.question().is_some())
        };
        let again = match ways_out.again_from {
            Some(index) if asks(&index) => {
                format!("answer \u{201c}{}\u{201d} again", title(index).unwrap_or_default())
            }
            Some(index) => format!("begin again at \u{201c}{}\u{201d}", title(index).unwrap_or_default()),
            None => "do the step again".to_owned(),
        };
        let mut offered = vec![(Decision::Retry, sentence_case(&again))];
        if let Some(robot) = &ways_out.robot {
            offered.push((Decision::Move, format!("Move {robot} yourself, then {again}")));
        }
        if let Some(title) = ways_out.back_to.and_then(title) {
            offered.push((Decision::Back, format!("Go back to \u{201c}{title}\u{201d}")));
        }
        offered.push((Decision::Skip, "Go on without it".to_owned()));
        offered.push((Decision::Abort, "Abort the run".to_owned()));
        offered.into_iter().unzip()
    }

    /// Lets the operator move the robot. The failed step no longer returns to where it began: it begins where the robot is then.
    pub(crate) fn move_by_hand(&mut self, ways_out: &WaysOut, at: &StepContext) -> Result<(), StepError> {
        let Some(robot) = ways_out.robot.clone() else {
            return Err(StepError::error("no robot can be moved here"));
        };
        self.journal.record.note_intent(at.attempt.row, &serde_json::Value::Null)?;
        // A path of its own: what is answered here is never taken for an answer to the step.
        let path = StepPath(format!("{}.by_hand", at.path));
        let at = StepContext { path: path.clone(), limit: None, ..at.clone() };
        let declared =
            PromptQuestion::JogTo { robot, span: Span::NONE, goals: Vec::new(), arrivals: Vec::new() };
        let mut kind = self.prompt_kind(&declared, &at)?;
        if let PromptKind::JogTo { joint, sensor, .. } = &mut kind {
            joint.clone_from(&ways_out.joint);
            sensor.clone_from(&ways_out.sensor);
        }
        let question = Question {
            step: &path,
            title: "Move the arm",
            text: format!("Move the arm to where \u{201c}{}\u{201d} can be done, then confirm.", at.title),
            help: None,
            kind,
            simulated: false,
        };
        self.jog_to(&declared, None, question, &at)?;
        Ok(self.note_poses()?)
    }

    /// Makes `to` the next entry of the plan: it and all that was done since are to be done again, in this sitting and in any that resumes the run.
    /// `open` are the repetitions and calls that are under way; those that do not hold `to` end.
    pub(crate) fn go_back(
        &mut self,
        from: &Entry,
        to: usize,
        open: &mut Vec<(usize, Attempt)>,
    ) -> Result<(), RecordError> {
        let Some(target) = self.plan.entries.get(to).map(|entry| entry.path.clone()) else { return Ok(()) };
        let why = format!("to be done again: the operator went back to `{target}`");
        while let Some((index, attempt)) = open.pop_if(|(index, _)| *index > to) {
            let Some(path) = self.plan.entries.get(index).map(|entry| entry.path.clone()) else { continue };
            let end = AttemptEnd {
                outcome: StepOutcome::Interrupted,
                message: &why,
                result: &serde_json::Value::Null,
                values: Vec::new(),
            };
            self.journal.end(&path, attempt, end)?;
        }
        for index in to..=from.index {
            let Some(entry) = self.plan.entries.get(index).filter(|entry| entry.is_shown()) else { continue };
            let path = entry.path.clone();
            self.journal.take_back(&path, &why)?;
        }
        for index in self.with_results.split_off(&to).into_iter().rev() {
            let Some(entry) = self.plan.entries.get(index) else { continue };
            if let Some(scope) = self.plan.scopes.get_mut(entry.scope) {
                scope.take_back_result(&entry.step.id);
            }
        }
        self.failed_check.take_if(|(index, _)| *index >= to);
        self.paused_scan = None;
        let message = format!("the operator goes back from `{}` to `{target}`", from.path);
        self.journal.log(LogLevel::Info, "engine", Some(&from.path), &message)?;
        let applied = self.applied_between(to, from.index)?;
        self.journal.show(Event::WentBack { from: from.path.clone(), to: target.clone() });
        self.undo(&applied, &format!("the operator went back to `{target}`"), &from.path)?;
        Ok(())
    }
}

impl WaysOut {
    /// What happens to corrections where the operator goes back past them, to be read before that is decided.
    pub(crate) fn what_going_back_undoes(&self) -> Option<String> {
        let listed = |kept: bool| {
            let names: Vec<String> =
                self.undone.iter().filter(|one| is_kept(one) == kept).map(in_words).collect();
            names.join(", ")
        };
        let (undone, kept) = (listed(false), listed(true));
        let mut sentences = Vec::new();
        if !undone.is_empty() {
            sentences.push(format!("Going back undoes the correction of {undone}."));
        }
        if !kept.is_empty() {
            sentences.push(format!("Going back does not undo what the controller has taken over: {kept}."));
        }
        (!sentences.is_empty()).then(|| sentences.join(" "))
    }
}

/// Whether the step of this path is inside the step or turn `outside`.
fn is_inside(path: &str, outside: &str) -> bool {
    path.strip_prefix(outside).is_some_and(|rest| rest.starts_with('.'))
}

/// Whether an expression uses the result of the step with this id: `id.` as a word, or `all.id`.
fn names(expression: &str, id: &str) -> bool {
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
    expression.match_indices(id).any(|(at, _)| {
        let (before, rest) = expression.split_at(at);
        let after = rest.strip_prefix(id).unwrap_or_default();
        let is_word = !before.ends_with(is_part) && !after.starts_with(is_part);
        // `.id` is a part of something else, but for the list of its results.
        is_word && (!before.ends_with('.') || before.ends_with("all."))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_expression_names_a_step_by_the_whole_word_and_its_list() {
        assert!(names("abs(level.value) <= 1", "level"));
        assert!(names("all.edge.len()", "edge"));
        assert!(!names("abs(level_x.value)", "level") && !names("spirit_level.value", "level"));
        assert!(!names("arm.model.elbow.a_mm", "elbow"));
    }

    #[test]
    fn a_step_is_inside_its_turn_and_its_call_only() {
        assert!(is_inside("call.cycle[2].edge", "call.cycle[2]") && is_inside("call.cycle[2].edge", "call"));
        assert!(!is_inside("call.cycle[2].edge", "call.cycle[1]") && !is_inside("caller.edge", "call"));
    }
}
