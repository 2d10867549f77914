//! How effects are written and read, what each of them refuses, and what makes it a candidate.

use crate::arm_model::{Epochs, Model};
use crate::effect::{
    CandidateContext, Channel, DatasetSummary, DrivenBy, EffectId, Family, Parameter, Quantity,
    SKETCH_COLUMNS, Search, Site, SiteKind, build, expand, kind, kinds,
};
use crate::effect::{acts_by_epoch, parse};
use crate::table::Table;

const ARM: &str = "
arm: names
convention: distal
joints:
  - {name: waist, d_mm: 150, alpha_deg: 90, gear_ratio: 36.5}
  - {name: lift, slides: true, limits_mm: [0, 500], screw_pitch_mm: 5}
  - {name: elbow, a_mm: 300}
links: [{after: elbow, mass_kg: 2, centre_mm: [0, 0, 0]}]
targets: {p1: {free: false}, p2: {free: true}}
base: {free: false}
measured_from: world
surfaces:
  table: {plane: {normal: [0, 0, 1], offset_mm: 0}}
  ball: {sphere: {centre_mm: [1, 2, 3], radius_mm: 12}}
  edge: {line: {point_mm: [100, 0, 0], direction: [0, 1, 0], light: right}}
sensor: {working_mm: 8, peak_mm: 5, spot_mm: 3, hysteresis_percent: 10, dark_percent: 7}
epochs: {rows: [3, 5]}
";

fn model() -> Model {
    Model::parse("names.yaml", ARM).unwrap()
}

/// The model without some of its lines.
fn without(parts: &[&str]) -> Model {
    let lines: Vec<&str> = ARM.lines().filter(|line| !parts.iter().any(|part| line.contains(part))).collect();
    Model::parse("names.yaml", &lines.join("\n")).unwrap()
}

fn labels(text: &str) -> Vec<String> {
    let model = model();
    expand(text, &model).unwrap().iter().map(|id| model.label(id)).collect()
}

fn refused(model: &Model, text: &str) -> String {
    match parse(text, model) {
        Err(error) => error.to_string(),
        Ok(id) => build(&id, model).unwrap_err().to_string(),
    }
}

#[test]
fn what_is_written_means_these_effects() {
    for (text, expected) in [
        ("joint_zero(*)", &["joint_zero(waist)", "joint_zero(lift)", "joint_zero(elbow)"][..]),
        ("joint_zero", &["joint_zero(waist)", "joint_zero(lift)", "joint_zero(elbow)"]),
        (" joint_gain( elbow ) ", &["joint_gain(elbow)"]),
        ("joint_harmonic(waist, 2)", &["joint_harmonic(waist, 2)"]),
        ("joint_harmonic(waist, n=36.5)", &["joint_harmonic(waist, 36.5)"]),
        ("joint_coupling(elbow, waist)", &["joint_coupling(elbow, waist)"]),
        ("joint_coupling(elbow, *)", &["joint_coupling(elbow, waist)", "joint_coupling(elbow, lift)"]),
        ("warm_up(elbow, length)", &["warm_up(elbow, length)"]),
        ("tool_offset", &["tool_offset(p1)", "tool_offset(p2)"]),
        ("tool_offset(p2)", &["tool_offset(p2)"]),
        ("reflectance(ball)", &["reflectance(ball)"]),
        ("reflectance(*)", &["reflectance(table)", "reflectance(ball)", "reflectance(edge)"]),
        ("scale(*)", &["scale(x)", "scale(y)", "scale(z)"]),
        ("scale(y)", &["scale(y)"]),
        ("base_tilt(base)", &["base_tilt(base)"]),
        ("instrument_tilt", &["instrument_tilt(instrument)"]),
        ("sensor_tilt(sensor)", &["sensor_tilt(sensor)"]),
        ("reading_reset(tilt_x)", &["reading_reset(tilt_x)"]),
    ] {
        assert_eq!(labels(text), expected, "{text}");
    }
    assert_eq!(expand("reading_reset(*)", &model()).unwrap().len(), Channel::COUNT);
    assert_eq!(expand("joint_coupling(*, *)", &model()).unwrap().len(), 6, "no joint drags itself");
    let geometry = labels("geometry(elbow)");
    let group: Vec<String> = kinds()
        .iter()
        .filter(|kind| kind.geometry_group)
        .map(|kind| format!("{}(elbow)", kind.name))
        .collect();
    assert_eq!(geometry, group);
    assert!(
        geometry.contains(&"link_length(elbow)".to_owned())
            && !geometry.contains(&"joint_gain(elbow)".to_owned())
    );
}

#[test]
fn every_kind_is_found_by_its_name_and_by_no_other() {
    for known in kinds() {
        assert_eq!(kind(known.name).map(|found| found.name), Some(known.name));
        assert!(!known.sentence.is_empty() && !known.how_to_see.is_empty(), "{}", known.name);
    }
    assert!(kind("joint_zer").is_none() && kind("").is_none());
    assert!(acts_by_epoch("base_reset") && !acts_by_epoch("joint_step") && !acts_by_epoch("nothing"));
}

#[test]
fn every_kind_has_a_sketch_that_fits_a_card_and_is_its_own() {
    for (index, known) in kinds().iter().enumerate() {
        for line in known.sketch {
            let columns = line.chars().count();
            assert!(columns <= SKETCH_COLUMNS, "{}: {line} takes {columns} columns", known.name);
        }
        assert!(kinds().iter().skip(index + 1).all(|other| other.sketch != known.sketch), "{}", known.name);
    }
}

/// An effect that is drawn against something of a joint acts on joints, and one by epoch against the order of the rows.
#[test]
fn what_drives_a_kind_is_there_where_it_acts() {
    for known in kinds() {
        let of_a_joint = match known.driven_by {
            DrivenBy::Coordinate
            | DrivenBy::Waves
            | DrivenBy::ScrewTurn
            | DrivenBy::Moment
            | DrivenBy::OtherJoint
            | DrivenBy::WayOfArrival
            | DrivenBy::LastMove
            | DrivenBy::Speed => true,
            DrivenBy::Weights
            | DrivenBy::Temperature
            | DrivenBy::Time
            | DrivenBy::RowOrder
            | DrivenBy::InstrumentAxis
            | DrivenBy::Several => false,
        };
        let on_joints =
            [SiteKind::Joints, SiteKind::JointsAndOrder, SiteKind::JointsAndPieces, SiteKind::JointPairs];
        assert!(!of_a_joint || on_joints.contains(&known.sites), "{}", known.name);
        assert_eq!(
            known.driven_by == DrivenBy::OtherJoint,
            known.sites == SiteKind::JointPairs,
            "{}",
            known.name
        );
        assert_eq!(known.driven_by == DrivenBy::RowOrder, known.family == Family::Epoch, "{}", known.name);
        assert_eq!(
            known.driven_by.is_weight(),
            ["joint_compliance", "joint_stiffening", "link_sag", "link_torsion"].contains(&known.name)
        );
    }
}

#[test]
fn what_is_written_wrongly_is_refused_with_what_would_be_right() {
    let model = model();
    for (text, part) in [
        ("joint_zeros(elbow)", "there is no effect `joint_zeros`; did you mean `joint_zero`?"),
        (
            "joint_zero(elbo)",
            "`joint_zero` acts on a joint, and there is none called `elbo`; did you mean `elbow`?",
        ),
        ("tool_offset(p9)", "acts on a target, and there is none called `p9`"),
        ("reflectance(tabel)", "acts on a surface, and there is none called `tabel`; did you mean `table`?"),
        (
            "reading_reset(hight)",
            "acts on a reading, and there is none called `hight`; did you mean `height`?",
        ),
        ("joint_zero(elbow", "is no effect; write a name and its place"),
        ("joint_zero elbow)", "is no effect; write a name and its place"),
        ("joint_zero((elbow))", "is no effect; write a name and its place"),
        ("", "is no effect; write a name and its place"),
        ("joint_zero(elbow, waist)", "write joint_zero(joint)"),
        ("joint_harmonic(elbow)", "write joint_harmonic(joint, periods a turn)"),
        ("joint_harmonic(elbow, 0)", "write joint_harmonic(joint, periods a turn)"),
        ("joint_harmonic(elbow, -2)", "write joint_harmonic(joint, periods a turn)"),
        ("joint_harmonic(elbow, inf)", "write joint_harmonic(joint, periods a turn)"),
        ("joint_harmonic(elbow, twice)", "write joint_harmonic(joint, periods a turn)"),
        ("positioning_error(lift)", "write positioning_error(joint, pieces)"),
        ("joint_coupling(elbow)", "write joint_coupling(joint, other joint)"),
        ("warm_up(elbow, width)", "write warm_up(joint, zero|length|offset)"),
        ("tool_offset(p1, p2)", "write tool_offset(p1)"),
        ("scale(w)", "write scale(x|y|z)"),
        ("reflectance(table, ball)", "write reflectance(surface)"),
        ("reading_reset(x, y)", "write reading_reset(x|y|z|height|distance|"),
        ("base_tilt(elbow)", "write base_tilt"),
        ("joint_zero(*)", "one effect at one place"),
    ] {
        let message = refused(&model, text);
        assert!(message.contains(part), "{text}: {message}");
    }
}

#[test]
fn an_effect_says_what_the_model_lacks_for_it() {
    let model = model();
    for (text, part) in [
        ("joint_coupling(elbow, elbow)", "joint_coupling(wrist_bend, wrist_roll): the joint that is dragged"),
        ("joint_step(elbow)", "needs the moment of the jump"),
        ("warm_up(elbow, zero)", "needs a time constant, in s"),
        ("joint_stiffening(elbow)", "needs the moment at which it stiffens, in N m"),
        ("screw_wave(elbow, 1)", "a turning one has joint_harmonic"),
        ("reflectance(edge)", "needs a plane or a ball of the model's `surfaces:`"),
        ("camera_roll", "is of the rig of a light stripe, which no model file holds"),
        ("clock_skew", "is of the rig of a light stripe, which no model file holds"),
        ("axis_pitch(elbow)", "is of a joint that slides"),
    ] {
        let message = refused(&model, text);
        assert!(message.contains(part), "{text}: {message}");
    }
    for text in ["sensor_tilt", "trigger_spot", "trigger_hysteresis", "reflectance(table)"] {
        let message = refused(&without(&["sensor:"]), text);
        assert!(message.contains("needs the arm's sensor described in the model file"), "{text}: {message}");
    }
    for text in
        ["base_reset", "base_shifted(x)", "reading_reset(x)", "target_reset(p1)", "joint_zero_reset(elbow)"]
    {
        let message = refused(&without(&["epochs:"]), text);
        assert!(message.contains("needs rows among which something was re-set"), "{text}: {message}");
    }
    // Places that no text can name: an effect put together in memory.
    for (id, part) in [
        (EffectId::at("joint_zero", Site::Joint(3)), "needs a joint to act on"),
        (EffectId::at("joint_zero", Site::Base), "needs a joint to act on"),
        (EffectId::at("tool_offset", Site::Target(2)), "needs a target to act on, such as p1"),
        (EffectId::at("scale", Site::Axis(3)), "write scale(x)"),
        (EffectId::at("base_shifted", Site::Base), "needs an axis: x, y or z"),
        (EffectId::at("reading_reset", Site::Base), "needs a reading, such as distance"),
        (EffectId::at("reading_rescaled", Site::Base), "needs a reading, such as distance"),
        (
            EffectId::at("joint_harmonic", Site::Joint(0)),
            "joint_harmonic(waist, 1): joint and periods a turn",
        ),
        (EffectId::at("warm_up", Site::Joint(0)), "warm_up(elbow, zero): the joint"),
    ] {
        let message = build(&id, &model).unwrap_err().to_string();
        assert!(message.contains(part), "{id:?}: {message}");
    }
    let of_nothing =
        EffectId { inner: Some(-5.0), of: Some(Quantity::Zero), ..EffectId::at("warm_up", Site::Joint(0)) };
    assert!(build(&of_nothing, &model).unwrap_err().to_string().contains("needs a time constant"));
}

#[test]
fn units_go_by_whether_a_joint_slides_and_by_the_reading() {
    let model = model();
    let first = |text: &str, inner: Option<f64>| {
        let id = EffectId { inner, ..parse(text, &model).unwrap() };
        let built = build(&id, &model).unwrap();
        (built.parameters()[0].name.clone(), built.parameters()[0].unit.name)
    };
    for (text, inner, name, unit) in [
        ("joint_zero(elbow)", None, "zero_deg", "deg"),
        ("joint_zero(lift)", None, "zero_mm", "mm"),
        ("joint_backlash(elbow)", None, "play_deg", "deg"),
        ("joint_backlash(lift)", None, "play_mm", "mm"),
        ("joint_step(elbow)", Some(5.0), "step_deg", "deg"),
        ("joint_step(lift)", Some(5.0), "step_mm", "mm"),
        ("warm_up(elbow, zero)", Some(5.0), "amount_deg", "deg"),
        ("warm_up(lift, zero)", Some(5.0), "amount_mm", "mm"),
        ("warm_up(elbow, length)", Some(5.0), "amount_mm", "mm"),
        ("joint_zero_reset(elbow)", None, "epoch_2_deg", "deg"),
        ("joint_zero_reset(lift)", None, "epoch_2_mm", "mm"),
        ("reading_reset(distance)", None, "epoch_2_mm", "mm"),
        ("reading_reset(tilt_y)", None, "epoch_2_deg", "deg"),
        ("reading_rescaled(distance)", None, "epoch_2_excess", "1"),
        ("axis_roll(lift)", None, "roll_deg_per_m", "deg/m"),
    ] {
        assert_eq!(first(text, inner), (name.to_owned(), unit), "{text}");
    }
    let resets = build(&parse("base_reset", &model).unwrap(), &model).unwrap();
    assert_eq!(resets.parameters().len(), 12, "six numbers in each of two epochs after the first");
    assert_eq!(resets.parameters()[11].name, "epoch_3_z_deg");
}

#[test]
fn the_base_has_a_heading_of_its_own_only_where_the_first_joint_has_not() {
    let numbers = |model: &Model| {
        let built = build(&parse("base_tilt", model).unwrap(), model).unwrap();
        built.parameters().iter().map(|parameter| parameter.name.clone()).collect::<Vec<_>>()
    };
    assert_eq!(numbers(&model()), ["x_deg", "y_deg"], "the waist turns about the base's z");
    let slide = ARM.replace(
        "{name: waist, d_mm: 150, alpha_deg: 90, gear_ratio: 36.5}",
        "{name: waist, slides: true, alpha_deg: 90}",
    );
    assert_eq!(numbers(&Model::parse("slide.yaml", &slide).unwrap()), ["x_deg", "y_deg", "z_deg"]);
}

/// What is offered by a kind where a table has these columns: as people write it.
fn offered(model: &Model, name: &str, table: &str) -> Vec<String> {
    let table = Table::parse("table.csv", table).unwrap();
    let summary = DatasetSummary::of(model, &table);
    let context = CandidateContext { model, summary: &summary };
    (kind(name).unwrap().candidates)(&context).iter().map(|id| model.label(id)).collect()
}

const POINTS: &str = "q1_deg,q2_mm,q3_deg,p1_x_mm\n0,1,0,5\n9,2,9,6\n18,3,40,7\n";

#[test]
fn epochs_make_candidates_of_what_may_have_been_re_set() {
    let (two, one) = (model(), without(&["epochs:"]));
    let heights = "q1_deg,q2_mm,q3_deg,height_mm,on\n0,1,0,5,table\n9,2,9,6,table\n";
    assert_eq!(offered(&two, "base_reset", POINTS), ["base_reset(base)"]);
    assert_eq!(offered(&two, "target_reset", POINTS), ["target_reset(p1)", "target_reset(p2)"]);
    assert_eq!(offered(&two, "reading_reset", POINTS), ["reading_reset(x)"]);
    assert_eq!(offered(&two, "reading_rescaled", POINTS), ["reading_rescaled(x)"]);
    let tilts = "q1_deg,q2_mm,q3_deg,tilt_x_deg\n0,1,0,5\n9,2,9,6\n";
    assert_eq!(offered(&two, "reading_reset", tilts), ["reading_reset(tilt_x)"]);
    assert!(offered(&two, "reading_rescaled", tilts).is_empty(), "the scale of an angle is none");
    // Of measured points a shift of the base along one axis is the zero of that coordinate.
    assert!(offered(&two, "base_shifted", POINTS).is_empty());
    assert_eq!(offered(&two, "base_shifted", heights).len(), 3);
    for name in ["base_reset", "target_reset", "reading_reset", "reading_rescaled", "joint_zero_reset"] {
        assert!(offered(&one, name, POINTS).is_empty(), "{name} without epochs");
    }
    assert!(offered(&one, "base_shifted", heights).is_empty());
    assert_eq!(offered(&two, "joint_zero_reset", POINTS).len(), 3);
    // One jump of one joint is joint_step.
    let mut once = model();
    once.epochs = Some(Epochs::Rows(vec![3]));
    assert!(offered(&once, "joint_zero_reset", POINTS).is_empty());
    // At the dated row, whatever moments the coarse grid has.
    let many = |rows: usize| {
        let points = (0..rows).map(|row| format!("{row},1,0,700,{row},0\n")).collect::<String>();
        format!("q1_deg,q2_mm,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n{points}")
    };
    let at = |model: &Model| {
        let table = Table::parse("t.csv", &many(400)).unwrap();
        let summary = DatasetSummary::of(model, &table);
        let steps = (kind("joint_step").unwrap().candidates)(&CandidateContext { model, summary: &summary });
        steps.iter().filter(|id| id.inner == Some(149.0)).count()
    };
    once.epochs = Some(Epochs::Rows(vec![150]));
    assert_eq!(at(&once), 3, "one for each joint");
    assert_eq!(at(&one), 0, "the coarse grid has every seventh row");
    once.epochs = Some(Epochs::Times(vec![3.0]));
    assert!(offered(&once, "joint_zero_reset", POINTS).is_empty());
    once.epochs = Some(Epochs::Times(vec![3.0, 4.0]));
    assert_eq!(offered(&once, "joint_zero_reset", POINTS).len(), 3);
}

#[test]
fn triggers_make_candidates_of_what_the_sensor_may_do() {
    let model = model();
    let table = |rows: &str| format!("q1_deg,q2_mm,q3_deg,on,signal\n{rows}");
    let over_one = table("0,1,0,table,on\n9,2,9,table,on\n");
    let over_two = table("0,1,0,table,on\n9,2,9,ball,off\n");
    let at_edge = table("0,1,0,table,on\n9,2,9,edge,off\n");
    assert_eq!(offered(&model, "trigger_height", &over_one), ["trigger_height(sensor)"]);
    assert_eq!(offered(&model, "sensor_tilt", &over_one), ["sensor_tilt(sensor)"]);
    // Over one surface alone its reflectance is the sensor's height.
    assert!(offered(&model, "reflectance", &over_one).is_empty());
    assert_eq!(offered(&model, "reflectance", &over_two), ["reflectance(table)", "reflectance(ball)"]);
    assert!(offered(&model, "reflectance", &at_edge).is_empty(), "an edge has none");
    assert!(offered(&model, "trigger_hysteresis", &over_one).is_empty(), "it only came on");
    assert_eq!(offered(&model, "trigger_hysteresis", &over_two), ["trigger_hysteresis(sensor)"]);
    assert!(offered(&model, "trigger_spot", &over_two).is_empty());
    assert_eq!(offered(&model, "trigger_spot", &at_edge), ["trigger_spot(sensor)"]);
    for name in ["trigger_height", "sensor_tilt", "reflectance", "trigger_hysteresis", "trigger_spot"] {
        assert!(offered(&model, name, POINTS).is_empty(), "{name} where nothing triggered");
    }
    let blind = without(&["sensor:"]);
    for name in ["sensor_tilt", "reflectance", "trigger_hysteresis", "trigger_spot"] {
        assert!(offered(&blind, name, &over_two).is_empty(), "{name} of a sensor that is not described");
    }
}

#[test]
fn what_is_searched_for_is_tried_at_these_places() {
    let model = model();
    let harmonics = offered(&model, "joint_harmonic", POINTS);
    // 64 orders each of two joints that turn, and three by the gear of the waist: half its ratio, the ratio, twice it.
    assert_eq!(harmonics.len(), 2 * 64 + 3);
    for order in ["18.25", "36.5", "73"] {
        assert!(harmonics.contains(&format!("joint_harmonic(waist, {order})")), "{order}");
    }
    let table = Table::parse("table.csv", POINTS).unwrap();
    let mut summary = DatasetSummary::of(&model, &table);
    let inner = |summary: &DatasetSummary, name: &str| -> Vec<f64> {
        let ids = (kind(name).unwrap().candidates)(&CandidateContext { model: &model, summary });
        let mut of_elbow: Vec<f64> =
            ids.iter().filter(|id| id.joint() == Some(2)).filter_map(|id| id.inner).collect();
        of_elbow.dedup();
        of_elbow
    };
    // Four rows on either side of a jump.
    summary.clocks = (0..8).map(f64::from).collect();
    assert!(inner(&summary, "joint_step").is_empty());
    summary.clocks = (0..10).map(f64::from).collect();
    assert_eq!(inner(&summary, "joint_step"), [4.0, 5.0]);
    // At most sixty of them: of 128 in between every third.
    summary.clocks = (0..136).map(f64::from).collect();
    let moments = inner(&summary, "joint_step");
    assert_eq!((moments.len(), moments[0], moments[1]), (43, 4.0, 7.0));
    // Rows at which epochs begin are moments, too, where four rows lie on either side.
    let dated = Model::parse("names.yaml", &ARM.replace("[3, 5]", "[3, 9, 134]")).unwrap();
    let steps =
        (kind("joint_step").unwrap().candidates)(&CandidateContext { model: &dated, summary: &summary });
    let of_elbow: Vec<f64> =
        steps.iter().filter(|id| id.joint() == Some(2)).filter_map(|id| id.inner).collect();
    assert_eq!((of_elbow.len(), of_elbow.last()), (44, Some(&8.0)), "{of_elbow:?}");
    summary.greatest_moments = vec![0.0, 0.0, 10.0];
    let knees = inner(&summary, "joint_stiffening");
    let near = |found: &[f64], expected: &[f64]| {
        found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9)
    };
    assert!(near(&knees, &[0.3, 0.7, 1.5, 3.0]), "{knees:?}");
    summary.greatest_moments = vec![0.0; 3];
    assert!(inner(&summary, "joint_stiffening").is_empty(), "without a moment there is no knee");
    summary.time_span = Some(1000.0);
    let constants = inner(&summary, "warm_up");
    assert!(
        near(&constants[..8], &[40.0, 80.0, 150.0, 250.0, 400.0, 700.0, 1200.0, 2500.0]),
        "{constants:?}"
    );
    summary.time_span = Some(0.0);
    assert!(inner(&summary, "warm_up").is_empty());
}

#[test]
fn a_search_costs_as_much_as_the_parameters_it_replaces() {
    let equations = 100.0_f64;
    assert_eq!(Search::Nothing.cost(equations), 0.0);
    // ln(100) = 4.605 by Schwarz; a jump counts twice.
    assert!((Search::Smooth.cost(equations) - 4.605_170_186).abs() < 1e-9);
    assert!((Search::Jumps.cost(equations) - 9.210_340_372).abs() < 1e-9);
}

#[test]
fn free_numbers_and_frames_leave_no_room_for_some_effects() {
    let (fixed, slides) = (model(), offered(&model(), "axis_pitch", POINTS));
    assert_eq!(slides, ["axis_pitch(lift)"]);
    assert_eq!(offered(&fixed, "base_tilt", POINTS), ["base_tilt(base)"]);
    assert_eq!(offered(&fixed, "base_position", POINTS), ["base_position(base)"]);
    assert_eq!(offered(&fixed, "instrument_tilt", POINTS), ["instrument_tilt(instrument)"]);
    assert_eq!(offered(&fixed, "tool_offset", POINTS), ["tool_offset(p1)"], "p2 is free anyhow");
    let free = Model::parse("free.yaml", &ARM.replace("base: {free: false}", "base: {free: true}")).unwrap();
    assert!(
        offered(&free, "base_tilt", POINTS).is_empty() && offered(&free, "base_position", POINTS).is_empty()
    );
    let anywhere = without(&["measured_from:"]);
    assert!(offered(&anywhere, "instrument_tilt", POINTS).is_empty(), "an instrument that may be anywhere");
    let heights = "q1_deg,q2_mm,q3_deg,height_mm,on\n0,1,0,5,table\n9,2,9,6,table\n";
    assert!(
        offered(&fixed, "instrument_tilt", heights).is_empty()
            && offered(&fixed, "scale", heights).is_empty()
    );
    assert_eq!(offered(&fixed, "scale", POINTS).len(), 3);
}

#[test]
fn an_effect_is_the_same_whatever_was_searched_for_inside() {
    let model = model();
    let at = |text: &str, inner: f64| EffectId { inner: Some(inner), ..parse(text, &model).unwrap() };
    assert!(at("joint_step(elbow)", 5.0).same_as(&at("joint_step(elbow)", 9.0)));
    for (one, other) in [
        ("joint_zero(elbow)", "joint_zero(waist)"),
        ("joint_zero(elbow)", "joint_gain(elbow)"),
        ("joint_harmonic(elbow, 1)", "joint_harmonic(elbow, 2)"),
        ("joint_coupling(elbow, waist)", "joint_coupling(elbow, lift)"),
        ("warm_up(elbow, zero)", "warm_up(elbow, length)"),
    ] {
        assert!(!at(one, 1.0).same_as(&at(other, 1.0)), "{one} and {other}");
    }
    assert_eq!(at("tool_offset(p1)", 0.0).joint(), None);
    assert_eq!(at("joint_zero(elbow)", 0.0).joint(), Some(2));
    for (index, channel) in Channel::all().enumerate() {
        assert_eq!((Channel::by_name(channel.name()), channel.index()), (Some(channel), index));
    }
    for quantity in Quantity::ALL {
        assert_eq!(Quantity::by_name(&quantity.to_string()), Some(quantity));
    }
}

#[test]
fn what_changes_a_coordinate_names_its_own_joint() {
    let model = model();
    for joint in [0, 2] {
        let name = &model.chain.joints[joint].name;
        for text in [
            "joint_gain(JOINT)",
            "joint_backlash(JOINT)",
            "joint_settling(JOINT)",
            "joint_lag(JOINT)",
            "joint_harmonic(JOINT, 2)",
            "joint_coupling(JOINT, lift)",
            "joint_step(JOINT)",
        ] {
            // The moment of a step; the others search for nothing.
            let inner = text.starts_with("joint_step").then_some(5.0);
            let id = EffectId { inner, ..parse(&text.replace("JOINT", name), &model).unwrap() };
            assert_eq!(build(&id, &model).unwrap().changes_coordinate(), Some(joint), "{text} of {name}");
        }
    }
    let slides = "arm: axes\nconvention: distal\njoints:\n  - {name: x, slides: true, limits_mm: [0, 90], screw_pitch_mm: 5}\n  - {name: y, slides: true, limits_mm: [0, 90], screw_pitch_mm: 5}\ntargets: {p1: {}}\n";
    let slides = Model::parse("axes.yaml", slides).unwrap();
    for (joint, name) in ["x", "y"].into_iter().enumerate() {
        let wave = parse(&format!("screw_wave({name}, 1)"), &slides).unwrap();
        assert_eq!(build(&wave, &slides).unwrap().changes_coordinate(), Some(joint));
    }
    let tilt = parse("base_tilt", &model).unwrap();
    assert_eq!(build(&tilt, &model).unwrap().changes_coordinate(), None);
}

#[test]
fn what_goes_by_time_is_gradual_unless_it_happens_at_one_moment() {
    let gradual = |name: &str| kind(name).unwrap().changes_gradually();
    assert!(gradual("warm_up") && gradual("drift"));
    assert!(!gradual("joint_step") && !gradual("joint_gain"));
}

/// An error may be nothing, and has a sign unless it is one that cannot: no kind is plausible on one side alone by a slip.
#[test]
fn nothing_at_all_is_a_plausible_size_of_every_number() {
    let model = model();
    let sites =
        [Site::Joint(0), Site::Joint(1), Site::Joint(2), Site::Base, Site::Target(0), Site::Target(1)];
    let more =
        [Site::Instrument, Site::Sensor, Site::Axis(0), Site::Surface(0), Site::Surface(1), Site::Surface(2)];
    let mut found = std::collections::BTreeSet::new();
    for kind in kinds() {
        for site in sites.into_iter().chain(more) {
            for of in [None, Some(Quantity::Zero), Some(Quantity::Length)] {
                for (order, inner) in [(None, None), (None, Some(5.0)), (Some(2.0), None)] {
                    let with = Some(1).filter(|_| kind.name == "joint_coupling");
                    let id = EffectId { of, order, inner, with, ..EffectId::at(kind.name, site) };
                    let Ok(built) = build(&id, &model) else { continue };
                    found.insert(kind.name);
                    for Parameter { name, range: (low, high), .. } in built.parameters() {
                        assert!(low < high && *low <= 0.0 && *high >= 0.0, "{id:?}, {name}: {low} {high}");
                    }
                }
            }
        }
    }
    // All but those of a light stripe, of readings, and of a camera.
    assert!(found.len() >= 35, "{} of {}: {found:?}", found.len(), kinds().len());
}
