//! Plugins: which are found, and whether they are right.

use std::path::PathBuf;

use plumb_host::Catalogue;

use super::finding::Finding;

const TOPIC: &str = "plugins";

pub(super) fn look(directories: &[PathBuf]) -> Vec<Finding> {
    let catalogue = Catalogue::search(directories);
    if catalogue.rows().is_empty() {
        let places: Vec<String> =
            catalogue.directories().iter().map(|path| path.display().to_string()).collect();
        let mend = format!(
            "put them beside the program or name their directory with --plugins; looked in {}",
            places.join(", ")
        );
        return vec![Finding::wrong(TOPIC, "none is found", mend)];
    }
    let mut findings = Vec::new();
    for row in catalogue.rows() {
        findings.push(match &row.plugin {
            Ok(plugin) => {
                let manifest = &plugin.manifest;
                Finding::good(
                    TOPIC,
                    format!("{} {}, contract {}", manifest.id, manifest.version, manifest.contract),
                )
            }
            Err(error) => Finding::wrong(
                TOPIC,
                error.to_string(),
                "plumb plugins verify says more; other plugins work all the same",
            ),
        });
    }
    findings
}
