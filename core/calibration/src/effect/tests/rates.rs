//! What each kind moves, and how fast, in a row of which everything is given by hand: numbers, signs and units worked out beside the code.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Vector3};
use plumb_kinematics::{DhParameter, LinkFrames, Weights};

use crate::arm_model::{Epochs, Model, RigNumber, Sensor, StripeRig};
use crate::effect::{
    Channel, Contribution, Dof, EffectId, LooksAt, Sample, Trigger, build, expand, kinds, parse,
};
use crate::table::scalar::{DISTANCE, HEIGHT};

/// A column that counts against its axis, an arm of 400 mm and a slide, with everything an effect may need.
const ARM: &str = "
arm: rates
convention: distal
joints:
  - {name: column, d_mm: 150, alpha_deg: 90, sign: -1}
  - {name: arm, a_mm: 400, d_mm: 20}
  - {name: slide, slides: true, limits_mm: [0, 500], screw_pitch_mm: 5}
targets: {p1: {}, p2: {}}
surfaces:
  table: {plane: {normal: [0, 0, 1], offset_mm: 0}}
  edge: {line: {point_mm: [100, 0, 0], direction: [0, 1, 0], light: right}}
  ball: {sphere: {centre_mm: [1, 2, 3], radius_mm: 12}}
sensor: {working_mm: 8, peak_mm: 5, spot_mm: 3, hysteresis_percent: 40, dark_percent: 20}
";

/// A trigger over the table, 8 mm below, on the way down.
const OVER_TABLE: Trigger =
    Trigger { surface: 0, edge: false, light: 0.0, came_on: true, distance: 8.0, sensor: None };

/// One at the edge, which is light on its right, on the way up.
const AT_EDGE: Trigger = Trigger { surface: 1, edge: true, light: -1.0, came_on: false, ..OVER_TABLE };

fn model() -> Model {
    Model::parse("rates.yaml", ARM).unwrap()
}

/// The contributions of an effect where the circumstances are what `set` makes of a row at -0.1 rad, 0.3 rad and 50 mm.
fn contributions_in(model: &Model, id: &EffectId, set: impl FnOnce(&mut Sample<'_>)) -> Vec<Contribution> {
    let q = [-0.1, 0.3, 50.0];
    let link_frames = LinkFrames::of(&model.chain, &q, &[]);
    let mut sample = Sample {
        chain: &model.chain,
        q: &q,
        previous: None,
        approach: &[],
        speed: &[],
        time: f64::NAN,
        clock: f64::NAN,
        epoch: 0,
        temperature: f64::NAN,
        moments: &[2.0, -3.0, 0.5],
        weights: Weights { masses: &[], payload: 0.0, down: -Vector3::z() },
        link_frames: &link_frames,
        point: Vector3::new(100.0, -200.0, 300.0),
        hand: Matrix3::identity(),
        trigger: None,
    };
    set(&mut sample);
    let mut contributions = Vec::new();
    build(id, model).unwrap().contribute(&sample, &mut contributions);
    contributions
}

fn contributions(effect: &str, set: impl FnOnce(&mut Sample<'_>)) -> Vec<Contribution> {
    let model = model();
    contributions_in(&model, &parse(effect, &model).unwrap(), set)
}

/// The same with what is searched for inside.
fn searched(effect: &str, inner: f64, set: impl FnOnce(&mut Sample<'_>)) -> Vec<Contribution> {
    let model = model();
    let id = EffectId { inner: Some(inner), ..parse(effect, &model).unwrap() };
    contributions_in(&model, &id, set)
}

fn one(dof: Dof, rate: f64) -> Vec<Contribution> {
    vec![Contribution { parameter: 0, dof, rate }]
}

/// The contributions are these, one after the other, their rates within rounding.
fn assert_same(found: &[Contribution], expected: &[Contribution], what: &str) {
    let same = |(found, expected): (&Contribution, &Contribution)| {
        found.parameter == expected.parameter
            && found.dof == expected.dof
            && (found.rate - expected.rate).abs() < 1e-7 * (1.0 + expected.rate.abs())
    };
    assert!(
        found.len() == expected.len() && found.iter().zip(expected).all(same),
        "{what}: {found:?} instead of {expected:?}"
    );
}

const COLUMN: Dof = Dof::Joint(0, DhParameter::Theta);
const ARM_ANGLE: Dof = Dof::Joint(1, DhParameter::Theta);
const SLIDE: Dof = Dof::Joint(2, DhParameter::D);

#[test]
fn what_changes_a_coordinate_turns_the_row_in_the_coordinates_own_sense() {
    let plain = |effect: &str| contributions(effect, |_| {});
    // The column counts against its axis: everything in its coordinate's sense changes sign in its row.
    assert_same(&plain("joint_zero(column)"), &one(COLUMN, -1.0), "zero");
    assert_same(&plain("joint_zero(slide)"), &one(SLIDE, 1.0), "zero of a slide");
    assert_same(&plain("joint_gain(column)"), &one(COLUMN, 0.1), "gain: -1 times -0.1 rad");
    assert_same(&plain("joint_gain(slide)"), &one(SLIDE, 50.0), "gain of a slide");
    assert_same(&plain("joint_coupling(column, arm)"), &one(COLUMN, -0.3), "dragged by the arm");
    assert_same(&plain("joint_coupling(arm, column)"), &one(ARM_ANGLE, -0.1), "dragged by the column");
    let (sine, cosine) = (0.6_f64.sin(), 0.6_f64.cos());
    let wave = [
        Contribution { parameter: 0, dof: ARM_ANGLE, rate: sine },
        Contribution { parameter: 1, dof: ARM_ANGLE, rate: cosine },
    ];
    assert_same(&plain("joint_harmonic(arm, 2)"), &wave, "two periods a turn at 0.3 rad");
    // 51.25 mm would be a quarter turn of a screw of 5 mm on from a whole one; 50 mm is a whole one.
    let whole = [
        Contribution { parameter: 0, dof: SLIDE, rate: 0.0 },
        Contribution { parameter: 1, dof: SLIDE, rate: 1.0 },
    ];
    assert_same(&plain("screw_wave(slide, 1)"), &whole, "at ten turns of the screw");
}

#[test]
fn gravity_turns_a_row_about_its_axis_whatever_the_coordinates_sense() {
    assert_same(&contributions("joint_compliance(column)", |_| {}), &one(COLUMN, 2.0), "2 N m, no sign");
    assert_same(&contributions("joint_compliance(arm)", |_| {}), &one(ARM_ANGLE, -3.0), "-3 N m");
    // 10 = w + w^3 for w = 2, so a moment of ten knees winds the spring by two of them.
    let stiff = searched("joint_stiffening(column)", 0.2, |_| {});
    assert_same(&stiff, &one(COLUMN, 0.4), "2 N m at a knee of 0.2");
    let other = searched("joint_stiffening(arm)", 1.5, |_| {});
    assert_same(&other, &one(ARM_ANGLE, -1.5), "-3 N m at a knee of 1.5: -2 = w + w^3 at w = -1");
}

#[test]
fn play_is_half_of_it_behind_the_side_and_a_move_below_the_scatter_is_none() {
    let play = |set: fn(&mut Sample<'_>)| contributions("joint_backlash(arm)", set);
    assert_same(&play(|row| row.approach = &[0, 1, 0]), &one(ARM_ANGLE, -0.5), "from below");
    assert_same(&play(|row| row.approach = &[0, -1, 0]), &one(ARM_ANGLE, 0.5), "from above");
    assert_same(&play(|row| row.approach = &[1, 0, 1]), &one(ARM_ANGLE, 0.0), "not known of this joint");
    // Sides that are logged count, whatever the way from the row before.
    let both = play(|row| {
        row.approach = &[0, 1, 0];
        row.previous = Some(&[0.0, 0.9, 0.0]);
    });
    assert_same(&both, &one(ARM_ANGLE, -0.5), "a logged side goes before the way");
    // Without sides by the way: 1 mrad is a move, less is the scatter of what was read.
    for (before, rate) in [(0.3 - 0.0011, -0.5), (0.3 - 0.0009, 0.0), (0.3 + 0.0011, 0.5), (0.3, 0.0)] {
        let previous: &'static [f64] = Box::leak(Box::new([0.0, before, 0.0]));
        let found = contributions("joint_backlash(arm)", |row| row.previous = Some(previous));
        assert_same(&found, &one(ARM_ANGLE, rate), "the way from the row before");
    }
}

#[test]
fn lag_goes_with_the_speed_of_the_joint_among_those_of_its_kind() {
    let lag =
        |effect: &str, before: &'static [f64]| contributions(effect, move |row| row.previous = Some(before));
    // The row is at -0.1 rad, 0.3 rad and 50 mm.
    assert_same(&lag("joint_lag(arm)", &[-0.5, 0.1, 0.0]), &one(ARM_ANGLE, -0.5), "half the longest way");
    assert_same(
        &lag("joint_lag(arm)", &[-0.2, 0.5, 0.0]),
        &one(ARM_ANGLE, 1.0),
        "the longest way, downwards",
    );
    // The column counts against its axis.
    assert_same(&lag("joint_lag(column)", &[-0.5, 0.1, 0.0]), &one(COLUMN, 1.0), "the longest way, upwards");
    // A slide's millimetres are not compared with radians.
    assert_same(&lag("joint_lag(slide)", &[-0.5, 0.1, 49.0]), &one(SLIDE, -1.0), "the only slide");
    for (before, rate) in [(0.3 - 0.0011, -1.0), (0.3 - 0.0009, 0.0)] {
        let previous: &'static [f64] = Box::leak(Box::new([-0.1, before, 50.0]));
        assert_same(&lag("joint_lag(arm)", previous), &one(ARM_ANGLE, rate), "less than 1 mrad is no move");
    }
    assert_same(
        &contributions("joint_lag(arm)", |_| {}),
        &one(ARM_ANGLE, 0.0),
        "no move before the first row",
    );
}

#[test]
fn settling_takes_from_the_last_move_and_a_step_adds_from_its_moment_on() {
    let settled = contributions("joint_settling(arm)", |row| row.previous = Some(&[0.0, 0.1, 0.0]));
    assert_same(&settled, &one(ARM_ANGLE, -0.2), "short of a move of 0.2 rad");
    assert_same(
        &contributions("joint_settling(arm)", |_| {}),
        &one(ARM_ANGLE, 0.0),
        "no move before the first row",
    );
    let step = |clock: f64| searched("joint_step(column)", 100.0, move |row| row.clock = clock);
    assert_same(&step(99.9), &one(COLUMN, 0.0), "before");
    assert_same(&step(100.0), &one(COLUMN, -1.0), "at the moment itself");
}

#[test]
fn what_goes_with_time_and_warmth_is_nothing_where_they_are_not_logged() {
    let base = |rate: f64| -> Vec<Contribution> {
        (0..3).map(|axis| Contribution { parameter: axis, dof: Dof::BaseShift(axis), rate }).collect()
    };
    assert_same(&contributions("drift", |row| row.time = 5400.0), &base(1.5), "an hour and a half");
    assert_same(&contributions("drift", |_| {}), &base(0.0), "no time");
    // After one time constant 1 - 1/e is there.
    let warm = |effect: &str| searched(effect, 600.0, |row| row.time = 600.0);
    let part = 1.0 - (-1.0_f64).exp();
    assert_same(&warm("warm_up(column, zero)"), &one(COLUMN, -part), "zero, in the coordinate's sense");
    assert_same(&warm("warm_up(arm, length)"), &one(Dof::Joint(1, DhParameter::A), part), "length");
    assert_same(&warm("warm_up(arm, offset)"), &one(Dof::Joint(1, DhParameter::D), part), "offset");
    let cold = searched("warm_up(arm, length)", 600.0, |_| {});
    assert_same(&cold, &one(Dof::Joint(1, DhParameter::A), 0.0), "no time: as cold as at first");
    // A row of 400 mm and an offset of 20 mm grow by as many mm for each 1/K and kelvin above 20 deg C (ISO 1).
    let grown = |warmer: f64| {
        let part = |dh_parameter, size: f64| Contribution {
            parameter: 0,
            dof: Dof::Joint(1, dh_parameter),
            rate: size * warmer,
        };
        [part(DhParameter::A, 400.0), part(DhParameter::D, 20.0)]
    };
    assert_same(
        &contributions("thermal_growth(arm)", |row| row.temperature = 25.0),
        &grown(5.0),
        "5 K warmer",
    );
    assert_same(&contributions("thermal_growth(arm)", |row| row.temperature = 18.5), &grown(-1.5), "colder");
    assert_same(&contributions("thermal_growth(arm)", |_| {}), &grown(0.0), "no temperature");
}

#[test]
fn errors_of_a_row_a_target_and_the_base_move_one_number_each() {
    for (effect, dof) in [
        ("link_length(arm)", Dof::Joint(1, DhParameter::A)),
        ("link_offset(arm)", Dof::Joint(1, DhParameter::D)),
        ("link_twist(arm)", Dof::Joint(1, DhParameter::Alpha)),
        ("axis_skew(arm)", Dof::Joint(1, DhParameter::Beta)),
        ("trigger_height", Dof::Trigger),
    ] {
        assert_same(&contributions(effect, |_| {}), &one(dof, 1.0), effect);
    }
    let three = |dof: fn(usize) -> Dof| -> Vec<Contribution> {
        (0..3).map(|axis| Contribution { parameter: axis, dof: dof(axis), rate: 1.0 }).collect()
    };
    assert_same(&contributions("base_position", |_| {}), &three(Dof::BaseShift), "base");
    assert_same(&contributions("tool_offset(p2)", |_| {}), &three(|axis| Dof::Target(1, axis)), "tool");
}

#[test]
fn instruments_read_by_the_point_that_is_measured() {
    for (effect, axis, coordinate) in
        [("scale(x)", 0, 100.0), ("scale(y)", 1, -200.0), ("scale(z)", 2, 300.0)]
    {
        assert_same(&contributions(effect, |_| {}), &one(Dof::Reading(axis), coordinate), effect);
    }
    // e_x x p = (0, -p_z, p_y), e_y x p = (p_z, 0, -p_x).
    let read = |parameter, axis, rate| Contribution { parameter, dof: Dof::Reading(axis), rate };
    let expected = [
        read(0, 0, 0.0),
        read(0, 1, -300.0),
        read(0, 2, -200.0),
        read(1, 0, 300.0),
        read(1, 1, 0.0),
        read(1, 2, -100.0),
    ];
    assert_same(&contributions("instrument_tilt", |_| {}), &expected, "out of level");
}

#[test]
fn a_sensor_that_sits_askew_looks_aside_by_its_distance() {
    let hand = Matrix3::new(0.0, -1.0, 0.0, 0.6, 0.0, 0.8, -0.8, 0.0, 0.6);
    let found = contributions("sensor_tilt", |row| {
        row.hand = hand;
        row.trigger = Some(Trigger { distance: 10.0, ..OVER_TABLE });
    });
    let read = |parameter, axis, rate| Contribution { parameter, dof: Dof::Reading(axis), rate };
    // Along the first and the second column of the hand's axes, 10 mm a radian.
    let expected = [
        read(0, 0, 0.0),
        read(0, 1, 6.0),
        read(0, 2, -8.0),
        read(1, 0, -10.0),
        read(1, 1, 0.0),
        read(1, 2, 0.0),
    ];
    assert_same(&found, &expected, "askew");
    assert!(contributions("sensor_tilt", |_| {}).is_empty(), "where nothing triggered it says nothing");
}

/// Of a spot with 40 % hysteresis and 20 % light from the dark side, half is light where it lets go: (0.6 - 0.2) / 0.8.
#[test]
fn a_spot_meets_an_edge_when_its_share_of_light_is_there() {
    let edge = |came_on: bool| {
        contributions("trigger_spot", move |row| row.trigger = Some(Trigger { came_on, ..AT_EDGE }))
    };
    assert_same(&edge(false), &one(Dof::Edge, 0.0), "half a spot: its middle is over the edge");
    let on = edge(true);
    // Coming on takes the light of a whole spot: its middle is a radius on the light side, which is the right here.
    assert!(on.len() == 1 && (on[0].rate + 0.5).abs() < 1e-3, "{on:?}");
    let left = contributions("trigger_spot", |row| {
        row.trigger = Some(Trigger { came_on: true, light: 1.0, ..AT_EDGE });
    });
    assert!((left[0].rate - 0.5).abs() < 1e-3, "{left:?}");
    assert!(contributions("trigger_spot", |row| row.trigger = Some(OVER_TABLE)).is_empty(), "over a table");
}

#[test]
fn hysteresis_moves_the_edge_by_the_slope_of_the_light_share() {
    let found = contributions("trigger_hysteresis", |row| row.trigger = Some(AT_EDGE));
    // A disk of radius 1 whose middle is at m is light by 1/2 + (m sqrt(1 - m^2) + asin m) / pi: at m = 0 its slope is 2 / pi, so m grows by
    // pi / 2 for a share of 1, and the fraction falls by 1 / (1 - dark) for a hysteresis of 1. A radius is 1.5 mm, and light is on the right.
    let expected = -1.5 * (-FRAC_PI_2 / 0.8);
    assert!(found.len() == 1 && found[0].dof == Dof::Edge, "{found:?}");
    assert!((found[0].rate - expected).abs() < 1e-4 * expected.abs(), "{found:?} {expected}");
    let above = contributions("trigger_hysteresis", |row| {
        row.trigger = Some(Trigger { came_on: false, ..OVER_TABLE });
    });
    assert!(above.len() == 1 && above[0].dof == Dof::Trigger && above[0].rate > 0.0, "{above:?}");
    for came_on in [OVER_TABLE, Trigger { came_on: true, ..AT_EDGE }] {
        assert!(
            contributions("trigger_hysteresis", |row| row.trigger = Some(came_on)).is_empty(),
            "coming on"
        );
    }
}

#[test]
fn a_lighter_surface_is_triggered_over_from_higher_and_only_that_one() {
    let over = |surface: usize| {
        contributions("reflectance(ball)", move |row| row.trigger = Some(Trigger { surface, ..OVER_TABLE }))
    };
    // Light falls by 2/5 - 2/8 = 0.15 of itself a mm where it works: 1 / 0.15 mm for as much light again.
    assert_same(&over(2), &one(Dof::Trigger, 1.0 / 0.15), "over the ball");
    assert!(over(0).is_empty() && contributions("reflectance(ball)", |_| {}).is_empty());
}

#[test]
fn late_pictures_move_every_joint_by_its_speed() {
    let mut model = model();
    model.stripe_rig = Some(StripeRig {
        focal_px: [500.0; 2],
        principal_px: [100.0; 2],
        distortion: [0.0; 5],
        flange_from_camera: nalgebra::Isometry3::identity(),
        normal: Vector3::z(),
        d_mm: -100.0,
        bow: 0.0,
    });
    let id = parse("clock_skew", &model).unwrap();
    let found = contributions_in(&model, &id, |row| row.speed = &[0.2, -0.1, 30.0]);
    let contribution = |dof, rate| Contribution { parameter: 0, dof, rate };
    assert_same(
        &found,
        &[contribution(COLUMN, -0.2), contribution(ARM_ANGLE, -0.1), contribution(SLIDE, 30.0)],
        "late",
    );
    assert!(contributions_in(&model, &id, |_| {}).is_empty(), "at rest nothing is late");
    let eye = contributions_in(&model, &parse("hand_eye", &model).unwrap(), |_| {});
    let numbers: Vec<Dof> = (0..3).map(|axis| Dof::Rig(RigNumber::HandEye(axis))).collect();
    assert_eq!(eye.iter().map(|contribution| contribution.dof).collect::<Vec<_>>(), numbers);
    assert_eq!(eye.iter().map(|contribution| contribution.parameter).collect::<Vec<_>>(), [0, 1, 2]);
}

/// Drives of an effect by epoch in one epoch of three.
fn in_epoch(effect: &str, epoch: usize) -> Vec<Contribution> {
    let mut model = model();
    model.epochs = Some(Epochs::Rows(vec![5, 9]));
    contributions_in(&model, &parse(effect, &model).unwrap(), |row| row.epoch = epoch)
}

#[test]
fn effects_by_epoch_have_numbers_of_their_own_in_every_epoch_but_the_first() {
    for effect in ["joint_zero_reset(column)", "base_reset", "reading_reset(distance)", "target_reset(p1)"] {
        assert!(in_epoch(effect, 0).is_empty(), "{effect}: the first epoch is what others are compared with");
        assert!(in_epoch(effect, 3).is_empty(), "{effect}: there is no fourth");
    }
    let at = |parameter, dof, rate| vec![Contribution { parameter, dof, rate }];
    assert_same(&in_epoch("joint_zero_reset(column)", 1), &at(0, COLUMN, -1.0), "in the coordinate's sense");
    assert_same(&in_epoch("joint_zero_reset(slide)", 2), &at(1, SLIDE, 1.0), "a slide");
    assert_same(&in_epoch("base_shifted(z)", 2), &at(1, Dof::BaseShift(2), 1.0), "along z");
    let distance = Dof::ReadingZero(Channel::of(&DISTANCE).unwrap());
    assert_same(&in_epoch("reading_reset(distance)", 1), &at(0, distance, 1.0), "zero");
    let scale = Dof::ReadingScale(Channel::of(&HEIGHT).unwrap());
    assert_same(&in_epoch("reading_rescaled(height)", 2), &at(1, scale, 1.0), "scale");
    let moved = in_epoch("base_reset", 2);
    let dofs: Vec<Dof> = moved.iter().map(|contribution| contribution.dof).collect();
    let (shift, rotation) = (Dof::BaseShift, Dof::BaseRotation);
    assert_eq!(dofs, [shift(0), shift(1), shift(2), rotation(0), rotation(1), rotation(2)]);
    assert_eq!(
        moved.iter().map(|contribution| contribution.parameter).collect::<Vec<_>>(),
        [6, 7, 8, 9, 10, 11]
    );
    let target = in_epoch("target_reset(p2)", 1);
    let expected: Vec<Dof> = (0..3).map(|axis| Dof::Target(1, axis)).collect();
    assert_eq!(target.iter().map(|contribution| contribution.dof).collect::<Vec<_>>(), expected);
}

#[test]
fn a_sensor_of_no_hysteresis_lets_go_where_it_fires() {
    let ideal = Sensor { working: 8.0, peak: 5.0, spot: 3.0, hysteresis: 0.0, dark: 0.0 };
    assert!(ideal.above(false, 0.0).abs() < 1e-9);
    assert!((ideal.falls_off() - 0.15).abs() < 1e-12, "2/5 - 2/8 a mm");
    assert!((ideal.early(true, 8.0, 0.0) - 1.0).abs() < 1e-3, "the whole spot has to be light");
}

#[test]
fn an_effect_that_looks_at_nothing_contributes_the_same_in_every_row() {
    let model = model();
    let mut seen = Vec::new();
    for kind in kinds() {
        // Kinds that need more than a place have no effect of their name alone.
        for id in expand(kind.name, &model).unwrap_or_default() {
            if !build(&id, &model).is_ok_and(|effect| effect.looks_at() == LooksAt::Nothing) {
                continue;
            }
            let elsewhere = contributions_in(&model, &id, |sample| {
                sample.q = &[2.0, -1.0, 400.0];
                sample.approach = &[1, -1, 1];
                sample.speed = &[0.1, 0.2, 30.0];
                (sample.time, sample.clock, sample.epoch) = (100.0, 200.0, 3);
                sample.temperature = 45.0;
                sample.moments = &[-7.0, 1.0, 4.0];
                sample.point = Vector3::new(-500.0, 20.0, 90.0);
                sample.trigger = Some(AT_EDGE);
            });
            assert_eq!(contributions_in(&model, &id, |_| ()), elsewhere, "{}", model.label(&id));
            seen.push(kind.name);
        }
    }
    assert!(["joint_zero", "link_length", "tool_offset"].iter().all(|name| seen.contains(name)), "{seen:?}");
}
