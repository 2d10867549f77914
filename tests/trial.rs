//! Blind trials from the command line, as a user meets them.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn plumb(arguments: &[&str], directory: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plumb")).args(arguments).current_dir(directory).output().unwrap()
}

fn printed(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn complained(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_trial_gives_measurements_and_keeps_its_answer_until_it_is_revealed() {
    let home = tempfile::tempdir().unwrap();
    let new = plumb(
        &[
            "trial",
            "new",
            "--seed",
            "5",
            "--arm",
            "puma560",
            "--effect",
            "joint_backlash(elbow)=0.065deg",
            "-o",
            "t",
        ],
        home.path(),
    );
    assert_eq!(new.status.code(), Some(0), "{}", complained(&new));
    for file in ["t/table.csv", "t/model.yaml", "t/answer.sealed"] {
        let text = fs::read_to_string(home.path().join(file)).unwrap();
        assert!(!text.contains("backlash"), "{file} gives the answer away");
    }
    let reveal = plumb(&["trial", "reveal", "t"], home.path());
    assert_eq!(reveal.status.code(), Some(0));
    assert!(
        printed(&reveal).starts_with("Hidden: joint_backlash at elbow, 0.06500 deg;"),
        "{}",
        printed(&reveal)
    );
}

#[test]
fn a_wrong_diagnosis_ends_with_one_and_a_right_one_with_zero() {
    let home = tempfile::tempdir().unwrap();
    plumb(
        &["trial", "new", "--seed", "5", "--arm", "ur5", "--effect", "joint_gain(lift)", "-o", "t"],
        home.path(),
    );
    let diagnosis = |effect: &str| {
        format!(r#"{{"verdict": "named", "named": {{"effect": "{effect}", "where": "lift"}}}}"#)
    };
    for (effect, code, word) in [("joint_gain", 0, "right"), ("joint_backlash", 1, "wrong")] {
        fs::write(home.path().join("d.json"), diagnosis(effect)).unwrap();
        let reveal = plumb(&["trial", "reveal", "t", "--diagnosis", "d.json"], home.path());
        assert_eq!(reveal.status.code(), Some(code));
        assert!(printed(&reveal).contains(&format!("The diagnosis is {word}.")), "{}", printed(&reveal));
    }
    fs::write(home.path().join("d.json"), "{}").unwrap();
    let bad = plumb(&["trial", "reveal", "t", "--diagnosis", "d.json"], home.path());
    assert_eq!(bad.status.code(), Some(2));
    assert!(complained(&bad).contains("d.json: not a diagnosis as `plumb model diagnose --json` writes it"));
}

#[test]
fn the_lab_names_what_a_trial_hides_and_the_seal_agrees() {
    let home = tempfile::tempdir().unwrap();
    let hide = "joint_compliance(shoulder)=3x";
    plumb(&["trial", "new", "--seed", "5", "--arm", "puma560", "--effect", hide, "-o", "t"], home.path());
    let diagnose =
        plumb(&["model", "diagnose", "t/model.yaml", "--data", "t/table.csv", "--json"], home.path());
    assert_eq!(diagnose.status.code(), Some(0), "{}", complained(&diagnose));
    fs::write(home.path().join("d.json"), &diagnose.stdout).unwrap();
    let reveal = plumb(&["trial", "reveal", "t", "--diagnosis", "d.json"], home.path());
    assert_eq!(reveal.status.code(), Some(0), "{}", printed(&reveal));
}

#[test]
fn a_batch_is_reproducible_and_can_be_opened_at_once() {
    let home = tempfile::tempdir().unwrap();
    for name in ["a", "b"] {
        let batch =
            plumb(&["trial", "batch", "--seed", "100", "--count", "4", "--open", "-o", name], home.path());
        assert_eq!(batch.status.code(), Some(0), "{}", complained(&batch));
    }
    let answers = |name: &str| fs::read_to_string(home.path().join(name).join("answers.json")).unwrap();
    assert_eq!(answers("a"), answers("b"));
    let all: serde_json::Value = serde_json::from_str(&answers("a")).unwrap();
    assert_eq!(
        all.as_object().unwrap().keys().collect::<Vec<_>>(),
        ["case-100", "case-101", "case-102", "case-103"]
    );
    assert!(all["case-100"]["accept_verdict"].is_array());
}

#[test]
fn a_user_can_measure_more_poses_before_opening_the_seal() {
    let home = tempfile::tempdir().unwrap();
    plumb(&["trial", "new", "--seed", "5", "--arm", "teachmover", "-o", "t"], home.path());
    let table = || fs::read_to_string(home.path().join("t/table.csv")).unwrap();
    let before = table();
    fs::write(
        home.path().join("next.json"),
        r#"{"next": [{"q_deg": [10, 20, -30, 40], "approach": [1, -1, 1, -1]}]}"#,
    )
    .unwrap();
    for _ in 0..2 {
        let measure = plumb(&["trial", "measure", "t", "--poses", "next.json"], home.path());
        assert_eq!(measure.status.code(), Some(0), "{}", complained(&measure));
    }
    assert!(table().starts_with(&before));
    let added: Vec<String> = table()[before.len()..].lines().map(str::to_owned).collect();
    assert_eq!(added.len(), 2);
    assert!(
        added.iter().all(|line| line.starts_with("10.000,20.000,-30.000,40.000,1,-1,1,-1,0,")),
        "{added:?}"
    );
    assert_ne!(added[0], added[1], "two returns differ by noise and time");
    fs::write(home.path().join("next.json"), r#"[{"q_deg": [10, 20]}]"#).unwrap();
    let bad = plumb(&["trial", "measure", "t", "--poses", "next.json"], home.path());
    assert!(complained(&bad).contains("pose 1 needs 4 joint angles in `q_deg`"), "{}", complained(&bad));
}

#[test]
fn poses_asked_for_far_from_the_others_are_not_locked_away_and_settle_a_tie() {
    let home = tempfile::tempdir().unwrap();
    let narrow = ["--seed", "12", "--arm", "puma560", "--narrow", "--effect", "link_twist=1x"];
    let first = diagnosed(home.path(), "t", &narrow);
    assert_eq!(first["verdict"], "tied", "{first}");
    let (model, table) = ("t/model.yaml", "t/table.csv");
    let next = plumb(&["model", "next", model, "--data", table, "--json"], home.path());
    let report: serde_json::Value = serde_json::from_slice(&next.stdout).unwrap();
    // Standard errors between the two rivals that lie nearest: an axis out of true and a coupling.
    assert!(report["separation"].as_f64().unwrap() > 15.0, "{report}");
    // Without the returns that come on top.
    let new = &report["next"].as_array().unwrap()[..8];
    fs::write(home.path().join("next.json"), serde_json::to_string(new).unwrap()).unwrap();
    plumb(&["trial", "measure", "t", "--poses", "next.json"], home.path());
    let printed = plumb(&["model", "diagnose", model, "--data", table, "--json"], home.path());
    let then: serde_json::Value = serde_json::from_slice(&printed.stdout).unwrap();
    assert_eq!(then["verdict"], "named", "{then}");
    assert_eq!((&then["named"]["effect"], &then["named"]["where"]), (&"link_twist".into(), &"waist".into()));
}

#[test]
fn waves_that_are_tied_are_given_by_their_orders() {
    let home = tempfile::tempdir().unwrap();
    let sentence = |seed: &str| {
        let options = ["--seed", seed, "--arm", "ur5", "--narrow", "--effect", "joint_harmonic=2x"];
        diagnosed(home.path(), seed, &options)["sentence"].as_str().unwrap().to_owned()
    };
    let located = sentence("14");
    assert!(
        located.contains("sits in wrist1, but these data cannot distinguish joint_harmonic(wrist1, 1)"),
        "{located}"
    );
    let tied = sentence("9");
    assert!(tied.contains("joint_harmonic(lift, 1)") && !tied.contains("joint_harmonic(lift) "), "{tied}");
}

#[test]
fn mistakes_are_reported_with_what_would_be_right() {
    let home = tempfile::tempdir().unwrap();
    let message = |arguments: &[&str]| {
        let output = plumb(arguments, home.path());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        complained(&output)
    };
    let new = |extra: &[&str]| message(&[&["trial", "new", "--seed", "1", "-o", "t"], extra].concat());
    assert!(new(&["--arm", "hal"]).contains("there is no arm `hal`: known are puma560, ur5"));
    assert!(new(&["--effect", "gremlins"]).contains("there is no effect `gremlins`; known are"));
    assert!(new(&["--noise", "0"]).contains("a standard deviation above zero"));
    assert!(new(&["--outliers", "0.9"]).contains("--outliers 0.9: a fraction from 0 to 0.5"));
    assert!(message(&["trial", "reveal", "nowhere"]).contains("cannot read nowhere/answer.sealed"));
    plumb(&["trial", "new", "--seed", "1", "-o", "t"], home.path());
    assert!(new(&[]).contains("t/table.csv is there already: a trial is not overwritten"));
}

/// What the lab says of a trial with these options.
fn diagnosed(home: &Path, name: &str, options: &[&str]) -> serde_json::Value {
    let new = plumb(&[&["trial", "new", "--heat", "-o", name][..], options].concat(), home);
    assert_eq!(new.status.code(), Some(0), "{}", complained(&new));
    let (model, table) = (format!("{name}/model.yaml"), format!("{name}/table.csv"));
    let printed = plumb(&["model", "diagnose", &model, "--data", &table, "--json"], home);
    assert_eq!(printed.status.code(), Some(0), "{}", complained(&printed));
    serde_json::from_slice(&printed.stdout).unwrap()
}

#[test]
fn two_joints_that_yield_are_found_both_and_not_the_link_between_them() {
    let home = tempfile::tempdir().unwrap();
    let hidden = ["--effect", "joint_compliance(lift)=8x", "--effect", "joint_compliance(elbow)=4x"];
    for seed in ["14", "16"] {
        let more = ["--arm", "ur10", "--seed", seed, "--poses", "120", "--free", "geometry"];
        let diagnosis = diagnosed(home.path(), seed, &[&more[..], &hidden[..]].concat());
        let named = &diagnosis["named"];
        assert_eq!((&named["effect"], &named["where"]), (&"joint_compliance".into(), &"lift".into()));
        assert_eq!(diagnosis["besides"], serde_json::json!(["joint_compliance(elbow)"]), "seed {seed}");
        // Without the two a jump seems to lie between rows 139 and 141 of the first.
        assert!(diagnosis["jumps"].is_null(), "seed {seed}: {}", diagnosis["sentence"]);
    }
}

#[test]
fn what_the_library_has_no_name_for_is_located_by_its_direction_and_not_padded_with_names() {
    let home = tempfile::tempdir().unwrap();
    for (seed, arm, effect, site) in [
        ("13403652896558072272", "ur10", "worn_gear=3x", "wrist3"),
        ("14973018471622387101", "ur5", "cable_wind_up=3x", "elbow"),
        ("5239455094129380578", "teachmover", "cable_wind_up=3x", "shoulder"),
        ("15930849103339168175", "puma560", "rocking_base=3x", "base"),
        ("6108241920527692793", "irb1600", "stick_slip=3x", "axis1"),
    ] {
        let printed = diagnosed(home.path(), seed, &["--seed", seed, "--arm", arm, "--effect", effect]);
        assert_eq!(printed["verdict"], "located", "{arm} {effect}: {}", printed["sentence"]);
        assert_eq!(printed["located"]["where"], site, "{arm} {effect}: {}", printed["sentence"]);
        assert_eq!(printed["remaining"]["where"][0], site, "{arm} {effect}: {}", printed["sentence"]);
    }
}

#[test]
fn a_formula_is_offered_for_what_the_library_does_not_list_and_its_block_does_what_it_says() {
    let home = tempfile::tempdir().unwrap();
    let found =
        diagnosed(home.path(), "t", &["--seed", "303", "--arm", "ur5", "--effect", "cable_wind_up=3x"]);
    let formula = &found["hypothesis"];
    assert_eq!((&found["verdict"], &formula["place"]), (&"located".into(), &"elbow".into()), "{formula}");
    assert!(formula["formula"].as_str().unwrap().contains("max(q3 + q4 - "), "{formula}");
    assert!(formula["explains"].as_f64().unwrap() > 0.9, "{formula}");
    let output = plumb(&["model", "diagnose", "t/model.yaml", "--data", "t/table.csv"], home.path());
    let block = formula["define"].as_str().unwrap();
    assert!(
        printed(&output).contains("HYPOTHESIS. ") && printed(&output).ends_with(block),
        "{}",
        printed(&output)
    );
    let model = home.path().join("t/model.yaml");
    let text = std::fs::read_to_string(&model).unwrap();
    std::fs::write(&model, format!("{text}{block}")).unwrap();
    let named = plumb(&["model", "diagnose", "t/model.yaml", "--data", "t/table.csv", "--json"], home.path());
    let named: serde_json::Value = serde_json::from_slice(&named.stdout).unwrap();
    assert_eq!(named["candidates"][0]["label"], "hypothesis(elbow)", "{}", named["sentence"]);
    let added = plumb(
        &["model", "add", "t/model.yaml", "hypothesis", "--yes", "--data", "t/table.csv", "--json"],
        home.path(),
    );
    assert_eq!(added.status.code(), Some(0), "{}", complained(&added));
    let added: serde_json::Value = serde_json::from_slice(&added.stdout).unwrap();
    let (before, after) = (formula["before_mm"].as_f64().unwrap(), added["rms_mm"]["fit"].as_f64().unwrap());
    assert!(after < 0.6 * before, "{before} {after}");
    // Where nothing is hidden nothing is offered.
    let found = diagnosed(home.path(), "n", &["--seed", "303", "--arm", "ur5", "--effect", "none"]);
    assert!(found.get("hypothesis").is_none(), "{}", found["hypothesis"]);
}

#[test]
fn a_joint_that_gives_is_reported_with_the_link_along_its_axis_that_would_twist_alike() {
    let home = tempfile::tempdir().unwrap();
    let options = ["--seed", "5", "--arm", "iiwa7", "--effect", "joint_compliance(a5)=5x"];
    let found = diagnosed(home.path(), "t", &options);
    assert_eq!((&found["verdict"], &found["named"]["where"]), (&"named".into(), &"a5".into()), "{found}");
    let note =
        "joint_compliance(a5): link_torsion(a5) would be the same, for that link lies along the axis of a5";
    let notes = found["warnings"].as_array().unwrap();
    assert!(notes.iter().any(|one| one.as_str().unwrap().starts_with(note)), "{notes:?}");
    // What is square to the axis is another thing.
    let options = ["--seed", "4", "--arm", "puma560", "--effect", "link_torsion(shoulder)=5x"];
    let found = diagnosed(home.path(), "p", &options);
    assert_eq!(
        (&found["named"]["effect"], &found["named"]["where"]),
        (&"link_torsion".into(), &"shoulder".into()),
        "{found}"
    );
    let notes = found["warnings"].as_array().unwrap();
    assert!(!notes.iter().any(|one| one.as_str().unwrap().contains("would be the same")), "{notes:?}");
}

/// The same error after moves in which the joint is fast and in which another is: neither play, which is the same after both, nor settling, which goes with the way.
#[test]
fn a_joint_that_stops_short_in_proportion_to_its_speed_is_named_and_neither_play_nor_settling() {
    let home = tempfile::tempdir().unwrap();
    for (folder, arm, joint, seed) in [("p", "puma560", "elbow", "3"), ("u", "ur5", "lift", "8")] {
        let effect = format!("joint_lag({joint})=4x");
        // With a short approach of its own to every pose each joint goes as fast as the others, and lag is play.
        let options = ["--seed", seed, "--arm", arm, "--effect", &effect, "--straight"];
        let found = diagnosed(home.path(), folder, &options);
        let named = &found["named"];
        assert_eq!((&named["effect"], &named["where"]), (&"joint_lag".into(), &joint.into()), "{found}");
    }
}

/// Six errors of an arm's shape, none of which the model frees.
const SHAPE: [&str; 12] = [
    "--effect",
    "link_twist(axis2)=2x",
    "--effect",
    "axis_skew(axis3)=2x",
    "--effect",
    "link_twist(axis4)=2x",
    "--effect",
    "link_length(axis5)=2x",
    "--effect",
    "link_twist(axis6)=2x",
    "--effect",
    "link_length(axis2)=2x",
];

#[test]
fn before_anything_is_named_the_geometry_that_is_not_free_is_asked() {
    let home = tempfile::tempdir().unwrap();
    let options = [&["--seed", "1", "--arm", "irb1600", "--narrow"], &SHAPE[..]].concat();
    let printed = diagnosed(home.path(), "t", &options);
    assert_ne!(printed["verdict"], "named", "{}", printed["sentence"]);
    assert_eq!(printed["free_first"], "geometry(*)", "{}", printed["sentence"]);
    let sentence = printed["sentence"].as_str().unwrap();
    assert!(
        sentence.contains("the model does not free") && sentence.ends_with("and ask again."),
        "{sentence}"
    );
    // Asked again, with the geometry free, there is nothing to free first.
    let asked = [
        "model",
        "diagnose",
        "t/model.yaml",
        "--data",
        "t/table.csv",
        "--json",
        "--free",
        "joint_zero(*),geometry(*)",
    ];
    let printed = plumb(&asked, home.path());
    assert_eq!(printed.status.code(), Some(0), "{}", complained(&printed));
    let printed: serde_json::Value = serde_json::from_slice(&printed.stdout).unwrap();
    assert!(
        printed.get("free_first").is_none() && printed["verdict"] == "at_floor",
        "{}",
        printed["sentence"]
    );
}

#[test]
fn an_effect_of_the_library_is_named_among_two_that_it_does_not_know() {
    let home = tempfile::tempdir().unwrap();
    let others = ["--effect", "worn_gear(pan)=3x", "--effect", "stick_slip(wrist3)=3x", "--poses", "150"];
    let options = [&["--seed", "11", "--arm", "ur5", "--effect", "joint_coupling(elbow)=6x"], &others[..]];
    let printed = diagnosed(home.path(), "t", &options.concat());
    assert_eq!(printed["verdict"], "named", "{}", printed["sentence"]);
    assert_eq!(printed["named"]["effect"], "joint_coupling", "{}", printed["sentence"]);
    assert_eq!(printed["named"]["where"], "elbow", "{}", printed["sentence"]);
    let left = printed["left_unexplained_mm"].as_f64().unwrap();
    assert!((0.1..0.5).contains(&left), "two of 3 times 0.05 mm an axis: {left}");
    assert!(printed["sentence"].as_str().unwrap().ends_with("mm of the rest is not explained yet."));
    assert!(printed["probability"].as_f64().unwrap() > 0.9, "{}", printed["probability"]);
    // Without it the same two get no name.
    let printed = diagnosed(home.path(), "u", &[&["--seed", "11", "--arm", "ur5"], &others[..]].concat());
    assert_ne!(printed["verdict"], "named", "{}", printed["sentence"]);
    assert!(printed.get("left_unexplained_mm").is_none());
}

#[test]
fn outliers_make_no_harmonic_where_nothing_is_hidden() {
    let home = tempfile::tempdir().unwrap();
    for (seed, arm) in [
        ("16253423048685897608", "puma560"),
        ("3343462347399892745", "ur5"),
        ("9423606308594488464", "panda"),
    ] {
        let options = ["--seed", seed, "--arm", arm, "--effect", "none", "--outliers", "0.08"];
        let printed = diagnosed(home.path(), seed, &options);
        assert_eq!(printed["verdict"], "at_floor", "{arm}: {}", printed["sentence"]);
    }
}

#[test]
fn a_joint_that_jumped_once_is_dated_and_not_called_unrepeatable() {
    let home = tempfile::tempdir().unwrap();
    let options = ["--seed", "3626386745217948269", "--arm", "iiwa7", "--effect", "joint_step=3x"];
    let diagnosis = diagnosed(home.path(), "wrist", &options);
    assert_eq!(diagnosis["verdict"], "named", "{}", diagnosis["sentence"]);
    assert_eq!(
        (&diagnosis["named"]["effect"], &diagnosis["named"]["where"]),
        (&"joint_step".into(), &"a5".into())
    );
}

#[test]
fn a_jump_of_the_first_joint_is_dated_and_tied_with_a_base_that_was_turned() {
    // No row determines a turn of the base about the first joint's axis from a jump of that joint: an honest tie holds both.
    let home = tempfile::tempdir().unwrap();
    let options = ["--seed", "770206031772917615", "--arm", "irb1600", "--effect", "joint_step=3x"];
    let diagnosis = diagnosed(home.path(), "waist", &options);
    assert_eq!(diagnosis["verdict"], "tied", "{}", diagnosis["sentence"]);
    let tied = diagnosis["tied"].as_array().unwrap();
    for (effect, site) in [("joint_step", "axis1"), ("base_reset", "base")] {
        let is_there = tied.iter().any(|one| one["effect"] == effect && one["where"] == site);
        assert!(is_there, "{effect} is not in {tied:?}");
    }
    assert!(diagnosis["sentence"].as_str().unwrap().contains("jumped between rows"));
}

#[test]
fn a_size_known_only_after_a_search_has_an_error_that_counts_the_search() {
    let home = tempfile::tempdir().unwrap();
    let options = ["--seed", "11", "--arm", "ur5", "--effect", "joint_stiffening(lift)=3x"];
    let printed = diagnosed(home.path(), "t", &options);
    assert_eq!(printed["named"]["effect"], "joint_stiffening", "{}", printed["sentence"]);
    let hidden = said_of_seal(home.path());
    let (size, se) = (printed["named"]["size"].as_f64().unwrap(), printed["named"]["se"].as_f64().unwrap());
    assert!((size - hidden).abs() < 3.0 * se, "{size} +- {se}, hidden {hidden}");
}

/// The size the seal of trial `t` gives.
fn said_of_seal(home: &Path) -> f64 {
    let output = printed(&plumb(&["trial", "reveal", "t"], home));
    let size = output.split(", ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap_or_default();
    size.parse().unwrap_or_else(|_| panic!("no size in: {output}"))
}

#[test]
fn an_effect_is_hidden_in_a_users_own_measurements_and_the_size_that_would_be_found_is_reported() {
    let home = tempfile::tempdir().unwrap();
    let own = ["trial", "new", "--seed", "11", "--arm", "ur5", "--effect", "none", "-o", "own"];
    assert_eq!(plumb(&own, home.path()).status.code(), Some(0));
    let inject = |effect: &str, to: &str| {
        let options = [
            "trial",
            "inject",
            "own/model.yaml",
            "--data",
            "own/table.csv",
            "--effect",
            effect,
            "--size",
            "4x",
            "-o",
            to,
        ];
        plumb(&options, home.path())
    };
    let hidden = inject("joint_compliance(lift)", "with");
    assert_eq!(hidden.status.code(), Some(0), "{}", complained(&hidden));
    let output = printed(&hidden);
    assert!(output.contains("joint_compliance(lift)") && output.contains("it is named"), "{output}");
    assert!(output.contains("The lab would name it from about"), "{output}");
    let answer: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(home.path().join("with/answer.json")).unwrap()).unwrap();
    let (visible, left) = (answer["visible_mm"].as_f64().unwrap(), answer["left_mm"].as_f64().unwrap());
    assert!((visible / left / 4.0 - 1.0).abs() < 0.05, "{answer}");
    let diagnosis =
        plumb(&["model", "diagnose", "with/model.yaml", "--data", "with/table.csv", "--json"], home.path());
    let diagnosis: serde_json::Value = serde_json::from_str(&printed(&diagnosis)).unwrap();
    assert_eq!(diagnosis["named"]["effect"], "joint_compliance", "{}", diagnosis["sentence"]);
    let again = inject("joint_compliance(lift)", "with");
    assert!(complained(&again).contains("is there already"), "{}", complained(&again));
    let unknown = inject("joint_complience(lift)", "other");
    assert!(
        complained(&unknown).contains("there is no effect `joint_complience`"),
        "{}",
        complained(&unknown)
    );
}

/// The table of a trial with orientations put beside its positions, by a body that turns with the flange as the model has it: exact but for a little noise.
#[test]
fn an_effect_hidden_in_measurements_turns_their_orientations_too() {
    let home = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(home.path().join(name), text).unwrap();
    // One joint that turns about z: the body's orientation is the joint's angle, its position is on a circle.
    write(
        "one.yaml",
        "arm: one\nconvention: distal\njoints: [{name: j, limits_deg: [-170, 170]}]\nbase: {xyz_mm: [0, 0, 0], free: false}\ntargets: {p1: {xyz_mm: [300, 0, 0], free: false}}\nfree: []\nnoise: {p1_mm: 0.05, p1_deg: 0.005}\n",
    );
    let mut table = "q1_deg,p1_x_mm,p1_y_mm,p1_z_mm,p1_rz_rad,p1_rx_rad,p1_ry_rad\n".to_owned();
    for row in 0..60_i32 {
        let (q, wobble) = (f64::from(row * 5 - 150), f64::from((row * 37) % 11 - 5) / 5.0);
        let (sin, cos) = q.to_radians().sin_cos();
        table += &format!(
            "{q},{:.4},{:.4},{:.4},{:.7},0,0\n",
            300.0 * cos + 0.04 * wobble,
            300.0 * sin - 0.04 * wobble,
            0.03 * wobble,
            q.to_radians() + 5e-5 * wobble
        );
    }
    write("own.csv", &table);
    let inject = [
        "trial",
        "inject",
        "one.yaml",
        "--data",
        "own.csv",
        "--effect",
        "joint_harmonic(j, 1)",
        "--size",
        "0.2deg",
        "-o",
        "with",
    ];
    let hidden = plumb(&inject, home.path());
    assert_eq!(hidden.status.code(), Some(0), "{}", complained(&hidden));
    assert!(printed(&hidden).contains("of 0.2000 deg is hidden"), "{}", printed(&hidden));
    // Every orientation has turned by as much as its position has moved on the circle.
    let read = |name: &str| {
        let text = fs::read_to_string(home.path().join(name)).unwrap();
        let mut lines = text
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(str::to_owned)
            .collect::<Vec<_>>()
            .into_iter();
        let header: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
        let index = |name: &str| header.iter().position(|known| known.starts_with(name)).unwrap();
        let (x, y) = (index("p1_x"), index("p1_y"));
        // A turn about z alone, as a rotation vector or as a quaternion.
        let rotation_vector = header.iter().position(|known| known == "p1_rz_rad");
        lines
            .map(|line| {
                let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
                let turn = rotation_vector.map_or_else(
                    || 2.0 * (cells[index("p1_qz")] / cells[index("p1_qw")]).atan(),
                    |column| cells[column],
                );
                (cells[y].atan2(cells[x]), turn)
            })
            .collect::<Vec<_>>()
    };
    let mut most = 0.0_f64;
    for ((angle, turn), (moved, turned)) in read("own.csv").into_iter().zip(read("with/table.csv")) {
        assert!(
            ((moved - angle) - (turned - turn)).abs() < 2e-6,
            "moved by {}, turned by {}",
            moved - angle,
            turned - turn
        );
        most = most.max((turned - turn).abs());
    }
    assert!(most > 2e-3, "0.2 deg is 3.5e-3 rad: {most}");
    // What cannot be moved is refused by its columns, with a way out.
    write(
        "heights.csv",
        "q1_deg,p1_x_mm,p1_y_mm,p1_z_mm,height_mm,on\n0,300,0,0,5,table\n10,295,52,0,5,table\n",
    );
    let mut refused = inject;
    refused[4] = "heights.csv";
    refused[10] = "other";
    let refused = plumb(&refused, home.path());
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        complained(&refused).contains("heights (height_mm)")
            && complained(&refused).contains("plumb trial new --cell"),
        "{}",
        complained(&refused)
    );
}

#[test]
fn a_trial_whose_table_has_orientations_is_diagnosed_and_scored() {
    let home = tempfile::tempdir().unwrap();
    // Play of the last joint, on whose axis the target is: positions say nothing of it, orientations all.
    for (effect, named) in [("joint_backlash(wrist_roll)=0.15deg", "joint_backlash"), ("none", "")] {
        let name = if named.is_empty() { "n" } else { "t" };
        let arm = arm_with_a_wrist(home.path());
        let new = plumb(
            &[
                "trial",
                "new",
                "--seed",
                "8",
                "--arm",
                &arm,
                "--reading",
                "pose",
                "--effect",
                effect,
                "-o",
                name,
            ],
            home.path(),
        );
        assert_eq!(new.status.code(), Some(0), "{}", complained(&new));
        let (model, table) = (format!("{name}/model.yaml"), format!("{name}/table.csv"));
        let text = fs::read_to_string(home.path().join(&table)).unwrap();
        assert!(
            text.lines().next().unwrap().ends_with("p1_x_mm,p1_y_mm,p1_z_mm,p1_rx_rad,p1_ry_rad,p1_rz_rad"),
            "{text}"
        );
        let compared = plumb(&["model", "compare", &model, "--data", &table], home.path());
        assert!(
            printed(&compared).contains("error of an orientation or angle, deg"),
            "{}",
            printed(&compared)
        );
        let diagnosis = plumb(&["model", "diagnose", &model, "--data", &table, "--json"], home.path());
        fs::write(home.path().join("found.json"), &diagnosis.stdout).unwrap();
        let revealed = plumb(&["trial", "reveal", name, "--diagnosis", "found.json"], home.path());
        assert!(
            printed(&revealed).contains("The diagnosis is right"),
            "{}{}",
            printed(&diagnosis),
            printed(&revealed)
        );
        assert!(printed(&diagnosis).contains(named), "{}", printed(&diagnosis));
    }
    // Without the orientations it does not show: the target is on the axis.
    let text = fs::read_to_string(home.path().join("t/table.csv")).unwrap();
    let positions: String = text
        .lines()
        .map(|line| {
            format!(
                "{}\n",
                line.split(',')
                    .rev()
                    .skip(3)
                    .collect::<Vec<_>>()
                    .into_iter()
                    .rev()
                    .collect::<Vec<_>>()
                    .join(",")
            )
        })
        .collect();
    fs::write(home.path().join("places.csv"), positions).unwrap();
    let without = plumb(&["model", "diagnose", "t/model.yaml", "--data", "places.csv"], home.path());
    assert!(!printed(&without).contains("NAMED"), "{}", printed(&without));
}

/// An arm with its target on the axis of the last joint.
fn arm_with_a_wrist(home: &Path) -> String {
    let path = home.join("arm.yaml");
    fs::write(&path, "arm: six\nconvention: distal\njoints:\n  - {name: waist, alpha_deg: 90, d_mm: 400, limits_deg: [-170, 170]}\n  - {name: shoulder, a_mm: 350, limits_deg: [-20, 110]}\n  - {name: elbow, alpha_deg: 90, limits_deg: [-120, 60]}\n  - {name: forearm, alpha_deg: -90, d_mm: 300, limits_deg: [-170, 170]}\n  - {name: wrist, alpha_deg: 90, limits_deg: [-110, 110]}\n  - {name: wrist_roll, d_mm: 80, limits_deg: [-170, 170]}\ntargets: {p1: {xyz_mm: [0, 0, 50]}}\n").unwrap();
    path.display().to_string()
}
