//! What is known of a cell's robots without asking them, for the time a plan takes.

use plumb_cell::device::joint_ranges;
use plumb_cell::engine::{JointFacts, RobotFacts};
use plumb_cell::workcell::{DeviceSetting, Workcell};
use plumb_host::Catalogue;
use plumb_simulated::world_file::{self, Described};

use crate::commands::cell_check::{SIMULATED, ranges_in};

/// How long an arm of a simulated world takes to receive a move and to answer, beside the motion, s: a message there and back within one computer.
const SIMULATED_COMMAND_S: f64 = 0.005;

/// What the world's file says of its arm, for devices that are that arm; of others what their manifests say.
pub(super) fn robot_facts(cell: &Workcell, catalogue: &Catalogue) -> Vec<RobotFacts> {
    // A file that cannot be read was reported when the cell was checked; a resumed run has its world already.
    let world = cell.world.as_ref().and_then(|setting| world_file::read(&setting.file).ok());
    let is_robot = |device: &&DeviceSetting| cell.robot(&device.name).is_some();
    let facts = |device: &DeviceSetting| match world.as_ref().filter(|_| device.plugin == SIMULATED) {
        Some(world) => of_world(device, world),
        None => of_manifest(device, cell, catalogue),
    };
    cell.devices.iter().filter(is_robot).map(facts).collect()
}

fn of_world(device: &DeviceSetting, world: &Described) -> RobotFacts {
    let joints = world.joints().into_iter().map(|joint| JointFacts {
        name: joint.name,
        max_speed: joint.top_speed,
        start: Some(joint.home),
    });
    RobotFacts {
        robot: device.name.clone(),
        joints: joints.collect(),
        ranges: ranges_in(world, device),
        command_s: Some(SIMULATED_COMMAND_S),
        ..RobotFacts::default()
    }
}

fn of_manifest(device: &DeviceSetting, cell: &Workcell, catalogue: &Catalogue) -> RobotFacts {
    let plugin = catalogue.find(&device.plugin).ok();
    let typical = plugin.and_then(|plugin| plugin.manifest.typical).unwrap_or_default();
    // A setting that its schema marks `is_full_speed: deg_per_s` says more than what is typical.
    let is_speed = |key: &str| {
        let mark = plugin.map(|plugin| &plugin.manifest.config["properties"][key]["is_full_speed"]);
        mark.is_some_and(|mark| mark.as_str() == Some("deg_per_s"))
    };
    let given = device.config.as_object().into_iter().flatten();
    let given = given.filter(|(key, _)| is_speed(key)).find_map(|(_, value)| value.as_f64());
    RobotFacts {
        robot: device.name.clone(),
        joints: Vec::new(),
        ranges: joint_ranges(cell, catalogue, &[]),
        turning_speed: given.or(typical.deg_per_s).map(f64::to_radians),
        sliding_speed: typical.mm_per_s,
        command_s: typical.command_s,
    }
}
