//! Help by task: the overview, and two examples of every command that can be typed as they are.

use crate::lab::Lab;

/// Every command that can be typed, and those that others are under, by the words after `plumb`.
fn collect(command: &clap::Command, path: &str, found: &mut Vec<(String, clap::Command)>) {
    for one in command.get_subcommands().filter(|one| !one.is_hide_set() && one.get_name() != "help") {
        let path = format!("{path} {}", one.get_name());
        found.push((path.trim().to_owned(), one.clone()));
        collect(one, &path, found);
    }
}

fn all() -> Vec<(String, clap::Command)> {
    let mut found = Vec::new();
    collect(&plumb::command(), "", &mut found);
    found
}

/// The lines to type under a command's help.
fn examples(command: &clap::Command) -> Vec<String> {
    let text = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    text.lines()
        .filter_map(|line| line.strip_prefix("  plumb "))
        .map(|line| format!("plumb {line}"))
        .collect()
}

/// Words as a shell splits them; single quotes alone.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut quoted) = (vec![String::new()], false);
    for letter in line.chars() {
        match (letter, quoted, words.last_mut()) {
            ('\'', _, _) => quoted = !quoted,
            (' ', false, _) => words.push(String::new()),
            (letter, _, Some(word)) => word.push(letter),
            (_, _, None) => {}
        }
    }
    words
}

#[test]
fn every_command_has_two_examples_that_can_be_typed() {
    let commands = all();
    assert!(commands.len() > 40, "{}", commands.len());
    for (path, command) in &commands {
        let examples = examples(command);
        assert!(examples.len() >= 2, "plumb {path} has {} examples", examples.len());
        for example in examples {
            let line = example.split(" | ").next().unwrap_or_default();
            let line = line.split(" > ").next().unwrap_or_default();
            let of_another = path == "watch" && line.starts_with("plumb run ");
            assert!(of_another || line.starts_with(&format!("plumb {path}")), "of `{path}`: {line}");
            if let Err(error) = plumb::command().try_get_matches_from(words(line)) {
                panic!("{line}\n{error}");
            }
        }
    }
}

#[test]
fn the_overview_holds_every_command_once_under_its_task_within_80_columns() {
    let overview = Lab::new().plumb(&["--help"]).out();
    let tasks = ["Operate:", "Look back:", "Many cells:", "Model lab:", "Scans:", "Practise:", "Extend:"];
    let headings: Vec<&str> = overview.lines().filter(|line| tasks.contains(line)).collect();
    assert_eq!(headings, tasks, "{overview}");
    assert!(overview.starts_with("Calibrates lab robots"), "what it is for comes first: {overview}");
    let (commands, _) = overview.split_once("Options:").unwrap();
    for line in commands.lines().skip_while(|line| !tasks.contains(line)) {
        assert!(line.chars().count() <= 80, "{line}");
    }
    for one in plumb::command().get_subcommands().filter(|one| !one.is_hide_set()) {
        let heading = format!("  {} ", one.get_name());
        assert_eq!(
            commands.lines().filter(|line| line.starts_with(&heading)).count(),
            1,
            "{heading}{commands}"
        );
    }
}

#[test]
fn who_may_name_the_record_reads_where_it_is_otherwise() {
    let mut seen = 0;
    for (path, command) in all() {
        let Some(record) = command.get_arguments().find(|one| one.get_id() == "record") else { continue };
        let help = record.get_help().map(ToString::to_string).unwrap_or_default();
        assert!(help.contains("~/.local/state"), "plumb {path}: {help}");
        seen += 1;
    }
    assert!(seen > 10, "{seen}");
}

#[test]
fn there_is_a_manual_page_for_every_command_with_its_examples() {
    let lab = Lab::new();
    let output = lab.plumb(&["man", "-o", "man1"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    for (path, _) in all() {
        let file = lab.path(&format!("man1/plumb-{}.1", path.replace(' ', "-")));
        let page =
            std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        assert!(page.contains("Examples:"), "{}", file.display());
    }
    let first = std::fs::read_to_string(lab.path("man1/plumb.1")).unwrap();
    assert!(first.contains("plumb\\-run(1)"), "{first}");
    lab.write("a-file", "");
    let refused = lab.plumb(&["man", "-o", "a-file/man1"]);
    assert_eq!(refused.code(), 2);
    assert!(
        refused.err().starts_with("plumb: the manual pages cannot be written to a-file/man1: "),
        "{}",
        refused.err()
    );
}

/// What bash offers for the last of these words.
fn offered(lab: &Lab, words: &[&str]) -> Vec<String> {
    let mut arguments = vec!["--", "plumb"];
    arguments.extend(words);
    let mut command = lab.command(&arguments);
    command.env("PLUMB_COMPLETE", "bash").env("_CLAP_COMPLETE_INDEX", words.len().to_string());
    command.env("_CLAP_COMPLETE_COMP_TYPE", "9").env("_CLAP_COMPLETE_SPACE", "false").env("_CLAP_IFS", "\n");
    let output = crate::lab::CommandOutput::of(command.output().unwrap());
    assert_eq!(output.code(), 0, "{}", output.all());
    output.out().lines().map(str::to_owned).collect()
}

#[test]
fn a_shell_completes_commands_and_the_names_of_effects_cells_and_examples() {
    let lab = Lab::new();
    for shell in ["bash", "zsh", "fish"] {
        let script = lab.plumb(&["completions", shell]);
        assert!(script.code() == 0 && script.out().contains("PLUMB_COMPLETE"), "{shell}: {}", script.all());
    }
    assert!(lab.plumb(&["completions", "csh"]).err().contains("[possible values: "));
    assert_eq!(offered(&lab, &["cert"]), ["certificate"]);
    let effects = offered(&lab, &["model", "effects", "joint_back"]);
    assert!(effects.contains(&"joint_backlash".to_owned()), "{effects:?}");
    assert_eq!(offered(&lab, &["init", "--cell", "ur"]), ["ur5"]);
    assert_eq!(offered(&lab, &["record", "zeros", "t"]).len(), 0, "no run, no cell, and no record is made");
    assert!(!lab.state().exists());
    assert_eq!(lab.plumb(&["run", "cell.yaml", "--headless"]).code(), 0);
    assert_eq!(offered(&lab, &["record", "zeros", "tea"]), ["teachmover"]);
}
