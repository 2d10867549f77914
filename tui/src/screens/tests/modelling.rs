//! The Model screen: the order of what it says, the chosen candidate's own plot, details, rows that are pointed out, and what asks before it is added.

use plumb_calibration::measurement::ReadingUnit;
use ratatui::crossterm::event::KeyCode;

use super::fixtures::{examined, page, press};
use crate::screens::message::{Action, Message};
use crate::screens::model::testing::{CardStatus, ModelSummary};
use crate::screens::model::{Doubtful, LabAnswer, LabRequest};
use crate::screens::screen::Screen;
use crate::screens::state::{Overlay, State};
use crate::screens::update::update;

/// The sizes the page is looked at in.
const SIZES: [(u16, u16); 3] = [(80, 24), (120, 40), (200, 60)];

fn summary(state: &State) -> ModelSummary {
    state.model.as_ref().and_then(|model| model.summary.clone()).expect("the model was examined")
}

fn take(state: &mut State, summary: ModelSummary) {
    update(state, Message::Lab(LabAnswer::Examined(Box::new(summary))));
}

/// The row and column of a text on the page.
#[track_caller]
fn position_of(page: &str, text: &str) -> (usize, usize) {
    let mut lines = page.lines().enumerate();
    let found = lines.find_map(|(row, line)| {
        let (before, _) = line.trim_matches('"').split_once(text)?;
        Some((row, before.chars().count()))
    });
    found.unwrap_or_else(|| panic!("{text} is not on the page:\n{page}"))
}

#[test]
fn the_page_answers_in_order_how_large_how_much_where_which_and_what_adding_did() {
    for (width, height) in SIZES {
        let page = page(&examined(), width, height);
        let strip = ["Error  ", "Explainable", "Where  "].map(|name| position_of(&page, name).0);
        assert!(strip.is_sorted() && strip[0] == 1, "{page}");
        assert!(page.contains("RMS 0.312, mean 0.204, 95 % 0.410, max 12.728 mm"), "{page}");
        assert!(page.contains(" pose + last move"), "{page}");
        let panes = ["Which effect", "\u{b1}0.40", "RMS of a point"].map(|name| position_of(&page, name));
        assert!(panes[0].0 > strip[2], "{page}");
        assert!(panes.map(|pane| pane.1).is_sorted(), "{page}");
    }
}

#[test]
fn the_chosen_candidates_own_plot_comes_first_with_both_axes_named() {
    for (width, height) in SIZES {
        let mut state = examined();
        let page_of = |state: &State| page(state, width, height);
        let shown = page_of(&state);
        let (own, _) = position_of(&shown, "joint_compliance(shoulder");
        let first_joint = shown.lines().position(|line| line.contains("error along pan"));
        assert!(first_joint.is_none_or(|row| row > own), "{shown}");
        assert!(
            shown.contains("moment about shoulder, N m") && shown.contains("-90") && shown.contains("90"),
            "{shown}"
        );
        press(&mut state, KeyCode::Down);
        let shown = page_of(&state);
        assert!(!shown.contains("moment about"), "the next candidate has no plot:\n{shown}");
    }
    let wide = page(&examined(), 200, 60);
    assert!(wide.contains("moment about shoulder, N m"), "{wide}");
    assert!(wide.contains("error along pan, mm") && wide.contains("pan, deg"), "{wide}");
    assert!(wide.contains("error of a row, mm") && wide.contains("order, row"), "{wide}");
    assert!(wide.contains("error in space"), "{wide}");
}

#[test]
fn a_pane_too_small_for_all_plots_says_which_are_shown_and_pages_through_them() {
    let mut state = examined();
    let shown = page(&state, 80, 24);
    assert!(shown.contains("1/11 PgDn"), "{shown}");
    press(&mut state, KeyCode::PageDown);
    assert!(page(&state, 80, 24).contains("2/11 PgDn"), "{}", page(&state, 80, 24));
}

#[test]
fn enter_opens_the_details_of_a_candidate_and_closes_them() {
    for (width, height) in SIZES {
        let mut state = examined();
        assert_eq!(press(&mut state, KeyCode::Enter), [], "nothing is added");
        let shown = page(&state, width, height);
        assert!(shown.contains("1 of 3 \u{b7} joint_compliance(shoulder)"), "{shown}");
        assert!(shown.contains("Probability 93 %."), "{shown}");
        assert!(shown.contains("To see it:"), "{shown}");
        press(&mut state, KeyCode::Down);
        assert!(page(&state, width, height).contains("2 of 3 \u{b7} link_sag(upper_arm)"));
        press(&mut state, KeyCode::Enter);
        assert_eq!(state.overlay, None);
    }
    let mut state = examined();
    press(&mut state, KeyCode::Enter);
    assert_eq!(press(&mut state, KeyCode::Esc), [Action::Stop], "the stop key closes them too");
    assert_eq!(state.overlay, None);
}

#[test]
fn what_was_not_named_is_added_only_after_a_question() {
    let mut state = examined();
    press(&mut state, KeyCode::Down);
    press(&mut state, KeyCode::Down);
    for refusal in [KeyCode::Char('n'), KeyCode::Enter, KeyCode::Esc] {
        assert_eq!(press(&mut state, KeyCode::Char('a')), []);
        assert_eq!(state.overlay, Some(Overlay::AddRejected));
        let shown = page(&state, 80, 24);
        let reason = "joint_backlash(elbow) was not named: no gain where it was";
        assert!(shown.contains(reason) && shown.contains("y  add it all the same"), "{shown}");
        let actions = press(&mut state, refusal);
        assert!(!actions.iter().any(|action| matches!(action, Action::Lab(_))), "{actions:?}");
        assert_eq!(state.overlay, None);
    }
    press(&mut state, KeyCode::Char('a'));
    let add = Action::Lab(LabRequest::Add("joint_backlash(elbow)".to_owned()));
    assert_eq!(press(&mut state, KeyCode::Char('y')), [add]);
    assert_eq!(state.overlay, None);

    let mut state = examined();
    press(&mut state, KeyCode::Char('n'));
    for key in "joint_backlash( elbow )".chars() {
        press(&mut state, KeyCode::Char(key));
    }
    assert_eq!(press(&mut state, KeyCode::Enter), [], "by its name as well");
    assert_eq!(state.overlay, Some(Overlay::AddRejected));
}

#[test]
fn a_name_that_was_written_and_would_not_be_named_is_added_only_after_a_question() {
    let mut state = examined();
    press(&mut state, KeyCode::Char('n'));
    for key in "joint_gain(wrist)".chars() {
        press(&mut state, KeyCode::Char(key));
    }
    let effect = "joint_gain(wrist)".to_owned();
    assert_eq!(press(&mut state, KeyCode::Enter), [Action::Lab(LabRequest::AddNamed(effect.clone()))]);
    let reason = "it is not among the 3 likeliest candidates".to_owned();
    let doubtful = Doubtful { effect: effect.clone(), reason, is_chosen: false };
    update(&mut state, Message::Lab(LabAnswer::Doubted(doubtful)));
    assert_eq!(state.overlay, Some(Overlay::AddRejected));
    let shown = page(&state, 80, 24);
    assert!(
        shown.contains("joint_gain(wrist) was not named: it is not among") && !shown.contains("Space"),
        "{shown}"
    );
    assert_eq!(press(&mut state, KeyCode::Char('y')), [Action::Lab(LabRequest::Add(effect))]);
}

#[test]
fn what_is_in_the_model_is_shown_first_at_the_floor_and_not_added_again() {
    let mut state = examined();
    let mut summary = summary(&state);
    summary.at_floor = true;
    for card in &mut summary.cards {
        card.status = CardStatus::Rejected;
    }
    summary.cards.swap(0, 2);
    summary.cards[2].status = CardStatus::InModel;
    summary.plots[0].added = true;
    take(&mut state, summary);
    let shown = page(&state, 120, 40);
    assert!(shown.contains("in the model") && shown.contains("moment about"), "{shown}");
    for key in [KeyCode::Char('a'), KeyCode::Char(' ')] {
        assert_eq!(press(&mut state, key), []);
        let notice = state.notice.as_ref().map(|notice| notice.text.clone()).unwrap_or_default();
        assert!(notice.starts_with("That is in the model already"), "{notice}");
    }
}

#[test]
fn rows_are_pointed_out_from_the_worst_on_and_by_a_click_on_a_point() {
    let mut state = examined();
    press(&mut state, KeyCode::Char('w'));
    let shown = page(&state, 120, 40);
    assert!(shown.contains("Line 79 (the worst of 200): off by"), "{shown}");
    assert!(shown.contains("pan") && shown.contains('\u{25c6}'), "the row is marked in the plots:\n{shown}");
    press(&mut state, KeyCode::Char('w'));
    assert!(page(&state, 120, 40).contains("(number 2 from the worst of 200)"));
    press(&mut state, KeyCode::Char('W'));
    press(&mut state, KeyCode::Char('W'));
    assert_eq!(state.model.as_ref().and_then(|model| model.pointed), None, "before the worst there is none");

    // The line of the worst row is in the picture of the error in space.
    state.size = (200, 60);
    let shown = page(&state, 200, 60);
    let space = position_of(&shown, "error in space");
    let marked = shown.lines().enumerate().skip(space.0).find_map(|(row, line)| {
        let line = line.trim_matches('"');
        let characters: Vec<char> = line.chars().collect();
        let found = (space.1..characters.len() - 1).find(|at| characters[*at..].starts_with(&['7', '9']));
        found.map(|column| (column, row))
    });
    let (column, row) = marked.unwrap_or_else(|| panic!("79 is not marked:\n{shown}"));
    let at = |index: usize| u16::try_from(index).expect("a place of the page");
    update(&mut state, Message::Click { column: at(column), row: at(row) });
    assert_eq!(state.model.as_ref().and_then(|model| model.pointed), Some(77));
    update(&mut state, Message::Click { column: at(column), row: at(row) });
    assert_eq!(state.model.as_ref().and_then(|model| model.pointed), None, "again lets go of it");
}

#[test]
fn the_fall_is_solid_for_mechanisms_and_hatched_for_corrections_with_noise_and_bound_as_lines() {
    for (width, height) in [(120, 40), (200, 60)] {
        let shown = page(&examined(), width, height);
        let bar_below = |label: &str| -> String {
            let (row, column) = position_of(&shown, label);
            shown.lines().nth(row + 1).unwrap_or_default().trim_matches('"').chars().skip(column).collect()
        };
        let (start, correction) = (bar_below("start"), bar_below("joint_harm"));
        assert!(start.contains('\u{2588}') && !start.contains('\u{2592}'), "{start}");
        assert!(correction.contains('\u{2592}') && !correction.contains('\u{2588}'), "{correction}");
        for bar in [&start, &correction] {
            assert!(bar.contains('\u{2502}') && bar.contains('\u{250a}'), "both lines cross {bar}");
        }
        assert!(shown.contains("noise of a point 0.0866"), "like is compared with like:\n{shown}");
        assert!(shown.contains("not predictable 0.1400"), "{shown}");
    }
}

#[test]
fn a_name_is_completed_by_tab_and_says_what_it_could_become() {
    let mut state = examined();
    press(&mut state, KeyCode::Char('n'));
    for key in "joint_sti".chars() {
        press(&mut state, KeyCode::Char(key));
    }
    assert!(page(&state, 120, 40).contains("Tab completes: joint_stiffening(*), joint_stiffening(pan)"));
    assert_eq!(press(&mut state, KeyCode::Tab), []);
    assert_eq!(state.screen, Screen::Model, "no other page is shown");
    let naming = |state: &State| state.model.as_ref().and_then(|model| model.naming.clone());
    assert_eq!(naming(&state).as_deref(), Some("joint_stiffening("));
    for key in "q".chars() {
        press(&mut state, KeyCode::Char(key));
    }
    press(&mut state, KeyCode::Tab);
    assert_eq!(naming(&state).as_deref(), Some("joint_stiffening(q"), "nothing begins so");
    assert!(page(&state, 120, 40).contains("no effect of the library is called so"));
}

#[test]
fn numbers_that_are_none_and_rows_that_are_missing_break_no_plot() {
    let mut state = examined();
    let mut summary = summary(&state);
    for row in &mut summary.residuals.rows {
        row.vector_mm = [f64::NAN; 3];
        row.size = Some(f64::INFINITY);
        row.joints.clear();
    }
    for series in &mut summary.residuals.series {
        series.points = series.points.iter().map(|(across, _, row)| (across, f64::NAN, row)).collect();
    }
    summary.plots[0].points.clear();
    summary.plots[0].curve = vec![(f64::NAN, f64::INFINITY); 3];
    take(&mut state, summary.clone());
    for (width, height) in SIZES {
        page(&state, width, height);
    }
    press(&mut state, KeyCode::Char('w'));
    assert_eq!(state.model.as_ref().and_then(|model| model.pointed), None);
    summary.residuals.rows.clear();
    summary.residuals.series.clear();
    take(&mut state, summary);
    press(&mut state, KeyCode::Enter);
    for (width, height) in SIZES {
        page(&state, width, height);
    }
}

#[test]
fn nothing_of_the_lines_over_the_page_is_cut_without_a_mark_in_a_small_terminal() {
    let mut state = examined();
    let long = "The shoulder gives way under gravity, and so does the elbow. ".repeat(12);
    if let Some(summary) = state.model.as_mut().and_then(|model| model.summary.as_mut()) {
        summary.sentence = long;
    }
    for (width, height) in [(80, 24), (72, 24), (60, 24), (44, 24)] {
        let page = page(&state, width, height);
        let flat: String =
            page.lines().map(|line| format!("{} ", line.trim_matches(['\u{2502}', ' ']))).collect();
        for words in ["12.728 mm", "0.087", "not predictable", "79, 134, 73", "0.110"] {
            assert!(flat.contains(words), "{words} at {width}: {page}");
        }
        let foot = page.lines().rev().nth(2).unwrap();
        assert!(foot.contains('\u{2026}'), "what is cut of the sentence is marked: {page}");
    }
}

/// Of a table of tilts alone the page said mm where degrees are meant.
#[test]
fn of_a_table_of_angles_alone_every_error_is_in_degrees() {
    for (width, height) in SIZES {
        let mut state = examined();
        let mut angles = summary(&state);
        angles.unit = ReadingUnit::Deg;
        for plot in &mut angles.plots {
            plot.up.unit = "deg".to_owned();
        }
        for series in &mut angles.residuals.series {
            series.shows = series.shows.replace(", mm", ", deg");
        }
        for row in &mut angles.residuals.rows {
            row.vector_mm = [0.0; 3];
        }
        for line in [&mut angles.how_large, &mut angles.how_much, &mut angles.where_it_is] {
            (line.full, line.short) = (line.full.replace(" mm", " deg"), line.short.replace(" mm", " deg"));
        }
        take(&mut state, angles);
        let shown = page(&state, width, height);
        for length in [" mm", ",mm", "mm\u{2502}"] {
            assert!(!shown.contains(length), "{shown}");
        }
        assert!(shown.contains("RMS of a point, deg"), "{shown}");
        assert!(shown.contains(" deg = ") || shown.contains("\u{b1}0.40 deg"), "{shown}");
        press(&mut state, KeyCode::Enter);
        let details = page(&state, width, height);
        assert!(!details.contains(" mm") && details.contains("In its own plot: 0.1600 deg RMS"), "{details}");
    }
}
