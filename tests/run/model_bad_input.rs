//! Model files, tables and arguments that cannot be meant, as `plumb model` answers them: exit code 2, and one message that says
//! the file, the position in it, the reason and what would do.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// Two links that turn and lift, with a tool.
const ARM: &str = "arm: two
convention: distal
joints:
  - {name: shoulder, a_mm: 300, alpha_deg: 90, d_mm: 100}
  - {name: elbow, a_mm: 250, alpha_deg: 0, d_mm: 0}
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: true}
targets: {p1: {xyz_mm: [0, 0, 40], free: true}}
free: [joint_zero(*)]
";

const HEADER: &str = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm";

const URDF: &str = r#"<robot name="r"><link name="base"/><link name="a"/><link name="b"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="j2" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="j3" type="fixed"><parent link="b"/><child link="a"/></joint>
</robot>
"#;

/// Cells of some poses and where the tip of the arm is there.
fn rows(count: i32) -> Vec<Vec<String>> {
    let row = |row: i32| {
        let (shoulder, elbow) = (f64::from(37 * row % 290 - 145), f64::from(53 * row % 230 - 115));
        let ((sine, cosine), (lift, reach)) = (shoulder.to_radians().sin_cos(), elbow.to_radians().sin_cos());
        let reach = 300.0 + 250.0 * reach;
        let tip = [reach * cosine + 40.0 * sine, reach * sine - 40.0 * cosine, 100.0 + 250.0 * lift];
        [shoulder, elbow].iter().chain(&tip).map(|value| format!("{value:.4}")).collect()
    };
    (0..count).map(row).collect()
}

fn text(header: &str, rows: &[Vec<String>]) -> String {
    let lines = rows.iter().map(|row| row.join(","));
    std::iter::once(header.to_owned()).chain(lines).fold(String::new(), |mut text, line| {
        let _ = writeln!(text, "{line}");
        text
    })
}

/// A table of twenty rows, its cells changed by `change(row, cells)`.
fn table(change: impl Fn(usize, &mut Vec<String>)) -> String {
    let mut rows = rows(20);
    rows.iter_mut().enumerate().for_each(|(row, cells)| change(row, cells));
    text(HEADER, &rows)
}

fn scaled(cells: &mut [String], factor: f64) {
    for cell in cells {
        *cell = format!("{:.7}", cell.parse::<f64>().unwrap() * factor);
    }
}

/// The arm with a formula of the user's own.
fn formula(text: &str) -> String {
    format!(
        "{ARM}define:\n  - {{name: belt, where: elbow, adds: {{joint: elbow, deg: \"{text}\"}}, parameters: {{a: {{unit: deg, range: [-1, 1]}}}}}}\n"
    )
}

/// Files to write, what to ask of `plumb model`, and what its message must say.
struct Case {
    files: Vec<(&'static str, String)>,
    asked: &'static [&'static str],
    says: &'static [&'static str],
}

const COMPARE: &[&str] = &["compare", "arm.yaml", "--data", "poses.csv"];

impl Case {
    fn table(table: String, says: &'static [&'static str]) -> Self {
        Self { files: vec![("arm.yaml", ARM.to_owned()), ("poses.csv", table)], asked: COMPARE, says }
    }

    fn model(model: String, says: &'static [&'static str]) -> Self {
        Self { files: vec![("arm.yaml", model), ("poses.csv", table(|_, _| ()))], asked: COMPARE, says }
    }

    fn asked(asked: &'static [&'static str], says: &'static [&'static str]) -> Self {
        Self { asked, ..Self::model(ARM.to_owned(), says) }
    }

    fn check(&self) {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in &self.files {
            fs::write(folder.path().join(name), text).unwrap();
        }
        let (code, printed) = printed(folder.path(), self.asked);
        assert_eq!(code, Some(2), "{:?} says: {printed}", self.asked);
        for part in self.says {
            assert!(printed.contains(part), "`{part}` is missing in: {printed}");
        }
    }
}

/// The exit code of `plumb model`, and all it said.
fn printed(folder: &Path, asked: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    command.arg("model").args(asked).current_dir(folder).env("NO_COLOR", "1").stdin(Stdio::null());
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), [text(&output.stderr), text(&output.stdout)].concat())
}

#[test]
fn tables_that_cannot_be_meant_are_refused_with_line_column_and_reason() {
    let one_pose = vec![rows(1).remove(0); 12];
    let cases = [
        Case::table(
            table(|row, cells| {
                if row == 5 {
                    cells[3] = "NaN".to_owned();
                }
            }),
            &["poses.csv: line 7, column 4 (`p1_y_mm`): `NaN` is not a finite number; leave the cell empty"],
        ),
        Case::table(
            table(|row, cells| {
                if row == 7 {
                    scaled(&mut cells[2..], 1.0 / 25.4);
                }
            }),
            &["poses.csv: line 9: the position is in another unit", "write the whole column in one unit"],
        ),
        Case::table(
            table(|_, cells| scaled(&mut cells[2..], 1e-3)),
            &["poses.csv: the positions of p1", "m for mm?", "correct the unit in the header"],
        ),
        Case::table(
            text(
                &HEADER.replace("q2_deg", "q2_deg,q3_deg"),
                &rows(8)
                    .into_iter()
                    .map(|mut row| {
                        row.insert(2, "0".to_owned());
                        row
                    })
                    .collect::<Vec<_>>(),
            ),
            &["poses.csv: the table has 3 joints (q1 ... q3) and the arm two has 2"],
        ),
        Case::table(
            text(HEADER, &rows(1)),
            &["poses.csv: line 2: only one row is left to fit; measure more poses"],
        ),
        Case::table(
            text(HEADER, &one_pose),
            &["poses.csv: all 12 rows have the same pose; a fit needs different ones"],
        ),
        Case::table(
            text(HEADER, &rows(2)),
            &[
                "poses.csv: 6 measured numbers cannot settle",
                "measure more poses, or free fewer (`--free none`)",
            ],
        ),
        Case::table(
            table(|_, cells| cells.iter_mut().for_each(|cell| *cell = cell.replace('.', ","))),
            &["poses.csv: line 2: 10 cells where the header has 5", "separate the columns by semicolons"],
        ),
        Case::table(String::new(), &["poses.csv: the file is empty; the first line must name the columns"]),
        Case::table(format!("{HEADER}\n"), &["poses.csv: no rows below the header"]),
        Case::table(
            text("1,2,3,4,5", &rows(4)),
            &["poses.csv: line 1 holds numbers where names belong; the header needs q1_deg"],
        ),
        Case::table(
            text(&HEADER.replace("q1_deg", "q1"), &rows(4)),
            &["poses.csv: line 1, column 1 (`q1`): the unit is missing: write q1_deg, q1_rad"],
        ),
    ];
    cases.iter().for_each(Case::check);
}

#[test]
fn distances_that_cannot_meet_name_both_lines() {
    let model = ARM.replace("free: true", "free: false").replace("free: [joint_zero(*)]", "free: []")
        + "measured_from: world\nsurfaces: {front: {point_mm: [500, 0, 0]}, back: {point_mm: [-500, 0, 0]}}\n";
    let table = "q1_deg,q2_deg,distance_mm,distance_to\n0,0,100,front\n0,0,200,back\n10,10,300,front\n20,20,300,front\n";
    Case {
        files: vec![("arm.yaml", model), ("poses.csv", table.to_owned())],
        asked: COMPARE,
        says: &["poses.csv: lines 2 and 3: from one pose p1 cannot be", "measure one of them again"],
    }
    .check();
}

#[test]
fn a_known_distance_to_a_place_that_no_row_touches_is_said_to_be_unused() {
    let folder = tempfile::tempdir().unwrap();
    let touched = rows(20).into_iter().enumerate().map(|(row, mut cells)| {
        cells.push(["pin_left", "pin_right", ""][row % 3].to_owned());
        cells
    });
    let touched: Vec<Vec<String>> = touched.collect();
    fs::write(folder.path().join("poses.csv"), text(&format!("{HEADER},touch"), &touched)).unwrap();
    let model = |distance: &str| {
        let touch = format!("{ARM}touch: {{p: p1, distances: [{distance}]}}\n");
        fs::write(folder.path().join("arm.yaml"), touch).unwrap();
        let (code, printed) = printed(folder.path(), COMPARE);
        assert_eq!(code, Some(0), "{printed}");
        printed
    };
    let misspelt = model("{between: [pin_left, pin_rihgt], mm: 120}");
    for part in [
        "note: the known distance of 120 mm between `pin_left` and `pin_rihgt` is not used",
        "no row touches `pin_rihgt`; did you mean `pin_right`?",
    ] {
        assert!(misspelt.contains(part), "`{part}` is missing in: {misspelt}");
    }
    let right = model("{between: [pin_left, pin_right], mm: 120}");
    assert!(!right.contains("is not used"), "{right}");
}

#[test]
fn model_files_that_cannot_be_meant_are_refused_with_their_position() {
    let zeros = ["a_mm: 300", "a_mm: 250", "d_mm: 100", "alpha_deg: 90"];
    let point = zeros.iter().fold(ARM.to_owned(), |text, key| {
        text.replace(key, &format!("{}: 0", key.split(':').next().unwrap_or("")))
    });
    let cases = [
        Case::model(
            point.replace("[0, 0, 40]", "[0, 0, 0]"),
            &["the arm two cannot move p1", "check lengths (`a_mm`, `d_mm`)"],
        ),
        Case::model(
            formula("a/(q1-q1)"),
            &[
                "arm.yaml: line 10, column ",
                "gives no finite number in line 2 of poses.csv",
                "divides by zero",
            ],
        ),
        Case::model(formula("while true { a }"), &["arm.yaml:10:", "a formula has no loops"]),
        Case::model(formula("a*sine(q1)"), &["arm.yaml:10:", "did you mean `sin`?"]),
        Case::model(
            ARM.replace("joint_zero(*)", "joint_zeros(*)"),
            &["arm.yaml:8:8: there is no effect `joint_zeros`\n", "did you mean `joint_zero`?"],
        ),
        Case::model(
            ARM.replace("a_mm: 250", "a_mm: abc"),
            &["arm.yaml:5:25: `a_mm` is a number; this is the text `abc`"],
        ),
        Case::model(
            ARM.replace("{name: elbow, a_mm", "{name: elbow, b_mm"),
            &["arm.yaml:5:19: unknown key `b_mm` in an entry of `joints`\n", "did you mean `a_mm`?"],
        ),
        Case::model(
            format!("{ARM}arm: other\n"),
            &["arm.yaml:9:1: the key `arm` is given twice in one map\n", "keep one of the two"],
        ),
        Case::model(
            ARM.replace("  - {name", "\t- {name"),
            &["arm.yaml:4:", "there is a tab\n", "write spaces"],
        ),
        Case::model(
            String::new(),
            &["arm.yaml: the file is empty\n", "`plumb model template ROBOT` writes one"],
        ),
        Case {
            files: vec![
                ("arm.yaml", "arm: r\nconvention: {urdf: loop.urdf}\n".to_owned()),
                ("loop.urdf", URDF.to_owned()),
                ("poses.csv", table(|_, _| ())),
            ],
            asked: COMPARE,
            says: &["arm.yaml:2:13: loop.urdf: line 4: link `a` hangs on both", "a closed loop"],
        },
    ];
    cases.iter().for_each(Case::check);
}

#[test]
fn arguments_that_cannot_be_meant_say_what_would_do() {
    let cases = [
        Case::asked(
            &["compare", "poses.csv", "--data", "arm.yaml"],
            &[
                "poses.csv: this is a table of measurements, no model\n",
                "the model file comes first, the table after --data",
            ],
        ),
        Case::asked(
            &["compare", "arm.yaml", "--data", "arm.yaml"],
            &["arm.yaml: this is no table; the header needs q1_deg"],
        ),
        Case::asked(
            &["diagnose", "arm.yaml", "--data", "nowhere.csv"],
            &["nowhere.csv: there is no such file"],
        ),
        Case::asked(
            &["diagnose", "nowhere.yaml", "--data", "poses.csv"],
            &["nowhere.yaml: there is no such file"],
        ),
        Case::asked(&["diagnose", "arm.yaml", "--data", "."], &[".: this is a folder; name a file in it"]),
        Case::asked(
            &["add", "arm.yaml", "joint_complience(elbow)", "--data", "poses.csv"],
            &["there is no effect `joint_complience`; did you mean `joint_compliance`?"],
        ),
        Case::asked(
            &["add", "arm.yaml", "joint_gain(elbo)", "--data", "poses.csv"],
            &["there is none called `elbo`; did you mean `elbow`?"],
        ),
        Case::asked(
            &["add", "joint_gain(elbow)", "arm.yaml", "--data", "poses.csv"],
            &[
                "`arm.yaml` is a file and `joint_gain(elbow)` is none: the model file comes first, then the effect",
            ],
        ),
        Case::asked(
            &["add", "arm.yaml", "joint_gain(elbow", "--data", "poses.csv"],
            &["`joint_gain(elbow` is no effect; write a name and its place, such as joint_zero(*)"],
        ),
        Case::asked(
            &["compare", "arm.yaml", "--data", "poses.csv", "--holdout", "half"],
            &["`half` is no way to hold rows out; write regions, random:0.3:SEED"],
        ),
        Case::asked(
            &["report", "arm.yaml", "--data", "poses.csv", "-o", "nowhere/report.html"],
            &["nowhere/report.html: there is no folder nowhere to write to"],
        ),
        Case::asked(&["template", "ur55"], &["`ur55` is no robot that is known", "did you mean `ur5`?"]),
    ];
    cases.iter().for_each(Case::check);
}

#[test]
fn what_spreadsheets_write_is_read_as_it_is() {
    let plain = table(|_, _| ());
    let commas = plain.replace(',', ";").replace('.', ",");
    let utf16 = |text: &str| -> Vec<u8> {
        "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
    };
    let dialects: [(&str, Vec<u8>); 5] = [
        ("decimal commas", commas.clone().into_bytes()),
        (
            "a mark in front, lines ended by two letters",
            format!("\u{feff}{plain}").replace('\n', "\r\n").into_bytes(),
        ),
        ("tabs", plain.replace(',', "\t").into_bytes()),
        ("sixteen bits a letter", utf16(&plain.replace(',', "\t"))),
        ("sixteen bits a letter, decimal commas", utf16(&commas)),
    ];
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("arm.yaml"), ARM).unwrap();
    let table = folder.path().join("poses.csv");
    fs::write(&table, &plain).unwrap();
    let (code, expected) = printed(folder.path(), COMPARE);
    assert_eq!(code, Some(0), "{expected}");
    for (dialect, bytes) in dialects {
        fs::write(&table, bytes).unwrap();
        assert_eq!(printed(folder.path(), COMPARE), (Some(0), expected.clone()), "{dialect}");
    }
}
