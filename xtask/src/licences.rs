//! The licences of the libraries that are built into plumb: most of them have to come with it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

/// The beginnings of the names of files that hold a licence.
const NAMES: [&str; 5] = ["LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE"];

/// One text with every licence: each once, under the libraries it is of. `metadata` is what `cargo metadata` says.
pub(crate) fn third_party(metadata: &Value) -> String {
    let packages = list(metadata, "packages");
    let ours: BTreeSet<&str> =
        list(metadata, "workspace_default_members").iter().filter_map(Value::as_str).collect();
    let built_in = built_in(metadata, &ours);
    let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut without = Vec::new();
    for package in packages {
        let id = package["id"].as_str().unwrap_or_default();
        if ours.contains(id) || package["source"].is_null() || !built_in.contains(id) {
            continue;
        }
        let message = |key: &str| package[key].as_str().unwrap_or("not said").to_owned();
        let name = format!("{} {} ({})", message("name"), message("version"), message("license"));
        let found = Path::new(&message("manifest_path")).parent().map(licences_in).unwrap_or_default();
        if found.is_empty() {
            without.push(format!("{name}, {}", message("repository")));
        }
        for text in found {
            texts.entry(text).or_default().push(name.clone());
        }
    }
    written(&texts, &without)
}

fn written(texts: &BTreeMap<String, Vec<String>>, without: &[String]) -> String {
    let mut whole = String::from("Libraries that are built into plumb, and their licences.\n");
    for (text, names) in texts {
        let _ = write!(whole, "\n{0}\n{1}\n{0}\n\n{2}\n", "=".repeat(78), names.join("\n"), text);
    }
    if !without.is_empty() {
        let _ = write!(
            whole,
            "\n{0}\nWithout a file of their licence; its name is in brackets:\n{1}\n",
            "=".repeat(78),
            without.join("\n")
        );
    }
    whole
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().map_or(&[], Vec::as_slice)
}

/// Everything that ours are built with, tests and build scripts left out.
fn built_in<'a>(metadata: &'a Value, ours: &BTreeSet<&'a str>) -> BTreeSet<&'a str> {
    let nodes = list(&metadata["resolve"], "nodes");
    let mut found = ours.clone();
    let mut open: Vec<&str> = ours.iter().copied().collect();
    while let Some(id) = open.pop() {
        let Some(node) = nodes.iter().find(|node| node["id"] == id) else { continue };
        for dependency in list(node, "deps") {
            let is_normal = list(dependency, "dep_kinds").iter().any(|kind| kind["kind"].is_null());
            if let Some(used) = dependency["pkg"].as_str().filter(|used| is_normal && found.insert(used)) {
                open.push(used);
            }
        }
    }
    found
}

/// The texts of the licences in a library's folder.
fn licences_in(folder: &Path) -> Vec<String> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let is_licence = |path: &Path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_uppercase();
        path.is_file() && NAMES.iter().any(|beginning| name.starts_with(beginning))
    };
    let mut paths: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.retain(|path| is_licence(path));
    paths.sort();
    paths.iter().filter_map(|path| Some(fs::read_to_string(path).ok()?.trim().to_owned())).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn libraries_that_are_only_tested_with_are_left_out_and_the_same_text_is_given_once() {
        let directory = tempfile::tempdir().unwrap();
        let package = |name: &str| {
            let folder = directory.path().join(name);
            fs::create_dir(&folder).unwrap();
            fs::write(folder.join("LICENSE-MIT"), "the same words\n").unwrap();
            json!({"id": name, "name": name, "version": "1", "license": "MIT", "source": "registry", "manifest_path": folder.join("Cargo.toml")})
        };
        let used = |name: &str, kind: Value| json!({"pkg": name, "dep_kinds": [{"kind": kind}]});
        let metadata = json!({
            "packages": [package("a"), package("b"), package("test-only"), {"id": "plumb", "source": null}],
            "workspace_default_members": ["plumb"],
            "resolve": {"nodes": [
                {"id": "plumb", "deps": [used("a", Value::Null), used("test-only", json!("dev"))]},
                {"id": "a", "deps": [used("b", Value::Null)]},
            ]},
        });
        let text = third_party(&metadata);
        assert!(text.contains("a 1 (MIT)\nb 1 (MIT)\n"), "{text}");
        assert_eq!(text.matches("the same words").count(), 1, "{text}");
        assert!(!text.contains("test-only"), "{text}");
    }
}
