//! Serial ports: may they be used.

use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use nix::unistd::{AccessFlags, access};
use plumb_cell::expression::Calculator;
use plumb_cell::workcell::load_workcell;

use super::finding::Finding;

const TOPIC: &str = "serial ports";

/// How the system calls ports of adapters and boards. Those of the mainboard (`ttyS0`) are there although nothing is behind them.
const ADAPTERS: [&str; 2] = ["ttyUSB", "ttyACM"];

/// The ports of adapters, and those that the given cells name.
pub(super) fn look(cells: &[PathBuf]) -> Vec<Finding> {
    let mut ports = adapters();
    for port in cells.iter().flat_map(|cell| named_in(cell)) {
        if !ports.contains(&port) {
            ports.push(port);
        }
    }
    if ports.is_empty() {
        return vec![Finding::good(TOPIC, "none is plugged in; a simulated cell needs none")];
    }
    ports.iter().map(|port| finding(port)).collect()
}

fn adapters() -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir("/dev") else { return Vec::new() };
    let is_adapter = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        ADAPTERS.iter().any(|adapter| name.starts_with(adapter))
    };
    let mut ports: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_adapter).collect();
    ports.sort();
    ports
}

/// The ports that a cell's devices are configured with. A cell file with mistakes names none: `plumb check` reports those.
fn named_in(cell: &Path) -> Vec<PathBuf> {
    let Ok(cell) = load_workcell(cell, &Calculator::new()) else { return Vec::new() };
    let ports =
        cell.devices.iter().filter_map(|device| device.config.get("port")?.as_str().map(PathBuf::from));
    ports.collect()
}

fn finding(port: &Path) -> Finding {
    let name = port.display();
    let Ok(metadata) = fs::metadata(port) else {
        let mend = "plug the adapter in, switch the controller on, and compare with `ls /dev/tty*`";
        return Finding::wrong(TOPIC, format!("{name} is not there"), mend);
    };
    match access(port, AccessFlags::R_OK | AccessFlags::W_OK) {
        Ok(()) => Finding::good(TOPIC, format!("{name} may be read and written")),
        Err(error) => {
            let group = group_name(metadata.gid()).unwrap_or_else(|| "dialout".to_owned());
            let mend = format!("sudo usermod -aG {group} $USER, then log out and in again");
            Finding::wrong(
                TOPIC,
                format!("{name} may not be used: {error}; it belongs to the group {group}"),
                mend,
            )
        }
    }
}

fn group_name(number: u32) -> Option<String> {
    let groups = fs::read_to_string("/etc/group").ok()?;
    groups.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)?.parse::<u32>().ok()? == number).then(|| name.to_owned())
    })
}
