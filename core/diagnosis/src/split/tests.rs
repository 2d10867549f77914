//! How rows are split, on tables small enough to count.

use super::*;

/// A table of one joint at these angles, deg, and what else is given of each row.
fn table(further: &str, rows: &[(f64, &str)]) -> Table {
    let mut text = format!("q1_deg,p1_x_mm{further}\n");
    for (angle, more) in rows {
        text.push_str(&format!("{angle},0{more}\n"));
    }
    Table::parse("table.csv", &text).unwrap()
}

fn angles(angles: &[f64]) -> Table {
    let rows: Vec<(f64, &str)> = angles.iter().map(|angle| (*angle, "")).collect();
    table("", &rows)
}

/// `count` poses a degree apart.
fn ladder(count: usize) -> Table {
    angles(&(0..count).map(|row| row as f64).collect::<Vec<_>>())
}

#[test]
fn replicates_and_rows_of_one_name_share_a_pose_and_places_are_shares_of_the_range() {
    let equal = Poses::of(&angles(&[10.0, 30.0, 10.0, 20.0]));
    assert_eq!(equal.rows, [vec![0, 2], vec![1], vec![3]]);
    let positions: Vec<f64> = equal.positions.iter().map(|position| position[0]).collect();
    assert!(
        positions.iter().zip([0.0, 1.0, 0.5]).all(|(position, fraction)| (position - fraction).abs() < 1e-12),
        "{positions:?}"
    );
    let named = Poses::of(&table(",repeat", &[(10.0, ",a"), (30.0, ","), (10.01, ",a")]));
    assert_eq!(named.rows, [vec![0, 2], vec![1]]);
    assert_eq!(
        Poses::of(&angles(&[5.0, 5.0])).positions,
        [[0.5]],
        "a joint that did not move separates no poses"
    );
}

#[test]
fn regions_are_cut_at_the_median_the_largest_first_and_hold_every_pose_once() {
    let poses = Poses::of(&ladder(10));
    let all: Vec<usize> = (0..10).collect();
    let mut halves = poses.regions(&all, 2);
    halves.sort();
    assert_eq!(halves, [vec![0, 1, 2, 3, 4], vec![5, 6, 7, 8, 9]]);
    let four = poses.regions(&all, 4);
    let sizes: Vec<usize> = four.iter().map(Vec::len).collect();
    assert_eq!((four.len(), sizes.iter().min(), sizes.iter().max()), (4, Some(&2), Some(&3)));
    let mut together = four.concat();
    together.sort_unstable();
    assert_eq!(together, all);
    assert_eq!(poses.regions(&[3], 4), [[3]], "a pose is not cut");
}

#[test]
fn of_joints_that_spread_alike_the_first_is_cut() {
    let text = "q1_deg,q2_deg,p1_x_mm\n0,0,0\n0,10,0\n10,0,0\n10,10,0\n";
    let poses = Poses::of(&Table::parse("table.csv", text).unwrap());
    let mut halves = poses.regions(&[0, 1, 2, 3], 2);
    halves.sort();
    assert_eq!(halves, [vec![0, 1], vec![2, 3]]);
}

/// Which of 20 poses a degree apart and one farther out is lonely.
fn lonely(far: f64) -> Vec<usize> {
    let mut positions: Vec<f64> = (0..20).map(f64::from).collect();
    positions.push(19.0 + far);
    let mut chosen: Vec<usize> = (0..21).collect();
    Poses::of(&angles(&positions)).drop_lonely(&mut chosen);
    (0..21).filter(|pose| !chosen.contains(pose)).collect()
}

#[test]
fn a_pose_is_lonely_beyond_a_multiple_of_the_usual_reach() {
    // A fifth of 21 is 5: in the middle five others lie within 3 deg, and the last one's fifth neighbour is the 16th pose, 4 deg farther than its nearest.
    assert_eq!(lonely(3.0 * LONELY_FACTOR - 4.5), Vec::<usize>::new());
    assert_eq!(lonely(3.0 * LONELY_FACTOR - 3.5), [20]);
}

#[test]
fn the_usual_reach_is_that_of_the_pose_in_the_middle_however_close_others_lie() {
    // Ten poses a tenth of a degree apart, ten a degree apart, and one farther out: of 21 reaches the eleventh is the least of the second ten, 3 deg.
    let with = |far: f64| {
        let close = (0..10).map(|index| 0.1 * f64::from(index));
        let wide = (0..10).map(|index| 200.0 + f64::from(index));
        let positions: Vec<f64> = close.chain(wide).chain([209.0 + far]).collect();
        let mut chosen: Vec<usize> = (0..21).collect();
        Poses::of(&angles(&positions)).drop_lonely(&mut chosen);
        (0..21).filter(|pose| !chosen.contains(pose)).collect::<Vec<usize>>()
    };
    assert_eq!(with(3.0 * LONELY_FACTOR - 4.5), Vec::<usize>::new());
    assert_eq!(with(3.0 * LONELY_FACTOR - 3.5), [20]);
}

#[test]
fn where_many_lie_far_out_and_in_large_tables_nothing_is_lonely() {
    let mut two_positions: Vec<f64> = (0..14).map(f64::from).collect();
    two_positions.extend((0..6).map(|pose| 400.0 + 40.0 * f64::from(pose)));
    let mut chosen: Vec<usize> = (0..20).collect();
    Poses::of(&angles(&two_positions)).drop_lonely(&mut chosen);
    assert_eq!(chosen.len(), 20, "six of twenty are more than a fifth");
    let mut many: Vec<f64> = (0..LONELY_POSES).map(|pose| pose as f64 * 0.1).collect();
    many.push(1e4);
    let mut chosen: Vec<usize> = (0..many.len()).collect();
    Poses::of(&angles(&many)).drop_lonely(&mut chosen);
    assert_eq!(chosen.len(), LONELY_POSES + 1);
}

#[test]
fn a_random_share_is_held_out_pose_by_pose_and_by_its_seed() {
    let mut rows = vec![(0.0, ",a"); 3];
    rows.extend((1..18).map(|row| (f64::from(row), ",")));
    let table = table(",repeat", &rows);
    let split = |seed| Split::new(&table, Holdout::Random { fraction: 0.3, seed }).unwrap();
    for seed in 0..20 {
        let held = split(seed).check_rows();
        assert!((6..=8).contains(&held.len()), "a third of 20, and at most a pose more: {held:?}");
        let of_pose = held.iter().filter(|row| **row < 3).count();
        assert!(of_pose == 0 || of_pose == 3, "replicates stay together: {held:?}");
        let fitted = split(seed).fit_rows();
        assert_eq!(fitted.len() + held.len(), 20);
        assert!(fitted.iter().all(|row| !held.contains(row)));
    }
    assert_eq!(split(4), split(4));
    assert!((0..20).any(|seed| split(seed) != split(4)));
}

#[test]
fn the_last_part_of_the_time_and_the_last_session_are_held_out() {
    let by_time = table(",time_s", &[(0.0, ",30"), (1.0, ",10"), (2.0, ",20"), (3.0, ",40")]);
    assert_eq!(Split::new(&by_time, Holdout::Time { fraction: 0.5 }).unwrap().check_rows(), [0, 3]);
    let sessions = table(",session", &[(0.0, ",mon"), (1.0, ",tue"), (2.0, ",mon"), (3.0, ",tue")]);
    assert_eq!(Split::new(&sessions, Holdout::Session).unwrap().check_rows(), [1, 3]);
    assert_eq!(Split::new(&by_time, Holdout::Session), Err(HoldoutError::NoSessions));
    assert_eq!(Split::new(&by_time, Holdout::None).unwrap().check_rows(), Vec::<usize>::new());
}

#[test]
fn two_regions_of_eight_are_locked_away_and_replicates_and_small_tables_are_not() {
    let held = Split::new(&ladder(40), Holdout::Regions).unwrap().check_rows();
    assert_eq!(held.len(), 10, "two of eight regions of five: {held:?}");
    assert_eq!(Split::new(&ladder(15), Holdout::Regions).unwrap().check_rows(), Vec::<usize>::new());
    assert_eq!(Split::new(&ladder(16), Holdout::Regions).unwrap().check_rows().len(), 4);
    let mut replicated: Vec<f64> = (0..30).map(f64::from).collect();
    replicated.extend([7.0, 21.0]);
    let held = Split::new(&angles(&replicated), Holdout::Regions).unwrap().check_rows();
    assert!(!held.is_empty() && [7, 21, 30, 31].iter().all(|row| !held.contains(row)), "{held:?}");
}

#[test]
fn poses_that_were_returned_to_stay_in_the_fit_while_half_of_all_poses_were_not() {
    let with_returns = |every: usize| {
        let poses: Vec<f64> = (0..30).map(f64::from).collect();
        let returned: Vec<f64> = poses.iter().copied().step_by(every).collect();
        let rows = [poses, returned.clone()].concat();
        let held = Split::new(&angles(&rows), Holdout::Regions).unwrap().check_rows();
        let of_returned = held.iter().filter(|row| returned.contains(&rows[**row])).count();
        (held.len(), of_returned)
    };
    let (held, of_returned) = with_returns(3);
    assert!(held >= 4 && of_returned == 0, "two regions of eight of twenty poses: {held}, {of_returned}");
    let (_, of_returned) = with_returns(1);
    assert!(of_returned > 0, "where all were returned to, some of them are held out");
}

/// So many positions in so many cycles, each approached from both sides, whose returns are named for position and side.
fn cycles(positions: usize, count: usize) -> Table {
    let rows: Vec<(f64, String)> = (0..count)
        .flat_map(|_| (0..2 * positions).map(move |step| step.min(2 * positions - 1 - step)))
        .enumerate()
        .map(|(row, position)| (position as f64, format!(",p{position}{}", row / positions % 2)))
        .collect();
    let rows: Vec<(f64, &str)> = rows.iter().map(|(angle, name)| (*angle, name.as_str())).collect();
    table(",repeat", &rows)
}

#[test]
fn rows_at_one_place_or_of_one_name_are_of_one_pose() {
    let poses = Poses::of(&cycles(9, 5));
    assert_eq!(
        (poses.rows.len(), poses.positions.len()),
        (9, 9),
        "named for the side they are returns to nine poses"
    );
    assert!(poses.rows.iter().all(|rows| rows.len() == 10 && rows.is_sorted()));
    // Two positions are one pose where one return was read a little off; a third stays by itself.
    let off =
        table(",repeat", &[(1.0, ",a"), (2.0, ",b"), (1.001, ",a"), (5.0, ","), (2.0, ",a"), (1.001, ",")]);
    assert_eq!(Poses::of(&off).rows, [vec![0, 1, 2, 4, 5], vec![3]]);
}

#[test]
fn of_few_poses_measured_often_none_is_held_out() {
    let held = |positions: usize, count: usize| {
        Split::new(&cycles(positions, count), Holdout::Regions).unwrap().check_rows().len()
    };
    assert_eq!((held(FEW_POSES - 1, 2), held(FEW_POSES, 2) > 0), (0, true));
    // Once from each side are two returns, fewer than FEW_POSES_RETURNS.
    assert!(held(FEW_POSES - 1, 1) > 0);
}

#[test]
fn of_touched_places_the_last_is_held_out() {
    let rows: Vec<(f64, &str)> =
        [",a", ",b", ",c", ",d", ",d"].iter().enumerate().map(|(row, name)| (row as f64, *name)).collect();
    let mut text = "q1_deg,touch\n".to_owned();
    rows.iter().for_each(|(angle, name)| text.push_str(&format!("{angle}{name}\n")));
    let touched = Table::parse("table.csv", &text).unwrap();
    assert_eq!(Split::new(&touched, Holdout::Regions).unwrap().check_rows(), [3, 4]);
}

#[test]
fn fewer_rows_are_kept_by_pose_and_never_one_that_was_locked() {
    let table = ladder(40);
    let mut split = Split::new(&table, Holdout::Regions).unwrap();
    let locked = split.check_rows();
    split.keep(&table, 12);
    let kept = split.fit_rows();
    assert_eq!((kept.len(), split.check_rows()), (12, locked.clone()));
    assert!(kept.iter().all(|row| !locked.contains(row)));
    assert!(kept.windows(2).any(|pair| pair[1] - pair[0] > 1), "spread at random: {kept:?}");
}

#[test]
fn a_way_to_hold_out_is_read_as_it_is_written_and_a_wrong_one_is_refused() {
    for text in ["regions", "random:0.25:7", "time:0.4", "session", "none"] {
        assert_eq!(text.parse::<Holdout>().unwrap().to_string(), text);
    }
    assert_eq!("random".parse(), Ok(Holdout::Random { fraction: 0.3, seed: 1 }));
    assert_eq!("time".parse(), Ok(Holdout::Time { fraction: 0.3 }));
    for fraction in ["random:0", "random:1", "time:-0.1", "time:1.5"] {
        assert_eq!(fraction.parse::<Holdout>(), Err(HoldoutError::Proportion(fraction.to_owned())));
    }
    for unknown in ["", "rows", "random:x", "random:0.3:x", "time:0.3:1", "regions:2"] {
        assert_eq!(unknown.parse::<Holdout>(), Err(HoldoutError::Unknown(unknown.to_owned())));
    }
}

#[test]
fn a_region_is_cut_across_the_joint_that_spreads_most_and_the_first_joints_count_for_more() {
    assert_eq!((weight(0), weight(5)), (1.0, 0.5));
    // Ten poses: three of the first joint lie at the other end of its range, five of the second.
    let far = [1, 4, 8];
    let rows = (0..10).map(|row| {
        let first = if far.contains(&row) { 10 } else { 0 };
        format!("{first},{},0\n", 30 * (row % 2))
    });
    let rows: String = rows.collect();
    let poses = Poses::of(&Table::parse("table.csv", &format!("q1_deg,q2_deg,p1_x_mm\n{rows}")).unwrap());
    let all: Vec<usize> = (0..poses.positions.len()).collect();
    let at =
        |first: f64, second: f64| poses.positions.iter().position(|position| position[..] == [first, second]);
    let four = [at(0.0, 0.0), at(0.0, 1.0), at(1.0, 0.0), at(1.0, 1.0)].map(Option::unwrap);
    assert_eq!((all.len(), poses.coordinate(four[1], 0), poses.coordinate(four[1], 1)), (4, 0.0, 1.0));
    assert_eq!(poses.coordinate(four[1], 2), 0.0, "there is no third joint");
    // As shares of the range: three at nothing and one at one lie 3/4 off their mean in squares.
    assert!((poses.spread(&all, 0) - 1.0).abs() < 1e-12);
    let three = [four[0], four[1], four[1], four[3]];
    assert!((poses.spread(&three, 0) - 0.75).abs() < 1e-12);
    assert!((poses.spread(&three, 1) - 0.75).abs() < 1e-12);
    let (low, high) = poses.cut(vec![four[3], four[1], four[2], four[0]]);
    assert_eq!((low, high), (vec![four[1], four[0]], vec![four[3], four[2]]), "the first of two alike");
    // The second joint spreads 2.5 of ten and the first 2.1, which is more than 2.5 over 1.2.
    let many = |first: &[usize]| {
        let pose = |one: usize| four[2 * usize::from(first.contains(&one)) + usize::from(one < 5)];
        (0..10).map(pose).collect::<Vec<usize>>()
    };
    let ones = |region: &[usize], joint: usize| {
        region.iter().filter(|pose| poses.coordinate(**pose, joint) > 0.5).count()
    };
    let (low, high) = poses.cut(many(&[0, 4, 8]));
    assert_eq!((ones(&low, 0), ones(&high, 0)), (0, 3));
    let (low, high) = poses.cut(many(&[0, 8]));
    assert_eq!((ones(&low, 1), ones(&high, 1)), (0, 5), "1.6 is less");
}
