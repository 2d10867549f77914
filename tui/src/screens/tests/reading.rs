//! Prompts that have not room enough: nothing of them is lost without a word, and what was found before makes room.

use plumb_cell::event::Event;
use plumb_cell::prompt::PromptKind;
use ratatui::crossterm::event::KeyCode;

use super::browsing::click;
use super::fixtures::{asked, begun, decision_asked, deliver, examined, jog_asked, page, path, press, value};
use crate::screens::message::Message;
use crate::screens::model::LabAnswer;
use crate::screens::update::update;

#[test]
fn a_text_that_is_cut_says_so_and_is_read_on() {
    let mut state = begun();
    deliver(&mut state, jog_asked());
    let whole = page(&state, 80, 24);
    assert!(whole.contains("the sheet.") && !whole.contains("PgDn"), "{whole}");
    let cut = page(&state, 80, 20);
    assert!(cut.contains("PgDn reads on") && !cut.contains("the sheet."), "{cut}");
    for _ in 0..4 {
        press(&mut state, KeyCode::PageDown);
        page(&state, 80, 20);
    }
    let end = page(&state, 80, 20);
    assert!(end.contains("the sheet.") && end.contains("PgUp goes back"), "{end}");
    for _ in 0..4 {
        press(&mut state, KeyCode::PageUp);
        page(&state, 80, 20);
    }
    assert!(page(&state, 80, 20).contains("Jog until the forearm"));
    // Where nothing is cut the key chooses, as elsewhere.
    page(&state, 80, 24);
    press(&mut state, KeyCode::PageDown);
    assert!(page(&state, 80, 24).contains("\u{25b8} gripper"), "{}", page(&state, 80, 24));
}

#[test]
fn labels_longer_than_a_line_are_shown_whole_and_each_of_their_lines_can_be_clicked() {
    let mut state = begun();
    deliver(&mut state, decision_asked());
    let shown = page(&state, 80, 24);
    assert!(!shown.contains("do the step ag\u{2026}"), "{shown}");
    assert!(shown.contains("m  Move arm yourself, then do the step "), "{shown}");
    // The line below it belongs to the same choice.
    click(&mut state, "     again ", (80, 24));
    assert!(page(&state, 80, 24).contains("\u{25b8} m  Move arm"), "{}", page(&state, 80, 24));
    click(&mut state, "Go back to", (80, 24));
    assert!(page(&state, 80, 24).contains("\u{25b8} b  Go back to"), "{}", page(&state, 80, 24));
}

#[test]
fn what_was_found_before_makes_room_for_a_prompt() {
    let mut state = begun();
    for turn in 1..=3 {
        let event = Event::TriggerFound {
            step: path(&format!("cycle[{turn}].lower")),
            device: "arm".to_owned(),
            joints: vec![value("shoulder", 36.5, "deg")],
            half_width: value("shoulder", 0.01, "deg"),
        };
        deliver(&mut state, event);
    }
    assert!(page(&state, 80, 24).contains("Trigger poses"));
    deliver(&mut state, jog_asked());
    let shown = page(&state, 80, 24);
    assert!(shown.contains("Jog until the forearm") && shown.contains("the arm is in position"), "{shown}");
}

#[test]
fn the_keys_that_stop_the_lab_and_take_it_up_again_are_in_the_footer_of_a_small_terminal() {
    let mut state = examined();
    let mut summary = state.model.as_ref().and_then(|model| model.summary.clone()).expect("examined");
    summary.verdict.clear();
    update(&mut state, Message::Lab(LabAnswer::Compared(Box::new(summary))));
    assert!(page(&state, 80, 24).contains("c cancel"), "{}", page(&state, 80, 24));
    press(&mut state, KeyCode::Char('c'));
    update(&mut state, Message::Lab(LabAnswer::GaveUp { judging: true }));
    assert!(page(&state, 80, 24).contains("j judge"), "{}", page(&state, 80, 24));
}

#[test]
fn the_key_that_swaps_views_is_offered_where_they_can_be_swapped_alone() {
    let mut state = begun();
    deliver(&mut state, jog_asked());
    assert!(page(&state, 80, 24).contains("v views"), "{}", page(&state, 80, 24));
    let large = page(&state, 120, 44);
    assert!(large.contains("Steps") && large.contains("Arm from above"), "{large}");
    assert!(!large.contains("v views"), "{large}");
}

#[test]
fn what_is_agreed_to_is_read_whole() {
    let mut state = begun();
    let label = "The arm is raised and clear, and a hand lies on STOP of the pendant";
    let kind = PromptKind::Acknowledge { label: label.to_owned() };
    deliver(&mut state, asked("grid", "Raise the arm", "Raise the arm.", kind));
    let shown = page(&state, 80, 24);
    assert!(shown.contains("Enter  The arm is raised") && shown.contains("the pendant"), "{shown}");
    assert_eq!(click(&mut state, "the pendant", (80, 24)).len(), 1, "each of its lines is the button");
}

#[test]
fn nothing_of_a_jog_is_cut_in_a_narrow_terminal() {
    let mut state = begun();
    deliver(&mut state, jog_asked());
    let Some(prompt) = state.run.as_ref().and_then(|run| run.prompt.as_ref()) else { panic!("a prompt") };
    let step = prompt.prompt.step.clone();
    deliver(&mut state, Event::InstrumentRead { step, value: Some(28.7), unit: "mm".to_owned() });
    for width in [72, 64, 56] {
        let page = page(&state, width, 40);
        for words in ["50: 28.7 mm high", " joint ", "the arm is in position"] {
            assert!(page.contains(words), "{words} at {width}: {page}");
        }
    }
}

#[test]
fn long_names_of_joints_keep_their_columns_in_a_resume_and_no_joint_is_at_minus_zero() {
    let mut state = begun();
    let at = |name: &str, by: f64| value(name, by, "deg");
    let recorded = vec![at("shoulder_pan", -179.25), at("shoulder_lift", -0.0001), at("gripper", 12.5)];
    let reported = vec![at("shoulder_pan", -179.25), at("shoulder_lift", 100.5), at("gripper", -0.0002)];
    let confirmed = PromptKind::ConfirmPose { device: "arm".to_owned(), recorded, reported };
    deliver(&mut state, asked("resume", "Is the arm where the run stopped?", "Look at it.", confirmed));
    let shown = page(&state, 80, 24);
    let ends = |name: &str| {
        let line = shown.lines().find(|line| line.contains(name) && line.contains("deg"));
        let line = line.unwrap_or_else(|| panic!("{name}: {shown}"));
        line.split("deg").next().map(|before| before.chars().count())
    };
    let rows = ["shoulder_pan  ", "shoulder_lift  ", "gripper     "].map(ends);
    assert!(rows.iter().all(|end| *end == rows[0]), "{rows:?}: {shown}");
    assert!(!shown.contains("-0.000"), "{shown}");
}
