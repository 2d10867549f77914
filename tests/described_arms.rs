//! Arms that files describe, in cells of their own: what their worlds hide is named, added, and gone from the true error of the tip.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use plumb_cell::device::CellResources;

/// A user's copy of the shipped cells, or of files of the user's own.
struct Cells {
    folder: tempfile::TempDir,
}

impl Drop for Cells {
    /// Puts away the world that a run which can be resumed keeps.
    fn drop(&mut self) {
        let cells =
            fs::read_dir(self.folder.path()).unwrap().flatten().map(|entry| entry.path().join("cell.yaml"));
        for cell in cells.filter(|cell| cell.exists()) {
            self.plumb(&["doctor", "--clean", &cell.display().to_string()]);
        }
    }
}

impl Cells {
    fn empty() -> Self {
        Self { folder: tempfile::Builder::new().prefix("plumb-described-").tempdir().unwrap() }
    }

    /// With a shipped cell in it.
    fn shipped(name: &str) -> Self {
        let cells = Self::empty();
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../workcells").join(name);
        for part in ["", "procedures"] {
            for entry in
                fs::read_dir(from.join(part)).unwrap().flatten().filter(|entry| entry.path().is_file())
            {
                let text = fs::read_to_string(entry.path()).unwrap();
                let file = Path::new(name).join(part).join(entry.file_name());
                cells.write(&file.display().to_string(), &text);
            }
        }
        cells
    }

    fn path(&self, file: &str) -> PathBuf {
        self.folder.path().join(file)
    }

    fn write(&self, file: &str, text: &str) {
        let path = self.path(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command.args(arguments).arg("--record").arg(self.path("record"));
        command.current_dir(self.folder.path()).stdin(Stdio::null());
        command
    }

    /// Exit code, and all that was said.
    fn plumb(&self, arguments: &[&str]) -> (Option<i32>, String) {
        let mut command = match arguments {
            ["model" | "check" | "trial", ..] => {
                let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
                command.args(arguments).current_dir(self.folder.path());
                command
            }
            _ => self.command(arguments),
        };
        let output = command.output().unwrap();
        let printed = [output.stdout, output.stderr].concat();
        (output.status.code(), String::from_utf8(printed).unwrap())
    }

    /// What a command says that must succeed.
    fn printed(&self, arguments: &[&str]) -> String {
        let (code, printed) = self.plumb(arguments);
        assert_eq!(code, Some(0), "plumb {arguments:?}: {printed}");
        printed
    }

    /// The true error of the tip over fresh points, root mean square, mm.
    fn true_error(&self, cell: &str) -> f64 {
        let printed = self.printed(&["run", cell, "verify", "--headless"]);
        let line = printed.lines().find(|line| line.contains("The error over all points")).unwrap();
        let number = line.split("rms = ").nth(1).unwrap().split(' ').next().unwrap();
        number.parse().unwrap()
    }

    /// Measures the poses of the table and keeps the rows in a file of this name.
    fn measure(&self, cell: &str, run: &str, table: &str) {
        self.printed(&["run", cell, "measure-tip", "--headless"]);
        let rows = self.printed(&["show", run, "--table"]);
        self.write(table, &rows);
    }
}

/// Goes the whole way in a cell: the error as the arm comes, the diagnosis' last line, and the error of the model that it grew.
fn found_in(cells: &Cells, name: &str) -> (f64, String, f64) {
    let (cell, model) = (format!("{name}/cell.yaml"), format!("{name}/{name}.model.yaml"));
    let before = cells.true_error(&cell);
    cells.measure(&cell, "2", "table.csv");
    let diagnosis = cells.printed(&["model", "diagnose", &model, "--data", "table.csv"]);
    cells.printed(&["model", "grow", &model, "--data", "table.csv"]);
    let verdict = diagnosis.lines().rev().find(|line| !line.is_empty()).unwrap().to_owned();
    (before, verdict, cells.true_error(&cell))
}

#[test]
fn what_the_shipped_ur5_hides_is_named_and_its_tip_comes_where_it_is_sent() {
    let (before, verdict, after) = found_in(&Cells::shipped("ur5"), "ur5");
    assert!(verdict.starts_with("NAMED.") && verdict.contains("joint_compliance(lift)"), "{verdict}");
    // The tracker's own noise makes 0.087 mm.
    assert!(before > 1.0 && after < 0.12, "{before} mm before, {after} mm after");
}

#[test]
fn an_upper_arm_that_twists_is_named_and_its_tip_comes_where_it_is_sent() {
    let cells = Cells::shipped("ur5");
    let soft = "joint_compliance: {joint: lift, rad_per_nm: 3.0e-5}";
    let world = fs::read_to_string(cells.path("ur5/world.yaml")).unwrap();
    assert!(world.contains(soft), "{world}");
    cells.write("ur5/world.yaml", &world.replace(soft, "link_torsion: {joint: lift, per_nm2: 1.5e-3}"));
    let (before, verdict, after) = found_in(&cells, "ur5");
    assert!(verdict.starts_with("NAMED.") && verdict.contains("link_torsion(lift)"), "{verdict}");
    assert!(before > 1.0 && after < 0.12, "{before} mm before, {after} mm after");
}

#[test]
fn what_the_shipped_scara_hides_in_its_slide_is_named_and_its_tip_comes_where_it_is_sent() {
    let (before, verdict, after) = found_in(&Cells::shipped("scara"), "scara");
    assert!(verdict.starts_with("NAMED.") && verdict.contains("joint_backlash(slide)"), "{verdict}");
    // The tracker's own noise makes 0.052 mm.
    assert!(before > 0.5 && after < 0.08, "{before} mm before, {after} mm after");
}

#[test]
fn what_the_shipped_gantry_hides_in_its_slides_is_named_and_its_tip_comes_where_it_is_sent() {
    let cells = Cells::shipped("gantry");
    let (cell, model) = ("gantry/cell.yaml", "gantry/gantry.model.yaml");
    let before = cells.true_error(cell);
    cells.measure(cell, "2", "table.csv");
    let grown = cells.printed(&["model", "grow", model, "--data", "table.csv", "--json"]);
    let grown: serde_json::Value = serde_json::from_str(&grown).unwrap();
    // The world hides it: 0.03 deg out of square, 0.12 mm of play, and a wave of 0.04 mm.
    for (effect, site, truth) in
        [("link_twist", "x", 0.03), ("joint_backlash", "y", 0.12), ("screw_wave", "x", 0.04)]
    {
        let steps = grown["steps"].as_array().unwrap().iter().map(|step| &step["added"]);
        let found = steps.into_iter().find(|one| one["effect"] == effect && one["where"] == site);
        let found = found.unwrap_or_else(|| panic!("{effect}({site}): {}", grown["steps"]));
        let (size, se) = (found["size"].as_f64().unwrap(), found["se"].as_f64().unwrap());
        assert!((size - truth).abs() < 3.0 * se, "{effect}({site}): {size} +- {se}, true {truth}");
    }
    assert_eq!(grown["steps"].as_array().unwrap().len(), 3, "{}", grown["steps"]);
    assert_eq!(grown["verdict"], "at_floor", "{}", grown["sentence"]);
    let after = cells.true_error(cell);
    // The tracker's own noise makes 0.017 mm.
    assert!(before > 0.2 && after < 0.03, "{before} mm before, {after} mm after");
}

/// Guideways that are bowed or twisted, and a screw out of true, hidden in the gantry's cell under seal.
#[test]
fn what_only_slides_have_is_named_with_its_size_where_a_trial_hides_it_in_the_gantry() {
    for (fault, effect, site) in [
        ("yaw(y)", "axis_yaw", "y"),
        ("roll(x)", "axis_roll", "x"),
        ("pitch(x)", "axis_pitch", "x"),
        ("screw(z)", "screw_wave", "z"),
    ] {
        let cells = Cells::empty();
        let (code, printed) = cells
            .plumb(&["trial", "new", "--cell", "gantry", "--fault", fault, "--seed", "5", "-o", "hidden"]);
        assert_eq!(code, Some(0), "{printed}");
        cells.measure("hidden/cell.yaml", "1", "table.csv");
        let output = cells.printed(&[
            "model",
            "diagnose",
            "hidden/gantry.model.yaml",
            "--data",
            "table.csv",
            "--json",
        ]);
        let output: serde_json::Value = serde_json::from_str(&output).unwrap();
        let named = &output["named"];
        assert_eq!(
            (&named["effect"], &named["where"]),
            (&effect.into(), &site.into()),
            "{fault}: {}",
            output["sentence"]
        );
        let (_, answer) = cells.plumb(&["trial", "reveal", "hidden", "--json"]);
        let answer: serde_json::Value = serde_json::from_str(&answer).unwrap();
        let hidden = answer["truth"]["hidden"][0]["size"].as_f64().unwrap();
        // The trial gives turns in rad for a mm, the lab in degrees for a metre.
        let truth = if named["unit"] == "deg/m" { hidden.to_degrees() * 1000.0 } else { hidden };
        let (size, se) = (named["size"].as_f64().unwrap(), named["se"].as_f64().unwrap());
        assert!((size - truth).abs() < 3.0 * se, "{fault}: {size} +- {se}, true {truth}");
    }
}

/// A link of the UR5 twists little: what shows is what an open channel has, not a tube.
#[test]
fn a_link_that_twists_is_hidden_in_the_ur5_where_it_is_asked_for_and_named() {
    let cells = Cells::empty();
    let (code, printed) =
        cells.plumb(&["trial", "new", "--cell", "ur5", "--fault", "torsion", "--seed", "5", "-o", "hidden"]);
    assert_eq!(code, Some(0), "{printed}");
    cells.measure("hidden/cell.yaml", "1", "table.csv");
    let output =
        cells.printed(&["model", "diagnose", "hidden/ur5.model.yaml", "--data", "table.csv", "--json"]);
    let output: serde_json::Value = serde_json::from_str(&output).unwrap();
    assert_eq!(output["named"]["effect"], "link_torsion", "{}", output["sentence"]);
}

/// A drive that stays behind as it is fast, hidden under seal in a cell, measured by a run of it, and its size held against the truth.
#[test]
fn a_joint_that_lags_is_hidden_in_the_ur5_where_it_is_asked_for_and_named_with_its_size() {
    let cells = Cells::empty();
    let (code, printed) =
        cells.plumb(&["trial", "new", "--cell", "ur5", "--fault", "lag", "--seed", "6", "-o", "hidden"]);
    assert_eq!(code, Some(0), "{printed}");
    cells.measure("hidden/cell.yaml", "1", "table.csv");
    let output =
        cells.printed(&["model", "diagnose", "hidden/ur5.model.yaml", "--data", "table.csv", "--json"]);
    let output: serde_json::Value = serde_json::from_str(&output).unwrap();
    let named = &output["named"];
    assert_eq!(named["effect"], "joint_lag", "{}", output["sentence"]);
    let (_, answer) = cells.plumb(&["trial", "reveal", "hidden", "--json"]);
    let answer: serde_json::Value = serde_json::from_str(&answer).unwrap();
    let hidden = &answer["truth"]["hidden"][0];
    assert_eq!(named["where"], hidden["where"], "{answer}");
    let truth = hidden["size"].as_f64().unwrap().to_degrees();
    let (size, se) = (named["size"].as_f64().unwrap(), named["se"].as_f64().unwrap());
    assert!((size - truth).abs() < 3.0 * se, "{size} +- {se}, true {truth}");
}

/// A machine of five axes that exists nowhere: a turning column, two slides and a wrist of two, as a URDF file has it.
const URDF: &str = r#"<robot name="palletizer">
  <link name="floor"/>
  <link name="column"><inertial><origin xyz="0.1 0 0.3"/><mass value="20"/></inertial></link>
  <link name="carriage"><inertial><origin xyz="0 0 0"/><mass value="8"/></inertial></link>
  <link name="beam"><inertial><origin xyz="-0.2 0 0"/><mass value="6"/></inertial></link>
  <link name="knuckle"/>
  <link name="plate"/>
  <joint name="column" type="revolute">
    <parent link="floor"/><child link="column"/><origin xyz="0 0 0.2"/><axis xyz="0 0 1"/>
    <limit lower="-2.8" upper="2.8" velocity="1.6" effort="0"/>
  </joint>
  <joint name="lift" type="prismatic">
    <parent link="column"/><child link="carriage"/><origin xyz="0.15 0 0.1"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.8" velocity="0.5" effort="0"/>
  </joint>
  <joint name="reach" type="prismatic">
    <parent link="carriage"/><child link="beam"/><origin xyz="0.1 0 0.05" rpy="0 0.02 0"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.6" velocity="0.7" effort="0"/>
  </joint>
  <joint name="bend" type="revolute">
    <parent link="beam"/><child link="knuckle"/><origin xyz="0.25 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1.8" upper="1.8" velocity="2" effort="0"/>
  </joint>
  <joint name="twist" type="continuous">
    <parent link="knuckle"/><child link="plate"/><origin xyz="0.08 0 0"/><axis xyz="1 0 0"/>
    <limit velocity="3" effort="0"/>
  </joint>
</robot>
"#;

/// Poses that come to every joint from both sides, deg, mm, mm, deg, deg.
fn poses(count: u32) -> String {
    let mut text = "q1_deg,q2_mm,q3_mm,q4_deg,q5_deg,repeat\n".to_owned();
    for row in 0..count {
        // Six poses come back twice.
        let pose = if row % 10 >= 8 { (row / 10) % 6 } else { row };
        let part = |step: f64| (f64::from(pose + 1) * step) % 1.0;
        let joints = [
            300.0 * part(0.819_172_513_4) - 150.0,
            20.0 + 760.0 * part(0.671_043_606_7),
            20.0 + 560.0 * part(0.549_700_477_9),
            200.0 * part(0.450_359_962_7) - 100.0,
            300.0 * part(0.368_925) - 150.0,
        ];
        let repeat = if pose < 6 { pose + 1 } else { 0 };
        let joints = joints.map(|joint| format!("{joint:.1}")).join(",");
        text.push_str(&format!("{joints},{repeat}\n"));
    }
    text
}

/// The palletizer's cell: nothing but files.
fn palletizer(noise_mm: f64, faults: &str) -> Cells {
    let cells = Cells::shipped("scara");
    let own = |file: &str| format!("palletizer/{file}");
    let to = "to_deg: {column: poses.q1_deg, bend: poses.q4_deg, twist: poses.q5_deg}\n                to_mm: {lift: poses.q2_mm, reach: poses.q3_mm}";
    let measure = fs::read_to_string(cells.path("scara/procedures/measure-tip.yaml")).unwrap();
    let (first, rest) = measure.split_once("to_deg: {").unwrap();
    let (_, rest) = rest.split_once("to_mm: {slide: poses.q3_mm}").unwrap();
    let (middle, _) = rest.split_once("  - id: home").unwrap();
    cells.write(&own("procedures/measure-tip.yaml"), &format!("{first}{to}{middle}"));
    let read = fs::read_to_string(cells.path("scara/procedures/read-tip.yaml")).unwrap();
    cells.write(&own("procedures/read-tip.yaml"), &read);
    cells.write(
        &own("answers.yaml"),
        "by: answers file\nanswers: {tip.tip_x: offered, tip.tip_y: offered, tip.tip_z: offered}\n",
    );
    cells.write(&own("palletizer.urdf"), URDF);
    cells.write(
        &own("palletizer.arm.yaml"),
        "arm: palletizer\nurdf: palletizer.urdf\njoints: [{name: lift, home_mm: 100}]\n",
    );
    cells.write(
        &own("palletizer.model.yaml"),
        &format!(
            "arm: palletizer\nconvention: {{urdf: palletizer.urdf}}\nbase: {{free: true}}\ntargets: {{p1: {{xyz_mm: [120, 30, 40], free: true}}}}\nfree: [joint_zero(*)]\nmeasured_from: world\nnoise: {{p1_mm: {noise_mm}}}\n"
        ),
    );
    cells.write(
        &own("world.yaml"),
        &format!(
            "world: A palletizer\nseed: 3\narm:\n  described:\n    by: palletizer.arm.yaml\n{faults}tool: {{tip_mm: [120, 30, 40]}}\ninstruments: {{tracker: {{error_mm: {noise_mm}}}}}\n"
        ),
    );
    cells.write(
        &own("cell.yaml"),
        "cell: palletizer\ntitle: A palletizer\nworld: {file: world.yaml, pace: fast}\ndevices: {arm: {plugin: simulated, config: {arm: palletizer}}}\nrobots:\n  arm:\n    joints: {column: deg, lift: mm, reach: mm, bend: deg, twist: deg}\n    model: palletizer.model.yaml\ninstruments: {tracker: {what: a laser tracker, uncertainty_mm: 0.03}}\nprocedures: [procedures/measure-tip.yaml]\nanswers: answers.yaml\n",
    );
    cells.write(&own("poses.csv"), &poses(60));
    fs::remove_dir_all(cells.path("scara")).unwrap();
    cells
}

#[test]
fn an_arm_of_five_axes_made_of_files_only_is_measured_and_what_it_hides_is_named() {
    let faults = "    zero_error: {column_deg: 0.2, lift_mm: 0.7, reach_mm: -0.5, bend_deg: 0.3}\n    imperfections: [{joint_gain: {joint: reach, mm_per_mm: 0.002}}]\n";
    let cells = palletizer(0.03, faults);
    cells.printed(&["check", "palletizer/cell.yaml"]);
    cells.measure("palletizer/cell.yaml", "1", "table.csv");
    let printed =
        cells.printed(&["model", "diagnose", "palletizer/palletizer.model.yaml", "--data", "table.csv"]);
    let verdict = printed.lines().rev().find(|line| !line.is_empty()).unwrap();
    assert!(verdict.starts_with("NAMED.") && verdict.contains("joint_gain(reach)"), "{printed}");
}

#[test]
fn the_worlds_reader_of_urdf_files_and_the_labs_put_the_tip_at_the_same_positions() {
    let cells = palletizer(0.0, "");
    let model = fs::read_to_string(cells.path("palletizer/palletizer.model.yaml")).unwrap();
    let fixed = model.replace("free: true", "free: false").replace("[joint_zero(*)]", "[]");
    // Rows are weighed by their noise, which must not be nothing.
    cells.write("palletizer/palletizer.model.yaml", &fixed.replace("p1_mm: 0}", "p1_mm: 0.001}"));
    cells.measure("palletizer/cell.yaml", "1", "table.csv");
    let printed = cells.printed(&[
        "model",
        "compare",
        "palletizer/palletizer.model.yaml",
        "--data",
        "table.csv",
        "--json",
    ]);
    let compared: serde_json::Value = serde_json::from_str(&printed).unwrap();
    let rms = compared["rms_mm"]["fit"].as_f64().unwrap();
    // Instruments are written down to a millionth.
    assert!(rms < 2e-6, "{rms} mm: {printed}");
}

/// The process of a cell's world.
fn world_of(cell: &Path) -> Option<i32> {
    let socket = CellResources::of_cell(cell).unwrap().world_socket().display().to_string();
    fs::read_dir("/proc").unwrap().flatten().find_map(|entry| {
        let process: i32 = entry.file_name().to_str()?.parse().ok()?;
        let command = fs::read(entry.path().join("cmdline")).ok()?;
        let words: Vec<&str> = command.split(|byte| *byte == 0).flat_map(std::str::from_utf8).collect();
        (words.contains(&"world") && words.contains(&socket.as_str())).then_some(process)
    })
}

#[test]
fn a_world_killed_while_the_ur5_moves_ends_the_run_within_seconds_and_it_passes_when_resumed() {
    let cells = Cells::shipped("ur5");
    let cell = cells.path("ur5/cell.yaml");
    let mut run = cells
        .command(&["run", "ur5/cell.yaml", "--headless", "--pace", "real"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(run.stdout.take().unwrap()).lines().map_while(Result::ok);
    // The third pose is reached: the fourth is a second's motion away.
    lines.find(|line| line.contains("poses[3].row")).unwrap();
    std::thread::sleep(Duration::from_millis(400));
    let world = world_of(&cell).expect("its world runs");
    nix::sys::signal::kill(nix::unistd::Pid::from_raw(world), nix::sys::signal::Signal::SIGKILL).unwrap();
    let killed = Instant::now();
    let rest: Vec<String> = lines.collect();
    let code = run.wait().unwrap().code();
    assert_eq!(code, Some(2), "{rest:?}");
    assert!(killed.elapsed() < Duration::from_secs(10), "{:?}", killed.elapsed());
    assert!(rest.iter().any(|line| line.contains("world")), "it says what went: {rest:?}");
    let (code, printed) = cells.plumb(&["run", "--resume", "1", "--headless", "--pace", "fast"]);
    assert!(printed.contains("began anew"), "{printed}");
    assert!(matches!(code, Some(0 | 4)), "{code:?}: {printed}");
}
