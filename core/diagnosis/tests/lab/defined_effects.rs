//! Effects a user writes down as formulas: they take part like any other, and bad formulas say what is wrong.

use plumb_calibration::arm_model::Model;
use plumb_calibration::file::model_text;
use plumb_diagnosis::Verdict;
use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, column_tip, laboratory, try_laboratory};

const KNOWN: &str =
    "base: {free: true}\ntargets: {p1: {free: true}}\nmeasured_from: world\nfree: [joint_zero(*)]\n";

fn model(define: &str) -> String {
    format!("{COLUMN_ARM}{KNOWN}noise: {{p1_mm: 0.02}}\ndefine:\n{define}")
}

const BELT: &str = r#"  - name: belt_error
    where: shoulder
    adds: {joint: shoulder, deg: "a*sin(2.5*q2) + b*cos(2.5*q2)"}
    parameters: {a: {unit: deg, range: [-1, 1]}, b: {unit: deg, range: [-1, 1]}}
"#;

/// Positions of the column arm; `wrong` changes what it really does: joints in degrees, then the tip in mm.
fn table(wrong: impl Fn([f64; 3]) -> [f64; 3], moved: impl Fn([f64; 3], [f64; 3]) -> [f64; 3]) -> String {
    let mut rng = Xorshift::seeded(21);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for q in column_poses(80, 21) {
        let [x, y, z] = moved(q, column_tip(wrong(q))).map(|part| part + rng.noise(0.02));
        text.push_str(&format!("{:.5},{:.5},{:.5},{x:.5},{y:.5},{z:.5}\n", q[0], q[1], q[2]));
    }
    text
}

fn belt(q: [f64; 3]) -> [f64; 3] {
    let angle = (2.5 * q[1]).to_radians();
    [q[0], q[1] + 0.08 * angle.sin() - 0.05 * angle.cos(), q[2]]
}

fn still(_: [f64; 3], tip: [f64; 3]) -> [f64; 3] {
    tip
}

#[test]
fn a_formula_is_diagnosed_previewed_and_added_like_any_other_effect() {
    let laboratory = laboratory(&model(BELT), &table(belt, still), Options::default());
    let watch = Progress::unwatched();
    let diagnosis = laboratory.diagnose(&watch).unwrap();
    assert_eq!(diagnosis.verdict, Verdict::Named, "{}", diagnosis_sentence(&diagnosis));
    let named = diagnosis.named.unwrap();
    assert_eq!((named.effect.effect.as_str(), named.effect.site.as_str()), ("belt_error", "shoulder"));
    let preview = laboratory.preview("belt_error", &watch).unwrap();
    assert!(preview.after.fit < 0.5 * preview.before.fit, "{:?} {:?}", preview.before, preview.after);
    let addition = laboratory.add("belt_error(shoulder)", &watch).unwrap();
    assert!(addition.rms_mm.fit < 0.06, "{:?}", addition.rms_mm);
    let values = &addition.model.effects.last().unwrap().values;
    assert!((values[0] - 0.08).abs() < 0.004 && (values[1] + 0.05).abs() < 0.004, "{values:?}");
    // The next revision's text holds formula and values, and reads back as the same model.
    let text = model_text(&addition.model);
    assert!(text.contains("a*sin(2.5*q2) + b*cos(2.5*q2)"), "{text}");
    let again = Model::parse("rev1.yaml", &text).unwrap();
    assert_eq!(again.definitions, addition.model.definitions);
    assert_eq!(again.effects[0].id, addition.model.effects[0].id);
}

/// A defined effect of one parameter comes out at what was hidden.
fn comes_out(define: &str, name: &str, table: &str, hidden: f64, slack: f64) {
    let options = Options { holdout: Holdout::None, ..Options::default() };
    let addition = laboratory(&model(define), table, options).add(name, &Progress::unwatched()).unwrap();
    let found = &addition.added[0];
    assert!((found.size - hidden).abs() < slack, "{name}: {} +- {} for {hidden}", found.size, found.se);
    assert!(addition.rms_mm.fit < 0.06, "{name}: {:?}", addition.rms_mm);
}

#[test]
fn a_formula_may_change_a_length_a_target_or_what_the_instrument_reads() {
    let length = r#"  - {name: soft_link, adds: {length: shoulder, mm: "k*cos(q1)"}, parameters: {k: {unit: mm, range: [-5, 5]}}}"#;
    let along = |q: [f64; 3], tip: [f64; 3]| {
        let [waist, shoulder, _] = q.map(f64::to_radians);
        let longer = 0.6 * waist.cos();
        [
            tip[0] + longer * shoulder.cos() * waist.cos(),
            tip[1] + longer * shoulder.cos() * waist.sin(),
            tip[2] + longer * shoulder.sin(),
        ]
    };
    comes_out(length, "soft_link", &table(|q| q, along), 0.6, 0.03);
    let target = r#"  - {name: loose_tool, adds: {target: p1, x_mm: "k*sin(q3)"}, parameters: {k: {unit: mm, range: [-5, 5]}}}"#;
    let pushed = |q: [f64; 3], tip: [f64; 3]| {
        let [waist, shoulder, elbow] = q.map(f64::to_radians);
        let (out, up) = ((shoulder + elbow).cos(), (shoulder + elbow).sin());
        let push = 0.4 * elbow.sin();
        [tip[0] + push * out * waist.cos(), tip[1] + push * out * waist.sin(), tip[2] + push * up]
    };
    comes_out(target, "loose_tool", &table(|q| q, pushed), 0.4, 0.05);
    let instrument = r#"  - {name: bowed_rail, where: z, adds: {reading_z_mm: "k*(x/100)^2"}, parameters: {k: {unit: mm, range: [-1, 1]}}}"#;
    let bowed = |_: [f64; 3], tip: [f64; 3]| [tip[0], tip[1], tip[2] + 0.05 * (tip[0] / 100.0).powi(2)];
    comes_out(instrument, "bowed_rail", &table(|q| q, bowed), 0.05, 0.004);
    let base = r#"  - {name: creeping, adds: {base_x_mm: "k*sin(q2)^2"}, parameters: {k: {unit: mm, range: [-5, 5]}}}"#;
    let creeps =
        |q: [f64; 3], tip: [f64; 3]| [tip[0] + 0.3 * q[1].to_radians().sin().powi(2), tip[1], tip[2]];
    comes_out(base, "creeping", &table(|q| q, creeps), 0.3, 0.03);
}

#[test]
fn a_formula_may_change_the_height_at_which_the_sensor_triggers() {
    // The sensor triggers over a table 200 mm high at 8 mm and more where it looks askance.
    let text = format!(
        "{COLUMN_ARM}base: {{free: false}}\ntargets: {{p1: {{free: false}}}}\nmeasured_from: world
surfaces: {{table: {{plane: {{normal: [0, 0, 1], offset_mm: 200}}}}}}
define:
  - {{name: askance, adds: {{trigger_height_mm: \"k*sin(q2+q3)^2\"}}, parameters: {{k: {{unit: mm, range: [-20, 20]}}}}}}
"
    );
    let (mut rows, mut rng) = ("q1_deg,q2_deg,q3_deg,on\n".to_owned(), Xorshift::seeded(5));
    for _ in 0..40 {
        let (waist, shoulder) = (rng.between(-90.0, 90.0), rng.between(-10.0, 12.0));
        let miss = |elbow: f64| {
            let askance = (shoulder + elbow).to_radians().sin().powi(2);
            column_tip([waist, shoulder, elbow])[2] - 200.0 - 8.0 - 3.0 * askance
        };
        let (mut low, mut high) = (-90.0 - shoulder, -5.0 - shoulder);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if miss(middle) > 0.0 { high = middle } else { low = middle }
        }
        rows.push_str(&format!("{waist},{shoulder},{:.7},table\n", low + rng.noise(0.001)));
    }
    let options = Options { holdout: Holdout::None, ..Options::default() };
    let watch = Progress::unwatched();
    let first = laboratory(&text, &rows, options.clone()).add("trigger_height", &watch).unwrap();
    let both = laboratory(&model_text(&first.model), &rows, options).add("askance", &watch).unwrap();
    let sizes: Vec<f64> = both.comparison.effects.iter().map(|effect| effect.size).collect();
    assert!((sizes[0] - 8.0).abs() < 0.05 && (sizes[1] - 3.0).abs() < 0.05, "{sizes:?}");
}

/// What is said of a model with this `adds` for a parameter `a`.
fn message(adds: &str) -> String {
    let define =
        format!("  - name: mine\n    adds: {adds}\n    parameters: {{a: {{unit: deg, range: [-1, 1]}}}}\n");
    match try_laboratory(&model(&define), &table(|q| q, still), Options::default()) {
        Err(reported) => reported,
        Ok(_) => "no error".to_owned(),
    }
}

fn says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is missing in: {message}");
    }
}

fn of_joint(formula: &str) -> String {
    message(&format!("{{joint: shoulder, deg: {formula:?}}}"))
}

#[test]
fn a_slope_that_begins_far_from_zero_is_a_formula_too() {
    for slope in [
        "a*max(q2 - 2.5, 0)",
        "a*min(q2 + 2.5, 0)",
        "a*max(m2 - 300, 0)",
        "a*sign(q1 + 1.9)*max(-40 - m3, 0)",
    ] {
        let define = format!(
            "  - name: slope\n    where: shoulder\n    adds: {{joint: shoulder, deg: \"{slope}\"}}\n    parameters: {{a: {{unit: deg, range: [-1, 1]}}}}\n"
        );
        let read = Model::parse("model.yaml", &model(&define));
        assert!(read.is_ok(), "{slope}: {}", read.err().map_or_else(String::new, |error| error.to_string()));
    }
    let never = model(
        "  - name: slope\n    where: shoulder\n    adds: {joint: shoulder, deg: \"a*0 + max(q2, 0)*0*a\"}\n    parameters: {a: {unit: deg, range: [-1, 1]}}\n",
    );
    assert!(
        Model::parse("model.yaml", &never)
            .unwrap_err()
            .to_string()
            .contains("depends on none of the parameters")
    );
}

#[test]
fn a_sign_before_a_power_is_that_of_the_power() {
    // As everywhere in mathematics: -q^2 is minus the square.
    let of = |formula: &str| {
        let define = format!(
            "  - name: bend\n    where: shoulder\n    adds: {{joint: shoulder, deg: \"{formula}\"}}\n    parameters: {{a: {{unit: deg, range: [-1, 1]}}}}\n"
        );
        let wrong = |q: [f64; 3]| [q[0], q[1] - 0.1 * q[1].to_radians().powi(2), q[2]];
        let laboratory = laboratory(&model(&define), &table(wrong, still), Options::default());
        laboratory.add("bend", &Progress::unwatched()).unwrap().model.effects.last().unwrap().values[0]
    };
    for formula in ["-a*q2^2", "a*(-q2^2)", "a * -q2^2", "a*(1 - q2^2 - 1)", "-q2^2*a", "a*(-(q2)^2)"] {
        assert!((of(formula) - 0.1).abs() < 0.01, "{formula}: {}", of(formula));
    }
    assert!((of("a*q2^2*2^-1") + 0.2).abs() < 0.02, "{}", of("a*q2^2*2^-1"));
}

#[test]
fn a_formula_that_divides_by_zero_names_the_row() {
    says(
        &of_joint("a/(q2 - q2)"),
        &[
            "model.yaml: line ",
            "column ",
            "`mine`",
            "no finite number in line 2 of table.csv",
            "q2 = ",
            "divides by zero",
        ],
    );
}

#[test]
fn a_formula_that_loops_or_is_a_program_is_refused() {
    says(&of_joint("loop { a }"), &["`loop` has no place in a formula", "no loops and no statements"]);
    says(&of_joint("while true { a = a + 1.0 }"), &["`while` has no place"]);
    says(&of_joint("{ let x = a; x }"), &["has no place in"]);
    let deep = format!("a*{}q2{}", "sin(".repeat(3000), ")".repeat(3000));
    says(&of_joint(&deep), &["is no formula"]);
}

#[test]
fn names_shapes_and_places_of_formulas_are_checked() {
    says(&of_joint("a*sin(q9)"), &["speaks of `q9`", "neither a parameter nor a quantity"]);
    says(&of_joint("a*sni(q2)"), &["speaks of `sni`", "did you mean `sin`?"]);
    says(&of_joint("a*sin("), &["model.yaml:", "is no formula"]);
    says(&of_joint("sin(a*q2)"), &["must grow in proportion to its parameters"]);
    says(&of_joint("a*q2 + 1"), &["must grow in proportion to its parameters"]);
    says(&of_joint("q2"), &["must grow in proportion"]);
    says(&of_joint("a*x"), &["can only change what an instrument reads"]);
    says(&message("{joint: sholder, deg: \"a*q2\"}"), &["no joint `sholder`", "did you mean `shoulder`?"]);
    says(&message("{joint: shoulder, mm: \"a*q2\"}"), &["what is added here is in deg"]);
    says(&message("{x_mm: \"a*q2\"}"), &["moves a target\n", "name it"]);
    says(&message("{}"), &["says nothing that is added"]);
}

#[test]
fn names_of_the_library_cannot_be_taken() {
    let define = BELT.replace("belt_error", "joint_zero");
    let reported = try_laboratory(&model(&define), &table(|q| q, still), Options::default()).unwrap_err();
    says(&reported, &["there is an effect `joint_zero` already\n", "choose another name"]);
    let twice = format!("{BELT}{BELT}");
    let reported = try_laboratory(&model(&twice), &table(|q| q, still), Options::default()).unwrap_err();
    says(&reported, &["there is an effect `belt_error` already"]);
}
