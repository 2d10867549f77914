//! Plugins that talk, remember or take without end: what is more than enough is left out and counted.

use std::fs;
use std::sync::mpsc::Receiver;

use plumb_host::{HostArguments, HostEvent};
use plumb_plugin::Value;

use crate::c_plugin::compiled_from_text;
use crate::test_folder::{LONG, TestFolder, until, waist_to};

/// What was said so far, as text.
fn reported(events: &Receiver<HostEvent>) -> Vec<String> {
    let text = |event| match event {
        HostEvent::Output { text } | HostEvent::Log { text, .. } => Some(text),
        _ => None,
    };
    events.try_iter().filter_map(text).collect()
}

fn faulty(fault: &str, call: &str) -> Value {
    serde_json::json!({"fault": fault, "in": call})
}

fn assert_flood_is_cut(fault: &str, most: usize) {
    let folder = TestFolder::new();
    let arguments = folder.arguments("arm", "misbehaving_robot", faulty(fault, "move"));
    let (host, events) = folder.spawn_listening(&arguments);
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    robot.move_joints(&waist_to(0.01), LONG).unwrap();
    drop(robot);
    host.finish(LONG);
    let lines = reported(&events);
    let shown = lines.iter().filter(|line| line.starts_with("line ")).count();
    assert!(shown > 100 && shown <= most, "{shown} lines were shown");
    let left_out = |line: &String| line.contains(" lines (") && line.contains("left out here");
    let count: usize = lines
        .iter()
        .filter(|line| left_out(line))
        .filter_map(|line| line.split_whitespace().next()?.parse::<usize>().ok())
        .sum();
    assert_eq!(shown + count, 100_000, "every line is shown or counted: {:?}", lines.last());
}

#[test]
fn a_plugin_that_prints_without_end_is_cut_and_the_rest_counted() {
    assert_flood_is_cut("print", 2_000);
}

#[test]
fn a_plugin_that_logs_without_end_is_cut_and_the_rest_counted() {
    assert_flood_is_cut("log", 30_000);
}

#[test]
fn a_long_error_is_cut_and_says_how_much_is_missing() {
    let folder = TestFolder::new();
    let host = folder.robot_with("long error", "read");
    let message = host.robot().unwrap().read_joints().unwrap_err().to_string();
    assert!(message.len() < 5_000, "{} bytes", message.len());
    assert!(message.ends_with("... (5 MB more left out)"), "{}", &message[message.len() - 60..]);
}

#[test]
fn a_description_without_end_is_refused() {
    let folder = TestFolder::new();
    let message = folder.refusal(&folder.arguments("arm", "misbehaving_robot", faulty("epic", "describe")));
    assert!(message.contains("bytes; it may have 1048576"), "{message}");
}

#[test]
fn a_plugin_that_takes_memory_without_end_is_ended_with_words() {
    let folder = TestFolder::new();
    let mut arguments = folder.arguments("arm", "misbehaving_robot", faulty("eat", "create"));
    arguments.memory_limit_mb = 200;
    let message = folder.refusal(&arguments);
    assert!(
        message.contains("it took more memory than it may (`memory_limit_mb:` in the cell file)"),
        "{message}"
    );
}

#[test]
fn memory_that_is_taken_at_once_is_refused_by_the_system_and_explained() {
    let folder = TestFolder::new();
    let mut arguments = folder.arguments("arm", "misbehaving_robot", faulty("grab", "create"));
    arguments.memory_limit_mb = 200;
    let message = folder.refusal(&arguments);
    assert!(message.contains("memory allocation of 4000000000 bytes failed"), "{message}");
    assert!(message.contains("`memory_limit_mb:`"), "{message}");
}

#[test]
fn what_a_plugin_in_c_prints_arrives_without_a_flush_also_when_it_dies() {
    let folder = TestFolder::new();
    let example = fs::read_to_string(crate::c_plugin::example()).unwrap();
    let prints = example
        .replace("#include <math.h>\n", "#include <math.h>\n#include <stdio.h>\n")
        .replace("    arm->host = host;\n", "    arm->host = host;\n    printf(\"printed in create\");\n")
        .replace(
            "    double from[JOINTS], way",
            "    printf(\"\\nprinted in move\\n\"); printf(\"half a line\"); abort();\n    double from[JOINTS], way",
        );
    assert_ne!(prints, example);
    let Some(plugin) = compiled_from_text(&prints, folder.directory.path()) else { return };
    let (host, events) = folder.spawn_listening(&HostArguments::new("arm", &folder.domain, &plugin));
    let mut lines = Vec::new();
    until("what was printed in create", || {
        lines.extend(reported(&events));
        lines.iter().any(|line| line == "printed in create").then_some(())
    });
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    let target = plumb_plugin::JointVector::from_slice(&[0.1, 0.0]).unwrap();
    let error = robot.move_joints(&plumb_plugin::Motion::absolute(target, 1.0), LONG).unwrap_err();
    assert!(error.to_string().ends_with("the last it wrote: half a line"), "{error}");
    lines.extend(reported(&events));
    assert!(lines.iter().any(|line| line == "printed in move"), "{lines:?}");
}
