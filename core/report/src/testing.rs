//! A small made-up arm for unit tests: plain trigonometry, no code of the lab.

use plumb_calibration::arm_model::Model;
use plumb_calibration::table::Table;
use plumb_diagnosis::laboratory::{Laboratory, Options};
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Random;

/// A planar arm of two links, 200 and 150 mm, its base and its point known.
const TWO_LINKS: &str = "
arm: two-links
convention: distal
joints:
  - {name: shoulder, a_mm: 200, limits_deg: [-170, 170]}
  - {name: elbow, a_mm: 150, limits_deg: [-150, 150]}
base: {xyz_mm: [0, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
measured_from: world
";

/// The arm measured at `poses` poses with noise of `sigma` mm, while each joint's coordinate is off by `off` of the pose (rad). `lines` are added to the
/// model file; nothing is held out.
pub(crate) fn two_links(
    poses: usize,
    lines: &str,
    sigma: f64,
    seed: u64,
    off: impl Fn([f64; 2]) -> [f64; 2],
) -> Laboratory {
    let mut random = Random::seeded(seed);
    let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for _ in 0..poses {
        let q = [300.0 * random.uniform() - 150.0, 200.0 * random.uniform() - 100.0];
        let wrong = off(q.map(f64::to_radians));
        let first = q[0].to_radians() + wrong[0];
        let second = first + q[1].to_radians() + wrong[1];
        let x = 200.0 * first.cos() + 150.0 * second.cos() + sigma * random.normal();
        let y = 200.0 * first.sin() + 150.0 * second.sin() + sigma * random.normal();
        text.push_str(&format!("{:.17},{:.17},{x:.9},{y:.9},{:.9}\n", q[0], q[1], sigma * random.normal()));
    }
    let model = Model::parse("model.yaml", &format!("{TWO_LINKS}{lines}\n")).unwrap();
    let table = Table::parse("table.csv", &text).unwrap();
    Laboratory::new(model, table, Options { holdout: Holdout::None, ..Options::default() }).unwrap()
}
