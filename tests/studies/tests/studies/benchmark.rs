//! The benchmark of the diagnosis beside its peers.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn studies(arguments: &[&str], directory: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plumb-studies")).args(arguments).current_dir(directory).output().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_cell_of_the_benchmark_that_is_not_there_is_refused_with_those_that_are() {
    let home = tempfile::tempdir().unwrap();
    let refused = studies(&["benchmark", "--cell", "x"], home.path());
    assert_eq!(refused.status.code(), Some(2));
    assert!(errors(&refused).contains("there is no cell `x`; known are nothing"), "{}", errors(&refused));
}

#[test]
fn the_benchmark_runs_and_writes_its_figures() {
    let home = tempfile::tempdir().unwrap();
    let run = studies(
        &["benchmark", "--cell", "one-3x", "--analyst", "forward-bic", "--scale", "0.01", "--json", "f.json"],
        home.path(),
    );
    assert_eq!(run.status.code(), Some(0), "{}", errors(&run));
    let figures: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(home.path().join("f.json")).unwrap()).unwrap();
    assert_eq!(figures["rows"][0]["trials"], 10);
    assert!(figures["rows"][0]["shares"]["truth_first"]["count"].as_u64().unwrap() >= 5);
}

#[test]
fn the_benchmark_measures_on_where_candidates_are_tied() {
    let home = tempfile::tempdir().unwrap();
    let asked = ["benchmark", "--ties", "--cell", "one-1x-narrow", "--scale", "0.04", "--json", "f.json"];
    let run = studies(&asked, home.path());
    assert_eq!(run.status.code(), Some(0), "{}", errors(&run));
    let figures: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(home.path().join("f.json")).unwrap()).unwrap();
    let row = &figures["rows"][0];
    let ties = row["ties"].as_u64().unwrap();
    assert!(ties >= 1 && ties < row["trials"].as_u64().unwrap(), "{row}");
    let trials = |way: &str| {
        let (settled, left) = (&row[way]["settled"], row[way]["left"].as_array().unwrap());
        let trials = settled["trials"].as_u64().unwrap();
        assert_eq!(settled["count"].as_u64().unwrap() + left.len() as u64, trials, "{row}");
        trials
    };
    assert_eq!(trials("asked_for"), trials("by_lot"));
    assert_eq!(trials("asked_for") + trials("no_pose_tells"), ties);
    let both = studies(&["benchmark", "--ties", "--analyst", "lasso"], home.path());
    assert_eq!(both.status.code(), Some(2));
    assert!(errors(&both).contains("cannot be used with '--analyst"), "{}", errors(&both));
}
