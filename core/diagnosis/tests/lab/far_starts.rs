//! Fits that start far from where they must end: base and target metres away, an arm that its maker built a little
//! otherwise than drawn.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use plumb_calibration::fit::FitOptions;
use plumb_diagnosis::laboratory::Options;
use plumb_estimation::Progress;

use super::made_up::{Xorshift, laboratory};

/// Rows of distal Denavit-Hartenberg numbers: a (mm), alpha (deg), d (mm).
type Rows = &'static [[f64; 3]];

/// An arm with three parallel axes, whose offsets along them look alike until the axes lean.
const PARALLEL: Rows = &[
    [0.0, 90.0, 141.0],
    [-520.0, 0.0, 0.0],
    [-437.0, 0.0, 0.0],
    [0.0, 90.0, 126.0],
    [0.0, -90.0, 97.0],
    [0.0, 0.0, 88.0],
];

/// An arm with a shoulder offset and a wrist whose axes meet.
const WRISTED: Rows = &[
    [75.0, -90.0, 330.0],
    [610.0, 0.0, 0.0],
    [40.0, -90.0, 0.0],
    [0.0, 90.0, 640.0],
    [0.0, -90.0, 0.0],
    [0.0, 0.0, 80.0],
];

/// Seven joints.
const SEVEN: Rows = &[
    [0.0, -90.0, 310.0],
    [0.0, 90.0, 0.0],
    [30.0, 90.0, 385.0],
    [-30.0, -90.0, 0.0],
    [0.0, 90.0, 395.0],
    [60.0, -90.0, 0.0],
    [0.0, 0.0, 120.0],
];

/// How far the made arm is from the drawn one, largest errors: zeros (deg), lengths (mm), angles of axes (deg).
struct Tolerance {
    zero: f64,
    length: f64,
    axis: f64,
}

fn turn(axis: Vector3<f64>, deg: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::identity(), UnitQuaternion::new(axis * deg.to_radians()))
}

/// Model and table of an arm made with errors, its base and target metres and half turns from where the model has them.
fn case(rows: Rows, tolerance: &Tolerance, noise: f64, seed: u64) -> (String, String) {
    let mut rng = Xorshift::seeded(seed);
    let mut model = "arm: made-up\nconvention: distal\njoints:\n".to_owned();
    for (index, [a, alpha, d]) in rows.iter().enumerate() {
        model.push_str(&format!("  - {{name: j{}, a_mm: {a}, alpha_deg: {alpha}, d_mm: {d}}}\n", index + 1));
    }
    model.push_str("targets: {p1: {xyz_mm: [0, 0, 20], free: true}}\nfree: [joint_zero(*), geometry(*)]\n");
    let mut off = |most: f64| rng.between(-most, most);
    let made: Vec<[f64; 5]> = rows
        .iter()
        .map(|[a, alpha, d]| {
            [
                a + off(tolerance.length),
                alpha + off(tolerance.axis),
                d + off(tolerance.length),
                off(tolerance.zero),
                off(tolerance.axis),
            ]
        })
        .collect();
    let base = Isometry3::new(
        Vector3::new(off(4000.0), off(4000.0), off(2000.0)),
        Vector3::new(off(2.0), off(2.0), off(2.0)),
    );
    let target = Point3::new(off(800.0), off(800.0), off(800.0));
    let names: Vec<String> = (1..=rows.len()).map(|joint| format!("q{joint}_deg")).collect();
    let mut table = format!("{},p1_x_mm,p1_y_mm,p1_z_mm\n", names.join(","));
    for _ in 0..90 {
        let mut flange = base;
        for [a, alpha, d, zero, skew] in &made {
            let q = rng.between(-150.0, 150.0);
            table.push_str(&format!("{q:.5},"));
            let q: f64 = format!("{q:.5}").parse().unwrap();
            flange = flange
                * turn(Vector3::y(), *skew)
                * turn(Vector3::z(), q + zero)
                * Translation3::new(*a, 0.0, *d)
                * turn(Vector3::x(), *alpha);
        }
        let point = flange * target;
        let read: Vec<String> = point.iter().map(|part| format!("{:.6}", part + rng.noise(noise))).collect();
        table.push_str(&format!("{}\n", read.join(",")));
    }
    (model, table)
}

/// RMS of the 3-D residual over the fitted rows, mm.
fn reached(model: &str, table: &str, robust: bool) -> f64 {
    let fit = FitOptions { robust, ..FitOptions::default() };
    let laboratory = laboratory(model, table, Options { fit, ..Options::default() });
    laboratory.compare(&Progress::unwatched()).unwrap().rms_mm.fit
}

#[test]
fn arms_are_found_wherever_base_and_target_are() {
    let tolerance = Tolerance { zero: 3.0, length: 5.0, axis: 0.5 };
    for (name, rows) in [("parallel axes", PARALLEL), ("wrist", WRISTED), ("seven joints", SEVEN)] {
        for seed in 1..=8 {
            let (model, table) = case(rows, &tolerance, 0.03, seed);
            for robust in [true, false] {
                let rms = reached(&model, &table, robust);
                assert!(rms < 0.03 * 3.0_f64.sqrt() * 1.15, "{name}, seed {seed}, robust {robust}: {rms} mm");
            }
        }
    }
}

#[test]
fn a_perfect_arm_with_parallel_axes_keeps_the_offsets_nobody_can_see() {
    let tolerance = Tolerance { zero: 0.0, length: 0.0, axis: 0.0 };
    let (model, table) = case(PARALLEL, &tolerance, 0.02, 3);
    let laboratory = laboratory(&model, &table, Options::default());
    let comparison = laboratory.compare(&Progress::unwatched()).unwrap();
    assert!(comparison.rms_mm.fit < 0.04, "{} mm", comparison.rms_mm.fit);
    let gauges: Vec<&str> = comparison.gauges.iter().map(|gauge| gauge.held.as_str()).collect();
    assert!(gauges.iter().filter(|held| held.starts_with("link_offset")).count() >= 2, "{gauges:?}");
    for effect in comparison.effects.iter().filter(|effect| effect.label.starts_with("link_offset")) {
        assert!(effect.size.abs() < 1.0, "{}: {} mm", effect.label, effect.size);
    }
}
