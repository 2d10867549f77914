//! Prompts in a simulated cell: what people do with their hands there, the world does when they say it is done.

use std::sync::Arc;

use plumb_cell::RunHandle;
use plumb_cell::command::Command;
use plumb_cell::event::{Event, RunOutcome};
use plumb_cell::prompt::{Answer, Decision, PromptId, PromptKind};
use plumb_cell::workcell::{Pace, WorldSetting};
use plumb_record::{Record, RunId};

use super::support::World;
use super::support::running::{
    Patient, ZERO_ERROR_DEG, cell_with_steps, message_of, operator, request, start, watch,
};
use super::{folder, run_attended};

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
fn anyone_who_drives_the_arm_there_is_not_driven_elsewhere() {
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
fn anyone_who_jogs_a_simulated_arm_to_a_level_is_shown_what_it_reads_after_each_jog() {
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

const READINGS: &str = "
steps:
  - {id: each, do: {repeat: {times: 3, steps: [
      {id: block, do: {prompt: {text: Lay the block., simulated: {rest_on_gauge: {height_mm: 9}}}}},
      {id: level, do: {prompt: {text: How far?, number: {unit: deg}, simulated: {read_level: {at: hand}}}}},
      {id: over, do: {prompt: {text: Drive there., jog_to: {robot: arm}, simulated: {place_hand: {}}}}},
    ]}}}
  - {id: paper, do: {prompt: {text: Which paper?, choice: {accept: light, dark: dark}}}}
  - {id: ruler, do: {prompt: {text: What do you read?, number: {unit: mm}}}}
";

/// Leaves a prompt and all like it to the world.
fn simulated(prompt: PromptId) -> Command {
    Command::Answer { prompt, answer: Answer::Simulated, by: "ada".to_owned() }
}

#[test]
fn what_is_left_to_the_simulated_world_once_is_not_asked_again_and_everything_else_is() {
    let folder = folder();
    let mut cell = cell_with_steps(&folder, READINGS);
    Arc::make_mut(&mut cell).world =
        Some(WorldSetting { file: folder.path().join("cell.yaml"), pace: Pace::Fast });
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let world = World::new(ZERO_ERROR_DEG);
    let mut answers = operator(Decision::Abort);
    let (mut left, mut asked) = (0, Vec::new());
    let (outcome, events) = watch(start(run, &world), |event, handle| {
        let Event::PromptAsked { prompt } = event else { return };
        if !prompt.simulated {
            asked.push(prompt.step.0.clone());
            return answers(event, handle);
        }
        if left == 0 {
            handle.send(simulated(prompt.id));
        }
        left += 1;
    });
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    assert_eq!((left, asked), (9, vec!["paper".to_owned(), "ruler".to_owned()]));
    let prompts = Record::open(folder.path()).unwrap().prompts(RunId(1)).unwrap();
    let by: Vec<String> =
        prompts.iter().filter_map(|prompt| Some(prompt.answer.as_ref()?.by.clone())).collect();
    assert!(by[..9].iter().all(|by| by == "simulated operator, for ada"), "{by:?}");
    assert_eq!(by[9..], ["ada", "ada"]);
    let read = prompts.iter().filter(|prompt| prompt.step.ends_with("level"));
    assert!(
        read.clone().count() == 3
            && read.clone().all(|one| one.answer.as_ref().unwrap().answer["value"] == 0.25)
    );
    // What hands do is done there each time.
    let acts = world.acts.lock().expect("no test panicked").clone();
    let done = |name: &str| acts.iter().filter(|act| act.name == name).count();
    assert_eq!(["rest_on_gauge", "read_level", "place_hand"].map(done), [3, 3, 3]);
}

#[test]
fn a_wish_that_was_refused_leaves_nothing_to_the_world() {
    let steps = "
steps:
  - {id: ruler, do: {prompt: {text: What do you read?, number: {unit: mm}}}}
  - {id: block, do: {prompt: {text: Lay the block., simulated: {rest_on_gauge: {height_mm: 9}}}}}
";
    let folder = folder();
    let mut cell = cell_with_steps(&folder, steps);
    Arc::make_mut(&mut cell).world =
        Some(WorldSetting { file: folder.path().join("cell.yaml"), pace: Pace::Fast });
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let (mut asked, mut answers) = (0, operator(Decision::Abort));
    let (outcome, _) = watch(start(run, &World::new(ZERO_ERROR_DEG)), |event, handle| {
        let Event::PromptAsked { prompt } = event else { return };
        if asked == 0 {
            handle.send(simulated(prompt.id));
        }
        asked += 1;
        answers(event, handle);
    });
    assert_eq!((outcome, asked), (RunOutcome::Passed, 2));
    let prompts = Record::open(folder.path()).unwrap().prompts(RunId(1)).unwrap();
    assert!(prompts.iter().all(|prompt| prompt.answer.as_ref().unwrap().by == "ada"));
}

#[test]
fn what_no_world_does_cannot_be_left_to_it() {
    let (mut refused, mut answers) = (None, operator(Decision::Abort));
    let steps = "
steps:
  - {id: ruler, do: {prompt: {text: What do you read?, number: {unit: mm}}}}
";
    let (outcome, _, _, _) = run_attended(steps, |event, handle| match event {
        Event::PromptAsked { prompt } => {
            handle.send(simulated(prompt.id));
            answers(event, handle);
        }
        Event::AnswerRefused { reason, .. } => refused = Some(reason.clone()),
        _ => {}
    });
    assert_eq!(outcome, RunOutcome::Passed);
    assert_eq!(refused.as_deref(), Some("nothing here is simulated: it needs an answer"));
}
