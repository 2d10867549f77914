//! Returns to one pose that be in two places: whatever moves between them, no model can be right.

use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_diagnosis::{Diagnosis, Verdict};
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, column_tip, laboratory};

/// The column arm: 40 poses, and six to which it returned five times; `moved` shifts a row's point. It is reported whether the row is a
/// return, the pose, and a number between 0 and 1.
fn diagnosed(seed: u64, moved: impl Fn(bool, [f64; 3], f64) -> [f64; 3]) -> Diagnosis {
    let mut rng = Xorshift::seeded(seed);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm,repeat\n".to_owned();
    let poses = column_poses(46, seed);
    let (single, returned) = poses.split_at(40);
    let returns = (0..30).filter_map(|index| Some((*returned.get(index % 6)?, format!("r{}", index % 6))));
    let rows: Vec<([f64; 3], String)> =
        single.iter().map(|pose| (*pose, String::new())).chain(returns).collect();
    for (pose, group) in rows {
        let (point, shift) = (column_tip(pose), moved(!group.is_empty(), pose, rng.unit()));
        let cells: Vec<String> = pose.iter().map(|angle| format!("{angle:.4}")).collect();
        let read: Vec<String> = point
            .iter()
            .zip(shift)
            .map(|(part, shift)| format!("{:.4}", part + shift + rng.noise(0.05)))
            .collect();
        text.push_str(&format!("{},{},{group}\n", cells.join(","), read.join(",")));
    }
    let model = format!(
        "{COLUMN_ARM}targets: {{p1: {{xyz_mm: [0, 0, 0], free: true}}}}\nfree: [joint_zero(*)]\nmeasured_from: world\n"
    );
    let options = Options { holdout: Holdout::None, ..Options::default() };
    laboratory(&model, &text, options).diagnose(&Progress::unwatched()).unwrap()
}

#[test]
fn a_base_that_is_in_two_places_is_the_hardwares_fault() {
    for seed in 1..=3 {
        let found = diagnosed(seed, |returned, _, chance| {
            [if returned && chance < 0.5 { 0.5 } else { 0.0 }, 0.0, 0.0]
        });
        assert_eq!(found.verdict, Verdict::NotRepeatable, "{}", diagnosis_sentence(&found));
        assert_eq!(found.remaining.places, ["base"], "{}", diagnosis_sentence(&found));
        let sentence = diagnosis_sentence(&found);
        assert!(sentence.contains("two groups about 0.") && sentence.contains(" mm apart"), "{sentence}");
    }
}

#[test]
fn a_tool_that_is_in_two_places_in_its_holder_is_the_hardwares_fault() {
    for seed in 1..=3 {
        let found = diagnosed(seed, |returned, [waist, shoulder, elbow], chance| {
            // Along the hand's x, which points where the last link does.
            let (waist, lift) = (waist.to_radians(), (shoulder + elbow).to_radians());
            let by = if returned && chance < 0.5 { 0.5 } else { 0.0 };
            [by * lift.cos() * waist.cos(), by * lift.cos() * waist.sin(), by * lift.sin()]
        });
        assert_eq!(found.verdict, Verdict::NotRepeatable, "{}", diagnosis_sentence(&found));
        assert_eq!(found.remaining.places, ["p1"], "{}", diagnosis_sentence(&found));
    }
}

/// How far the tip moves when shoulder and elbow are off by so many degrees.
fn turned([waist, shoulder, elbow]: [f64; 3], [by_shoulder, by_elbow]: [f64; 2]) -> [f64; 3] {
    let (there, here) =
        (column_tip([waist, shoulder + by_shoulder, elbow + by_elbow]), column_tip([waist, shoulder, elbow]));
    std::array::from_fn(|axis| there[axis] - here[axis])
}

#[test]
fn two_joints_that_stand_in_two_places_each_are_both_found() {
    for seed in 1..=3 {
        let found = diagnosed(seed, |_, pose, chance| {
            // Two coins out of one number.
            let (first, second) = (chance < 0.5, (2.0 * chance).fract() < 0.5);
            let off = |up: bool, by: f64| if up { by } else { 0.0 };
            turned(pose, [off(first, 0.15), off(second, 0.25)])
        });
        assert_eq!(found.verdict, Verdict::NotRepeatable, "seed {seed}: {}", diagnosis_sentence(&found));
        let mut sites = found.remaining.places.clone();
        sites.sort();
        assert_eq!(sites, ["elbow", "shoulder"], "seed {seed}: {}", diagnosis_sentence(&found));
        assert!(diagnosis_sentence(&found).contains(" deg apart at elbow"), "{}", diagnosis_sentence(&found));
    }
}

#[test]
fn the_camp_of_the_fewer_is_no_outlier_however_long_the_lever() {
    for seed in 1..=4 {
        let found =
            diagnosed(seed, |_, pose, chance| turned(pose, [if chance < 0.3 { 0.4 } else { 0.0 }, 0.0]));
        assert_eq!(found.verdict, Verdict::NotRepeatable, "seed {seed}: {}", diagnosis_sentence(&found));
        assert_eq!(found.remaining.places, ["shoulder"], "seed {seed}: {}", diagnosis_sentence(&found));
    }
}

#[test]
fn returns_that_scatter_alike_or_of_which_a_few_are_outliers_are_no_fault() {
    for seed in 1..=3 {
        let quiet = diagnosed(seed, |_, _, _| [0.0; 3]);
        assert_ne!(quiet.verdict, Verdict::NotRepeatable, "{}", diagnosis_sentence(&quiet));
        let noisy =
            diagnosed(
                seed,
                |_, _, chance| {
                    if chance < 0.08 { [12.0 * chance, 1.0 - 20.0 * chance, 0.7] } else { [0.0; 3] }
                },
            );
        assert_ne!(noisy.verdict, Verdict::NotRepeatable, "{}", diagnosis_sentence(&noisy));
    }
}

/// A joint that jumps half-way through 120 poses, one reading in twelve an outlier, all of these along that joint's motion; what is said.
fn jumped(seed: u64) -> Diagnosis {
    let mut rng = Xorshift::seeded(seed);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for (row, pose) in column_poses(120, seed).into_iter().enumerate() {
        let step = if row >= 60 { 0.06 } else { 0.0 };
        let point = column_tip([pose[0], pose[1], pose[2] + step]);
        let slip = if rng.unit() < 1.0 / 12.0 { rng.between(-1.5, 1.5) } else { 0.0 };
        let further = column_tip([pose[0], pose[1], pose[2] + step + 0.5]);
        // Half a degree of the elbow moves the tip by 1.3 mm.
        let along: Vec<f64> = further.iter().zip(point).map(|(there, here)| (there - here) / 1.3).collect();
        let cells: Vec<String> = pose.iter().map(|angle| format!("{angle:.4}")).collect();
        let read: Vec<String> = point
            .iter()
            .zip(along)
            .map(|(part, along)| format!("{:.4}", part + slip * along + rng.noise(0.05)))
            .collect();
        text.push_str(&format!("{},{}\n", cells.join(","), read.join(",")));
    }
    let model = format!(
        "{COLUMN_ARM}targets: {{p1: {{xyz_mm: [0, 0, 0], free: true}}}}\nfree: [joint_zero(*)]\nmeasured_from: world\nnoise: {{p1_mm: 0.05}}\n"
    );
    let options = Options { holdout: Holdout::None, ..Options::default() };
    laboratory(&model, &text, options).diagnose(&Progress::unwatched()).unwrap()
}

#[test]
fn an_outlier_that_happens_to_lie_along_a_joints_motion_speaks_against_no_name() {
    for seed in 1..=4 {
        let found = jumped(seed);
        let named =
            found.named.as_ref().map(|named| (named.effect.effect.as_str(), named.effect.site.as_str()));
        assert_eq!(named, Some(("joint_step", "elbow")), "seed {seed}: {}", diagnosis_sentence(&found));
    }
}
