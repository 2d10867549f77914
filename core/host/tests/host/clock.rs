//! The one clock of a cell: where a world keeps it every host dates by it, and what another clock has dated is refused.

use plumb_host::SpawnError;
use plumb_plugin::Value;
use plumb_plugin::cell_clock::{CellTime, ClockWriter};
use serde_json::json;

use crate::test_folder::{LONG, TestFolder};

#[test]
fn a_device_dates_by_the_clock_that_the_cells_world_keeps() {
    let folder = TestFolder::new();
    let file = folder.directory.path().join("world.clock");
    let clock = ClockWriter::create(&file, CellTime::Stopped { at_ns: 77_000_000_000_000 }).unwrap();
    let mut arguments = folder.arguments("arm", "misbehaving_robot", Value::Null);
    arguments.clock = Some(file);
    let host = folder.spawn(&arguments).unwrap();
    let arm = host.robot().unwrap();
    assert_eq!(arm.read_joints().unwrap().time_ns, 77_000_000_000_000);
    clock.write(CellTime::Stopped { at_ns: 77_000_000_000_001 }).unwrap();
    assert_eq!(arm.read_joints().unwrap().time_ns, 77_000_000_000_001);
    // From then on it runs with the wall's.
    clock.write(CellTime::Runs { ahead_ns: 1_000_000_000_000_000 }).unwrap();
    let first = arm.read_joints().unwrap().time_ns;
    assert!(first > 1_000_000_000_000_000 && arm.read_joints().unwrap().time_ns > first);
    host.finish(LONG);
}

#[test]
fn a_device_that_dates_by_another_clock_is_named_with_how_far_it_is_away() {
    let folder = TestFolder::new();
    // Seconds since 1970, as a plugin has them that asks the system for the date.
    let host = folder.robot(json!({"fault": "date", "in": "read"}));
    let arm = host.robot().unwrap();
    let refused = arm.read_joints().unwrap_err().to_string();
    assert!(
        refused.contains("the clock of arm is ") && refused.contains(" s ahead of the clock of the cell"),
        "{refused}"
    );
    assert!(refused.contains("a message on `joints`") && refused.contains("`now_ns`"), "{refused}");
    host.finish(LONG);
}

#[test]
fn a_device_whose_cell_has_lost_its_clock_does_not_start() {
    let folder = TestFolder::new();
    let mut arguments = folder.arguments("arm", "misbehaving_robot", Value::Null);
    arguments.clock = Some(folder.directory.path().join("no.clock"));
    let refusal: Result<_, SpawnError> = folder.spawn(&arguments);
    let text = refusal.map(|host| host.process()).unwrap_err().to_string();
    assert!(text.contains("the clock of the cell's simulated world"), "{text}");
}
