//! The permutation test's parts on made-up columns.

use super::*;

/// Numbers without a pattern.
fn noise(count: usize, seed: u64) -> Vec<f64> {
    let mut random = Random::seeded(seed);
    (0..count).map(|_| random.normal()).collect()
}

fn sheet(covariate: Vec<f64>, component: Vec<f64>, turns: bool) -> Sheet {
    Sheet {
        covariates: vec![Covariate {
            name: "lift".to_owned(),
            unit: "deg",
            turns,
            values: covariate,
            categories: Vec::new(),
        }],
        components: vec![Component { name: "along x".to_owned(), unit: ReadingUnit::Mm, values: component }],
    }
}

#[test]
fn squares_between_and_within_levels_add_up() {
    let values = noise(90, 3);
    let order: Vec<usize> = (0..90).collect();
    let levels: Vec<usize> = (0..90).map(|index| index % 3).collect();
    let (between, within, count) = explained(&values, &levels, &order);
    let mean = values.iter().sum::<f64>() / 90.0;
    let total: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    assert!((between + within - total).abs() < 1e-9 * total && count == 3);
    assert!(between < 0.1 * total, "levels of no meaning explain next to nothing");
}

#[test]
fn a_covariate_of_few_values_is_taken_as_it_is_and_others_by_equal_numbers() {
    assert_eq!(levels(&[5.0, -1.0, 5.0, 2.0]), [2, 0, 2, 1]);
    let many: Vec<f64> = (0..160).map(f64::from).collect();
    let of_level = |level: usize| levels(&many).into_iter().filter(|own| *own == level).count();
    assert!((0..LEVELS).all(|level| of_level(level) == 160 / LEVELS));
}

#[test]
fn a_covariate_that_matters_beats_all_shuffles_and_one_that_does_not_stays_among_them() {
    let covariate = noise(200, 5);
    let answers: Vec<f64> = covariate.iter().zip(noise(200, 6)).map(|(at, noise)| at + noise).collect();
    let strength = |component: Vec<f64>, order: &[usize]| {
        let sheet = sheet(covariate.clone(), component, false);
        strongest(&sheet, &[levels(&covariate)], order)[0].strength
    };
    let mut order: Vec<usize> = (0..200).collect();
    let (real, none) = (strength(answers.clone(), &order), strength(noise(200, 7), &order));
    let mut random = Random::seeded(8);
    let mut chance: f64 = 0.0;
    for _ in 0..SHUFFLES {
        random.shuffle(&mut order);
        chance = chance.max(strength(answers.clone(), &order));
    }
    assert!(real > 2.0 * chance && none < chance, "{real} {none} {chance}");
}

#[test]
fn a_wave_is_found_with_its_order_and_amplitude_and_half_a_wave_is_none() {
    let angles: Vec<f64> = (0..300).map(|index| 0.02 * f64::from(index)).collect();
    let swing =
        |order: f64| angles.iter().map(|angle| 0.3 * (order * angle + 0.4).sin()).collect::<Vec<f64>>();
    let (order, amplitude) = strongest_wave(&angles, &swing(6.0)).unwrap();
    assert!(order == 6 && (amplitude - 0.3).abs() < 1e-9, "{order} {amplitude}");
    let narrow: Vec<f64> = angles.iter().map(|angle| 0.1 * angle).collect();
    let slow: Vec<f64> = narrow.iter().map(|angle| (2.0 * angle).sin()).collect();
    assert_eq!(strongest_wave(&narrow, &slow), None, "a fifth of a period within the poses");
    assert_eq!(strongest_wave(&angles, &noise(300, 9)), None);
}

#[test]
fn only_angles_are_asked_for_waves() {
    let at: Vec<f64> = (0..300).map(|index| 0.02 * f64::from(index)).collect();
    let swing: Vec<f64> = at.iter().map(|at| (6.0 * at).sin()).collect();
    let find = Find { covariate: 0, component: 0, strength: 1.0 };
    let as_angle = describe(&sheet(at.clone(), swing.clone(), true), find).unwrap();
    let is_wave = |found: &Description| match found {
        Description::Trend(trend) => matches!(trend.shape, ResidualShape::Periodic { order: 6, .. }),
        _ => false,
    };
    assert!(is_wave(&as_angle), "{as_angle:?}");
    let as_load = describe(&sheet(at, swing, false), find).unwrap();
    assert!(!is_wave(&as_load), "{as_load:?}");
}

#[test]
fn squares_between_levels_and_within_them_add_up() {
    // Means 2 and 6 about 4, two of each: 16 between; 1 and 3, 5 and 7: 4 within.
    assert_eq!(explained(&[1.0, 3.0, 5.0, 7.0], &[0, 0, 1, 1], &[0, 1, 2, 3]), (16.0, 4.0, 2));
    // In another order every level has the same mean.
    assert_eq!(explained(&[1.0, 3.0, 5.0, 7.0], &[0, 0, 1, 1], &[0, 3, 1, 2]), (0.0, 20.0, 2));
}

#[test]
fn categories_are_described_by_the_means_of_their_own_rows_and_those_without_any_are_left_out() {
    let covariate = Covariate {
        name: "fixture".to_owned(),
        unit: "",
        turns: false,
        values: vec![0.0, 2.0, 0.0, 2.0, 2.0],
        categories: ["left", "right", "rear"].map(str::to_owned).to_vec(),
    };
    let component = Component {
        name: "along x".to_owned(),
        unit: ReadingUnit::Mm,
        values: vec![1.0, 4.0, 2.0, 5.0, 9.0],
    };
    let found = category_means(&covariate, &component);
    assert_eq!((found.along.as_str(), found.against.as_str()), ("along x", "fixture"));
    assert_eq!(found.means, [("left".to_owned(), 1.5), ("rear".to_owned(), 6.0)]);
}

#[test]
fn the_strength_of_a_covariate_is_that_of_its_f_test_by_the_component_it_explains_best() {
    // 16 between two levels and 4 within of four rows: F = 16 / 2 with 1 and 2 degrees. p = 1 - sqrt(F / (F + 2)).
    let mut sheet = sheet(vec![0.0, 0.0, 1.0, 1.0], vec![1.0, 3.0, 5.0, 7.0], false);
    sheet.components.push(Component {
        name: "along y".to_owned(),
        unit: ReadingUnit::Mm,
        values: vec![1.0, 7.0, 3.0, 5.0],
    });
    let of = |levels: &[Vec<usize>]| strongest(&sheet, levels, &[0, 1, 2, 3]);
    let found = of(&[vec![0, 0, 1, 1]]);
    let expected = -(1.0 - (8.0_f64 / 10.0).sqrt()).ln();
    assert!((found[0].strength - expected).abs() < 1e-9, "{} {expected}", found[0].strength);
    assert_eq!((found.len(), found[0].covariate, found[0].component), (1, 0, 0));
    // A single level has nothing between, as many levels as rows nothing within.
    let found = of(&[vec![0; 4], vec![0, 1, 2, 3], vec![0, 1, 1, 0]]);
    assert_eq!(found.iter().map(|find| find.covariate).collect::<Vec<_>>(), [2]);
    assert_eq!(found[0].component, 1, "3, 5 and 1, 7 have the same mean, but not along x");
}

#[test]
fn what_a_row_has_left_is_a_vector_weighed_as_in_the_fit() {
    let lab = crate::testing::two_links(6, "", 0.05, 31, |_| [0.0; 2]);
    let mut fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
    fitted.fit.weights[2] = 0.25;
    let own = &fitted.fit.residuals[fitted.problem.observations.range(2)];
    let expected = Vector3::new(own[0], own[1], own[2]) * 0.25;
    assert!(expected.norm() > 0.0 && (vector(&fitted, 2).unwrap() - expected).norm() < 1e-15);
}

#[test]
fn sessions_and_columns_of_words_are_categories_unless_there_are_one_or_too_many() {
    let lab = crate::testing::two_links(6, "", 0.05, 31, |_| [0.0; 2]);
    let with_sessions = |sessions: usize| {
        let lab = crate::testing::with_table(&lab, |table| {
            table.session.names = (0..sessions).map(|one| format!("s{one}")).collect();
            table.session.of_row = (0..6).map(|row| (row != 3).then_some(u32::from(row > 3))).collect();
        });
        categorical(lab.table(), &[0, 3, 5])
    };
    let two = with_sessions(2);
    assert_eq!((two.len(), two[0].name.as_str(), two[0].turns), (1, "session", false));
    assert!(two[0].values[0] == 0.0 && two[0].values[1].is_nan() && two[0].values[2] == 1.0);
    assert_eq!(two[0].categories, ["s0", "s1"]);
    assert!(
        with_sessions(1).is_empty()
            && with_sessions(MOST_LEVELS).len() == 1
            && with_sessions(MOST_LEVELS + 1).is_empty()
    );
}

#[test]
fn of_readings_without_a_direction_what_was_read_is_looked_at_as_the_fit_weighs_it() {
    let lab = crate::testing::by_wire(12, 0.0, 5, |row| if row == 3 { 0.4 } else { 0.1 });
    let lab = lab.with_model(plumb_calibration::arm_model::Model { free: Vec::new(), ..lab.model().clone() });
    let mut fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
    fitted.fit.weights = vec![1.0; 12];
    fitted.fit.weights[3] = 0.5;
    assert!(vector(&fitted, 0).is_none());
    let left: Vec<f64> = [0, 3].map(|row| first_reading(&fitted, row)).to_vec();
    assert!((left[0].abs() - 0.1).abs() < 1e-6 && (left[1] / left[0] - 2.0).abs() < 1e-6, "{left:?}");
    let found = components(&fitted, &[vec![0, 1], vec![3]]);
    assert_eq!((found.len(), found[0].name.as_str()), (1, "in what was read"));
    assert!((found[0].values[0] - left[0]).abs() < 1e-6 && (found[0].values[1] - left[1]).abs() < 1e-9);
}

#[test]
fn a_level_has_the_means_of_its_places_and_of_its_values() {
    let means = level_means(&[3.0, 1.0, 3.0, 2.0, 3.0], &[1.0, 5.0, 2.0, -4.0, 6.0]);
    let found: Vec<(f64, f64, f64)> = means.iter().map(|one| (one.at, one.mean, one.count)).collect();
    assert_eq!(found, [(1.0, 5.0, 1.0), (2.0, -4.0, 1.0), (3.0, 3.0, 3.0)]);
}

#[test]
fn a_wave_alone_explains_all_squares_and_has_its_amplitude() {
    let angles: [f64; 6] = [0.1, 0.5, 1.3, 2.0, 2.2, 3.9];
    for order in [1, 2, 5] {
        let values = angles.map(|angle| {
            let (sine, cosine) = (f64::from(order) * angle).sin_cos();
            3.0 * sine - 2.0 * cosine
        });
        let (squares, amplitude) = wave(order, &angles, &values).unwrap();
        let all: f64 = values.iter().map(|value| value * value).sum();
        assert!((squares - all).abs() < 1e-9 && (amplitude - 13.0_f64.sqrt()).abs() < 1e-9, "{order}");
    }
    assert_eq!(wave(1, &[0.7; 3], &[1.0, 2.0, 3.0]), None, "sine and cosine do not differ over one angle");
}

#[test]
fn only_what_is_known_everywhere_and_varies_is_a_covariate() {
    let one = |values: &[f64]| sheet(values.to_vec(), Vec::new(), false).covariates.remove(0);
    let kept = varying(vec![
        one(&[5.0, 5.0, 5.0]),
        one(&[5.0, 5.0, 5.1]),
        one(&[5.0, f64::NAN, 6.0]),
        one(&[-3.0, -3.0, -3.0 + 1e-10]),
        one(&[]),
    ]);
    assert_eq!(kept.len(), 1);
    assert_eq!(kept[0].values, [5.0, 5.0, 5.1]);
}
