//! A joint that is driven by hand has to come from the side that is asked for.

use plumb_cell::command::Command;
use plumb_cell::event::{Event, RunOutcome};
use plumb_cell::prompt::{Answer, PromptId, PromptKind};

use super::run_attended;
use crate::support::running::Patient;

const STEPS: &str = "
steps:
  - {id: place, do: {prompt: {text: There, jog_to: {robot: arm, from: {waist: above}}}}}
";

fn jog(prompt: PromptId, by: f64) -> Command {
    Command::Jog { prompt, joint: "waist".to_owned(), by }
}

fn done(prompt: PromptId) -> Command {
    Command::Answer { prompt, answer: Answer::Done, by: "ada".to_owned() }
}

#[test]
fn a_bubble_that_was_come_to_from_the_wrong_side_is_not_taken() {
    let mut refused = Vec::new();
    let mut operator = Patient::default();
    let (outcome, _, _, _) = run_attended(STEPS, |event, handle| {
        operator.take(event, handle);
        match event {
            Event::PromptAsked { prompt } if matches!(prompt.kind, PromptKind::JogTo { .. }) => {
                operator.send([jog(prompt.id, 2.0), done(prompt.id)], handle);
            }
            Event::AnswerRefused { prompt, reason } => {
                refused.push(reason.clone());
                // Past it, and back from there.
                operator.send([jog(*prompt, 3.0), jog(*prompt, -3.0), done(*prompt)], handle);
            }
            _ => {}
        }
    });
    assert_eq!(outcome, RunOutcome::Passed, "{refused:?}");
    assert_eq!(refused.len(), 1, "{refused:?}");
    assert!(refused[0].starts_with("waist has not come from above, as it has to"), "{refused:?}");
}

#[test]
fn anyone_who_has_not_moved_a_joint_has_not_brought_it_from_anywhere() {
    let mut refused = 0;
    let mut operator = Patient::default();
    let (outcome, _, _, _) = run_attended(STEPS, |event, handle| {
        operator.take(event, handle);
        match event {
            Event::PromptAsked { prompt } if matches!(prompt.kind, PromptKind::JogTo { .. }) => {
                operator.send([done(prompt.id)], handle);
            }
            Event::AnswerRefused { prompt, .. } => {
                refused += 1;
                operator.send([jog(*prompt, -1.0), done(*prompt)], handle);
            }
            _ => {}
        }
    });
    assert_eq!((outcome, refused), (RunOutcome::Passed, 1));
}
