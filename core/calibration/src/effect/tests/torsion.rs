//! The torsion of a link against the textbook's shaft, and against the compliance of a joint that it lies along.

use crate::arm_model::{AddedEffect, Model};
use crate::effect::{CandidateContext, DatasetSummary, build, kind, parse};
use crate::fit::ResidualModel;
use crate::measurement::Observations;
use crate::table::Table;

/// Standard gravity, m/s2.
const GRAVITY: f64 = 9.80665;

/// How far an effect moves the point that a row reads, mm.
fn moved(model: &str, rows: &str, row: usize, effect: &str, value: f64) -> [f64; 3] {
    let model = Model::parse("arm.yaml", model).unwrap();
    let table = Table::parse("table.csv", rows).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let residuals = |effects: &[AddedEffect]| {
        let problem = ResidualModel::new(&model, &table, &observations, effects).unwrap();
        problem.residuals(&problem.start())[observations.range(row)].to_vec()
    };
    let with = residuals(&[AddedEffect { id: parse(effect, &model).unwrap(), values: vec![value] }]);
    // Residuals are measured less predicted, in units of 1 mm where no noise is declared.
    let without = residuals(&[]);
    [0, 1, 2].map(|axis| without[axis] - with[axis])
}

fn assert_close(found: [f64; 3], expected: [f64; 3], within: f64, what: &str) {
    let close = found.iter().zip(expected).all(|(one, other)| (one - other).abs() < within);
    assert!(close, "{what}: {found:?} instead of {expected:?}");
}

/// The second link of the gallows, mm.
const SECOND: f64 = 300.0;

/// An arm whose first link lies along x when its joints are at zero, with the second, 300 mm long, square to it and level.
const GALLOWS: &str = "
arm: gallows
convention: distal
joints:
  - {name: lift, a_mm: 400, alpha_deg: 0}
  - {name: turn, theta_deg: 90, a_mm: 300}
links:
  - {after: lift, mass_kg: 3, centre_mm: [-100, 50, 0]}
  - {after: turn, mass_kg: 2, centre_mm: [0, 0, 0]}
gravity: [0, 0, -1]
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
measured_from: instrument
";

#[test]
fn a_link_twists_as_the_shaft_of_the_textbook() {
    // 2 kg hang 0.3 m beside the end of a level shaft of 0.4 m, and 3 kg of its own 50 mm beside its axis, 0.3 m from where it is clamped; by T L / GJ the tip,
    // 300 mm beside the axis, goes down on a circle. Nothing beyond turns back, so that the lever shrinks by the cosine of the angle alone.
    let flexibility = 2e-3;
    let angle_of = |angle: f64| {
        let lever = angle.cos();
        let torque = 2.0 * GRAVITY * 0.3 * lever;
        let own = 3.0 * GRAVITY * 0.05;
        flexibility * (torque * 0.4 + own * 0.3)
    };
    let angle = (0..20).fold(0.0, |angle, _| angle_of(angle));
    let expected = [0.0, SECOND * (angle.cos() - 1.0), -SECOND * angle.sin()];
    let at = |q: &str| format!("q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n{q},0,0,0\n");
    let found = moved(GALLOWS, &at("0,0"), 0, "link_torsion(lift)", flexibility);
    assert_close(found, expected, 0.02 * expected[2].abs(), "to one side");
    // On the other side it turns the other way: what hangs there goes down as well, the link's own weight apart.
    let other = moved(GALLOWS, &at("0,180"), 0, "link_torsion(lift)", flexibility);
    assert!(other[2] < 0.0 && found[2] < other[2], "{found:?} {other:?}");
    // In line with the shaft nothing of the second link twists it, and the tip lies on its axis.
    let straight = moved(GALLOWS, &at("0,-90"), 0, "link_torsion(lift)", flexibility);
    assert_close(straight, [0.0; 3], 1e-6, "in line");
}

/// An arm in a vertical plane whose forearm, 350 mm, lies along the axis of its roll joint.
const FOREARM: &str = "
arm: forearm
convention: distal
joints:
  - {name: shoulder, a_mm: 400}
  - {name: elbow, alpha_deg: 90}
  - {name: roll, d_mm: 350, alpha_deg: -90}
  - {name: bend, a_mm: 80}
links: [{after: bend, mass_kg: 2, centre_mm: [0, 0, 0]}]
base: {xyz_mm: [0, 0, 0], rpy_deg: [90, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
measured_from: world
";

#[test]
fn the_twist_of_a_link_along_a_joints_axis_goes_by_the_name_of_the_joints_compliance() {
    let rows =
        "q1_deg,q2_deg,q3_deg,q4_deg,p1_x_mm,p1_y_mm,p1_z_mm\n10,20,40,60,0,0,0\n40,-30,-50,20,0,0,0\n";
    let value = 1e-4;
    for row in 0..2 {
        let torsion = moved(FOREARM, rows, row, "link_torsion(roll)", value);
        let compliance = moved(FOREARM, rows, row, "joint_compliance(roll)", value * 0.35);
        assert!(torsion.iter().any(|moved| moved.abs() > 1e-4), "{torsion:?}");
        assert_close(torsion, compliance, 1e-6, "springs in series");
    }
    let model = Model::parse("arm.yaml", FOREARM).unwrap();
    let twin = |effect: &str| build(&parse(effect, &model).unwrap(), &model).unwrap().twin(&model.chain);
    let message = twin("joint_compliance(roll)").unwrap();
    assert!(message.starts_with("link_torsion(roll) would be the same"), "{message}");
    assert_eq!(twin("joint_compliance(shoulder)"), None);
    let summary = DatasetSummary::of(&model, &Table::parse("table.csv", rows).unwrap());
    let candidates =
        (kind("link_torsion").unwrap().candidates)(&CandidateContext { model: &model, summary: &summary });
    let labels: Vec<String> = candidates.iter().map(|id| model.label(id)).collect();
    assert!(labels.contains(&"link_torsion(shoulder)".to_owned()), "{labels:?}");
    assert!(!labels.contains(&"link_torsion(roll)".to_owned()), "{labels:?}");
}

/// A wrist whose axes meet after a forearm of 300 mm, as most arms have.
const WRIST: &str = "
arm: wrist
convention: distal
joints:
  - {name: lift, a_mm: 400}
  - {name: roll, alpha_deg: -90, a_mm: 0.5}
  - {name: bend, alpha_deg: 90, d_mm: 300}
  - {name: flange, d_mm: 70}
links: [{after: flange, mass_kg: 2}]
measured_from: world
";

#[test]
fn only_links_with_a_length_of_their_own_bend_or_twist() {
    let model = Model::parse("arm.yaml", WRIST).unwrap();
    let summary = DatasetSummary::default();
    let context = CandidateContext { model: &model, summary: &summary };
    let labels = |name: &str| {
        let ids = (kind(name).unwrap().candidates)(&context);
        ids.iter().map(|id| model.label(id)).collect::<Vec<String>>()
    };
    // Half a millimetre between two axes is an error of the arm, whose stiffness would be anything.
    assert_eq!(labels("link_sag"), ["link_sag(lift)", "link_sag(bend)", "link_sag(flange)"]);
    assert_eq!(labels("link_torsion"), ["link_torsion(lift)"]);
}
