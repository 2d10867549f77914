//! Several targets of which the noise of one is declared: the others count as much as they are worth.

use plumb_calibration::measurement::NoiseSource;
use plumb_diagnosis::Verdict;
use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, laboratory};

/// Where the column arm with a turning hand has a point of the hand, mm; `q` in degrees.
fn point(q: [f64; 4], [x, y, z]: [f64; 3]) -> [f64; 3] {
    let [waist, shoulder, elbow, hand] = q.map(f64::to_radians);
    // The hand turns about the axis of its row, which is that of the elbow.
    let bent = shoulder + elbow + hand;
    let radius = 200.0 * shoulder.cos() + 150.0 * (shoulder + elbow).cos() + x * bent.cos() - y * bent.sin();
    let height =
        300.0 + 200.0 * shoulder.sin() + 150.0 * (shoulder + elbow).sin() + x * bent.sin() + y * bent.cos();
    [radius * waist.cos() + z * waist.sin(), radius * waist.sin() - z * waist.cos(), height]
}

/// Three targets: the first on the hand's axis, where the hand's wrong ratio does not move it.
const TARGETS: [[f64; 3]; 3] = [[0.0, 0.0, 20.0], [60.0, 0.0, 0.0], [0.0, 60.0, 10.0]];

fn table(excess: f64, seed: u64) -> String {
    let mut rng = Xorshift::seeded(seed);
    let mut text = "q1_deg,q2_deg,q3_deg,q4_deg".to_owned();
    for target in 1..=3 {
        text.push_str(&format!(",p{target}_x_mm,p{target}_y_mm,p{target}_z_mm"));
    }
    text.push('\n');
    for [waist, shoulder, elbow] in column_poses(90, seed) {
        let hand = rng.between(-80.0, 80.0);
        text.push_str(&format!("{waist},{shoulder},{elbow},{hand}"));
        for target in TARGETS {
            for part in point([waist, shoulder, elbow, hand * (1.0 + excess)], target) {
                text.push_str(&format!(",{}", part + rng.noise(0.02)));
            }
        }
        text.push('\n');
    }
    text
}

fn model(noise: &str) -> String {
    let targets = "targets: {p1: {xyz_mm: [0, 0, 20]}, p2: {xyz_mm: [60, 0, 0]}, p3: {xyz_mm: [0, 60, 10]}}";
    let arm = COLUMN_ARM.trim_end();
    format!("{arm}\n  - {{name: hand}}\n{targets}\nfree: [joint_zero(*)]\nnoise: {noise}\n")
}

#[test]
fn what_only_undeclared_targets_show_is_named() {
    let options = Options { holdout: Holdout::None, ..Options::default() };
    let lab = laboratory(&model("{p1_mm: 0.02}"), &table(2e-3, 71), options);
    for one in lab.noise() {
        let declared = if one.reading == "p1_mm" { NoiseSource::Declared } else { NoiseSource::Estimated };
        assert_eq!(one.source, declared, "{one:?}");
        assert!(one.sigma < 0.1, "{one:?}");
    }
    let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
    assert_eq!(diagnosis.verdict, Verdict::Named, "{}", diagnosis_sentence(&diagnosis));
    let named = diagnosis.named.unwrap();
    assert_eq!((named.effect.effect.as_str(), named.effect.site.as_str()), ("joint_gain", "hand"));
    assert!((named.size - 2e-3).abs() < 4.0 * named.se.max(1e-5), "{} +- {}", named.size, named.se);
}

#[test]
fn compare_says_which_noise_was_declared() {
    let lab = laboratory(&model("{p1_mm: 0.02}"), &table(0.0, 72), Options::default());
    let noise = lab.compare(&Progress::unwatched()).unwrap().noise;
    let sources: Vec<(&str, NoiseSource)> =
        noise.iter().map(|one| (one.reading.as_str(), one.source)).collect();
    let estimated = NoiseSource::Estimated;
    assert_eq!(sources, [("p1_mm", NoiseSource::Declared), ("p2_mm", estimated), ("p3_mm", estimated)]);
    assert!(noise.iter().all(|one| (one.sigma / 0.02 - 1.0).abs() < 0.2), "{noise:?}");
}
