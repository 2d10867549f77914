//! A cell held against its plugins and its simulated world, before anything is started.

use plumb_cell::check_cell;
use plumb_cell::device::{InputLines, JointRange};
use plumb_cell::workcell::{DeviceSetting, Workcell};
use plumb_document::{FileProblems, Problems, did_you_mean};
use plumb_host::Catalogue;
use plumb_simulated::protocol::JointFacts;
use plumb_simulated::world_file::{self, Described, WorldFileError};

/// The plugin that serves the arm of a simulated world; which arm that is, the world says, not its manifest.
pub(crate) const SIMULATED: &str = "simulated";

/// Checks what can be known of a cell from manifests and from the file of its world.
///
/// # Errors
/// Every mistake of the cell's files. That the world's file cannot be opened is left to what starts it: a resumed run has its world already.
pub(crate) fn check_with_world(cell: &Workcell, catalogue: &Catalogue) -> Result<(), Vec<FileProblems>> {
    let mut wrong = Vec::new();
    let mut lines = Vec::new();
    let mut ranges = Vec::new();
    if let Some(setting) = &cell.world {
        match world_file::read(&setting.file) {
            Ok(world) => {
                let (name, count) = world.arm();
                let devices = || cell.devices.iter().filter(|device| device.plugin == SIMULATED);
                wrong.extend(check_arm(cell, devices(), name).err());
                lines.extend(devices().map(|device| InputLines { device: device.name.clone(), count }));
                ranges.extend(devices().flat_map(|device| ranges_in(&world, device)));
            }
            Err(WorldFileError::Wrong(problems)) => wrong.push(*problems),
            Err(_) => {}
        }
    }
    wrong.extend(check_cell(cell, catalogue, &lines, &ranges).err().into_iter().flatten());
    if wrong.is_empty() { Ok(()) } else { Err(wrong) }
}

/// How far the joints of a device go that is the arm of this world.
pub(crate) fn ranges_in(world: &Described, device: &DeviceSetting) -> Vec<JointRange> {
    let range = |joint: JointFacts| JointRange {
        device: device.name.clone(),
        joint: joint.name,
        least: joint.lower,
        most: joint.upper,
    };
    world.joints().into_iter().map(range).collect()
}

/// Checks that devices ask for the arm that is in the world.
fn check_arm<'a>(
    cell: &Workcell,
    devices: impl Iterator<Item = &'a DeviceSetting>,
    name: &str,
) -> Result<(), FileProblems> {
    let problems = Problems::default();
    for device in devices {
        let asked = device.config.get("arm").and_then(serde_json::Value::as_str);
        if let Some(asked) = asked.filter(|asked| *asked != name) {
            let message = format!("device `{}`: there is no arm `{asked}` in the cell's world", device.name);
            problems.add(device.span, message, did_you_mean(asked, [name]));
        }
    }
    problems.into_result(&cell.file, &cell.text)
}
