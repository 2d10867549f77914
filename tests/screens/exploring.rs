//! The Model screen around a small made-up machine: its shoulder is half a degree off.

#![allow(clippy::expect_used, reason = "a test that cannot go on has failed")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use tempfile::TempDir;

use crate::plumb;
use crate::terminal::Session;

const MODEL: &str = "arm: two-link
convention: distal
joints:
  - {name: waist, a_mm: 0, alpha_deg: 90, d_mm: 300, theta_deg: 0}
  - {name: shoulder, a_mm: 400, alpha_deg: 0, d_mm: 0, theta_deg: 0}
  - {name: elbow, a_mm: 300, alpha_deg: 0, d_mm: 0, theta_deg: 0}
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
free: []
effects: []
measured_from: world
noise: {p1_mm: 0.02}
";

/// Writes the model and measurements of that machine.
pub(crate) fn machine(folder: &Path) -> [String; 2] {
    let mut table = String::from("q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n");
    let mut random = 1_u32;
    let mut noise = || {
        // Twelve numbers between 0 and 1, less their mean: a variance of 1. The generator is Numerical Recipes' own.
        let sum: f64 = (0..12)
            .map(|_| {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(random) / f64::from(u32::MAX)
            })
            .sum();
        0.02 * (sum - 6.0)
    };
    for pose in 0..60_u32 {
        let angle = |step: u32, width: f64| (f64::from(pose * step % 61) / 60.0 - 0.5) * width;
        let (waist, shoulder, elbow) = (angle(17, 240.0), angle(23, 120.0), angle(37, 200.0));
        let (first, second) = ((shoulder + 0.5).to_radians(), (shoulder + 0.5 + elbow).to_radians());
        let out = 400.0 * first.cos() + 300.0 * second.cos();
        let (x, y) = (out * waist.to_radians().cos() + noise(), out * waist.to_radians().sin() + noise());
        let z = 300.0 + 400.0 * first.sin() + 300.0 * second.sin() + noise();
        writeln!(table, "{waist:.4},{shoulder:.4},{elbow:.4},{x:.4},{y:.4},{z:.4}")
            .expect("text can be written");
    }
    let [model, data] = ["model.yaml", "table.csv"].map(|name| folder.join(name));
    fs::write(&model, MODEL).expect("the model file is written");
    fs::write(&data, table).expect("the table is written");
    [model, data].map(|path| path.display().to_string())
}

#[test]
fn a_hidden_error_is_named_previewed_added_and_undone() {
    let folder = TempDir::new().expect("a folder for the files");
    let [model, data] = machine(folder.path());
    let mut session = Session::start(plumb(), &["model", "screen", &model, "--data", &data], 120, 40);
    let page = session.wait_for("named \u{b7} model.yaml");
    assert!(page.contains("joint_zero shoulder"), "{page}");
    session.press(" ");
    session.wait_for("Preview: with joint_zero(shoulder) added");
    session.press("a");
    let page = session.wait_for("at floor \u{b7} model.yaml");
    assert!(page.contains("joint_zero(shoulder)"), "the waterfall names what was added:\n{page}");
    assert!(folder.path().join("model.rev1.yaml").exists(), "what was added is written as the next revision");
    session.press("u");
    session.wait_for("named \u{b7} model.yaml");
    assert!(
        folder.path().join("model.rev2.yaml").exists(),
        "what was undone is written as the next revision"
    );
    session.press("n");
    session.press("joint_nons\tense(elbow)\r");
    session.wait_for("joint_nonsense");
    session.press("q");
    assert!(session.wait_for_end().success());
}

#[test]
fn the_own_plot_comes_first_enter_opens_details_and_the_worst_row_is_found_by_its_line() {
    let folder = TempDir::new().expect("a folder for the files");
    let [model, data] = machine(folder.path());
    // Somebody typed the x of the 30th pose wrongly: line 31 of the file.
    let table = fs::read_to_string(&data).expect("the table is read");
    let mut lines: Vec<String> = table.lines().map(str::to_owned).collect();
    let mut cells: Vec<String> = lines[30].split(',').map(str::to_owned).collect();
    let x: f64 = cells[3].parse().expect("x is a number");
    cells[3] = format!("{:.4}", x + 25.0);
    lines[30] = cells.join(",");
    fs::write(&data, lines.join("\n") + "\n").expect("the table is written");
    for (columns, rows) in [(80, 24), (120, 40), (200, 60)] {
        let mut session =
            Session::start(plumb(), &["model", "screen", &model, "--data", &data], columns, rows);
        let page = session.wait_for("Explainable");
        let first = page.lines().nth(1).expect("a line below the tabs");
        assert!(
            first.contains("Error") && first.contains("RMS"),
            "how large the error is comes first:\n{page}"
        );
        let page = session.wait_for("joint_zero(shoulder");
        // Three joints' names leave no room for the long form on 80 columns.
        let worst = if columns == 80 { "worst 31" } else { "worst lines 31" };
        assert!(page.contains("Explainable") && page.contains(worst), "{page}");
        let page = session.wait_for("named \u{b7} model.yaml");
        assert!(page.contains("shoulder, deg"), "what drives it goes across:\n{page}");
        session.press("\r");
        let page = session.wait_for("To see it:");
        assert!(page.contains("joint_zero(shoulder)") && page.contains("Size"), "{page}");
        session.press("\r");
        session.wait_until_gone("To see it:");
        session.press("w");
        let page = session.wait_for("Line 31 (the worst of 60)");
        assert!(page.contains("shoulder") && page.contains("deg"), "{page}");
        session.press("q");
        assert!(session.wait_for_end().success());
    }
}

#[test]
fn a_rejected_candidate_is_added_only_after_a_question() {
    let folder = TempDir::new().expect("a folder for the files");
    let [model, data] = machine(folder.path());
    let mut session = Session::start(plumb(), &["model", "screen", &model, "--data", &data], 120, 40);
    session.wait_for("named \u{b7} model.yaml");
    session.press("\x1b[B");
    session.wait_for("not named:");
    session.press("a");
    let page = session.wait_for("Add what was not named?");
    assert!(page.contains("was not named:"), "{page}");
    session.press("n");
    session.wait_until_gone("Add what was not named?");
    assert!(!folder.path().join("model.rev1.yaml").exists(), "nothing was written");
    session.press("a");
    session.wait_for("Add what was not named?");
    session.press("y");
    session.wait_for("added; revision 1");
    assert!(folder.path().join("model.rev1.yaml").exists());
    session.press("q");
    assert!(session.wait_for_end().success());
}

#[test]
fn a_name_that_the_lab_would_not_name_is_added_only_after_a_question() {
    let folder = TempDir::new().expect("a folder for the files");
    let [model, data] = machine(folder.path());
    let mut session = Session::start(plumb(), &["model", "screen", &model, "--data", &data], 120, 40);
    session.wait_for("named \u{b7} model.yaml");
    session.press("n");
    session.press("link_offset(elbow)\r");
    session.wait_for("link_offset(elbow) was not named:");
    session.press("n");
    session.wait_until_gone("Add what was not named?");
    assert!(!folder.path().join("model.rev1.yaml").exists(), "nothing was written");
    // Numbers of a kind that are freed claim nothing.
    session.press("n");
    session.press("link_length(*)\r");
    session.wait_for("added; revision 1");
    session.press("q");
    assert!(session.wait_for_end().success());
}

#[test]
fn a_revision_that_cannot_be_written_is_reported_and_leaves_the_model_as_it_was() {
    let folder = TempDir::new().expect("a folder for the files");
    let [model, data] = machine(folder.path());
    let mut session = Session::start(plumb(), &["model", "screen", &model, "--data", &data], 120, 40);
    session.wait_for("named \u{b7} model.yaml");
    fs::remove_dir_all(folder.path()).expect("the folder is taken away");
    session.press("a");
    let page = session.wait_for("model.rev1.yaml");
    assert!(page.contains('\u{2717}') && !page.contains("added; revision"), "{page}");
    session.press("\r");
    session.wait_for("To see it:");
    session.press("\rq");
    assert!(session.wait_for_end().success());
}

#[test]
fn a_table_that_does_not_fit_is_refused_before_the_screen_opens() {
    let folder = TempDir::new().expect("a folder for the files");
    let [model, data] = machine(folder.path());
    fs::write(&data, "q1_deg,p1_x_mm\n1,wide\n").expect("the table is written");
    let mut session = Session::start(plumb(), &["model", "screen", &model, "--data", &data], 120, 24);
    assert_eq!(session.wait_for_end().exit_code(), 2);
    session.wait_for("plumb:");
    assert!(!session.with_screen(vt100::Screen::alternate_screen));
}
