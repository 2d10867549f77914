//! What the record keeps of runs, and how it is got out again.

use std::fs;

use plumb_calibration::table::Table;

use crate::lab::Lab;

const LEVEL: &str = "  level: {what: spirit level on the hand, uncertainty_deg: 0.25}\n";
const INSTRUMENTS: &str =
    "  block: {what: gauge block 8 mm, serial: GB-17, uncertainty_mm: 0.0005, calibration_due: 2099-01-31}
  level: {what: spirit level, serial: 4711, uncertainty_deg: 0.01, calibration_due: 2020-02-29}
";

#[test]
fn operator_notes_and_instruments_are_kept_and_an_overdue_calibration_is_warned_of() {
    let lab = Lab::new();
    lab.edit("cell.yaml", LEVEL, INSTRUMENTS);
    let run = lab.plumb(&["run", "cell.yaml", "--operator", "ada", "--note", "after the belt was changed"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    assert!(
        run.out()
            .contains("the calibration of level (spirit level) was due on 2020-02-29: have it calibrated"),
        "{}",
        run.out()
    );
    assert!(!run.out().contains("gauge block"), "one that is not overdue is no warning: {}", run.out());
    assert_eq!(lab.plumb(&["note", "1", "belt", "tension", "42 N", "--operator", "bob"]).code(), 0);
    let shown = lab.plumb(&["show", "1"]).out();
    for line in [
        "by ada",
        "ada: after the belt was changed",
        "bob: belt tension 42 N",
        "gauge block 8 mm, no. GB-17, +- 0.0005 mm, calibrated until 2099-01-31",
        "spirit level, no. 4711, +- 0.01 deg, calibration OVERDUE since 2020-02-29",
    ] {
        assert!(shown.contains(line), "{line}: {shown}");
    }
    let json = lab.shown("1");
    assert_eq!(json["instruments"][0]["serial"], "GB-17");
    assert_eq!(json["notes"][1]["text"], "belt tension 42 N");
    let noted = lab.plumb(&["note", "9", "lost"]);
    assert_eq!(noted.code(), 2);
    assert!(noted.err().contains("there is no run 9"), "{}", noted.err());
}

#[test]
fn a_day_that_is_none_is_shown_where_it_is_written() {
    let lab = Lab::new();
    lab.edit("cell.yaml", LEVEL, &INSTRUMENTS.replace("2020-02-29", "2021-02-29"));
    let check = lab.plumb(&["check", "cell.yaml"]);
    assert_eq!(check.code(), 2, "{}", check.all());
    assert!(check.err().contains("`2021-02-29` is no day"), "{}", check.err());
    assert!(check.err().contains("as in 2027-03-31"), "{}", check.err());
}

#[test]
fn history_is_filtered_and_a_correction_is_followed_over_time() {
    let lab = Lab::new();
    assert_eq!(lab.plumb(&["run", "cell.yaml", "--operator", "ada"]).code(), 0);
    assert_eq!(lab.plumb(&["run", "cell.yaml", "--operator", "bob", "--set", "cycles=1"]).code(), 0);
    lab.edit("answers.yaml", "place: done", "place: {pose_deg: {shoulder: 50, elbow: -65}}");
    assert_eq!(lab.plumb(&["run", "cell.yaml", "--operator", "bob"]).code(), 1);
    let numbers = |arguments: &[&str]| -> Vec<i64> {
        let output = lab.plumb(&[&["history", "--json"], arguments].concat());
        let runs = output.out();
        runs.lines()
            .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap()["run"].as_i64().unwrap())
            .collect()
    };
    assert_eq!(numbers(&[]), [3, 2, 1]);
    assert_eq!(numbers(&["--operator", "bob"]), [3, 2]);
    assert_eq!(numbers(&["--ended", "failed"]), [3]);
    assert_eq!(numbers(&["--ended", "open"]), [] as [i64; 0]);
    assert_eq!(numbers(&["--until", "2020-01-01"]), [] as [i64; 0]);
    assert_eq!(numbers(&["--since", "2020-01-01", "--operator", "ada"]), [1]);
    let csv = lab.plumb(&["history", "--csv", "-n", "1"]).out();
    assert!(
        csv.starts_with("run,started,")
            && csv.contains("\n3,20")
            && csv.contains(",failed,teachmover,initialize,bob,"),
        "{csv}"
    );
    let day = lab.plumb(&["history", "--since", "yesterday"]);
    assert_eq!(day.code(), 2);
    assert!(day.err().contains("write year, month and day, as in 2026-11-21"), "{}", day.err());

    let trend = lab.plumb(&["history", "--trend", "arm.waist"]).out();
    assert!(trend.contains("joint zero of arm.waist, deg"), "{trend}");
    assert!(trend.contains("2 findings: mean 1.7") && trend.contains('●'), "{trend}");
    assert!(!trend.contains("of cell"), "one cell needs no name: {trend}");
    let csv = lab.plumb(&["history", "--trend", "arm.waist", "--csv"]).out();
    assert_eq!(csv.lines().count(), 3, "{csv}");
    let unknown = lab.plumb(&["history", "--trend", "arm.wrist"]);
    assert_eq!(unknown.code(), 2);
    assert!(
        unknown
            .err()
            .contains("no run found anything for arm.wrist; there is arm.elbow, arm.shoulder, arm.waist"),
        "{}",
        unknown.err()
    );
}

#[test]
fn what_two_cells_of_one_record_found_is_not_mixed() {
    let lab = Lab::new();
    let cell = fs::read_to_string(lab.path("cell.yaml")).unwrap();
    lab.write("second.yaml", &cell.replacen("cell: teachmover", "cell: second", 1));
    for (cell, line) in [("cell.yaml", "0"), ("cell.yaml", "1"), ("second.yaml", "3")] {
        let set = format!("line_a_deg={line}");
        assert_eq!(lab.plumb(&["run", cell, "waist-initialization", "--set", &set]).code(), 0);
    }
    let trend = lab.plumb(&["history", "--trend", "arm.waist"]).out();
    for title in
        ["joint zero of arm.waist of cell teachmover, deg", "joint zero of arm.waist of cell second, deg"]
    {
        assert!(trend.contains(title), "{trend}");
    }
    assert!(trend.contains("2 findings") && !trend.contains("3 findings"), "{trend}");
    let one = lab.plumb(&["history", "--trend", "arm.waist", "--cell", "second"]).out();
    assert!(one.contains("4.7000") && !one.contains("1.7000"), "{one}");
}

#[test]
fn the_numbers_of_a_run_come_out_as_csv_and_its_trigger_poses_as_a_table_the_model_lab_reads() {
    let lab = Lab::new();
    assert_eq!(lab.plumb(&["run", "cell.yaml"]).code(), 0);
    let csv = lab.plumb(&["show", "1", "--csv"]).out();
    assert!(csv.starts_with("kind,step,name,value,unit,uncertainty\n"), "{csv}");
    assert!(csv.contains("\nas_left,waist.apply_waist,joint_zero arm waist,1.7"), "{csv}");
    assert!(csv.contains("\nanswer,target,answers file,done,,"), "{csv}");

    for (how, name) in [(&["--as-left"][..], "left.csv"), (&[], "found.csv")] {
        let table = lab.plumb(&[&["show", "1", "--table"], how].concat());
        assert_eq!(table.code(), 0, "{}", table.all());
        lab.write(name, &table.out());
    }
    let table = Table::read(&lab.path("left.csv")).unwrap();
    assert_eq!((table.joints, table.len()), (5, 9), "line A, then four times the table and line B");
    let fit = |name: &str| {
        let output = lab.plumb(&[
            "model",
            "compare",
            "teachmover.model.yaml",
            "--data",
            name,
            "--free",
            "none",
            "--holdout",
            "none",
            "--json",
        ]);
        assert_eq!(output.code(), 0, "{}", output.all());
        let json: serde_json::Value = serde_json::from_str(&output.out()).unwrap();
        json["rms_mm"]["fit"].as_f64().unwrap()
    };
    assert!(fit("found.csv") > 1.0, "the zeros were wrong: {} mm", fit("found.csv"));
    assert!(fit("left.csv") < 0.01, "the zeros are right: {} mm", fit("left.csv"));
}

#[test]
fn a_run_whose_searches_say_nothing_of_what_they_find_has_no_table_and_says_why() {
    let lab = Lab::new();
    lab.edit("procedures/waist-initialization.yaml", "        finds: {on: line_a}\n", "");
    let run = lab.plumb(&["run", "cell.yaml", "waist-initialization"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let table = lab.plumb(&["show", "1", "--table"]);
    assert_eq!(table.code(), 2, "{}", table.all());
    assert!(table.err().contains("give searches `finds: {on: SURFACE, height_mm: ...}`"), "{}", table.err());
    lab.edit("procedures/shoulder-elbow-initialization.yaml", "finds: {on: line_b}", "finds: {on: line_c}");
    let check = lab.plumb(&["check", "cell.yaml"]);
    assert!(check.err().contains("the model of arm has no surface `line_c`"), "{}", check.err());
}

#[test]
fn a_certificate_is_one_file_with_the_machine_as_found_and_as_left() {
    let lab = Lab::new();
    lab.edit("cell.yaml", LEVEL, INSTRUMENTS);
    lab.edit("cell.yaml", "title: TeachMover over a T target", "title: TeachMover <no. 3> over a T target");
    let run = lab.plumb(&["run", "cell.yaml", "--operator", "ada & bob", "--note", "as <found>"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let output = lab.plumb(&["certificate", "1", "-o", "certificate.html"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let page = fs::read_to_string(lab.path("certificate.html")).unwrap();
    for part in [
        "<!DOCTYPE html>",
        "As found",
        "joint zero of arm waist",
        "+1.7000",
        "GB-17",
        "2020-02-29 (overdue)",
        "ada &amp; bob",
        "as &lt;found&gt;",
        "shoulder_elbow.cycle[4].edge",
        "SHA-256",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(
        !page.contains("http://") && !page.contains("https://") && !page.contains("<script"),
        "it needs nothing else"
    );

    lab.edit("answers.yaml", "place: done", "place: {pose_deg: {shoulder: 50, elbow: -65}}");
    assert_eq!(lab.plumb(&["run", "cell.yaml"]).code(), 1);
    let failed = lab.plumb(&["certificate", "2", "-o", "no.html"]);
    assert_eq!(failed.code(), 2);
    assert!(failed.err().contains("only a run that passed certifies something"), "{}", failed.err());
    assert!(!lab.path("no.html").exists());
}

#[test]
fn the_record_is_copied_whole_and_never_over_something() {
    let lab = Lab::new();
    assert_eq!(lab.plumb(&["run", "cell.yaml", "waist-initialization"]).code(), 0);
    fs::create_dir(lab.path("copy")).unwrap();
    let backup = lab.plumb(&["record", "backup", "copy/plumb.sqlite3"]);
    assert_eq!(backup.code(), 0, "{}", backup.all());
    let again = lab.plumb(&["record", "backup", "copy/plumb.sqlite3"]);
    assert_eq!(again.code(), 2);
    assert!(again.err().contains("is there already: give a new file for the copy"), "{}", again.err());
    let check = lab.plumb(&["record", "check", "--record", "copy"]);
    assert_eq!((check.code(), check.out().trim_end()), (0, "copy: sound; 1 run"));
    let original = lab.plumb(&["show", "1", "--json"]).out();
    assert_eq!(lab.plumb(&["show", "1", "--json", "--record", "copy"]).out(), original);
}
