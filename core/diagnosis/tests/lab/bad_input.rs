//! Files and tables that cannot be meant: each says what is wrong, where, and what would do.

use plumb_calibration::arm_model::Model;
use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;

use super::made_up::{COLUMN_ARM, TWO_LINKS, column_poses, column_tip, try_laboratory, two_links_tip};

const HEADER: &str = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm";

/// Rows of the two links as cells, changed by `change(row, cells)`.
fn rows(count: usize, change: impl Fn(usize, &mut Vec<String>)) -> String {
    let pose = |row: usize| (-100.0 + 37.0 * row as f64 % 190.0, -100.0 + 53.0 * row as f64 % 190.0);
    let mut text = String::new();
    for row in 0..count {
        let (shoulder, elbow) = pose(row);
        let (x, y) = two_links_tip(shoulder, elbow);
        let mut cells: Vec<String> = [shoulder, elbow, x, y, 0.0].iter().map(|v| format!("{v:.4}")).collect();
        change(row, &mut cells);
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

fn table(count: usize, change: impl Fn(usize, &mut Vec<String>)) -> String {
    format!("{HEADER}\n{}", rows(count, change))
}

fn scale(cell: &mut String, factor: f64) {
    *cell = format!("{:.7}", cell.parse::<f64>().unwrap() * factor);
}

/// The first message, from reading to fitting.
fn message(model: &str, table: &str) -> String {
    let options = Options { holdout: Holdout::None, ..Options::default() };
    match try_laboratory(model, table, options) {
        Err(reported) => reported,
        Ok(laboratory) => match laboratory.compare(&Progress::unwatched()) {
            Err(error) => error.to_string(),
            Ok(comparison) => format!("no error, but: {:?}", comparison.warnings),
        },
    }
}

fn message_of_model(model: &str) -> String {
    Model::parse("model.yaml", model).map_or_else(|error| error.to_string(), |_| "no error".to_owned())
}

fn says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is missing in: {message}");
    }
}

fn free(effects: &str) -> String {
    TWO_LINKS.replace("free: []", &format!("free: [{effects}]"))
}

#[test]
fn a_number_that_is_none_names_its_line_and_column() {
    let table = table(10, |row, cells| {
        if row == 3 {
            cells[2] = "NaN".to_owned()
        }
    });
    says(
        &message(TWO_LINKS, &table),
        &["table.csv: line 5, column 3 (`p1_x_mm`)", "`NaN` is not a finite number", "leave the cell empty"],
    );
}

#[test]
fn a_unit_inside_a_cell_is_refused() {
    let table = table(10, |row, cells| {
        if row == 4 {
            cells[2].push_str(" mm")
        }
    });
    says(&message(TWO_LINKS, &table), &["line 6, column 3", "mm` is not a number"]);
}

#[test]
fn a_table_in_metres_under_a_header_in_millimetres_is_refused() {
    let table = table(20, |_, cells| cells[2..5].iter_mut().for_each(|cell| scale(cell, 1e-3)));
    says(
        &message(TWO_LINKS, &table),
        &["the positions of p1", "1000 times as long (m for mm?)", "correct the unit in the header"],
    );
}

#[test]
fn one_axis_in_inches_is_found() {
    let table = table(20, |_, cells| scale(&mut cells[3], 1.0 / 25.4));
    says(&message(TWO_LINKS, &table), &["the y coordinates of p1", "25.4 times as long (in for mm?)"]);
}

#[test]
fn radians_under_a_header_in_degrees_are_refused() {
    let all = table(20, |_, cells| cells[..2].iter_mut().for_each(|cell| scale(cell, 1.0_f64.to_radians())));
    says(&message(TWO_LINKS, &all), &["the joints cannot be in the unit", "read as radians they would fit"]);
    let one = table(20, |_, cells| scale(&mut cells[1], 1.0_f64.to_radians()));
    says(&message(TWO_LINKS, &one), &["the values of q2", "read as radians"]);
}

#[test]
fn a_row_in_another_unit_than_the_others_is_named() {
    let metres = table(20, |row, cells| {
        if row >= 14 {
            cells[2..5].iter_mut().for_each(|cell| scale(cell, 1e-3));
        }
    });
    says(
        &message(TWO_LINKS, &metres),
        &[
            "line 16: the position is in another unit than in the other rows",
            "write the whole column in one unit",
        ],
    );
    let radians = table(20, |row, cells| {
        if row == 7 {
            cells[..2].iter_mut().for_each(|cell| scale(cell, 1.0_f64.to_radians()));
        }
    });
    says(&message(TWO_LINKS, &radians), &["line 9: the pose is in another unit", "read as radians"]);
}

#[test]
fn wrong_units_are_found_wherever_base_and_instrument_stand() {
    let model =
        TWO_LINKS.replace("free: false}\ntargets", "free: true}\ntargets").replace("world", "instrument");
    let table = table(20, |_, cells| {
        cells[2..4]
            .iter_mut()
            .for_each(|cell| *cell = format!("{:.6}", cell.parse::<f64>().unwrap() / 25.4 + 900.0));
    });
    says(&message(&model, &table), &["the positions of p1", "25.4 times as long (in for mm?)"]);
}

#[test]
fn a_joint_that_counts_the_other_way_is_pointed_out() {
    let table = table(20, |_, cells| scale(&mut cells[1], -1.0));
    says(
        &message(TWO_LINKS, &table),
        &["would fit the arm if shoulder or elbow counted the other way: check the `sign`"],
    );
}

#[test]
fn commanded_coordinates_beyond_the_limits_are_pointed_out() {
    let table = table(20, |row, cells| {
        if row == 2 {
            cells[0] = "185".to_owned();
        }
    });
    says(&message(TWO_LINKS, &table), &["beyond the model's limits", "line 4: shoulder at 185.00 deg"]);
}

#[test]
fn a_table_for_another_number_of_joints_says_both_numbers() {
    let table = "q1_deg,q2_deg,q3_deg,p1_x_mm\n1,2,3,4\n5,6,7,8\n";
    says(&message(TWO_LINKS, table), &["the table has 3 joints (q1 ... q3)", "the arm two-links has 2"]);
}

#[test]
fn one_row_or_rows_all_alike_cannot_be_fitted() {
    let model = free("joint_zero(*)");
    says(&message(&model, &table(1, |_, _| ())), &["only one row", "measure more poses"]);
    let alike = format!("{HEADER}\n{}", rows(1, |_, _| ()).repeat(8));
    says(&message(&model, &alike), &["all 8 rows have the same pose", "a fit needs different ones"]);
}

#[test]
fn fewer_numbers_than_unknowns_are_refused() {
    let model = free("joint_zero(*), link_length(*)");
    let table = "q1_deg,q2_deg,p1_x_mm\n10,20,320.3\n-40,60,265.1\n30,-70,341.9\n";
    says(&message(&model, table), &["3 measured numbers cannot settle", "measure more poses, or free fewer"]);
}

#[test]
fn an_arm_that_cannot_move_is_reported() {
    let model = TWO_LINKS.replace("a_mm: 200", "a_mm: 0").replace("a_mm: 150", "a_mm: 0");
    says(
        &message(&model, &table(20, |_, _| ())),
        &[
            "the arm two-links cannot move p1",
            "check lengths (`a_mm`, `d_mm`), twists and the target's `xyz_mm`",
        ],
    );
}

#[test]
fn freedoms_a_singular_arm_cannot_distinguish_are_named_not_inverted() {
    // Two joints on one axis: only the sum of their zeros can be seen.
    let model = "
arm: twins
convention: distal
joints: [{name: first}, {name: second, a_mm: 200}]
base: {free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
free: [joint_zero(*)]
measured_from: world
";
    let mut table = format!("{HEADER}\n");
    for row in 0..12 {
        let (first, second) = (-80.0 + 11.0 * f64::from(row), 40.0 - 17.0 * f64::from(row));
        let (sine, cosine) = (first + second + 0.5_f64).to_radians().sin_cos();
        table.push_str(&format!("{first},{second},{:.5},{:.5},0\n", 200.0 * cosine, 200.0 * sine));
    }
    let laboratory =
        try_laboratory(model, &table, Options { holdout: Holdout::None, ..Options::default() }).unwrap();
    let found = laboratory.compare(&Progress::unwatched()).unwrap();
    assert!(found.rms_mm.fit < 1e-3, "{:?}", found.rms_mm);
    let gauge = found.gauges.first().expect("one of the two zeros is held");
    let both = format!("{} {}", gauge.held, gauge.same_as.join(" "));
    assert!(both.contains("joint_zero(first)") && both.contains("joint_zero(second)"), "{both}");
}

#[test]
fn known_distances_that_cannot_all_be_true_are_refused() {
    let touch = |entries: &str| format!("{COLUMN_ARM}targets: {{p1: {{}}}}\ntouch:\n  distances:\n{entries}");
    let triangle = touch(
        "    - {between: [a, b], mm: 50}\n    - {between: [b, c], mm: 20}\n    - {between: [a, c], mm: 90}\n",
    );
    says(
        &message_of_model(&triangle),
        &["model.yaml:", "`a` and `c` cannot be 90 mm apart", "at most 70 mm"],
    );
    let twice = touch("    - {between: [a, b], mm: 50}\n    - {between: [b, a], mm: 51}\n");
    says(&message_of_model(&twice), &["model.yaml:", "said to be 50 mm apart and 51 mm apart\n", "keep one"]);
    let itself = touch("    - {between: [a, a], mm: 50}\n");
    says(&message_of_model(&itself), &["between `a` and itself"]);
}

#[test]
fn distances_from_one_pose_that_cannot_meet_are_refused() {
    let model = format!(
        "{COLUMN_ARM}base: {{free: false}}\ntargets: {{p1: {{free: false}}}}\nmeasured_from: world
surfaces: {{left: {{point_mm: [0, 500, 0]}}, right: {{point_mm: [0, -500, 0]}}}}\n"
    );
    let mut table = "q1_deg,q2_deg,q3_deg,distance_mm,distance_to\n".to_owned();
    for (row, q) in column_poses(8, 1).into_iter().enumerate() {
        let [x, y, z] = column_tip(q);
        for (name, side) in [("left", 500.0), ("right", -500.0)] {
            let distance = (x * x + (y - side) * (y - side) + z * z).sqrt();
            let wrong = if row == 5 && side < 0.0 { -1000.0 } else { 0.0 };
            let [a, b, c] = q;
            table.push_str(&format!("{a},{b},{c},{:.4},{name}\n", (distance + wrong).max(3.0)));
        }
    }
    says(
        &message(&model, &table),
        &[
            "lines 12 and 13: from one pose p1 cannot be",
            "mm from `left`",
            "mm from `right`",
            "measure one of them again",
        ],
    );
}

#[test]
fn decimal_commas_between_commas_are_explained() {
    let points = table(4, |_, _| ());
    let commas = points.lines().skip(1).map(|line| line.replace('.', ",")).collect::<Vec<_>>().join("\n");
    says(
        &message(TWO_LINKS, &format!("{HEADER}\n{commas}\n")),
        &["line 2: 10 cells where the header has 5", "decimal commas, separate the columns by semicolons"],
    );
    let mixed = format!("{HEADER}\n{}", rows(4, |_, _| ()).replace(',', ";").replace('.', ","));
    says(&message(TWO_LINKS, &mixed), &["line 2", "separated by semicolons and the header by commas"]);
}

#[test]
fn an_empty_file_a_header_alone_and_noise_are_distinguished() {
    says(&message(TWO_LINKS, ""), &["table.csv: the file is empty", "the first line must name the columns"]);
    says(&message(TWO_LINKS, &format!("{HEADER}\n")), &["no rows below the header"]);
    says(&message(TWO_LINKS, "\u{1}\u{2}x\u{0}y\n1\n"), &["no joint columns", "q1_deg ... qn_deg"]);
}

#[test]
fn surfaces_targets_and_frames_that_are_missing_say_where_to_add_them() {
    let row = |header: &str, cells: &str| format!("q1_deg,q2_deg,{header}\n10,20,{cells}\n30,40,{cells}\n");
    says(
        &message(TWO_LINKS, &row("p2_x_mm", "5")),
        &["measures a target the model does not have", "add `p2` under `targets:`"],
    );
    says(
        &message(TWO_LINKS, &row("on", "tabel")),
        &["line 2: `tabel` in column `on` is not in the model's `surfaces:`"],
    );
    says(
        &message(TWO_LINKS, &row("height_mm", "5")),
        &["`height_mm` needs a plane in the model's `surfaces:`"],
    );
    says(&message(TWO_LINKS, &row("tilt_x_deg", "5")), &["need `level:` in the model"]);
    let levels = format!("{TWO_LINKS}levels:\n  arm: {{after: shoulder}}\n  hand: {{after: elbow}}\n");
    says(
        &message(&levels, &row("tilt_x_deg", "5")),
        &["say in column `level` which of the model's levels it is: arm, hand"],
    );
    says(
        &message(&levels, &row("tilt_x_deg,level", "5,hnad")),
        &["`hnad` in column `level` is not in the model's `levels:`", "did you mean `hand`?"],
    );
    says(&message(TWO_LINKS, &row("distance_mm", "5")), &["line 2: a distance needs `distance_to`"]);
    says(&message(TWO_LINKS, &row("humidity", "5")), &["nothing was measured; the table needs p1_x_mm"]);
}

#[test]
fn a_slide_in_degrees_and_a_turn_in_millimetres_are_refused_with_the_right_column() {
    let rows: String = (0..6).map(|row| format!("{row},{},1,2,3\n", 2 * row)).collect();
    let turned = format!("q1_mm,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n{rows}");
    says(&message(TWO_LINKS, &turned), &["column `q1_mm`", "turns", "give it as `q1_deg` or `q1_rad`"]);
    let sliding = "arm: lift
convention: distal
joints:
  - {name: turn, a_mm: 200, alpha_deg: 0, d_mm: 0, theta_deg: 0, limits_deg: [-180, 180]}
  - {name: quill, a_mm: 0, alpha_deg: 0, d_mm: 0, theta_deg: 0, slides: true, limits_mm: [0, 100]}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
measured_from: world
";
    let degrees = format!("q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n{rows}");
    says(
        &message(sliding, &degrees),
        &["column `q2_deg`", "joint `quill` of the arm lift slides", "`q2_mm` or `q2_m` or `q2_in`"],
    );
    let millimetres = format!("q1_deg,q2_mm,p1_x_mm,p1_y_mm,p1_z_mm\n{rows}");
    assert!(!message(sliding, &millimetres).contains("slides"), "{}", message(sliding, &millimetres));
}
