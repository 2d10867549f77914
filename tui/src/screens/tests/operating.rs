//! What an operator does, and what the program does about it.

use std::time::Duration;

use plumb_cell::command::{Command as RunCommand, PauseWhen};
use plumb_cell::event::{Event, PlaneClearance, RunOutcome, StepOutcome};
use plumb_cell::prompt::{Answer, Decision, PromptId, PromptKind};
use ratatui::crossterm::event::KeyCode;

use super::fixtures::{
    begun, choice_asked, decision_asked, deliver, examined, finished, jog_asked, number_asked, page, passed,
    path, posed, press, searching,
};
use crate::screens::keys::{BINDINGS, Context, command_for};
use crate::screens::message::{Action, Message};
use crate::screens::model::{LabAnswer, LabRequest};
use crate::screens::screen::Screen;
use crate::screens::state::{Overlay, Severity, State};
use crate::screens::update::update;

fn type_in(state: &mut State, text: &str) {
    for key in text.chars() {
        press(state, KeyCode::Char(key));
    }
}

fn answers(actions: &[Action]) -> Vec<&Answer> {
    actions
        .iter()
        .filter_map(|action| match action {
            Action::Send(RunCommand::Answer { answer, .. }) => Some(answer),
            _ => None,
        })
        .collect()
}

#[test]
fn a_number_is_typed_over_the_one_offered_and_answered_with_who_gave_it() {
    let mut state = begun();
    assert_eq!(deliver(&mut state, number_asked()), [Action::Bell]);
    type_in(&mut state, "269,5");
    let actions = press(&mut state, KeyCode::Enter);
    let answer = RunCommand::Answer {
        prompt: PromptId(41),
        answer: Answer::Number { value: 269.5 },
        by: "ada".to_owned(),
    };
    assert_eq!(actions, [Action::Send(answer)]);
}

#[test]
fn the_number_offered_is_taken_with_enter_alone() {
    let mut state = begun();
    deliver(&mut state, number_asked());
    let actions = press(&mut state, KeyCode::Enter);
    assert_eq!(answers(&actions), [&Answer::Number { value: 270.0 }]);
}

#[test]
fn a_number_out_of_bounds_never_reaches_the_engine() {
    let mut state = begun();
    deliver(&mut state, number_asked());
    type_in(&mut state, "290");
    assert_eq!(press(&mut state, KeyCode::Enter), [Action::Bell]);
    assert!(page(&state, 80, 24).contains("290 deg is too large"));
}

#[test]
fn an_answer_is_given_once_until_the_engine_refuses_it() {
    let mut state = begun();
    deliver(&mut state, number_asked());
    assert_eq!(press(&mut state, KeyCode::Enter).len(), 1);
    assert_eq!(press(&mut state, KeyCode::Enter), []);
    deliver(&mut state, Event::AnswerRefused { prompt: PromptId(41), reason: "read it again".to_owned() });
    assert!(page(&state, 80, 24).contains("read it again"));
    assert_eq!(press(&mut state, KeyCode::Enter).len(), 1);
}

#[test]
fn digits_go_into_a_number_and_switch_pages_elsewhere() {
    let mut state = begun();
    deliver(&mut state, number_asked());
    type_in(&mut state, "1");
    assert_eq!(state.screen, Screen::Run);
    press(&mut state, KeyCode::Tab);
    type_in(&mut state, "1");
    assert_eq!(state.screen, Screen::Cell);
    type_in(&mut state, "2");
    assert_eq!(state.screen, Screen::Run);
    press(&mut state, KeyCode::Backspace);
    assert_eq!(
        state.run.as_ref().and_then(|run| run.prompt.as_ref()).map(|prompt| prompt.field.as_str()),
        Some("")
    );
}

#[test]
fn a_choice_is_made_with_the_arrows() {
    let mut state = begun();
    deliver(&mut state, choice_asked());
    press(&mut state, KeyCode::Down);
    press(&mut state, KeyCode::Down);
    let actions = press(&mut state, KeyCode::Enter);
    assert_eq!(answers(&actions), [&Answer::Choice { key: "other".to_owned() }]);
}

#[test]
fn a_jog_moves_the_chosen_joint_by_the_chosen_step_and_shows_where_it_is() {
    let mut state = begun();
    // The joint that has to come somewhere is chosen already.
    deliver(&mut state, jog_asked());
    press(&mut state, KeyCode::Char(']'));
    let actions = press(&mut state, KeyCode::Left);
    assert_eq!(
        actions,
        [Action::Send(RunCommand::Jog { prompt: PromptId(41), joint: "elbow".to_owned(), by: -5.0 })]
    );
    assert!(page(&state, 120, 40).contains("\u{2717} elbow between -107.25 and -72.75 deg"));
    deliver(&mut state, posed(35.5, -80.0, false));
    assert!(page(&state, 120, 40).contains("\u{2713} elbow between -107.25 and -72.75 deg"));
    assert_eq!(answers(&press(&mut state, KeyCode::Enter)), [&Answer::Done]);
}

#[test]
fn the_height_over_the_table_is_shown_with_the_jog_and_says_in_words_when_it_is_below() {
    let mut state = begun();
    let Event::PromptAsked { prompt } = jog_asked() else { panic!("a prompt") };
    let PromptKind::JogTo { device, .. } = prompt.kind.clone() else { panic!("a jog") };
    deliver(&mut state, Event::PromptAsked { prompt });
    let clearance = |clearance_mm: Option<f64>| Event::Clearance {
        device: device.clone(),
        planes: vec![PlaneClearance { plane: "the table".to_owned(), clearance_mm }],
    };
    deliver(&mut state, clearance(Some(33.46)));
    assert!(page(&state, 80, 24).contains("33.5 mm clear of the table"));
    deliver(&mut state, clearance(Some(-12.04)));
    assert!(page(&state, 80, 24).contains("\u{2717} 12.0 mm BEYOND the table"));
    deliver(&mut state, clearance(None));
    assert!(page(&state, 80, 24).contains("? distance to the table unknown"));
}

#[test]
fn a_pause_leaves_no_prompt_that_looks_live_and_the_one_asked_again_has_the_same_joint_chosen() {
    let mut state = begun();
    deliver(&mut state, jog_asked());
    press(&mut state, KeyCode::Up);
    let Event::PromptAsked { prompt } = jog_asked() else { panic!("a prompt") };
    deliver(&mut state, Event::PromptWithdrawn { prompt: prompt.id });
    deliver(&mut state, Event::Paused { step: None, reason: "stopped by the operator".to_owned() });
    assert!(!page(&state, 80, 24).contains("the arm is in position"));
    assert_eq!(press(&mut state, KeyCode::Left), []);
    deliver(&mut state, Event::Resumed);
    deliver(&mut state, jog_asked());
    let actions = press(&mut state, KeyCode::Left);
    assert!(
        matches!(actions.as_slice(), [Action::Send(RunCommand::Jog { joint, .. })] if joint == "shoulder"),
        "{actions:?}"
    );
}

#[test]
fn a_stop_key_that_is_drawn_after_the_run_has_paused_leaves_what_the_run_says() {
    let mut state = begun();
    update(&mut state, Message::StopKey { leave: false });
    assert!(page(&state, 80, 24).contains("none reported that it was moving"));
    deliver(&mut state, Event::Paused { step: None, reason: "stopped by the operator".to_owned() });
    let paused = "Paused: stopped by the operator. Nothing moves until r resumes.";
    assert!(page(&state, 80, 24).contains(paused));
    update(&mut state, Message::StopKey { leave: false });
    assert!(page(&state, 80, 24).contains(paused));
    // What needs nobody's attention does not hide the stop.
    state.notify(Severity::Info, "Chosen.");
    update(&mut state, Message::StopKey { leave: false });
    assert!(page(&state, 80, 24).contains("Stop sent to every robot"));
}

#[test]
fn an_arm_is_handed_to_its_pendant_only_when_that_was_said_twice() {
    let mut state = begun();
    let Event::PromptAsked { mut prompt } = jog_asked() else { panic!("a prompt") };
    deliver(&mut state, Event::PromptAsked { prompt: prompt.clone() });
    assert_eq!(press(&mut state, KeyCode::Char('h')), [Action::Bell]);
    assert!(page(&state, 120, 40).contains("this arm is not handed over here"));
    if let PromptKind::JogTo { hand_over, .. } = &mut prompt.kind {
        *hand_over = true;
    }
    deliver(&mut state, Event::PromptAsked { prompt });
    assert!(page(&state, 120, 40).contains("h hand it to its pendant, which alone stops it then"));
    assert_eq!(press(&mut state, KeyCode::Char('h')), [Action::Bell]);
    assert!(page(&state, 120, 40).contains("From then on nothing stops the arm but STOP on its pendant"));
    let actions = press(&mut state, KeyCode::Char('h'));
    assert_eq!(actions, [Action::Send(RunCommand::HandOver { prompt: PromptId(41) })]);
}

#[test]
fn asking_once_for_the_pendant_is_forgotten_with_any_other_key_and_with_time() {
    let mut state = begun();
    let Event::PromptAsked { mut prompt } = jog_asked() else { panic!("a prompt") };
    if let PromptKind::JogTo { hand_over, .. } = &mut prompt.kind {
        *hand_over = true;
    }
    deliver(&mut state, Event::PromptAsked { prompt });
    let warning = "From then on nothing stops the arm but STOP on its pendant";

    assert_eq!(press(&mut state, KeyCode::Char('h')), [Action::Bell]);
    press(&mut state, KeyCode::Down);
    assert!(!page(&state, 120, 40).contains(warning));
    assert_eq!(press(&mut state, KeyCode::Char('h')), [Action::Bell], "it asks anew");

    let later = state.now + Duration::from_secs(11);
    update(&mut state, Message::Tick(later));
    assert!(!page(&state, 120, 40).contains(warning));
    assert_eq!(press(&mut state, KeyCode::Char('h')), [Action::Bell], "it asks anew");
    assert_eq!(
        press(&mut state, KeyCode::Char('h')),
        [Action::Send(RunCommand::HandOver { prompt: PromptId(41) })]
    );
}

#[test]
fn a_failed_step_is_tried_again_with_one_key() {
    let mut state = searching();
    deliver(&mut state, decision_asked());
    let actions = press(&mut state, KeyCode::Char('t'));
    assert_eq!(answers(&actions), [&Answer::Decision { decision: Decision::Retry }]);
}

#[test]
fn a_failed_step_offers_to_move_the_arm_and_to_go_back_and_says_what_each_does() {
    for (key, expected) in [('m', Decision::Move), ('b', Decision::Back)] {
        let mut state = searching();
        deliver(&mut state, decision_asked());
        let shown = page(&state, 120, 40);
        assert!(shown.contains("m  Move arm yourself, then do the step again"), "{shown}");
        assert!(shown.contains("b  Go back to \u{201c}Set the target\u{201d}"), "{shown}");
        let actions = press(&mut state, KeyCode::Char(key));
        assert_eq!(answers(&actions), [&Answer::Decision { decision: expected }]);
    }
}

#[test]
fn steps_that_are_done_again_wait_again_and_their_trigger_poses_are_gone() {
    let mut state = searching();
    let run = state.run.as_ref().expect("a run");
    assert_eq!(run.triggers.len(), 5);
    let (before, all) = run.count();
    deliver(&mut state, Event::WentBack { from: path("cycle[3].reach"), to: path("cycle[2].lower") });
    let run = state.run.as_ref().expect("a run");
    assert_eq!(run.triggers.len(), 2, "those of the first turn are left");
    assert_eq!(run.count(), (before - 4, all));
}

#[test]
fn the_keys_of_a_run_do_the_same_on_every_page_and_no_page_has_another_use_for_them() {
    for screen in Screen::ALL {
        let mut state = searching();
        state.scan = Some(crate::screens::scan::ScanState::of_step(&path("scan")));
        state.screen = screen;
        if !state.screens().contains(&screen) {
            continue;
        }
        let paused = Event::Paused { step: None, reason: "stopped by the operator".to_owned() };
        deliver(&mut state, paused);
        assert_eq!(press(&mut state, KeyCode::Char('r')), [Action::Send(RunCommand::Resume)], "{screen:?}");
        deliver(&mut state, Event::Resumed);
        let pause = RunCommand::Pause { when: PauseWhen::BeforeNextStep };
        assert_eq!(press(&mut state, KeyCode::Char('p')), [Action::Send(pause)], "{screen:?}");
        press(&mut state, KeyCode::Char('a'));
        assert_eq!(state.overlay, Some(Overlay::Abort), "{screen:?}");
    }
    let run: Vec<_> =
        BINDINGS.iter().filter(|row| row.context == Context::Run).flat_map(|row| row.keys).collect();
    // No run and no model are open on the Model page at once.
    let pages = [Context::Cell, Context::History, Context::OpenedRun, Context::Log, Context::Scan];
    for row in BINDINGS.iter().filter(|row| pages.contains(&row.context)) {
        assert!(!row.keys.iter().any(|key| run.contains(&key)), "{} on {}", row.shown, row.context.name());
    }
}

#[test]
fn a_resume_marks_the_joint_that_is_elsewhere_with_the_difference() {
    let mut state = begun();
    let joint = |name: &str, value: f64| plumb_cell::event::NamedValue {
        name: name.to_owned(),
        value,
        unit: "deg".to_owned(),
        uncertainty: None,
    };
    let Event::PromptAsked { mut prompt } = jog_asked() else { panic!("a prompt") };
    prompt.kind = PromptKind::ConfirmPose {
        device: "arm".to_owned(),
        recorded: vec![joint("waist", 9.3), joint("shoulder", 41.0)],
        reported: vec![joint("waist", 5.7), joint("shoulder", 41.0)],
    };
    deliver(&mut state, Event::PromptAsked { prompt });
    let shown = page(&state, 80, 24);
    let line = |name: &str| {
        let line = shown.lines().find(|line| line.contains(name) && line.matches("deg").count() > 0);
        line.unwrap_or_default().to_owned()
    };
    assert!(line("9.300").contains("-3.600 deg"), "{shown}");
    assert!(shown.lines().any(|line| line.contains("41.000") && line.contains("same")), "{shown}");
}

#[test]
fn the_last_page_says_what_scans_found_and_leaving_names_the_run_and_its_record() {
    let mut state = begun();
    state.record_option = " --record bench".to_owned();
    press(&mut state, KeyCode::Char('q'));
    let shown = page(&state, 80, 24);
    assert!(shown.contains("plumb run --resume 12 --record bench"), "{shown}");
    press(&mut state, KeyCode::Char('s'));
    let mut planned = state.run.as_ref().expect("a run").steps[0].planned.clone();
    planned.kind = "scan".to_owned();
    let step = planned.step.0.clone();
    deliver(&mut state, Event::Planned { steps: vec![planned], estimate_s: 1.0 });
    deliver(&mut state, finished(&step, StepOutcome::Passed, "apex at 60.0, 530.1, 71.2 mm, 0.043 mm rms"));
    let ended =
        Event::RunEnded { run: 12, outcome: RunOutcome::Passed, message: "all steps passed".to_owned() };
    deliver(&mut state, ended);
    let shown = page(&state, 120, 40);
    assert!(shown.contains("apex at 60.0, 530.1, 71.2 mm, 0.043 mm"), "{shown}");
}

#[test]
fn who_jogs_is_shown_where_the_hand_is_over_the_target_and_shown_it_from_above() {
    let mut state = begun();
    deliver(&mut state, jog_asked());
    deliver(&mut state, posed(35.5, -84.2, false));
    let shown = page(&state, 80, 24);
    assert!(shown.contains("Arm from above") && shown.contains("Arm from the side"), "{shown}");
    assert!(shown.contains("beyond B") && shown.contains("over the table"), "{shown}");
    press(&mut state, KeyCode::Char('v'));
    let shown = page(&state, 80, 24);
    assert!(shown.contains("Steps") && !shown.contains("Arm from above"), "{shown}");
    // Through the table, and in words too.
    deliver(&mut state, posed(-10.0, -84.2, false));
    let shown = page(&state, 80, 24);
    assert!(shown.contains("BELOW the table"), "{shown}");
}

#[test]
fn who_jogs_a_simulated_arm_to_a_level_sees_its_bubble() {
    let mut state = begun();
    deliver(&mut state, jog_asked());
    let Event::PromptAsked { prompt } = jog_asked() else { panic!("a prompt") };
    let read = |value: Option<f64>, step: &plumb_cell::event::StepPath| Event::InstrumentRead {
        step: step.clone(),
        value,
        unit: "deg".to_owned(),
    };
    deliver(&mut state, read(Some(1.0), &path("another")));
    assert!(!page(&state, 80, 24).contains("level ["), "of another step");
    deliver(&mut state, read(Some(-1.0), &prompt.step));
    let shown = page(&state, 80, 24);
    assert!(
        shown.contains("\u{25cf}\u{2500}\u{2500}\u{2500}\u{2500}|") && shown.contains("-1.00 deg"),
        "{shown}"
    );
    deliver(&mut state, read(None, &prompt.step));
    assert!(page(&state, 80, 24).contains("the bubble is at an end"));
}

#[test]
fn the_stop_key_works_in_prompts_overlays_and_on_every_page() {
    let mut prompted = begun();
    deliver(&mut prompted, number_asked());
    let mut helped = searching();
    helped.overlay = Some(Overlay::Help { scrolled: 0 });
    let mut leaving = searching();
    leaving.overlay = Some(Overlay::Leave);
    for mut state in [prompted, helped, leaving, searching(), begun()] {
        for screen in [Screen::Cell, Screen::Run, Screen::Log] {
            state.screen = screen;
            assert_eq!(press(&mut state, KeyCode::Esc), [Action::Stop]);
        }
    }
}

#[test]
fn no_other_row_of_the_table_takes_a_stop_key_away() {
    let stop = &BINDINGS[0];
    assert_eq!((stop.shown, stop.context), ("Esc", Context::Everywhere));
    for binding in &BINDINGS[2..] {
        for key in [BINDINGS[0].keys, BINDINGS[1].keys].concat() {
            assert!(!binding.keys.contains(&key), "{} takes a stop key", binding.shown);
        }
    }
}

#[test]
fn a_stop_closes_what_lies_over_the_page_and_says_what_to_watch() {
    let mut state = searching();
    state.overlay = Some(Overlay::Help { scrolled: 0 });
    update(&mut state, Message::StopKey { leave: false });
    assert_eq!(state.overlay, None);
    assert!(page(&state, 80, 24).contains("Stop sent to every robot. Watch the arm until it rests."));
}

#[test]
fn nothing_moves_again_after_a_stop_until_resume_is_pressed() {
    let mut state = searching();
    deliver(&mut state, Event::Stopped { reason: "operator".to_owned() });
    deliver(&mut state, Event::Paused { step: None, reason: "stopped by the operator".to_owned() });
    for key in [KeyCode::Enter, KeyCode::Char('p'), KeyCode::Char('?'), KeyCode::Tab, KeyCode::Up] {
        let actions = press(&mut state, key);
        assert!(
            !actions.iter().any(|action| matches!(action, Action::Send(_))),
            "{key:?} sent the engine {actions:?}"
        );
        state.screen = Screen::Run;
        state.overlay = None;
    }
    assert_eq!(press(&mut state, KeyCode::Char('r')), [Action::Send(RunCommand::Resume)]);
}

#[test]
fn pausing_waits_for_the_next_step_and_abort_asks_first() {
    let mut state = searching();
    assert_eq!(
        press(&mut state, KeyCode::Char('p')),
        [Action::Send(RunCommand::Pause { when: PauseWhen::BeforeNextStep })]
    );
    assert_eq!(press(&mut state, KeyCode::Char('a')), []);
    assert_eq!(press(&mut state, KeyCode::Char('n')), []);
    assert_eq!(state.overlay, None);
    press(&mut state, KeyCode::Char('a'));
    assert_eq!(press(&mut state, KeyCode::Char('y')), [Action::Send(RunCommand::Abort)]);
}

#[test]
fn leaving_asks_while_a_run_is_open_and_not_afterwards() {
    let mut state = searching();
    assert_eq!(press(&mut state, KeyCode::Char('q')), []);
    assert_eq!(state.overlay, Some(Overlay::Leave));
    assert_eq!(press(&mut state, KeyCode::Char('k')), [Action::Stop]);
    assert!(page(&state, 80, 24).contains("Leaving as soon as the robots are at rest."));
    let paused = Event::Paused { step: None, reason: "stopped".to_owned() };
    assert!(deliver(&mut state, paused).contains(&Action::Leave));
    assert_eq!(press(&mut passed(), KeyCode::Char('q')), [Action::Stop, Action::Leave]);
}

#[test]
fn an_aborted_run_is_left_when_it_has_ended_and_a_stuck_one_all_the_same() {
    let mut state = searching();
    press(&mut state, KeyCode::Char('q'));
    assert_eq!(press(&mut state, KeyCode::Char('a')), [Action::Stop, Action::Send(RunCommand::Abort)]);
    let now = state.now;
    assert_eq!(update(&mut state, Message::Tick(now + Duration::from_secs(1))), []);
    assert_eq!(update(&mut state, Message::Tick(now + Duration::from_secs(6))), [Action::Leave]);
    let ended = Event::RunEnded { run: 12, outcome: RunOutcome::Aborted, message: "Aborted.".to_owned() };
    assert!(deliver(&mut state, ended).contains(&Action::Leave));
}

#[test]
fn a_second_stop_key_asks_to_leave() {
    let mut state = searching();
    update(&mut state, Message::StopKey { leave: true });
    assert_eq!(state.overlay, Some(Overlay::Leave));
}

#[test]
fn a_click_on_a_hint_a_tab_or_the_stop_bar_does_what_its_key_does() {
    let mut state = searching();
    update(&mut state, Message::Resized { width: 80, height: 24 });
    let text = page(&state, 80, 24);
    let click_on = |what: &str| {
        let (row, line) =
            text.lines().enumerate().find(|(_, line)| line.contains(what)).expect("it is on the page");
        let before = line.split(what).next().unwrap_or_default();
        // The text of a test page is in quotation marks.
        Message::Click {
            column: u16::try_from(before.chars().count()).unwrap_or(0),
            row: u16::try_from(row).unwrap_or(0),
        }
    };
    assert_eq!(
        update(&mut state, click_on("pause")),
        [Action::Send(RunCommand::Pause { when: PauseWhen::BeforeNextStep })]
    );
    assert_eq!(update(&mut state, click_on("1 Cell")), []);
    assert_eq!(state.screen, Screen::Cell);
    assert_eq!(update(&mut state, click_on("STOPS")), [Action::Stop]);
}

#[test]
fn an_answer_to_a_prompt_that_was_withdrawn_is_not_given() {
    let mut state = begun();
    deliver(&mut state, number_asked());
    deliver(&mut state, Event::PromptWithdrawn { prompt: PromptId(41) });
    assert_eq!(press(&mut state, KeyCode::Enter), []);
}

#[test]
fn a_run_that_ended_says_how_and_takes_no_more_commands() {
    let mut state = searching();
    let message = "Host of arm ended: signal 11.".to_owned();
    deliver(&mut state, Event::RunEnded { run: 12, outcome: RunOutcome::Error, message });
    assert!(page(&state, 80, 24).contains("Host of arm ended: signal 11."));
    for key in ['p', 'r', 'a'] {
        assert_eq!(press(&mut state, KeyCode::Char(key)), []);
        assert_eq!(state.overlay, None);
    }
}

#[test]
fn a_candidate_is_previewed_before_it_is_added_and_can_be_undone() {
    let mut state = examined();
    press(&mut state, KeyCode::Down);
    assert_eq!(
        press(&mut state, KeyCode::Char(' ')),
        [Action::Lab(LabRequest::Preview("link_sag(upper_arm)".to_owned()))]
    );
    assert_eq!(press(&mut state, KeyCode::Char('a')), [], "one thing at a time");
    let mut state = examined();
    assert_eq!(
        press(&mut state, KeyCode::Char('a')),
        [Action::Lab(LabRequest::Add("joint_compliance(shoulder)".to_owned()))]
    );
    let mut state = examined();
    assert_eq!(press(&mut state, KeyCode::Char('u')), [Action::Lab(LabRequest::Undo)]);
}

#[test]
fn an_effect_is_added_by_its_name_and_no_letter_of_it_does_anything_else() {
    let mut state = examined();
    press(&mut state, KeyCode::Char('n'));
    type_in(&mut state, "q?1u joint_zero(*)x");
    press(&mut state, KeyCode::Backspace);
    assert!(page(&state, 80, 24).contains("Add effect: q?1u joint_zero(*)"));
    let name = "q?1u joint_zero(*)".to_owned();
    assert_eq!(press(&mut state, KeyCode::Enter), [Action::Lab(LabRequest::AddNamed(name))]);
}

#[test]
fn the_scale_of_the_plots_follows_the_model_until_the_operator_steps_it() {
    let mut state = examined();
    let half = |state: &State| state.model.as_ref().map_or(0.0, |model| model.half_height_mm());
    let mut summary =
        state.model.as_ref().and_then(|model| model.summary.clone()).expect("the model was examined");
    let mut shrink_residuals = |state: &mut State| {
        for row in &mut summary.residuals.rows {
            row.size = row.size.map(|size| 0.4 * size);
        }
        update(state, Message::Lab(LabAnswer::Examined(Box::new(summary.clone()))));
    };
    let before = half(&state);
    shrink_residuals(&mut state);
    let followed = half(&state);
    assert!(followed < before, "what is left is seen as large as what was left before");
    press(&mut state, KeyCode::Char('f'));
    let stepped = half(&state);
    assert_eq!(stepped, 2.0 * followed);
    shrink_residuals(&mut state);
    assert_eq!(half(&state), stepped);
}

#[test]
fn long_work_of_the_lab_says_how_far_it_is_and_can_be_given_up() {
    let mut state = examined();
    assert_eq!(press(&mut state, KeyCode::Char('c')), [], "nothing is under way");
    let request = LabRequest::Preview("joint_compliance(shoulder)".to_owned());
    assert_eq!(press(&mut state, KeyCode::Char(' ')), [Action::Lab(request)]);
    update(&mut state, Message::LabProgress(0.5, "fitting with it".to_owned()));
    let shown = page(&state, 120, 40);
    assert!(shown.contains("50 % (fitting with it)"), "{shown}");
    assert_eq!(press(&mut state, KeyCode::Char('c')), [Action::CancelLab]);
    update(&mut state, Message::Lab(LabAnswer::GaveUp { judging: false }));
    assert!(page(&state, 120, 40).contains("Given up; the model is as it was."));
    let request = LabRequest::Preview("joint_compliance(shoulder)".to_owned());
    assert_eq!(press(&mut state, KeyCode::Char(' ')), [Action::Lab(request)], "it can be asked again");
    assert_eq!(
        press(&mut state, KeyCode::Esc),
        [Action::Stop, Action::CancelLab],
        "the stop key ends it too"
    );
}

#[test]
fn judging_that_was_given_up_is_taken_up_again_when_asked_for() {
    let mut state = examined();
    let mut summary = state.model.as_ref().and_then(|model| model.summary.clone()).expect("examined");
    summary.verdict.clear();
    update(&mut state, Message::Lab(LabAnswer::Compared(Box::new(summary))));
    assert_eq!(press(&mut state, KeyCode::Char('j')), [], "it is being judged");
    press(&mut state, KeyCode::Char('c'));
    update(&mut state, Message::Lab(LabAnswer::GaveUp { judging: true }));
    assert!(page(&state, 120, 40).contains("Judging was given up; j takes it up again."));
    assert_eq!(press(&mut state, KeyCode::Char('j')), [Action::Lab(LabRequest::Judge)]);
}

#[test]
fn one_gross_error_does_not_squash_the_plots() {
    let state = examined();
    let half = state.model.as_ref().map_or(0.0, |model| model.half_height_mm());
    assert!((0.3..2.0).contains(&half), "the plots are \u{b1}{half} mm high, the gross error is 9 mm");
    assert!(page(&state, 120, 40).contains("1 off"));
}

#[test]
fn every_key_of_the_table_is_found_in_its_context() {
    for binding in BINDINGS {
        for (modifiers, code) in binding.keys {
            let event = ratatui::crossterm::event::KeyEvent::new(*code, *modifiers);
            assert_eq!(command_for(&[binding.context], &event), Some(binding.command), "{}", binding.shown);
        }
    }
}

#[test]
fn the_manual_prints_the_key_table_as_it_is() {
    let manual = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../README.md"));
    let table = crate::screens::keys::manual_table();
    assert!(manual.contains(&table), "README.md should hold this table of keys:\n\n{table}");
}
