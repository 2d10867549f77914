//! Formulas for what no effect of the library does, on small made-up arms.

use super::forms::{Angle, Shape};
use super::*;
use crate::laboratory::Options;
use crate::split::Holdout;
use crate::testing::two_links;
use plumb_calibration::table::Table;

fn found(lab: &Laboratory) -> Option<Hypothesis> {
    let problem = lab.problem(&[]).unwrap();
    lab.hypothesis(&Floor::among(&problem, None), &Progress::unwatched()).unwrap()
}

#[test]
fn a_slope_that_begins_at_an_angle_is_found_with_its_joint_and_its_size() {
    let lab = two_links(150, "joint_zero(*)", 0.05, 1, |q| [0.0, 0.004 * (q[1] - 0.4).max(0.0)]);
    let found = found(&lab).unwrap();
    assert_eq!(found.site, "elbow");
    assert!(found.formula.contains("max(q2 - "), "{}", found.formula);
    let (value, size) = (&found.values[0], 0.004_f64.to_degrees());
    assert!((value.value - size).abs() < 0.1 * size, "{value:?}");
    assert!(found.explains > 0.7 && found.after_mm < 0.6 * found.before_mm, "{found:?}");
    // With it only the noise of three coordinates is left; without it what a fit of the zeros leaves.
    assert!((found.after_mm / (0.05 * 3.0_f64.sqrt()) - 1.0).abs() < 0.15, "{found:?}");
    let left = lab.left_by_fit(&Progress::unwatched()).unwrap();
    assert!((found.before_mm / left - 1.0).abs() < 0.02, "{found:?}, {left}");
    assert!(found.define.contains("adds: {joint: elbow, deg: \"a*max(q2 - "), "{}", found.define);
}

#[test]
fn a_wave_of_the_sum_of_two_joints_is_found() {
    let lab = two_links(150, "joint_zero(*)", 0.05, 2, |q| [0.0, 0.002 * (q[0] + q[1]).sin()]);
    let found = found(&lab).unwrap();
    assert_eq!(found.site, "elbow");
    assert_eq!(found.formula, "deg: a*sin(q2 + q1) + b*cos(q2 + q1)");
    assert!((found.values[0].value - 0.002_f64.to_degrees()).abs() < 0.01, "{:?}", found.values);
    assert!(found.values[1].value.abs() < 4.0 * found.values[1].se, "{:?}", found.values);
}

#[test]
fn noise_gets_no_formula_and_neither_does_what_the_library_lists() {
    for seed in 0..8 {
        let lab = two_links(80, "joint_zero(*)", 0.05, seed, |_| [0.0, 0.0]);
        assert_eq!(found(&lab), None, "seed {seed}");
    }
    let lab = two_links(150, "joint_zero(*)", 0.05, 1, |q| [0.003 * q[0].sin(), 0.0]);
    assert_eq!(found(&lab), None, "joint_harmonic(shoulder)");
}

#[test]
fn what_no_form_comes_near_gets_no_formula() {
    // A sawtooth of thirteen teeth a turn.
    let lab = two_links(150, "joint_zero(*)", 0.05, 3, |q| {
        [0.002 * (13.0 * q[0] / std::f64::consts::TAU).rem_euclid(1.0), 0.0]
    });
    assert_eq!(found(&lab), None);
}

/// Everything that a table may log, in few rows.
fn everything_logged() -> Laboratory {
    let model = "
arm: heavy
convention: distal
joints:
  - {name: shoulder, a_mm: 200, limits_deg: [-170, 170]}
  - {name: slide, alpha_deg: 90, d_mm: 10, slides: true, limits_mm: [-100, 100]}
  - {name: elbow, a_mm: 150, limits_deg: [-150, 150]}
base: {xyz_mm: [0, 0, 0], free: false}
gravity: [0, -1, 0]
links: [{after: elbow, mass_kg: 2, centre_mm: [-50, 0, 0]}]
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
free: [joint_zero(shoulder)]
";
    let mut text = "q1_deg,q2_mm,q3_deg,approach_q1,approach_q2,approach_q3,time_s,temperature_c,payload_kg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for row in 0..40 {
        let wave = |rate: f64| (rate * f64::from(row)).sin();
        let side = if row % 2 == 0 { 1 } else { -1 };
        text.push_str(&format!(
            "{},{},{},{side},{},{side},{},{},{},{},{},{}\n",
            100.0 * wave(1.3),
            50.0 * wave(2.1),
            80.0 * wave(0.7),
            -side,
            60 * row,
            22.0 + 3.0 * wave(0.2),
            f64::from(row % 3),
            300.0 * wave(1.3),
            200.0 * wave(0.9),
            100.0 * wave(1.7)
        ));
    }
    let model = Model::parse("model.yaml", model).unwrap();
    let table = Table::parse("table.csv", &text).unwrap();
    Laboratory::new(model, table, Options { holdout: Holdout::None, ..Options::default() }).unwrap()
}

#[test]
fn every_form_is_what_its_formula_says() {
    let lab = everything_logged();
    let problem = lab.problem(&[]).unwrap();
    let (state, rows) = (problem.start(), (0..lab.table().len()).collect::<Vec<_>>());
    let weights = vec![1.0; rows.len()];
    let mut factors = std::collections::BTreeSet::new();
    let forms = grammar::probes(&lab);
    for (form, probe) in forms.iter().step_by(7) {
        let written = definition("hypothesis", form, lab.model()).unwrap_or_else(|| panic!("{form:?}"));
        let id = EffectId::at("hypothesis", written.site);
        let mut model = lab.model().clone();
        model.definitions.push(Arc::new(written));
        let defined = effect::build(&id, &model).unwrap();
        let block = problem.block(&state, &rows, &weights, &[probe.effect.as_ref(), defined.as_ref()]);
        let (free_parameters, own) = (problem.free_parameters().len(), probe.effect.parameters().len());
        let (search, file) =
            (block.jacobian.rows(free_parameters, own), block.jacobian.rows(free_parameters + own, own));
        assert!((search - file).amax() < 1e-9 * (1.0 + search.amax()), "{form:?}: {:?}", form.formulas());
        factors.insert(format!("{:?}", form.factor).chars().take(4).collect::<String>());
    }
    assert_eq!(factors.len(), 9, "{factors:?}");
}

#[test]
fn the_block_is_read_as_it_is_written() {
    for (site, name) in [(FormSite::Joint { joint: 1, slides: false }, "elbow"), (FormSite::Base, "base")] {
        let angle = Angle { first: 1, second: Some((0, true)) };
        let form = Form { site, factor: forms::Factor::Load(1), shape: Shape::Wave(angle, 2) };
        let arm = "arm: two\nconvention: distal\njoints:\n  - {name: shoulder, a_mm: 200, limits_deg: [-170, 170]}\n  - {name: elbow, a_mm: 150, limits_deg: [-150, 150]}\ntargets: {p1: {xyz_mm: [0, 0, 0]}}\n";
        let read = Model::parse("model.yaml", &format!("{arm}{}", block(&form, name))).unwrap();
        assert_eq!(*read.definitions[0], definition(HYPOTHESIS, &form, &read).unwrap());
    }
}

#[test]
fn twins_need_a_relation_to_the_pose_and_not_only_large_residuals() {
    let forms = |lab: &Laboratory| -> Vec<Probe> {
        grammar::probes(lab)
            .into_iter()
            .filter(|(form, _)| grammar::site_of(form.site) == effect::Site::Joint(1))
            .map(|(_, probe)| probe)
            .collect()
    };
    let angle = Angle::of(1);
    let form = Form {
        site: FormSite::Joint { joint: 1, slides: false },
        factor: forms::Factor::One,
        shape: Shape::Above(angle, 0.4),
    };
    for (off, beaten) in [(0.004, true), (0.0, false)] {
        let lab = two_links(120, "joint_zero(*)", 0.2, 5, |q| [0.0, off * (q[1] - 0.4_f64).max(0.0)]);
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let probes = forms(&lab);
        let all: Vec<&dyn Effect> = probes.iter().map(|probe| probe.effect.as_ref()).collect();
        assert_eq!(twins::beaten(&fitted, &Candidate::new(form), &all), beaten, "{off}");
    }
}

#[test]
fn a_searched_number_is_tried_again_on_either_side_of_where_it_was() {
    let lab = two_links(30, "joint_zero(*)", 0.05, 71, |_| [0.0; 2]);
    let site = grammar::probes(&lab)[0].0.site;
    let at = 0.2;
    let form = Form { site, factor: forms::Factor::One, shape: forms::Shape::Above(forms::Angle::of(1), at) };
    let tried: Vec<f64> = grammar::finer(&lab, &form)
        .into_iter()
        .map(|(form, _)| match form.shape {
            forms::Shape::Above(_, at) => at,
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(tried.len(), 19);
    assert!(tried.windows(2).all(|pair| pair[1] > pair[0]), "{tried:?}");
    assert!((tried[9] - at).abs() < 1e-3 && (tried[0] + tried[18] - 2.0 * at).abs() < 1e-2, "{tried:?}");
    // Nine tenths of the first search's spacing, a fraction of a range of some 200 deg.
    assert!((0.05..1.5).contains(&(tried[18] - at)), "{tried:?}");
}

#[test]
fn a_bump_and_a_half_turn_are_tried_again_about_their_numbers() {
    let lab = two_links(30, "joint_zero(*)", 0.05, 71, |_| [0.0; 2]);
    let site = grammar::probes(&lab)[0].0.site;
    let (angle, factor) = (Angle::of(1), forms::Factor::One);
    let tried = |shape: Shape| {
        let forms = grammar::finer(&lab, &forms::Form { site, factor, shape });
        forms.into_iter().map(|(form, _)| form.shape).collect::<Vec<Shape>>()
    };
    let bumps = tried(Shape::Bump(angle, 0.2, 0.3));
    assert_eq!(bumps.len(), 3 * 19);
    for (index, shape) in bumps.iter().enumerate() {
        let Shape::Bump(_, _, wide) = shape else { panic!("{shape:?}") };
        // Narrower and wider by a root of two.
        assert!((wide - [0.21, 0.3, 0.42][index % 3]).abs() < 1e-9, "{shape:?}");
    }
    let halves = tried(Shape::Half(angle, 0.5));
    assert_eq!(halves.len(), 19);
    let at = |index: usize| match halves[index] {
        Shape::Half(_, at) => at,
        other => panic!("{other:?}"),
    };
    // An eighth of half a turn lies between two that were tried: nine tenths of it on either side.
    let reach = 0.9 * 0.125 * std::f64::consts::PI;
    assert!((at(9) - 0.5).abs() < 1e-9, "{}", at(9));
    assert!((at(0) - (0.5 - reach)).abs() < 1e-3 && (at(18) - (0.5 + reach)).abs() < 1e-3, "{halves:?}");
    assert_eq!(tried(Shape::One), [Shape::One]);
    let beyond = tried(Shape::Beyond(angle, 0.1));
    assert!(beyond.iter().all(|shape| matches!(shape, Shape::Beyond(_, at) if *at > 0.0)), "{beyond:?}");
    assert!((10..19).contains(&beyond.len()), "{}: those below zero begin nowhere", beyond.len());
}

#[test]
fn an_angle_that_stays_where_it_is_has_no_steps_and_slopes() {
    let bent = |elbow: fn(f64) -> f64| {
        let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
        for row in 0..40 {
            let q = [-150.0 + 7.0 * f64::from(row), elbow(f64::from(row))];
            text.push_str(&format!("{},{},{},0,0\n", q[0], q[1], 100.0 + q[0]));
        }
        let model = Model::parse("model.yaml", &format!("{}free: []\n", crate::testing::TWO_LINKS)).unwrap();
        let table = Table::parse("table.csv", &text).unwrap();
        let options = Options { holdout: Holdout::None, ..Options::default() };
        Laboratory::new(model, table, options).unwrap()
    };
    let kinks = |lab: &Laboratory| {
        let of_elbow = Angle::of(1);
        let forms = grammar::probes(lab).into_iter().map(|(form, _)| form.shape);
        forms
            .filter(
                |shape| matches!(shape, Shape::Above(angle, _) | Shape::Step(angle, _) if *angle == of_elbow),
            )
            .count()
    };
    assert_eq!(kinks(&bent(|_| 30.0)), 0);
    assert!(kinks(&bent(|row| -60.0 + 3.0 * row)) > 0);
    // What goes beyond an angle on either side needs both.
    let beyond = |lab: &Laboratory| {
        let forms = grammar::probes(lab).into_iter().map(|(form, _)| form.shape);
        forms.filter(|shape| matches!(shape, Shape::Beyond(angle, _) if *angle == Angle::of(1))).count()
    };
    assert!(beyond(&bent(|row| -60.0 + 3.0 * row)) > 0);
    assert_eq!(beyond(&bent(|row| 2.0 * row)), 0, "from zero upward");
    assert_eq!(beyond(&bent(|row| -2.0 * row)), 0, "from zero downward");
}

#[test]
fn slopes_and_steps_begin_within_the_range_of_their_angle() {
    let lab = two_links(60, "joint_zero(*)", 0.05, 71, |_| [0.0; 2]);
    let elbow: Vec<f64> = (0..60).map(|row| lab.table().q_of(row)[1]).collect();
    let (low, high) = elbow.iter().fold((f64::MAX, f64::MIN), |(low, high), q| (low.min(*q), high.max(*q)));
    let probes = grammar::probes(&lab);
    let angles: Vec<f64> = probes
        .iter()
        .filter_map(|(form, _)| match form.shape {
            Shape::Above(angle, at) if angle == Angle::of(1) => Some(at),
            _ => None,
        })
        .collect();
    assert!(angles.len() > 3 && angles.iter().all(|at| low < *at && *at < high), "{low} {high} {angles:?}");
    // Spread over the range, and not about one end of it.
    let least = angles.iter().copied().fold(f64::MAX, f64::min);
    let most = angles.iter().copied().fold(f64::MIN, f64::max);
    assert!(least < low + 0.4 * (high - low) && most > high - 0.4 * (high - low), "{angles:?}");
}

#[test]
fn a_formula_explains_its_share_of_what_lies_beyond_the_noise() {
    let lab = two_links(30, "joint_zero(*)", 0.05, 71, |_| [0.0; 2]);
    let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
    let before = fitted.fit.normal.squares;
    // Ninety readings less two zeros.
    let freedom = 88.0;
    let floor = |noise: f64| Floor {
        scale: (noise > 0.0).then(|| (noise * before / freedom).sqrt()),
        ..Floor::of(&fitted.problem, &fitted.fit, &lab.context())
    };
    let leaving = |fraction: f64| FittedCandidate {
        left: (fraction * before, freedom),
        ..crate::testing::fitted_candidate("joint_gain", 1, 0.0)
    };
    let fraction = |left: f64, noise: f64| explained(&fitted, &leaving(left), &floor(noise));
    assert!((fraction(0.4, 0.2) - 0.75).abs() < 1e-9, "six tenths of eight");
    assert!((fraction(0.4, 0.0) - 0.6).abs() < 1e-9, "of all where nobody knows the noise");
    assert_eq!((fraction(0.1, 0.2), fraction(1.5, 0.2)), (1.0, 0.0));
}

#[test]
fn a_form_pays_for_its_numbers_and_for_being_chosen_among_many() {
    let lab = two_links(30, "joint_zero(*)", 0.05, 71, |_| [0.0; 2]);
    let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
    let squares = fitted.fit.normal.squares;
    let score = |gain: f64| Score {
        gain: gain * squares,
        freedom: 3,
        ..crate::testing::fitted_candidate("joint_gain", 1, 0.0).score
    };
    // Schwarz: n ln(S / n) + k ln n, up to what is the same for all.
    let differs = |gain: f64, cost: f64| {
        criterion(&fitted.fit, &score(gain), cost) - criterion(&fitted.fit, &score(0.0), 0.0)
    };
    assert!((differs(0.5, 0.0) - 90.0 * 0.5_f64.ln()).abs() < 1e-9);
    assert!((differs(0.0, 7.0) - 7.0).abs() < 1e-9);
    assert!((differs(2.0, 0.0) - 90.0 * 1e-9_f64.ln()).abs() < 1e-6, "never to nothing");
    let plain = bic(squares, 90.0, 2.0, 0.0);
    assert!((criterion(&fitted.fit, &score(0.0), 0.0) - plain - 3.0 * 90.0_f64.ln()).abs() < 1e-9);
    let mad = Score { plausible: false, ..score(0.5) };
    assert_eq!((plausible_gain(&score(0.5)), plausible_gain(&mad)), (0.5 * squares, 0.0));
}

#[test]
fn kinks_steps_halves_and_bumps_have_a_number_that_was_searched_for() {
    let angle = Angle::of(1);
    let plain = [Shape::One, Shape::Linear(angle), Shape::Wave(angle, 2)];
    assert!(!plain.into_iter().any(Shape::is_searched));
    let kinked =
        [Shape::Above, Shape::Below, Shape::Beyond, Shape::Step, Shape::Half].map(|shape| shape(angle, 0.3));
    assert!(kinked.into_iter().chain([Shape::Bump(angle, 0.3, 0.1)]).all(Shape::is_searched));
}

#[test]
fn bumps_are_a_fourteenth_and_a_seventh_of_the_range_wide_about() {
    let lab = two_links(60, "joint_zero(*)", 0.05, 71, |_| [0.0; 2]);
    let elbow: Vec<f64> = (0..60).map(|row| lab.table().q_of(row)[1]).collect();
    let (low, high) = elbow.iter().fold((f64::MAX, f64::MIN), |(low, high), q| (low.min(*q), high.max(*q)));
    let forms = grammar::probes(&lab).into_iter().map(|(form, _)| form.shape);
    let mut widths: Vec<f64> = forms
        .filter_map(|shape| match shape {
            Shape::Bump(angle, _, wide) if angle == Angle::of(1) => Some(wide / (high - low)),
            _ => None,
        })
        .collect();
    widths.sort_by(f64::total_cmp);
    widths.dedup();
    assert!((widths[0] - 0.07).abs() < 1e-3 && (widths[widths.len() - 1] - 0.15).abs() < 1e-3, "{widths:?}");
    assert_eq!(widths.len(), 2);
}

#[test]
fn a_lean_of_the_base_has_numbers_of_its_own_about_either_axis() {
    let count = |site: FormSite, shape: Shape| {
        let form = Form { site, factor: forms::Factor::One, shape };
        (form.parameters().len(), form.parameters()[0].range.1)
    };
    let angle = Angle::of(0);
    let joint = |slides: bool| FormSite::Joint { joint: 1, slides };
    let (one, two) = (Shape::Half(angle, 0.5), Shape::Wave(angle, 2));
    assert_eq!([one, two].map(|shape| count(joint(false), shape).0), [1, 2]);
    assert_eq!([one, two].map(|shape| count(FormSite::Base, shape).0), [2, 4]);
    assert!(count(joint(true), one).1 > 0.0 && count(FormSite::Base, one).1 > 0.0);
}
