//! Jumps in made-up readings of a draw wire and of a tracker.

use super::*;
use crate::laboratory::Options;
use crate::outcome::Verdict;
use crate::split::Holdout;
use plumb_calibration::arm_model::Model;
use plumb_calibration::effect::Site;
use plumb_calibration::table::Table;
use plumb_estimation::Random;

/// A column arm: waist, shoulder, elbow; lengths 200 and 150 mm over a foot of 300 mm.
const ARM: &str = "
arm: column
convention: distal
joints:
  - {name: waist, d_mm: 300, alpha_deg: 90}
  - {name: shoulder, a_mm: 200}
  - {name: elbow, a_mm: 150}
base: {free: false}
measured_from: world
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
surfaces: {anchor: {point_mm: [500, 100, 50], free: true}}
free: [joint_zero(*)]
noise: {p1_mm: 0.05, distance_mm: 0.05}
";

/// What is wrong in a row, rad and mm: of the joints, of the base, of a reading of length.
#[derive(Clone, Copy, Default)]
struct Wrong {
    joints: [f64; 3],
    base: [f64; 3],
    length: f64,
}

fn tip(q: [f64; 3], wrong: &Wrong) -> [f64; 3] {
    let [waist, shoulder, elbow] = [0, 1, 2].map(|joint| q[joint].to_radians() + wrong.joints[joint]);
    let radius = 200.0 * shoulder.cos() + 150.0 * (shoulder + elbow).cos();
    let height = 300.0 + 200.0 * shoulder.sin() + 150.0 * (shoulder + elbow).sin();
    let [x, y, z] = [radius * waist.cos(), radius * waist.sin(), height];
    [x + wrong.base[0], y + wrong.base[1], z + wrong.base[2]]
}

/// A table of `rows` poses, each with something wrong: lengths of a wire, or positions.
fn laboratory(rows: usize, wire: bool, seed: u64, wrong: impl Fn(usize) -> Wrong) -> Laboratory {
    let mut random = Random::seeded(seed);
    let mut text = "q1_deg,q2_deg,q3_deg,".to_owned();
    text.push_str(if wire { "distance_mm,distance_to\n" } else { "p1_x_mm,p1_y_mm,p1_z_mm\n" });
    for row in 0..rows {
        let q = [
            240.0 * random.uniform() - 120.0,
            70.0 * random.uniform() + 10.0,
            90.0 * random.uniform() - 100.0,
        ];
        let wrong = wrong(row);
        let [x, y, z] = tip(q, &wrong);
        text.push_str(&format!("{},{},{}", q[0], q[1], q[2]));
        let mut noise = || 0.05 * random.normal();
        if wire {
            let length = ((x - 500.0).powi(2) + (y - 100.0).powi(2) + (z - 50.0).powi(2)).sqrt();
            text.push_str(&format!(",{},anchor\n", length + wrong.length + noise()));
        } else {
            text.push_str(&format!(",{},{},{}\n", x + noise(), y + noise(), z + noise()));
        }
    }
    let model = Model::parse("model.yaml", ARM).unwrap();
    let table = Table::parse("table.csv", &text).unwrap();
    Laboratory::new(model, table, Options { holdout: Holdout::None, ..Options::default() }).unwrap()
}

/// The first rows after the jumps that are found, from 1.
fn found(lab: &Laboratory) -> Vec<usize> {
    let dated = lab.dated(&Progress::unwatched()).unwrap();
    dated.map_or_else(Vec::new, |dated| dated.jumps.iter().map(|jump| jump.between_rows[1]).collect())
}

fn length(length: f64) -> Wrong {
    Wrong { length, ..Wrong::default() }
}

/// The value of an epoch: `starts` are rows from 0.
fn by_epoch(row: usize, starts: &[usize], values: &[f64]) -> f64 {
    values[starts.iter().filter(|start| row >= **start).count()]
}

#[test]
fn one_two_and_three_jumps_of_a_wires_zero_are_dated_to_the_row() {
    let one = laboratory(200, true, 1, |row| length(by_epoch(row, &[80], &[0.0, 0.3])));
    assert_eq!(found(&one), [81]);
    let two = laboratory(240, true, 2, |row| length(by_epoch(row, &[60, 150], &[0.0, 0.4, 0.0])));
    assert_eq!(found(&two), [61, 151]);
    let three =
        laboratory(300, true, 3, |row| length(by_epoch(row, &[40, 140, 220], &[0.0, 0.4, -0.2, 0.3])));
    assert_eq!(found(&three), [41, 141, 221]);
}

#[test]
fn epochs_are_searched_once_however_many_questions_begin_with_them() {
    let lab = laboratory(200, true, 1, |row| length(by_epoch(row, &[80], &[0.0, 0.3])));
    let [one, other] = [(); 2].map(|()| lab.dated(&Progress::unwatched()).unwrap().unwrap());
    assert!(std::ptr::eq(one, other));
    // A copy is made to be changed: it searches anew.
    assert_eq!(found(&lab.clone()), [81]);
}

#[test]
fn jumps_of_a_joints_zero_and_of_the_base_are_dated() {
    let of_joint = |row| Wrong {
        joints: [0.0, by_epoch(row, &[70, 130], &[0.0, 0.002, -0.001]), 0.0],
        ..Wrong::default()
    };
    assert_eq!(found(&laboratory(200, false, 4, of_joint)), [71, 131]);
    let of_base = |row| Wrong { base: [0.0, by_epoch(row, &[90], &[0.0, 0.25]), 0.0], ..Wrong::default() };
    assert_eq!(found(&laboratory(200, false, 5, of_base)), [91]);
}

#[test]
fn without_a_jump_none_is_found_in_98_of_100_tables() {
    let false_finds = (0..100).filter(|seed| {
        let wire = seed % 2 == 0;
        !found(&laboratory(150, wire, 100 + seed, |_| Wrong::default())).is_empty()
    });
    assert!(false_finds.count() <= 2);
}

#[test]
fn a_jump_is_reported_where_the_rows_show_it_beside_what_was_found() {
    let watch = Progress::unwatched();
    let jump = Jump { between_rows: [45, 46], between_lines: [46, 47], at_s: None };
    // The base is 5 mm off in every row: beside that an elbow that jumps by 0.3 mm at the tip shows only once the base is known.
    let kept = |elbow: f64, jumps: &[Jump]| {
        let lab = laboratory(90, false, 31, |row| Wrong {
            joints: [0.0, 0.0, by_epoch(row, &[45], &[0.0, elbow])],
            base: [5.0, 0.0, 0.0],
            ..Wrong::default()
        });
        let base = plumb_calibration::effect::parse("base_position", lab.model()).unwrap();
        let found = [AddedEffect { id: base, values: vec![0.0; 3] }];
        let near = lab.fit_with(&[], None, &watch).unwrap();
        lab.jumps_beside(jumps.to_vec(), &found, &near, &watch).unwrap()
    };
    let elsewhere = Jump { between_rows: [45 + JUMP_ROWS, 46 + JUMP_ROWS], ..jump.clone() };
    let dated = [jump];
    assert_eq!(kept(0.002, &dated), dated);
    assert_eq!(kept(0.0, &dated), []);
    assert_eq!(kept(0.002, &[dated[0].clone(), elsewhere]), dated);
    assert_eq!(kept(0.002, &[]), [], "none is looked for that was not seen before");
}

#[test]
fn a_slow_drift_is_no_jump() {
    for seed in 0..10 {
        let drift = laboratory(240, true, 300 + seed, |row| length(0.6 * row as f64 / 240.0));
        assert_eq!(found(&drift), [0_usize; 0], "a straight drift, seed {seed}");
        let warming =
            laboratory(240, true, 400 + seed, |row| length(0.6 * (1.0 - (-(row as f64) / 60.0).exp())));
        assert_eq!(found(&warming), [0_usize; 0], "warming up, seed {seed}");
    }
}

/// Of two numbers one drifts, and the other jumps at row 500 of 600: many small steps of the first explain more than the jump does.
#[test]
fn a_number_that_jumps_is_found_beside_one_that_drifts_and_explains_more() {
    let found = |jump: f64| {
        let mut random = Random::seeded(8);
        let (mut residuals, mut steps) = (Vec::new(), nalgebra::DMatrix::zeros(2, 600));
        for row in 0..600 {
            let drifting = random.normal();
            steps.set_column(row, &nalgebra::DVector::from_column_slice(&[drifting, 1.0]));
            let drift = (row as f64 / 40.0).sin();
            residuals.push(drift * drifting + by_epoch(row, &[500], &[0.0, jump]) + 0.1 * random.normal());
        }
        let effect = |name| EffectId::at(name, Site::Base);
        starts(&Columns {
            rows: (0..600).collect(),
            positions: (0..600).map(f64::from).collect(),
            ranges: (0..600).map(|row| row..row + 1).collect(),
            residuals,
            fitted: nalgebra::DMatrix::from_element(1, 600, 1.0),
            steps,
            ids: vec![effect("reading_rescaled"), effect("reading_reset")],
        })
    };
    let jumping = found(1.5).unwrap();
    assert_eq!((jumping.number, jumping.abrupt), (1, vec![500]));
    assert_eq!(found(0.0), None);
}

/// One joint was driven along its range in order: its wave is a smooth curve of the rows, of which a cubic explains little. Where rows are held out
/// the curve goes on, and what it does there is no jump.
#[test]
fn a_wave_of_a_joint_that_was_measured_in_order_is_no_jump() {
    let found = |seed: u64, jump: f64, held_out: usize| {
        let mut random = Random::seeded(seed);
        let position = |row: usize| (if row < 20 { row } else { row + held_out }) as f64;
        let wave = |row: usize| (position(row) * 5.0_f64.to_radians() - 2.6).sin();
        let residuals =
            (0..60).map(|row| wave(row) + by_epoch(row, &[35], &[0.0, jump]) + 0.04 * random.normal());
        starts(&Columns {
            rows: (0..60).collect(),
            positions: (0..60).map(position).collect(),
            ranges: (0..60).map(|row| row..row + 1).collect(),
            residuals: residuals.collect(),
            fitted: nalgebra::DMatrix::from_element(1, 60, 1.0),
            steps: nalgebra::DMatrix::from_element(1, 60, 1.0),
            ids: vec![EffectId::at("reading_reset", Site::Base)],
        })
    };
    for seed in 0..20 {
        assert_eq!(found(seed, 0.0, 0), None, "seed {seed}");
        assert_eq!(found(seed, 0.0, 10), None, "seed {seed}, ten rows held out");
        let starts = found(seed, 1.0, 0).unwrap().abrupt;
        assert!(starts.contains(&35), "seed {seed}: {starts:?}");
    }
}

#[test]
fn a_wires_zero_that_jumps_twice_is_in_the_verdict_with_its_rows() {
    let lab = laboratory(240, true, 6, |row| length(by_epoch(row, &[60, 150], &[0.0, 0.4, -0.3])));
    let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
    let rows: Vec<[usize; 2]> = diagnosis.jumps.iter().map(|jump| jump.between_rows).collect();
    assert_eq!(rows, [[60, 61], [150, 151]]);
    let found = diagnosis.named.iter().map(|named| &named.effect).chain(&diagnosis.tied);
    let found: Vec<(&str, &str)> = found.map(|one| (one.effect.as_str(), one.site.as_str())).collect();
    assert!(found.contains(&("reading_reset", "distance")), "{found:?}: {diagnosis:#?}");
}

#[test]
fn a_joints_zero_that_jumps_twice_under_a_tracker_is_named() {
    let of_joint = |row| Wrong {
        joints: [0.0, by_epoch(row, &[70, 130], &[0.0, 0.003, -0.002]), 0.0],
        ..Wrong::default()
    };
    let diagnosis = laboratory(200, false, 7, of_joint).diagnose(&Progress::unwatched()).unwrap();
    assert_eq!(diagnosis.verdict, Verdict::Named, "{diagnosis:#?}");
    let named = diagnosis.named.unwrap();
    assert_eq!((named.effect.effect.as_str(), named.effect.site.as_str()), ("joint_zero_reset", "shoulder"));
    let size = 0.005_f64.to_degrees();
    assert!((named.size - size).abs() < 4.0 * named.se, "{} +- {} for {size}", named.size, named.se);
}

#[test]
fn a_last_joint_whose_zero_jumps_is_tied_with_the_target() {
    // The target sits on the elbow's link: a turn of the elbow is a shift of the target.
    let of_joint = |row| Wrong {
        joints: [0.0, 0.0, by_epoch(row, &[70, 130], &[0.0, 0.003, -0.002])],
        ..Wrong::default()
    };
    let diagnosis = laboratory(200, false, 7, of_joint).diagnose(&Progress::unwatched()).unwrap();
    assert_eq!(diagnosis.verdict, Verdict::Tied, "{diagnosis:#?}");
    let tied: Vec<&str> = diagnosis.tied.iter().map(|one| one.effect.as_str()).collect();
    for effect in ["joint_zero_reset", "target_reset"] {
        assert!(tied.contains(&effect), "{effect} is not in {tied:?}");
    }
}

#[test]
fn what_was_added_by_epoch_is_in_the_written_model_with_its_epochs() {
    let lab = laboratory(240, true, 8, |row| length(by_epoch(row, &[60, 150], &[0.0, 0.4, -0.3])));
    let added = lab.add("reading_reset(distance)", &Progress::unwatched()).unwrap();
    assert_eq!(added.model.epochs, Some(Epochs::Rows(vec![61, 151])));
    assert!(added.rms_mm.fit < 0.06 && added.before.fit > 0.1, "{:?} {:?}", added.before, added.rms_mm);
    let text = plumb_calibration::file::model_text(&added.model);
    let again = Model::parse("again.yaml", &text).unwrap();
    assert_eq!(again.epochs, added.model.epochs);
    let values = |model: &Model| model.effects[0].values.clone();
    let pairs = values(&again).into_iter().zip(values(&added.model));
    assert!(pairs.into_iter().all(|(read, written)| (read - written).abs() < 1e-8));
}

#[test]
fn rows_that_err_alike_inflate_the_variance_of_their_sum() {
    // Four ones, window 2: 1 + 2 (1 - 1/3) 3/4 + 2 (1 - 2/3) 2/4 = 7/3.
    assert!((search::long_run_variance_ratio(&[1.0; 4]) - 7.0 / 3.0).abs() < 1e-12);
    assert_eq!(
        search::long_run_variance_ratio(&[1.0, -1.0, 1.0, -1.0]),
        1.0,
        "never below that of independent rows"
    );
    assert_eq!(search::long_run_variance_ratio(&[0.0; 9]), 1.0);
    assert_eq!(search::long_run_variance_ratio(&[]), 1.0);
}

/// Sixty readings of a polynomial of the ninth degree, the highest that counts as a smooth curve.
#[test]
fn a_step_is_chance_where_a_curve_of_any_degree_that_counts_does_as_well_without_it() {
    let chance = |jump: f64, first: f64| {
        let mut random = Random::seeded(12);
        let residuals = (0..60).map(|row| {
            let x = (f64::from(row) - 29.5) / 29.5;
            (9.0 * x.acos()).cos() + if row < 30 { 0.0 } else { jump } + 0.01 * random.normal()
        });
        let columns = Columns {
            rows: (0..60).collect(),
            positions: (0..60).map(|row| first + f64::from(row)).collect(),
            ranges: (0..60).map(|row| row..row + 1).collect(),
            residuals: residuals.collect(),
            fitted: nalgebra::DMatrix::from_element(1, 60, 1.0),
            steps: nalgebra::DMatrix::from_element(1, 60, 1.0),
            ids: vec![EffectId::at("reading_reset", Site::Base)],
        };
        search::step_beside_a_curve(&columns, 0, 30, (0, 60))
    };
    // Wherever in the table they are.
    for first in [0.0, 1000.0] {
        assert_eq!(chance(0.0, first), 1.0);
        assert!(chance(0.2, first) < 1e-6, "{}", chance(0.2, first));
    }
}

#[test]
fn a_jump_is_looked_for_where_an_epoch_fits_on_either_side() {
    // Nothing is fitted: two epochs of the fewest rows are enough, and one row less is not.
    let looked_for = |rows: usize| {
        let lab = laboratory(rows, true, 5, move |row| length(by_epoch(row, &[JUMP_ROWS], &[0.0, 5.0])));
        let mut model = Model { free: Vec::new(), ..lab.model().clone() };
        model.surfaces.iter_mut().for_each(|surface| surface.free = false);
        let lab = lab.with_model(model);
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        assert_eq!(fitted.fit.rank(), 0);
        lab.find_epochs(&fitted, &Progress::unwatched()).unwrap().is_some()
    };
    assert!(looked_for(2 * JUMP_ROWS) && !looked_for(2 * JUMP_ROWS - 1));
    // Sixteen rows, and one for each number that is fitted.
    assert!(may_show_a_jump(16, 0) && !may_show_a_jump(15, 0));
    assert!(may_show_a_jump(21, 5) && !may_show_a_jump(20, 5));
}

#[test]
fn only_the_geometry_is_held_and_a_model_without_any_has_no_stiffer_one() {
    let held = |free: &[&str]| {
        let model = Model::parse("model.yaml", ARM).unwrap();
        let free = free.iter().map(|pattern| (*pattern).to_owned()).collect();
        with_geometry_held(&Model { free, ..model }).map(|model| model.free)
    };
    let (zeros, lengths) = ("joint_zero(*)", "link_length(*)");
    assert_eq!(held(&[zeros, lengths, "link_twist(elbow)"]), Some(vec![zeros.to_owned()]));
    assert_eq!(held(&[lengths]), Some(Vec::new()));
    assert_eq!(held(&[zeros]), None);
    assert_eq!(held(&[]), None);
}

#[test]
fn epochs_go_by_time_where_it_is_logged_and_by_rows_where_it_is_not() {
    let rows = laboratory(60, false, 8, |_| Wrong::default());
    let timed = crate::testing::with_table(&rows, |table| {
        table.time = Some((0..60).map(|row| 10.0 * f64::from(row)).collect());
    });
    let named = |lab: &Laboratory| {
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        lab.named_epochs(&Columns::of(lab, &fitted, &Progress::unwatched()).unwrap().rows, &[20])
    };
    let (epochs, jumps) = named(&rows);
    assert_eq!(epochs, Epochs::Rows(vec![21]));
    assert_eq!((jumps[0].between_rows, jumps[0].between_lines, jumps[0].at_s), ([20, 21], [21, 22], None));
    let (epochs, jumps) = named(&timed);
    assert_eq!((epochs, jumps[0].at_s), (Epochs::Times(vec![200.0]), Some(200.0)));
}

#[test]
fn epochs_are_the_sessions_where_each_jump_lies_between_two_and_there_alone() {
    let lab = crate::testing::with_table(&laboratory(60, false, 8, |_| Wrong::default()), |table| {
        table.session.names = ["mon", "tue"].map(str::to_owned).to_vec();
        table.session.of_row = (0..60).map(|row| Some(u32::from(row >= 30))).collect();
    });
    let named = |starts: &[usize]| {
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        lab.named_epochs(&Columns::of(&lab, &fitted, &Progress::unwatched()).unwrap().rows, starts).0
    };
    assert_eq!(named(&[30]), Epochs::Sessions(vec!["mon".to_owned(), "tue".to_owned()]));
    assert_eq!(named(&[20]), Epochs::Rows(vec![21]));
    assert_eq!(named(&[20, 30]), Epochs::Rows(vec![21, 31]));
}

#[test]
fn an_event_begins_an_epoch_beside_those_that_are_known() {
    let at = |lab: &Laboratory, moment: f64| {
        let event = EffectId { inner: Some(moment), ..EffectId::at("joint_step", Site::Joint(1)) };
        let dated = lab.clone();
        let dated = dated.dated_at(&event, &Progress::unwatched()).unwrap();
        dated.map(|dated| (dated.laboratory.model().epochs.clone().unwrap(), dated.jumps.len()))
    };
    let rows = laboratory(120, false, 9, |_| Wrong::default());
    assert_eq!(at(&rows, 50.0), Some((Epochs::Rows(vec![51]), 1)));
    // An epoch has at least eight rows on either side.
    assert_eq!(at(&rows, 8.0), Some((Epochs::Rows(vec![9]), 1)));
    assert_eq!(at(&rows, 7.0), None);
    assert_eq!(at(&rows, 112.0), Some((Epochs::Rows(vec![113]), 1)));
    assert_eq!(at(&rows, 113.0), None);
    let timed = crate::testing::with_table(&rows, |table| {
        table.time = Some((0..120).map(|row| 10.0 * f64::from(row)).collect());
    });
    assert_eq!(at(&timed, 500.0), Some((Epochs::Times(vec![500.0]), 1)));
    let jumping = laboratory(200, true, 1, |row| length(by_epoch(row, &[80], &[0.0, 0.3])));
    assert_eq!(at(&jumping, 140.0), Some((Epochs::Rows(vec![81, 141]), 2)));
    assert_eq!(at(&jumping, 87.0), None, "one begins seven rows before");
    assert_eq!(at(&jumping, 88.0), Some((Epochs::Rows(vec![81, 89]), 2)));
    let of_its_own = rows.with_epochs(Epochs::Rows(vec![31]));
    assert_eq!(at(&of_its_own, 50.0), None, "the model's own epochs are the user's");
    let event = EffectId::at("joint_zero_reset", Site::Joint(1));
    assert!(rows.dated_at(&event, &Progress::unwatched()).unwrap().is_none(), "an event between epochs");
}

/// A base that sinks beside waves of the shoulder along the rows: the search for change points takes the jump for one more of them, and a jump of a joint fits
/// the rows best.
#[test]
fn where_a_joint_seems_to_have_jumped_the_base_and_the_instrument_are_asked_as_well() {
    let wrong = |row: usize| Wrong {
        joints: [0.0, 0.0015 * ((row as f64 / 8.0).sin() + (row as f64 / 24.8).cos()), 0.0],
        base: [0.0, 0.0, by_epoch(row, &[90], &[0.0, 0.3])],
        ..Wrong::default()
    };
    let lab = laboratory(180, false, 506, wrong);
    assert_eq!(found(&lab), [0_usize; 0], "no jump is dated");
    let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
    assert_eq!(diagnosis.verdict, Verdict::Tied, "{diagnosis:#?}");
    assert_eq!(diagnosis.jumps.len(), 1);
    let tied: Vec<&str> = diagnosis.tied.iter().map(|one| one.effect.as_str()).collect();
    for effect in ["joint_step", "base_reset", "reading_reset"] {
        assert!(tied.contains(&effect), "{effect} is not in {tied:?}");
    }
    assert_eq!(found(&lab).len(), 1, "what is added next knows the epoch");
}
