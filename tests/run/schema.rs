//! `plumb schema`: what editors complete with is held against the files and against what reads them.

use std::fs;
use std::path::{Path, PathBuf};

use plumb_cell::device::check_plugins;
use plumb_cell::expression::Calculator;
use plumb_cell::workcell::load_workcell;
use plumb_cell::{check_file, kind_of_file};
use plumb_document::DocumentKind;
use plumb_host::Catalogue;
use serde_json::{Value, json};

use crate::lab::Lab;

fn schema(lab: &Lab, kind: &str) -> jsonschema::Validator {
    let said = lab.plumb(&["schema", kind]);
    assert_eq!(said.code(), 0, "{}", said.all());
    let schema: Value = serde_json::from_str(&said.out()).unwrap();
    jsonschema::draft7::meta::validate(&schema).unwrap_or_else(|error| panic!("{kind}: {error}"));
    jsonschema::validator_for(&schema).unwrap()
}

/// The kind of a file as the command names it; none of those that have no schema.
fn kind_of(value: &Value) -> Option<&'static str> {
    let is_study = value.get("study").is_some();
    ["cell", "procedure", "answers"].into_iter().find(|kind| !is_study && value.get(*kind).is_some())
}

/// Every YAML file under a folder, as JSON.
fn files(folder: &Path) -> Vec<(PathBuf, Value)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|extension| extension == "yaml") {
            let text = fs::read_to_string(&path).unwrap();
            found.push((path, serde_yaml::from_str(&text).unwrap()));
        }
    }
    found
}

fn problems(validator: &jsonschema::Validator, value: &Value) -> Vec<String> {
    validator.iter_errors(value).map(|error| format!("{}: {error}", error.instance_path())).collect()
}

#[test]
fn every_shipped_cell_procedure_and_answers_file_fits_its_schema() {
    let lab = Lab::new();
    let mut checked = 0;
    for (path, value) in files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../workcells")) {
        let Some(kind) = kind_of(&value) else { continue };
        assert_eq!(problems(&schema(&lab, kind), &value), [] as [&str; 0], "{}", path.display());
        checked += 1;
    }
    assert!(checked > 8, "the shipped files were found");
}

#[test]
fn mistakes_are_found_while_one_types() {
    let lab = Lab::new();
    let device = |device: Value| json!({"cell": "a", "devices": {"arm": device}, "procedures": ["p.yaml"]});
    let step = |action: Value| json!({"procedure": "p", "steps": [{"id": "a", "do": action}]});
    let bad = [
        ("cell", json!({"cell": "a", "devices": {}, "procedures": []}), "has less than 1 property"),
        (
            "cell",
            json!({"cell": "a b", "devices": {"arm": {"plugin": "simulated", "config": {"arm": "teachmover"}}}, "procedures": []}),
            "does not match",
        ),
        ("cell", device(json!({"plugin": "simulatd"})), "simulatd"),
        ("cell", device(json!({"plugin": "simulated"})), "\"config\" is a required property"),
        ("cell", device(json!({"plugin": "simulated", "config": {"arm": 560}})), "560"),
        (
            "cell",
            device(
                json!({"plugin": "ir-proximity", "config": {"bit": 99}, "inputs": {"line": "arm/inputs"}}),
            ),
            "99",
        ),
        (
            "cell",
            device(json!({"plugin": "ir-proximity", "config": {"bit": 0}, "inputs": {"lime": "arm/inputs"}})),
            "'lime' was unexpected",
        ),
        ("cell", device(json!({"plugin": "teachmover", "config": {"prot": "/dev/ttyUSB0"}})), "prot"),
        (
            "cell",
            device(json!({"plugin": "ir-proximity", "config": {"bit": 0}, "inputs": {"line": "arm-inputs"}})),
            "does not match",
        ),
        ("procedure", step(json!({"mvoe": {"robot": "arm", "by_deg": {"waist": 5}}})), "mvoe"),
        ("procedure", step(json!({"move": {"robot": "arm", "by": {"waist": 5}}})), "'by' was unexpected"),
        ("procedure", step(json!({"move": {"robot": "arm"}})), "is not valid under any"),
        (
            "procedure",
            step(
                json!({"search": {"robot": "arm", "joint": "waist", "until": {"sensor": "eye", "is": "dark"}, "travel_deg": 5}}),
            ),
            "dark",
        ),
        ("procedure", json!({"procedure": "p", "steps": []}), "less than 1 item"),
        ("answers", json!({"answers": {"place": {"pose": {"waist": 5}}}}), ""),
        ("answers", json!({"answers": {}, "on_error": {"lower": "ask"}}), "ask"),
    ];
    for (kind, value, message) in bad {
        let found = problems(&schema(&lab, kind), &value);
        assert!(found.iter().any(|problem| problem.contains(message)), "{value} in {kind}: {found:?}");
    }
}

/// Every place in a tree where a key can be taken away or misspelt.
fn spoilt(value: &Value) -> Vec<Value> {
    let mut trees = Vec::new();
    match value {
        Value::Object(entries) => {
            for key in entries.keys() {
                let mut without = entries.clone();
                let taken = without.shift_remove(key).unwrap();
                trees.push(Value::Object(without.clone()));
                without.insert(format!("{key}_zz"), taken);
                trees.push(Value::Object(without));
                for inner in spoilt(&entries[key]) {
                    let mut changed = entries.clone();
                    changed.insert(key.clone(), inner);
                    trees.push(Value::Object(changed));
                }
            }
        }
        Value::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                for inner in spoilt(item) {
                    let mut changed = items.clone();
                    changed[index] = inner;
                    trees.push(Value::Array(changed));
                }
            }
        }
        _ => {}
    }
    trees
}

/// Whether the program finds nothing wrong with a file, as `plumb check` looks at it.
fn is_taken(file: &Path, kind: DocumentKind, calculator: &Calculator, catalogue: &Catalogue) -> bool {
    let fits_plugins =
        || load_workcell(file, calculator).is_ok_and(|cell| check_plugins(&cell, catalogue).is_ok());
    check_file(file, kind, calculator).is_ok() && (kind != DocumentKind::Cell || fits_plugins())
}

#[test]
fn whatever_the_program_takes_its_schema_takes_too() {
    let lab = Lab::new();
    let mut taken = 0;
    let catalogue = Catalogue::search(&[]);
    for name in [
        "procedures/shoulder-elbow-initialization.yaml",
        "procedures/initialize.yaml",
        "cell.yaml",
        "answers.yaml",
    ] {
        let text = fs::read_to_string(lab.path(name)).unwrap();
        let value: Value = serde_yaml::from_str(&text).unwrap();
        let validator = schema(&lab, kind_of(&value).unwrap());
        let calculator = Calculator::new();
        let file = lab.path(&name.replace(".yaml", "-spoilt.yaml"));
        for tree in spoilt(&value) {
            fs::write(&file, tree.to_string()).unwrap();
            let kind = kind_of_file(&file);
            if kind.is_ok_and(|kind| is_taken(&file, kind, &calculator, &catalogue)) {
                taken += 1;
                assert_eq!(problems(&validator, &tree), [] as [&str; 0], "{name}: {tree}");
            }
        }
        fs::remove_file(&file).unwrap();
    }
    assert!(taken > 20, "some keys may be left out: {taken}");
}
