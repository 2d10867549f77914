//! Derivatives of an arm that bends under its weight, against differences.

use super::*;
use nalgebra::DVector;

/// A six-joint arm with heavy links, upright in a world whose gravity its base is turned in.
const HEAVY: &str = "
arm: heavy
convention: distal
joints:
  - {name: j1, a_mm: 0, alpha_deg: 90, d_mm: 90}
  - {name: j2, a_mm: -425, alpha_deg: 20, d_mm: 0}
  - {name: j3, a_mm: -392, alpha_deg: -30, d_mm: 20}
  - {name: j4, a_mm: 10, alpha_deg: 90, d_mm: 109}
  - {name: j5, a_mm: 0, alpha_deg: -90, d_mm: 95}
  - {name: j6, a_mm: 0, alpha_deg: 0, d_mm: 82}
links: [{after: j2, mass_kg: 8, centre_mm: [200, 0, 0]}, {after: j3, mass_kg: 4, centre_mm: [180, 10, 0]}, {after: j6, mass_kg: 2, centre_mm: [0, 0, 20]}]
base: {xyz_mm: [10, 20, 30], rpy_deg: [2, -3, 20], free: true}
targets: {p1: {xyz_mm: [5, -10, 40], free: true}}
";

/// The greatest difference between a derivative and the slope by central differences, of a model with these effects at these values, as a fraction of the greatest slope of its
/// number.
fn worst(effects: &[(&str, &[f64])]) -> f64 {
    let others = ["joint_zero", "link_length", "link_offset", "link_twist", "axis_skew"];
    let others = others.iter().flat_map(|name| (1..=6).map(move |joint| format!("{name}(j{joint})")));
    worst_of(HEAVY, TURNED, others.collect(), effects)
}

const TURNED: &str = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,p1_x_mm,p1_y_mm,p1_z_mm
10,-60,80,-30,40,20,0,0,0
-70,-100,30,60,-50,130,0,0,0
";

/// The same of any arm and table, with these other effects taking part at a hundredth of their unit.
fn worst_of(arm: &str, table: &str, others: Vec<String>, effects: &[(&str, &[f64])]) -> f64 {
    let table = Table::parse("made.csv", table).unwrap();
    let model = Model::parse("arm.yaml", arm).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let mut added: Vec<AddedEffect> = others
        .iter()
        .filter_map(|text| Some(AddedEffect { id: parse(text, &model).ok()?, values: vec![0.01] }))
        .collect();
    for (text, values) in effects {
        added.push(AddedEffect { id: parse(text, &model).unwrap(), values: values.to_vec() });
    }
    let problem = ResidualModel::new(&model, &table, &observations, &added).unwrap();
    let state = problem.start();
    let rows = [0, 1];
    let block = problem.block(&state, &rows, &[], &[]);
    let mut worst = 0.0_f64;
    for free_parameter in 0..problem.free_parameters().len() {
        let mut step = vec![0.0; problem.free_parameters().len()];
        let [ahead, behind] = [1e-5, -1e-5].map(|amount| {
            step[free_parameter] = amount;
            problem.block(&state.stepped(problem.free_parameters(), &step), &rows, &[], &[]).residuals
        });
        let slopes: Vec<f64> =
            ahead.iter().zip(&behind).map(|(ahead, behind)| (behind - ahead) / 2e-5).collect();
        let greatest = slopes.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
        for (equation, slope) in slopes.iter().enumerate() {
            worst =
                worst.max((block.jacobian[(free_parameter, equation)] - slope).abs() / greatest.max(1e-3));
        }
    }
    worst
}

#[test]
fn what_turns_a_link_turns_its_weight_and_what_that_bends() {
    // Of stiff joints nothing answers.
    assert!(worst(&[]) < 1e-6, "{}", worst(&[]));
    // Bends of a tenth of a radian, under known weights and under unknown ones.
    let flexure: &[f64] = &[0.05, -0.04, 0.03, 0.02, 0.05, -0.03, 0.01, 0.02, 0.04];
    for effects in [
        &[("gravity_flexure(j2)", flexure)] as &[(&str, &[f64])],
        &[("gravity_flexure(j2)", flexure), ("gravity_flexure(j3)", flexure)],
        &[("joint_compliance(j2)", &[0.003]), ("joint_compliance(j3)", &[0.005])],
        &[("link_sag(j2)", &[0.0005]), ("joint_compliance(j2)", &[0.003])],
        &[("link_torsion(j2)", &[0.001]), ("link_sag(j3)", &[0.0002])],
    ] {
        let worst = worst(effects);
        assert!(worst < 1e-5, "{effects:?}: off by {worst} of the slope");
    }
}

/// A state with all that can be fitted moved by so much (rad, or a hundred times as many mm), the base turned besides.
fn moved(problem: &ResidualModel<'_>, by: f64, rotated_base: f64) -> State {
    let step: Vec<f64> = problem
        .free_parameters()
        .iter()
        .enumerate()
        .map(|(index, free_parameter)| match free_parameter {
            FreeParameter::BaseRotation(_) => rotated_base,
            FreeParameter::Effect(part, _) if problem.parts[*part].id.name.starts_with("link_l") => {
                100.0 * by
            }
            FreeParameter::Effect(part, _) if problem.parts[*part].id.name == "joint_zero" => {
                by * if index % 2 == 0 { 1.0 } else { -1.0 }
            }
            _ => 0.0,
        })
        .collect();
    problem.start().stepped(problem.free_parameters(), &step)
}

#[test]
fn slopes_are_kept_near_by_and_worked_out_anew_where_the_arm_hangs_otherwise() {
    let table = Table::parse("made.csv", TURNED).unwrap();
    let model = Model::parse("arm.yaml", HEAVY).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let added: Vec<AddedEffect> = ["joint_zero(j2)", "joint_zero(j4)", "link_length(j2)", "link_length(j3)"]
        .iter()
        .map(|text| (*text, vec![0.0]))
        .chain([("joint_compliance(j2)", vec![0.003]), ("link_sag(j3)", vec![0.0002])])
        .map(|(text, values)| AddedEffect { id: parse(text, &model).unwrap(), values })
        .collect();
    let problem = || ResidualModel::new(&model, &table, &observations, &added).unwrap();
    let rows = [0, 1];
    // What differs between derivatives with slopes from the start and with fresh ones, as a fraction of the greatest derivative.
    let off = |state: &State| {
        let begun = problem();
        let start = begun.block(&begun.start(), &rows, &[], &[]).jacobian;
        let [kept, fresh] = [begun, problem()].map(|problem| problem.block(state, &rows, &[], &[]).jacobian);
        ((&kept - &fresh).amax() / fresh.amax(), (&fresh - start).amax() / fresh.amax())
    };
    // Five milliradians and half a millimetre: the derivatives themselves move by more than the slopes matter.
    let (kept, moved_by) = off(&moved(&problem(), 0.005, 0.005));
    // Of a bend of a tenth of a radian; of one of a machine it is a hundredth of that.
    assert!(kept > 0.0 && kept < 1e-3 && moved_by > 10.0 * kept, "{kept} of {moved_by}");
    // Farther away, in any one of what counts, they are the same to the last digit.
    for far in [moved(&problem(), 0.02, 0.0), moved(&problem(), 0.0, 0.3)] {
        assert_eq!(off(&far).0, 0.0);
    }
}

#[test]
fn a_later_fit_uses_the_slopes_of_an_earlier_one_in_which_the_same_bends() {
    let table = Table::parse("made.csv", TURNED).unwrap();
    let model = Model::parse("arm.yaml", HEAVY).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let with = |model, texts: &[(&str, f64)]| {
        let added = texts
            .iter()
            .map(|(text, value)| AddedEffect { id: parse(text, model).unwrap(), values: vec![*value] });
        ResidualModel::new(model, &table, &observations, &added.collect::<Vec<_>>()).unwrap()
    };
    let (zero, bend, gain) =
        (("joint_zero(j2)", 0.0), ("joint_compliance(j2)", 0.003), ("joint_gain(j4)", 0.0));
    let earlier = with(&model, &[zero, bend]);
    earlier.block(&earlier.start(), &[0, 1], &[], &[]);
    let of_zero = |problem: &ResidualModel<'_>, by: f64| {
        let block = problem.block(&moved(problem, by, 0.0), &[0, 1], &[], &[]);
        let number = problem.free_parameters().iter().position(|one| *one == FreeParameter::Effect(0, 0));
        block.jacobian.row(number.unwrap()).into_owned()
    };
    let kept = of_zero(&earlier, 0.005);
    assert_eq!(of_zero(&with(&model, &[zero, bend, gain]).after(&earlier), 0.005), kept);
    // Where the earlier ones do not hold, where something else bends, and in another model they are worked out.
    let fresh = of_zero(&with(&model, &[zero, bend]), 0.005);
    assert!(
        fresh != kept
            && of_zero(&with(&model, &[zero, bend]).after(&earlier), 0.02)
                == of_zero(&with(&model, &[zero, bend]), 0.02)
    );
    let two = [zero, bend, ("joint_compliance(j3)", 0.0)];
    assert_eq!(of_zero(&with(&model, &two).after(&earlier), 0.005), of_zero(&with(&model, &two), 0.005));
    let other = model.clone();
    assert_eq!(of_zero(&with(&other, &[zero, bend]).after(&earlier), 0.005), fresh);
}

#[test]
fn the_second_derivative_along_a_change_is_that_of_the_predictions() {
    let table = Table::parse("made.csv", TURNED).unwrap();
    let model = Model::parse("arm.yaml", HEAVY).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let added: Vec<AddedEffect> =
        [("joint_zero(j2)", 0.0), ("link_length(j2)", 0.0), ("joint_compliance(j2)", 0.003)]
            .iter()
            .map(|(text, value)| AddedEffect { id: parse(text, &model).unwrap(), values: vec![*value] })
            .collect();
    let problem = ResidualModel::new(&model, &table, &observations, &added).unwrap();
    let (rows, weights) = ([0, 1], [0.25, 1.0]);
    let change = DVector::from_fn(problem.free_parameters().len(), |free_parameter, _| {
        match problem.free_parameters()[free_parameter] {
            FreeParameter::BaseRotation(axis) => 0.02 * (axis as f64 + 1.0),
            FreeParameter::Effect(0, _) => -0.03,
            FreeParameter::Effect(1, _) => 5.0,
            _ => 0.0,
        }
    });
    let at = |fraction: f64| {
        let state = problem.start().stepped(problem.free_parameters(), (&change * fraction).as_slice());
        problem.block(&state, &rows, &weights, &[])
    };
    // Central differences of the predictions, which fall as the residuals rise.
    let small = 0.01;
    let [behind, here, ahead] =
        [-small, 0.0, small].map(|fraction| DVector::from_vec(at(fraction).residuals));
    let second = (here * 2.0 - behind - ahead) / (small * small);
    let expected = at(0.0).jacobian * second;
    let found = problem.second_derivative_along(&problem.start(), &change, &rows, &weights);
    assert!(
        expected.norm() > 0.0 && (&found - &expected).norm() < 0.02 * expected.norm(),
        "{found} {expected}"
    );
}

#[test]
fn what_derivatives_are_off_by_is_no_bend() {
    let table = Table::parse("made.csv", TURNED).unwrap();
    let model = Model::parse("arm.yaml", HEAVY).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let added: Vec<AddedEffect> = [("joint_zero(j2)", 0.0), ("joint_compliance(j2)", 0.003)]
        .iter()
        .map(|(text, value)| AddedEffect { id: parse(text, &model).unwrap(), values: vec![*value] })
        .collect();
    let problem = ResidualModel::new(&model, &table, &observations, &added).unwrap();
    // With the slopes of the start derivatives are off by some hundred-thousandths here.
    problem.block(&problem.start(), &[0, 1], &[], &[]);
    let state = moved(&problem, 0.0008, 0.0);
    let along = |size: f64| {
        let turned = problem
            .free_parameters()
            .iter()
            .map(|free_parameter| if *free_parameter == FreeParameter::Effect(0, 0) { size } else { 0.0 });
        let change = DVector::from_iterator(problem.free_parameters().len(), turned);
        problem.second_derivative_along(&state, &change, &[0, 1], &[])
    };
    // A second derivative goes with the square of the change, however small that is.
    let (large, small) = (along(1e-2) * 1e-4, along(1e-4));
    assert!(large.norm() > 0.0 && (&small - &large).norm() < 0.02 * large.norm(), "{small} {large}");
}

#[test]
fn an_effect_that_joins_has_slopes_of_its_own() {
    let table = Table::parse("made.csv", TURNED).unwrap();
    let model = Model::parse("arm.yaml", HEAVY).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let with = |texts: &[(&str, f64)]| -> Vec<AddedEffect> {
        let added = |(text, value): &(&str, f64)| AddedEffect {
            id: parse(text, &model).unwrap(),
            values: vec![*value],
        };
        texts.iter().map(added).collect()
    };
    let (first, second) = (("joint_compliance(j2)", 0.003), ("joint_compliance(j3)", 0.005));
    let mut joined = ResidualModel::new(&model, &table, &observations, &with(&[first])).unwrap();
    joined.block(&joined.start(), &[0, 1], &[], &[]);
    let id = parse(second.0, &model).unwrap();
    let effect = crate::effect::build(&id, &model).unwrap();
    joined.admit(id, std::sync::Arc::from(effect), vec![second.1]);
    let whole = ResidualModel::new(&model, &table, &observations, &with(&[first, second])).unwrap();
    let [joined, whole] = [joined, whole].map(|one| one.block(&one.start(), &[0, 1], &[], &[]).jacobian);
    assert_eq!(joined, whole);
}

/// Three slides one upon the other: what turns a carriage turns about where the ones before have brought it.
const GANTRY: &str = "
arm: gantry
convention: proximal
joints:
  - {name: y, slides: true, alpha_deg: -90, theta_deg: 90}
  - {name: x, slides: true, a_mm: -400, alpha_deg: 90, theta_deg: 90}
  - {name: z, slides: true, alpha_deg: 90}
base: {xyz_mm: [0, 0, 0], rpy_deg: [2, -3, 20], free: true}
targets: {p1: {xyz_mm: [20, 15, 120], free: true}}
measured_from: world
";

#[test]
fn what_shifts_a_slide_shifts_where_the_carriages_upon_it_turn() {
    let table = "q1_mm,q2_mm,q3_mm,p1_x_mm,p1_y_mm,p1_z_mm
112,524,105,0,0,0
748,228,43,0,0,0
";
    let others = ["joint_zero", "link_length", "link_offset", "link_twist", "axis_skew"];
    let others: Vec<String> =
        others.iter().flat_map(|name| ["y", "x", "z"].map(|joint| format!("{name}({joint})"))).collect();
    // A degree a metre, many times what a machine has.
    let worst = worst_of(GANTRY, table, others, &[("axis_roll(x)", &[2e-5]), ("axis_yaw(z)", &[2e-5])]);
    assert!(worst < 1e-5, "off by {worst} of the slope");
}
