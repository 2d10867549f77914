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

#[test]
fn probabilities_are_held_against_what_is_hidden_and_drawn() {
    let home = tempfile::tempdir().unwrap();
    let asked = [
        "benchmark",
        "--probabilities",
        "--cell",
        "one-3x",
        "--scale",
        "0.01",
        "--json",
        "f.json",
        "-o",
        "pictures",
    ];
    let run = studies(&asked, home.path());
    assert_eq!(run.status.code(), Some(0), "{}", errors(&run));
    let text = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(text.contains("Brier score") && text.contains("of the best constant guess"), "{text}");
    let picture = fs::read_to_string(home.path().join("pictures/reliability-candidates.svg")).unwrap();
    assert!(picture.contains("probability given, %"));
    let figures: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(home.path().join("f.json")).unwrap()).unwrap();
    let candidates = figures["rows"]["candidates"].as_array().unwrap();
    let sure = candidates.iter().filter(|one| one["probability"].as_f64().unwrap() > 0.9);
    assert!(sure.clone().count() >= 3 && sure.clone().all(|one| one["came_true"] == true), "{candidates:?}");
}

#[test]
fn cards_are_held_against_what_adding_leaves_on_locked_rows() {
    let home = tempfile::tempdir().unwrap();
    let asked = ["benchmark", "--cards", "--cell", "two-3x", "--scale", "0.02", "--json", "f.json"];
    let run = studies(&asked, home.path());
    assert_eq!(run.status.code(), Some(0), "{}", errors(&run));
    let figures: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(home.path().join("f.json")).unwrap()).unwrap();
    let row = &figures["rows"][0];
    let (kept, cards) = (&row["validated"]["count"], row["cards"].as_array().unwrap());
    // Of two effects each card promises what adding it alone leaves, not what it leaves beside the other. Rows that were judged outliers are in the second figure only.
    assert!(cards.len() >= 4 && kept.as_u64().unwrap() * 5 >= cards.len() as u64 * 4, "{row}");
}

#[test]
fn halves_of_a_table_are_compared_and_a_table_that_is_not_there_is_reported() {
    let home = tempfile::tempdir().unwrap();
    let run = studies(&["benchmark", "--halves", "--cell", "one-3x", "--scale", "0.003"], home.path());
    assert_eq!(run.status.code(), Some(0), "{}", errors(&run));
    let text = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(text.contains("poses at random") && text.contains("earlier and later rows"), "{text}");
    let missing = studies(&["benchmark", "--halves", "--set", "none.yaml:none.csv"], home.path());
    assert_eq!(missing.status.code(), Some(2));
    assert!(errors(&missing).contains("cannot read none.yaml"), "{}", errors(&missing));
    let half = studies(&["benchmark", "--halves", "--set", "none.yaml"], home.path());
    assert!(errors(&half).contains("write MODEL:TABLE"), "{}", errors(&half));
}
