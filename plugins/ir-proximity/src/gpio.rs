//! A line of a GPIO chip of this computer.

use std::fmt;
use std::io::ErrorKind;
use std::path::Path;

use gpiocdev::line::{EdgeDetection, EdgeKind, Value as Level};
use gpiocdev::{Chip, Error, Request};
use plumb_plugin::PluginError;

use crate::config::GpioSetting;

/// The most edges the kernel keeps for us between two looks.
const KERNEL_EDGES: u32 = 1024;

/// A change of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LineEdge {
    /// When it happened: ns, `CLOCK_MONOTONIC`, taken by the kernel in its interrupt.
    pub(crate) time_ns: u64,
    /// The level since then.
    pub(crate) level: bool,
}

/// A line whose changes are kept, with the time of each, until they are taken.
pub(crate) trait LineSource: fmt::Debug + Send {
    /// The level now.
    fn level(&mut self) -> Result<bool, PluginError>;
    /// The oldest change not yet taken; none when all were.
    fn next_edge(&mut self) -> Result<Option<LineEdge>, PluginError>;
}

/// A line requested from the kernel.
#[derive(Debug)]
pub(crate) struct GpioLine {
    request: Request,
    setting: GpioSetting,
    /// The number of the last change; the kernel counts from 1 and leaves out none.
    last: u32,
}

impl GpioLine {
    pub(crate) fn open(setting: &GpioSetting) -> Result<Self, PluginError> {
        let GpioSetting { chip, line } = setting;
        look_for(chip)?;
        let count = Chip::from_path(chip)
            .and_then(|chip| chip.info())
            .map_err(|error| no_chip(chip, &error))?
            .num_lines;
        if *line >= count {
            return Err(PluginError::Refused(format!(
                "the GPIO chip {chip} has no line {line}: its lines are 0 to {}",
                count.saturating_sub(1)
            )));
        }
        let request = Request::builder()
            .on_chip(chip)
            .with_consumer("plumb")
            .with_line(*line)
            .as_input()
            .with_edge_detection(EdgeDetection::BothEdges)
            .with_kernel_event_buffer_size(KERNEL_EDGES)
            .request()
            .map_err(|error| no_line(setting, &error))?;
        Ok(Self { request, setting: setting.clone(), last: 0 })
    }

    fn failed(&self, what: &str, error: &Error) -> PluginError {
        let GpioSetting { chip, line } = &self.setting;
        PluginError::Disconnected(format!(
            "{what} of line {line} of the GPIO chip {chip} cannot be read: {error}"
        ))
    }
}

impl LineSource for GpioLine {
    fn level(&mut self) -> Result<bool, PluginError> {
        let level =
            self.request.value(self.setting.line).map_err(|error| self.failed("the level", &error))?;
        Ok(level == Level::Active)
    }

    fn next_edge(&mut self) -> Result<Option<LineEdge>, PluginError> {
        if !self.request.has_edge_event().map_err(|error| self.failed("the changes", &error))? {
            return Ok(None);
        }
        let event = self.request.read_edge_event().map_err(|error| self.failed("the changes", &error))?;
        let lost = event.line_seqno.wrapping_sub(self.last).saturating_sub(1);
        self.last = event.line_seqno;
        if lost > 0 {
            return Err(PluginError::InputLost(format!(
                "{lost} changes of line {} of {} came faster than they were taken; a longer `debounce_ms` does not help here, look for a loose wire",
                self.setting.line, self.setting.chip
            )));
        }
        Ok(Some(LineEdge { time_ns: event.timestamp_ns, level: event.kind == EdgeKind::Rising }))
    }
}

/// Whether there is such a chip, reported in words better than the system's.
fn look_for(chip: &str) -> Result<(), PluginError> {
    match std::fs::metadata(chip) {
        Ok(_) => Ok(()),
        Err(error) if error.kind() == ErrorKind::NotFound => Err(PluginError::Disconnected(format!(
            "there is no GPIO chip {chip}; {}",
            match chips_there_are().as_slice() {
                [] => "this computer has none (ls /dev/gpiochip*): the line may be wired to an input of the robot instead, as `bit`".to_owned(),
                there => format!("there is {}", there.join(", ")),
            }
        ))),
        Err(error) => Err(PluginError::Disconnected(format!("the GPIO chip {chip} cannot be reached: {error}"))),
    }
}

fn chips_there_are() -> Vec<String> {
    let entries = std::fs::read_dir("/dev").into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut chips: Vec<String> = names
        .filter(|name| name.starts_with("gpiochip"))
        .map(|name| Path::new("/dev").join(name).display().to_string())
        .collect();
    chips.sort();
    chips
}

fn no_chip(chip: &str, error: &Error) -> PluginError {
    let text = error.to_string();
    if text.to_lowercase().contains("permission denied") {
        return PluginError::Disconnected(format!(
            "the GPIO chip {chip} may not be opened; add this user to the group that owns it (often gpio) and log in again"
        ));
    }
    PluginError::Refused(format!("{chip} is no GPIO chip ({text}); ls /dev/gpiochip* shows those there are"))
}

fn no_line(setting: &GpioSetting, error: &Error) -> PluginError {
    let GpioSetting { chip, line } = setting;
    let text = error.to_string();
    if text.to_lowercase().contains("busy") {
        return PluginError::Disconnected(format!(
            "line {line} of the GPIO chip {chip} is in use by another program or by the kernel (gpioinfo names it); end that, or wire the sensor to another line"
        ));
    }
    PluginError::Disconnected(format!("line {line} of the GPIO chip {chip} cannot be watched: {text}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(chip: &str) -> String {
        GpioLine::open(&GpioSetting { chip: chip.to_owned(), line: 3 }).unwrap_err().to_string()
    }

    #[test]
    fn a_chip_that_is_not_there_is_named_with_those_that_are() {
        let text = refusal("/dev/gpiochip9");
        assert!(text.starts_with("there is no GPIO chip /dev/gpiochip9; "), "{text}");
        assert!(text.contains("this computer has none") || text.contains("there is /dev/gpiochip"), "{text}");
    }

    #[test]
    fn a_file_that_is_no_chip_is_said_to_be_none() {
        let text = refusal("/dev/null");
        assert!(text.starts_with("/dev/null is no GPIO chip ("), "{text}");
    }
}
