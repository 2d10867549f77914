//! A cell held against what the manifests of its plugins say, before anything is started.

use plumb_document::FileProblems;
use plumb_host::Catalogue;

use crate::cell_names::CellNames;
use crate::device::{InputLines, JointRange, check_plugins, joint_ranges, own_limits};
use crate::engine::scope::result_name;
use crate::procedure::check_procedure;
use crate::stream_fields::streams_of;
use crate::workcell::{Workcell, cell_names};

/// Checks what manifests know of a cell: plugins, settings, wiring, and what procedures name of readings. `lines` are the input lines of devices
/// whose manifest leaves them open, `ranges` how far the joints of robots go of which more is known than their manifests say.
///
/// # Errors
/// Every mistake of the cell's file and its procedures'.
pub fn check_cell(
    cell: &Workcell,
    catalogue: &Catalogue,
    lines: &[InputLines],
    ranges: &[JointRange],
) -> Result<(), Vec<FileProblems>> {
    let mut wrong: Vec<FileProblems> = check_plugins(cell, catalogue, lines).err().into_iter().collect();
    let mut names = names_of_devices(cell, catalogue, lines);
    let ranges = joint_ranges(cell, catalogue, ranges);
    for robot in &mut names.robots {
        robot.own_limits = own_limits(cell, &robot.name, &ranges);
    }
    for procedure in &cell.procedures {
        for problems in check_procedure(procedure, &names).err().into_iter().flatten() {
            // A procedure that two others call is reported once.
            if !wrong.iter().any(|earlier| earlier.to_string() == problems.to_string()) {
                wrong.push(problems);
            }
        }
    }
    if wrong.is_empty() { Ok(()) } else { Err(wrong) }
}

/// What the cell offers to names, with the quantities and the streams that manifests list.
fn names_of_devices(cell: &Workcell, catalogue: &Catalogue, lines: &[InputLines]) -> CellNames {
    let mut names = cell_names(&cell.devices, &cell.robots);
    for device in &cell.devices {
        let Ok(plugin) = catalogue.find(&device.plugin) else { continue };
        let known = lines.iter().find(|known| known.device == device.name).map(|known| known.count);
        let lines = plugin.manifest.input_lines.or(known);
        names.streams.push(streams_of(device, plugin, &cell.robots, lines));
    }
    for device in cell.devices.iter().filter(|device| names.sensors.contains(&device.name)) {
        let plugin = catalogue.find(&device.plugin).ok();
        let Some(listed) = plugin.and_then(|plugin| plugin.manifest.quantities.as_ref()) else { continue };
        let known = listed.iter().map(|quantity| result_name(&quantity.name, &quantity.unit)).collect();
        names.quantities.push((device.name.clone(), known));
    }
    names
}
