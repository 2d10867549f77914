//! `plumb run --json`: the version of the form, and a choice of events.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::lab::Lab;

/// The events of a run with these options.
fn events(lab: &Lab, more: &[&str]) -> Vec<Value> {
    let mut arguments = vec!["run", "cell.yaml", "--json"];
    arguments.extend(more);
    let ran = lab.plumb(&arguments);
    assert_eq!(ran.code(), 0, "{}", ran.err());
    ran.out().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn names(events: &[Value]) -> BTreeSet<&str> {
    events.iter().map(|event| event["event"].as_str().unwrap()).collect()
}

#[test]
fn the_first_event_says_the_version_and_events_can_be_chosen() {
    let lab = Lab::new();
    let all = events(&lab, &[]);
    assert_eq!((&all[0]["event"], &all[0]["version"]), (&Value::from("run_started"), &Value::from(1)));
    assert!(all.iter().skip(1).all(|event| event.get("version").is_none()), "once a sitting");
    let some = events(&lab, &["--events", "step_finished,run_ended"]);
    assert_eq!(names(&some), ["run_ended", "step_finished"].into());
    let without = events(&lab, &["--events", "no:joints,no:clearance"]);
    let mut expected = names(&all);
    assert!(expected.remove("joints") && expected.remove("clearance"), "{expected:?}");
    assert_eq!(names(&without), expected);
}

#[test]
fn a_misspelled_event_is_refused_with_the_nearest_and_a_filter_needs_json() {
    let lab = Lab::new();
    let refused = lab.plumb(&["run", "cell.yaml", "--json", "--events", "step_finnished"]);
    assert_eq!(refused.code(), 2);
    let stderr = refused.err();
    assert!(stderr.contains("there is no event `step_finnished`; did you mean `step_finished`?"), "{stderr}");
    let alone = lab.plumb(&["run", "cell.yaml", "--events", "joints"]);
    assert_eq!(alone.code(), 2);
    assert!(alone.err().contains("--json"), "{}", alone.err());
}
