//! Machines of which nothing is free: what is wrong must be named, not be called an error of something known.

use plumb_diagnosis::Verdict;
use plumb_diagnosis::laboratory::Options;
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;

use super::made_up::{TWO_LINKS, Xorshift, laboratory, two_links_tip};

/// Positions of the two links with the shoulder's zero off by so much.
fn table(error_deg: f64, seed: u64) -> String {
    let mut rng = Xorshift::seeded(seed);
    let mut table = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for _ in 0..40 {
        let (shoulder, elbow) = (rng.between(-120.0, 120.0), rng.between(-120.0, 120.0));
        let (x, y) = two_links_tip(shoulder + error_deg, elbow);
        let (x, y, z) = (x + rng.noise(0.05), y + rng.noise(0.05), rng.noise(0.05));
        table.push_str(&format!("{shoulder:.4},{elbow:.4},{x:.4},{y:.4},{z:.4}\n"));
    }
    table
}

#[test]
fn a_gross_zero_of_a_machine_with_nothing_free_is_named() {
    let declared = format!("{TWO_LINKS}noise: {{p1_mm: 0.05}}\n");
    for (seed, error) in [(1, 1.0), (2, -1.4), (3, 2.0), (4, 1.0), (5, -2.0)] {
        for model in [TWO_LINKS, declared.as_str()] {
            let laboratory = laboratory(model, &table(error, seed), Options::default());
            let diagnosis = laboratory.diagnose(&Progress::unwatched()).unwrap();
            assert_eq!(diagnosis.verdict, Verdict::Named, "{error} deg: {}", diagnosis_sentence(&diagnosis));
            let named = diagnosis.named.unwrap();
            let which = (named.effect.effect.as_str(), named.effect.site.as_str());
            assert_eq!(which, ("joint_zero", "shoulder"), "{error} deg");
            assert!((named.size - error).abs() < 4.0 * named.se + 1e-3, "{} for {error}", named.size);
        }
    }
}
