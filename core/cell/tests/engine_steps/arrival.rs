//! A joint that is driven by hand has to come from the side that is asked for.

use plumb_cell::command::Command;
use plumb_cell::event::{Event, RunOutcome};
use plumb_cell::prompt::{Answer, PromptKind};

use super::run_attended;

const STEPS: &str = "
steps:
  - {id: place, do: {prompt: {text: There, jog_to: {robot: arm, from: {waist: above}}}}}
";

#[test]
fn a_bubble_that_was_come_to_from_the_wrong_side_is_not_taken() {
    let mut refused = Vec::new();
    let (outcome, _, _, _) = run_attended(STEPS, |event, handle| {
        let jog = |prompt, by| handle.send(Command::Jog { prompt, joint: "waist".to_owned(), by });
        let done =
            |prompt| handle.send(Command::Answer { prompt, answer: Answer::Done, by: "ada".to_owned() });
        match event {
            Event::PromptAsked { prompt } if matches!(prompt.kind, PromptKind::JogTo { .. }) => {
                jog(prompt.id, 2.0);
                done(prompt.id);
            }
            Event::AnswerRefused { prompt, reason } => {
                refused.push(reason.clone());
                // Past it, and back from there.
                jog(*prompt, 3.0);
                jog(*prompt, -3.0);
                done(*prompt);
            }
            _ => {}
        }
    });
    assert_eq!(outcome, RunOutcome::Passed, "{refused:?}");
    assert_eq!(refused.len(), 1, "{refused:?}");
    assert!(refused[0].starts_with("waist has not come from above, as it has to"), "{refused:?}");
}

#[test]
fn whoever_has_not_moved_a_joint_has_not_brought_it_from_anywhere() {
    let mut refused = 0;
    let (outcome, _, _, _) = run_attended(STEPS, |event, handle| {
        let done =
            |prompt| handle.send(Command::Answer { prompt, answer: Answer::Done, by: "ada".to_owned() });
        match event {
            Event::PromptAsked { prompt } if matches!(prompt.kind, PromptKind::JogTo { .. }) => {
                done(prompt.id);
            }
            Event::AnswerRefused { prompt, .. } => {
                refused += 1;
                handle.send(Command::Jog { prompt: *prompt, joint: "waist".to_owned(), by: -1.0 });
                done(*prompt);
            }
            _ => {}
        }
    });
    assert_eq!((outcome, refused), (RunOutcome::Passed, 1));
}
