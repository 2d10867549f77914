//! Plugins that cannot be had: each is one clear line.

use std::fs;
use std::path::{Path, PathBuf};

use plumb_host::{Catalogue, HostArguments, LoadError, Plugin, WiredInput, verify};
use plumb_plugin::{ContractVersion, Manifest, StreamDescription, Value};

use crate::test_folder::{TestFolder, example_file, plugin};

/// The misbehaving robot's library and manifest, copied and changed.
fn changed(folder: &TestFolder, library: &str, change: impl Fn(String) -> String) -> Plugin {
    let original = plugin("misbehaving_robot");
    let manifest_path = folder.directory.path().join("plugin.yaml");
    let text = fs::read_to_string(&original.manifest_path).unwrap();
    fs::write(&manifest_path, change(text)).unwrap();
    let library_path = folder.directory.path().join(library);
    fs::copy(&original.library_path, &library_path).unwrap();
    Plugin::at_library(&manifest_path, &library_path).unwrap()
}

fn arguments(folder: &TestFolder, plugin: &Plugin) -> HostArguments {
    HostArguments::new("arm", &folder.domain, plugin)
}

#[test]
fn a_file_that_is_no_library_is_refused() {
    let folder = TestFolder::new();
    let plugin = changed(&folder, "libmisbehaving_robot.so", |text| text);
    fs::write(&plugin.library_path, "this is no library").unwrap();
    let path = plugin.library_path.display();
    let message = folder.refusal(&arguments(&folder, &plugin));
    assert!(message.starts_with(&format!("arm: {path}: is not a library that can be loaded: ")), "{message}");
}

#[test]
fn a_library_that_is_gone_is_named() {
    let folder = TestFolder::new();
    let plugin = changed(&folder, "libmisbehaving_robot.so", |text| text);
    fs::remove_file(&plugin.library_path).unwrap();
    let message = folder.refusal(&arguments(&folder, &plugin));
    assert!(message.contains("libmisbehaving_robot.so: is not a library that can be loaded"), "{message}");
}

#[test]
fn a_library_without_an_entry_is_refused_with_the_symbol_it_lacks() {
    let folder = TestFolder::new();
    let plugin = changed(&folder, "libother.so", |text| text);
    let error = verify(&plugin).unwrap_err();
    assert_eq!(
        error,
        LoadError::NoEntry { library: plugin.library_path.clone(), symbol: "plumb_plugin_other".to_owned() }
    );
    assert!(error.to_string().ends_with(
        "is not a plugin: it has no symbol plumb_plugin_other (a library that is renamed loses it)"
    ));
}

#[test]
fn a_manifest_of_another_contract_is_refused_with_both_versions() {
    let folder = TestFolder::new();
    let plugin = changed(&folder, "libmisbehaving_robot.so", |text| text);
    let text = fs::read_to_string(&plugin.manifest_path).unwrap().replace("[1, 0]", "[2, 0]");
    fs::write(&plugin.manifest_path, text).unwrap();
    let message = folder.refusal(&arguments(&folder, &plugin));
    let path = plugin.manifest_path.display();
    assert_eq!(
        message,
        format!(
            "arm: {path}: plugin 'misbehaving-robot' was built for contract 2.0; this program speaks {}: \
             rebuild the plugin against contract 1.x",
            ContractVersion::CURRENT
        )
    );
}

#[test]
fn a_library_older_than_its_manifest_is_refused() {
    let folder = TestFolder::new();
    let plugin =
        changed(&folder, "libmisbehaving_robot.so", |text| text.replace("version: 0.1.0", "version: 0.2.0"));
    let message = verify(&plugin).unwrap_err().to_string();
    assert!(
        message.ends_with(
            "does not belong to its plugin.yaml: the version is 0.2.0 in the file and 0.1.0 in the library; build the plugin again"
        ),
        "{message}"
    );
}

#[test]
fn a_library_of_another_minor_contract_than_its_manifest_is_refused_with_the_contract() {
    let folder = TestFolder::new();
    let plugin = changed(&folder, "libmisbehaving_robot.so", |text| text.replace("[1, 0]", "[1, 9]"));
    let message = verify(&plugin).unwrap_err().to_string();
    assert!(message.contains("the contract is 1.9 in the file and 1.0 in the library"), "{message}");
}

#[test]
fn a_driver_runs_in_the_library_for_drivers_and_in_no_other() {
    let folder = TestFolder::new();
    let plugin = changed(&folder, "libmisbehaving_robot.so", |text| {
        text.replace("library: libmisbehaving_robot.so", "driver: [python3, driver.py]")
    });
    let message = verify(&plugin).unwrap_err().to_string();
    assert!(
        message.contains("it names a driver, and the library is 'misbehaving-robot'; build the plugin again"),
        "{message}"
    );
}

#[test]
fn a_good_plugin_is_verified() {
    for example in ["misbehaving_robot", "line_watcher"] {
        assert_eq!(
            verify(&plugin(example)).unwrap(),
            [] as [&str; 0],
            "there is nothing to note of {example}"
        );
    }
}

#[test]
fn a_panic_in_create_is_one_line() {
    let folder = TestFolder::new();
    let message = folder.refusal(&folder.arguments(
        "arm",
        "misbehaving_robot",
        serde_json::json!({"fault": "panic", "in": "create"}),
    ));
    assert!(message.starts_with("arm: the plugin panicked at "), "{message}");
    assert!(message.ends_with(": the robot lost its head"), "{message}");
    assert_eq!(message.lines().count(), 1);
}

#[test]
fn a_refused_configuration_is_reported_in_the_plugins_words() {
    let folder = TestFolder::new();
    let config = serde_json::json!({"fault": "refuse", "in": "create"});
    let message = folder.refusal(&folder.arguments("arm", "misbehaving_robot", config));
    assert_eq!(message, "arm: the robot does not want to");
}

#[test]
fn a_crash_in_create_is_named() {
    let folder = TestFolder::new();
    let config = serde_json::json!({"fault": "abort", "in": "create"});
    let message = folder.refusal(&folder.arguments("arm", "misbehaving_robot", config));
    assert_eq!(message, "the host of arm was ended by SIGABRT before the device was ready");
}

#[test]
fn a_hang_in_create_is_ended() {
    let folder = TestFolder::new();
    let config = serde_json::json!({"fault": "hang", "in": "create"});
    let arguments = folder.arguments("arm", "misbehaving_robot", config);
    let command = crate::test_folder::command().ready_within(std::time::Duration::from_millis(300));
    let error = plumb_host::HostProcess::spawn(folder.bus(), &arguments, command).map(|host| host.process());
    assert_eq!(error.unwrap_err().to_string(), "arm was not ready within 300ms; its host was killed");
}

#[test]
fn a_robot_without_joints_is_refused() {
    let folder = TestFolder::new();
    let config = serde_json::json!({"fault": "refuse", "in": "describe"});
    let message = folder.refusal(&folder.arguments("arm", "misbehaving_robot", config));
    assert_eq!(message, "arm: the robot has 0 joints; 1 to 8 are possible");
}

#[test]
fn an_input_left_open_or_wired_wrongly_is_refused() {
    let folder = TestFolder::new();
    let mut arguments = folder.arguments("eye", "line_watcher", Value::Null);
    assert_eq!(folder.refusal(&arguments), "eye: input 'line' of eye is not wired to any stream");
    let joints: StreamDescription = crate::test_folder::stream("misbehaving_robot", "joints");
    arguments.inputs =
        vec![WiredInput { input: "line".to_owned(), device: "arm".to_owned(), stream: joints }];
    assert_eq!(
        folder.refusal(&arguments),
        "eye: input 'line' of eye takes digital-inputs/1 messages; arm/joints carries joint-state/1"
    );
    arguments.inputs[0].input = "lime".to_owned();
    assert_eq!(folder.refusal(&arguments), "eye: input 'line' of eye is not wired to any stream");
}

#[test]
fn a_program_that_is_no_host_is_named() {
    let folder = TestFolder::new();
    let arguments = folder.arguments("arm", "misbehaving_robot", Value::Null);
    let command = plumb_host::HostCommand::new(PathBuf::from("/bin/false"), [] as [&str; 0]);
    let error = plumb_host::HostProcess::spawn(folder.bus(), &arguments, command).map(|host| host.process());
    assert_eq!(
        error.unwrap_err().to_string(),
        "the host of arm ended with code 1 before the device was ready"
    );
}

#[test]
fn plugins_are_found_by_their_manifests_good_and_bad() {
    let directory = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        fs::create_dir(directory.path().join(name)).unwrap();
        fs::write(directory.path().join(name).join(Manifest::FILE_NAME), text).unwrap();
    };
    let good =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/line_watcher/plugin.yaml"));
    let good = good.unwrap();
    write("good", &good);
    fs::copy(example_file("libline_watcher.so"), directory.path().join("good/libline_watcher.so")).unwrap();
    write("old", &good.replace("[1, 0]", "[0, 9]").replace("line-watcher", "old-watcher"));
    write("lost", &good.replace("liblin", "libgone").replace("line-watcher", "lost-watcher"));

    let catalogue = Catalogue::search(&[directory.path().to_owned()]);
    assert_eq!(catalogue.find("line-watcher").unwrap().manifest.id, "line-watcher");
    let text = |name: &str| {
        let row =
            catalogue.rows().iter().find(|row| row.manifest_path.ends_with(format!("{name}/plugin.yaml")));
        row.unwrap().plugin.as_ref().unwrap_err().to_string()
    };
    let speaks = format!("built for contract 0.9; this program speaks {}", ContractVersion::CURRENT);
    assert!(text("old").contains(&speaks), "{}", text("old"));
    assert!(
        text("lost").contains("library libgonee_watcher.so of plugin 'lost-watcher' is not there"),
        "{}",
        text("lost")
    );
    let message = catalogue.find("line-watchr").unwrap_err().to_string();
    assert!(message.starts_with("there is no plugin 'line-watchr'; there are line-watcher"), "{message}");
}
