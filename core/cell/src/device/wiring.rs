//! Streams led from device to device, as the plugins' manifests know them.

use plumb_host::{Catalogue, Plugin, WiredInput};
use plumb_plugin::{DeviceKind, InputDescription, StreamDescription};
use serde_json::Value;

use super::configuration;
use super::input_lines::{InputLines, check_input_lines};
use super::joint_ranges::check_joints;
use crate::workcell::{DeviceSetting, Workcell};
use plumb_document::{FileProblems, Problems, did_you_mean};

/// Checks what plugins' manifests know of a cell's devices: that there is a plugin, and that what is wired exists and fits. `lines` are the input
/// lines of devices whose manifest leaves them open.
///
/// # Errors
/// Every mistake in the cell file.
pub(crate) fn check_plugins(
    cell: &Workcell,
    catalogue: &Catalogue,
    lines: &[InputLines],
) -> Result<(), FileProblems> {
    let problems = Problems::default();
    for device in &cell.devices {
        let plugin = match catalogue.find(&device.plugin) {
            Ok(plugin) => plugin,
            Err(error) => {
                problems.add(device.span, error.to_string(), "");
                continue;
            }
        };
        // The cell fills these in where they are wanted.
        let given: &[&str] = match (&cell.world, &device.emulate) {
            (Some(_), Some(_)) => &["world", "port", "address"],
            (Some(_), None) => &["world"],
            _ => &[],
        };
        for (message, help) in configuration::mistakes(&device.config, &plugin.manifest.config, given) {
            problems.add(device.span, format!("device `{}`: {message}", device.name), help);
        }
        check_kind(cell, device, plugin, &problems);
        check_corrections(cell, device, plugin, &problems);
        let lines_of = |name: &str| lines_of(cell, catalogue, lines, name);
        check_input_lines(device, plugin, &lines_of, &problems);
        for wire in &device.inputs {
            let wired = input_of(plugin, &wire.input).and_then(|input| {
                let stream = stream_of(cell, catalogue, &wire.device, &wire.stream)?;
                fits(input, &stream)
            });
            if let Err((message, help)) = wired {
                problems.add(wire.span, message, help);
            }
        }
        let missing = plugin.manifest.inputs.iter().filter(|input| !input.optional);
        for input in missing.filter(|input| device.inputs.iter().all(|wire| wire.input != input.name)) {
            let message = format!("device `{}` needs its input `{}` wired", device.name, input.name);
            problems.add(
                device.span,
                message,
                format!(
                    "write `inputs: {{{}: DEVICE/STREAM}}` with a stream of {}",
                    input.name, input.message
                ),
            );
        }
    }
    problems.into_result(&cell.file, &cell.text)
}

/// Checks that what is under `robots:` is a robot, with the joints that are named there, and that a robot is.
fn check_kind(cell: &Workcell, device: &DeviceSetting, plugin: &Plugin, problems: &Problems) {
    let (name, id) = (&device.name, &plugin.manifest.id);
    match (cell.robot(name), plugin.manifest.kind) {
        (Some(robot), DeviceKind::Robot) => check_joints(robot, device, &plugin.manifest, problems),
        (Some(_), DeviceKind::Sensor) => {
            let message = format!("device `{name}` is under `robots:`, and plugin `{id}` is a sensor");
            let help = format!("name the plugin of a robot, or take `{name}` away under `robots:`");
            problems.add(device.span, message, help);
        }
        (None, DeviceKind::Robot) => {
            let message = format!("device `{name}` is a robot, and the cell file says nothing about it");
            problems.add(device.span, message, "name it under `robots:` with its joints");
        }
        (None, DeviceKind::Sensor) => {}
    }
}

/// How many input lines a device has, if that is known before it is started.
fn lines_of(cell: &Workcell, catalogue: &Catalogue, known: &[InputLines], name: &str) -> Option<u32> {
    let device = cell.devices.iter().find(|device| device.name == name)?;
    let of_manifest = catalogue.find(&device.plugin).ok().and_then(|plugin| plugin.manifest.input_lines);
    of_manifest.or_else(|| known.iter().find(|known| known.device == name).map(|known| known.count))
}

/// Checks that what the procedures correct of a sensor is something its plugin takes corrections of.
fn check_corrections(cell: &Workcell, device: &DeviceSetting, plugin: &Plugin, problems: &Problems) {
    let taken = plugin.manifest.config.pointer("/properties/corrections/properties");
    let taken: Vec<&str> =
        taken.and_then(Value::as_object).into_iter().flatten().map(|(key, _)| key.as_str()).collect();
    for procedure in &cell.procedures {
        for key in procedure.corrections_of(&device.name) {
            if taken.contains(&key) {
                continue;
            }
            let message = format!(
                "device `{}`: procedure `{}` corrects its `{key}`, and plugin `{}` takes no such correction",
                device.name, procedure.name, plugin.manifest.id
            );
            problems.add(device.span, message, did_you_mean(key, taken.iter().copied()));
        }
    }
}

/// The wired inputs of a device, as its host is given them.
///
/// # Errors
/// A sentence that says what does not fit.
pub(super) fn wired_inputs(
    cell: &Workcell,
    device: &DeviceSetting,
    catalogue: &Catalogue,
) -> Result<Vec<WiredInput>, String> {
    let wired = device.inputs.iter().map(|wire| {
        let stream = stream_of(cell, catalogue, &wire.device, &wire.stream)
            .map_err(|(message, help)| format!("{message}: {help}"))?;
        Ok(WiredInput { input: wire.input.clone(), device: wire.device.clone(), stream })
    });
    wired.collect()
}

type Mistake = (String, String);

fn input_of<'p>(plugin: &'p Plugin, name: &str) -> Result<&'p InputDescription, Mistake> {
    plugin.manifest.inputs.iter().find(|input| input.name == name).ok_or_else(|| {
        let help = did_you_mean(name, plugin.manifest.inputs.iter().map(|input| input.name.as_str()));
        (format!("plugin `{}` has no input `{name}`", plugin.manifest.id), help)
    })
}

fn stream_of(
    cell: &Workcell,
    catalogue: &Catalogue,
    device: &str,
    name: &str,
) -> Result<StreamDescription, Mistake> {
    let source = cell.devices.iter().find(|known| known.name == device);
    let plugin = source.map(|source| catalogue.find(&source.plugin));
    let plugin = match plugin {
        Some(Ok(plugin)) => plugin,
        Some(Err(error)) => return Err((error.to_string(), String::new())),
        None => return Err((format!("there is no device `{device}` in the cell"), String::new())),
    };
    let streams = &plugin.manifest.streams;
    streams.iter().find(|stream| stream.name == name).cloned().ok_or_else(|| {
        let help = did_you_mean(name, streams.iter().map(|stream| stream.name.as_str()));
        (format!("device `{device}` has no stream `{name}`"), help)
    })
}

fn fits(input: &InputDescription, stream: &StreamDescription) -> Result<(), Mistake> {
    if input.message == stream.message {
        return Ok(());
    }
    let message =
        format!("input `{}` takes {}, but this stream carries {}", input.name, input.message, stream.message);
    Err((message, "wire a stream of the same kind".to_owned()))
}

#[cfg(test)]
mod tests;
