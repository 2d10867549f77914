//! Prompts in a simulated cell: what people do with their hands there, the world does when they say it is done.

use plumb_cell::RunHandle;
use plumb_cell::command::Command;
use plumb_cell::event::{Event, RunOutcome};
use plumb_cell::prompt::{Answer, Decision, PromptKind};

use super::run_attended;
use super::support::running::{Patient, message_of, operator};

const STEPS: &str = "
parameters: {h_mm: 8}
steps:
  - {id: level, do: {prompt: {text: How far?, number: {unit: deg}, simulated: {read_level: {at: hand, turned: true}}}}}
  - {id: gauge, do: {prompt: {text: Lay the block., simulated: {rest_on_gauge: {height_mm: h_mm + 1}}}}}
  - {id: over, do: {prompt: {text: Drive there., jog_to: {robot: arm}, simulated: {place_hand: {}}}}}
";

fn jogs_first() -> impl FnMut(&Event, &RunHandle) {
    let mut patient = Patient::default();
    move |event, handle| {
        patient.take(event, handle);
        if let Event::PromptAsked { prompt } = event
            && let PromptKind::JogTo { .. } = &prompt.kind
        {
            let jog = Command::Jog { prompt: prompt.id, joint: "waist".to_owned(), by: 1.0 };
            let done = Command::Answer { prompt: prompt.id, answer: Answer::Done, by: "ada".to_owned() };
            patient.send([jog, done], handle);
            return;
        }
        operator(Decision::Abort)(event, handle);
    }
}

#[test]
fn a_simulated_operator_does_what_is_said_to_be_done_and_instruments_offer_what_they_read() {
    let mut offered = None;
    let mut answers = operator(Decision::Abort);
    let (outcome, events, _, world) = run_attended(STEPS, |event, handle| {
        if let Event::PromptAsked { prompt } = event
            && let PromptKind::Number { default, .. } = &prompt.kind
        {
            offered = *default;
        }
        answers(event, handle);
    });
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    assert_eq!(offered, Some(0.25));
    let acts = world.acts.lock().expect("no test panicked").clone();
    let names: Vec<&str> = acts.iter().map(|act| act.name.as_str()).collect();
    assert_eq!(names, ["read_level", "rest_on_gauge", "read_ruler", "place_hand"]);
    assert_eq!(acts[1].numbers, [("height_mm".to_owned(), 9.0)]);
    assert_eq!(
        acts[0].words,
        [("at".to_owned(), "hand".to_owned()), ("turned".to_owned(), "true".to_owned())]
    );
}

#[test]
fn whoever_drives_the_arm_there_is_not_driven_elsewhere() {
    let (outcome, events, _, world) = run_attended(STEPS, jogs_first());
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    let acts = world.acts.lock().expect("no test panicked").clone();
    assert!(acts.iter().all(|act| act.name != "place_hand"), "{acts:?}");
}

#[test]
fn an_act_the_world_does_not_know_fails_the_step_with_its_reason() {
    let steps = "
steps:
  - {id: odd, do: {prompt: {text: Dance., simulated: {dance: {}}}}}
";
    let (outcome, events, _, _) = run_attended(steps, operator(Decision::Abort));
    assert_eq!(outcome, RunOutcome::Error);
    assert!(message_of(&events).contains("does not know `dance`"), "{}", message_of(&events));
}

#[test]
fn whoever_jogs_a_simulated_arm_to_a_level_is_shown_what_it_reads_after_each_jog() {
    let steps = "
steps:
  - {id: over, do: {prompt: {text: To the bubble., jog_to: {robot: arm}, simulated: {drive_to_level: {joint: waist, at: hand, turned: true}}}}}
";
    let (outcome, events, _, world) = run_attended(steps, jogs_first());
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    let read: Vec<Option<f64>> = events
        .iter()
        .filter_map(|event| match event {
            Event::InstrumentRead { step, value, unit } if step.0 == "over" && unit == "deg" => Some(*value),
            _ => None,
        })
        .collect();
    assert_eq!(read, [Some(0.25), Some(0.25)], "when it is asked, and after the jog");
    let acts = world.acts.lock().expect("no test panicked").clone();
    let words = [("at".to_owned(), "hand".to_owned()), ("turned".to_owned(), "true".to_owned())];
    assert!(acts.iter().all(|act| act.name == "read_level" && act.words == words), "{acts:?}");
}
