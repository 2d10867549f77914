//! The Scan screen around a small cloud, a level plate of 40 x 30 mm with a block of 10 mm on it in ten stripes; and a scan that is paused.

#![allow(clippy::expect_used, reason = "a test that cannot go on has failed")]

use std::cell::Cell;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::process::Command;
use std::time::Instant;

use tempfile::TempDir;

use crate::bench::Bench;
use crate::plumb;
use crate::terminal::{Session, is_given_back};

/// Writes the cloud; its path.
fn cloud(folder: &TempDir) -> String {
    let mut points = String::new();
    for stripe in 0..10 {
        for row in 0..31 {
            let (x, y) = (f64::from(stripe) * 4.0, f64::from(row));
            let high = (3..6).contains(&stripe) && (10..20).contains(&row);
            let z = if high { 10.0 } else { 0.01 * f64::from((row * 7 + stripe * 3) % 5 - 2) };
            writeln!(points, "{x} {y} {z} {stripe} {row}").expect("text can be written");
        }
    }
    let head = "ply\nformat ascii 1.0\ncomment units mm\nelement vertex 310\nproperty float x\nproperty float y\n\
        property float z\nproperty float stripe\nproperty float row\nend_header\n";
    let path = folder.path().join("plate.ply");
    fs::write(&path, format!("{head}{points}")).expect("the cloud is written");
    path.display().to_string()
}

#[test]
fn a_stored_cloud_turns_is_measured_and_leaves_pictures() {
    let folder = TempDir::new().expect("a folder for the files");
    let path = cloud(&folder);
    let (program, folder_path) = (plumb(), folder.path().display().to_string());
    let arguments =
        ["-c", "cd \"$1\" && shift && exec \"$@\"", "sh", &folder_path, &program.display().to_string()];
    let arguments: Vec<&str> = arguments.iter().copied().chain(["stripe", "show", path.as_str()]).collect();
    let mut session = Session::start(std::path::Path::new("/bin/sh"), &arguments, 120, 30);
    session.wait_for("plate.ply \u{b7} 310 points, 10 stripes");
    session.wait_for("turn -30 deg, up 30 deg");
    session.press("\x1b[C");
    session.wait_for("turn 335 deg");
    session.press("]");
    session.wait_for("35 deg, at");
    // Edge-on, the plate is a band of some hundredths of a millimetre, whatever is on it.
    session.press("e");
    session.wait_for("band 0.040 mm thick");
    session.press("e");
    session.wait_for("turn 335 deg");
    // Straight down the cross is on the block's middle after a click there: distances are measured from it.
    session.press("vvvv");
    session.wait_for("up 90 deg");
    session.press("j");
    session.wait_for("cursor [");
    session.press("mllllllllll");
    session.wait_for("mm from the mark");
    session.press("x");
    session.wait_for("Picture saved: plate-view-1.png");
    session.press("X");
    session.wait_for("Picture saved: plate-view-2.png");
    for (name, width) in [("plate-view-1.png", 1280_u32), ("plate-view-2.png", 2560)] {
        let bytes = fs::read(folder.path().join(name)).expect("the picture is there");
        assert_eq!(bytes.get(16..20), Some(&width.to_be_bytes()[..]), "{name}");
    }
    session.press("q");
    assert!(session.wait_for_end().success());
    is_given_back(&session);
}

/// The least stripe that is reported until `text` is on the screen.
fn least_stripe_until(session: &Session, text: &str) -> usize {
    let least = Cell::new(usize::MAX);
    session.wait_until(text, |screen| {
        let contents = screen.contents();
        let numbers =
            contents.split("Stripe ").skip(1).filter_map(|rest| rest.split(' ').next()?.parse().ok());
        least.set(numbers.chain([least.get()]).min().unwrap_or(usize::MAX));
        contents.contains(text)
    });
    least.get()
}

#[test]
fn a_scan_that_is_stopped_and_paused_goes_on_where_it_was_and_takes_no_stripe_twice() {
    let bench = Bench::of("light-stripe");
    // Slowly enough to be stopped on the way.
    bench.edit("procedures/scan-pyramid.yaml", "speed: 0.03", "speed: 0.02");
    let mut session = bench.run(&["scan-pyramid", "--pace", "real"], 100, 30);
    session.wait_for("Stripe 3 of 21,");
    session.press("\x1b");
    session.wait_for("stopped by the operator");
    session.press("r");
    assert!(least_stripe_until(&session, "Stripe 9 of 21,") >= 3, "it goes on where it was");
    session.press("p");
    session.wait_for("paused by the operator");
    session.press("r");
    assert!(least_stripe_until(&session, "\u{2713} passed") >= 9, "it goes on where it was");
    session.press("q");
    assert_eq!(session.wait_for_end().exit_code(), 0);
    let table = |name: &str| {
        let path = bench.path("record/run-1").join(format!("pyramid.{name}.csv"));
        fs::read_to_string(path).expect("the scan is kept")
    };
    let poses = table("poses");
    let distinct: BTreeSet<&str> = poses.lines().skip(1).collect();
    assert_eq!((poses.lines().count() - 1, distinct.len()), (21, 21), "each place once:\n{poses}");
    let stripes = table("stripes");
    let seen: BTreeSet<&str> = stripes.lines().skip(1).filter_map(|line| line.split(',').next()).collect();
    assert_eq!(seen.len(), 21, "points of each");
}

#[test]
fn a_newcomer_has_time_to_see_a_scan_grow() {
    let bench = Bench::of("light-stripe");
    let mut session = bench.run(&["scan-pyramid", "--pace", "real"], 100, 30);
    session.wait_for("Stripe 2 of 21,");
    let begun = Instant::now();
    session.press("6");
    // A bar in the corner says how large it is.
    let page = session.wait_for("mm in the middle");
    assert!(page.contains(" points, ") && page.contains(" stripes"), "{page}");
    session.press("2");
    session.wait_for("\u{2713} passed");
    let seconds = begun.elapsed().as_secs_f64();
    assert!(seconds > 3.0, "over in {seconds:.1} s");
    session.press("q");
    assert_eq!(session.wait_for_end().exit_code(), 0);
}

/// Scans of the light-stripe cell whose stripe is bent, and the screen that looks at them.
fn stripes_screen(bench: &Bench) -> Session {
    bench.edit("world.yaml", "    width_mm: 1\n", "    width_mm: 1\n    bow: 0.01\n");
    let (cell, record) = (bench.path("cell/cell.yaml"), bench.path("record"));
    let mut gather = Command::new(plumb());
    gather.arg("run").arg(&cell).args(["gather", "--headless", "--record"]).arg(&record);
    assert!(gather.output().expect("plumb runs").status.success());
    let (cell, scans) = (cell.display().to_string(), record.join("run-1").display().to_string());
    Session::start(plumb(), &["stripe", "screen", &cell, "--scans", &scans], 120, 40)
}

#[test]
fn a_long_computation_about_stripes_is_given_up_at_once_and_taken_up_again() {
    let bench = Bench::of("light-stripe");
    let mut session = stripes_screen(&bench);
    // Before anything is fitted.
    session.wait_for("Fitting the model");
    session.press("c");
    session.wait_for("Given up before anything was fitted; j starts over.");
    session.press("j");
    // While candidates are judged.
    session.wait_for("Judging what could explain the rest");
    session.press("c");
    let page = session.wait_for("Judging was given up; j takes it up again.");
    assert!(!page.contains("named \u{b7} "), "nothing was judged:\n{page}");
    session.press("j");
    session.wait_for("named \u{b7} ");
    // While something is added: it is not added then.
    session.press("a");
    session.wait_for("Adding stripe_bow(sensor)");
    session.press("c");
    let page = session.wait_for("Given up; the model is as it was.");
    assert!(!page.contains("stripe_bow(sensor) added"), "{page}");
    session.press("q");
    assert!(session.wait_for_end().success());
    is_given_back(&session);
}

#[test]
fn what_the_matter_is_with_stripes_is_named_previewed_added_and_undone_on_the_model_screen() {
    let bench = Bench::of("light-stripe");
    let mut session = stripes_screen(&bench);
    let page = session.wait_for("named \u{b7} ");
    assert!(page.contains("stripe_bow"), "{page}");
    session.press("w");
    session.wait_for("(the worst of");
    assert!(session.text().contains("Stripe "), "a row is a stripe here: {}", session.text());
    session.press("W");
    session.wait_until_gone("the worst of");
    session.press(" ");
    session.wait_for("Preview: with stripe_bow(sensor) added");
    session.press("a");
    session.wait_for("stripe_bow(sensor) added");
    session.wait_until("judged anew", |screen| {
        let page = screen.contents();
        page.contains("at floor \u{b7} ") || page.contains("unknown \u{b7} ")
    });
    session.press("u");
    session.wait_for("named \u{b7} ");
    session.press("n");
    session.press("joint_nonsense(elbow)\r");
    session.wait_for("joint_nonsense");
    session.press("q");
    assert!(session.wait_for_end().success());
    is_given_back(&session);
}
