//! Settings that denote an input of the device, or a line of the device that is wired to one. A manifest marks them in its schema:
//! `needs_input: INPUT` beside a setting that is of no use without that input, `input_line_of: INPUT` beside one that is the number of an input
//! line of the device whose stream is wired there.

use plumb_document::Problems;
use plumb_host::Plugin;
use serde_json::Value;

use crate::workcell::DeviceSetting;

/// How many digital input lines a device of the cell has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputLines {
    /// The device.
    pub device: String,
    /// Its lines are the bits from 0 to one below this.
    pub count: u32,
}

/// Checks the settings of a device that are marked so. `lines_of` gives how many lines a device has, where that is known.
pub(super) fn check_input_lines(
    device: &DeviceSetting,
    plugin: &Plugin,
    lines_of: &dyn Fn(&str) -> Option<u32>,
    problems: &Problems,
) {
    for (key, value) in device.config.as_object().into_iter().flatten() {
        let schema = plugin.manifest.config.get("properties").and_then(|properties| properties.get(key));
        let mark = |name: &str| schema.and_then(|schema| schema.get(name)).and_then(Value::as_str);
        let Some(input) = mark("input_line_of").or_else(|| mark("needs_input")) else { continue };
        let Some(wire) = device.inputs.iter().find(|wire| wire.input == input) else {
            let message =
                format!("device `{}` has `{key}`, which needs its input `{input}` wired", device.name);
            problems.add(device.span, message, wiring_of(plugin, input));
            continue;
        };
        let count = mark("input_line_of").and_then(|_| lines_of(&wire.device));
        let (Some(count), Some(line)) = (count, value.as_u64()) else { continue };
        if line >= u64::from(count) {
            let message = format!("device `{}`: `config.{key}` is {line}", device.name);
            problems.add(device.span, message, lines_there_are(&wire.device, count));
        }
    }
}

fn wiring_of(plugin: &Plugin, input: &str) -> String {
    let of_input = plugin.manifest.inputs.iter().find(|known| known.name == input);
    let message = of_input.map(|known| format!(" with a stream of {}", known.message)).unwrap_or_default();
    format!("write `inputs: {{{input}: DEVICE/STREAM}}`{message}")
}

pub(super) fn lines_there_are(device: &str, count: u32) -> String {
    match count {
        0 => format!("`{device}` has no input lines"),
        1 => format!("`{device}` has one input line: 0"),
        more => format!("`{device}` has {more} input lines: 0 to {}", more - 1),
    }
}
