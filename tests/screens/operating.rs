//! An operator's work at the simulated TeachMover: from the first prompt to the corrections, stopping, leaving, resuming.

#![allow(clippy::expect_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::process::{Command, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::bench::Bench;
use crate::plumb;
use crate::terminal::{Session, is_given_back};

/// What the five prompts of the initialization ask, in their order.
const PROMPTS: [&str; 6] = [
    "Lay the T target on the table",
    "Set the hand with the teach pendant",
    "How far from straight down does it point",
    "Bring the hand over the white paper",
    "zero of waist",
    "zero of shoulder",
];

/// Answers the first `count` prompts with Enter alone.
fn answer(session: &mut Session, count: usize) {
    for prompt in &PROMPTS[..count] {
        session.wait_for(prompt);
        session.press("\r");
    }
}

#[test]
fn a_new_user_finishes_an_initialization_with_enter_alone() {
    let bench = Bench::new();
    let mut session = bench.run(&["--pace", "fast"], 80, 24);
    answer(&mut session, PROMPTS.len());
    let page = session.wait_for("\u{2713} passed");
    for correction in ["\u{2713} waist zero", "\u{2713} shoulder zero", "\u{2713} elbow zero"] {
        assert!(page.contains(correction), "{correction} is in force:\n{page}");
    }
    session.press("4");
    session.wait_for("Runs (1)");
    session.wait_for("waist zero of arm, deg");
    session.press("\r");
    let page = session.wait_for("joint zero of arm waist");
    assert!(page.contains("corrections"), "one run in full:\n{page}");
    session.press("\x7f");
    session.wait_for("Runs (1)");
    session.press("q");
    assert_eq!(session.wait_for_end().exit_code(), 0);
    is_given_back(&session);
}

#[test]
fn every_ordinary_cell_refuses_a_forearm_too_far_from_vertical_and_says_why() {
    for cell in ["cell.yaml", "cell-backlash.yaml"] {
        let bench = Bench::new();
        let mut session = bench.run_cell(cell, &["--pace", "fast"], 100, 30);
        answer(&mut session, 3);
        session.wait_for(PROMPTS[3]);
        // Waist, shoulder, elbow: the forearm outwards by steps of ten degrees.
        session.press("\x1b[B");
        session.press("\x1b[B");
        session.press("]");
        session.press("]");
        session.wait_for("jog by 10 deg");
        session.press("\x1b[C");
        session.wait_for("elbow          -69.");
        session.press("\r");
        let page = session.wait_for("b  Go back to \u{201c}Bring the hand");
        for reason in ["The forearm is at", "17.25", "strike"] {
            assert!(page.contains(reason), "{reason}:\n{page}");
        }
        // Past doing it again, moving the arm, going back and leaving it out: ending the run.
        session.press("\x1b[B\x1b[B\x1b[B\x1b[B");
        session.wait_for("\u{25b8} a  Abort the run");
        session.press("\r");
        session.wait_for("\u{2717} failed");
        session.press("q");
        assert_eq!(session.wait_for_end().exit_code(), 1);
    }
}

#[test]
fn a_click_jogs_nothing_and_answers_only_on_the_button() {
    let bench = Bench::new();
    let mut session = bench.run(&["--pace", "fast"], 80, 24);
    let page = session.wait_for(PROMPTS[0]);
    session.click_on("The target is in place");
    session.wait_for(PROMPTS[1]);
    assert!(page.contains("The target is in place"));
    session.click_on("4 History");
    session.wait_for("not ended");
}

#[test]
fn the_stop_key_stops_the_arm_in_mid_motion_and_only_resume_moves_it_again() {
    let bench = Bench::new();
    let mut session = bench.run(&["--pace", "real"], 100, 30);
    answer(&mut session, 4);
    session.wait_for("\u{25b8} moving");
    session.press("\x1b");
    session.wait_for("stopped by the operator");
    session.wait_for("arm at rest");
    session.press("\r");
    session.press("1");
    session.wait_for("Arm from the side");
    session.press("2");
    session.wait_for("Nothing moves until you press r to resume.");
    session.press("r");
    session.wait_for(PROMPTS[4]);
}

/// The waist's angle as the page shows it beside the joint to be jogged.
fn waist(page: &str) -> f64 {
    let line = page.lines().find(|line| line.contains("\u{25b8} waist")).expect("the waist is chosen");
    let number = line.split("\u{25b8} waist").nth(1).and_then(|rest| rest.split_whitespace().next());
    number.and_then(|number| number.parse().ok()).expect("an angle")
}

#[test]
fn a_jog_key_held_down_leaves_nothing_queued_and_esc_leaves_no_live_prompt() {
    let bench = Bench::new();
    let mut session = bench.run(&["--pace", "real"], 100, 40);
    answer(&mut session, 3);
    session.wait_for(PROMPTS[3]);
    let page = session.wait_for("clear of the table");
    assert!(page.contains("left of line A"), "which side is white is said:\n{page}");
    session.press("]]");
    session.wait_for("jog by 10 deg");
    let before = waist(&session.text());
    // As a key held down: a hundred presses at once.
    session.press(&"\x1b[D".repeat(100));
    session.wait_for("arm moving");
    session.wait_for("arm at rest");
    std::thread::sleep(std::time::Duration::from_secs(3));
    let after = waist(&session.text());
    assert!(
        (before - after - 10.0).abs() < 0.1 || (before - after - 20.0).abs() < 0.1,
        "{before} -> {after}"
    );

    // Enter while it moves is not queued behind the motion.
    session.press("\x1b[C");
    session.wait_for("arm moving");
    session.press("\r");
    session.wait_for("still moving when you answered");
    session.wait_for("arm at rest");

    session.press("\x1b[D");
    session.wait_for("arm moving");
    session.press("\x1b");
    let page = session.wait_for("Nothing moves until you press r to resume.");
    assert!(!page.contains("the arm is in position"), "no prompt looks live:\n{page}");
    session.press("r");
    session.wait_for("the arm is in position");
}

#[test]
fn who_jogs_through_the_table_is_warned_and_shown_the_height_without_colours_too() {
    let bench = Bench::new();
    let mut session = bench.run_cell("cell.yaml", &["--pace", "fast"], 100, 40);
    answer(&mut session, 3);
    session.wait_for(PROMPTS[3]);
    session.press("\x1b[B");
    session.press("]]");
    session.wait_for("jog by 10 deg");
    session.press("\x1b[D");
    session.wait_for("shoulder        33.4");
    session.press("\x1b[D");
    let page = session.wait_for("Is the way free?");
    assert!(page.contains("past the table") && page.contains("Stay where it is"), "{page}");
    session.press("\r");
    // Asked again, it has the same joint and the same step chosen.
    session.wait_for("jog by 10 deg");
    session.press("\x1b[D");
    session.wait_for("Is the way free?");
    session.press("\x1b[B\r");
    session.wait_for("jog by 10 deg");
    session.press("\x1b[D");
    session.wait_for("BEYOND the table");
}

#[test]
fn the_stop_key_works_from_inside_help_and_prompts() {
    let bench = Bench::new();
    let mut session = bench.run(&["--pace", "real"], 80, 24);
    session.wait_for(PROMPTS[0]);
    session.press("?");
    session.wait_for("Esc stops every robot at once");
    session.press("\x1b");
    session.wait_for("stopped by the operator");
    session.wait_until_gone("Esc stops every robot at once");
    session.press("r");
    session.wait_for(PROMPTS[0]);
    session.press("\x1b");
    session.wait_for("stopped by the operator");
}

#[test]
fn a_run_that_is_kept_goes_on_where_it_was_left_once_the_pose_is_confirmed() {
    let bench = Bench::new();
    let mut session = bench.run(&["--pace", "fast"], 100, 30);
    answer(&mut session, 4);
    session.wait_for(PROMPTS[4]);
    session.press("q");
    session.wait_for("A run is open.");
    session.press("k");
    assert_eq!(session.wait_for_end().exit_code(), 4);
    session.wait_for("is kept; go on with: plumb run --resume");
    is_given_back(&session);

    let mut session = bench.run(&["--pace", "fast", "--resume"], 100, 30);
    session.wait_for("Is the arm where the run stopped?");
    session.press("\r");
    session.wait_for(PROMPTS[4]);
    session.press("a");
    session.wait_for("Abort the run?");
    session.press("y");
    session.wait_for("\u{25a0} aborted");
    session.press("q");
    assert_eq!(session.wait_for_end().exit_code(), 3);
}

#[test]
fn a_run_is_watched_in_one_terminal_and_answered_from_another() {
    let bench = Bench::new();
    let cell = bench.path("cell/cell.yaml").display().to_string();
    let record = bench.path("record").display().to_string();
    let mut run = Command::new(plumb());
    run.args(["run", &cell, "--attended", "--record", &record]).stdout(Stdio::null()).stderr(Stdio::null());
    let mut run = run.spawn().expect("the run starts");
    let answer = |words: &[&str]| {
        let mut command = Command::new(plumb());
        command.args(["answer", "--record", &record]).args(words).stdout(Stdio::null()).stderr(Stdio::null());
        command.status().expect("plumb answers").success()
    };
    while !answer(&[]) {
        assert!(run.try_wait().expect("the run is there").is_none(), "the run ended before it asked");
    }
    let mut session = Session::start(plumb(), &["watch", "1", "--record", &record], 80, 24);
    session.wait_for(PROMPTS[0]);
    assert!(answer(&["done"]));
    session.wait_for(PROMPTS[1]);
    kill(Pid::from_raw(run.id().cast_signed()), Signal::SIGTERM).expect("the run takes signals");
    run.wait().expect("the run ends");
    session.wait_for("\u{25a0} aborted");
    session.press("q");
    assert!(session.wait_for_end().success());
}

#[test]
fn a_termination_stops_the_arm_gives_the_terminal_back_and_keeps_the_run() {
    let bench = Bench::new();
    let mut session = bench.run(&["--pace", "real"], 80, 24);
    answer(&mut session, 4);
    session.wait_for("\u{25b8} moving");
    kill(Pid::from_raw(session.process()), Signal::SIGTERM).expect("the program takes signals");
    assert_eq!(session.wait_for_end().exit_code(), 4);
    session.wait_for("is kept");
    is_given_back(&session);
}

#[test]
fn without_colours_the_screen_has_none() {
    let bench = Bench::new();
    let cell = bench.path("cell/cell.yaml").display().to_string();
    let record = bench.path("record").display().to_string();
    let session =
        Session::start_with(plumb(), &["run", &cell, "--record", &record], &[("NO_COLOR", "1")], 80, 24);
    session.wait_for(PROMPTS[0]);
    session.with_screen(|screen| {
        for row in 0..24 {
            for column in 0..80 {
                let cell = screen.cell(row, column).expect("the cell is on the screen");
                assert_eq!((cell.fgcolor(), cell.bgcolor()), (vt100::Color::Default, vt100::Color::Default));
            }
        }
    });
}

#[test]
fn a_taught_program_runs_once_it_was_asked_for_twice_and_gives_the_arm_back_at_its_end() {
    let bench = Bench::new();
    let mut session = bench.run_cell("cell-taught.yaml", &["--pace", "fast"], 100, 30);
    session.wait_for("Then press h twice: the taught program runs.");
    session.press("h");
    session.wait_for("From then on nothing stops the arm");
    session.press("h");
    session.wait_for("the pendant has given the arm back");
    // The last point of the program: 800 half-steps of 7072 a turn up.
    session.wait_for("shoulder        40.7");
    session.press("\r");
    session.wait_for("\u{2713} passed");
    session.press("5");
    let page = session.wait_for("the taught program has ended");
    assert!(page.contains("from here on only the STOP key on the pendant stops"), "{page}");
    assert!(page.contains("nod.csv are taught to the controller"), "{page}");
}

/// A procedure that asks for a number and a choice and moves nothing.
const ASKING: &str = "procedure: ask
title: Set the sensor up
steps:
  - id: gauge
    title: Read the gauge
    do:
      prompt:
        text: Put the gauge block under the hand and read its height.
        number: {unit: mm, minimum: 7, maximum: 9}
  - id: paper
    title: Which paper
    do:
      prompt:
        text: Which paper lies under the target?
        choice: {white: White copy paper, grey: Grey board}
        default: white
  - id: maker
    title: Who made it
    do:
      prompt:
        text: Who made the paper, and how heavy is it?
        write: {longest: 20}
";

#[test]
fn a_wrong_answer_is_refused_in_words_and_the_right_one_taken() {
    let bench = Bench::new();
    let folder = bench.path("cell");
    fs::write(folder.join("procedures/ask.yaml"), ASKING).expect("the procedure is written");
    let cell = fs::read_to_string(folder.join("cell.yaml")).expect("the cell can be read");
    // The list of procedures goes on in lines of its own, and is before the answers at the end of the file.
    let (kept, _) = cell.split_once("procedures:").expect("the cell names its procedures");
    let cell = format!("{kept}procedures: [procedures/ask.yaml]\n");
    fs::write(folder.join("cell-ask.yaml"), cell).expect("the cell is written");
    let mut session = bench.run_cell("cell-ask.yaml", &["--pace", "fast"], 80, 24);
    session.wait_for("Put the gauge block under the hand");
    session.press("12\r");
    session.wait_for("12 mm is too large: between 7 and 9 mm");
    session.press("\x7f\x7f8,02\r");
    session.wait_for("Which paper lies under the target?");
    session.press("\x1b[B\r");
    session.wait_for("Who made the paper, and how heavy is it?");
    session.press("\r");
    session.wait_for("Nothing is written: write a line.");
    // Letters that are keys elsewhere, one too many, and one taken back.
    session.press("pqrs 80 g, quite heavy\x7f!");
    session.wait_for("pqrs 80 g, quite he!");
    session.press("\x7fa\r");
    session.wait_for("\u{2713} passed");
    session.press("4");
    session.wait_for("Runs (1)");
    session.press("\r");
    let page = session.wait_for("grey by ada");
    assert!(page.contains("8.02 by ada"), "the record keeps what was answered:\n{page}");
    assert!(page.contains("pqrs 80 g, quite hea by ada"), "the record keeps what was written:\n{page}");
}

#[test]
fn one_key_leaves_all_readings_of_simulated_instruments_to_the_program() {
    let bench = Bench::of("ur5");
    let mut session = bench.run(&["--pace", "fast"], 80, 24);
    let page = session.wait_for("What does the tracker show for x");
    assert!(page.contains("Simulated: read already, Enter takes it."), "{page}");
    session.press("s");
    // 180 readings of 60 poses.
    session.wait_for("\u{2713} passed");
    session.press("q");
    assert_eq!(session.wait_for_end().exit_code(), 0);
    let record = bench.path("record").display().to_string();
    let shown = Command::new(plumb()).args(["show", "1", "--record", &record]).output().expect("it starts");
    let shown = String::from_utf8_lossy(&shown.stdout).into_owned();
    assert_eq!(shown.matches("simulated operator, for ada").count(), 180, "{shown}");
}
