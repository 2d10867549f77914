//! The noise floor of made-up replicates whose sigma and degrees of freedom are known.

use nalgebra::{DMatrix, DVector};

use super::*;
use crate::thresholds::INLIER_QUANTILE;
use plumb_calibration::arm_model::Model;
use plumb_calibration::effect::{EffectId, Site};
use plumb_calibration::measurement::Observations;
use plumb_calibration::table::Table;
use plumb_estimation::{Random, chi_squared_quantile};

/// Groups of so many replicates, three equations each, with scatter `sigma` and no candidate for it.
fn replicates(sizes: &[usize], sigma: f64, seed: u64) -> Replicates {
    let mut random = Random::seeded(seed);
    let groups = sizes.iter().enumerate().flat_map(|(group, size)| std::iter::repeat_n(group, *size));
    let members: Vec<(usize, usize)> = groups.enumerate().collect();
    let residuals = members.iter().map(|(_, group)| {
        // Each pose has an error of the model of its own, which must not count.
        DVector::from_fn(3, |axis, _| 10.0 * (group + axis) as f64 + sigma * random.normal())
    });
    let residuals: Vec<DVector<f64>> = residuals.collect();
    Replicates {
        columns: vec![DMatrix::zeros(3, 0); members.len()],
        motions: Vec::new(),
        loose: Vec::new(),
        candidates: Vec::new(),
        groups: sizes.len(),
        members,
        residuals,
    }
}

#[test]
fn a_group_pays_for_its_mean_and_a_single_reading_gives_nothing() {
    let sizes = [3, 2, 5, 1];
    let all = replicates(&sizes, 1.0, 1);
    let ones = vec![1.0; 11];
    // (3 - 1) + (2 - 1) + (5 - 1) + (1 - 1) replicates of three equations each.
    assert_eq!(all.freedom(&ones), 3 * 7);
    let without_one: Vec<f64> = (0..11).map(|member| if member == 1 { 0.0 } else { 1.0 }).collect();
    assert_eq!(all.freedom(&without_one), 3 * 6);
}

#[test]
fn the_floor_is_the_known_sigma_on_the_known_degrees_of_freedom() {
    // 400 pairs: 1,200 degrees of freedom, so sigma is known to 1 / sqrt(2 * 1200) = 2 %.
    for (seed, sigma) in [(2, 0.5), (3, 1.0), (4, 7.0)] {
        let scatter = allow(&replicates(&[2; 400], sigma, seed)).1;
        // Rows beyond the inlier quantile are left out: of 800 sound ones hardly any.
        assert!(scatter.freedom <= 1200 && scatter.freedom > 1200 - 12, "{}", scatter.freedom);
        assert!((scatter.sigma / sigma - 1.0).abs() < 0.06, "{} for {sigma}", scatter.sigma);
    }
}

#[test]
fn the_mean_square_over_its_freedom_is_unbiased_in_small_groups() {
    // Divided by the number of equations in place of the freedom, sigma of pairs would come out as 0.71.
    let sigmas: f64 = (0..60).map(|seed| allow(&replicates(&[2; 20], 1.0, 100 + seed)).1.sigma.powi(2)).sum();
    assert!((sigmas / 60.0 - 1.0).abs() < 0.06, "{}", sigmas / 60.0);
}

#[test]
fn an_outlier_is_left_out_and_costs_its_degrees_of_freedom() {
    let mut all = replicates(&[20; 12], 1.0, 9);
    let sound = allow(&all).1;
    all.residuals[17][0] += 20.0;
    let spoilt = allow(&all).1;
    assert!((spoilt.sigma - sound.sigma).abs() < 0.02, "{} {}", spoilt.sigma, sound.sigma);
    assert_eq!(spoilt.freedom, sound.freedom - 3);
    let edge = chi_squared_quantile(INLIER_QUANTILE, 3.0).sqrt();
    assert!((4.0..4.5).contains(&edge), "{edge} sigmas");
}

#[test]
fn a_far_outlier_of_a_small_group_is_left_out_alone() {
    for size in [3, 4, 6] {
        for shift in [12.0, 100.0, 1e4] {
            let mut all = replicates(&vec![size; 40], 1.0, 31);
            let sound = allow(&all).1;
            all.residuals[size * 7][1] += shift;
            let spoilt = allow(&all).1;
            assert_eq!(spoilt.freedom, sound.freedom - 3, "{size} replicates, {shift} sigmas");
            assert!((spoilt.sigma - sound.sigma).abs() < 0.05, "{} {}", spoilt.sigma, sound.sigma);
        }
    }
}

#[test]
fn of_a_pair_that_differs_nothing_is_left_and_of_two_outliers_in_a_group_neither() {
    let mut all = replicates(&[2; 60], 1.0, 32);
    let sound = allow(&all).1;
    all.residuals[20][0] += 50.0;
    assert_eq!(allow(&all).1.freedom, sound.freedom - 3);
    let mut all = replicates(&[7; 20], 1.0, 33);
    let sound = allow(&all).1;
    all.residuals[21][0] += 500.0;
    all.residuals[24][2] -= 20.0;
    let spoilt = allow(&all).1;
    assert_eq!(spoilt.freedom, sound.freedom - 6);
    assert!((spoilt.sigma - sound.sigma).abs() < 0.05, "{} {}", spoilt.sigma, sound.sigma);
}

/// Replicates that also depend on one condition: +-1 with a coefficient, and a candidate that says so.
fn with_condition(coefficient: f64) -> Replicates {
    condition_among(&[4; 30], coefficient)
}

/// The same in groups of these sizes.
fn condition_among(sizes: &[usize], coefficient: f64) -> Replicates {
    let mut all = replicates(sizes, 1.0, 21);
    all.candidates = vec![(EffectId::at("joint_backlash", Site::Joint(0)), 0..1)];
    for (member, (columns, residuals)) in all.columns.iter_mut().zip(&mut all.residuals).enumerate() {
        let side = if member % 2 == 0 { 1.0 } else { -1.0 };
        *columns = DMatrix::from_column_slice(3, 1, &[side, 0.0, 0.0]);
        residuals[0] += coefficient * side;
    }
    all
}

#[test]
fn a_condition_that_matters_is_taken_out_and_costs_a_degree_of_freedom() {
    let (chosen, scatter) = allow(&with_condition(3.0));
    assert_eq!(chosen, [0]);
    assert!((scatter.sigma - 1.0).abs() < 0.12, "{}", scatter.sigma);
    assert!((3 * 90 - 10..3 * 90).contains(&scatter.freedom), "{}", scatter.freedom);
    let (chosen, _) = allow(&with_condition(0.0));
    assert!(chosen.is_empty(), "a condition without influence is left in");
}

#[test]
fn replicates_on_fewer_degrees_of_freedom_than_the_least_make_no_floor() {
    let freedom = |sizes: &[usize]| replicates(sizes, 1.0, 5).freedom(&vec![1.0; sizes.iter().sum()]);
    assert!(freedom(&[2]) < FLOOR_FREEDOM && freedom(&[2, 2]) >= FLOOR_FREEDOM);
}

#[test]
fn of_gaps_between_approach_directions_one_joint_is_taken_out_and_no_other_beside_it() {
    let mut all = with_condition(3.0);
    let range = all.candidates[0].1.clone();
    all.candidates = vec![
        (EffectId::at(SIDE_OF_APPROACH, Site::Joint(0)), range.clone()),
        (EffectId::at("joint_backlash", Site::Joint(1)), range),
    ];
    assert!(all.is_gap(0) && !all.is_gap(1) && !all.is_gap(2));
}

#[test]
fn returns_make_the_floor_from_six_degrees_of_freedom_on_else_what_is_declared_does() {
    let lab = crate::testing::two_links_with("free: []\nnoise: {p1_mm: 0.05}", 12, 0.05, 91, |_| [0.0; 2]);
    let problem = lab.problem(&[]).unwrap();
    assert!((typical_sigma(&problem) - 0.05).abs() < 1e-12);
    // Two groups of two: (2 - 1) returns of three equations each.
    let enough = Floor::among(&problem, Some(&replicates(&[2, 2], 1.0, 5)));
    assert_eq!((enough.source, enough.dof), (FloorSource::Repeats, FLOOR_FREEDOM));
    assert!((enough.sigma_mm.unwrap() - 0.05 * enough.scale.unwrap()).abs() < 1e-12, "in sigmas of 0.05 mm");
    let many = Floor::among(&problem, Some(&replicates(&[6; 20], 2.0, 5)));
    assert!((many.scale.unwrap() - 2.0).abs() < 0.2 && many.dof == 300, "{many:?}");
    let few = Floor::among(&problem, Some(&replicates(&[2], 2.0, 5)));
    assert_eq!((few.source, few.dof, few.scale), (FloorSource::Declared, 0, Some(1.0)));
    assert!((few.sigma_mm.unwrap() - 0.05).abs() < 1e-12, "{few:?}");
    let still = Floor::among(&problem, Some(&replicates(&[6; 4], 0.0, 5)));
    assert_eq!(
        still.source,
        FloorSource::Declared,
        "readings that are rounded to the same number are no floor"
    );
}

#[test]
fn a_candidate_gains_what_it_takes_beyond_the_columns_that_are_in() {
    let mut all = with_condition(3.0);
    // A second candidate that does the same as the first, and one that moves another coordinate with the order in the group.
    all.candidates.push((EffectId::at("joint_settling", Site::Joint(0)), 1..2));
    all.candidates.push((EffectId::at("drift", Site::Base), 2..3));
    for (member, columns) in all.columns.iter_mut().enumerate() {
        let side = if member % 2 == 0 { 1.0 } else { -1.0 };
        let late = if member % 4 < 2 { -1.0 } else { 1.0 };
        *columns = DMatrix::from_column_slice(3, 3, &[side, 0.0, 0.0, 2.0 * side, 0.0, 0.0, 0.0, late, 0.0]);
    }
    let nothing_in = all.gains(&all.scatter(&[]), &[]);
    // 120 replicates, each 3 sigmas off by its side: 9 squares each, and the noise of one parameter.
    assert!((nothing_in[0].0 - 9.0 * 120.0).abs() < 250.0, "{nothing_in:?}");
    assert!((nothing_in[1].0 - nothing_in[0].0).abs() < 1e-6, "{nothing_in:?}");
    assert_eq!(nothing_in.iter().map(|(_, freedom)| *freedom).collect::<Vec<_>>(), [1, 1, 1]);
    let first_in = all.gains(&all.scatter(&[0]), &[0]);
    assert_eq!((first_in[0].1, first_in[1].1), (0, 0), "{first_in:?}");
    assert!(first_in[0].0 < 1e-6 && first_in[1].0 < 1e-6, "{first_in:?}");
    assert!(first_in[2].1 == 1 && first_in[2].0 < 12.0, "noise of one parameter: {first_in:?}");
}

#[test]
fn no_condition_is_taken_out_of_as_few_degrees_of_freedom_as_a_floor_needs() {
    // Two pairs have six degrees of freedom, a group of three and a pair nine.
    let (chosen, scatter) = allow(&condition_among(&[2, 2], 30.0));
    assert_eq!((chosen.len(), scatter.freedom), (0, FLOOR_FREEDOM));
    let (chosen, scatter) = allow(&condition_among(&[3, 2], 30.0));
    assert_eq!((chosen, scatter.freedom), (vec![0], 8));
}

/// Deviations along x of 0.5 (36 members), 1.2 (24) and 1.7 (4). The first sigma comes from the median: 0.5 over the root of the median of chi squared
/// with three degrees of freedom, 2.366, so 0.33, and 1.7 lies beyond 4.2 of those. The sigma of what is kept is 0.5, and 1.7 lies within.
#[test]
fn what_a_first_sigma_made_too_small_is_taken_back_in_the_next_round() {
    let mut all = replicates(&[64], 0.0, 1);
    for (member, residual) in all.residuals.iter_mut().enumerate() {
        let size =
            [(36, 0.5), (60, 1.2), (64, 1.7)].into_iter().find(|(below, _)| member < *below).unwrap().1;
        residual[0] += if member % 2 == 0 { size } else { -size };
    }
    let scatter = all.scatter(&[]);
    assert_eq!(scatter.freedom, 3 * 63, "all are kept");
    let squares = 36.0 * 0.25 + 24.0 * 1.44 + 4.0 * 2.89;
    assert!((scatter.sigma - (squares / 189.0_f64).sqrt()).abs() < 1e-9, "{}", scatter.sigma);
}

/// Six poses of two links, each visited three times, every joint from both sides.
fn visited() -> crate::laboratory::Laboratory {
    crate::testing::with_table(&crate::testing::returned(6, 3), |table| {
        table.approach = Some((0..18).flat_map(|row| [from_below(row, 2), from_below(row, 3)]).collect());
    })
}

/// From below in every so many rows, else from above.
fn from_below(row: usize, every: usize) -> i8 {
    if row.is_multiple_of(every) { 1 } else { -1 }
}

#[test]
fn a_replicate_has_the_columns_of_what_was_asked_and_a_gap_of_its_own_pose() {
    let lab = visited();
    let fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
    let (problem, fit) = (&fitted.problem, &fitted.fit);
    let all = Replicates::gather(problem, fit, &lab.context()).unwrap();
    assert_eq!((all.members.len(), all.groups, all.motions[0].len()), (18, 6, 2));
    assert_eq!(all.members[7], (7, 2));
    // Candidates follow one another, the gaps of both joints last, with a column for each pose.
    let gaps: Vec<_> = all.candidates.iter().filter(|(id, _)| id.name == SIDE_OF_APPROACH).collect();
    let sites: Vec<(Site, usize)> = gaps.iter().map(|(id, range)| (id.site, range.len())).collect();
    assert_eq!(sites, [(Site::Joint(0), 6), (Site::Joint(1), 6)]);
    assert_eq!(gaps[1], all.candidates.last().unwrap());
    let mut end = 0;
    for (_, range) in &all.candidates {
        assert_eq!(range.start, end);
        end = range.end;
    }
    let play = all.candidates.iter().find(|(id, _)| id.name == "joint_backlash" && id.site == Site::Joint(0));
    let play = play.unwrap().1.start;
    let step = 1e-6;
    for member in [0, 1, 7, 17] {
        // How the tip moves with the first joint, by plain trigonometry; whitened by nothing, for no noise is declared.
        let q = lab.table().q_of(member);
        let tip = |first: f64, bent: f64| {
            let second = first + bent;
            [200.0 * first.cos() + 150.0 * second.cos(), 200.0 * first.sin() + 150.0 * second.sin(), 0.0]
        };
        let slopes = |axis: usize| {
            let by = |first: f64, bent: f64| tip(q[0] + first, q[1] + bent)[axis] / (2.0 * step);
            [by(step, 0.0) - by(-step, 0.0), by(0.0, step) - by(0.0, -step)]
        };
        let sides = [2, 3].map(|every| f64::from(from_below(member, every)));
        let columns = &all.columns[member];
        for (joint, axis) in [0, 1].into_iter().flat_map(|joint| [0, 1, 2].map(|axis| (joint, axis))) {
            let moved = all.motions[member][joint][axis];
            assert!((moved - slopes(axis)[joint]).abs() < 0.5, "{moved} {:?}", slopes(axis));
            for pose in 0..6 {
                let expected = if pose == member / 3 { sides[joint] * moved } else { 0.0 };
                assert!((columns[(axis, gaps[joint].1.start + pose)] - expected).abs() < 1e-9);
            }
        }
        // Half of the play, behind.
        for axis in 0..3 {
            let expected = -0.5 * sides[0] * all.motions[member][0][axis];
            assert!((columns[(axis, play)] - expected).abs() < 1e-9);
        }
        // The base is moved along each axis by as much, then the target turns with the hand.
        let (id, base) = (&all.loose[0].0, &all.loose[0].1[member]);
        assert_eq!((id.name.as_str(), base.shape()), ("base_position", (3, 3)));
        assert!((base - DMatrix::<f64>::identity(3, 3)).norm() < 1e-9, "{base}");
        let target = all.loose.iter().find(|(id, _)| id.name == "tool_offset").unwrap();
        let turned = (q[0] + q[1]).cos();
        assert!((target.1[member][(0, 0)] - turned).abs() < 0.02, "{}", target.1[member]);
    }
}

#[test]
fn replicates_that_read_something_else_than_the_first_are_not_compared() {
    let mut lab = visited();
    let count = |lab: &crate::laboratory::Laboratory| {
        let fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
        Replicates::gather(&fitted.problem, &fitted.fit, &lab.context()).unwrap().members
    };
    assert_eq!(count(&lab).len(), 18);
    // Row 4 is the second of the second pose, row 6 the first of the third: then both others differ from it.
    lab = crate::testing::with_table(&lab, |table| {
        table.positions[0].xyz[4][2] = f64::NAN;
        table.positions[0].xyz[6] = [f64::NAN; 3];
    });
    let rows: Vec<usize> = count(&lab).iter().map(|(row, _)| *row).collect();
    assert_eq!(rows, [0, 1, 2, 3, 5, 9, 10, 11, 12, 13, 14, 15, 16, 17]);
}

#[test]
fn the_typical_sigma_is_the_root_mean_square_of_lengths_and_of_angles_where_there_are_no_lengths() {
    let typical = |columns: &str, cells: &str| {
        let lines = "free: []\nnoise: {p1_mm: 0.3, p1_deg: 0.25}\n";
        let model = Model::parse("m.yaml", &format!("{}{lines}", crate::testing::TWO_LINKS)).unwrap();
        let table = Table::parse("t.csv", &format!("q1_deg,q2_deg,{columns}\n0,10,{cells}\n20,30,{cells}\n"));
        let table = table.unwrap();
        let observations = Observations::new(&model, &table).unwrap();
        typical_sigma(&ResidualModel::new(&model, &table, &observations, &[]).unwrap())
    };
    let (positions, turns) = ("p1_x_mm,p1_y_mm,p1_z_mm", "p1_rx_deg,p1_ry_deg,p1_rz_deg");
    assert!((typical(positions, "1,2,3") - 0.3).abs() < 1e-12);
    assert!((typical(turns, "1,2,3") - 0.25).abs() < 1e-12);
    assert!((typical(&format!("{positions},{turns}"), "1,2,3,1,2,3") - 0.3).abs() < 1e-12);
}

/// Ten pairs whose members are one sigma off their mean; a condition of two numbers is this share of the squares.
fn pairs_of_a_condition(fraction: f64) -> Replicates {
    let mut all = replicates(&[2; 10], 0.0, 5);
    all.candidates = vec![(EffectId::at("drift", Site::Base), 0..2)];
    for (member, (columns, residual)) in all.columns.iter_mut().zip(&mut all.residuals).enumerate() {
        let side = if member % 2 == 0 { 1.0 } else { -1.0 };
        *columns = DMatrix::from_row_slice(3, 2, &[side, 0.0, 0.0, side, 0.0, 0.0]);
        // What is left differs in sign from pair to pair.
        let rest = if member % 4 < 2 { side } else { -side };
        let along = side * (fraction / 2.0).sqrt();
        *residual += DVector::from_row_slice(&[along, along, rest * (1.0 - fraction).sqrt()]);
    }
    all
}

#[test]
fn a_condition_is_taken_out_from_a_level_of_one_percent_on() {
    // Thirty degrees of freedom: P(F with 2 and 28 degrees > f) = (1 + f / 14)^-14, which is the fraction that is left to the 14th.
    let edge = 1.0 - 0.01_f64.powf(1.0 / 14.0);
    let (chosen, scatter) = allow(&pairs_of_a_condition(1.005 * edge));
    assert_eq!((chosen, scatter.freedom), (vec![0], 28));
    assert!((scatter.squares - 20.0 * (1.0 - 1.005 * edge)).abs() < 1e-9, "{}", scatter.squares);
    let (chosen, scatter) = allow(&pairs_of_a_condition(0.995 * edge));
    assert_eq!((chosen.len(), scatter.freedom), (0, 30));
    assert!((scatter.squares - 20.0).abs() < 1e-9 && (scatter.sigma - (20.0_f64 / 30.0).sqrt()).abs() < 1e-9);
    // Beside another that is asked as well each has half of it (Holm 1979).
    let mut two = pairs_of_a_condition(1.005 * edge);
    two.candidates.push((EffectId::at("warm_up", Site::Joint(0)), 2..3));
    for (member, columns) in two.columns.iter_mut().enumerate() {
        *columns = columns.clone().insert_column(2, 0.0);
        columns[(0, 2)] = if member % 4 == 0 { 0.01 } else { -0.01 };
    }
    assert!(allow(&two).0.is_empty());
}

#[test]
fn of_two_gaps_one_is_taken_out_and_a_condition_beside_it() {
    let with = |names: [&str; 3]| {
        let mut all = replicates(&[4; 30], 1.0, 22);
        all.candidates =
            (0..3).map(|one| (EffectId::at(names[one], Site::Joint(one)), one..one + 1)).collect();
        for (member, (columns, residual)) in all.columns.iter_mut().zip(&mut all.residuals).enumerate() {
            let signs = [[1.0, -1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0], [1.0, -1.0, -1.0, 1.0]];
            let signs = signs.map(|signs| signs[member % 4]);
            *columns = DMatrix::from_diagonal(&nalgebra::DVector::from_row_slice(&signs));
            *residual += DVector::from_row_slice(&[2.0 * signs[0], 1.6 * signs[1], 1.2 * signs[2]]);
        }
        allow(&all).0
    };
    assert_eq!(with([SIDE_OF_APPROACH, SIDE_OF_APPROACH, "drift"]), [0, 2]);
    assert_eq!(with([SIDE_OF_APPROACH, "warm_up", "drift"]), [0, 1, 2], "the clearest first");
}

#[test]
fn a_jump_is_dated_between_moments_of_the_replicates_each_once_and_in_order() {
    let lab = crate::testing::returned(4, 3);
    let problem = lab.problem(&[]).unwrap();
    let clock = |row: usize| problem.clock(row).unwrap();
    assert!(clock(1) < clock(2) && clock(2) < clock(9));
    let groups = [vec![9, 2], vec![1, 2]];
    assert_eq!(super::replicates::clocks(&problem, &groups), [clock(1), clock(2), clock(9)]);
}
