//! Simulated measurement campaigns: what they promise to those who diagnose them.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use plumb_simulated::physics::arms;
use plumb_simulated::physics::campaign::catalogue::{self, Choice};
use plumb_simulated::physics::campaign::poses::Chosen;
use plumb_simulated::physics::campaign::specification::{
    Approach, Free, Reading, Requested, Size, Specification, Spread,
};
use plumb_simulated::physics::campaign::{self, Case, Verdict, seal};

fn usual(arm: &str) -> Specification {
    Specification::usual(arms::by_name(arm).unwrap().unwrap())
}

fn hiding(arm: &str, effects: &[(&str, f64)]) -> Specification {
    let expected = |(name, ratio): &(&str, f64)| Requested {
        choice: Choice::named(name),
        size: Size::OverNoise(*ratio),
    };
    Specification { hidden: effects.iter().map(expected).collect(), heat: true, ..usual(arm) }
}

fn case(specification: &Specification, seed: u64) -> Case {
    campaign::generate(specification, seed).unwrap()
}

#[test]
fn a_seed_gives_the_same_case_again_and_another_seed_another() {
    let specification = hiding("puma560", &[("any", 3.0)]);
    let first = case(&specification, 42);
    assert_eq!(first, case(&specification, 42));
    assert_ne!(first.table_csv(), case(&specification, 43).table_csv());
}

#[test]
fn an_effect_moves_the_readings_by_as_many_times_the_noise_as_asked() {
    for arm in ["puma560", "teachmover", "panda"] {
        let known = catalogue::LIBRARY.iter().chain(&catalogue::OUTSIDE).chain([&catalogue::NOT_REPEATABLE]);
        let mut shown = 0;
        for name in known {
            // Some effects cannot show on some arms: offsets along parallel axes, skew between perpendicular ones, sagging of light links.
            let Ok(made) = campaign::generate(&hiding(arm, &[(name, 3.0)]), 7) else { continue };
            let ratio = made.truth.hidden[0].over_noise;
            assert!((ratio - 3.0).abs() < 0.02, "{name} on {arm}: {ratio} times the noise");
            shown += 1;
        }
        assert!(shown >= 17, "only {shown} of 20 effects can be hidden in {arm}");
    }
}

#[test]
fn hiding_something_changes_neither_poses_nor_noise() {
    let plain = case(&Specification { heat: true, ..usual("ur5") }, 9);
    let hidden = case(&hiding("ur5", &[("joint_backlash", 0.01)]), 9);
    assert_eq!(plain.visits, hidden.visits);
    let apart = |row: usize| {
        plain.readings[row].iter().zip(&hidden.readings[row]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    assert!(
        (0..plain.visits.len()).all(|row| apart(row) < 0.01),
        "a hundredth of the noise cannot change a reading by more"
    );
}

#[test]
fn the_table_has_the_columns_of_the_contract() {
    let made = case(&usual("scara4"), 1);
    let table = made.table_csv();
    let header = "q1_deg,q2_deg,q3_deg,q4_deg,approach_q1,approach_q2,approach_q3,approach_q4,\
                  payload_kg,temperature_c,time_s,repeat,p1_x_mm,p1_y_mm,p1_z_mm";
    assert_eq!(table.lines().next().unwrap(), header);
    assert_eq!(table.lines().count(), 1 + 60 + 6 * 5);
    assert!(table.lines().all(|line| line.split(',').count() == 15));
    let repeated = |name: &str| table.lines().filter(|line| line.split(',').nth(11) == Some(name)).count();
    assert_eq!([repeated("r1"), repeated("r6"), repeated("")], [5, 5, 60]);
}

#[test]
fn the_model_file_is_the_arm_on_paper_and_reveals_nothing() {
    let made = case(&hiding("panda", &[("link_length", 3.0)]), 3);
    let again = plumb_simulated::physics::description::ArmDescription::from_yaml(&made.model_yaml()).unwrap();
    let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
    let paper = &made.specification.arm;
    for (joint, on_paper) in again.joints.iter().zip(&paper.joints) {
        assert!(
            close(joint.length, on_paper.length)
                && close(joint.twist, on_paper.twist)
                && close(joint.offset, on_paper.offset)
        );
    }
    assert_eq!(again.weights, paper.weights);
    assert!(made.model_yaml().contains("free: [joint_zero(*)]\neffects: []\n"));
    assert_eq!(made.model_yaml(), case(&usual("panda"), 3).model_yaml());
}

#[test]
fn returns_to_a_pose_differ_in_circumstances_only() {
    let specification = Specification { payloads_kg: vec![0.0, 1.0], heat: true, ..usual("puma560") };
    let made = case(&specification, 4);
    let returns: Vec<_> = made.visits.iter().filter(|visit| visit.repeat == Some(1)).collect();
    assert_eq!(returns.len(), 5);
    assert!(returns.iter().all(|visit| visit.commanded == returns[0].commanded));
    assert!(returns.iter().any(|visit| visit.sides != returns[0].sides));
    assert!(returns.iter().any(|visit| visit.temperature_c != returns[0].temperature_c));
}

#[test]
fn straight_moves_log_the_side_they_come_from() {
    let made = case(&Specification { approach: Approach::Straight, ..usual("teachmover") }, 5);
    for pair in made.visits.windows(2) {
        for joint in 0..4 {
            let moved = pair[1].commanded_deg[joint] - pair[0].commanded_deg[joint];
            assert_eq!(pair[1].sides[joint], if moved == 0.0 { 0.0 } else { moved.signum() });
        }
    }
}

#[test]
fn narrow_poses_stay_in_a_window_and_grids_on_a_lattice() {
    let narrow = case(&Specification { spread: Spread::Narrow, ..usual("puma560") }, 6);
    let grid = case(&Specification { spread: Spread::Grid, poses: 64, ..usual("puma560") }, 6);
    let of = |made: &Case, joint: usize| -> Vec<f64> {
        made.visits
            .iter()
            .filter(|visit| visit.repeat.is_none())
            .map(|visit| visit.commanded_deg[joint])
            .collect()
    };
    for joint in 0..6 {
        let angles = of(&narrow, joint);
        let spread =
            angles.iter().cloned().fold(f64::MIN, f64::max) - angles.iter().cloned().fold(f64::MAX, f64::min);
        assert!(spread <= 40.0 && spread > 30.0, "joint {joint}: {spread} degrees");
    }
    let mut levels = of(&grid, 0);
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    assert_eq!(levels.len(), 4);
}

#[test]
fn one_reading_in_twelve_is_grossly_wrong_when_asked_and_the_truth_knows_which() {
    let plain = case(&usual("puma560"), 8);
    let spoilt = case(&Specification { outliers: 0.08, ..usual("puma560") }, 8);
    let rows = &spoilt.truth.outlier_rows;
    assert!((2..=15).contains(&rows.len()), "{} outliers", rows.len());
    for row in 0..plain.readings.len() {
        assert_eq!(plain.readings[row] != spoilt.readings[row], rows.contains(&(row + 1)), "row {row}");
    }
}

#[test]
fn heights_and_distances_are_one_reading_a_row() {
    for (reading, columns) in
        [(Reading::Height, "height_mm,on"), (Reading::Distance, "distance_mm,distance_to")]
    {
        let made = case(&Specification { reading, ..usual("puma560") }, 2);
        assert!(made.table_csv().lines().next().unwrap().ends_with(columns));
        assert!(made.readings.iter().all(|row| row.len() == 1));
    }
    let tilted = case(&Specification { reading: Reading::Tilt, ..usual("puma560") }, 2);
    assert!(tilted.table_csv().lines().next().unwrap().ends_with("tilt_x_deg,tilt_y_deg"));
    assert!(tilted.model_yaml().contains("level: {after: flange}"));
}

#[test]
fn a_ball_sits_in_its_socket_however_the_arm_comes() {
    use plumb_simulated::physics::machine::{Conditions, Machine};
    let specification =
        Specification { reading: Reading::Touch, ..hiding("puma560", &[("joint_backlash", 3.0)]) };
    let made = case(&specification, 3);
    assert!(made.table_csv().lines().next().unwrap().ends_with("time_s,repeat,touch"));
    assert!(made.model_yaml().contains("touch: {p: p1, distances: [{between: [s1, s2], mm: "));
    let all: Vec<_> = made.nuisances.iter().chain(&made.imperfections).cloned().collect();
    let mut machine = Machine::new(&made.specification.arm, &all);
    let mut seated: Vec<Vec<[f64; 3]>> = vec![Vec::new(); 6];
    for (visit, off) in made.visits.iter().zip(&made.readings) {
        machine.go(&visit.beyond(), visit.time_s);
        machine.go(&visit.commanded, visit.time_s);
        let conditions = Conditions {
            time_s: visit.time_s,
            temperature_c: visit.temperature_c,
            payload_kg: visit.payload_kg,
        };
        let target: [f64; 3] = machine.equilibrium(&conditions).unwrap().link_frames.target.into();
        let position = [target[0] - off[0], target[1] - off[1], target[2] - off[2]];
        seated[visit.touch.unwrap()].push(position);
    }
    assert!(seated.iter().all(|positions| positions.len() >= 5));
    for positions in seated {
        for axis in 0..3 {
            let spread = positions
                .iter()
                .map(|position| (position[axis] - positions[0][axis]).abs())
                .fold(0.0, f64::max);
            assert!(spread < 0.1, "a ball wanders by {spread} mm: joint angles have thousandths of a degree");
        }
    }
}

#[test]
fn accepted_verdicts_follow_from_what_is_hidden() {
    assert_eq!(case(&usual("puma560"), 1).truth.accept_verdict, [Verdict::AtFloor]);
    assert_eq!(
        case(&hiding("puma560", &[("outside", 3.0)]), 1).truth.accept_verdict,
        [Verdict::Unknown, Verdict::Located]
    );
    assert_eq!(
        case(&hiding("puma560", &[("joint_backlash", 6.0), ("outside", 3.0)]), 1).truth.accept_verdict,
        [Verdict::Unknown, Verdict::Located, Verdict::Named, Verdict::Tied]
    );
    assert_eq!(
        case(&hiding("puma560", &[("not_repeatable", 3.0)]), 1).truth.accept_verdict,
        [Verdict::NotRepeatable]
    );
    // A tenth of the noise is no sure find, no matter who looks.
    let faint = case(&hiding("puma560", &[("joint_backlash", 0.1)]), 1).truth.accept_verdict;
    assert!(faint.contains(&Verdict::AtFloor) && faint.contains(&Verdict::Named));
    let pair = case(&hiding("puma560", &[("joint_compliance", 3.0), ("joint_backlash", 3.0)]), 1).truth;
    assert!(pair.grow && pair.effects.len() == 2);
}

#[test]
fn the_seal_hides_and_opens() {
    let made = case(&hiding("puma560", &[("joint_backlash", 3.0)]), 12);
    let sealed = seal::seal(&made);
    assert!(!sealed.contains("backlash") && sealed.contains("not a cipher"));
    let opened = seal::open(&sealed).unwrap();
    assert_eq!(opened.truth, made.truth);
    assert_eq!(case(&opened.specification, 12), made);
}

#[test]
fn a_damaged_seal_says_what_is_wrong() {
    let sealed = seal::seal(&case(&usual("puma560"), 12));
    let message = |text: String| seal::open(&text).unwrap_err().to_string();
    assert!(message("hello".to_owned()).starts_with("this is no sealed answer"));
    let twelve = message(sealed.replace("seed: 12", "seed: twelve"));
    assert!(twelve.starts_with("line 2: the sealed answer must say `seed: NUMBER`"), "{twelve}");
    assert!(message(format!("{sealed}xyz")).contains("`xy` is not hexadecimal"));
    let lines: Vec<&str> = sealed.lines().collect();
    assert!(message(lines[..lines.len() - 1].join("\n")).contains("does not open"));
}

#[test]
fn further_poses_are_measured_on_the_same_arm_without_disturbing_what_was_read() {
    let specification =
        Specification { payloads_kg: vec![0.0, 1.0], ..hiding("ur10", &[("joint_step", 3.0)]) };
    let first = case(&specification, 31);
    let chosen =
        |q: f64, payload_kg: f64| Chosen { commanded_deg: vec![q; 6], sides: vec![1.0, 0.0], payload_kg };
    let poses = [chosen(-10.0, 2.0), chosen(-35.5, 0.0)];
    let more = campaign::generate_further(&specification, 31, &poses).unwrap();
    let count = first.visits.len();
    assert_eq!(more.visits[..count], first.visits[..]);
    assert_eq!(more.readings[..count], first.readings[..]);
    assert_eq!(more.imperfections, first.imperfections);
    assert_eq!((more.visits.len(), more.visits[count].payload_kg), (count + 2, 2.0));
    assert_eq!(more.visits[count].sides[0], 1.0);
    assert!(more.visits[count].time_s > more.visits[count - 1].time_s);
    // One more later is the same as all at once.
    let one = campaign::generate_further(&specification, 31, &poses[..1]).unwrap();
    assert_eq!(one.readings[..], more.readings[..count + 1]);
}

#[test]
fn wishes_that_make_no_sense_are_refused_with_what_would_be_right() {
    let message = |choice: Choice| {
        let hidden = vec![Requested { choice, size: Size::OverNoise(3.0) }];
        campaign::generate(&Specification { hidden, ..usual("puma560") }, 1).unwrap_err().to_string()
    };
    assert!(
        message(Choice::named("gremlins"))
            .starts_with("there is no effect `gremlins`; known are joint_gain, link_length")
    );
    let choice = |name: &str, site: &str, detail: Option<&str>| Choice {
        site: Some(site.to_owned()),
        detail: detail.map(str::to_owned),
        ..Choice::named(name)
    };
    assert_eq!(
        message(choice("joint_compliance", "waist", None)),
        "`joint_compliance` cannot sit at `waist`; on this arm it can at shoulder, elbow, wrist_roll, wrist_bend"
    );
    assert_eq!(
        message(choice("joint_coupling", "waist", Some("waist"))),
        "`joint_coupling`: `waist` is not another joint of this arm"
    );
    assert_eq!(
        message(choice("thermal_growth", "shoulder", None)),
        "`thermal_growth` at `shoulder` does not move the readings in these poses: give its size itself, or another place"
    );
    let none = Specification { poses: 0, repeated_poses: 0, ..usual("puma560") };
    assert_eq!(
        campaign::generate(&none, 1).unwrap_err().to_string(),
        "a campaign needs at least one pose (to read tilts: one with the flange's z pointing up)"
    );
}

#[test]
fn a_model_that_frees_the_geometry_meets_an_arm_whose_geometry_is_off() {
    let made = case(&Specification { free: Free::Geometry, ..usual("ur5") }, 2);
    assert!(made.model_yaml().contains("free: [joint_zero(*), geometry(*)]"));
    assert_eq!(made.nuisances.len(), 3 + 6 * 5);
}
