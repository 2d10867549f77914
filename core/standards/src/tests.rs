//! Figures of runs with known answers. The numbers of the first were worked out apart from this program, with Python's `statistics`.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use plumb_calibration::arm_model::Model;
use plumb_calibration::table::Table;

use super::*;

/// Targets, mm, and deviations in the positive and the negative direction, um.
const DEVIATIONS: [(f64, [f64; 5], [f64; 5]); 6] = [
    (3.0, [0.2, -1.0, 0.6, 0.0, 0.3], [-2.9, -3.8, -2.9, -3.5, -4.6]),
    (61.2, [5.6, 5.9, 5.5, 4.5, 4.6], [2.2, 2.3, 2.4, -0.5, 1.9]),
    (118.9, [2.9, 3.5, 2.5, 2.6, 3.4], [-0.2, -0.5, -0.6, 1.0, -0.1]),
    (181.4, [-0.6, 0.1, 1.1, 0.7, -0.4], [-2.7, -3.5, -4.2, -3.8, -2.2]),
    (240.7, [3.0, 2.4, 4.2, 3.1, 2.6], [0.7, -0.3, -0.5, -1.4, 1.3]),
    (299.0, [9.5, 8.3, 10.7, 9.9, 10.4], [7.4, 5.2, 5.5, 6.7, 6.9]),
];

/// The run as a table: `reading` makes what was read of target and deviation, mm.
fn table(header: &str, reading: impl Fn(f64, f64) -> String) -> Table {
    let mut text = format!("{header}\n");
    for (at, positive, negative) in DEVIATIONS {
        for (side, deviations) in [(1, positive), (-1, negative)] {
            for deviation in deviations {
                text.push_str(&format!("{at},{side},t{at},{}\n", reading(at, deviation / 1000.0)));
            }
        }
    }
    Table::parse("axis.csv", &text).unwrap()
}

fn plain() -> Table {
    table("q1_mm,approach_q1,repeat,p1_x_mm", |at, deviation| format!("{}", at + deviation))
}

fn figures(table: &Table) -> Iso230 {
    iso_230_2(&AxisRun::of(table, &AxisChoice::default()).unwrap())
}

fn close(value: f64, right: f64) {
    assert!((value - right).abs() < 1e-8, "{value} and not {right}");
}

#[test]
fn the_figures_of_an_axis_are_those_of_the_standard() {
    let report = figures(&plain());
    let (both, positive, negative) =
        (report.bidirectional.unwrap(), report.positive.unwrap(), report.negative.unwrap());
    for (value, right) in [
        (both.accuracy, 0.016592483),
        (positive.accuracy, 0.012892087),
        (negative.accuracy, 0.013188423),
        (both.systematic, 0.0133),
        (positive.systematic, 0.00974),
        (negative.systematic, 0.00988),
        (both.mean, 0.00981),
        (both.repeatability, 0.007263926),
        (positive.repeatability, 0.003748066),
        (negative.repeatability, 0.004887535),
        (both.reversal, 0.00356),
        (both.mean_reversal, 0.00336),
    ] {
        close(value, right);
    }
    assert_eq!((report.targets, report.approaches), (6, 5));
    assert!(report.notes.is_empty(), "{:?}", report.notes);
}

#[test]
fn other_units_another_zero_and_a_scale_that_counts_backwards_change_nothing() {
    let right = figures(&plain()).bidirectional.unwrap();
    let metres = table("q1_mm,approach_q1,repeat,p1_x_m", |at, deviation| {
        format!("{}", 7.5 - (at + deviation) / 1000.0)
    });
    let report = figures(&metres);
    let both = report.bidirectional.unwrap();
    for (value, right) in [
        (both.accuracy, right.accuracy),
        (both.repeatability, right.repeatability),
        (both.mean_reversal, right.mean_reversal),
    ] {
        close(value, right);
    }
    assert!(
        report.notes.iter().any(|note| note.contains("p1_x falls where q1_mm rises")),
        "{:?}",
        report.notes
    );
}

#[test]
fn what_is_no_run_along_an_axis_is_refused_with_its_position_and_what_would_be_right() {
    let head = "q1_mm,approach_q1,repeat,p1_x_mm\n";
    let rows = "0,1,a,0\n0,1,a,.01\n0,-1,a,0\n0,-1,a,.01\n9,1,b,9\n9,1,b,9\n9,-1,b,9\n9,-1,b,9\n";
    let message_for = |text: &str| {
        let table = Table::parse("axis.csv", text).unwrap();
        AxisRun::of(&table, &AxisChoice::default()).unwrap_err().to_string()
    };
    for (text, needed) in [
        ("q1_mm,repeat,p1_x_mm\n0,a,0\n9,b,9\n".to_owned(), "no column `approach_q1`"),
        (format!("{head}0,1,a,0\n9,0,b,9\n"), "line 3: `approach_q1` is empty or 0"),
        (
            format!("{head}0,1,a,0\n0,-1,a,0\n9,1,b,9\n9,-1,b,9\n"),
            "q1_mm = 0 mm was approached once in the positive direction",
        ),
        (
            format!("{head}{rows}9,1,b,9\n"),
            "q1_mm = 0 mm was approached 2 times in the positive direction, and 3 times elsewhere",
        ),
        (
            format!("{head}{rows}5,1,c,5\n5,1,c,5\n"),
            "q1_mm = 5 mm was approached 0 times in the negative direction",
        ),
        (
            format!("{head}{rows}").replace("9,1,b,9", "9,1,b,228.6").replace("9,-1,b,9", "9,-1,b,228.6"),
            "p1_x changes by 25.39",
        ),
        (
            format!("{head}{rows}").replace("9,-1,b,9\n", "9,-1,a,9\n"),
            "`repeat` a is used for q1_mm at 0 and at 9",
        ),
        (format!("{head}{rows}").replace("9,1,b,9\n", "9,1,b,\n"), "line 6: p1_x is empty"),
        ("q1_deg,approach_q1,p1_x_mm\n0,1,0\n9,1,9\n".to_owned(), "nothing was read in deg"),
        (
            "q1_mm,q2_mm,approach_q1,p1_x_mm\n0,0,1,0\n9,9,1,9\n".to_owned(),
            "q1_mm and q2_mm move; say which is the axis",
        ),
        (format!("{head}0,1,a,0\n0,1,a,0\n"), "no joint moves"),
    ] {
        let message = message_for(&text);
        assert!(message.starts_with("axis.csv: ") && message.contains(needed), "{message}\nwanted: {needed}");
    }
}

/// Poses as in the first test, worked out apart from this program.
const POSES: &str =
    "q1_deg,repeat,time_s,commanded_x_mm,commanded_y_mm,commanded_z_mm,p1_x_mm,p1_y_mm,p1_z_mm
0,P1,0,100,200,300,100.123,199.988,300.172
0,P1,1,100,200,300,100.15,199.942,300.192
0,P1,2,100,200,300,100.177,199.955,300.199
0,P1,3,100,200,300,100.142,199.984,300.199
0,P1,4,100,200,300,100.138,199.921,300.189
0,P1,5,100,200,300,100.107,199.91,300.155
5,P2,6,-50.5,20,410,-50.309,19.893,410.395
5,P2,7,-50.5,20,410,-50.27,19.902,410.36
5,P2,8,-50.5,20,410,-50.262,19.907,410.423
5,P2,9,-50.5,20,410,-50.285,19.888,410.34
5,P2,10,-50.5,20,410,-50.275,19.834,410.357
5,P2,11,-50.5,20,410,-50.227,19.834,410.424
";

#[test]
fn the_figures_of_poses_are_those_of_the_standard() {
    let table = Table::parse("poses.csv", POSES).unwrap();
    let report = iso_9283(&PoseRun::of(&table, None, None).unwrap());
    assert_eq!(report.commanded, CommandedFrom::Table);
    close(report.at[0].accuracy.unwrap(), 0.236514329);
    close(report.at[1].accuracy.unwrap(), 0.463031946);
    close(report.at[0].repeatability, 0.081521636);
    close(report.at[1].repeatability, 0.089144810);
    close(report.at[1].s_l_mm, 0.013109370);
    close(report.accuracy.unwrap(), 0.463031946);
    assert_eq!((report.variation, report.at[0].drift), (None, None));
}

#[test]
fn a_pose_that_creeps_has_a_drift_and_two_ways_to_it_a_variation() {
    let mut text = "q1_deg,approach_q1,repeat,time_s,commanded_x_mm,p1_x_mm\n".to_owned();
    for visit in 0..40_i32 {
        // Every second visit from the other side, a tenth of a millimetre off; the second half of the run .05 mm farther.
        let side = if visit % 2 == 0 { 1 } else { -1 };
        let x = 10.0 + 0.2 + 0.05 * f64::from(side) + if visit < 20 { 0.0 } else { 0.05 };
        text.push_str(&format!("0,{side},P,{visit},10,{x}\n"));
    }
    let table = Table::parse("poses.csv", &text).unwrap();
    let report = iso_9283(&PoseRun::of(&table, None, None).unwrap());
    close(report.variation.unwrap(), 0.1);
    let drift = report.at[0].drift.unwrap();
    close(drift.accuracy.unwrap(), 0.05);
    assert_eq!((drift.measurements, drift.over_s), (2, 38.0));
}

#[test]
fn what_holds_no_returns_to_poses_is_refused() {
    let message_for = |text: &str| {
        PoseRun::of(&Table::parse("poses.csv", text).unwrap(), None, None).unwrap_err().to_string()
    };
    for (text, needed) in [
        ("q1_deg,p1_x_mm\n0,1\n5,2\n".to_owned(), "no pose was reached twice"),
        ("q1_deg,repeat,p1_x_mm\n0,a,1\n5,b,2\n".to_owned(), "line 2: pose a was reached once"),
        (
            "q1_deg,repeat,p1_x_mm\n0,a,1\n5,a,2\n".to_owned(),
            "line 3: `repeat` a is used for two poses: q1 differs from line 2",
        ),
        (POSES.replace("199.955", ""), "line 4: p1_y is empty"),
        (POSES.replace("commanded_z_mm", "wanted_z"), "no column for commanded z"),
        (POSES.replace("commanded_z_mm", "commanded_z"), "`commanded_z` has no unit"),
        ("q1_deg,height_mm,on\n0,1,t\n0,1,t\n".to_owned(), "no position was read"),
    ] {
        let message = message_for(&text);
        assert!(message.contains(needed), "{message}\nwanted: {needed}");
    }
}

/// A slide with play whose zero and play are fitted to the run of the first test.
const SLIDE: &str = "arm: slide
convention: distal
joints: [{name: x, slides: true, theta_deg: 0, alpha_deg: 0}]
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 90, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
effects:
  - {effect: joint_zero, where: x, values: {zero_mm: 0}}
  - {effect: joint_backlash, where: x, values: {play_mm: 0}}
";

/// By hand: 60 readings, 30 from each side. Zero and play are uncorrelated in such a run; the zero is the mean of all readings, with the standard error
/// s / sqrt(60), the play twice half the difference of the two means, which moves each reading by half of it: s / sqrt(60) as well, where s is the scatter
/// of all readings about the two means with 58 degrees of freedom.
#[test]
fn a_budget_holds_what_each_effect_adds_and_the_sum_by_the_gum() {
    let model = Model::parse("slide.yaml", SLIDE).unwrap();
    let table = plain();
    let run = AxisRun::of(&table, &AxisChoice::default()).unwrap();
    let rows: Vec<usize> = run.targets.iter().flat_map(|target| target.rows.clone()).collect();
    let asked = Question { reading: "p1_x", unit: Unit::Mm, rows: &rows };
    let found = budget(&model, &table, &asked).unwrap();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (mut squares, mut single, mut between) = (0.0, 0.0, 0.0);
    for positive in [true, false] {
        let of = |one: &(f64, [f64; 5], [f64; 5])| if positive { one.1 } else { one.2 };
        let all: Vec<f64> = DEVIATIONS.iter().flat_map(of).map(|um| um / 1000.0).collect();
        squares += all.iter().map(|value| (value - mean(&all)).powi(2)).sum::<f64>();
        for target in all.chunks(5) {
            single += target.iter().map(|value| (value - mean(target)).powi(2)).sum::<f64>() / 48.0;
            between += (mean(target) - mean(&all)).powi(2) / 12.0;
        }
    }
    let unexplained = between - single / 5.0;
    let error = (squares / 58.0 / 60.0).sqrt();
    let part = |name: &str| found.components.iter().find(|one| one.name.starts_with(name)).unwrap().standard;
    let near =
        |value: f64, right: f64| assert!((value / right - 1.0).abs() < 0.03, "{value} and not {right}");
    near(part("joint_zero(x)"), error);
    near(part("joint_backlash(x)"), error);
    near(part("repeatability"), single.sqrt());
    near(part("not explained"), unexplained.sqrt());
    near(found.combined, (2.0 * error * error + single + unexplained).sqrt());
    close(found.expanded, 2.0 * found.combined);
    let missing = budget(&model, &table, &Question { reading: "distance", ..asked }).unwrap_err().to_string();
    assert!(missing.contains("says nothing of `distance`"), "{missing}");
}

/// Invented; the figures below were worked out apart from this program, in Python, by quaternions.
const ROTATED: &str = "\
q1_deg,repeat,commanded_qw,commanded_qx,commanded_qy,commanded_qz,p1_x_mm,p1_qw,p1_qx,p1_qy,p1_qz
0,P1,0.707106781,0,0.707106781,0,0,0.707354992,-0.001723276,0.706851067,0.002741425
0,P1,0.707106781,0,0.707106781,0,1,0.707117217,-0.000805409,0.707089334,0.003044039
0,P1,0.707106781,0,0.707106781,0,2,0.707471534,-0.000768569,0.7067373,0.002413857
0,P1,0.707106781,0,0.707106781,0,3,0.707177494,-0.001347821,0.707029994,0.002600588
0,P1,0.707106781,0,0.707106781,0,4,0.707669719,-0.001226929,0.70653771,0.002554902
5,P2,0.102731566,0.846312168,0.518878402,0.062985259,0,0.104034324,0.845970769,0.519355525,0.061482982
5,P2,0.102731566,0.846312168,0.518878402,0.062985259,1,0.104597672,0.846257279,0.518815401,0.061143472
5,P2,0.102731566,0.846312168,0.518878402,0.062985259,2,0.104354353,0.845817946,0.519500546,0.061817101
5,P2,0.102731566,0.846312168,0.518878402,0.062985259,3,0.103610207,0.846247214,0.518984398,0.061528622
5,P2,0.102731566,0.846312168,0.518878402,0.062985259,4,0.10436705,0.845981717,0.519275915,0.06144085
";

#[test]
fn figures_of_orientation_are_those_of_the_standard_also_where_angles_of_the_attitude_are_singular() {
    let table = Table::parse("poses.csv", ROTATED).unwrap();
    let report = iso_9283(&PoseRun::of(&table, None, None).unwrap());
    let same = |found: [f64; 3], expected: [f64; 3]| {
        assert!(
            found.iter().zip(expected).all(|(one, other)| (one - other).abs() < 1e-6),
            "{found:?} {expected:?}"
        );
    };
    let at = |pose: usize| report.at[pose].orientation.unwrap();
    same(at(0).accuracy.unwrap(), [0.121154, -0.041577, 0.311544]);
    same(at(0).repeatability, [0.114770, 0.108624, 0.111299]);
    same(at(1).accuracy.unwrap(), [-0.236296, 0.060650, 0.016800]);
    same(at(1).repeatability, [0.130181, 0.076914, 0.121823]);
    let all = report.orientation.unwrap();
    same(all.accuracy.unwrap(), [0.236296, 0.060650, 0.311544]);
    same(all.repeatability, [0.130181, 0.108624, 0.121823]);
    assert_eq!(all.variation, None);
    // Nobody says how it was to be turned: repeatability alone, about the mean.
    let without = ROTATED.replace("commanded_q", "note_q");
    let report = iso_9283(&PoseRun::of(&Table::parse("poses.csv", &without).unwrap(), None, None).unwrap());
    let alone = report.at[0].orientation.unwrap();
    assert_eq!(alone.accuracy, None);
    assert!(
        alone
            .repeatability
            .iter()
            .zip([0.114770, 0.108624, 0.111299])
            .all(|(one, other)| (one - other).abs() < 1e-3)
    );
    let refused = |text: String| {
        PoseRun::of(&Table::parse("poses.csv", &text).unwrap(), None, None).unwrap_err().to_string()
    };
    for (text, part) in [
        (ROTATED.replace("commanded_qz", "wanted"), "no column `commanded_qz`"),
        (
            ROTATED.replace("0.707106781,0,0.707106781,0,2", "0.7,0,0.1,0,2"),
            "line 4: the commanded quaternion has length 0.7071",
        ),
        (
            ROTATED.replace(",2,0.707471534,-0.000768569,0.7067373,0.002413857", ",2,,,,"),
            "line 4: the orientation of p1 is empty",
        ),
        (
            without.replace("note_qw", "commanded_yaw_deg"),
            "`commanded_yaw_deg` is no part of a commanded orientation",
        ),
    ] {
        let message = refused(text);
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn two_ways_to_a_pose_that_end_turned_have_a_variation_of_orientation() {
    let mut text = "q1_deg,approach_q1,repeat,p1_x_mm,p1_rx_deg,p1_ry_deg,p1_rz_deg\n".to_owned();
    for visit in 0..8 {
        let side = if visit % 2 == 0 { 1 } else { -1 };
        text.push_str(&format!("0,{side},P,0,0,0,{}\n", 30.0 + 0.1 * f64::from(side)));
    }
    let report = iso_9283(&PoseRun::of(&Table::parse("poses.csv", &text).unwrap(), None, None).unwrap());
    let variation = report.orientation.unwrap().variation.unwrap();
    close(variation[2], 0.2);
    assert!(variation[0] < 1e-9 && variation[1] < 1e-9);
}
