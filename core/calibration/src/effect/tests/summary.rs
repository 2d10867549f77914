//! What a table has to offer, and effects of slides that its positions cannot show.

use crate::arm_model::Model;
use crate::effect::{
    CandidateContext, Channel, DatasetSummary, EffectId, not_at_these_positions, parse, waves_not_shown,
};
use crate::table::scalar::{DISTANCE, HEIGHT};
use crate::table::{Stretch, Table};

const ARM: &str = "
arm: passport
convention: distal
joints:
  - {name: waist, d_mm: 150, alpha_deg: 90}
  - {name: lift, slides: true, limits_mm: [0, 100], screw_pitch_mm: 5}
links: [{after: waist, mass_kg: 2, centre_mm: [100, 0, 0]}]
targets: {p1: {}}
surfaces:
  table: {plane: {normal: [0, 0, 1], offset_mm: 0}}
  ball: {sphere: {centre_mm: [1, 2, 3], radius_mm: 12}}
  edge: {line: {point_mm: [100, 0, 0], direction: [0, 1, 0], light: right}}
  dim: {line: {point_mm: [100, 0, 0], direction: [0, 1, 0]}}
gravity: [0, -1, 0]
";

fn model() -> Model {
    Model::parse("passport.yaml", ARM).unwrap()
}

fn of(text: &str) -> DatasetSummary {
    DatasetSummary::of(&model(), &Table::parse("table.csv", text).unwrap())
}

#[test]
fn ranges_and_numbers_of_what_was_logged() {
    let summary = of("q1_deg,q2_mm,p1_x_mm,time_s,temperature_c,payload_kg,session,repeat\n\
                       0,10,1,100,20,0,a,r\n90,40,2,160,,0.5,b,r\n-30,25,3,130,24.5,0.25,a,\n");
    assert_eq!((summary.rows, summary.returns, summary.sessions), (3, 2, 2));
    assert_eq!(summary.time_span, Some(60.0));
    assert_eq!(summary.temperature_range, Some(4.5));
    assert_eq!(summary.payload_range, Some(0.5));
    assert_eq!(summary.clocks, [100.0, 130.0, 160.0], "in the order of time");
    assert_eq!(summary.channels, [Channel::X]);
    assert!(summary.measures_points && !summary.triggers && !summary.stripes && !summary.moves);
    assert!((summary.ranges[0].0 + 30_f64.to_radians()).abs() < 1e-12);
    assert!((summary.ranges[0].1 - 90_f64.to_radians()).abs() < 1e-12);
    assert_eq!(summary.ranges[1], (10.0, 40.0));
    assert_eq!(summary.positions, [vec![], vec![10.0, 25.0, 40.0]], "of slides alone");
    let plain = of("q1_deg,q2_mm,height_mm,on\n0,10,1,table\n90,40,2,table\n");
    assert_eq!((plain.time_span, plain.temperature_range, plain.payload_range), (None, None, None));
    assert_eq!(plain.clocks, [0.0, 1.0], "rows, where no time is logged");
    assert!(!plain.measures_points && plain.channels == [Channel::of(&HEIGHT).unwrap()]);
}

#[test]
fn every_number_that_is_read_is_a_channel() {
    let summary =
        of("q1_deg,q2_mm,p1_y_mm,p1_z_mm,distance_mm,distance_to,tilt_y_deg\n0,10,1,,5,ball,\n1,20,,,,,2\n");
    assert_eq!(
        summary.channels,
        [Channel::Y, Channel::of(&DISTANCE).unwrap(), Channel::TiltY],
        "z was never read"
    );
    let touches = of("q1_deg,q2_mm,touch\n0,10,a\n1,20,a\n");
    assert!(touches.measures_points && touches.channels.is_empty());
}

#[test]
fn joints_come_from_both_sides_as_logged_or_by_their_way() {
    let logged = of("q1_deg,q2_mm,p1_x_mm,approach_q1,approach_q2\n0,10,1,1,1\n9,5,2,-1,1\n3,8,3,0,1\n");
    assert_eq!([0, 1].map(|joint| logged.has_both_sides(joint)), [true, false]);
    assert_eq!(logged.both_ways, [false, false], "the way says nothing where sides are logged");
    assert_eq!([0, 1, 7].map(|joint| logged.came_both_ways(joint)), [true, false, false]);
    let ways = of("q1_deg,q2_mm,p1_x_mm\n0,10,1\n9,15,2\n3,20,3\n");
    assert_eq!(ways.both_ways, [true, false], "up and down; only up");
    assert_eq!([0, 1].map(|joint| ways.came_both_ways(joint)), [true, false]);
}

#[test]
fn speeds_are_many_where_they_are_not_all_but_the_sense_of_the_moves() {
    let arm = "arm: two\nconvention: distal\njoints: [{name: a}, {name: b}, {name: c, slides: true}]\ntargets: {p1: {}}\n";
    let model = Model::parse("two.yaml", arm).unwrap();
    let speeds = |rows: &str| {
        let table = format!("q1_deg,q2_deg,q3_mm,p1_x_mm\n{rows}");
        DatasetSummary::of(&model, &Table::parse("table.csv", &table).unwrap()).many_speeds
    };
    // The second goes as far as the first, then a tenth: a correlation of 1.1 / sqrt(2 * 1.01) = 0.77. The only slide is always the fastest slide.
    assert_eq!(speeds("0,0,0,1\n20,20,5,1\n0,18,9,1\n"), [false, true, false]);
    // Nine tenths: 1.9 / sqrt(2 * 1.81) = 0.9986.
    assert_eq!(speeds("0,0,0,1\n20,20,5,1\n0,2,9,1\n"), [false, false, false]);
    assert_eq!(speeds("0,0,0,1\n20,0,5,1\n0,0,9,1\n"), [false, false, false], "one joint at a time");
    assert_eq!(speeds("0,0,0,1\n"), [false, false, false], "no move");
    let summary = of("q1_deg,q2_mm,p1_x_mm\n0,10,1\n");
    assert!(!summary.went_at_many_speeds(0) && !summary.went_at_many_speeds(7));
}

#[test]
fn triggers_are_rows_over_a_surface_that_hold_no_height() {
    let summary = of(
        "q1_deg,q2_mm,height_mm,on,signal\n0,10,1,ball,on\n1,20,,table,on\n2,30,,edge,off\n3,40,,table,\n",
    );
    assert!(summary.triggers);
    assert_eq!(summary.triggered_on, [0, 2], "of the ball a height was read");
    assert!(summary.switches_both_ways);
    assert!(summary.triggers_at_edges(&model()));
    let dim = of("q1_deg,q2_mm,on,signal\n0,10,dim,on\n1,20,dim,on\n");
    assert!(!dim.triggers_at_edges(&model()), "nobody says on which side it is light");
    assert!(!dim.switches_both_ways);
    let heights = of("q1_deg,q2_mm,height_mm,on\n0,10,1,table\n1,20,2,table\n");
    assert!(!heights.triggers && heights.triggered_on.is_empty());
}

#[test]
fn the_greatest_moment_is_that_of_the_weight_where_it_hangs_out_farthest() {
    // 2 kg that hang 100 mm out; what is down is -y of the base, so the moment about z is -2 g 0.1 cos q.
    let summary = of("q1_deg,q2_mm,p1_x_mm\n60,10,1\n90,40,2\n");
    let expected = 2.0 * 9.80665 * 0.1 * 60_f64.to_radians().cos();
    assert!(
        (summary.greatest_moments[0] - expected).abs() < 1e-9,
        "{:?} {expected}",
        summary.greatest_moments
    );
    // A load hangs on the flange: at 90 degrees the slide goes out along x, and 5 kg hang 40 mm out.
    let loaded = of("q1_deg,q2_mm,p1_x_mm,payload_kg\n60,10,1,5\n90,40,2,5\n");
    let expected = 5.0 * 9.80665 * 0.04;
    assert!((loaded.greatest_moments[0] - expected).abs() < 1e-9, "{:?}", loaded.greatest_moments);
}

#[test]
fn pictures_without_a_time_date_nothing() {
    let mut table = Table::parse("table.csv", "q1_deg,q2_mm,p1_x_mm\n0,1,1\n9,2,2\n0,1,3\n").unwrap();
    table.stretches = vec![Stretch::new(0, 0, vec![[0.0; 2]; 5], 0.1)];
    table.speed = Some(vec![0.0, 0.0, 0.0, 0.0, 0.1, 0.0]);
    let summary = DatasetSummary::of(&model(), &table);
    assert!(summary.stripes && summary.moves && summary.clocks.is_empty());
    assert_eq!(summary.many_speeds, [false, false], "read in motion: nothing ended");
    assert_eq!(summary.both_ways, [false, false], "pictures are in the order of their scans");
    table.time = Some(vec![5.0, 7.0, 6.0]);
    table.speed = Some(vec![0.0; 6]);
    let dated = DatasetSummary::of(&model(), &table);
    assert_eq!(dated.clocks, [5.0, 6.0, 7.0]);
    assert!(!dated.moves);
}

/// Why an effect cannot be seen where the slide was measured at these positions.
fn not_seen(positions: &[f64], effect: &str) -> Option<String> {
    let model = model();
    let rows: String = positions.iter().map(|position| format!("0,{position},1\n")).collect();
    let summary = of(&format!("q1_deg,q2_mm,p1_x_mm\n{rows}"));
    let id: EffectId = parse(effect, &model).unwrap();
    not_at_these_positions(&CandidateContext { model: &model, summary: &summary }, &id)
}

#[test]
fn what_positions_cannot_show_is_said_with_those_that_would() {
    let whole: Vec<f64> = (0..15).map(|index| 5.0 * f64::from(index)).collect();
    let message = not_seen(&whole, "screw_wave(lift, 1)").unwrap();
    assert!(message.contains("whole pitches apart, it is the same everywhere"), "{message}");
    // A quarter of the pitch apart, over two pitches.
    assert!(message.contains("a run of positions 1.25 mm apart over 10.0 mm"), "{message}");
    let wide: Vec<f64> = (0..16).map(|index| 6.0 * f64::from(index)).collect();
    let message = not_seen(&wide, "screw_wave(lift, 1)").unwrap();
    assert!(
        message.contains("it looks like a slow wave of 3")
            || message.contains("it looks like a slow wave of 2"),
        "{message}"
    );
    let message = not_seen(&[1.0, 2.0, 3.0], "screw_wave(lift, 1)").unwrap();
    assert!(message.contains("lift was measured at 3 positions, and it takes 5"), "{message}");
    let fine: Vec<f64> = (0..40).map(|index| 1.3 * f64::from(index)).collect();
    assert_eq!(not_seen(&fine, "screw_wave(lift, 1)"), None);
    assert_eq!(not_seen(&whole, "joint_gain(lift)"), None, "it asks for no positions");
    let message = not_seen(&[0.0, 10.0, 20.0, 90.0, 100.0], "positioning_error(lift, 4)").unwrap();
    assert!(message.contains("was not measured near the middle of 25.0 to 75.0 mm"), "{message}");
}

#[test]
fn waves_of_screws_that_were_not_shown_are_listed_with_their_reasons() {
    let model = model();
    let listed = |positions: &[f64]| {
        let rows: String = positions.iter().map(|position| format!("0,{position},1\n")).collect();
        let summary = of(&format!("q1_deg,q2_mm,p1_x_mm\n{rows}"));
        waves_not_shown(&CandidateContext { model: &model, summary: &summary })
    };
    let message = listed(&[0.0, 5.0, 10.0, 15.0, 20.0, 25.0]);
    assert!(
        message.len() == 1 && message[0].starts_with("screw_wave(lift, 1) cannot be identified"),
        "{message:?}"
    );
    assert!(listed(&[7.0, 7.0]).is_empty(), "a slide that stood still was not measured along its travel");
    assert!(listed(&(0..40).map(|step| 1.3 * f64::from(step)).collect::<Vec<_>>()).is_empty());
}
