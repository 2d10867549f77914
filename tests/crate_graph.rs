//! The house's floors: each crate uses only those below it, and the simulated world depends on the plugin contract alone.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[path = "drivers_apart.rs"]
mod drivers_apart;

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

/// From the ground up.
const FLOORS: [&str; 19] = [
    "plumb-document",
    "plumb-abi",
    "plumb-serial-line",
    "plumb-plugin",
    "plumb-kinematics",
    "plumb-cloud",
    "plumb-estimation",
    "plumb-calibration",
    "plumb-diagnosis",
    "plumb-standards",
    "plumb-bus",
    "plumb-host",
    "plumb-record",
    "plumb-central",
    "plumb-cell",
    "plumb-report",
    "plumb-simulated",
    "plumb",
    "plumb-studies",
];

/// The product, and the research behind its manual: they alone know plugins.
const PROGRAMS: [&str; 2] = ["plumb", "plumb-studies"];

/// What each crate of the workspace uses of the others: to build, and for its tests besides.
struct Graph {
    builds_on: BTreeMap<String, BTreeSet<String>>,
    tests_with: BTreeMap<String, BTreeSet<String>>,
    plugins: BTreeSet<String>,
}

fn graph() -> Graph {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let mut graph =
        Graph { builds_on: BTreeMap::new(), tests_with: BTreeMap::new(), plugins: BTreeSet::new() };
    let packages = metadata["packages"].as_array().unwrap();
    let name = |package: &serde_json::Value| package["name"].as_str().unwrap().to_owned();
    let ours: BTreeSet<String> = packages.iter().map(name).collect();
    for package in packages {
        if package["manifest_path"].as_str().unwrap().contains("/plugins/") {
            graph.plugins.insert(name(package));
        }
        let uses = |test: bool| -> BTreeSet<String> {
            let dependencies = package["dependencies"].as_array().unwrap();
            let expected = dependencies.iter().filter(|one| (one["kind"] == "dev") == test);
            expected.map(name).filter(|one| ours.contains(one)).collect()
        };
        graph.builds_on.insert(name(package), uses(false));
        graph.tests_with.insert(name(package), uses(true));
    }
    graph
}

impl Graph {
    /// Everything below a crate.
    fn below(&self, name: &str) -> BTreeSet<String> {
        let mut found = BTreeSet::new();
        let mut open = vec![name.to_owned()];
        while let Some(next) = open.pop() {
            for used in self.builds_on.get(&next).into_iter().flatten() {
                if found.insert(used.clone()) {
                    open.push(used.clone());
                }
            }
        }
        found
    }
}

#[test]
fn plugins_and_the_world_depend_on_the_plugin_contract_and_the_serial_line_alone() {
    let graph = graph();
    assert!(graph.plugins.contains("plumb-simulated"));
    let allowed: BTreeSet<String> =
        ["plumb-abi", "plumb-document", "plumb-plugin", "plumb-serial-line"].map(str::to_owned).into();
    assert_eq!(graph.below("plumb-serial-line"), BTreeSet::new(), "the serial line knows nothing of plumb");
    for plugin in &graph.plugins {
        // The camera on a simulated hand is a client of the world, and speaks its protocol.
        let world = "plumb-simulated".to_owned();
        let of_the_world = plugin == "plumb-simulated-camera";
        let below = graph.below(plugin).into_iter().filter(|one| !(of_the_world && *one == world));
        let extra: Vec<_> = below.filter(|one| !allowed.contains(one)).collect();
        assert!(extra.is_empty(), "{plugin} builds on {extra:?}");
    }
}

#[test]
fn the_core_knows_no_plugin() {
    let graph = graph();
    for name in graph
        .builds_on
        .keys()
        .filter(|name| !PROGRAMS.contains(&name.as_str()) && !graph.plugins.contains(*name))
    {
        let known: Vec<_> = graph.below(name).intersection(&graph.plugins).cloned().collect();
        assert!(known.is_empty(), "{name} is built on {known:?}");
        let tested: Vec<_> = graph.tests_with[name].intersection(&graph.plugins).cloned().collect();
        assert!(
            tested.is_empty(),
            "tests of {name} know {tested:?}: whole-program tests belong under tests/"
        );
    }
}

#[test]
fn the_product_holds_nothing_of_the_studies() {
    assert!(!graph().below("plumb").contains("plumb-studies"));
}

#[test]
fn each_floor_uses_only_those_below_it() {
    let graph = graph();
    let floor = |name: &str| FLOORS.iter().position(|one| *one == name);
    for (name, uses) in &graph.builds_on {
        let Some(own) = floor(name) else { continue };
        for used in uses {
            let below = floor(used).is_none_or(|other| other < own);
            assert!(below, "{name} uses {used}, which is above it");
        }
    }
}
