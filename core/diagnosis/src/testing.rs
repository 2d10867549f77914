//! A small made-up arm for unit tests: plain trigonometry, no code of the crate. And a fitted candidate made by hand.

use nalgebra::DMatrix;

use crate::forward_selection::FittedCandidate;
use crate::laboratory::{Laboratory, Options};
use crate::outcome::{Candidate, EffectSite};
use crate::predictive_gain::Gain;
use crate::score_test::Score;
use crate::split::Holdout;
use plumb_calibration::arm_model::Model;
use plumb_calibration::effect::{EffectId, Site, Size};
use plumb_calibration::table::Table;
use plumb_estimation::Random;

/// A planar arm of two links, 200 and 150 mm, its base and its point known.
pub(crate) const TWO_LINKS: &str = "
arm: two-links
convention: distal
joints:
  - {name: shoulder, a_mm: 200, limits_deg: [-170, 170]}
  - {name: elbow, a_mm: 150, limits_deg: [-150, 150]}
base: {xyz_mm: [0, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
measured_from: world
";

/// Three joints whose axes differ; what it carries, sees and touches follows.
pub(crate) const THREE_JOINTS: &str = "
arm: three
convention: distal
joints:
  - {name: j1, alpha_deg: 90, d_mm: 400}
  - {name: j2, a_mm: 350, alpha_deg: 90}
  - {name: j3, d_mm: 80}
";

/// The arm measured at `poses` poses with noise of `sigma` mm, while each joint's coordinate is off by `off` of the pose (rad). What
/// is `free` is fitted; nothing is held out.
pub(crate) fn two_links(
    poses: usize,
    free: &str,
    sigma: f64,
    seed: u64,
    off: impl Fn([f64; 2]) -> [f64; 2],
) -> Laboratory {
    two_links_with(&format!("free: [{free}]"), poses, sigma, seed, off)
}

/// The same with further lines of the model file.
pub(crate) fn two_links_with(
    lines: &str,
    poses: usize,
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

/// The arm measured by a draw wire from [500, 100, 50] mm, whose readings are off by `off` mm of the row.
pub(crate) fn by_wire(rows: usize, sigma: f64, seed: u64, off: impl Fn(usize) -> f64) -> Laboratory {
    let exact = two_links(rows, "", 0.0, seed, |_| [0.0; 2]);
    let mut random = Random::seeded(seed);
    let mut text = "q1_deg,q2_deg,distance_mm,distance_to\n".to_owned();
    for row in 0..rows {
        let q = exact.table().q_of(row);
        let point = nalgebra::Point3::from(exact.table().positions[0].xyz[row]);
        let length = nalgebra::distance(&point, &nalgebra::Point3::new(500.0, 100.0, 50.0));
        let read = length + off(row) + sigma * random.normal();
        text.push_str(&format!("{:.17},{:.17},{read:.9},anchor\n", q[0].to_degrees(), q[1].to_degrees()));
    }
    let lines = "surfaces: {anchor: {point_mm: [500, 100, 50], free: false}}\nfree: [joint_zero(*)]\n";
    let model = Model::parse("model.yaml", &format!("{TWO_LINKS}{lines}")).unwrap();
    let table = Table::parse("table.csv", &text).unwrap();
    Laboratory::new(model, table, Options { holdout: Holdout::None, ..Options::default() }).unwrap()
}

/// The same laboratory with something else in its table.
pub(crate) fn with_table(lab: &Laboratory, change: impl FnOnce(&mut Table)) -> Laboratory {
    let mut table = lab.table().clone();
    change(&mut table);
    Laboratory::new(lab.model().clone(), table, lab.options().clone()).unwrap()
}

/// So many poses of two links, each visited so many times: readings that differ by some hundredths of a millimetre.
pub(crate) fn returned(poses: usize, visits: usize) -> Laboratory {
    let rows = poses * visits;
    with_table(&two_links(rows, "joint_zero(*)", 0.05, 9, |_| [0.0; 2]), |table| {
        for row in 0..rows {
            let first = row - row % visits;
            let pose = table.q[2 * first..2 * first + 2].to_vec();
            table.q[2 * row..2 * row + 2].copy_from_slice(&pose);
            let xyz = &mut table.positions[0].xyz;
            xyz[row] = xyz[first].map(|part| part + 0.03 * (row % visits) as f64);
        }
        table.repeat.names = (0..poses).map(|pose| format!("r{pose}")).collect();
        table.repeat.of_row = (0..rows).map(|row| u32::try_from(row / visits).ok()).collect();
    })
}

/// Sides from which the joints of so many rows arrived: the first joint's in turn, the second's always from below.
pub(crate) fn sides_in_turn(rows: usize) -> Vec<i8> {
    (0..rows).flat_map(|row| [if row.is_multiple_of(2) { 1 } else { -1 }, 1]).collect()
}

/// An effect at a place, and nothing more.
pub(crate) fn effect_at(effect: &str, site: &str) -> EffectSite {
    EffectSite { effect: effect.to_owned(), site: site.to_owned(), with: None, n: None, of: None, at: None }
}

/// A candidate that is plausible and not rejected.
pub(crate) fn candidate(effect: &str, at: &str) -> Candidate {
    Candidate {
        effect: effect_at(effect, at),
        label: format!("{effect}({at})"),
        holm_p: 1e-6,
        delta_bic: 0.0,
        probability: None,
        cv_gain: None,
        leaves_mm: None,
        size: 1.0,
        unit: "deg".to_owned(),
        se: 0.1,
        plausible: true,
        absorbed: 0.0,
        explains_mm: 1.0,
        smallest: 0.5,
        rejected: None,
    }
}

/// A gain of so many of its standard errors.
pub(crate) fn gain(errors: f64) -> Gain {
    Gain { total: errors, error: 1.0 }
}

/// A fitted candidate that passes everything: an effect of a joint that explains all but noise and predicts rows it has not seen.
pub(crate) fn fitted_candidate(name: &str, joint: usize, bic: f64) -> FittedCandidate {
    let one = DMatrix::from_element(1, 1, 1e-4);
    let score = Score {
        gain: 300.0,
        freedom: 1,
        left: (190.0, 190.0),
        p: 1e-12,
        values: vec![1.0],
        covariance: one.clone(),
        beside: Vec::new(),
        size: Size { value: 1.0, unit: "deg", error: 0.01 },
        has_unseen: false,
        plausible: true,
        absorbed: 0.0,
        strength: 1.0,
    };
    FittedCandidate {
        row_residuals: Vec::new(),
        id: EffectId::at(name, Site::Joint(joint)),
        score,
        holm_p: 1e-10,
        bic,
        search_cost: 0.0,
        values: vec![1.0],
        covariance: one,
        block_errors: Vec::new(),
        gains: vec![gain(5.0)],
        promise: None,
        refitted: true,
        outvoted: false,
        left: (190.0, 190.0),
    }
}
