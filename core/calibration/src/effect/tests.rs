//! Every kind of effect against an independent formula: what an arm of a textbook measures with it, less what it measures without.
//!
//! The arm of most of them is the planar one of two links (Spong, Hutchinson and Vidyasagar 2006, section 3.3) in a vertical plane, x ahead and z up,
//! with all its weight at the tip.

mod names;
mod rates;
mod sizes;
mod summary;
mod torsion;

use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::arm_model::{AddedEffect, Model, StripeRig};
use crate::fit::ResidualModel;
use crate::measurement::Observations;
use crate::table::{Stretch, Table};

/// Links, mm.
const LINKS: [f64; 2] = [400.0, 300.0];

/// Standard gravity, m/s2.
const GRAVITY: f64 = 9.80665;

/// Mass at the tip, kg.
const TIP_MASS: f64 = 2.0;

const PLANAR: &str = "
arm: planar
convention: distal
joints:
  - {name: shoulder, a_mm: 400}
  - {name: elbow, a_mm: 300}
links: [{after: elbow, mass_kg: 2, centre_mm: [0, 0, 0]}]
base: {xyz_mm: [0, 0, 0], rpy_deg: [90, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
measured_from: world
";

/// What a row of the table reads with these effects, given as written with their values (inner units), less what it reads without.
fn changes_with(model: &str, table: &str, row: usize, effects: &[(&str, Option<f64>, &[f64])]) -> Vec<f64> {
    let model = Model::parse("arm.yaml", model).unwrap();
    let table = Table::parse("table.csv", table).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let added = |(text, inner, values): &(&str, Option<f64>, &[f64])| {
        let id = EffectId { inner: *inner, ..parse(text, &model).unwrap() };
        AddedEffect { id, values: values.to_vec() }
    };
    let effects: Vec<AddedEffect> = effects.iter().map(added).collect();
    let residuals = |effects: &[AddedEffect]| {
        let problem = ResidualModel::new(&model, &table, &observations, effects).unwrap();
        problem.residuals(&problem.start())[observations.range(row)].to_vec()
    };
    // Residuals are measured less predicted.
    residuals(&[]).iter().zip(residuals(&effects)).map(|(without, with)| without - with).collect()
}

/// The same of one effect that nothing is searched for in.
fn changes(model: &str, table: &str, row: usize, effect: &str, values: &[f64]) -> Vec<f64> {
    changes_with(model, table, row, &[(effect, None, values)])
}

/// The tip of the planar arm, mm; angles from the horizontal, rad.
fn tip(links: [f64; 2], shoulder: f64, elbow: f64) -> Vector3<f64> {
    let along = |length: f64, angle: f64| Vector3::new(length * angle.cos(), 0.0, length * angle.sin());
    along(links[0], shoulder) + along(links[1], shoulder + elbow)
}

/// The pose of most tests, deg.
const POSE: [f64; 2] = [25.0, 40.0];

fn pose() -> [f64; 2] {
    POSE.map(f64::to_radians)
}

/// A table of that pose with more columns.
fn table(columns: &str, cells: &str) -> String {
    let comma = if columns.is_empty() { "" } else { "," };
    format!("q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm{comma}{columns}\n25,40,0,0,0{comma}{cells}\n")
}

/// How far the tip moves when the shoulder and the elbow are off by so much, rad.
fn displaced(shoulder: f64, elbow: f64) -> Vector3<f64> {
    let [one, other] = pose();
    tip(LINKS, one + shoulder, other + elbow) - tip(LINKS, one, other)
}

fn assert_close(found: &[f64], expected: &[f64], within: f64, what: &str) {
    let close =
        found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < within);
    assert!(close, "{what}: {found:?} instead of {expected:?}");
}

/// One effect at the usual pose moves the tip so.
fn assert_moves(effect: &str, values: &[f64], expected: Vector3<f64>) {
    let found = changes(PLANAR, &table("", ""), 0, effect, values);
    assert_close(&found, expected.as_slice(), 1e-9, effect);
}

#[test]
fn a_zero_turns_a_joint_by_its_value_in_the_coordinates_sense() {
    assert_moves("joint_zero(shoulder)", &[0.01], displaced(0.01, 0.0));
    assert_moves("joint_zero(elbow)", &[-0.02], displaced(0.0, -0.02));
    let mirrored = PLANAR.replace("{name: elbow, a_mm: 300}", "{name: elbow, a_mm: 300, sign: -1}");
    let found = changes(&mirrored, &table("", ""), 0, "joint_zero(elbow)", &[0.01]);
    let [one, other] = pose();
    let expected = tip(LINKS, one, -other - 0.01) - tip(LINKS, one, -other);
    assert_close(&found, expected.as_slice(), 1e-9, "a joint counted the other way");
}

#[test]
fn a_gain_grows_with_the_joints_own_coordinate_and_a_coupling_with_the_others() {
    let [shoulder, elbow] = pose();
    assert_moves("joint_gain(elbow)", &[0.01], displaced(0.0, 0.01 * elbow));
    assert_moves("joint_coupling(elbow, shoulder)", &[0.01], displaced(0.0, 0.01 * shoulder));
    assert_moves("joint_coupling(shoulder, elbow)", &[-0.02], displaced(-0.02 * elbow, 0.0));
}

#[test]
fn a_harmonic_is_a_sine_and_a_cosine_of_so_many_periods_a_turn() {
    let elbow = pose()[1];
    let (sine, cosine) = (0.003, -0.002);
    let by = sine * (3.0 * elbow).sin() + cosine * (3.0 * elbow).cos();
    assert_moves("joint_harmonic(elbow, 3)", &[sine, cosine], displaced(0.0, by));
}

#[test]
fn play_leaves_a_joint_half_its_width_behind_on_the_side_it_came_from() {
    let play = 0.004;
    for (side, by) in [("1", -0.5 * play), ("-1", 0.5 * play), ("0", 0.0)] {
        let table = table("approach_q1,approach_q2", &format!("0,{side}"));
        let found = changes(PLANAR, &table, 0, "joint_backlash(elbow)", &[play]);
        assert_close(&found, displaced(0.0, by).as_slice(), 1e-9, side);
    }
}

#[test]
fn without_a_logged_side_play_goes_by_the_way_from_the_row_before() {
    let play = 0.004;
    let rows = ["0,20,0,0,0", "5,40,0,0,0", "9,30,0,0,0", "9,30.01,0,0,0"];
    let table = format!("q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n{}\n", rows.join("\n"));
    let found = |row: usize| changes(PLANAR, &table, row, "joint_backlash(elbow)", &[play]);
    let tip_at = |shoulder: f64, elbow: f64| tip(LINKS, shoulder.to_radians(), elbow.to_radians());
    let moved = |shoulder: f64, elbow: f64, by: f64| {
        tip_at(shoulder, elbow + by.to_degrees()) - tip_at(shoulder, elbow)
    };
    for (row, expected) in [(1, moved(5.0, 40.0, -0.5 * play)), (2, moved(9.0, 30.0, 0.5 * play))] {
        assert_close(&found(row), expected.as_slice(), 1e-9, "up, then down");
    }
    for row in [0, 3] {
        assert_close(&found(row), &[0.0; 3], 1e-9, "no row before it, and no move but scatter");
    }
    // The shoulder moved one way only: nothing distinguishes play from a zero there.
    let model = Model::parse("arm.yaml", PLANAR).unwrap();
    let summary = DatasetSummary::of(&model, &Table::parse("table.csv", &table).unwrap());
    assert_eq!([0, 1].map(|joint| summary.came_both_ways(joint)), [false, true]);
}

#[test]
fn a_soft_joint_is_turned_by_the_moment_of_gravity_and_lets_the_tip_down() {
    let [shoulder, elbow] = pose();
    let compliance = 1e-5;
    let out = tip(LINKS, shoulder, elbow).x;
    // The weight pulls down at the tip: its moment turns the shoulder down, rad for N m.
    let by = -compliance * TIP_MASS * GRAVITY * out * 1e-3;
    let expected = displaced(by, 0.0);
    assert!(expected.z < 0.0);
    let found = changes(PLANAR, &table("", ""), 0, "joint_compliance(shoulder)", &[compliance]);
    assert_close(&found, expected.as_slice(), 1e-3 * expected.norm(), "compliance");
    // A load in the hand adds to it.
    let loaded = changes(PLANAR, &table("payload_kg", "3"), 0, "joint_compliance(shoulder)", &[compliance]);
    let expected = displaced(by * (TIP_MASS + 3.0) / TIP_MASS, 0.0);
    assert_close(&loaded, expected.as_slice(), 1e-3 * expected.norm(), "with a load");
}

#[test]
fn a_joint_under_a_weight_that_nobody_knows_is_turned_by_the_cosine_and_the_sine_of_its_links_angles() {
    let unknown = PLANAR.replace("links: [{after: elbow, mass_kg: 2, centre_mm: [0, 0, 0]}]\n", "");
    let [one, other] = pose();
    // A weight ahead on the upper arm lets the shoulder down by the cosine of its angle, one on the lower arm by that of its own.
    let cases: [(usize, f64); 4] =
        [(0, -one.cos()), (1, one.sin()), (3, -(one + other).cos()), (4, (one + other).sin())];
    for (parameter, fraction) in cases {
        let mut values = [0.0; 6];
        values[parameter] = 1e-3;
        let found = changes(&unknown, &table("", ""), 0, "gravity_flexure(shoulder)", &values);
        // The deflection itself turns what pulls, by a thousandth of it.
        assert_close(&found, displaced(1e-3 * fraction, 0.0).as_slice(), 1e-3, &format!("term {parameter}"));
    }
    // Along the axes nothing pulls, and a declared mass makes one number of it.
    let found =
        changes(&unknown, &table("", ""), 0, "gravity_flexure(shoulder)", &[0.0, 0.0, 1e-3, 0.0, 0.0, 1e-3]);
    assert_close(&found, &[0.0; 3], 1e-12, "square to the plane");
    let rows = "q1_deg,q2_deg,p1_x_mm\n0,10,0\n20,40,0\n50,-30,0\n";
    assert!(offered(&unknown, rows).contains(&"gravity_flexure".to_owned()));
    assert!(!offered(PLANAR, rows).iter().any(|one| one.starts_with("gravity_flexure")));
}

#[test]
fn a_slide_has_no_flexure_that_turns_it() {
    let text = PLANAR.replace("{name: elbow, a_mm: 300}", "{name: elbow, slides: true}");
    let model = Model::parse("arm.yaml", &text).unwrap();
    let refused = build(&parse("gravity_flexure(elbow)", &model).unwrap(), &model).unwrap_err().to_string();
    assert!(refused.contains("acts on a joint that turns"), "{refused}");
}

#[test]
fn a_stiffening_joint_winds_up_as_a_cubic_spring() {
    let [shoulder, elbow] = pose();
    let (compliance, knee) = (1e-5, 2.0);
    let moment = -TIP_MASS * GRAVITY * tip(LINKS, shoulder, elbow).x * 1e-3;
    // moment = knee (w + w^3), by Cardano's formula.
    let half = 0.5 * moment / knee;
    let root = (half * half + 1.0 / 27.0).sqrt();
    let wound = (half + root).cbrt() + (half - root).cbrt();
    let expected = displaced(compliance * knee * wound, 0.0);
    let effect: (&str, Option<f64>, &[f64]) = ("joint_stiffening(shoulder)", Some(knee), &[compliance]);
    let found = changes_with(PLANAR, &table("", ""), 0, &[effect]);
    assert_close(&found, expected.as_slice(), 1e-3 * expected.norm(), "stiffening");
}

#[test]
fn a_settling_joint_stops_short_by_a_fraction_of_its_last_move() {
    let table = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n25,10,0,0,0\n25,40,0,0,0\n";
    let moved = 30_f64.to_radians();
    let found = changes(PLANAR, table, 1, "joint_settling(elbow)", &[0.01]);
    assert_close(&found, displaced(0.0, -0.01 * moved).as_slice(), 1e-9, "after a move");
    let first = changes(PLANAR, table, 0, "joint_settling(elbow)", &[0.01]);
    assert_close(&first, &[0.0; 3], 1e-12, "where no move is known");
}

#[test]
fn a_lagging_joint_stops_short_by_its_part_of_the_greatest_speed() {
    let table = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n-35,10,0,0,0\n25,40,0,0,0\n";
    let after = |effect: &str| changes(PLANAR, table, 1, effect, &[0.01]);
    // The shoulder went 60 deg, the elbow 30 in the same time.
    assert_close(&after("joint_lag(elbow)"), displaced(0.0, -0.005).as_slice(), 1e-9, "at half the speed");
    assert_close(&after("joint_lag(shoulder)"), displaced(-0.01, 0.0).as_slice(), 1e-9, "at full speed");
    let first = changes(PLANAR, table, 0, "joint_lag(elbow)", &[0.01]);
    assert_close(&first, &[0.0; 3], 1e-12, "where no move is known");
}

#[test]
fn a_step_stays_from_its_moment_on() {
    let rows = table("time_s", "50") + "25,40,0,0,0,100\n";
    let at = |row: usize| {
        let effect: (&str, Option<f64>, &[f64]) = ("joint_step(elbow)", Some(100.0), &[0.01]);
        changes_with(PLANAR, &rows, row, &[effect])
    };
    assert_close(&at(0), &[0.0; 3], 1e-12, "before");
    assert_close(&at(1), displaced(0.0, 0.01).as_slice(), 1e-9, "from then on");
}

#[test]
fn what_warms_up_comes_to_its_value_exponentially() {
    let rows = table("time_s", "0") + "25,40,0,0,0,600\n";
    let part = 1.0 - (-600.0_f64 / 300.0).exp();
    let at = |row: usize, effect: &str, value: f64| {
        changes_with(PLANAR, &rows, row, &[(effect, Some(300.0), &[value])])
    };
    assert_close(&at(0, "warm_up(elbow, zero)", 0.01), &[0.0; 3], 1e-12, "cold");
    assert_close(&at(1, "warm_up(elbow, zero)", 0.01), displaced(0.0, 0.01 * part).as_slice(), 1e-9, "zero");
    let [shoulder, elbow] = pose();
    let longer = tip([400.0 + 2.0 * part, 300.0], shoulder, elbow) - tip(LINKS, shoulder, elbow);
    assert_close(&at(1, "warm_up(shoulder, length)", 2.0), longer.as_slice(), 1e-9, "length");
    // The joints' axes point along -y.
    assert_close(&at(1, "warm_up(shoulder, offset)", 2.0), &[0.0, -2.0 * part, 0.0], 1e-9, "offset");
}

#[test]
fn a_link_grows_by_its_length_for_a_kelvin_above_twenty_degrees() {
    let [shoulder, elbow] = pose();
    let longer = tip([400.0 + 400.0 * 2e-5 * 10.0, 300.0], shoulder, elbow) - tip(LINKS, shoulder, elbow);
    let found = changes(PLANAR, &table("temperature_c", "30"), 0, "thermal_growth(shoulder)", &[2e-5]);
    assert_close(&found, longer.as_slice(), 1e-9, "10 K warmer");
    let found = changes(PLANAR, &table("temperature_c", "20"), 0, "thermal_growth(shoulder)", &[2e-5]);
    assert_close(&found, &[0.0; 3], 1e-12, "at the reference temperature of ISO 1");
}

/// The tip by products of rotations and shifts, with a rotation before the elbow turns and another after the first link, world frame.
fn tip_with(leaning: Rotation3<f64>, twisted: Rotation3<f64>) -> Vector3<f64> {
    let [shoulder, elbow] = pose();
    let about_z = |angle: f64| Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
    let second = leaning * about_z(elbow) * Vector3::new(LINKS[1], 0.0, 0.0);
    let in_chain = about_z(shoulder) * (Vector3::new(LINKS[0], 0.0, 0.0) + twisted * second);
    // The chain's y is the world's z, and its z the world's -y.
    Vector3::new(in_chain.x, -in_chain.z, in_chain.y)
}

#[test]
fn errors_of_geometry_are_those_of_the_denavit_hartenberg_rows() {
    let [shoulder, elbow] = pose();
    let straight = tip(LINKS, shoulder, elbow);
    assert_moves("link_length(elbow)", &[1.5], tip([400.0, 301.5], shoulder, elbow) - straight);
    assert_moves("link_offset(elbow)", &[1.5], Vector3::new(0.0, -1.5, 0.0));
    let none = Rotation3::identity();
    assert!((tip_with(none, none) - straight).norm() < 1e-9);
    let twist = Rotation3::from_axis_angle(&Vector3::x_axis(), 0.01);
    assert_moves("link_twist(shoulder)", &[0.01], tip_with(none, twist) - straight);
    // Hayati's fifth parameter: the axis leans about y before the joint turns.
    let lean = Rotation3::from_axis_angle(&Vector3::y_axis(), 0.01);
    assert_moves("axis_skew(elbow)", &[0.01], tip_with(lean, none) - straight);
}

#[test]
fn a_link_sags_as_the_cantilever_of_the_textbook() {
    // Stretched out level, the weight at the end of the first link; the second goes on straight where the first ends.
    let model = PLANAR.replace("after: elbow, mass_kg: 2", "after: shoulder, mass_kg: 2");
    let level = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n0,0,0,0,0\n";
    let flexibility = 1e-6;
    let (force, length) = (TIP_MASS * GRAVITY, LINKS[0] * 1e-3);
    let deflection = flexibility * force * length.powi(3) / 3.0 * 1e3;
    let slope = flexibility * force * length.powi(2) / 2.0;
    let expected = [0.0, 0.0, -deflection - slope * LINKS[1]];
    let found = changes(&model, level, 0, "link_sag(shoulder)", &[flexibility]);
    assert_close(&found, &expected, 1e-3 * expected[2].abs(), "a cantilever with a force at its end");
}

#[test]
fn the_base_shifts_and_turns_about_its_own_origin() {
    let moved =
        PLANAR.replace("xyz_mm: [0, 0, 0], rpy_deg: [90, 0, 0]", "xyz_mm: [10, 20, 30], rpy_deg: [90, 0, 0]");
    let found = changes(&moved, &table("", ""), 0, "base_position", &[1.0, -2.0, 3.0]);
    assert_close(&found, &[1.0, -2.0, 3.0], 1e-9, "shift");
    let [shoulder, elbow] = pose();
    let from_base = tip(LINKS, shoulder, elbow);
    // About the base's own x and y, which are the world's x and z; about z it is the shoulder's zero.
    let small = 1e-6;
    for (values, axis) in [([small, 0.0], Vector3::x_axis()), ([0.0, small], Vector3::z_axis())] {
        let expected = Rotation3::from_axis_angle(&axis, small) * from_base - from_base;
        let found = changes(&moved, &table("", ""), 0, "base_tilt", &values);
        assert_close(&found, expected.as_slice(), 1e-9, "turn");
    }
}

#[test]
fn drift_grows_with_the_hours_since_the_first_row() {
    let rows = table("time_s", "1000") + "25,40,0,0,0,6400\n";
    let at = |row: usize| changes(PLANAR, &rows, row, "drift", &[0.2, 0.0, -0.1]);
    assert_close(&at(0), &[0.0; 3], 1e-12, "at first");
    assert_close(&at(1), &[0.3, 0.0, -0.15], 1e-9, "after an hour and a half");
}

#[test]
fn an_instrument_reads_too_long_along_its_axis_and_out_of_level_about_its_origin() {
    let [shoulder, elbow] = pose();
    let point = tip(LINKS, shoulder, elbow);
    let found = changes(PLANAR, &table("", ""), 0, "scale(x)", &[0.001]);
    assert_close(&found, &[0.001 * point.x, 0.0, 0.0], 1e-9, "scale");
    let small = 1e-6;
    let turned = Rotation3::from_axis_angle(&Vector3::y_axis(), small) * point - point;
    let found = changes(PLANAR, &table("", ""), 0, "instrument_tilt", &[0.0, small]);
    assert_close(&found, turned.as_slice(), 1e-9, "tilt");
}

#[test]
fn a_tool_sits_elsewhere_in_the_flanges_frame() {
    let along = pose()[0] + pose()[1];
    let (sine, cosine) = along.sin_cos();
    // The flange's x goes along the second link, its y square to it in the plane, its z along -y.
    let expected = Vector3::new(2.0 * cosine - sine, -3.0, 2.0 * sine + cosine);
    assert_moves("tool_offset(p1)", &[2.0, 1.0, 3.0], expected);
}

/// An arm that turns a column and slides along it, and out from it.
const SLIDES: &str = "
arm: cylindrical
convention: distal
joints:
  - {name: column, a_mm: 0}
  - {name: lift, slides: true, alpha_deg: 90, theta_deg: 90, limits_mm: [0, 500]}
  - {name: reach, slides: true, limits_mm: [0, 500]}
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
measured_from: world
";

#[test]
fn joints_that_slide_have_their_errors_in_millimetres() {
    let table = "q1_deg,q2_mm,q3_mm,p1_x_mm,p1_y_mm,p1_z_mm,approach_q1,approach_q2,approach_q3\n0,100,250,0,0,0,0,1,-1\n";
    let found = |effect: &str, value: f64| changes(SLIDES, table, 0, effect, &[value]);
    let moved = |axis: usize, by: f64| {
        let mut moved = [0.0; 3];
        moved[axis] = by;
        moved
    };
    assert_close(&found("joint_zero(lift)", 0.4), &moved(2, 0.4), 1e-9, "zero of the lift");
    assert_close(&found("joint_zero(reach)", 0.4), &moved(0, 0.4), 1e-9, "zero of the reach");
    assert_close(&found("joint_gain(reach)", 0.002), &moved(0, 0.5), 1e-9, "gain");
    assert_close(&found("joint_backlash(lift)", 0.6), &moved(2, -0.3), 1e-9, "play, come from below");
    assert_close(&found("joint_backlash(reach)", 0.6), &moved(0, 0.3), 1e-9, "play, come from outside");
    let units = ["joint_zero(lift)", "joint_backlash(lift)"].map(|text| {
        let model = Model::parse("arm.yaml", SLIDES).unwrap();
        build(&parse(text, &model).unwrap(), &model).unwrap().parameters()[0].unit.name
    });
    assert_eq!(units, ["mm", "mm"]);
}

/// The planar arm with a sensor that looks down from its tip, 8 mm at most, over a table.
fn sensing() -> String {
    PLANAR.replace("measured_from: world", "surfaces:\n  table: {plane: {normal: [0, 0, 1], offset_mm: 0}, free: false}\nmeasured_from: world\nnoise: {on_mm: 1}\nsensor: {working_mm: 8, peak_mm: 5, spot_mm: 3, hysteresis_percent: 10, dark_percent: 5}")
}

fn triggered(effect: &str, value: f64, signal: &str) -> f64 {
    let table = format!("q1_deg,q2_deg,on,signal\n25,40,table,{signal}\n");
    changes(&sensing(), &table, 0, effect, &[value])[0]
}

/// Light of the sensor's data sheet, 1 at its peak: (d/p)^2 exp(2 (1 - d/p)).
fn light(distance: f64) -> f64 {
    let relative = distance / 5.0;
    relative * relative * (2.0 * (1.0 - relative)).exp()
}

#[test]
fn a_sensor_that_triggers_higher_leaves_less_to_its_height() {
    assert!((triggered("trigger_height", 0.7, "on") + 0.7).abs() < 1e-9);
    // A lighter surface is seen from further away: by where the light has fallen by as much.
    let lighter = 1e-4;
    let slope = (light(8.0 + 1e-5) - light(8.0 - 1e-5)) / 2e-5 / light(8.0);
    let higher = -lighter / slope;
    assert!(higher > 0.0);
    let found = triggered("reflectance(table)", lighter, "on");
    assert!((found + higher).abs() < 1e-3 * higher, "{found} {higher}");
}

#[test]
fn more_hysteresis_lets_go_higher_and_does_not_change_where_it_comes_on() {
    assert!(triggered("trigger_hysteresis", 0.01, "on").abs() < 1e-12);
    let lets_go = |hysteresis: f64| {
        let level = (1.0 - hysteresis) * light(8.0);
        let mut height = 8.0;
        while light(height) > level {
            height += 1e-5;
        }
        height
    };
    let higher = (lets_go(0.11) - lets_go(0.09)) / 0.02 * 1e-3;
    let found = triggered("trigger_hysteresis", 1e-3, "off");
    assert!((found + higher).abs() < 1e-2 * higher, "{found} {higher}");
}

/// A camera of a light stripe that looks along the flange's z onto a sheet 100 mm ahead.
fn rig() -> StripeRig {
    StripeRig {
        focal_px: [500.0; 2],
        principal_px: [100.0; 2],
        distortion: [0.0; 5],
        flange_from_camera: nalgebra::Isometry3::identity(),
        normal: Vector3::z(),
        d_mm: -100.0,
        bow: 0.0,
    }
}

/// How far a stripe lies off a wall across the planar arm's x, more than without an effect of the rig: its mean, mm. The hand is stretched out and moves.
fn seen_off(effect: &str, values: &[f64]) -> f64 {
    let wall = "surfaces: {wall: {plane: {normal: [1, 0, 0], offset_mm: 700}}}\n";
    let mut model = Model::parse("arm.yaml", &format!("{PLANAR}{wall}")).unwrap();
    model.stripe_rig = Some(rig());
    let mut table = Table::parse("table.csv", "q1_deg,q2_deg,p1_x_mm\n0,90,0\n").unwrap();
    table.stretches =
        vec![Stretch::new(0, 0, (0..9).map(|row| [150.0, 60.0 + 10.0 * f64::from(row)]).collect(), 1.0)];
    table.speed = Some(vec![0.2, 0.0]);
    let observations = Observations::new(&model, &table).unwrap();
    let at = |values: Vec<f64>| {
        let added = AddedEffect { id: parse(effect, &model).unwrap(), values };
        let problem = ResidualModel::new(&model, &table, &observations, &[added]).unwrap();
        let first =
            observations.of_row(0).iter().position(|one| one.measurand.kind.name() == "stripe").unwrap();
        -problem.residuals(&problem.start())[first]
    };
    at(values.to_vec()) - at(vec![0.0; values.len()])
}

#[test]
fn errors_of_a_light_stripes_rig_move_what_it_shows_as_its_geometry_says() {
    // With the elbow up the flange's x looks up, its y along -x of the wall's normal; a pixel 50 aside shows a point 10 mm aside.
    let across = seen_off("hand_eye", &[0.0, 1.0, 0.0]);
    assert!(
        (across.abs() - 1.0).abs() < 1e-9,
        "a rig that sits 1 mm beside along the wall's normal: {across}"
    );
    assert!(seen_off("hand_eye", &[0.0, 0.0, 1.0]).abs() < 1e-9, "along the wall nothing shows");
    // The mean row of the picture is 100: the principal one.
    assert!((seen_off("principal_point", &[0.0, 5.0]) + across * 1.0).abs() < 1e-9, "5 px are 1 mm");
    assert!((seen_off("camera_aim", &[0.01, 0.0]) + across * 100.0 * 0.01_f64.tan()).abs() < 0.02);
    // The sheet nearer shows the point nearer the middle; in the mean row that is nothing.
    assert!(seen_off("stripe_plane", &[0.0, 0.0, 3.0]).abs() < 1e-9);
    // 10 ms at 0.2 rad/s about the shoulder, which turns 400 mm of upper arm and what lies beyond: the height over the shoulder moves along the wall's normal.
    let height = 300.0 + 10.0;
    let late = seen_off("clock_skew", &[0.010]);
    assert!((late.abs() - 0.002 * height).abs() < 0.01, "{late}");
}

/// What is offered where a table has these columns.
fn offered(model: &str, table: &str) -> Vec<String> {
    let model = Model::parse("arm.yaml", model).unwrap();
    let table = Table::parse("table.csv", table).unwrap();
    let summary = DatasetSummary::of(&model, &table);
    let context = CandidateContext { model: &model, summary: &summary };
    let mut names: Vec<String> =
        kinds().iter().flat_map(|kind| (kind.candidates)(&context)).map(|id| id.name).collect();
    names.dedup();
    names
}

#[test]
fn only_what_a_table_could_show_is_a_candidate() {
    let poses = |columns: &str, cells: [&str; 2]| {
        let row = |q: &str, cells: &str| format!("{q},0,0,0{cells}\n");
        format!(
            "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm{columns}\n{}{}",
            row("10,20", cells[0]),
            row("30,-20", cells[1])
        )
    };
    let light = PLANAR.replace("links: [{after: elbow, mass_kg: 2, centre_mm: [0, 0, 0]}]\n", "");
    let plain = offered(&light, &poses("", ["", ""]));
    let has = |names: &[String], name: &str| names.iter().any(|known| known == name);
    for name in
        ["joint_zero", "joint_gain", "joint_harmonic", "link_length", "axis_skew", "base_tilt", "scale"]
    {
        assert!(has(&plain, name), "{name} of {plain:?}");
    }
    let needs = [
        ("joint_backlash", poses(",approach_q1,approach_q2", [",1,1", ",-1,1"])),
        ("thermal_growth", poses(",temperature_c", [",20", ",25"])),
        ("drift", poses(",time_s", [",0", ",600"])),
        ("warm_up", poses(",time_s", [",0", ",600"])),
        ("joint_compliance", poses(",payload_kg", [",0", ",3"])),
        ("link_sag", poses(",payload_kg", [",0", ",3"])),
        ("link_torsion", poses(",payload_kg", [",0", ",3"])),
    ];
    for (name, table) in needs {
        assert!(!has(&plain, name), "{name} of {plain:?}");
        let names = offered(&light, &table);
        assert!(has(&names, name), "{name} of {names:?}");
    }
    let constant = offered(&light, &poses(",temperature_c", [",20", ",20"]));
    assert!(!has(&constant, "thermal_growth"), "a temperature that never changes shows nothing");
    assert!(has(&offered(PLANAR, &poses("", ["", ""])), "joint_compliance"), "its own weight bends it");
    let slides = offered(SLIDES, "q1_deg,q2_mm,q3_mm,p1_x_mm,p1_y_mm,p1_z_mm\n0,1,2,0,0,0\n9,8,7,0,0,0\n");
    assert!(
        has(&slides, "joint_gain") && !has(&slides, "joint_coupling"),
        "a coupling is of joints that turn"
    );
}

#[test]
fn sizes_are_shown_in_their_own_units_with_their_errors() {
    let model = Model::parse("arm.yaml", PLANAR).unwrap();
    let size = |text: &str, inner: Option<f64>, values: &[f64], variances: &[f64]| {
        let id = EffectId { inner, ..parse(text, &model).unwrap() };
        let covariance = DMatrix::from_diagonal(&variances.to_vec().into());
        build(&id, &model).unwrap().size(values, &covariance)
    };
    let zero = size("joint_zero(elbow)", None, &[0.01], &[1e-6]);
    assert!((zero.value - 0.572_957_795).abs() < 1e-9 && (zero.error - 0.057_295_779_5).abs() < 1e-9);
    assert_eq!(zero.unit, "deg");
    // A wave's size is its amplitude; its error that along the amplitude.
    let wave = size("joint_harmonic(elbow, 2)", None, &[0.003, 0.004], &[1e-8, 4e-8]);
    let error = (0.36_f64 * 1e-8 + 0.64 * 4e-8).sqrt();
    assert!((wave.value - 0.005_f64.to_degrees()).abs() < 1e-9, "{wave:?}");
    assert!((wave.error - error.to_degrees()).abs() < 1e-9, "{wave:?}");
    let shift = size("base_position", None, &[3.0, 0.0, -4.0], &[0.01; 3]);
    assert!((shift.value - 5.0).abs() < 1e-9 && (shift.error - 0.1).abs() < 1e-9 && shift.unit == "mm");
    // What the rows cannot determine is not known to be zero: an unseen part may be as large as those that are seen.
    assert_eq!(size("joint_zero(elbow)", None, &[0.0], &[0.0]).error, f64::INFINITY);
    assert_eq!(size("base_position", None, &[0.0; 3], &[0.0; 3]).error, f64::INFINITY);
    let partly = size("base_position", None, &[3.0, 0.0, -4.0], &[0.01, 0.0, 0.01]);
    assert!((partly.error - 5.0_f64.hypot(0.1)).abs() < 1e-9, "{partly:?}");
    let drift = size("drift", None, &[0.0, 0.3, 0.0], &[1e-4; 3]);
    assert!((drift.value - 0.3).abs() < 1e-9 && drift.unit == "mm/h");
    let soft = size("joint_compliance(elbow)", None, &[2e-5], &[1e-12]);
    assert_eq!((soft.value, soft.unit), (2e-5, "rad/(N m)"));
}

#[test]
fn sizes_no_real_machine_has_are_distinguished_from_those_it_may_have() {
    let model = Model::parse("arm.yaml", PLANAR).unwrap();
    let plausible =
        |text: &str, values: &[f64]| build(&parse(text, &model).unwrap(), &model).unwrap().plausible(values);
    assert!(plausible("joint_compliance(elbow)", &[1e-5]));
    assert!(!plausible("joint_compliance(elbow)", &[-1e-5]), "a spring that pushes back");
    assert!(!plausible("link_sag(elbow)", &[-1e-6]));
    assert!(!plausible("link_torsion(elbow)", &[-1e-6]) && plausible("link_torsion(elbow)", &[1e-4]));
    assert!(plausible("joint_backlash(elbow)", &[-0.01]), "what is +1 is the table's business");
    assert!(plausible("joint_gain(elbow)", &[0.04]) && !plausible("joint_gain(elbow)", &[0.06]));
    assert!(!plausible("thermal_growth(elbow)", &[6e-4]) && plausible("thermal_growth(elbow)", &[1.2e-5]));
}

#[test]
fn a_size_known_no_better_than_before_anything_was_measured_is_not_determined() {
    let parameters = [
        Parameter::new("shift", Unit::MM, (-100.0, 100.0)),
        Parameter::new("turn", Unit::DEG, (-0.01, 0.03)),
    ];
    let with = |unit: Unit, error: f64| {
        Size { value: 2.5, unit: unit.name, error }.unless_undetermined(&parameters).error
    };
    // 200 over the root of 12 are 57.7; 0.04 rad are 2.292 degrees, of which that is 0.662.
    assert_eq!([with(Unit::MM, 57.7), with(Unit::MM, 57.8)], [57.7, f64::INFINITY]);
    assert_eq!([with(Unit::DEG, 0.661), with(Unit::DEG, 0.662)], [0.661, f64::INFINITY]);
    assert_eq!(with(Unit::RATIO, 1e9), 1e9, "of another unit nothing is known");
}
