//! The likelihoods in closed form, and both sides of what is asked of two positions.

use super::*;
use plumb_estimation::Random;

fn line(positions: &[f64]) -> Line {
    Line { positions: positions.to_vec(), spread: 1.0 }
}

fn lines(groups: Vec<Vec<f64>>) -> Lines {
    let sizes: Vec<f64> = groups.iter().flatten().map(|position| position.abs()).collect();
    let typical = median(&sizes).max(1e-12);
    Lines {
        lines: groups.iter().map(|positions| line(positions)).collect(),
        across: 0.0,
        freedom: 0.0,
        typical,
    }
}

/// Groups of five replicates of which each chose one of two positions `half` to either side, with noise of one.
fn groups(count: usize, half: f64, seed: u64) -> Vec<Vec<f64>> {
    let mut random = Random::seeded(seed);
    let position = |random: &mut Random| {
        let side = if random.below(2) == 0 { -half } else { half };
        side + random.normal()
    };
    let groups = (0..count).map(|_| {
        let mut positions: Vec<f64> = (0..5).map(|_| position(&mut random)).collect();
        let mean = positions.iter().sum::<f64>() / 5.0;
        positions.iter_mut().for_each(|position| *position -= mean);
        positions
    });
    groups.collect()
}

#[test]
fn one_position_has_the_likelihood_of_a_normal_sample_with_unknown_mean() {
    // Restricted likelihood: -((n - 1) ln s^2 + S / s^2) / 2.
    let group = line(&[1.0, -1.0, 3.0]);
    let (squares, sigma) = (8.0, 2.0);
    let expected = -0.5 * (2.0 * f64::ln(sigma * sigma) + squares / (sigma * sigma));
    assert!((one_camp(&group, sigma, 0.0) - expected).abs() < 1e-12);
    let wider = -0.5 * (2.0 * f64::ln(sigma * sigma + 9.0) + squares / (sigma * sigma + 9.0));
    assert!((one_camp(&group, sigma, 3.0) - wider).abs() < 1e-12, "further scatter adds to the variance");
}

#[test]
fn two_positions_sum_over_all_ways_to_choose() {
    // Two replicates at -d and d: four patterns, of which two leave S = 2 d^2, one 2 (d - h)^2 and one 2 (d + h)^2.
    let (d, h, sigma) = (1.5, 1.0, 0.5);
    let group = line(&[-d, d]);
    let term = |off: f64| (-0.5 * 2.0 * off * off / (sigma * sigma)).exp();
    let sum: f64 = 2.0 * term(d) + term(d - h) + term(d + h);
    let expected = sum.ln() - 2.0 * 2.0_f64.ln() - 0.5 * f64::ln(sigma * sigma);
    assert!((two_clusters(&group, sigma, h) - expected).abs() < 1e-12);
    assert!(
        (two_clusters(&group, sigma, 0.0) - one_camp(&group, sigma, 0.0)).abs() < 1e-12,
        "at no distance they are one"
    );
}

#[test]
fn two_positions_far_apart_are_found_with_their_distance_and_one_position_is_not_split() {
    let split = lines(groups(8, 4.0, 3));
    let (apart, likelier) = split.judge(split.one_camp()).unwrap();
    assert!((apart - 8.0).abs() < 1.0 && likelier > TWO_OVER_ONE, "{apart} {likelier}");
    for seed in 0..20 {
        let whole = lines(groups(8, 0.0, 50 + seed));
        assert_eq!(whole.judge(whole.one_camp()), None, "seed {seed}");
    }
}

#[test]
fn two_positions_must_be_likelier_than_one_by_the_threshold() {
    let split = lines(groups(8, 4.0, 3));
    let one = split.one_camp();
    let (_, likelier) = split.judge(one).unwrap();
    // One position explained better by something else: what it gains is lost to the split.
    assert!(split.judge(one + likelier - 1.01 * TWO_OVER_ONE).is_some());
    assert!(split.judge(one + likelier - 0.99 * TWO_OVER_ONE).is_none());
}

#[test]
fn a_wider_scatter_is_no_second_position() {
    // Scatter of five, without a gap between two positions.
    let mut random = Random::seeded(7);
    let groups = (0..8).map(|_| (0..5).map(|_| 5.0 * random.normal()).collect()).collect();
    let wide = lines(groups);
    assert_eq!(wide.judge(wide.one_camp()), None);
}

#[test]
fn positions_spread_evenly_are_a_wider_scatter_though_likelier_than_one_position_as_narrow_as_the_noise() {
    // Spread over ten sigmas without a gap; what lies across the motion says that a sigma is one.
    let mut random = Random::seeded(8);
    let groups = (0..8).map(|_| (0..5).map(|_| 10.0 * random.uniform() - 5.0).collect()).collect();
    let even = Lines { across: 400.0, freedom: 400.0, ..lines(groups) };
    let one = even.one_camp();
    let steps = (1..=48).map(|step| 5.5 * f64::from(step) / 48.0);
    let two = |half: f64| {
        even.across(1.0) + even.lines.iter().map(|line| two_clusters(line, 1.0, half)).sum::<f64>()
    };
    let best = steps.clone().map(two).fold(f64::NEG_INFINITY, f64::max);
    let wide = steps.map(|step| even.normal(1.0, step)).fold(f64::NEG_INFINITY, f64::max);
    assert!(best - one > TWO_OVER_ONE && best - wide < TWO_OVER_WIDE, "{one} {best} {wide}");
    assert_eq!(even.judge(one), None);
}

#[test]
fn a_few_slips_make_no_second_position() {
    // One replicate in forty lies far out.
    let mut slipped = groups(8, 0.0, 11);
    slipped[2][1] += 30.0;
    assert!(!in_earnest(&lines(slipped).lines, 15.0, 1.0));
    assert!(in_earnest(&lines(groups(8, 15.0, 12)).lines, 15.0, 1.0));
}

#[test]
fn a_group_counts_by_how_likely_it_would_show_both_positions() {
    // By 1 - 2 / 2^n: five replicates make 0.94 of a group, four 0.875; 0.9 are asked for.
    assert!(in_earnest(&[line(&[-9.0, 9.0, -9.0, 9.0, -9.0])], 9.0, 1.0));
    assert!(!in_earnest(&[line(&[-9.0, 9.0, -9.0, 9.0])], 9.0, 1.0));
    // Of nine groups of two, a half each, 4.5 are expected to show both: three are more than 0.55 of them, two are not.
    let pairs = |split: usize| -> Vec<Line> {
        (0..9).map(|group| if group < split { line(&[-9.0, 9.0]) } else { line(&[0.1, -0.1]) }).collect()
    };
    assert!(in_earnest(&pairs(3), 9.0, 1.0) && !in_earnest(&pairs(2), 9.0, 1.0));
}

#[test]
fn positions_nearer_than_the_noise_show_are_not_counted() {
    let near = lines(groups(8, 4.0, 3));
    assert!(in_earnest(&near.lines, 4.0, 8.0 / (1.01 * SPLIT_VISIBLE)));
    assert!(!in_earnest(&near.lines, 4.0, 8.0 / (0.99 * SPLIT_VISIBLE)));
}

#[test]
fn what_lies_across_is_distinguished_from_what_lies_along() {
    let (deviation, way) = (DVector::from_vec(vec![3.0, 4.0, 0.0]), DVector::from_vec(vec![2.0, 0.0, 0.0]));
    let member = Member::of(&deviation, &way, None);
    assert_eq!((member.along, member.across, member.freedom, member.length), (1.5, 16.0, 2.0, 2.0));
    let other = DVector::from_vec(vec![0.0, 5.0, 0.0]);
    let beside = Member::of(&deviation, &way, Some(&other));
    assert_eq!((beside.across, beside.freedom), (0.0, 1.0), "what another motion may have done says nothing");
}

#[test]
fn members_are_measured_along_their_way_and_what_lies_across_is_noise_of_its_own() {
    // Two groups of three replicates; the joint moves each reading 2 sigmas a unit along x.
    let positions = [[-2.0, 1.0, 0.0], [0.0, 0.0, 2.0], [2.0, -1.0, -2.0]];
    let deviations: Vec<DVector<f64>> =
        positions.iter().chain(&positions).map(|three| DVector::from_row_slice(three)).collect();
    let path = vec![DVector::from_row_slice(&[2.0, 0.0, 0.0]); 6];
    let returns = Replicates {
        members: (0..6).map(|member| (member, member / 3)).collect(),
        residuals: deviations.clone(),
        columns: vec![nalgebra::DMatrix::zeros(3, 0); 6],
        motions: Vec::new(),
        loose: Vec::new(),
        candidates: Vec::new(),
        groups: 2,
    };
    let found = Lines::along(&returns, &deviations, &[1.0; 6], &path, None).unwrap();
    assert_eq!(found.lines.len(), 2);
    for line in &found.lines {
        assert_eq!(line.positions, [-1.0, 0.0, 1.0], "half a unit a sigma");
        assert!((line.spread - 0.5).abs() < 1e-12);
    }
    // Squares across: 1 + 4 + 1 + 4 a group. Two directions across, less a mean in each group.
    assert!((found.across - 20.0).abs() < 1e-12 && (found.freedom - 8.0).abs() < 1e-12);
    assert!((found.typical - 2.0).abs() < 1e-12, "sigmas along the way: 2, 0, 2 twice");
    // The likelihood of what lies across: -8 ln s - 20 / 2 s^2.
    assert!((found.across(2.0) - (-8.0 * 2.0_f64.ln() - 2.5)).abs() < 1e-12);
    assert!((found.across(5.0) - (-8.0 * 5.0_f64.ln() - 0.4)).abs() < 1e-12);
    // What moves beside it along y is left out of account, and costs a direction.
    let beside = vec![DVector::from_row_slice(&[0.0, 3.0, 0.0]); 6];
    let aside = Lines::along(&returns, &deviations, &[1.0; 6], &path, Some(&beside)).unwrap();
    assert!((aside.across - 16.0).abs() < 1e-12 && (aside.freedom - 4.0).abs() < 1e-12);
    // An outlier is left out; of five that are left two positions say nothing.
    let mut kept = [1.0; 6];
    kept[1] = 0.0;
    assert!(Lines::along(&returns, &deviations, &kept, &path, None).is_none());
}

#[test]
fn the_smaller_cluster_has_one_member_in_six() {
    // Groups of which one member is on the other side: six members count 6 (1 - 2 / 64) = 5.8, seven 6.9.
    let odd_one = |count: usize| -> Vec<f64> {
        (0..count).map(|member| if member == 0 { 9.0 } else { -9.0 }).collect()
    };
    assert!(in_earnest(&[line(&odd_one(6)), line(&odd_one(6))], 9.0, 1.0));
    assert!(!in_earnest(&[line(&odd_one(7)), line(&odd_one(7))], 9.0, 1.0));
}

#[test]
fn a_pattern_says_which_members_are_taken_to_be_of_the_upper_place() {
    assert_eq!(shifted(&line(&[5.0, 5.0, -2.0]), 0b101, 1.5), [3.5, 6.5, -3.5]);
}

/// Returns to two poses, so many to each, of one reading; and what a motion moves it by.
fn returns_to(sizes: [usize; 2], motion: f64) -> (Replicates, Vec<DVector<f64>>) {
    let members: Vec<(usize, usize)> =
        (0..sizes[0] + sizes[1]).map(|member| (member, usize::from(member >= sizes[0]))).collect();
    let count = members.len();
    let residuals = (0..count).map(|member| DVector::from_element(1, member as f64));
    let returns = Replicates {
        residuals: residuals.collect(),
        columns: vec![nalgebra::DMatrix::zeros(1, 0); count],
        motions: Vec::new(),
        loose: Vec::new(),
        candidates: Vec::new(),
        groups: 2,
        members,
    };
    (returns, vec![DVector::from_element(1, motion); count])
}

#[test]
fn returns_that_do_not_move_or_are_alone_say_nothing_of_two_positions() {
    let lines = |sizes: [usize; 2], motion: f64| {
        let (returns, path) = returns_to(sizes, motion);
        let kept = vec![1.0; path.len()];
        Lines::along(&returns, &returns.residuals, &kept, &path, None).map(|all| all.lines.len())
    };
    assert_eq!(lines([3, 3], 2.0), Some(2));
    assert_eq!(lines([6, 1], 2.0), Some(1), "one return has nothing to be compared with");
    assert_eq!(lines([5, 1], 2.0), None, "five returns are too few");
    assert_eq!(lines([4, 4], 0.0), None, "what does not move the reading has no position along it");
}
