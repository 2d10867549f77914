//! The arm model in memory: rigs of light stripes, residual maps, noise and names, by hand-computed cases.

use nalgebra::{Isometry3, Rotation3, Vector3};

use super::measured_region::JointRange;
use super::rig_number::RigNumber;
use super::{Along, MapCarrier, MeasuredFrom, MeasuredRegion, Model, ResidualMap, Side, StripeRig, Wave};
use crate::effect::{Channel, EffectId, Quantity, Site};

/// A camera 10 mm beside the flange's z that looks along it, and a sheet 100 mm ahead.
fn rig() -> StripeRig {
    StripeRig {
        focal_px: [500.0, 400.0],
        principal_px: [100.0, 90.0],
        distortion: [0.0; 5],
        flange_from_camera: Isometry3::translation(10.0, 0.0, 0.0),
        normal: Vector3::z(),
        d_mm: -100.0,
        bow: 0.0,
    }
}

fn assert_at(rig: &StripeRig, pixel: [f64; 2], expected: [f64; 3]) {
    let found = rig.point(pixel[0], pixel[1]).unwrap().coords;
    assert!((found - Vector3::from(expected)).norm() < 1e-6, "{pixel:?}: {found} instead of {expected:?}");
}

#[test]
fn a_pixel_shows_where_its_ray_meets_the_sheet() {
    assert_at(&rig(), [100.0, 90.0], [10.0, 0.0, 100.0]);
    assert_at(&rig(), [150.0, 50.0], [20.0, -10.0, 100.0]);
    // A sheet that leans by 45 degrees about x: n = (0, 1, 1)/sqrt(2) through (0, 0, 100).
    let root = 0.5_f64.sqrt();
    let leaning = StripeRig { normal: Vector3::new(0.0, root, root), d_mm: -100.0 * root, ..rig() };
    // The ray (0, 0.25, 1) meets y + z = 100 at z = 80.
    assert_at(&leaning, [100.0, 190.0], [10.0, 20.0, 80.0]);
    let behind = StripeRig { d_mm: 100.0, ..rig() };
    assert!(behind.point(100.0, 90.0).is_none(), "the sheet is behind the camera");
    let along = StripeRig { normal: Vector3::y(), ..rig() };
    assert!(along.point(100.0, 90.0).is_none(), "a ray that runs along the sheet");
    assert_eq!(rig().working_point(), Vector3::new(10.0, 0.0, 100.0));
}

#[test]
fn a_bowed_sheet_lies_further_by_the_square_of_the_place_along_it() {
    // n.x + d = bow s^2 with s along y: at y = 20 of a sheet at 100 mm it is 0.4 mm for 1e-3 / mm.
    let bowed = StripeRig { bow: 1e-3, ..rig() };
    let point = bowed.point(100.0, 170.0).unwrap();
    assert!(
        (point.z - 100.0 - 1e-3 * point.y * point.y).abs() < 1e-3 && (20.0..20.2).contains(&point.y),
        "{point}"
    );
    assert_at(&bowed, [100.0, 90.0], [10.0, 0.0, 100.0]);
}

#[test]
fn the_lens_bends_rays_as_brown_has_it() {
    // Radial of the second power: what is seen at 0.1 of the straight place is x (1 + k1 x^2) = 0.1 with k1 = 1: 0.0990...
    let bent = StripeRig { distortion: [1.0, 0.0, 0.0, 0.0, 0.0], ..rig() };
    let x = (bent.point(150.0, 90.0).unwrap().x - 10.0) / 100.0;
    assert!((x + x.powi(3) - 0.1).abs() < 1e-9, "{x}");
    let higher = StripeRig { distortion: [0.0, 2.0, 0.0, 0.0, 5.0], ..rig() };
    let x = (higher.point(150.0, 90.0).unwrap().x - 10.0) / 100.0;
    assert!((x * (1.0 + 2.0 * x.powi(4) + 5.0 * x.powi(6)) - 0.1).abs() < 1e-9, "{x}");
    // Tangential: x'' = x + 2 p1 x y + p2 (r^2 + 2 x^2), y'' = y + p1 (r^2 + 2 y^2) + 2 p2 x y.
    let aside = StripeRig { distortion: [0.0, 0.0, 0.02, 0.03, 0.0], ..rig() };
    let point = aside.point(150.0, 130.0).unwrap();
    let (x, y) = ((point.x - 10.0) / 100.0, point.y / 100.0);
    let square = x * x + y * y;
    assert!((x + 0.04 * x * y + 0.03 * (square + 2.0 * x * x) - 0.1).abs() < 1e-9, "{x} {y}");
    assert!((y + 0.02 * (square + 2.0 * y * y) + 0.06 * x * y - 0.1).abs() < 1e-9, "{x} {y}");
}

#[test]
fn each_number_of_a_rig_moves_what_its_name_says() {
    let moved = |number: RigNumber, by: f64| rig().moved(number, by);
    // A turn of the camera about its own y looks towards +x: by 100 mm times the tangent.
    let aside = 100.0 * 0.01_f64.tan();
    assert_at(&moved(RigNumber::CameraAim(1), 0.01), [100.0, 90.0], [10.0 + aside, 0.0, 100.0]);
    assert_at(&moved(RigNumber::CameraAim(0), 0.01), [100.0, 90.0], [10.0, -aside, 100.0]);
    // A quarter turn about the principal ray takes +x to +y.
    assert_at(&moved(RigNumber::CameraRoll, std::f64::consts::FRAC_PI_2), [150.0, 90.0], [10.0, 10.0, 100.0]);
    assert_at(&moved(RigNumber::CameraScale(0), 0.25), [150.0, 50.0], [18.0, -10.0, 100.0]);
    assert_at(&moved(RigNumber::CameraScale(1), 0.25), [150.0, 50.0], [20.0, -8.0, 100.0]);
    assert_at(&moved(RigNumber::PrincipalPoint(0), 25.0), [150.0, 90.0], [15.0, 0.0, 100.0]);
    assert_at(&moved(RigNumber::PrincipalPoint(1), -40.0), [150.0, 90.0], [20.0, 10.0, 100.0]);
    assert_eq!(moved(RigNumber::LensDistortion, 0.5).distortion, [0.5, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(moved(RigNumber::StripeBow, 2e-3).bow, 2e-3);
    // n.x + d = 0: a greater d is a nearer sheet.
    assert_at(&moved(RigNumber::StripePlane(2), 20.0), [150.0, 90.0], [18.0, 0.0, 80.0]);
    // The whole rig, sheet and all, along z.
    assert_at(&moved(RigNumber::HandEye(2), 7.0), [150.0, 90.0], [20.0, 0.0, 107.0]);
    assert_at(&moved(RigNumber::HandEye(0), 7.0), [150.0, 90.0], [27.0, 0.0, 100.0]);
    // The sheet tilts about where it meets the principal ray: there nothing moves, and the normal leans by the angle.
    for which in [0, 1] {
        let tilted = moved(RigNumber::StripePlane(which), 0.1);
        assert_at(&tilted, [100.0, 90.0], [10.0, 0.0, 100.0]);
        assert!(
            (tilted.normal.z - 0.1_f64.cos()).abs() < 1e-12 && (tilted.normal.norm() - 1.0).abs() < 1e-12
        );
    }
    assert!(moved(RigNumber::StripePlane(0), 0.1).normal.x.abs() > 0.09, "about y, down the picture");
    assert!(moved(RigNumber::StripePlane(1), 0.1).normal.y.abs() > 0.09, "about x");
}

#[test]
fn numbers_of_a_rig_are_moved_in_their_order_and_those_that_do_not_move_stay() {
    let mut amounts = [0.0; RigNumber::ALL.len()];
    assert_eq!(rig().with(&amounts), rig());
    amounts[RigNumber::PrincipalPoint(1).index()] = 3.0;
    amounts[RigNumber::CameraScale(0).index()] = 0.1;
    let both = rig().with(&amounts);
    assert_eq!((both.principal_px, both.focal_px), ([100.0, 93.0], [550.0, 400.0]));
    for (index, number) in RigNumber::ALL.into_iter().enumerate() {
        assert_eq!(number.index(), index, "{number:?}");
        assert!((1e-7..0.1).contains(&number.small()), "{number:?}");
    }
}

const ARM: &str = "
arm: two
convention: distal
joints: [{name: turn, a_mm: 100, limits_deg: [-170, 170]}, {name: slide, slides: true, limits_mm: [0, 80]}]
targets: {p1: {}, p2: {}}
surfaces: {table: {plane: {normal: [0, 0, 1], offset_mm: 0}}}
noise: {p1_mm: 0.05, p2_deg: 0.1}
";

fn model() -> Model {
    Model::parse("two.yaml", ARM).unwrap()
}

/// A region of a turn over 90 degrees and a slide over 50 mm.
fn region() -> MeasuredRegion {
    let poses = vec![
        vec![0.0, 0.0],
        vec![std::f64::consts::FRAC_PI_2, 50.0],
        vec![0.0, 50.0],
        vec![std::f64::consts::FRAC_PI_2, 0.0],
    ];
    MeasuredRegion::of(&model().chain, &poses).unwrap()
}

fn map() -> ResidualMap {
    ResidualMap {
        waves: vec![Wave { rates: vec![1.0, 0.5], phase: 0.25, shift: Vector3::new(2.0, 0.0, -4.0) }],
        along: vec![Along { joint: 1, weights: vec![0.3, 0.2] }],
        sides: vec![Side { joint: 0, weights: vec![0.1, 0.05] }],
        not_understood: 0.5,
    }
}

#[test]
fn a_residual_map_is_waves_of_the_pose_and_cosines_over_ranges() {
    let (region, q) = (region(), [0.0, 12.5]);
    // Scaled coordinates run from -1 to 1 over the ranges: -1 and -0.5 here.
    assert!(
        region.inputs(&q).iter().zip([-1.0, -0.5]).all(|(found, expected)| (found - expected).abs() < 1e-12)
    );
    let effect = map().at(&region, &q, &[-1, 1]).unwrap();
    let wave = (0.25_f64 - 1.0 - 0.25).cos();
    assert!((effect.shift - Vector3::new(2.0, 0.0, -4.0) * wave).norm() < 1e-12, "{effect:?}");
    // A quarter of the slide's range: cos(pi/4) and half of cos(pi/2).
    assert!((effect.joints[1] - 0.3 * 0.5_f64.sqrt()).abs() < 1e-12, "{effect:?}");
    // From above: minus the weight itself, and minus that of cos(0) at the range's lower end.
    assert!((effect.joints[0] + 0.15).abs() < 1e-12, "{effect:?}");
    assert_eq!(map().at(&region, &q, &[]).unwrap().joints[0], 0.0, "a side that is not known");
    assert!(map().at(&region, &[0.0, 51.0], &[]).is_none(), "outside the region it says nothing");
}

#[test]
fn columns_of_a_map_are_in_the_order_of_its_weights() {
    let (region, mut map) = (region(), map());
    let columns = map.columns(&region, &[0.0, 12.5], &[-1, 1]);
    let carriers: Vec<MapCarrier> = columns.iter().map(|(carrier, _)| *carrier).collect();
    let shifts = [0, 1, 2].map(MapCarrier::Shift);
    let joints = [1, 1, 0, 0].map(MapCarrier::Joint);
    assert_eq!(carriers, [&shifts[..], &joints[..]].concat());
    map.set_weights(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    assert_eq!(map.waves[0].shift, Vector3::new(1.0, 2.0, 3.0));
    assert_eq!(
        (map.along[0].weights.clone(), map.sides[0].weights.clone()),
        (vec![4.0, 5.0], vec![6.0, 7.0])
    );
    map.set_weights(&[0.0, 0.0, 0.0, 4.0]);
    map.drop_idle();
    assert_eq!(
        (map.waves.len(), map.along.len(), map.sides.len()),
        (0, 1, 0),
        "what does nothing is dropped"
    );
    assert_eq!(map.along[0].weights, [4.0, 0.0]);
}

#[test]
fn a_joint_that_turned_half_a_turn_is_seen_by_sine_and_cosine() {
    let chain = model().chain;
    let of = |high: f64| MeasuredRegion::of(&chain, &[vec![0.0, 0.0], vec![high, 50.0]]).unwrap();
    let (below, from) = (of(179_f64.to_radians()), of(180_f64.to_radians()));
    assert!(!below.joints[0].wide && from.joints[0].wide && !from.joints[1].wide, "a slide never turns");
    let inputs = from.inputs(&[0.3, 25.0]);
    assert!((inputs[0] - 0.3_f64.sin()).abs() < 1e-12 && (inputs[1] - 0.3_f64.cos()).abs() < 1e-12);
    assert!(inputs.len() == 3 && inputs[2].abs() < 1e-12);
    // A joint that was at rest says nothing.
    let still = MeasuredRegion::of(&chain, &[vec![0.2, 0.0], vec![0.2, 50.0]]).unwrap();
    assert_eq!(still.inputs(&[0.2, 50.0]), [1.0]);
}

#[test]
fn a_region_ends_at_its_ranges_and_at_the_distance_of_neighbours() {
    let region = region();
    // Four corners, 2 apart along either scaled coordinate: that far from the nearest is allowed.
    assert!((region.reach - 2.0).abs() < 1e-12 && region.poses.len() == 4, "{region:?}");
    assert!(region.check(&[0.7, 25.0]).is_ok() && region.check(&[0.0, 50.0]).is_ok());
    assert!(region.check(&[-0.01, 25.0]).is_err() && region.check(&[0.0, 50.1]).is_err());
    let tight = MeasuredRegion { reach: 1.0, ..region };
    // The middle is sqrt(2) from every corner.
    let message = tight.check(&[std::f64::consts::FRAC_PI_4, 25.0]).unwrap_err().describe(&model().chain);
    assert!(message.contains("it is 1.4 times as far"), "{message}");
}

#[test]
fn corrections_and_maps_hold_where_was_measured_and_say_so() {
    let mut model = model();
    assert!(model.holds_at(&[9.0, 9e9]).is_ok(), "a model of mechanisms holds everywhere");
    model.measured_region = Some(region());
    model.residual_map = Some(map());
    let message = model.holds_at(&[0.0, 60.0]).unwrap_err();
    assert!(message.contains("slide would be at 60.000 mm, and was measured from 0.000 to 50.000 mm. the residual map of the model holds"), "{message}");
    let id = EffectId::at("joint_gain", Site::Joint(0));
    model.corrections.push(super::Correction { id: id.clone(), may_be: Vec::new() });
    let message = model.holds_at(&[0.0, 60.0]).unwrap_err();
    assert!(
        message.contains("the correction joint_gain(turn) and the residual map of the model hold only"),
        "{message}"
    );
    assert!(
        model.correction(&id).is_some()
            && model.correction(&EffectId::at("joint_zero", Site::Joint(0))).is_none()
    );
    assert!(model.holds_at(&[0.0, 50.0]).is_ok());
}

#[test]
fn what_is_down_is_given_or_follows_from_the_frame() {
    let tilted = Rotation3::from_axis_angle(&Vector3::x_axis(), 0.5);
    let mut model = model();
    model.measured_from = MeasuredFrom::World;
    assert!((tilted * model.down(&tilted) + Vector3::z()).norm() < 1e-12, "along the world's -z");
    model.measured_from = MeasuredFrom::Instrument;
    assert_eq!(model.down(&tilted), -Vector3::z(), "an instrument's frame says nothing: upright on its base");
    model.gravity = Some(Vector3::y());
    assert_eq!(model.down(&tilted), Vector3::y());
}

#[test]
fn effects_are_called_as_people_write_them() {
    let model = model();
    let at = |site: Site| EffectId::at("e", site);
    for (id, label) in [
        (at(Site::Joint(0)), "e(turn)"),
        (at(Site::Target(1)), "e(p2)"),
        (at(Site::Axis(2)), "e(z)"),
        (at(Site::Base), "e(base)"),
        (at(Site::Sensor), "e(sensor)"),
        (at(Site::Instrument), "e(instrument)"),
        (at(Site::Surface(0)), "e(table)"),
        (at(Site::Reading(Channel::TiltX)), "e(tilt_x)"),
        (at(Site::Joint(9)), "e(?)"),
        (EffectId { with: Some(1), ..at(Site::Joint(0)) }, "e(turn, slide)"),
        (EffectId { order: Some(36.5), ..at(Site::Joint(0)) }, "e(turn, 36.5)"),
        (EffectId { of: Some(Quantity::Length), ..at(Site::Joint(0)) }, "e(turn, length)"),
    ] {
        assert_eq!(model.label(&id), label);
    }
}

#[test]
fn noise_is_of_its_own_target_and_levels_go_by_name_or_alone() {
    let mut model = model();
    assert_eq!((model.noise.of_position("p1"), model.noise.of_position("p2")), (Some(0.05), None));
    let turned = model.noise.of_orientation("p2").unwrap();
    assert!((turned - 0.1_f64.to_radians()).abs() < 1e-15 && model.noise.of_orientation("p1").is_none());
    assert_eq!(model.noise.estimated_of("p2_mm"), None);
    model.noise.estimated.push(("p2_mm".to_owned(), 0.3));
    assert_eq!(model.noise.estimated_of("p2_mm"), Some(0.3));
    assert_eq!(model.level_position(None), None);
    let leveled = Model::parse("l.yaml", &format!("{ARM}levels: {{a: {{after: base}}}}\n")).unwrap();
    assert_eq!((leveled.level_position(None), leveled.level_position(Some("a"))), (Some(0), Some(0)));
    assert_eq!(leveled.level_position(Some("b")), None);
    let two = Model::parse("l.yaml", &format!("{ARM}levels: {{a: {{after: base}}, b: {{after: turn}}}}\n"))
        .unwrap();
    assert_eq!(
        (two.level_position(None), two.level_position(Some("b"))),
        (None, Some(1)),
        "of two one has to be named"
    );
}

#[test]
fn a_pose_is_scaled_over_the_ranges_wherever_they_begin() {
    let joints = vec![
        JointRange { low: 1.0, high: 3.0, wide: false },
        JointRange { low: -4.0, high: 4.0, wide: true },
    ];
    let region = MeasuredRegion { joints, poses: Vec::new(), reach: 1.0 };
    for (q, expected) in [(1.0, -1.0), (2.0, 0.0), (3.0, 1.0)] {
        let inputs = region.inputs(&[q, 0.5]);
        assert!((inputs[0] - expected).abs() < 1e-12, "{inputs:?}");
        assert!((inputs[1] - 0.5_f64.sin()).abs() < 1e-12 && (inputs[2] - 0.5_f64.cos()).abs() < 1e-12);
    }
}

#[test]
fn the_weights_of_a_side_are_before_it_and_before_its_cosines() {
    // A sixth of the turn's range, the joint came from above: -1, and minus cos(30 deg).
    let columns = map().columns(&region(), &[std::f64::consts::FRAC_PI_2 / 6.0, 25.0], &[-1, 1]);
    let sides: Vec<f64> = columns.iter().rev().take(2).map(|(_, value)| *value).collect();
    assert!((sides[1] + 1.0).abs() < 1e-12 && (sides[0] + 0.75_f64.sqrt()).abs() < 1e-12, "{sides:?}");
}

#[test]
fn boards_go_by_name_and_one_without_a_name_by_any() {
    let with = |boards: &str| Model::parse("b.yaml", &format!("{ARM}{boards}\n")).unwrap();
    let unnamed = with("board: {seen_by: p1}");
    assert_eq!((unnamed.board_position(None), unnamed.board_position(Some("floor"))), (Some(0), Some(0)));
    assert_eq!((unnamed.board_name(0), unnamed.board_name(7)), ("board", "board"));
    let one = with("boards: {floor: {seen_by: p1}}");
    assert_eq!((one.board_position(None), one.board_position(Some("floor"))), (Some(0), Some(0)));
    assert_eq!(one.board_position(Some("wall")), None, "one that has a name goes by it alone");
    let two = with("boards: {floor: {seen_by: p1}, wall: {seen_by: p2}}");
    assert_eq!((two.board_position(None), two.board_position(Some("wall"))), (None, Some(1)));
    assert_eq!((two.boards[1].camera, two.board_name(1)), (1, "wall"));
}

#[test]
fn the_cosines_of_a_map_run_over_the_range_wherever_it_begins() {
    let joints = vec![JointRange { low: 2.0, high: 6.0, wide: false }];
    let region = MeasuredRegion { joints, poses: Vec::new(), reach: 1.0 };
    let along = vec![Along { joint: 0, weights: vec![1.0, 1.0] }];
    let map = ResidualMap { along, ..ResidualMap::default() };
    // At the lower end, a quarter on, and at the upper end: half a wave, and a whole one of half the height.
    for (q, expected) in [(2.0, [1.0, 0.5]), (3.0, [0.5_f64.sqrt(), 0.0]), (6.0, [-1.0, 0.5])] {
        let columns = map.columns(&region, &[q], &[0]);
        assert!(
            columns.iter().zip(expected).all(|((_, value), one)| (value - one).abs() < 1e-12),
            "{columns:?}"
        );
    }
}
