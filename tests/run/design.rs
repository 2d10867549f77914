//! The design of the initialization for an arm of the user's own.

#[test]
fn a_study_designs_the_papers_target_for_any_arm_and_says_what_an_arm_lacks() {
    let folder = tempfile::tempdir().unwrap();
    let plumb = |arguments: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_plumb"));
        let done = command.args(arguments).current_dir(folder.path()).env("NO_COLOR", "1").output().unwrap();
        let output = [done.stdout, done.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
        (done.status.code(), output.concat())
    };
    let arms = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../workcells/arms");
    let arm = |name: &str| arms.join(name).display().to_string();
    let (code, output) = plumb(&["study", "design", &arm("teachmover.yaml"), "--K", "140", "-o", "figures"]);
    assert!(
        code == Some(0) && output.contains("K, distance of line B") && output.contains("as given"),
        "{output}"
    );
    for name in ["design-08-back-rotation.svg", "design-09-distance.csv", "design-10-trigger-height.csv"] {
        assert!(folder.path().join("figures").join(name).exists(), "{name}");
    }
    let (code, output) = plumb(&["study", "design", &arm("scara4.yaml")]);
    assert!(code == Some(2) && output.contains("right angle"), "{output}");
    let (code, output) = plumb(&["study", "design", &arm("teachmover.yaml"), "--K", "5000"]);
    assert!(code == Some(2) && output.contains("K = 5000.0"), "{output}");
    let (code, output) = plumb(&["study", "design", "nowhere.yaml"]);
    assert!(code == Some(2) && output.contains("nowhere.yaml"), "{output}");
}
