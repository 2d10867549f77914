//! What a type is given when the file does not fit, and what is said of it.

#![allow(dead_code, reason = "most values are read to see that they are read")]

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::*;
use crate::{Problem, parse};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Arm {
    arm: String,
    seed: u64,
    length_mm: Spanned<f64>,
    #[serde(default)]
    solid: bool,
    tip_mm: Option<[f64; 3]>,
    optics: Option<Optics>,
    #[serde(default)]
    joints: Vec<Joint>,
    #[serde(default)]
    weights: BTreeMap<String, Joint>,
    word: Option<Word>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Joint {
    name: Spanned<String>,
    deg: f64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Optics {
    None,
    Ideal(Ideal),
    Spot { diameter_mm: f64 },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Ideal {
    height_mm: f64,
}

/// Read by itself, and with no stand-in.
#[derive(Debug)]
struct Word(String);

impl<'de> Deserialize<'de> for Word {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let word = String::deserialize(deserializer)?;
        match word.chars().all(char::is_alphabetic) && !word.is_empty() {
            true => Ok(Self(word)),
            false => Err(de::Error::custom("only letters make a word")),
        }
    }
}

fn read(text: &str) -> (Option<Arm>, Vec<String>) {
    let problems = Problems::default();
    let root = parse(Path::new("f"), text, &problems).expect("YAML");
    let arm = typed(&root, "an arm", &problems);
    let problems = problems.into_result(Path::new("f"), text).err().map(|all| all.problems);
    let in_words = |problem: Problem| {
        let at = problem.span.map(|span| format!("{}:{}", span.line, span.column)).unwrap_or_default();
        format!("{at} {} = {}", problem.message, problem.help.unwrap_or_default())
    };
    (arm, problems.unwrap_or_default().into_iter().map(in_words).collect())
}

const GOOD: &str = "arm: a\nseed: 18446744073709551615\nlength_mm: 5\n";

#[test]
fn what_fits_is_read_with_its_position() {
    let more = "tip_mm: [1, 2, 3]\noptics: {ideal: {height_mm: 4}}\njoints: [{name: q1, deg: 3}]\nsolid: true\nword: a\n";
    let (arm, problems) = read(&format!("{GOOD}{more}"));
    let arm = arm.expect("an arm");
    assert_eq!(problems, [""; 0]);
    assert_eq!(arm.seed, u64::MAX);
    assert_eq!(arm.length_mm, Spanned { span: Span { line: 3, column: 12, length: 1 }, value: 5.0 });
    assert_eq!(arm.joints[0].name.span, Span { line: 6, column: 17, length: 2 });
    assert!(matches!(arm.optics, Some(Optics::Ideal(Ideal { height_mm: 4.0 }))));
}

#[test]
fn one_slip_in_a_key_is_one_mistake() {
    let (_, problems) = read(&GOOD.replace("length_mm", "lenght_mm"));
    assert_eq!(problems, ["3:1 unknown key `lenght_mm` in an arm = did you mean `length_mm`?"]);
    let (_, problems) = read(&GOOD.replace("length_mm", "length_m"));
    assert_eq!(
        problems,
        ["3:1 unknown key `length_m` in an arm = this is not read in `m`: write `length_mm`"]
    );
}

#[test]
fn keys_of_another_program_are_left_aside_where_that_is_wanted() {
    let problems = Problems::default();
    let root = parse(Path::new("f"), &format!("{GOOD}flags: 3\nsoldi: 1\n"), &problems).expect("YAML");
    assert!(typed_with::<Arm>(&root, "an arm", OtherKeys::LeftAside, &problems).is_some());
    assert!(problems.is_empty());
    assert_eq!(root.span_at(&["seed"]), Span { line: 2, column: 7, length: 20 });
    assert_eq!(root.span_at(&["nothing", "here"]).line, 1);
}

#[test]
fn all_missing_keys_are_named() {
    let (_, problems) = read("arm: a\njoints: [{}, {name: b}]\n");
    assert_eq!(
        problems,
        [
            "1:1 an arm needs the key `seed` = ",
            "1:1 an arm needs the key `length_mm` = ",
            "2:10 an entry of `joints` needs the key `name` = ",
            "2:10 an entry of `joints` needs the key `deg` = ",
            "2:14 an entry of `joints` needs the key `deg` = ",
        ]
    );
}

#[test]
fn every_value_of_the_wrong_kind_is_reported_and_the_rest_is_read() {
    let text = "arm: [1]\nseed: -1\nlength_mm: 5 mm\nsolid: 1\ntip_mm: [1, 2]\noptics: {spto: {}}\njoints: [{name: q1, deg: x}, 3]\nweights: {a: {name: 4, deg: true}}\n";
    let (arm, problems) = read(text);
    assert_eq!(
        problems,
        [
            "1:6 `arm` is a text; this is a list = ",
            "2:7 `seed` is -1 = it is a whole number, 0 or more",
            "3:12 `length_mm` is a number; this is the text `5 mm` = the unit belongs to the key; write the number alone: 5",
            "4:8 `solid` is `true` or `false`; this is a number = ",
            "5:9 `tip_mm` has 2 entries = it has 3",
            "6:10 unknown key `spto` in `optics` = did you mean `spot`?",
            "7:26 `deg` is a number; this is the text `x` = ",
            "7:30 an entry of `joints` is a map of keys and values; this is a number = there are `name`, `deg`",
            "8:29 `deg` is a finite number; this is true or false = ",
        ]
    );
    let arm = arm.expect("stand-ins for what is wrong");
    assert_eq!(arm.length_mm.span, Span::NONE);
    assert!(arm.length_mm.value.is_nan() && arm.weights["a"].name.value == "4");
}

#[test]
fn what_a_type_refuses_in_its_own_words_is_shown_where_it_is_and_reading_goes_on() {
    let (arm, problems) = read(&format!("{GOOD}word: a1\nsolid: maybe\n"));
    assert!(arm.is_some(), "an empty option is its stand-in");
    assert_eq!(
        problems,
        [
            "4:7 `word`: only letters make a word = ",
            "5:8 `solid` is `true` or `false`; this is the text `maybe` = "
        ]
    );
}

#[test]
fn a_variant_is_one_key_or_one_word() {
    let reported = |optics: &str| read(&format!("{GOOD}optics: {optics}\n")).1;
    assert_eq!(reported("none"), [""; 0]);
    assert_eq!(
        reported("spot"),
        ["4:9 `optics`: `spot` has keys of its own: write `spot:` with them under it = "]
    );
    assert_eq!(reported("nine"), ["4:9 `optics` is `nine`, which is not known = did you mean `none`?"]);
    assert_eq!(
        reported("{ideal: {height_mm: 1}, spot: {diameter_mm: 2}}"),
        ["4:9 `optics` has one key; this has 2 = there are `none`, `ideal`, `spot`"]
    );
}

/// As [`Arm`], but for what is read by a reader of its own that takes no empty text: such a type cannot be found out.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Tool {
    arm: String,
    seed: u64,
    length_mm: Spanned<f64>,
    #[serde(default)]
    solid: bool,
    tip_mm: Option<[f64; 3]>,
    optics: Option<Optics>,
    #[serde(default)]
    joints: Vec<Joint>,
    #[serde(default)]
    weights: BTreeMap<String, Joint>,
}

#[test]
fn the_schema_of_a_type_knows_its_keys_its_variants_and_what_may_be_left_out() {
    let schema = schema_of::<Tool>();
    assert_eq!(schema["required"], serde_json::json!(["arm", "seed", "length_mm"]));
    assert_eq!(schema["additionalProperties"], false);
    let of = |pointer: &str| schema.pointer(pointer).cloned().unwrap_or_default();
    assert_eq!(of("/properties/length_mm/type"), "number");
    assert_eq!(of("/properties/solid/type"), "boolean");
    assert_eq!(
        (of("/properties/tip_mm/minItems"), of("/properties/tip_mm/items/type")),
        (3.into(), "number".into())
    );
    assert_eq!(of("/properties/joints/items/required"), serde_json::json!(["name", "deg"]));
    assert_eq!(of("/properties/weights/additionalProperties/properties/deg/type"), "number");
    // An enum's words, and its variants that hold something.
    let optics = of("/properties/optics").to_string();
    assert!(optics.contains("\"enum\":[\"none\"]") && optics.contains("\"maxProperties\":1"), "{optics}");
    let message = with_words(schema, "An arm", &[("joints.deg", "Where it is."), ("joints.dge", "Nowhere.")]);
    assert_eq!(message["title"], "An arm");
    assert_eq!(message["properties"]["joints"]["items"]["properties"]["deg"]["description"], "Where it is.");
}
