//! A cell with plugins of its own for unit tests: two manifests whose libraries are empty files, and a cell file.

use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

use plumb_host::Catalogue;
use tempfile::TempDir;

use crate::expression::Calculator;
use crate::workcell::{Workcell, load_workcell};

/// A robot with one turn and one slide, and two input lines.
const ROBOT: &str = "id: test-robot
title: A robot for tests
version: 0.1.0
contract: [1, 0]
kind: robot
library: libtest_robot.so
streams:
  - {name: joints, message: joint-state/1}
  - {name: inputs, message: digital-inputs/1}
input_lines: 2
joints:
  - {name: waist, from_deg: -90, to_deg: 120}
  - {name: lift, from_mm: 0, to_mm: 50}
config:
  type: object
  additionalProperties: false
  properties:
    port: {type: string}
    cell_directory: {type: string}
    world: {type: string}
";

/// A sensor on a line of a robot.
const SENSOR: &str = "id: test-sensor
title: A sensor for tests
version: 0.1.0
contract: [1, 0]
kind: sensor
library: libtest_sensor.so
inputs:
  - {name: line, message: digital-inputs/1}
  - {name: joints, message: joint-state/1, optional: true}
quantities: []
config:
  type: object
  additionalProperties: false
  properties:
    bit: {type: integer, minimum: 0, input_line_of: line}
    chip: {type: string, needs_input: joints}
    address: {type: string}
    corrections: {type: object, properties: {tilt_deg: {type: number}, scale: {type: number}}}
";

/// A cell of one robot and one sensor that is in order.
pub(super) const CELL: &str = "cell: bench
devices:
  arm: {plugin: test-robot}
  eye: {plugin: test-sensor, config: {bit: 1}, inputs: {line: arm/inputs}}
robots:
  arm: {joints: {waist: deg, lift: mm}}
procedures: []
";

/// A directory with the two plugins in it.
pub(super) fn plugins() -> (TempDir, Catalogue) {
    let directory = tempfile::tempdir().unwrap();
    for (id, manifest) in [("robot", ROBOT), ("sensor", SENSOR)] {
        let folder = directory.path().join(id);
        fs::create_dir(&folder).unwrap();
        fs::write(folder.join("plugin.yaml"), manifest).unwrap();
        fs::write(folder.join(format!("libtest_{id}.so")), id).unwrap();
    }
    let catalogue = Catalogue::search(&[directory.path().to_owned()]);
    (directory, catalogue)
}

/// The cell of this text, in that directory.
pub(super) fn cell_in(folder: &TempDir, text: &str) -> Arc<Workcell> {
    let file: PathBuf = folder.path().join("cell.yaml");
    fs::write(&file, text).unwrap();
    Arc::new(load_workcell(&file, &Calculator::new()).unwrap_or_else(|problems| {
        panic!("{}", problems.iter().map(ToString::to_string).collect::<String>())
    }))
}
