//! Every page at several sizes, as it is drawn.

use plumb_cell::event::{Correction, Event, RunOutcome, StepOutcome};
use ratatui::crossterm::event::KeyCode;
use ratatui::style::{Color, Modifier};

use crate::screens::history::ArchiveAnswer;
use crate::screens::message::Message;
use crate::screens::update::update;

use super::fixtures::{
    begun, choice_asked, decision_asked, deliver, drawn, examined, finished, jog_asked, number_asked, page,
    passed, press, recorded, searching, started,
};
use crate::screens::screen::Screen;
use crate::screens::state::{Overlay, State};
use crate::screens::theme::Theme;

/// The sizes every page is held to.
const SIZES: [(u16, u16); 4] = [(80, 24), (120, 40), (40, 10), (1, 1)];

fn snapshots(name: &str, state: &State) {
    for (width, height) in SIZES {
        insta::assert_snapshot!(format!("{name}-{width}x{height}"), page(state, width, height));
    }
}

#[test]
fn the_cell_page_shows_devices_joints_signals_and_the_arm() {
    let mut state = searching();
    state.screen = Screen::Cell;
    snapshots("cell", &state);
}

#[test]
fn the_run_page_asks_for_a_number_with_its_unit_and_bounds() {
    let mut state = begun();
    deliver(&mut state, started("upright"));
    deliver(&mut state, number_asked());
    snapshots("run-number", &state);
}

#[test]
fn the_run_page_says_why_a_number_was_not_taken() {
    let mut state = begun();
    deliver(&mut state, started("upright"));
    deliver(&mut state, number_asked());
    for key in "290".chars() {
        press(&mut state, KeyCode::Char(key));
    }
    press(&mut state, KeyCode::Enter);
    insta::assert_snapshot!(page(&state, 80, 24));
}

#[test]
fn the_run_page_shows_how_trigger_poses_settle_while_the_arm_moves() {
    snapshots("run-search", &searching());
}

#[test]
fn the_run_page_shows_corrections_at_the_end() {
    snapshots("run-passed", &passed());
}

#[test]
fn a_correction_that_was_not_accepted_is_shown_as_discarded_and_one_proposed_anew_as_proposed() {
    let mut state = searching();
    let correction = camera_aim();
    let proposed = || Event::CorrectionProposed { correction: correction.clone() };
    deliver(&mut state, proposed());
    assert!(page(&state, 120, 40).contains("camera aim x") && page(&state, 120, 40).contains("proposed"));
    deliver(&mut state, finished("apply", StepOutcome::Passed, "discarded"));
    assert!(page(&state, 120, 40).contains("discarded"), "{}", page(&state, 120, 40));
    deliver(&mut state, Event::CorrectionApplied { correction: correction.clone(), revision: 1 });
    assert!(page(&state, 120, 40).contains("deg in force"));
    deliver(&mut state, proposed());
    assert!(!page(&state, 120, 40).contains("deg in force"));
}

fn camera_aim() -> Correction {
    Correction {
        device: "stripe".to_owned(),
        quantity: "sensor_parameter".to_owned(),
        site: "camera_aim_x".to_owned(),
        old: 0.0,
        new: 0.4,
        uncertainty: Some(0.04),
        budget: None,
        unit: "deg".to_owned(),
    }
}

#[test]
fn a_choice_a_jog_and_a_decision_show_what_can_be_done() {
    for (name, event) in [("choice", choice_asked()), ("jog", jog_asked()), ("decision", decision_asked())] {
        let mut state = begun();
        deliver(&mut state, started("upright"));
        deliver(&mut state, event);
        snapshots(&format!("run-{name}"), &state);
    }
}

#[test]
fn a_prompt_can_be_read_from_the_arm() {
    let mut state = begun();
    deliver(&mut state, jog_asked());
    press(&mut state, KeyCode::Char('z'));
    snapshots("run-large", &state);
}

#[test]
fn the_model_page_shows_candidates_residuals_and_the_fall_of_the_error() {
    snapshots("model", &examined());
}

#[test]
fn the_history_page_lists_runs_and_draws_corrections_over_time() {
    let mut state = recorded();
    snapshots("history", &state);
    press(&mut state, KeyCode::Down);
    press(&mut state, KeyCode::Down);
    press(&mut state, KeyCode::Enter);
    let lines = [
        "run 1 of teachmover: Initialize the arm",
        "",
        "corrections",
        "  zero of arm waist   1.7 -> 1.6 deg",
    ];
    let lines = lines.map(str::to_owned).to_vec();
    update(&mut state, Message::Archive(ArchiveAnswer::Opened { run: 1, lines }));
    insta::assert_snapshot!(page(&state, 80, 24));
}

#[test]
fn the_log_page_keeps_a_line_for_everything_that_happened() {
    let mut state = searching();
    state.screen = Screen::Log;
    snapshots("log", &state);
}

#[test]
fn help_and_questions_lie_over_the_page() {
    let mut state = searching();
    for (name, overlay) in
        [("help", Overlay::Help { scrolled: 0 }), ("leave", Overlay::Leave), ("abort", Overlay::Abort)]
    {
        state.overlay = Some(overlay);
        snapshots(name, &state);
    }
}

#[test]
fn every_page_survives_every_small_size() {
    let mut states = vec![begun(), searching(), passed(), examined(), recorded()];
    for event in [number_asked(), choice_asked(), jog_asked(), decision_asked()] {
        let mut state = begun();
        deliver(&mut state, event);
        states.push(state.clone());
        press(&mut state, KeyCode::Char('z'));
        states.push(state);
    }
    for state in &mut states {
        for screen in Screen::ALL {
            for overlay in [None, Some(Overlay::Help { scrolled: 99 }), Some(Overlay::Leave)] {
                (state.screen, state.overlay) = (screen, overlay);
                for width in (1..=130).step_by(13) {
                    for height in (1..=31).step_by(3) {
                        drawn(state, width, height);
                    }
                }
            }
        }
    }
}

#[test]
fn every_page_of_a_cell_says_which_key_stops_and_that_it_is_no_emergency_stop() {
    let mut state = searching();
    for screen in [Screen::Cell, Screen::Run, Screen::Log] {
        for overlay in [None, Some(Overlay::Help { scrolled: 0 }), Some(Overlay::Abort)] {
            (state.screen, state.overlay) = (screen, overlay);
            let page = page(&state, 80, 24);
            assert!(
                page.contains("Esc or Ctrl+C STOPS every robot. It is software, not an emergency stop."),
                "{page}"
            );
        }
    }
    assert!(page(&state, 30, 8).contains("Esc STOP"));
    assert!(page(&state, 10, 2).contains("Esc STOP"));
}

#[test]
fn without_colour_words_and_signs_still_distinguish_passed_from_failed() {
    let mut state = begun();
    state.theme = Theme::plain();
    deliver(&mut state, started("grid"));
    deliver(&mut state, finished("grid", StepOutcome::Passed, "done"));
    deliver(&mut state, started("upright"));
    deliver(&mut state, finished("upright", StepOutcome::Failed, "not upright"));
    deliver(
        &mut state,
        Event::RunEnded { run: 12, outcome: RunOutcome::Failed, message: "Not upright.".to_owned() },
    );
    let backend = drawn(&state, 80, 24);
    let text = backend.to_string();
    assert!(
        text.contains("\u{2713} Set the target") && text.contains("\u{2717} Bring the forearm"),
        "{text}"
    );
    assert!(text.contains("\u{2717} failed"), "{text}");
    for cell in backend.buffer().content() {
        assert_eq!((cell.fg, cell.bg), (Color::Reset, Color::Reset), "a cell has a colour: {cell:?}");
    }
    let stop = &backend.buffer().content()[23 * 80 + 2];
    assert!(stop.modifier.contains(Modifier::REVERSED), "the stop bar is conspicuous: {stop:?}");
}
