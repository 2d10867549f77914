//! Corrections after the run: their uncertainties, the certificate, and the way back.

use std::fs;

use plumb_record::CellLock;

use crate::lab::{CommandOutput, Lab};

/// Says what a command refused, which must not be a crash.
fn refused(output: &CommandOutput) -> String {
    assert_eq!(output.code(), 2, "{}", output.all());
    output.err()
}

#[test]
fn a_bad_zero_is_brought_back_by_its_revision_and_the_next_run_drives_by_it() {
    let lab = Lab::new();
    assert_eq!(lab.plumb(&["run", "cell.yaml", "waist-initialization"]).code(), 0);
    assert_eq!(lab.plumb(&["run", "cell.yaml", "waist-initialization", "--set", "line_a_deg=3"]).code(), 0);
    let listed = lab.plumb(&["record", "zeros", "teachmover"]).out();
    assert!(listed.contains("arm of cell teachmover: in force now"), "{listed}");
    assert!(
        listed.contains("joint zero of waist              4.7000 deg"),
        "the second run was given a wrong line: {listed}"
    );
    let back = lab.plumb(&["record", "rollback", "teachmover", "1"]);
    assert_eq!(back.code(), 0, "{}", back.all());
    assert!(
        back.out().contains("revision 3 is in force: arm of cell teachmover as at revision 1"),
        "{}",
        back.out()
    );
    assert!(back.out().contains("4.7000 ->     1.7000 deg (± "), "{}", back.out());

    let trend = lab.plumb(&["history", "--trend", "arm.waist"]).out();
    let states: Vec<&str> = trend
        .lines()
        .filter_map(|line| line.split_whitespace().find(|word| ["now", "was", "never"].contains(word)))
        .collect();
    assert_eq!(states, ["was", "was", "now"], "one value is in force: {trend}");

    assert_eq!(lab.plumb(&["run", "cell.yaml", "waist-initialization"]).code(), 0);
    let found = lab.shown("3")["corrections"][0]["old"].as_f64().unwrap();
    assert!((found - 1.7).abs() < 1e-3, "the next run began with {found}");
}

#[test]
fn a_roll_back_that_cannot_be_says_why_and_changes_nothing() {
    let lab = Lab::new();
    assert!(
        refused(&lab.plumb(&["record", "zeros", "teachmover"]))
            .contains("nothing was ever corrected in a cell `teachmover`")
    );
    assert_eq!(lab.plumb(&["run", "cell.yaml", "waist-initialization"]).code(), 0);
    let of_another = refused(&lab.plumb(&["record", "rollback", "teachmove", "1"]));
    assert!(of_another.contains("did you mean `teachmover`?"), "{of_another}");
    let unknown = refused(&lab.plumb(&["record", "rollback", "teachmover", "9"]));
    assert!(unknown.contains("cell teachmover has no revision 9: there is only `1`"), "{unknown}");
    let same = refused(&lab.plumb(&["record", "rollback", "teachmover", "1"]));
    assert!(same.contains("nothing to bring back"), "{same}");
    let word = refused(&lab.plumb(&["record", "rollback", "teachmover", "first"]));
    assert!(word.contains("invalid value 'first'"), "{word}");

    let held = CellLock::take(&lab.state(), "teachmover").unwrap();
    let running = refused(&lab.plumb(&["record", "rollback", "teachmover", "0"]));
    assert!(
        running.contains("already run by another plumb") && running.contains(&std::process::id().to_string()),
        "{running}"
    );
    drop(held);
    assert_eq!(lab.plumb(&["record", "rollback", "teachmover", "0"]).code(), 0);
    assert_eq!(lab.plumb(&["record", "zeros", "teachmover", "--json"]).out().lines().count(), 2);
}

#[test]
fn a_certificate_says_that_it_is_simulated_what_was_skipped_and_what_each_uncertainty_is_made_of() {
    let lab = Lab::new();
    lab.edit(
        "procedures/initialize.yaml",
        "  - id: place\n",
        "  - {id: look, do: {move: {robot: arm, by_deg: {waist: 500}}}, on_error: skip}\n  - id: place\n",
    );
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let last = run.out().lines().last().unwrap_or_default().to_owned();
    assert!(last.contains("run 1 passed: 1 step skipped: look; all others passed"), "{last}");
    let history = lab.plumb(&["history"]).out();
    assert!(history.contains("passed, 1 skipped"), "{history}");

    assert_eq!(lab.plumb(&["certificate", "1", "-o", "c.html"]).code(), 0);
    let page = fs::read_to_string(lab.path("c.html")).unwrap();
    for part in [
        "<b>SIMULATED</b>",
        "<b>passed, 1 step skipped: look</b>",
        "Uncertainty budgets",
        "line B off its distance",
        "cell file: tolerances.target_mm",
        "shoulder and elbow are correlated",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let powers = page.contains("0.0e0") || (0..10).any(|digit| page.contains(&format!("e-{digit}")));
    assert!(!powers, "numbers as people write them");
    let shown = lab.plumb(&["show", "1"]).out();
    assert!(shown.contains("line B off its distance") && shown.contains("are correlated"), "{shown}");
}

#[test]
fn without_what_the_cell_knows_of_its_parts_an_uncertainty_is_not_determined() {
    let lab = Lab::new();
    lab.edit("cell.yaml", "  target_mm: 1 ", "  # target_mm: 1 ");
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    assert!(run.out().contains("(± not determined)"), "{}", run.out());
    assert_eq!(lab.plumb(&["certificate", "1", "-o", "c.html"]).code(), 0);
    let page = fs::read_to_string(lab.path("c.html")).unwrap();
    assert!(page.contains("the cell file gives no `tolerances.target_mm`"), "{page}");

    lab.edit("cell.yaml", "  # target_mm: 1 ", "  tagret_mm: 1 ");
    let check = refused(&lab.plumb(&["check", "cell.yaml"]));
    assert!(check.contains("no procedure of the cell uses a tolerance `tagret_mm`"), "{check}");
    assert!(check.contains("did you mean `target_mm`?"), "{check}");
}

#[test]
fn a_table_of_another_cells_run_is_not_taken_for_this_model() {
    let lab = Lab::new();
    assert_eq!(lab.plumb(&["run", "cell.yaml"]).code(), 0);
    assert_eq!(lab.plumb(&["run", "cell-other-arm.yaml"]).code(), 0);
    let table = lab.plumb(&["show", "--cell", "teachmover", "--table"]);
    assert_eq!(table.code(), 0, "{}", table.all());
    assert!(
        table.out().starts_with("# cell: teachmover\n# run: 1\n# model: teachmover.model.yaml\n"),
        "{}",
        table.out()
    );
    lab.write("table.csv", &table.out());
    let compare = |model: &str, more: &[&str]| {
        let common =
            ["model", "compare", model, "--data", "table.csv", "--free", "none", "--holdout", "none"];
        lab.plumb(&[&common, more].concat())
    };
    assert_eq!(compare("teachmover.model.yaml", &[]).code(), 0);
    let other = refused(&compare("other-arm.model.yaml", &[]));
    assert!(
        other.contains("measured with another model, teachmover.model.yaml (cell teachmover, run 1)"),
        "{other}"
    );
    assert_eq!(compare("other-arm.model.yaml", &["--any-model"]).code(), 0);
    fs::copy(lab.path("teachmover.model.yaml"), lab.path("mine.yaml")).unwrap();
    assert_eq!(compare("mine.yaml", &[]).code(), 0, "the same model under another name");

    let none = refused(&lab.plumb(&["show", "--cell", "puma"]));
    assert!(none.contains("no such runs of cell puma in"), "{none}");
}

#[test]
fn what_is_printed_to_go_on_with_names_the_record_that_was_given() {
    let lab = Lab::new();
    lab.edit("answers.yaml", "  place: done\n", "");
    let run = lab.plumb(&["run", "cell.yaml", "--record", "my record"]);
    assert_eq!(run.code(), 4, "{}", run.all());
    lab.edit(
        "procedures/initialize.yaml",
        "  - id: place\n",
        "  - {id: no_way, do: {move: {robot: arm, by_deg: {waist: 500}}}, on_error: abort}\n  - id: place\n",
    );
    lab.edit("answers.yaml", "  hand: done\n", "  hand: done\n  place: done\n");
    let run = lab.plumb(&["run", "cell.yaml", "--record", "my record"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.out().contains("--resume 1 --record 'my record'"), "{}", run.out());
    // So do the errors and the hints of the commands that look back.
    let asked: [(&[&str], &str); 4] = [
        (&["show", "99"], "`plumb history --record 'my record'`"),
        (&["certificate", "1", "-o", "c.html"], "`plumb show 1 --record 'my record'`"),
        (&["show", "--cell", "nowhere"], "`plumb history --record 'my record'`"),
        (&["queue", "list"], "`plumb queue add CELL --record 'my record'`"),
    ];
    for (command, hint) in asked {
        let output = lab.plumb(&[command, &["--record", "my record"]].concat());
        assert!(output.all().contains(hint), "{command:?}: {}", output.all());
    }
}
