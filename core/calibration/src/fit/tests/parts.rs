//! The pieces of a fit, each against numbers worked out by hand.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3, dmatrix};
use plumb_estimation::{NormalEquations, Problem as _, Progress, RankRevealingCholesky};

use crate::arm_model::{AddedEffect, Epochs, Model, SurfaceShape};
use crate::effect::{EffectId, Site, build, parse};
use crate::fit::arm_pose::ArmPose;
use crate::fit::doubt::{Prior, out_of_range, range_doubts, undetermined};
use crate::fit::outcome::kept;
use crate::fit::tangent::Tangent;
use crate::fit::{
    Distances, FitDoubt, FitError, FitOptions, FreeParameter, ResidualModel, State, ViewOfTable,
};
use crate::measurement::Observations;
use crate::table::Table;

const PLANAR: &str = "
arm: planar
convention: distal
joints:
  - {name: shoulder, a_mm: 400}
  - {name: elbow, a_mm: 300}
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
";

const POINTS: &str =
    "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n0,0,700,0,0\n30,40,450,480,1\n60,-20,430,540,-1\n";

/// Shows a residual model of a model's text and a table's, with these effects.
fn with(model: &str, table: &str, effects: &[&str], look: impl FnOnce(&ResidualModel<'_>)) {
    let model = Model::parse("m.yaml", model).unwrap();
    let table = Table::parse("t.csv", table).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let added: Vec<AddedEffect> = effects
        .iter()
        .map(|text| AddedEffect { id: parse(text, &model).unwrap(), values: Vec::new() })
        .collect();
    look(&ResidualModel::new(&model, &table, &observations, &added).unwrap());
}

fn near(found: f64, expected: f64) -> bool {
    (found - expected).abs() < 1e-9 * (1.0 + expected.abs())
}

#[test]
fn the_scatter_of_rows_is_their_median_against_that_of_noise_and_pays_for_the_parameters() {
    // The median of chi squared is 0.454936 with one degree of freedom and 2.365974 with three.
    let (one, three) = (0.454_936_423_119_6_f64.sqrt(), 2.365_973_884_375_2_f64.sqrt());
    let of = |rows: Vec<(f64, usize)>, parameters: usize| {
        let all: Vec<usize> = (0..rows.len()).collect();
        Distances { rows }.scale(&all, parameters)
    };
    let close = |found: f64, expected: f64| (found - expected).abs() < 1e-6;
    assert!(close(of(vec![(one, 1); 10], 0), 1.0));
    assert!(close(of(vec![(2.0 * three, 3); 10], 0), 2.0));
    assert!(close(of([vec![(one, 1); 5], vec![(three, 3); 5]].concat(), 0), 1.0), "rows of both kinds");
    // Six of ten equations are spent: what is left is sqrt(10 / 4) of what scatters.
    assert!(close(of(vec![(one, 1); 10], 6), 2.5_f64.sqrt()));
    assert!(close(of([vec![(one, 1); 6], vec![(1e6, 1); 4]].concat(), 0), 1.0), "four of ten run away");
    assert!(close(of(vec![(5.0, 0); 3], 0), 1.0) && close(of(Vec::new(), 0), 1.0), "nothing was measured");
    assert!(
        close(Distances { rows: vec![(one, 1), (50.0, 1)] }.scale(&[0], 0), 1.0),
        "of the asked rows alone"
    );
}

#[test]
fn far_rows_pull_as_hard_as_one_at_the_edge_and_no_harder() {
    // Nine in ten of a normal lie within 1.644854 sigmas.
    let edge = 1.644_853_626_951_5;
    let weights =
        Distances { rows: vec![(0.0, 1), (0.99 * edge, 1), (1.01 * edge, 1), (10.0 * edge, 1)] }.weights(1.0);
    assert_eq!(weights[..2], [1.0, 1.0]);
    assert!((weights[2] - 1.0 / 1.01).abs() < 1e-9 && (weights[3] - 0.1).abs() < 1e-9, "{weights:?}");
    let wider = Distances { rows: vec![(2.0 * edge, 1)] };
    assert_eq!(wider.weights(2.001), [1.0]);
    assert!((wider.weights(1.0)[0] - 0.5).abs() < 1e-9);
    assert_eq!(Distances { rows: vec![(0.0, 1)] }.weights(0.0), [1.0], "a row without any error");
}

#[test]
fn distances_of_rows_are_in_their_own_sigmas() {
    with(&format!("{PLANAR}noise: {{p1_mm: 0.5}}\n"), POINTS, &[], |problem| {
        let mut residuals = vec![0.0; 9];
        residuals[3..6].copy_from_slice(&[3.0, 0.0, 4.0]);
        let rows = Distances::of(problem, &residuals).rows;
        assert_eq!(rows, [(0.0, 3), (10.0, 3), (0.0, 3)], "5 mm at a sigma of 0.5 mm");
    });
}

#[test]
fn a_step_moves_what_its_free_parameters_say() {
    let text = "
arm: all
convention: distal
joints: [{name: turn, a_mm: 100}]
base: {xyz_mm: [1, 2, 3], rpy_deg: [0, 0, 90], free: true}
targets: {p1: {xyz_mm: [4, 5, 6], rpy_deg: [0, 0, 90], free: true}}
surfaces: {ball: {sphere: {centre_mm: [1, 1, 1], radius_mm: 5}, free: true}}
board: {seen_by: p1}
";
    let model = Model::parse("m.yaml", text).unwrap();
    let start = State::nominal(&model, 1, vec![vec![0.5, 0.25]]);
    let free_parameters = [
        FreeParameter::BaseShift(0),
        FreeParameter::BaseRotation(2),
        FreeParameter::Target(0, 1),
        FreeParameter::TargetRotation(0, 0),
        FreeParameter::BoardShift(0, 2),
        FreeParameter::BoardRotation(0, 1),
        FreeParameter::Place(0, 2),
        FreeParameter::Surface(0, 1),
        FreeParameter::Effect(0, 1),
    ];
    let next = start.stepped(&free_parameters, &[10.0, 0.1, 20.0, 0.2, 30.0, 0.3, 40.0, 50.0, 60.0]);
    assert_eq!(next.base.translation.vector, Vector3::new(11.0, 2.0, 3.0), "a turn leaves the base's origin");
    let about = |axis: Vector3<f64>| Rotation3::new(axis);
    let apart = |one: &Rotation3<f64>, other: &Rotation3<f64>| (one.matrix() - other.matrix()).norm();
    assert!(apart(&next.base.rotation, &(about(0.1 * Vector3::z()) * start.base.rotation)) < 1e-12);
    assert_eq!(next.targets[0], Vector3::new(4.0, 25.0, 6.0));
    // A target turns about the flange's axes: on the left of how it sits there.
    assert!(apart(&next.rotations[0], &(about(0.2 * Vector3::x()) * start.rotations[0])) < 1e-12);
    assert_eq!(next.boards[0].translation.vector, Vector3::new(0.0, 0.0, 30.0));
    assert!(apart(&next.boards[0].rotation, &about(0.3 * Vector3::y())) < 1e-12);
    assert_eq!(next.places[0], Vector3::new(0.0, 0.0, 40.0));
    assert!(
        matches!(&next.surfaces[0], SurfaceShape::Sphere { centre, .. } if *centre == Vector3::new(1.0, 51.0, 1.0))
    );
    assert_eq!(next.effects, [[0.5, 60.25]]);
    assert_eq!(start.stepped(&free_parameters, &[0.0; 9]), start);
    // A free parameter of something that is not there moves nothing.
    assert_eq!(
        start.stepped(
            &[FreeParameter::Target(7, 0), FreeParameter::Effect(3, 0), FreeParameter::Surface(9, 0)],
            &[1.0; 3]
        ),
        start
    );
}

#[test]
fn a_state_with_one_number_that_is_not_finite_is_not() {
    let model = Model::parse("m.yaml", &format!("{PLANAR}board: {{seen_by: p1}}\n")).unwrap();
    let start = State::nominal(&model, 1, vec![vec![0.5]]);
    assert!(start.is_finite());
    let breaks: [fn(&mut State); 7] = [
        |state| state.targets[0].x = f64::NAN,
        |state| state.places[0].z = f64::INFINITY,
        |state| state.effects[0][0] = f64::NAN,
        |state| state.base.translation.vector.y = f64::NAN,
        |state| state.base.rotation = Rotation3::from_matrix_unchecked(Matrix3::repeat(f64::NAN)),
        |state| state.boards[0].translation.vector.y = f64::NAN,
        |state| state.rotations[0] = Rotation3::from_matrix_unchecked(Matrix3::repeat(f64::NAN)),
    ];
    for (index, spoil) in breaks.into_iter().enumerate() {
        let mut state = start.clone();
        spoil(&mut state);
        assert!(!state.is_finite(), "break {index}");
    }
}

#[test]
fn normal_equations_sum_weighted_squares_and_agree_with_residuals() {
    with(&format!("{PLANAR}noise: {{p1_mm: 0.5}}\n"), POINTS, &["joint_zero(elbow)"], |problem| {
        let (state, weights) = (problem.start(), [1.0, 0.25, 4.0]);
        let residuals = problem.residuals(&state);
        let of_row =
            |row: usize| residuals[3 * row..3 * row + 3].iter().map(|r| (r / 0.5).powi(2)).sum::<f64>();
        let expected = 0.25 * of_row(1) + 4.0 * of_row(2);
        assert!(near(problem.squares(&state, &[1, 2], &weights), expected));
        let normal = problem.normal(&state, &[1, 2], &weights, &[]);
        assert!(near(normal.squares, expected) && normal.equations == 6);
        let tangent = Tangent::at(problem, &state, &[1, 2], None).unwrap();
        assert!(near(tangent.squares(&weights), expected));
        let of_tangent = tangent.normal(&weights);
        assert!(near(of_tangent.squares, expected) && of_tangent.equations == 6);
        assert!(near(of_tangent.matrix[(0, 0)], normal.matrix[(0, 0)]));
        assert!(near(of_tangent.gradient[0], normal.gradient[0]));
        let alone = problem.normal_of_rows(&state, &[1, 2], &weights);
        assert!(near(alone.squares, expected) && near(alone.gradient[0], normal.gradient[0]));
        // The gradient is half the slope of the squares, downhill.
        let at =
            |by: f64| problem.squares(&state.stepped(problem.free_parameters(), &[by]), &[1, 2], &weights);
        let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
        assert!(
            (normal.gradient[0] + 0.5 * slope).abs() < 1e-4 * slope.abs(),
            "{} {slope}",
            normal.gradient[0]
        );
        // By the elbow's zero the tip moves 300 mm/rad whatever the pose: (300 / 0.5)^2 a unit of weight.
        assert!(near(normal.matrix[(0, 0)], (0.25 + 4.0) * 600.0 * 600.0));
    });
}

#[test]
fn a_probe_is_a_column_after_the_free_parameters_and_rates_are_of_effects_that_do_not_take_part() {
    with(PLANAR, POINTS, &["joint_zero(elbow)"], |problem| {
        let probe = build(&parse("joint_zero(shoulder)", problem.model).unwrap(), problem.model).unwrap();
        let gain = build(&parse("joint_gain(elbow)", problem.model).unwrap(), problem.model).unwrap();
        let state = problem.start();
        let (block, rates) =
            problem.block_and_rates(&state, &[0, 1], &[], &[probe.as_ref()], &[gain.as_ref()]);
        assert_eq!(block.jacobian.shape(), (2, 6));
        // Stretched out along x both turn the tip along y: by 300 mm and by 700 mm a radian.
        assert!(near(block.jacobian[(0, 1)], 300.0) && near(block.jacobian[(1, 1)], 700.0));
        assert_eq!(rates.shape(), (1, 2));
        assert!(near(rates[(0, 0)], 0.0) && near(rates[(0, 1)], 40_f64.to_radians()));
    });
}

#[test]
fn known_distances_between_places_are_equations_of_their_own() {
    let model =
        format!("{PLANAR}touch: {{distances: [{{between: [a, b], mm: 6}}]}}\nnoise: {{touch_mm: 0.5}}\n");
    let rows = "q1_deg,q2_deg,touch\n0,0,a\n30,40,b\n10,20,a\n";
    with(&model, rows, &[], |problem| {
        let mut state = problem.start();
        state.places = vec![Vector3::new(3.0, 0.0, 4.0), Vector3::zeros()];
        let mut total = NormalEquations::zeros(problem.free_parameters().len());
        problem.known_besides_rows(&state, &[0, 1], &mut total);
        // They are 5 mm apart and 6 mm is known to a tenth of the noise of touching, 0.05 mm: 1 mm is 20 sigmas.
        assert!(near(total.squares, 400.0) && total.equations == 1);
        let away = [0.6, 0.0, 0.8, -0.6, 0.0, -0.8].map(|part| part / 0.05);
        for (index, part) in away.iter().enumerate() {
            assert!(near(total.gradient[index], 20.0 * part), "{index}: {}", total.gradient);
            assert!(near(total.matrix[(index, index)], part * part));
        }
        state.places = vec![Vector3::zeros(); 2];
        let mut at_one = NormalEquations::zeros(problem.free_parameters().len());
        problem.known_besides_rows(&state, &[0, 1], &mut at_one);
        assert!(
            at_one.matrix.iter().all(|entry| entry.is_finite()),
            "places upon each other have some direction"
        );
        assert!(near(at_one.squares, 120.0 * 120.0));
        // Of the rows that are fitted none touched b, or none any place.
        for rows in [[0_usize, 2].as_slice(), &[]] {
            let mut alone = NormalEquations::zeros(problem.free_parameters().len());
            problem.known_besides_rows(&state, rows, &mut alone);
            assert_eq!((alone.squares, alone.equations, alone.matrix.norm()), (0.0, 0, 0.0));
        }
    });
}

#[test]
fn what_is_known_of_a_value_beforehand_is_an_observation_of_zero() {
    let model = format!(
        "{PLANAR}effects:\n  - {{effect: joint_gain, where: elbow, values: {{gain: 0.01}}, prior_sd: {{gain: 0.002}}}}\n"
    );
    let parsed = Model::parse("planar.yaml", &model).unwrap();
    let table = Table::parse("t.csv", "q1_deg,q2_deg,p1_x_mm\n0,10,1\n20,30,2\n").unwrap();
    let observations = Observations::new(&parsed, &table).unwrap();
    let problem = ResidualModel::new(&parsed, &table, &observations, &parsed.effects).unwrap();
    let state = problem.start();
    let mut known = NormalEquations::zeros(1);
    problem.known_besides_rows(&state, &[0, 1], &mut known);
    // The gain is five of its standard deviations from zero.
    assert!(near(known.squares, 25.0) && known.equations == 1);
    assert!(near(known.matrix[(0, 0)], 250_000.0) && near(known.gradient[0], -2500.0));
    let (all, ones) = ([0, 1], [1.0; 2]);
    let rows = problem.normal_of_rows(&state, &all, &ones);
    let total = problem.normal(&state, &all, &ones, &[]);
    assert!(near(total.squares - rows.squares, 25.0), "it is no row's, and counts in the sum");
    assert!(near(problem.squares(&state, &all, &ones), total.squares));
}

#[test]
fn a_place_that_no_fitted_row_touched_is_put_where_the_held_rows_say() {
    let rows = "q1_deg,q2_deg,touch\n0,0,a\n0,2,a\n90,0,b\n90,4,b\n";
    with(PLANAR, rows, &[], |problem| {
        let mut state = problem.start();
        state.places = vec![Vector3::new(700.0, 0.0, 0.0), Vector3::zeros()];
        let apart = problem.residuals_apart(&state, &[2, 3], &[0, 1]);
        assert!(apart[..6].iter().all(|residual| residual.is_nan()), "rows that are not held");
        // The two visits to b lie on a circle of 300 mm about (0, 400): 4 degrees apart, each half of it from their middle.
        let angle = 4_f64.to_radians();
        let between = Vector3::new(300.0 * angle.sin(), 300.0 * (1.0 - angle.cos()), 0.0).norm();
        let off = Vector3::from_column_slice(&apart[6..9]).norm();
        assert!(near(off, 0.5 * between), "{off} {between}");
        // A place that the fit knows stays where it is.
        let known = problem.residuals_apart(&state, &[1], &[0]);
        let tip =
            Vector3::new(400.0 + 300.0 * 2_f64.to_radians().cos(), 300.0 * 2_f64.to_radians().sin(), 0.0);
        let expected = tip - state.places[0];
        assert!((Vector3::from_column_slice(&known[3..6]) + expected).norm() < 1e-9);
    });
}

#[test]
fn plausible_ranges_are_observations_of_zero_with_two_sigmas_to_their_ends() {
    let effects = ["joint_zero(elbow)", "joint_gain(elbow)", "link_length(elbow)"];
    with(PLANAR, POINTS, &effects, |problem| {
        let mut state = problem.start();
        state.effects = vec![vec![0.1], vec![0.3], vec![4.0]];
        let mut normal = NormalEquations::zeros(3);
        let prior = Prior { variance: 0.04, spared: vec![2] };
        prior.add(problem, &state, &mut normal);
        // The zero's range ends at 0.35 rad: a sigma of 0.175. A gain is no number of the geometry, and the length is spared.
        let weight = 0.04 / (0.175 * 0.175);
        assert!(near(normal.matrix[(0, 0)], weight) && near(normal.gradient[0], -weight * 0.1));
        assert!(near(normal.squares, weight * 0.01));
        assert_eq!(
            (normal.matrix[(1, 1)], normal.matrix[(2, 2)], normal.gradient[1], normal.gradient[2]),
            (0.0, 0.0, 0.0, 0.0)
        );
        // The solver sees them with the rows, and without them where they do not count.
        let (rows, weights) = ([0, 1, 2], vec![1.0; 3]);
        let plain = problem.over(&rows, &weights).normal_equations(&state);
        let known = problem.over(&rows, &weights).knowing(Some(&prior)).normal_equations(&state);
        assert!(near(known.matrix[(0, 0)] - plain.matrix[(0, 0)], weight));
    });
}

#[test]
fn a_number_of_the_geometry_is_out_of_its_range_beyond_its_ends() {
    let effects = ["joint_zero(elbow)", "joint_gain(elbow)"];
    with(PLANAR, POINTS, &effects, |problem| {
        let out = |zero: f64, gain: f64| {
            let state = State { effects: vec![vec![zero], vec![gain]], ..problem.start() };
            out_of_range(problem, &state)
        };
        assert!(
            out(0.35, 0.0).is_empty() && out(-0.35, 9.0).is_empty(),
            "the ends belong to it; a gain is not asked"
        );
        assert_eq!(out(0.351, 0.0), [(0, 0.351)]);
        assert_eq!(out(-0.351, 0.0), [(0, -0.351)]);
        assert!(out(f64::NAN, 0.0).len() == 1, "not a number is in no range");
        let message = |zero: f64| {
            let state = State { effects: vec![vec![zero], vec![0.0]], ..problem.start() };
            let doubts = range_doubts(problem, &[(0, zero)], &state);
            doubts.iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        assert!(message(0.1)[0].contains("hardly determine joint_zero(elbow)"), "{:?}", message(0.1));
        assert!(
            message(0.5)[0]
                .contains("no machine has: joint_zero(elbow) (28.648 outside -20.054 to 20.054 deg)"),
            "{:?}",
            message(0.5)
        );
        // Ten ranges off a number means nothing.
        assert!(message(3.6)[0].contains("joint_zero(elbow) (far outside"), "{:?}", message(3.6));
        assert!(message(3.4)[0].contains("joint_zero(elbow) (194.8"), "{:?}", message(3.4));
    });
}

#[test]
fn a_number_is_undetermined_where_its_error_is_wider_than_its_range() {
    with(PLANAR, POINTS, &["joint_zero(elbow)"], |problem| {
        // Of a matrix of 4 the standard error is 0.5 for a scatter of 1; the range ends at 0.35.
        let factor = RankRevealingCholesky::new(&dmatrix![4.0]);
        assert!(undetermined(problem, &factor, 0.69).is_empty());
        assert_eq!(undetermined(problem, &factor, 0.71), [(0, 0.0)]);
    });
    with(PLANAR, POINTS, &["joint_gain(elbow)"], |problem| {
        let factor = RankRevealingCholesky::new(&dmatrix![1e-9]);
        assert!(
            undetermined(problem, &factor, 1e9).is_empty(),
            "what has no range of the geometry is not asked"
        );
    });
}

#[test]
fn messages_name_three_numbers_and_count_the_rest() {
    let names = |count: usize| (1..=count).map(|number| format!("n{number}")).collect::<Vec<_>>();
    assert!(FitDoubt::Bounded(names(3)).to_string().contains("hardly determine n1, n2, n3: left"));
    assert!(FitDoubt::Bounded(names(5)).to_string().contains("hardly determine n1, n2, n3, 2 more: left"));
    let worse = FitDoubt::WorseThanPlain { robust: 0.6, plain: 0.5 }.to_string();
    assert!(worse.contains("by 1.20 times as much as plain least squares"), "{worse}");
}

#[test]
fn free_parameters_are_called_by_what_they_move() {
    let model = format!(
        "{}surfaces: {{table: {{plane: {{normal: [0, 0, 1], offset_mm: 0}}, free: true}}}}\nboard: {{seen_by: p1, xyz_mm: [1, 2, 3], rpy_deg: [0, 0, 0], free: true}}\n",
        PLANAR.replace(
            "targets: {p1: {xyz_mm: [0, 0, 0], free: false}}",
            "targets: {p1: {xyz_mm: [0, 0, 0], free: true}}"
        )
    );
    let rows = "q1_deg,q2_deg,touch,board_x_mm\n0,0,nest,1\n30,40,nest,2\n";
    with(&model, rows, &["joint_zero(elbow)"], |problem| {
        let names: Vec<String> = problem
            .free_parameters()
            .iter()
            .map(|free_parameter| problem.parameter_name(*free_parameter))
            .collect();
        for name in [
            "p1 z",
            "p1 rotation about x",
            "board y",
            "board rotation about z",
            "nest x",
            "table (1)",
            "table (3)",
            "joint_zero(elbow)",
        ] {
            assert!(names.contains(&name.to_owned()), "{name} of {names:?}");
        }
        assert_eq!(names.len(), 3 + 3 + 6 + 3 + 3 + 1);
        assert_eq!(problem.parameter_name(FreeParameter::Effect(9, 0)), "?");
    });
}

#[test]
fn the_row_before_is_that_in_time_and_time_counts_from_the_first() {
    let rows = "q1_deg,q2_deg,p1_x_mm,time_s\n10,0,1,50\n20,0,1,30\n30,0,1,\n40,0,1,40\n";
    with(PLANAR, rows, &[], |problem| {
        assert_eq!(problem.first_time, 30.0);
        assert_eq!(problem.previous, [Some(3), None, Some(0), Some(1)], "a row without time comes last");
        let state = problem.start();
        let seen = |row: usize| {
            let pose = ArmPose::default();
            let sample = problem.sample(&state, row, &pose.link_frames, &[], None);
            (sample.time, sample.clock, sample.last_move(0).to_degrees().round())
        };
        assert_eq!(seen(0), (20.0, 50.0, -30.0));
        assert_eq!(seen(3), (10.0, 40.0, 20.0));
        assert_eq!([0, 1, 2].map(|row| problem.clock(row)), [Some(50.0), Some(30.0), None]);
    });
    with(PLANAR, POINTS, &[], |problem| {
        assert_eq!((problem.first_time, problem.clock(2)), (0.0, Some(2.0)), "rows are numbered");
        assert_eq!(problem.previous, [None, Some(0), Some(1)]);
        let state = problem.start();
        let pose = ArmPose::default();
        let sample = problem.sample(&state, 1, &pose.link_frames, &[], None);
        assert!(sample.time.is_nan() && sample.temperature.is_nan() && sample.clock == 1.0);
    });
}

#[test]
fn epochs_are_those_of_the_model_and_one_where_it_has_none() {
    let model = Model { epochs: Some(Epochs::Rows(vec![2])), ..Model::parse("m.yaml", PLANAR).unwrap() };
    let table = Table::parse("t.csv", POINTS).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    assert_eq!([0, 1, 2].map(|row| problem.epoch(row)), [0, 1, 1]);
    with(PLANAR, POINTS, &[], |problem| assert_eq!(problem.epoch(2), 0));
}

#[test]
fn the_sensor_looks_ahead_on_the_first_plane_no_flatter_than_fifteen_degrees() {
    let text = format!("{PLANAR}surfaces: {{table: {{plane: {{normal: [0, 0, 1], offset_mm: 10}}}}}}\n");
    let model = Model::parse("m.yaml", &text).unwrap();
    let view = ViewOfTable::new(&State::nominal(&model, 0, Vec::new()));
    let down = Vector3::new(0.6, 0.0, -0.8);
    assert!(
        (view.ahead(&Vector3::new(5.0, 5.0, 26.0), &down) - 20.0).abs() < 1e-12,
        "16 mm above it, 0.8 down a mm"
    );
    assert!((view.ahead(&Vector3::new(5.0, 5.0, 2.0), &down) + 10.0).abs() < 1e-12, "8 mm below it");
    assert_eq!(view.steepness(&down), -0.8);
    for flat in [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 0.6, 0.8), Vector3::new(0.97, 0.0, -0.25)] {
        assert_eq!(view.steepness(&flat), -0.26, "what hardly goes down does not see the table");
    }
    let bare = ViewOfTable::new(&State::nominal(&Model::parse("m.yaml", PLANAR).unwrap(), 0, Vec::new()));
    assert_eq!((bare.normal, bare.ahead(&Vector3::new(0.0, 0.0, 50.0), &down)), (Vector3::z(), 0.0));
}

#[test]
fn a_fit_of_one_row_or_one_pose_is_refused_with_its_reason() {
    let message = |rows: &str, mask: &[bool]| {
        let mut found = String::new();
        with(PLANAR, rows, &["joint_zero(elbow)"], |problem| {
            let fit = problem.fit(&problem.start(), mask, FitOptions::default(), &Progress::default());
            found = fit.err().map_or_else(String::new, |error: FitError| error.to_string());
        });
        found
    };
    assert!(message(POINTS, &[false, true, false]).contains("line 3: only one row is left to fit"));
    let same = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n5,6,700,0,0\n5,6,450,480,1\n";
    assert!(message(same, &[true, true]).contains("all 2 rows have the same pose"));
    assert!(message(POINTS, &[false; 3]).contains("no rows are left to fit"));
    assert_eq!(message(POINTS, &[true; 3]), "");
}

#[test]
fn a_dependent_number_is_named_with_those_that_move_the_readings_alike() {
    with(PLANAR, POINTS, &["joint_zero(shoulder)", "joint_zero(elbow)", "joint_gain(elbow)"], |problem| {
        // The third column is the first twice and a hundredth of the second, which is too little to be named.
        let columns = DMatrix::from_columns(&[
            DVector::from_vec(vec![1.0, 0.0, 2.0]),
            DVector::from_vec(vec![0.0, 1.0, 0.01]),
        ]);
        let matrix = &columns * columns.transpose();
        let factor = RankRevealingCholesky::new(&matrix);
        assert_eq!(factor.dependent.len(), 1);
        let gauges = problem.gauges(&matrix, &factor);
        let names = ["joint_zero(shoulder)", "joint_zero(elbow)", "joint_gain(elbow)"];
        assert_eq!(gauges[0].held, names[factor.dependent[0]]);
        assert_eq!(gauges[0].same_as.len(), 1, "{gauges:?}");
        assert!(!gauges[0].same_as.contains(&"joint_zero(elbow)".to_owned()));
    });
}

#[test]
fn only_what_the_table_shows_of_bodies_and_boards_is_free() {
    let model = format!(
        "{}board: {{seen_by: p2, free: true}}\n",
        PLANAR.replace(
            "targets: {p1: {xyz_mm: [0, 0, 0], free: false}}",
            "targets: {p1: {free: false, free_rpy: true}, p2: {free: false, free_rpy: true}}"
        )
    );
    let turns = |rows: &str| {
        let mut found = Vec::new();
        with(&model, rows, &[], |problem| found = problem.free_parameters().to_vec());
        found
    };
    assert!(turns(POINTS).is_empty());
    let of_body = turns("q1_deg,q2_deg,p1_rx_rad,p1_ry_rad,p1_rz_rad\n0,0,0,0,0\n");
    assert_eq!(of_body, [0, 1, 2].map(|axis| FreeParameter::TargetRotation(0, axis)));
    let of_board = turns("q1_deg,q2_deg,board_x_mm\n0,0,5\n");
    assert_eq!(of_board[..3], [0, 1, 2].map(|axis| FreeParameter::TargetRotation(1, axis)));
    assert_eq!(of_board[3..6], [0, 1, 2].map(|axis| FreeParameter::BoardShift(0, axis)));
    assert_eq!(of_board[6..], [0, 1, 2].map(|axis| FreeParameter::BoardRotation(0, axis)));
}

#[test]
fn a_turn_is_free_for_a_camera_where_a_board_is_seen_and_for_no_other_target() {
    let target = "targets: {p1: {xyz_mm: [0, 0, 0], free: false}}";
    let targets = "targets: {p1: {free: false, free_rpy: true}, p2: {free: false, free_rpy: true}, p3: {free: false, free_rpy: true}}";
    let model = format!("{}board: {{seen_by: p1}}\n", PLANAR.replace(target, targets));
    with(&model, "q1_deg,q2_deg,board_x_mm\n0,0,5\n", &[], |problem| {
        let turns = problem
            .free_parameters()
            .iter()
            .filter(|free_parameter| matches!(free_parameter, FreeParameter::TargetRotation(..)));
        assert_eq!(
            turns.copied().collect::<Vec<_>>(),
            [0, 1, 2].map(|axis| FreeParameter::TargetRotation(0, axis))
        );
    });
}

#[test]
fn a_camera_is_believed_to_see_its_board_from_where_the_hand_has_it() {
    let target = "targets: {p1: {xyz_mm: [0, 0, 0], free: false}}";
    let targets = "targets: {p1: {xyz_mm: [0, 0, 40], rpy_deg: [180, 0, 0], free: false}}";
    let board = "board: {seen_by: p1, xyz_mm: [700, 30, -260], rpy_deg: [0, 0, 0]}";
    let model = format!("{}{board}\n", PLANAR.replace(target, targets));
    with(&model, "q1_deg,q2_deg,board_x_mm\n0,0,5\n", &[], |problem| {
        // Stretched out the camera is at (700, 0, 40) and looks down: its y and z are turned over.
        let seen = problem.believed_board(&problem.start(), 0).unwrap();
        assert!((seen.translation.vector - Vector3::new(0.0, -30.0, 300.0)).norm() < 1e-9, "{seen}");
        let over = Rotation3::from_euler_angles(std::f64::consts::PI, 0.0, 0.0);
        assert!((seen.rotation.matrix() - over.matrix()).norm() < 1e-9);
    });
}

#[test]
fn a_reading_that_is_too_large_by_a_share_is_predicted_so() {
    // An instrument whose x reads a thousandth too long and 2 mm too far: 700 becomes 702.7.
    let effects = ["scale(x)", "reading_reset(x)"];
    let scaled = |value: f64| {
        let mut left = 0.0;
        with(PLANAR, "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n0,0,702.7,0,0\n", &effects[..1], |problem| {
            let mut state = problem.start();
            state.effects[0] = vec![value; state.effects[0].len()];
            left = problem.block(&state, &[0], &[], &[]).residuals[0];
        });
        left
    };
    let (none, some) = (scaled(0.0), scaled(0.001));
    assert!((none - 2.7).abs() < 1e-9, "{none}");
    assert!((none - some - 0.7).abs() < 1e-9, "{some}");
}

#[test]
fn an_effect_that_is_admitted_is_free_like_the_others() {
    let model = Model::parse("m.yaml", PLANAR).unwrap();
    let table = Table::parse("t.csv", POINTS).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let mut problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    let id = EffectId::at("joint_zero", Site::Joint(1));
    let effect = build(&id, &model).unwrap();
    problem.admit(id.clone(), effect.into(), vec![0.25]);
    assert_eq!(problem.free_parameters(), [FreeParameter::Effect(0, 0)]);
    assert_eq!(problem.start().effects, [[0.25]]);
    assert_eq!(problem.effects().collect::<Vec<_>>(), [&id]);
    assert_eq!(problem.least_variance(), 0.0, "points scatter each for itself");
}

#[test]
fn ranges_count_for_geometry_and_for_what_gives_to_either_side_under_weight() {
    // Far outside whatever a machine has. A joint that gives under a torque gives one way only, and what friction or a wave does is no matter of ranges.
    let far = |effect: &str| {
        let model = PLANAR.replace("elbow, a_mm: 300", "elbow, a_mm: 300, alpha_deg: 90");
        let mut found = Vec::new();
        with(&model, POINTS, &[effect], |problem| {
            let mut state = problem.start();
            state.effects[0].iter_mut().for_each(|value| *value = 1e4);
            found = out_of_range(problem, &state);
        });
        found.len()
    };
    assert_eq!(far("joint_zero(elbow)"), 1);
    assert_eq!(far("link_length(elbow)"), 1);
    assert!(far("gravity_flexure(elbow)") > 1, "every term has a range");
    assert_eq!(far("joint_compliance(elbow)"), 0);
    assert_eq!(far("joint_harmonic(elbow, 1)"), 0);
}

#[test]
fn of_what_is_held_at_a_start_an_effect_may_be_let_go_later_and_the_rest_may_not() {
    let model = PLANAR.replace("free: false}}", "free: true}}");
    with(&model, POINTS, &["joint_zero(elbow)", "joint_gain(elbow)"], |problem| {
        let of_effect = |free_parameter: &FreeParameter| matches!(free_parameter, FreeParameter::Effect(..));
        let first_effect = problem.free_parameters().iter().position(of_effect).unwrap();
        assert!(first_effect > 0, "a target is free as well: {:?}", problem.free_parameters());
        let all: Vec<usize> = (0..problem.free_parameters().len()).collect();
        assert_eq!(kept(problem, &all, &[]), (0..first_effect).collect::<Vec<_>>());
        // What the rows cannot determine at all stays, whatever it belongs to.
        let spared = [first_effect];
        assert_eq!(kept(problem, &all, &spared), (0..=first_effect).collect::<Vec<_>>());
        assert!(kept(problem, &[], &[]).is_empty());
    });
}
