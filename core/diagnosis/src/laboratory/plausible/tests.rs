//! Slips with units and joints, on a planar arm of two links whose table is right but for one slip.

use super::*;

const ARM: &str = "
arm: two-links
convention: distal
joints:
  - {name: shoulder, a_mm: 200, limits_deg: [-170, 170]}
  - {name: elbow, a_mm: 150, limits_deg: [-150, 150]}
base: {xyz_mm: [0, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
free: []
measured_from: world
";

/// Angles (deg) and tip (mm) of a row.
type Row = [f64; 5];

fn row(number: usize) -> Row {
    let q = [-100.0 + 37.0 * number as f64 % 190.0, -100.0 + 53.0 * number as f64 % 190.0];
    let (first, second) = (q[0].to_radians(), (q[0] + q[1]).to_radians());
    [q[0], q[1], 200.0 * first.cos() + 150.0 * second.cos(), 200.0 * first.sin() + 150.0 * second.sin(), 0.0]
}

/// What is said of so many rows, each changed.
fn checked(count: usize, change: impl Fn(usize, &mut Row)) -> Result<Vec<String>, ImplausibleError> {
    let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for number in 0..count {
        let mut cells = row(number);
        change(number, &mut cells);
        text.push_str(&cells.map(|cell| format!("{cell:.9}")).join(","));
        text.push('\n');
    }
    check(&Model::parse("model.yaml", ARM).unwrap(), &Table::parse("table.csv", &text).unwrap())
}

fn unit(what: &str, as_what: &str) -> Result<Vec<String>, ImplausibleError> {
    let (what, as_what) = (what.to_owned(), as_what.to_owned());
    Err(ImplausibleError::Unit { table: "table.csv".to_owned(), what, as_what })
}

fn mixed(line: u32, what: &'static str, as_what: &'static str) -> Result<Vec<String>, ImplausibleError> {
    Err(ImplausibleError::MixedRow { table: "table.csv".to_owned(), line, what, as_what })
}

/// All lengths of a row times a factor.
fn stretched(cells: &mut Row, factor: f64) {
    cells[2..].iter_mut().for_each(|cell| *cell *= factor);
}

#[test]
fn a_table_that_is_right_is_let_be_and_too_few_rows_say_nothing() {
    assert_eq!(checked(20, |_, _| {}), Ok(Vec::new()));
    assert_eq!(checked(FEWEST - 1, |_, cells| stretched(cells, 1e-3)), Ok(Vec::new()));
    assert!(checked(FEWEST, |_, cells| stretched(cells, 1e-3)).is_err());
}

#[test]
fn every_slip_of_lengths_is_named_for_what_it_is() {
    for (factor, as_what) in LENGTH_SLIPS {
        assert_eq!(
            checked(20, |_, cells| stretched(cells, 1.0 / factor)),
            unit("the positions of p1", as_what)
        );
    }
    assert_eq!(
        checked(20, |_, cells| cells[3] /= 25.4),
        unit("the y coordinates of p1", "25.4 times as long (in for mm?)")
    );
}

#[test]
fn angles_in_another_unit_are_named_for_all_joints_or_for_one() {
    let all = checked(20, |_, cells| cells[..2].iter_mut().for_each(|q| *q = q.to_radians()));
    assert_eq!(all, unit("the joints", "read as radians"));
    assert_eq!(
        checked(20, |_, cells| cells[1] = cells[1].to_radians()),
        unit("the values of q2", "read as radians")
    );
}

#[test]
fn a_row_in_another_unit_is_named_by_its_line_and_a_row_that_is_merely_off_is_not() {
    let of_row = |expected: usize, change: fn(&mut Row)| {
        checked(20, move |number, cells| {
            if number == expected {
                change(cells)
            }
        })
    };
    assert_eq!(of_row(14, |cells| stretched(cells, 1e-3)), mixed(16, "the position", LENGTH_SLIPS[0].1));
    let radians = of_row(7, |cells| cells[..2].iter_mut().for_each(|q| *q = q.to_radians()));
    assert_eq!(radians, mixed(9, "the pose", "read as radians"));
    assert_eq!(of_row(5, |cells| cells[2] += 60.0), Ok(Vec::new()), "an outlier fits in no unit");
}

#[test]
fn a_joint_that_counts_the_other_way_is_reported_and_what_fits_no_way_as_well() {
    let backwards = checked(20, |_, cells| cells[1] = -cells[1]).unwrap();
    assert!(backwards[0].contains("if shoulder or elbow counted the other way"), "{backwards:?}");
    let foreign = checked(20, |number, cells| {
        let [x, y, z] = [7919, 6271, 3571].map(|step| ((number * step) % 20_000) as f64);
        cells[2..].copy_from_slice(&[x, y, z]);
    });
    assert!(foreign.unwrap()[0].contains("have little to do with those the model expects"));
}

#[test]
fn an_arm_that_cannot_move_its_point_is_refused_and_one_that_was_not_moved_is_not() {
    let still = ARM.replace("a_mm: 200", "a_mm: 0").replace("a_mm: 150", "a_mm: 0");
    let model = Model::parse("model.yaml", &still).unwrap();
    let text = |angle: fn(i32) -> i32| {
        let rows = (0..8).map(|row| format!("{},0,0,0,0\n", angle(row)));
        format!("q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n{}", rows.collect::<String>())
    };
    let moved = Table::parse("table.csv", &text(|row| 10 * row)).unwrap();
    assert!(matches!(check(&model, &moved), Err(ImplausibleError::Still { rows: 8, .. })));
    let still = Table::parse("table.csv", &text(|_| 10)).unwrap();
    assert_eq!(check(&model, &still), Ok(Vec::new()));
}

#[test]
fn coordinates_beyond_the_limits_are_counted_and_the_first_is_reported() {
    let odd = checked(20, |number, cells| {
        if number >= 18 {
            let rotation = if number == 18 { 172.0 } else { -175.0 } - cells[0];
            let (x, y) = (cells[2], cells[3]);
            let (sine, cosine) = rotation.to_radians().sin_cos();
            cells[0] += rotation;
            (cells[2], cells[3]) = (cosine * x - sine * y, sine * x + cosine * y);
        }
    });
    let odd = odd.unwrap();
    assert!(odd[0].starts_with("2 commanded coordinates lie beyond"), "{odd:?}");
    assert!(odd[0].contains("the first in line 20: shoulder at 172.00 deg"), "{odd:?}");
}

/// Two distances from one pose, to nails 300 mm apart.
fn nails(one: f64, other: f64) -> Result<Vec<String>, ImplausibleError> {
    let surfaces = "surfaces: {a: {point_mm: [0, 0, 0]}, b: {point_mm: [300, 0, 0]}}\n";
    let model = Model::parse("model.yaml", &format!("{ARM}{surfaces}")).unwrap();
    let text = format!("q1_deg,q2_deg,distance_mm,distance_to\n10,20,{one},a\n10,20,{other},b\n");
    check(&model, &Table::parse("table.csv", &text).unwrap())
}

#[test]
fn two_distances_from_one_pose_must_be_able_to_meet() {
    // The slack is 1 mm without a declared noise.
    assert_eq!(nails(100.0, 199.5), Ok(Vec::new()));
    assert!(matches!(nails(100.0, 198.5), Err(ImplausibleError::Distances { first: 2, second: 3, .. })));
    assert_eq!(nails(400.5, 100.0), Ok(Vec::new()));
    assert!(matches!(nails(401.5, 100.0), Err(ImplausibleError::Distances { .. })));
}

#[test]
fn short_distances_are_not_compared() {
    let points = |scale: f64| [0.0, 1.0, 100.0].map(|x| Vector3::new(scale * x, 0.0, 0.0));
    let found = ratios(&points(2.0), &points(1.0));
    assert_eq!((found[0][0], found[0][1], found[1][0]), (None, None, None));
    assert!((found[0][2].unwrap() - 2.0_f64.ln()).abs() < 1e-12 && found[2][1].is_some());
    assert!((median_size(&found) - 2.0_f64.ln()).abs() < 1e-12);
    assert_eq!(median_size(&[]), 0.0);
}

#[test]
fn a_point_is_still_where_the_joints_move_and_it_does_not() {
    let sample = |q: f64| Sample { line: 1, q: vec![q, 0.0], measured: Vector3::zeros() };
    let still = |qs: [f64; 3], x: [f64; 3]| {
        is_still(&qs.map(sample), &x.map(|x| Vector3::new(100.0 + x, -50.0, 20.0)))
    };
    assert!(still([0.0, 0.5, 0.0], [0.0, 1e-7, -1e-7]));
    assert!(!still([0.0, 0.5, 0.0], [0.0, 0.0, 1e-5]) && !still([0.0, 0.5, 1.0], [0.0, -1e-5, 0.0]));
    assert!(!still([0.5, 0.5, 0.5], [0.0; 3]), "the joints do not move either");
}

#[test]
fn distances_are_compared_where_they_are_long_enough_to_matter() {
    let at = |x: f64| Vector3::new(x, 0.0, 0.0);
    // The longest believed distance is 100: pairs from a fraction of it on count.
    let short = SHORT * 100.0;
    let believed = [at(0.0), at(100.0), at(1.01 * short), at(100.0 - 0.99 * short)];
    let measured = believed.map(|point| point * 2.0);
    let found = ratios(&measured, &believed);
    let known =
        |one: usize, other: usize| found[one][other].map(|ratio| (ratio / 2.0_f64.ln() * 1e6).round() / 1e6);
    assert_eq!(
        (known(0, 1), known(0, 2), known(2, 0), known(1, 3), known(0, 0)),
        (Some(1.0), Some(1.0), Some(1.0), None, None)
    );
    assert_eq!(
        ratios(&[at(1.0), at(2.0)], &[at(5.0), at(5.0)]),
        vec![vec![None, None]; 2],
        "they do not move"
    );
}

#[test]
fn coordinates_count_as_beyond_their_limits_from_a_thousandth_of_the_range_on() {
    let model = Model::parse("model.yaml", ARM).unwrap();
    let beyond = |rows: &[[f64; 2]]| {
        let rows: String = rows.iter().map(|q| format!("{},{},0,0,0\n", q[0], q[1])).collect();
        let text = format!("q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n{rows}");
        beyond_limits(&model, &Table::parse("table.csv", &text).unwrap())
    };
    // A thousandth of 340 and of 300 degrees.
    assert_eq!(beyond(&[[170.3, 150.25], [-170.3, -150.25]]), None);
    let noted = beyond(&[[0.0, 0.0], [0.0, -150.4], [170.4, 0.0], [-170.4, 150.4]]).unwrap();
    assert!(
        noted.starts_with(
            "4 commanded coordinates lie beyond the model's limits, the first in line 3: elbow at -150.40 deg"
        ),
        "{noted}"
    );
}

#[test]
fn rows_of_other_sessions_are_looked_at_unless_each_has_a_base_of_its_own() {
    let table =
        "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm,session\n0,0,1,2,3,mon\n0,1,4,5,6,tue\n0,2,7,8,9,mon\n";
    let table = Table::parse("table.csv", table).unwrap();
    let mut model = Model::parse("model.yaml", ARM).unwrap();
    let positions = &table.positions[0].xyz;
    let lines =
        |model: &Model| samples(model, &table, positions).iter().map(|one| one.line).collect::<Vec<_>>();
    assert_eq!(lines(&model), [2, 3, 4]);
    model.base.per_session = true;
    assert_eq!(lines(&model), [2, 4]);
}
