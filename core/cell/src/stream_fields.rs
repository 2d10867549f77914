//! The fields of streams as procedures name them, from their layouts and the cell's names of joints.

use plumb_host::Plugin;
use plumb_plugin::message::{FieldType, JointQuantity, Layout};
use plumb_plugin::{DigitalInputs, Health, Message as _, StreamDescription};

use crate::deg_or_mm::DegOrMm;
use crate::engine::scope::result_name;
use crate::stream_names::{DeviceStreams, FieldName, StreamNames};
use crate::workcell::{DeviceSetting, RobotSetting};

/// The most input lines a message can report: the bits of its levels.
const MOST_LINES: u32 = u64::BITS;

/// The streams of a device, its host's own among them.
pub(crate) fn streams_of(
    device: &DeviceSetting,
    plugin: &Plugin,
    robots: &[RobotSetting],
    lines: Option<u32>,
) -> DeviceStreams {
    let health = StreamDescription::of::<Health>("health");
    let joints = robot_of(device, robots).map(|robot| robot.joints.as_slice()).unwrap_or_default();
    let names = |stream: &StreamDescription| StreamNames {
        name: stream.name.clone(),
        message: stream.message.clone(),
        fields: Layout::of(stream).map(|layout| field_names(&layout, joints, lines)).unwrap_or_default(),
    };
    let streams = plugin.manifest.streams.iter().chain([&health]).map(names).collect();
    DeviceStreams { device: device.name.clone(), streams }
}

/// The robot whose joints a device's messages report: itself, or the one whose stream it takes in.
pub(crate) fn robot_of<'r>(device: &DeviceSetting, robots: &'r [RobotSetting]) -> Option<&'r RobotSetting> {
    let wired = device.inputs.iter().map(|wire| &wire.device);
    [&device.name].into_iter().chain(wired).find_map(|name| robots.iter().find(|robot| robot.device == *name))
}

pub(crate) fn field_names(
    layout: &Layout,
    joints: &[(String, DegOrMm)],
    lines: Option<u32>,
) -> Vec<FieldName> {
    let mut names = Vec::new();
    for field in layout.visible_fields() {
        match field.of {
            FieldType::Joints(quantity) => {
                let of_joint = |(joint, unit): &(String, DegOrMm)| {
                    let unit = joint_unit(*unit, quantity);
                    let path = format!("{}.{}", field.name, result_name(joint, &unit));
                    FieldName { path, unit }
                };
                names.extend(joints.iter().map(of_joint));
            }
            FieldType::F32x3 => {}
            _ => names
                .push(FieldName { path: name_with_unit(&field.name, &field.unit), unit: field.unit.clone() }),
        }
    }
    if layout.name == DigitalInputs::TYPE_NAME {
        let line = |line| FieldName { path: line_name(line), unit: String::new() };
        names.extend((0..lines.unwrap_or(MOST_LINES)).map(line));
    }
    names
}

/// By which an input line is called whose level is 0 or 1.
pub(crate) fn line_name(line: u32) -> String {
    format!("line_{line}")
}

/// The unit of what a field says of a joint.
pub(crate) fn joint_unit(unit: DegOrMm, quantity: JointQuantity) -> String {
    match quantity {
        JointQuantity::Position | JointQuantity::HalfWidth => unit.symbol().to_owned(),
        JointQuantity::Speed => format!("{}/s", unit.symbol()),
    }
}

/// A field's name with its unit at the end, where it does not end so already.
pub(crate) fn name_with_unit(name: &str, unit: &str) -> String {
    if !unit.is_empty() && name.ends_with(&result_name("", unit)) {
        return name.to_owned();
    }
    result_name(name, unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_has_its_unit_at_the_end_of_its_name_once() {
        assert_eq!(name_with_unit("time_ns", "ns"), "time_ns");
        assert_eq!(name_with_unit("weight", "g"), "weight_g");
        assert_eq!(name_with_unit("moving", ""), "moving");
        assert_eq!(name_with_unit("flow", "mm/s"), "flow_mm_per_s");
        assert_eq!(name_with_unit("bring", "g"), "bring_g", "a letter at the end is no unit");
    }

    #[test]
    fn joints_are_named_by_the_cell_and_lines_by_their_number() {
        let joints = [("elbow".to_owned(), DegOrMm::Deg), ("lift".to_owned(), DegOrMm::Mm)];
        let paths = |layout: &str, lines| {
            let names = field_names(&Layout::known(layout).expect(layout), &joints, lines);
            names.into_iter().map(|name| name.path).collect::<Vec<_>>()
        };
        assert_eq!(
            paths("joint-state/1", None),
            ["time_ns", "sequence", "moving", "joints.elbow_deg", "joints.lift_mm"]
        );
        let stripe = paths("stripe-points/2", None);
        assert!(stripe.contains(&"speeds.elbow_deg_per_s".to_owned()), "{stripe:?}");
        let inputs = paths("digital-inputs/1", Some(2));
        assert_eq!(inputs.iter().filter(|path| path.starts_with("line_")).count(), 2, "{inputs:?}");
    }
}
