//! `plumb schema`: what editors complete with is held against the files and against what reads them; that of events against real runs.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use plumb::commands::study::study_file::StudyFile;
use plumb_cell::expression::Calculator;
use plumb_cell::workcell::load_workcell;
use plumb_cell::{check_cell, check_file, kind_of_file};
use plumb_diagnosis::stripe::read_scene;
use plumb_document::{DocumentKind, Problems, parse, typed};
use plumb_host::Catalogue;
use plumb_light_stripe::geometry::read_rig;
use plumb_plugin::Manifest;
use plumb_simulated::world_file;
use serde_json::{Value, json};

use crate::lab::Lab;

/// With the plugins of the examples, which have cells of their own.
pub(crate) fn schema(lab: &Lab, kind: &str) -> jsonschema::Validator {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../plugins/bridge/examples");
    let output = lab.plumb(&["schema", kind, "--plugins", examples]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let schema: Value = serde_json::from_str(&output.out()).unwrap();
    jsonschema::draft7::meta::validate(&schema).unwrap_or_else(|error| panic!("{kind}: {error}"));
    jsonschema::validator_for(&schema).unwrap()
}

/// The kind of a file as the command names it.
fn kind_of(path: &Path) -> &'static str {
    if path.to_string_lossy().ends_with(".arm.yaml") {
        return "arm";
    }
    match kind_of_file(path).unwrap() {
        DocumentKind::Cell => "cell",
        DocumentKind::Procedure => "procedure",
        DocumentKind::Answers => "answers",
        DocumentKind::Model => "model",
        DocumentKind::World => "world",
        DocumentKind::Study => "study",
        DocumentKind::Rig => "rig",
        DocumentKind::Scene => "scene",
        DocumentKind::Manifest => "manifest",
    }
}

/// The schemas of files, as `plumb schema` knows them.
const KINDS: [&str; 10] =
    ["cell", "procedure", "answers", "model", "world", "arm", "rig", "scene", "manifest", "study"];

/// A file as JSON, read as the program and YAML 1.2 read it: `on` is a word.
fn value_of(path: &Path) -> Value {
    let problems = Problems::default();
    let text = fs::read_to_string(path).unwrap();
    let root = parse(path, &text, &problems).unwrap_or_else(|error| panic!("{error}"));
    typed(&root, "a file", &problems).unwrap()
}

/// Every YAML file under a folder, as JSON.
fn files(folder: &Path) -> Vec<(PathBuf, Value)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        // Tests hold files that are wrong on purpose, and languages of their own.
        if path.is_dir() && path.file_name().is_some_and(|name| name != "tests") {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|extension| extension == "yaml") {
            let value = value_of(&path);
            found.push((path, value));
        }
    }
    found
}

pub(crate) fn problems(validator: &jsonschema::Validator, value: &Value) -> Vec<String> {
    validator.iter_errors(value).map(|error| format!("{}: {error}", error.instance_path())).collect()
}

#[test]
fn every_shipped_file_fits_the_schema_of_its_kind() {
    let lab = Lab::new();
    let schemas: BTreeMap<&str, jsonschema::Validator> =
        KINDS.iter().map(|kind| (*kind, schema(&lab, kind))).collect();
    let mut checked: BTreeMap<&str, usize> = BTreeMap::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for folder in
        ["workcells", "plugins", "core/calibration/robots", "core/abi/examples", "core/host/examples"]
    {
        for (path, value) in files(&root.join(folder)) {
            let kind = kind_of(&path);
            assert_eq!(problems(&schemas[kind], &value), [] as [&str; 0], "{}", path.display());
            *checked.entry(kind).or_default() += 1;
        }
    }
    assert_eq!(
        checked.keys().copied().collect::<BTreeSet<_>>(),
        KINDS.into(),
        "each kind was found: {checked:?}"
    );
}

#[test]
fn of_every_key_at_the_top_of_a_file_it_is_said_what_it_is() {
    let lab = Lab::new();
    for kind in KINDS {
        let schema: Value = serde_json::from_str(&lab.plumb(&["schema", kind]).out()).unwrap();
        assert!(schema["title"].is_string(), "{kind}");
        for (key, property) in schema["properties"].as_object().unwrap() {
            let is_described = property["description"].is_string() || property["$ref"].is_string();
            assert!(is_described, "{key} of {kind}: {property}");
        }
    }
}

#[test]
fn every_event_of_real_runs_fits_the_schema_of_events_and_has_no_key_that_it_does_not_name() {
    let lab = Lab::new();
    let validator = schema(&lab, "events");
    let text: Value = serde_json::from_str(&lab.plumb(&["schema", "events"]).out()).unwrap();
    let named: BTreeMap<&str, &Value> = text["oneOf"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| (one["properties"]["event"]["const"].as_str().unwrap(), &one["properties"]))
        .collect();
    // The program lists its events where one is misspelled.
    let refused = lab.plumb(&["run", "cell.yaml", "--json", "--events", "?"]).err();
    for event in named.keys() {
        assert!(refused.contains(&format!("`{event}`")), "{event}: {refused}");
    }
    assert_eq!(refused.split("there are").nth(1).unwrap().matches("`").count(), 2 * named.len(), "{refused}");
    let mut seen = BTreeSet::new();
    let mut look = |output: &str| {
        for line in output.lines() {
            let event: Value = serde_json::from_str(line).unwrap();
            assert_eq!(problems(&validator, &event), [] as [&str; 0], "{line}");
            let name = event["event"].as_str().unwrap();
            for key in event.as_object().unwrap().keys() {
                let is_common = ["sequence", "time", "event"].contains(&key.as_str());
                assert!(
                    is_common || named[name].get(key).is_some(),
                    "`{key}` of {name} is not in the schema"
                );
            }
            seen.insert(name.to_owned());
        }
    };
    look(&lab.plumb(&["run", "cell.yaml", "--json"]).out());
    // Found nothing, and tried again twice.
    lab.edit("world-ideal.yaml", "waist_deg: 11,", "waist_deg: -60,");
    look(&lab.plumb(&["run", "cell.yaml", "--json", "--record", "fails"]).out());
    let stripes = Lab::of("light-stripe");
    look(&stripes.plumb(&["run", "cell.yaml", "scan-pyramid", "--json"]).out());
    let expected = [
        "clearance",
        "correction_applied",
        "correction_proposed",
        "device",
        "joints",
        "planned",
        "prompt_answered",
        "prompt_asked",
        "run_ended",
        "run_started",
        "signal",
        "step_finished",
        "step_started",
        "stripe_taken",
        "trigger_found",
    ];
    for event in expected {
        assert!(seen.contains(event), "{event}: {seen:?}");
    }
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

/// Every position in a tree where a key can be taken away or misspelt.
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
fn is_taken(file: &Path, kind: &str, catalogue: &Catalogue) -> bool {
    let calculator = Calculator::new();
    let fits_plugins =
        || load_workcell(file, &calculator).is_ok_and(|cell| check_cell(&cell, catalogue, &[], &[]).is_ok());
    match kind {
        "world" => world_file::read(file).is_ok(),
        "rig" => read_rig(file).is_ok(),
        "scene" => read_scene(file).is_ok(),
        "manifest" => Manifest::read(file).is_ok(),
        "study" => StudyFile::read(file, "study").is_ok(),
        "cell" => check_file(file, DocumentKind::Cell, &calculator).is_ok() && fits_plugins(),
        _ => kind_of_file(file).is_ok_and(|kind| check_file(file, kind, &calculator).is_ok()),
    }
}

#[test]
fn whatever_the_program_takes_its_schema_takes_too() {
    let labs = [Lab::new(), Lab::of("light-stripe"), Lab::of("scara")];
    let [teachmover, stripe, scara] = &labs;
    let catalogue = Catalogue::search(&[]);
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../plugins/ir-proximity/plugin.yaml");
    fs::copy(manifest, teachmover.path("plugin.yaml")).unwrap();
    // Each with how many of its keys may at least be taken away.
    for (lab, name, least) in [
        (teachmover, "procedures/shoulder-elbow-initialization.yaml", 5),
        (teachmover, "procedures/initialize.yaml", 1),
        (teachmover, "cell.yaml", 5),
        (teachmover, "answers.yaml", 1),
        (teachmover, "trial.model.yaml", 20),
        (teachmover, "world-worn.yaml", 10),
        (teachmover, "studies/methods.yaml", 5),
        (teachmover, "plugin.yaml", 5),
        (stripe, "rig.yaml", 0),
        (stripe, "scene.yaml", 0),
        (stripe, "world.yaml", 5),
        (scara, "world.yaml", 3),
    ] {
        let value = value_of(&lab.path(name));
        let kind = kind_of(&lab.path(name));
        let validator = schema(lab, kind);
        let file = lab.path(&name.replace(".yaml", "-spoilt.yaml"));
        let mut taken = 0;
        for tree in spoilt(&value) {
            fs::write(&file, tree.to_string()).unwrap();
            if is_taken(&file, kind, &catalogue) {
                taken += 1;
                assert_eq!(problems(&validator, &tree), [] as [&str; 0], "{name}: {tree}");
            }
        }
        fs::remove_file(&file).unwrap();
        assert!(taken >= least, "some keys of {name} may be left out: {taken}");
    }
}

#[test]
fn keys_that_readers_refuse_their_schemas_refuse() {
    let labs = [Lab::new(), Lab::of("light-stripe")];
    for (lab, name) in [
        (0, "trial.model.yaml"),
        (0, "world-worn.yaml"),
        (0, "studies/methods.yaml"),
        (1, "rig.yaml"),
        (1, "scene.yaml"),
        (1, "world.yaml"),
    ] {
        let lab = &labs[lab];
        let value = value_of(&lab.path(name));
        let validator = schema(lab, kind_of(&lab.path(name)));
        let keys: Vec<String> = value.as_object().unwrap().keys().cloned().collect();
        for key in keys {
            let mut misspelt = value.clone();
            let entries = misspelt.as_object_mut().unwrap();
            let taken = entries.shift_remove(&key).unwrap();
            entries.insert(format!("{key}_zz"), taken);
            assert!(!problems(&validator, &misspelt).is_empty(), "{key}_zz in {name}");
        }
    }
}
