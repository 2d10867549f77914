//! Plugins: which are found, and whether they are right.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use plumb_cell::expression::Calculator;
use plumb_cell::workcell::load_workcell;
use plumb_host::{Catalogue, CatalogueError};

use super::finding::Finding;

const TOPIC: &str = "plugins";

/// What plugins are for, and what does without them.
const FOR_WHAT: &str =
    "a cell needs that of each of its devices; the model lab, records and reports need none";

/// How plugins of this program come to be where it finds them.
const BUILD: &str =
    "cargo build --release builds them beside the program; cargo xtask package makes plumb with all of them";

/// The plugins that are found in these directories too, and those that the given cells need.
pub(super) fn look(directories: &[PathBuf], cells: &[PathBuf]) -> Vec<Finding> {
    let catalogue = Catalogue::search(directories);
    let mut findings = Vec::new();
    let mut needed = BTreeSet::new();
    for cell in cells {
        findings.extend(of_cell(cell, directories, &mut needed));
    }
    let is_usable = |id: &str| catalogue.plugins().any(|plugin| plugin.manifest.id == id);
    let mut not_built: Vec<&str> = Vec::new();
    for row in catalogue.rows() {
        match &row.plugin {
            Ok(plugin) => {
                let manifest = &plugin.manifest;
                findings.push(Finding::good(
                    TOPIC,
                    format!("{} {}, contract {}", manifest.id, manifest.version, manifest.contract),
                ));
            }
            // Found elsewhere with its library, or reported with the cell that needs it.
            Err(CatalogueError::NoLibrary { id, .. }) if is_usable(id) || needed.contains(id) => {}
            Err(CatalogueError::NoLibrary { id, .. }) => not_built.push(id),
            Err(error) => findings.push(Finding::wrong(
                TOPIC,
                error.to_string(),
                "plumb plugins verify says more; other plugins work all the same",
            )),
        }
    }
    if !not_built.is_empty() {
        let text = format!("not built: {}; {FOR_WHAT}", not_built.join(", "));
        findings.push(Finding::note(TOPIC, text).mend(BUILD));
    }
    if catalogue.rows().is_empty() {
        findings.push(none_found(&catalogue));
    }
    findings
}

/// That no plugin is found at all.
fn none_found(catalogue: &Catalogue) -> Finding {
    let directories: Vec<String> =
        catalogue.directories().iter().map(|path| path.display().to_string()).collect();
    let mend = format!(
        "put them beside the program or name their directory with --plugins; looked in {}",
        directories.join(", ")
    );
    Finding::note(TOPIC, format!("none is found; {FOR_WHAT}")).mend(mend)
}

/// What a cell needs and cannot have. A cell file with mistakes needs nothing: `plumb check` reports those.
fn of_cell(cell: &Path, directories: &[PathBuf], needed: &mut BTreeSet<String>) -> Vec<Finding> {
    let Ok(workcell) = load_workcell(cell, &Calculator::new()) else { return Vec::new() };
    let named: Vec<PathBuf> = directories.iter().chain(&workcell.plugins).cloned().collect();
    let catalogue = Catalogue::search_for_cell(&named, Some(cell));
    let mut findings = Vec::new();
    for device in &workcell.devices {
        let is_new = needed.insert(device.plugin.clone());
        if let (true, Err(error)) = (is_new, catalogue.find(&device.plugin)) {
            let text = format!("{}: device {}: {error}", cell.display(), device.name);
            findings.push(Finding::wrong(TOPIC, text, BUILD));
        }
    }
    findings
}
