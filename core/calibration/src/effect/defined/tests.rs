//! Formulas of a user's own: what they may say, what they come to in a row, and what is refused.

use nalgebra::{Matrix3, Vector3};
use plumb_kinematics::{DhParameter, LinkFrames, Weights};

use super::formula::{Formula, FormulaError};
use super::variables::Variable;
use crate::arm_model::Model;
use crate::effect::{Contribution, Dof, LooksAt, Sample, build, parse};
use crate::fit::ResidualModel;
use crate::measurement::Observations;
use crate::table::Table;

fn formula(text: &str) -> Result<Formula, FormulaError> {
    Formula::read(text, &["a".to_owned(), "b".to_owned()], 3)
}

/// The rates of `a` and `b` at the values of the formula's variables, in the order in which it speaks of them.
fn rates(text: &str, variables: &[f64]) -> Vec<f64> {
    formula(text).unwrap_or_else(|error| panic!("{text}: {error}")).rates(variables).unwrap()
}

fn close(found: &[f64], expected: &[f64]) -> bool {
    found.len() == expected.len()
        && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12 * (1.0 + b.abs()))
}

#[test]
fn a_formula_is_worked_out_as_a_textbook_reads_it() {
    for (text, variables, expected) in [
        ("a*sin(q2) + b*cos(q2)", &[0.3][..], [0.3_f64.sin(), 0.3_f64.cos()]),
        ("a + 2*b", &[], [1.0, 2.0]),
        ("a/4", &[], [0.25, 0.0]),
        ("-a*q1^2", &[3.0], [-9.0, 0.0]),
        ("a*-q1^2", &[3.0], [-9.0, 0.0]),
        ("a*(-q1)^2", &[3.0], [9.0, 0.0]),
        ("a*2^-q1", &[2.0], [0.25, 0.0]),
        ("a*q1 - b*q2", &[3.0, 5.0], [3.0, -5.0]),
        ("a*pi", &[], [std::f64::consts::PI, 0.0]),
        ("a*1e-3*q1 + b*2.5E+1", &[2.0], [2e-3, 25.0]),
        ("a*max(0.0, q1 - 2) + b*min(q1, 1)", &[3.0], [1.0, 1.0]),
        ("a*sign(q1) + b*abs(q1)", &[-4.0], [-1.0, 4.0]),
        ("a*sqrt(q1) + b*exp(q2)", &[9.0, 1.0], [3.0, std::f64::consts::E]),
        ("a*t_s + b*temperature_c", &[60.0, 21.0], [60.0, 21.0]),
        ("a*payload_kg + b*side3", &[2.0, -1.0], [2.0, -1.0]),
    ] {
        assert!(close(&rates(text, variables), &expected), "{text}: {:?}", rates(text, variables));
    }
    // Zero has no side.
    assert!(close(&rates("a*sign(q1) + b", &[0.0]), &[0.0, 1.0]));
}

#[test]
fn what_is_no_formula_is_refused_with_what_would_be_right() {
    for (text, part) in [
        ("a*sin(q2", "is no formula"),
        ("a*sin(q2) +", "is no formula"),
        ("a*q1; b", "has no place in it"),
        ("a = 3", "has no place in it"),
        ("while a", "`while` has no place in a formula: a formula has no loops"),
        ("if q1 a", "`if` has no place in a formula"),
        ("a*q4", "speaks of `q4`, which is neither a parameter nor a quantity of a row"),
        ("a*q0", "speaks of `q0`"),
        ("a*sine(q1)", "speaks of `sine`"),
        ("a*torq1", "speaks of `torq1`"),
        ("a*b", "must grow in proportion to its parameters"),
        ("sin(a*q1)", "must grow in proportion to its parameters"),
        ("a + 1", "must grow in proportion to its parameters"),
        ("a*a", "must grow in proportion to its parameters"),
        ("abs(a)", "must grow in proportion to its parameters"),
        ("sin(q1)", "must grow in proportion to its parameters"),
        ("0*a", "depends on none of the parameters"),
    ] {
        let message = formula(text).map(|_| String::new()).unwrap_or_else(|error| error.to_string());
        assert!(message.contains(part), "{text}: {message:?}");
    }
    // A slope that begins far out is one all the same.
    for text in ["a*max(0, q1 - 300)", "a*max(0, -40 - m2)", "a*max(0, q1 - 2)"] {
        assert!(formula(text).is_ok(), "{text}");
    }
}

#[test]
fn what_was_worked_out_is_remembered_as_it_was() {
    let formula = formula("a*q1 + b*q2").unwrap();
    for _ in 0..2 {
        assert_eq!(formula.remembered(&[3.0, 5.0]), [3.0, 5.0]);
        assert_eq!(formula.remembered(&[-3.0, 5.0]), [-3.0, 5.0]);
    }
    assert_eq!(formula.format_values(&[3.0, 0.12346]), "q1 = 3.0000, q2 = 0.1235");
    assert_eq!(format!("{formula:?}"), "Formula(\"a*q1 + b*q2\")");
}

#[test]
fn names_are_quantities_of_a_row_up_to_the_number_of_joints() {
    for (name, variable) in [
        ("q1", Some(Variable::Coordinate(0))),
        ("m3", Some(Variable::Moment(2))),
        ("side2", Some(Variable::Side(1))),
        ("move1", Some(Variable::Move(0))),
        ("t_s", Some(Variable::Time)),
        ("temperature_c", Some(Variable::Temperature)),
        ("payload_kg", Some(Variable::Payload)),
        ("x", Some(Variable::Point(0))),
        ("y", Some(Variable::Point(1))),
        ("z", Some(Variable::Point(2))),
        ("q4", None),
        ("q0", None),
        ("q", None),
        ("q1a", None),
        ("w", None),
    ] {
        assert_eq!(Variable::named(name, 3), variable, "{name}");
    }
    for name in Variable::names(3) {
        assert!(Variable::named(&name, 3).is_some(), "{name}");
    }
    assert_eq!(Variable::names(3).len(), 4 * 3 + 6);
    let looks = [Variable::Moment(0), Variable::Point(1), Variable::Side(0)].map(Variable::looks_at);
    assert_eq!(looks, [LooksAt::Gravity, LooksAt::Point, LooksAt::Conditions]);
}

#[test]
fn a_quantity_that_was_not_logged_is_zero() {
    let model = Model::parse("m.yaml", ARM).unwrap();
    let (q, before, link_frames) = ([0.1, 0.2, 30.0], [0.4, 0.2, 10.0], LinkFrames::default());
    let bare = Sample {
        chain: &model.chain,
        q: &q,
        previous: None,
        approach: &[],
        speed: &[],
        time: f64::NAN,
        clock: f64::NAN,
        epoch: 0,
        temperature: f64::NAN,
        moments: &[],
        weights: Weights { masses: &[], payload: 0.0, down: -Vector3::z() },
        link_frames: &link_frames,
        point: Vector3::new(7.0, 8.0, 9.0),
        hand: Matrix3::identity(),
        trigger: None,
    };
    let logged = Sample {
        previous: Some(&before),
        approach: &[0, -1, 1],
        time: 60.0,
        temperature: 21.5,
        moments: &[1.0, 2.0, 3.0],
        weights: Weights { payload: 4.0, ..bare.weights },
        ..bare
    };
    for (variable, without, with) in [
        (Variable::Coordinate(2), 30.0, 30.0),
        (Variable::Moment(1), 0.0, 2.0),
        (Variable::Side(1), 0.0, -1.0),
        (Variable::Move(2), 0.0, 20.0),
        (Variable::Time, 0.0, 60.0),
        (Variable::Temperature, 0.0, 21.5),
        (Variable::Payload, 0.0, 4.0),
        (Variable::Point(1), 8.0, 8.0),
    ] {
        assert_eq!((variable.value(&bare), variable.value(&logged)), (without, with), "{variable:?}");
    }
}

const ARM: &str = "
arm: defined
convention: distal
joints:
  - {name: column, d_mm: 150, alpha_deg: 90, sign: -1}
  - {name: arm, a_mm: 400}
  - {name: slide, slides: true, limits_mm: [0, 500]}
targets: {p1: {}, p2: {}}
";

/// The model with one effect that adds this with the parameter `a`.
fn defining(adds: &str, unit: &str) -> Result<Model, String> {
    let define = format!(
        "define:\n  - name: own\n    adds: {{{adds}}}\n    parameters: {{a: {{unit: {unit}, range: [-1, 1]}}}}\n"
    );
    Model::parse("own.yaml", &format!("{ARM}{define}")).map_err(|error| error.to_string())
}

/// What such an effect moves at -0.1 rad, 0.3 rad and 50 mm, and what it looks at.
fn moved(adds: &str, unit: &str) -> (Vec<Contribution>, LooksAt) {
    let model = defining(adds, unit).unwrap_or_else(|error| panic!("{error}"));
    let q = [-0.1, 0.3, 50.0];
    let link_frames = LinkFrames::of(&model.chain, &q, &[]);
    let sample = Sample {
        chain: &model.chain,
        q: &q,
        previous: None,
        approach: &[],
        speed: &[],
        time: 0.0,
        clock: 0.0,
        epoch: 0,
        temperature: 20.0,
        moments: &[],
        weights: Weights { masses: &[], payload: 0.0, down: -Vector3::z() },
        link_frames: &link_frames,
        point: Vector3::new(100.0, 0.0, 0.0),
        hand: Matrix3::identity(),
        trigger: None,
    };
    let effect = build(&parse("own", &model).unwrap(), &model).unwrap();
    let mut contributions = Vec::new();
    effect.contribute(&sample, &mut contributions);
    (contributions, effect.looks_at())
}

#[test]
fn what_is_added_moves_the_number_it_is_added_to_in_inner_units() {
    let degree = 1_f64.to_radians();
    for (adds, unit, dof, rate) in [
        ("joint: column, deg: \"a*q3\"", "deg", Dof::Joint(0, DhParameter::Theta), -50.0 * degree),
        ("joint: slide, mm: \"a*q3\"", "mm", Dof::Joint(2, DhParameter::D), 50.0),
        ("length: arm, mm: \"a*2\"", "mm", Dof::Joint(1, DhParameter::A), 2.0),
        ("offset: arm, mm: \"a*2\"", "mm", Dof::Joint(1, DhParameter::D), 2.0),
        ("twist: arm, deg: \"a*2\"", "deg", Dof::Joint(1, DhParameter::Alpha), 2.0 * degree),
        ("skew: arm, deg: \"a*2\"", "deg", Dof::Joint(1, DhParameter::Beta), 2.0 * degree),
        ("target: p2, y_mm: \"a*q3\"", "mm", Dof::Target(1, 1), 50.0),
        ("base_z_mm: \"a*2\"", "mm", Dof::BaseShift(2), 2.0),
        ("base_x_deg: \"a*2\"", "deg", Dof::BaseRotation(0), 2.0 * degree),
        ("reading_x_mm: \"a*x\"", "mm", Dof::Reading(0), 100.0),
        ("trigger_height_mm: \"a*3\"", "mm", Dof::Trigger, 3.0),
    ] {
        let (contributions, _) = moved(adds, unit);
        assert!(contributions.len() == 1 && contributions[0].dof == dof, "{adds}: {contributions:?}");
        assert!(
            (contributions[0].rate - rate).abs() < 1e-9 * (1.0 + rate.abs()),
            "{adds}: {contributions:?}"
        );
    }
}

#[test]
fn a_definition_looks_at_what_its_formulas_speak_of() {
    assert_eq!(moved("joint: arm, deg: \"a*q1\"", "deg").1, LooksAt::Conditions);
    assert_eq!(moved("joint: arm, deg: \"a*m2\"", "deg").1, LooksAt::Gravity);
    assert_eq!(moved("reading_x_mm: \"a*x\"", "mm").1, LooksAt::Point);
    assert_eq!(
        moved("reading_x_mm: \"a*q1\"", "mm").1,
        LooksAt::Point,
        "what an instrument reads comes last"
    );
    let message = defining("joint: arm, deg: \"a*x\"", "deg").unwrap_err();
    assert!(message.contains("can only change what an instrument reads"), "{message}");
    for (adds, depends) in
        [("\"a*q1\"", false), ("\"a*m2\"", false), ("\"a*side1\"", true), ("\"a*t_s\"", true)]
    {
        let model = defining(&format!("joint: arm, deg: {adds}"), "deg").unwrap();
        assert_eq!(model.definitions[0].depends_on_conditions(), depends, "{adds}");
    }
}

#[test]
fn definitions_are_the_same_where_all_they_say_is() {
    let own = |adds: &str, unit: &str| defining(adds, unit).unwrap().definitions.remove(0);
    let one = own("joint: arm, deg: \"a*q1\"", "deg");
    assert_eq!(one, own("joint: arm, deg: \"a*q1\"", "deg"));
    for (adds, unit) in [
        ("joint: arm, deg: \"a*q2\"", "deg"),
        ("joint: column, deg: \"a*q1\"", "deg"),
        ("joint: arm, deg: \"a*q1\"", "rad"),
        ("joint: arm, deg: \"a*q1\", base_x_mm: \"a\"", "deg"),
    ] {
        assert_ne!(one, own(adds, unit), "{adds} {unit}");
    }
}

#[test]
fn a_formula_without_a_value_somewhere_is_reported_with_the_line_and_the_numbers() {
    let message = |formula: &str| {
        let model = defining(&format!("joint: arm, deg: \"{formula}\""), "deg").unwrap();
        let rows = "q1_deg,q2_deg,q3_mm,p1_x_mm\n0,0,1,5\n0,0,0,6\n";
        let table = Table::parse("t.csv", rows).unwrap();
        let observations = Observations::new(&model, &table).unwrap();
        let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
        problem.check_formulas().map_or_else(|error| error.to_string(), |()| String::new())
    };
    let divided = message("a/q3");
    assert!(divided.contains("gives no finite number in line 3 of t.csv (q3 = 0.0000)"), "{divided}");
    assert!(divided.contains("it divides by zero there"), "{divided}");
    assert!(
        message("a*ln(q3)").contains("a root or logarithm has no value there"),
        "{}",
        message("a*ln(q3)")
    );
    assert!(message("a*q3^-400").contains("it grows beyond all numbers there"));
    assert_eq!(message("a*q3"), "");
}
