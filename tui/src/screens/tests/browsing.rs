//! What an operator does on the History screen, and with the mouse anywhere.

use plumb_cell::command::Command as RunCommand;
use plumb_cell::prompt::{Answer, PromptId};
use ratatui::crossterm::event::KeyCode;

use super::fixtures::{asked_to_confirm, begun, choice_asked, deliver, examined, page, press, recorded};
use crate::screens::history::{ArchiveAnswer, ArchiveRequest};
use crate::screens::message::{Action, Message};
use crate::screens::screen::Screen;
use crate::screens::state::{Overlay, State};
use crate::screens::update::update;

/// Clicks on the first position of the page where `text` is, drawn in a terminal of this size.
pub(super) fn click(state: &mut State, text: &str, size: (u16, u16)) -> Vec<Action> {
    state.size = size;
    let page = page(state, size.0, size.1);
    let found = page.lines().enumerate().find_map(|(row, line)| {
        // The page is printed between quotation marks.
        let line = line.trim_matches('"');
        let before = line.split_once(text)?.0;
        Some((before.chars().count(), row))
    });
    let (column, row) = found.unwrap_or_else(|| panic!("{text} is not on the page:\n{page}"));
    let at = |index: usize| u16::try_from(index).unwrap_or(u16::MAX);
    update(state, Message::Click { column: at(column), row: at(row) })
}

#[test]
fn opening_the_history_reads_the_record() {
    let mut state = begun();
    assert_eq!(press(&mut state, KeyCode::Char('4')), [Action::Archive(ArchiveRequest::List)]);
    assert_eq!(state.screen, Screen::History);
    assert!(page(&state, 80, 24).contains("Reading the record"));
}

#[test]
fn a_run_is_chosen_opened_scrolled_and_closed() {
    let mut state = recorded();
    press(&mut state, KeyCode::Down);
    assert_eq!(press(&mut state, KeyCode::Enter), [Action::Archive(ArchiveRequest::Open(2))]);
    press(&mut state, KeyCode::Enter);
    assert!(page(&state, 80, 24).contains("nothing found within 40 deg of waist"));
}

#[test]
fn a_filter_shows_only_runs_that_hold_all_its_words() {
    let mut state = recorded();
    press(&mut state, KeyCode::Char('/'));
    for key in "ADA pass".chars() {
        press(&mut state, KeyCode::Char(key));
    }
    assert!(page(&state, 80, 24).contains("Runs (1 of 3)"));
    press(&mut state, KeyCode::Enter);
    assert_eq!(press(&mut state, KeyCode::Enter), [Action::Archive(ArchiveRequest::Open(1))]);
    press(&mut state, KeyCode::Backspace);
    press(&mut state, KeyCode::Char('/'));
    for key in "xyz".chars() {
        press(&mut state, KeyCode::Char(key));
    }
    assert!(page(&state, 80, 24).contains("No run holds these words"));
    press(&mut state, KeyCode::Enter);
    assert_eq!(press(&mut state, KeyCode::Enter), [], "there is nothing to open");
}

#[test]
fn the_record_says_whose_it_is() {
    let mut state = recorded();
    let first_line = |state: &State| page(state, 80, 24).lines().next().unwrap().to_owned();
    assert!(first_line(&state).contains("the record of teachmover"), "{}", first_line(&state));
    assert!(page(&state, 80, 24).contains("Runs (3) of teachmover, UTC"));
    if let Some(run) = state.history.as_mut().and_then(|history| history.runs.as_mut()?.first_mut()) {
        run.cell = "puma".to_owned();
    }
    assert!(first_line(&state).contains("the record of 2 cells"), "{}", first_line(&state));
    let listed = page(&state, 80, 24);
    assert!(listed.contains("puma initialize") && listed.contains("teachmover wais"), "{listed}");
}

#[test]
fn corrected_quantities_are_stepped_through() {
    let mut state = recorded();
    assert!(page(&state, 80, 24).contains("waist zero of arm, deg"));
    press(&mut state, KeyCode::Right);
    assert!(page(&state, 80, 24).contains("elbow zero of arm, deg"));
    press(&mut state, KeyCode::Right);
    assert!(page(&state, 80, 24).contains("waist zero of arm, deg"));
}

#[test]
fn earlier_corrections_are_brought_back_once_that_is_confirmed() {
    let mut state = recorded();
    click(&mut state, "11-19", (80, 24));
    press(&mut state, KeyCode::Char('b'));
    let notice = |state: &State| state.notice.as_ref().map(|notice| notice.text.clone()).unwrap_or_default();
    assert_eq!((state.overlay, notice(&state).as_str()), (None, "What run 1 put in force is in force."));

    // A later run put something else in force.
    let waist = state.history.as_mut().and_then(|history| history.trends.first_mut()).expect("a trend");
    let mut later = waist.points.last().expect("a point").clone();
    (later.run, later.revision, later.value) = (Some(3), 7, 9.0);
    waist.points.push(later);
    press(&mut state, KeyCode::Char('b'));
    assert_eq!(state.overlay, Some(Overlay::BringBack));
    let page = page(&state, 80, 24);
    assert!(page.contains("waist zero of arm: 9.0000 -> 1.6000 deg"), "{page}");
    assert!(page.contains("n  leave them as they are"), "nothing of the question is cut off: {page}");
    let back = state.history.as_ref().and_then(|history| history.bring_back.clone()).expect("it is asked");
    assert!(
        back.question().contains("arm of cell teachmover, back to revision 2 of run 1"),
        "{}",
        back.question()
    );
    assert_eq!(back.changes.len(), 1, "the elbow's is in force: {:?}", back.changes);
    assert_eq!(press(&mut state, KeyCode::Enter), [], "Enter leaves them");
    assert_eq!(state.overlay, None);
    press(&mut state, KeyCode::Char('b'));
    let actions = press(&mut state, KeyCode::Char('y'));
    let [Action::Archive(ArchiveRequest::BringBack(back))] = actions.as_slice() else {
        panic!("it is asked of the record: {actions:?}")
    };
    assert_eq!((back.cell.as_str(), back.device.as_str(), back.revision), ("teachmover", "arm", 2));

    press(&mut state, KeyCode::Up);
    press(&mut state, KeyCode::Char('b'));
    assert_eq!(notice(&state), "Run 2 put no correction in force: choose one that did.");
    let reason = "cell teachmover is already run by another plumb".to_owned();
    update(&mut state, Message::Archive(ArchiveAnswer::NotBroughtBack(reason.clone())));
    assert_eq!(notice(&state), reason);
}

#[test]
fn a_click_chooses_a_run_and_a_candidate() {
    let mut state = recorded();
    click(&mut state, "11-19", (80, 24));
    assert_eq!(press(&mut state, KeyCode::Enter), [Action::Archive(ArchiveRequest::Open(1))]);
    let mut state = examined();
    click(&mut state, "joint_backlash", (120, 40));
    assert_eq!(state.model.as_ref().map(|model| model.chosen), Some(2));
}

#[test]
fn a_click_chooses_an_option_and_only_enter_or_the_button_answers() {
    let mut state = begun();
    deliver(&mut state, choice_asked());
    assert_eq!(click(&mut state, "another one", (80, 24)), []);
    let answer = RunCommand::Answer {
        prompt: PromptId(41),
        answer: Answer::Choice { key: "other".to_owned() },
        by: "ada".to_owned(),
    };
    assert_eq!(press(&mut state, KeyCode::Enter), [Action::Send(answer)]);

    let mut state = begun();
    deliver(&mut state, asked_to_confirm());
    let answer = RunCommand::Answer { prompt: PromptId(41), answer: Answer::Done, by: "ada".to_owned() };
    assert_eq!(click(&mut state, "the target lies", (80, 24)), [Action::Send(answer)]);
}

#[test]
fn what_lies_over_the_page_shields_it_from_clicks() {
    let mut state = begun();
    deliver(&mut state, asked_to_confirm());
    page(&state, 80, 24);
    state.overlay = Some(Overlay::Abort);
    for row in 1..21 {
        assert_eq!(update(&mut state, Message::Click { column: 40, row }), []);
    }
}

#[test]
fn the_wheel_moves_the_choice() {
    let mut state = recorded();
    update(&mut state, Message::Scroll(1));
    assert_eq!(state.history.as_ref().map(|history| history.chosen), Some(2), "a notch is three lines");
    update(&mut state, Message::Scroll(-1));
    assert_eq!(state.history.as_ref().map(|history| history.chosen), Some(0));
}

#[test]
fn a_correction_over_time_names_its_cell_among_several_and_has_two_ends_of_its_axis() {
    let mut state = recorded();
    assert!(!page(&state, 120, 40).contains("waist zero of arm, teachmover"), "one cell needs no name");
    let history = state.history.as_mut().expect("a history");
    history.trends[1].cell = "second".to_owned();
    let point = history.trends[0].points.first_mut().expect("a point");
    (point.value, point.uncertainty) = (0.0, None);
    history.trends[0].points.truncate(1);
    let shown = page(&state, 120, 40);
    assert!(shown.contains("waist zero of arm, teachmover, deg (1 of 2)"), "{shown}");
    assert!(shown.contains(" 0.010 ") && shown.contains("-0.010 ") && !shown.contains("-0.000"), "{shown}");
}
