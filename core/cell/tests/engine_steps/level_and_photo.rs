//! A spirit level read along two axes, and a picture that was taken.

use plumb_cell::command::Command;
use plumb_cell::event::{Event, RunOutcome};
use plumb_cell::prompt::{Answer, PromptKind};
use tempfile::TempDir;

use super::run_attended;
use super::support::running::message_of;

const STEPS: &str = "
steps:
  - {id: lie, do: {prompt: {text: Lay the level on the hand., level: {most_deg: 5}}}}
  - {id: seen, do: {prompt: {text: Take a picture of it., photo: {}}}}
  - {id: flat, do: {check: {that: 'lie.tilt_deg < 0.6 && lie.tilt_deg > lie.x_deg && seen.format == \"png\"', otherwise: no}}}
";

#[test]
fn a_level_beyond_its_range_and_a_file_that_is_no_picture_are_refused_with_what_would_be_right() {
    let folder = TempDir::new().expect("a folder");
    let (picture, words) = (folder.path().join("hand.png"), folder.path().join("hand.txt"));
    std::fs::write(&picture, b"\x89PNG\r\n\x1a\n and the rest").expect("written");
    std::fs::write(&words, "no picture").expect("written");
    let photo = |path: &std::path::Path| Answer::Photo { file: path.display().to_string() };
    let (outcome, events, _, _) = run_attended(STEPS, |event, handle| {
        let Event::PromptAsked { prompt } = event else { return };
        let answers = match &prompt.kind {
            PromptKind::Level { most } => {
                [Answer::Level { x: 0.3, y: 2.0 * most }, Answer::Level { x: 0.3, y: -0.5 }]
            }
            _ => [photo(&words), photo(&picture)],
        };
        for answer in answers {
            handle.send(Command::Answer { prompt: prompt.id, answer, by: "ada".to_owned() });
        }
    });
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    let refused: Vec<&str> = events
        .iter()
        .filter_map(|event| match event {
            Event::AnswerRefused { reason, .. } => Some(reason.as_str()),
            _ => None,
        })
        .collect();
    let [level, picture] = refused.as_slice() else { panic!("two are refused: {refused:?}") };
    assert!(level.contains("y = 10 deg is out of range: this level shows 5 deg at most"), "{level}");
    assert!(picture.contains("hand.txt: is neither PNG nor JPEG"), "{picture}");
}
