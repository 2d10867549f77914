//! Fits of made-up measurements whose truth and noise are known.

mod parts;
mod places;
mod response;

use plumb_estimation::{Progress, Random};

use super::*;
use crate::arm_model::{AddedEffect, Model};
use crate::effect::parse;
use crate::measurement::Observations;
use crate::table::Table;

/// A planar arm of two links (Spong, Hutchinson and Vidyasagar 2006, section 3.3).
const PLANAR: &str = "
arm: planar
convention: distal
joints:
  - {name: shoulder, a_mm: 400}
  - {name: elbow, a_mm: 300}
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
";

/// What the arm really is: zero of the elbow, rad, and excess length of the first link, mm.
const TRUTH: [f64; 2] = [0.004, 1.25];

/// Measurements of the arm as it really is, with noise of `sigma` mm an axis.
fn measured(rows: usize, sigma: f64, seed: u64) -> Table {
    let mut random = Random::seeded(seed);
    let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for _ in 0..rows {
        let (one, other) = (-90.0 + 180.0 * random.uniform(), -120.0 + 240.0 * random.uniform());
        let (first, second) = (one.to_radians(), (one + other).to_radians() + TRUTH[0]);
        let x = (400.0 + TRUTH[1]) * first.cos() + 300.0 * second.cos() + sigma * random.normal();
        let y = (400.0 + TRUTH[1]) * first.sin() + 300.0 * second.sin() + sigma * random.normal();
        let z = sigma * random.normal();
        text.push_str(&format!("{one},{other},{x},{y},{z}\n"));
    }
    Table::parse("made.csv", &text).unwrap()
}

/// Fits these effects to a table; `noise` is the model file's line about it.
fn fitted(table: &Table, noise: &str, effects: &[&str]) -> Result<Fit, FitError> {
    let model = Model::parse("planar.yaml", &format!("{PLANAR}{noise}")).unwrap();
    let observations = Observations::new(&model, table).unwrap();
    let added = |text: &&str| AddedEffect { id: parse(text, &model).unwrap(), values: Vec::new() };
    let effects: Vec<AddedEffect> = effects.iter().map(added).collect();
    let problem = ResidualModel::new(&model, table, &observations, &effects).unwrap();
    problem.fit(&problem.start(), &vec![true; table.len()], FitOptions::default(), &Progress::default())
}

#[test]
fn the_normal_equations_of_a_fit_are_those_of_its_state_and_weights() {
    let model = Model::parse("planar.yaml", PLANAR).unwrap();
    for seed in 1..7 {
        let table = measured(40, 0.2, seed);
        let observations = Observations::new(&model, &table).unwrap();
        let effects = BOTH.map(|text| AddedEffect { id: parse(text, &model).unwrap(), values: Vec::new() });
        let problem = ResidualModel::new(&model, &table, &observations, &effects).unwrap();
        let all = vec![true; table.len()];
        let fit = problem.fit(&problem.start(), &all, FitOptions::default(), &Progress::default()).unwrap();
        assert!(fit.weights.iter().any(|weight| *weight < 0.99), "a far row counts less");
        let anew = problem.normal_of_rows(&fit.state, &fit.rows, &fit.weights);
        // Rows are left out by taking theirs out of the sum: any difference is then an error of what the others say.
        let difference = (&fit.normal.matrix - &anew.matrix).norm() / anew.matrix.norm();
        assert!(difference < 1e-12, "{seed}: {difference}");
    }
}

const BOTH: [&str; 2] = ["joint_zero(elbow)", "link_length(shoulder)"];

#[test]
fn the_truth_is_found_exactly_without_noise() {
    let fit = fitted(&measured(20, 0.0, 1), "", &BOTH).unwrap();
    assert!((fit.state.effects[0][0] - TRUTH[0]).abs() < 1e-9, "{:?}", fit.state.effects);
    assert!((fit.state.effects[1][0] - TRUTH[1]).abs() < 1e-6, "{:?}", fit.state.effects);
    assert!(fit.convergence.arrived && fit.gauges.is_empty());
}

#[test]
fn standard_errors_are_those_with_which_the_estimates_scatter() {
    // The model declares no noise, or a wrong one: the errors have to come from the residuals.
    for (noise, sigma) in [("", 0.05), ("noise: {p1_mm: 1}\n", 0.05)] {
        let mut squares = [0.0; 2];
        let runs = 60;
        for seed in 0..runs {
            let fit = fitted(&measured(30, sigma, 100 + seed), noise, &BOTH).unwrap();
            for (parameter, square) in squares.iter_mut().enumerate() {
                let off = fit.state.effects[parameter][0] - TRUTH[parameter];
                *square += off * off / fit.covariance[(parameter, parameter)];
            }
        }
        // The mean of 60 squares of a standard normal has a standard deviation of sqrt(2 / 60) = 0.18.
        for square in squares {
            let mean = square / f64::from(runs as u32);
            assert!((0.5..1.6).contains(&mean), "{noise:?}: {mean}");
        }
    }
}

#[test]
fn an_outlier_is_weighed_down_and_hardly_moves_the_estimate() {
    let mut table = measured(30, 0.05, 7);
    table.positions[0].xyz[4][0] += 40.0;
    let fit = fitted(&table, "", &BOTH).unwrap();
    assert!(fit.weights[4] < 0.01, "{}", fit.weights[4]);
    let sound = fit.weights.iter().enumerate().filter(|(row, _)| *row != 4);
    assert!(sound.clone().filter(|(_, weight)| **weight > 0.5).count() >= 27);
    assert!((fit.state.effects[1][0] - TRUTH[1]).abs() < 0.1, "{:?}", fit.state.effects);
}

#[test]
fn of_two_numbers_that_move_the_readings_alike_one_is_held_and_named_with_the_other() {
    // The joints' axes are parallel: shifts along them add up.
    let fit = fitted(&measured(20, 0.05, 3), "", &["link_offset(shoulder)", "link_offset(elbow)"]).unwrap();
    assert_eq!(fit.gauges.len(), 1, "{:?}", fit.gauges);
    let gauge = &fit.gauges[0];
    let mut both = vec![gauge.held.clone()];
    both.extend(gauge.same_as.clone());
    both.sort();
    assert_eq!(both, ["link_offset(elbow)", "link_offset(shoulder)"]);
    let held = usize::from(gauge.held.contains("elbow"));
    assert_eq!(fit.state.effects[held], [0.0], "it is left where it was");
    assert_eq!(fit.covariance[(held, held)], 0.0);
}

#[test]
fn a_number_that_changes_nothing_is_held_and_is_like_no_other() {
    // Warmth shows only where the table says how warm it was.
    let fit = fitted(&measured(20, 0.05, 4), "", &["joint_zero(elbow)", "thermal_growth(elbow)"]).unwrap();
    assert_eq!(fit.gauges, [Gauge { held: "thermal_growth(elbow)".to_owned(), same_as: Vec::new() }]);
}

#[test]
fn names_of_free_numbers_say_what_they_are() {
    let text = PLANAR.replace("free: false", "free: true");
    let model = Model::parse("planar.yaml", &text).unwrap();
    let table = measured(3, 0.0, 5);
    let observations = Observations::new(&model, &table).unwrap();
    let harmonic = AddedEffect { id: parse("joint_harmonic(elbow, 2)", &model).unwrap(), values: Vec::new() };
    let problem = ResidualModel::new(&model, &table, &observations, &[harmonic]).unwrap();
    let names: Vec<String> = problem
        .free_parameters()
        .iter()
        .map(|free_parameter| problem.parameter_name(*free_parameter))
        .collect();
    let expected = [
        "base x",
        "base y",
        "base z",
        "base rotation about x",
        "base rotation about y",
        "base rotation about z",
        "p1 x",
        "p1 y",
        "p1 z",
        "joint_harmonic(elbow, 2) sine_deg",
        "joint_harmonic(elbow, 2) cosine_deg",
    ];
    assert_eq!(names, expected);
}

#[test]
fn too_few_measurements_are_refused_in_words() {
    let message = |rows: usize, effects: &[&str]| {
        fitted(&measured(rows, 0.05, 6), "", effects).err().unwrap().to_string()
    };
    let many = ["joint_zero(elbow)", "joint_zero(shoulder)", "link_length(elbow)", "link_length(shoulder)"];
    assert!(message(1, &many).contains("measure more"), "{}", message(1, &many));
    let model = Model::parse("planar.yaml", PLANAR).unwrap();
    let table = measured(4, 0.05, 6);
    let observations = Observations::new(&model, &table).unwrap();
    let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    let nothing = problem.fit(&problem.start(), &[false; 4], FitOptions::default(), &Progress::default());
    assert!(matches!(nothing, Err(FitError::NoRows { .. })), "{:?}", nothing.err());
}

#[test]
fn rows_that_are_held_out_do_not_move_the_fit() {
    let mut table = measured(20, 0.0, 8);
    table.positions[0].xyz[3] = [0.0; 3];
    let model = Model::parse("planar.yaml", PLANAR).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let effects: Vec<AddedEffect> = BOTH
        .iter()
        .map(|text| AddedEffect { id: parse(text, &model).unwrap(), values: Vec::new() })
        .collect();
    let problem = ResidualModel::new(&model, &table, &observations, &effects).unwrap();
    let mask: Vec<bool> = (0..20).map(|row| row != 3).collect();
    let plain = FitOptions { robust: false, ..FitOptions::default() };
    let fit = problem.fit(&problem.start(), &mask, plain, &Progress::default()).unwrap();
    assert!((fit.state.effects[1][0] - TRUTH[1]).abs() < 1e-6, "{:?}", fit.state.effects);
    assert_eq!(fit.rows.len(), 19);
    assert!(fit.residuals[9].abs() > 10.0, "its residual is reported all the same");
}

/// Poses of the planar arm in which the elbow hardly moves: its length cannot be distinguished from the first link's.
fn narrow(zero_deg: f64, sigma: f64, seed: u64) -> Table {
    within(0.2, zero_deg, sigma, seed)
}

/// Poses in which the elbow moves within so many degrees.
fn within(range_deg: f64, zero_deg: f64, sigma: f64, seed: u64) -> Table {
    let mut random = Random::seeded(seed);
    let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for _ in 0..20 {
        let (one, other) = (-90.0 + 180.0 * random.uniform(), 40.0 + range_deg * random.uniform());
        let (first, second) = (one.to_radians(), (one + other + zero_deg).to_radians());
        let x = 400.0 * first.cos() + 300.0 * second.cos() + sigma * random.normal();
        let y = 400.0 * first.sin() + 300.0 * second.sin() + sigma * random.normal();
        text.push_str(&format!("{one},{other},{x},{y},{}\n", sigma * random.normal()));
    }
    Table::parse("narrow.csv", &text).unwrap()
}

#[test]
fn numbers_that_the_rows_hardly_determine_stay_in_their_ranges_and_are_reported() {
    let effects = ["joint_zero(elbow)", "link_length(shoulder)", "link_length(elbow)"];
    for seed in 0..10 {
        let fit = fitted(&narrow(0.0, 1.0, seed), "", &effects).unwrap();
        let values: Vec<f64> = fit.state.effects.iter().flatten().copied().collect();
        assert!(values[0].abs() < 0.35 && values[1].abs() < 20.0 && values[2].abs() < 20.0, "{values:?}");
        let message: Vec<String> = fit.doubts.iter().map(ToString::to_string).collect();
        assert!(
            message.len() == 1
                && message[0].contains("hardly determine")
                && message[0].contains("joint_zero(elbow)"),
            "{message:?}"
        );
        assert!(
            message[0].contains("plausible ranges were used as prior knowledge; measure more poses"),
            "{message:?}"
        );
        // What the rows do determine is as good as ever.
        assert!(fit.scale < 1.3, "{}", fit.scale);
    }
}

/// A planar arm whose elbow's axis is tilted by a third of a milliradian against the shoulder's, and sits `offset` mm farther along it: next to nothing distinguishes that from an offset
/// of the shoulder.
fn nearly_parallel(offset: f64, seed: u64) -> Table {
    let tilt: f64 = 0.02_f64.to_radians();
    let mut random = Random::seeded(seed);
    let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for _ in 0..40 {
        let (one, two) = (-90.0 + 180.0 * random.uniform(), -90.0 + 180.0 * random.uniform());
        let (sine, cosine) = one.to_radians().sin_cos();
        // In the shoulder's frame the elbow turns about an axis that is tilted about x.
        let (reach_sine, reach_cosine) = two.to_radians().sin_cos();
        let local = [
            400.0 + 300.0 * reach_cosine,
            300.0 * reach_sine * tilt.cos() - offset * tilt.sin(),
            300.0 * reach_sine * tilt.sin() + offset * tilt.cos(),
        ];
        let point = [local[0] * cosine - local[1] * sine, local[0] * sine + local[1] * cosine, local[2]];
        let read = point.map(|value| (value + 0.002 * random.normal()).to_string());
        text.push_str(&format!("{one},{two},{}\n", read.join(",")));
    }
    Table::parse("parallel.csv", &text).unwrap()
}

/// The offsets of shoulder and elbow, mm, that a fit finds which does not move those in `holding`, and those it held to the end.
fn offsets(table: &Table, holding: &[FreeParameter]) -> ((f64, f64), Vec<FreeParameter>) {
    let arm = PLANAR.replace("name: shoulder, a_mm: 400", "name: shoulder, a_mm: 400, alpha_deg: 0.02");
    let model = Model::parse("planar.yaml", &arm).unwrap();
    let observations = Observations::new(&model, table).unwrap();
    let added = |text: &str| AddedEffect { id: parse(text, &model).unwrap(), values: Vec::new() };
    let effects = ["link_offset(shoulder)", "link_offset(elbow)"].map(added);
    let problem = ResidualModel::new(&model, table, &observations, &effects).unwrap();
    let free = problem.free_parameters();
    let holding: Vec<usize> = (0..free.len()).filter(|number| holding.contains(&free[*number])).collect();
    let (rows, ones): (Vec<usize>, Vec<f64>) = ((0..table.len()).collect(), vec![1.0; table.len()]);
    let (start, options) = (problem.start(), FitOptions::default());
    let fit = match holding.is_empty() {
        true => problem.fit(&start, &vec![true; table.len()], options, &Progress::default()),
        false => problem.refit_holding(&start, (&rows, &ones), &holding, options, &Progress::default()),
    }
    .unwrap();
    let held = fit.held.iter().map(|number| free[*number]).collect();
    ((fit.state.effects[0][0], fit.state.effects[1][0]), held)
}

#[test]
fn offsets_along_nearly_parallel_axes_stay_until_they_help() {
    // The elbow's offset is known to 1.3 mm: what noise promises moves nothing, 15 mm are found.
    let of_elbow = FreeParameter::Effect(1, 0);
    let found: Vec<_> = (0..10).map(|seed| offsets(&nearly_parallel(0.0, seed), &[])).collect();
    let stayed = found.iter().filter(|((_, elbow), _)| *elbow == 0.0).count();
    assert!(stayed >= 7, "held in {stayed} of 10");
    assert!(found.iter().all(|((_, elbow), held)| held.contains(&of_elbow) == (*elbow == 0.0)), "{found:?}");
    for seed in 0..10 {
        let ((shoulder, elbow), held) = offsets(&nearly_parallel(15.0, seed), &[]);
        assert!((elbow - 15.0).abs() < 5.2 && (shoulder + elbow - 15.0).abs() < 0.005, "{shoulder} {elbow}");
        assert!(!held.contains(&of_elbow));
    }
}

#[test]
fn what_a_refit_is_to_hold_stays_though_the_rows_show_it() {
    let [of_shoulder, of_elbow] = [0, 1].map(|effect| FreeParameter::Effect(effect, 0));
    for seed in 0..3 {
        let table = nearly_parallel(15.0, seed);
        let ((shoulder, elbow), held) = offsets(&table, &[of_elbow]);
        assert!(elbow == 0.0 && (shoulder - 15.0).abs() < 0.005, "{shoulder} {elbow}");
        assert!(held.contains(&of_elbow) && !held.contains(&of_shoulder));
    }
}

#[test]
fn ranges_are_weighed_anew_only_where_the_scatter_is_another() {
    let prior = super::doubt::Prior { variance: 4.0, spared: Vec::new() };
    for (scale, same) in [(2.0, true), (1.93, true), (2.08, true), (1.8, false), (2.2, false), (0.0, false)] {
        assert_eq!(prior.is_weighed_as_by(scale), same, "{scale}");
    }
    assert!(super::doubt::Prior { variance: 0.0, ..prior }.is_weighed_as_by(0.0), "without any scatter");
}

#[test]
fn a_sound_fit_knows_nothing_of_ranges() {
    let fit = fitted(&measured(20, 0.05, 9), "", &BOTH).unwrap();
    assert!(fit.doubts.is_empty(), "{:?}", fit.doubts);
}

#[test]
fn a_number_that_no_machine_has_is_reported_where_the_rows_determine_it() {
    let mut table = measured(30, 0.05, 11);
    // The elbow's zero is 40 deg off: the model file's row is wrong.
    for row in table.q.chunks_mut(2) {
        row[1] -= 40_f64.to_radians();
    }
    let fit = fitted(&table, "", &["joint_zero(elbow)"]).unwrap();
    assert!(
        (fit.state.effects[0][0] - 40_f64.to_radians() - TRUTH[0]).abs() < 1e-3,
        "{:?}",
        fit.state.effects
    );
    let message = fit.doubts.iter().map(ToString::to_string).collect::<String>();
    assert!(
        message.contains("no machine has: joint_zero(elbow) (40.2") && message.contains("units and signs"),
        "{message}"
    );
}

#[test]
fn a_robust_fit_that_misses_the_rows_it_trusts_by_more_than_the_plain_one_is_not_used() {
    use super::doubt::worse_than_plain;
    let table = measured(20, 0.05, 12);
    let model = Model::parse("planar.yaml", PLANAR).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let effects = [AddedEffect { id: parse("joint_zero(elbow)", &model).unwrap(), values: Vec::new() }];
    let problem = ResidualModel::new(&model, &table, &observations, &effects).unwrap();
    let rows: Vec<usize> = (0..20).collect();
    let state = |zero: f64| State { effects: vec![vec![zero]], ..problem.start() };
    let mut weights = vec![1.0; 20];
    weights[3] = 0.2;
    let doubt = worse_than_plain(&problem, (&state(0.2), &weights), &state(0.0), &rows).unwrap();
    assert!(doubt.to_string().contains("the robust fit ran away"), "{doubt}");
    assert!(worse_than_plain(&problem, (&state(0.004), &weights), &state(0.0), &rows).is_none());
    assert!(worse_than_plain(&problem, (&state(f64::NAN), &weights), &state(0.0), &rows).is_some());
}

#[test]
fn a_refit_from_near_does_not_spend_its_steps_on_taking_the_damping_away() {
    // Within three degrees of the elbow the lengths and the zero are nearly alike: only steps that are hardly damped get along between them.
    let table = within(3.0, 0.0, 0.01, 3);
    let model = Model::parse("planar.yaml", PLANAR).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let added = |text: &str| AddedEffect { id: parse(text, &model).unwrap(), values: Vec::new() };
    let effects = ["joint_zero(elbow)", "link_length(shoulder)", "link_length(elbow)"].map(added);
    let problem = ResidualModel::new(&model, &table, &observations, &effects).unwrap();
    let (rows, ones): (Vec<usize>, Vec<f64>) = ((0..20).collect(), vec![1.0; 20]);
    let plain = FitOptions { robust: false, ..FitOptions::default() };
    let near = State { effects: vec![vec![0.002], vec![0.3], vec![-0.2]], ..problem.start() };
    let fit = problem.refit(&near, &rows, &ones, plain, &Progress::default()).unwrap();
    assert!(fit.convergence.arrived && fit.convergence.steps <= 3, "{:?}", fit.convergence);
}

/// Asks about measurements of which three are 5 mm off, with all rows and weights of one.
fn with_three_outliers(ask: impl FnOnce(&ResidualModel<'_>, &[usize], &[f64])) {
    let mut table = measured(60, 0.05, 13);
    for row in [4, 17, 40] {
        table.positions[0].xyz[row][1] += 5.0;
    }
    let model = Model::parse("planar.yaml", PLANAR).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let added = |text: &str| AddedEffect { id: parse(text, &model).unwrap(), values: Vec::new() };
    let problem = ResidualModel::new(&model, &table, &observations, &BOTH.map(added)).unwrap();
    ask(&problem, &(0..60).collect::<Vec<usize>>(), &[1.0; 60]);
}

#[test]
fn one_robust_step_from_near_is_the_whole_fit_and_without_scatter_a_whole_fit_is_made() {
    with_three_outliers(|problem, rows, ones| {
        let near = State { effects: vec![vec![0.003], vec![1.0]], ..problem.start() };
        let whole = problem.refit(&near, rows, ones, FitOptions::default(), &Progress::default()).unwrap();
        let one = super::outcome::one_step(problem, &near, rows, ones.to_vec()).unwrap().unwrap();
        assert_eq!(one.convergence.steps, 1);
        for (index, (one_step, descent)) in one.state.effects.iter().zip(&whole.state.effects).enumerate() {
            let error = whole.covariance[(index, index)].sqrt();
            assert!((one_step[0] - descent[0]).abs() < 0.05 * error, "{one_step:?} {descent:?} +- {error}");
        }
        assert!((one.scale / whole.scale - 1.0).abs() < 0.01 && one.weights[17] < 0.1);
        // As many numbers as equations leave no scatter to weigh rows by.
        assert!(super::outcome::one_step(problem, &near, &[], ones.to_vec()).unwrap().is_none());
        let whole = problem.refit_by_one_step(&near, &[], ones, FitOptions::default(), &Progress::default());
        assert!(
            matches!(whole, Err(FitError::TooFewRows { equations: 0, .. })),
            "a whole fit says what is wrong"
        );
    });
}

#[test]
fn more_steps_follow_one_from_which_another_promises_much() {
    with_three_outliers(|problem, rows, ones| {
        let from = |zero: f64| {
            let start = State { effects: vec![vec![zero], vec![1.0]], ..problem.start() };
            let one = super::outcome::one_step(problem, &start, rows, ones.to_vec()).unwrap().unwrap();
            let options = FitOptions::default();
            let made = problem.refit_by_one_step(&start, rows, ones, options, &Progress::default()).unwrap();
            (one, made)
        };
        let (near, made) = from(0.003);
        assert_eq!((near.convergence.steps, made.convergence.steps), (1, 1));
        // From 0.3 rad away the step is a good one, but a circle is no tangent: millimetres are left, in which 5 mm are nothing unusual.
        let (far, made) = from(0.3);
        let [scattered, settled] = [&far, &made].map(|fit| (fit.scale / near.scale, fit.weights[17]));
        assert!(scattered.0 > 10.0 && scattered.1 > 0.9, "{scattered:?}");
        assert!((settled.0 - 1.0).abs() < 0.01 && settled.1 < 0.1, "{settled:?}");
        assert!(!far.convergence.is_near() && made.convergence.is_near());
    });
}

#[test]
fn one_step_that_leaves_more_than_staying_is_refused_and_a_whole_fit_is_made() {
    let model = Model::parse("planar.yaml", PLANAR).unwrap();
    let added = |text: &str| AddedEffect { id: parse(text, &model).unwrap(), values: Vec::new() };
    // The elbow hardly bends, and what was measured is that of other poses: the tangent asks for turns of many times round.
    let mut table = measured(60, 0.05, 13);
    (0..60).for_each(|row| table.q[2 * row + 1] = 0.03 * (row % 3) as f64);
    let observations = Observations::new(&model, &table).unwrap();
    let effects = ["joint_zero(shoulder)", "joint_zero(elbow)"].map(added);
    let problem = ResidualModel::new(&model, &table, &observations, &effects).unwrap();
    let (start, rows, ones) = (problem.start(), (0..60).collect::<Vec<usize>>(), vec![1.0; 60]);
    assert!(super::outcome::one_step(&problem, &start, &rows, ones.clone()).unwrap().is_none());
    let options = FitOptions::default();
    let whole = problem.refit(&start, &rows, &ones, options, &Progress::default()).unwrap();
    let made = problem.refit_by_one_step(&start, &rows, &ones, options, &Progress::default()).unwrap();
    assert_eq!(made.state.effects, whole.state.effects);
    let squares = |state: &State| problem.normal(state, &rows, &made.weights, &[]).squares;
    assert!(made.convergence.steps > 1 && squares(&whole.state) < squares(&start));
}
