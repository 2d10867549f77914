//! How far the joints of robots go by what the robots themselves allow, as far as that is known before they are started: a manifest lists them, or
//! a setting does that its schema marks `are_joints: true`.

use plumb_document::{Problems, did_you_mean};
use plumb_host::Catalogue;
use plumb_plugin::{Manifest, ManifestJoint};
use serde_json::Value;

use crate::check_context::OwnLimits;
use crate::deg_or_mm::DegOrMm;
use crate::joint_range::JointRange;
use crate::workcell::{DeviceSetting, RobotSetting, Workcell};

/// The joints of a cell's robots whose ranges are known: those of `reported`, which holds more than a manifest knows, and those of manifests and settings.
pub fn joint_ranges(cell: &Workcell, catalogue: &Catalogue, reported: &[JointRange]) -> Vec<JointRange> {
    let of_manifest = |device: &DeviceSetting| {
        let plugin = catalogue.find(&device.plugin).ok();
        plugin.map(|plugin| ranges_of(device, &plugin.manifest)).unwrap_or_default()
    };
    let robots = cell.devices.iter().filter(|device| cell.robot(&device.name).is_some());
    let own = robots.filter(|device| reported.iter().all(|range| range.device != device.name));
    reported.iter().cloned().chain(own.flat_map(of_manifest)).collect()
}

/// How far the joints go that a device's manifest and settings list.
fn ranges_of(device: &DeviceSetting, manifest: &Manifest) -> Vec<JointRange> {
    let range = |joint: ManifestJoint| {
        let (least, most) = joint.range()?;
        Some(JointRange { device: device.name.clone(), joint: joint.name, least, most })
    };
    listed_joints(device, manifest).into_iter().filter_map(range).collect()
}

/// The joints that a device's manifest and settings list; none where they leave them open.
fn listed_joints(device: &DeviceSetting, manifest: &Manifest) -> Vec<ManifestJoint> {
    let settings = device.config.as_object().into_iter().flatten();
    let marked = settings.filter(|(key, _)| manifest.config["properties"][key]["are_joints"] == true);
    // A joint that cannot be read is reported where the settings are checked.
    let joint = |item: &Value| {
        let end = |key: &str| item.get(key).and_then(Value::as_f64);
        Some(ManifestJoint {
            name: item.get("name")?.as_str()?.to_owned(),
            from_deg: end("from_deg"),
            to_deg: end("to_deg"),
            from_mm: end("from_mm"),
            to_mm: end("to_mm"),
        })
    };
    let given = marked.flat_map(|(_, list)| list.as_array().into_iter().flatten()).filter_map(joint);
    manifest.joints.iter().flatten().cloned().chain(given).collect()
}

/// Checks the joints that the cell names of a robot against those that its manifest and settings list, where they list any.
pub(super) fn check_joints(
    robot: &RobotSetting,
    device: &DeviceSetting,
    manifest: &Manifest,
    problems: &Problems,
) {
    let listed = listed_joints(device, manifest);
    if listed.is_empty() {
        return;
    }
    for (joint, unit) in &robot.joints {
        let Some(known) = listed.iter().find(|known| known.name == *joint) else {
            let message = format!("robot `{}`: its plugin has no joint `{joint}`", device.name);
            let help = did_you_mean(joint, listed.iter().map(|known| known.name.as_str()));
            problems.add(device.span, message, help);
            continue;
        };
        let is = if known.from_mm.is_some() { DegOrMm::Mm } else { DegOrMm::Deg };
        if is != *unit {
            let (slides, turns) = ("it slides: write `mm`", "it turns: write `deg`");
            let message = format!("robot `{}`: joint `{joint}` is given in {}", device.name, unit.symbol());
            problems.add(device.span, message, if is == DegOrMm::Mm { slides } else { turns });
        }
    }
}

/// The limits of a robot's own of its joints, each with how far the cell's procedures may correct its zero: a joint's numbers in a procedure are those of its
/// drive, and the zero in force, which nobody knows before the run.
pub(crate) fn own_limits(cell: &Workcell, robot: &str, ranges: &[JointRange]) -> Vec<OwnLimits> {
    let own = ranges.iter().filter(|range| range.device == robot);
    let limits = own.map(|range| {
        let shifts = cell.procedures.iter().map(|procedure| procedure.zero_shift(robot, &range.joint));
        let zero_shift = shifts.fold(0.0, f64::max);
        OwnLimits { joint: range.joint.clone(), least: range.least, most: range.most, zero_shift }
    });
    limits.collect()
}
