//! Errors put into a rig and an arm come out of stripes on a table, a pyramid and a ball.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use plumb_kinematics::{Deviation, LinkFrames, inverse};

use super::{AdjustError, Adjustment, Scans, StripePixel, StripeScene, Surface, View, adjust};
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::arm_model::{Model, RigNumber, StripeRig};
use plumb_calibration::effect;
use plumb_estimation::Progress;

pub(super) fn puma() -> Model {
    Model::parse("puma560.yaml", include_str!("../../../../workcells/arms/puma560.yaml")).unwrap()
}

pub(super) fn rig() -> StripeRig {
    let toward = (100.0_f64 / 300.0).atan();
    let normal = Vector3::new(toward.cos(), 0.0, toward.sin());
    StripeRig {
        focal_px: [694.4, 694.4],
        principal_px: [127.5, 127.5],
        distortion: [0.0; 5],
        flange_from_camera: Isometry3::from_parts(
            Translation3::new(-30.0, 0.0, 60.0),
            UnitQuaternion::identity(),
        ),
        normal,
        d_mm: -normal.dot(&Vector3::new(70.0, 0.0, 60.0)),
        bow: 0.0,
    }
}

fn surfaces() -> Vec<(String, Surface)> {
    let named = |(name, surface): (&str, Surface)| (name.to_owned(), surface);
    [
        ("platform", Surface::plane(Vector3::z(), -300.0)),
        ("pyramid", Surface::pyramid(Point3::new(530.0, -60.0, -260.0), 110.0, 40.0, 0.3)),
        ("ball", Surface::Sphere(Point3::new(530.0, 120.0, -275.0), 25.0)),
    ]
    .map(named)
    .into()
}

/// How far a point is outside the nearest of the surfaces, mm.
fn height(point: &Point3<f64>) -> f64 {
    let outside = |(_, surface): &(String, Surface)| match surface {
        Surface::Faces(faces) => faces
            .iter()
            .map(|(normal, offset)| normal.dot(&point.coords) - offset)
            .fold(f64::NEG_INFINITY, f64::max),
        Surface::Sphere(centre, radius) => (point - centre).norm() - radius,
    };
    surfaces().iter().map(outside).fold(f64::INFINITY, f64::min)
}

/// Views of pyramid and ball from several sides, as a scan makes them on paper.
fn views(model: &Model) -> Vec<View> {
    let start = [-22.7_f64, -65.6, 198.0, 0.0, 47.6, 157.3].map(f64::to_radians);
    let mut views = Vec::new();
    for approach in 0..14 {
        let angle = f64::from(approach);
        let (tilt, azimuth, rotation) =
            (0.17 * f64::from(approach % 3), 0.9 * angle, 0.45 * (angle * 1.7).sin());
        let about_z = |angle| nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
        let attitude = about_z(azimuth)
            * nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), tilt)
            * about_z(rotation - azimuth)
            * nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let middle = if approach % 2 == 0 { [530.0, -60.0] } else { [530.0, 120.0] };
        for step in 0..9 {
            let position = Vector3::new(
                middle[0] - 44.0 + 11.0 * f64::from(step),
                middle[1],
                -285.0 + 20.0 * f64::from(approach % 2),
            );
            let origin = position - attitude * Vector3::new(-30.0, 0.0, 360.0);
            let expected = nalgebra::IsometryMatrix3::from_parts(Translation3::from(origin), attitude);
            let flange_of = |q: &[f64]| LinkFrames::of(&model.chain, q, &[]).flange;
            if let Ok(q) = inverse(flange_of, &expected, &start) {
                views.push(View { q, speed: Vec::new(), approach: Vec::new(), time_s: None });
            }
        }
    }
    views
}

/// What a perfect camera of this rig sees: along each row the column at which the sheet meets the nearest surface.
fn seen(model: &Model, rig: &StripeRig, deviations: &[Deviation], views: &[View]) -> Vec<StripePixel> {
    let mut pixels = Vec::new();
    for (view, pose) in views.iter().enumerate() {
        let flange = LinkFrames::of(&model.chain, &pose.q, deviations).flange;
        for row in (4..252).step_by(8) {
            let height = |u: f64| Some(self::height(&(flange * rig.point(u, f64::from(row))?)));
            // From the projector's side inward the first sign change is where light meets matter.
            let columns: Vec<f64> = (0..=255).map(f64::from).collect();
            let crossing = columns.windows(2).find_map(|pair| {
                let (mut low, mut high) = (pair[0], pair[1]);
                let (first, second) = (height(low)?, height(high)?);
                if first.signum() == second.signum() {
                    return None;
                }
                for _ in 0..50 {
                    let middle = 0.5 * (low + high);
                    if height(middle)?.signum() == first.signum() { low = middle } else { high = middle }
                }
                Some(low)
            });
            if let Some(u_px) = crossing {
                pixels.push(StripePixel { view, u_px, v_px: f64::from(row), sigma_px: 0.03 });
            }
        }
    }
    pixels
}

/// What is found of an arm and a rig that are so, and of nothing else but these effects.
fn found(truth: &StripeRig, deviations: &[Deviation], added: &[&str]) -> Adjustment {
    let model = puma();
    let views = views(&model);
    assert!(views.len() > 90, "{} views", views.len());
    let pixels = seen(&model, truth, deviations, &views);
    let scan_of_view = vec![0; views.len()];
    let scans = Scans { views, scan_of_view, pixels, names: vec!["scan".to_owned()] };
    let scene = StripeScene { model: &model, rig: &rig(), surfaces: &surfaces(), scans: &scans };
    let added: Vec<_> = added.iter().map(|name| effect::parse(name, &model).unwrap()).collect();
    adjust(scene, &added, &Progress::unwatched()).unwrap()
}

#[test]
fn errors_of_rig_and_joints_are_found_from_surfaces_alone() {
    let truth = rig()
        .moved(RigNumber::HandEye(1), 0.8)
        .moved(RigNumber::CameraAim(0), -0.003)
        .moved(RigNumber::StripePlane(0), 0.004);
    let mut deviations = vec![Deviation::default(); 6];
    deviations[1].theta = 0.0030;
    deviations[2].theta = -0.0020;
    let found = found(&truth, &deviations, &[]);
    for found in &found.found {
        println!("{:<32} {:+.5} +- {:.5} {}", found.name, found.value, found.sigma, found.unit);
    }
    println!("{} points, {:.4} mm rms; not seen: {:?}", found.points, found.rms_mm, found.not_observable);
    assert!(found.rms_mm < 0.02, "{} mm", found.rms_mm);
    let expected = [
        ("joint_zero(shoulder)", 0.0030_f64.to_degrees(), 0.01),
        ("joint_zero(elbow)", -0.0020_f64.to_degrees(), 0.01),
        ("stripe_plane(sensor) tilt_1_deg", 0.004_f64.to_degrees(), 0.01),
        ("camera_aim(sensor) x_deg", -0.003_f64.to_degrees(), 0.01),
    ];
    for (name, expected, within) in expected {
        let found = found.found.iter().find(|found| found.name == name).unwrap();
        let near = 4.0 * found.sigma + within;
        assert!((found.value - expected).abs() < near, "{found:?}, not {expected}");
    }
    assert!((found.rig.point(130.0, 120.0).unwrap() - truth.point(130.0, 120.0).unwrap()).norm() < 0.1);
}

#[test]
fn fewer_than_three_points_a_number_are_refused_with_how_many_there_are() {
    let model = puma();
    let views = views(&model);
    let all = seen(&model, &rig(), &[], &views);
    let scan_of_view = vec![0; views.len()];
    let with = |count: usize| {
        // Some of all views.
        let pixels = all.iter().step_by(all.len() / count).take(count).cloned().collect();
        let (views, scan_of_view) = (views.clone(), scan_of_view.clone());
        let scans = Scans { views, scan_of_view, pixels, names: vec!["scan".to_owned()] };
        let scene = StripeScene { model: &model, rig: &rig(), surfaces: &surfaces(), scans: &scans };
        adjust(scene, &[], &Progress::unwatched()).map(|_| ())
    };
    for count in [20, 60, 90] {
        let Err(AdjustError::TooFew { near, all, unknowns }) = with(count) else { panic!("{count} points") };
        assert!(all == count && near <= all && 2 * near > all && near < 3 * unknowns, "{near} of {all}");
        assert!(unknowns > 30, "zeros and the rig: {unknowns}");
    }
    assert!(!matches!(with(120), Err(AdjustError::TooFew { .. })), "enough for 32 numbers");
}

#[test]
fn what_no_surface_determines_is_named() {
    let found = found(&rig(), &[], &["joint_zero(waist)", "joint_zero(flange)"]);
    let text = found.not_observable.join("; ");
    println!("{text}");
    assert!(text.contains("waist"), "{text}");
    assert!(text.contains("flange"), "{text}");
}

#[test]
fn the_laboratory_asks_the_stripes_with_the_whole_library() {
    let mut adjustment = found(&rig(), &[], &[]);
    let laboratory = adjustment.laboratory().unwrap();
    assert!(laboratory.summary().stripes && !laboratory.summary().moves);
    // Effects of the rig are no part of the arm, and pictures are late by what their clock is.
    assert_eq!(adjustment.late_s(), 0.0);
    let of_arm = adjustment.of_arm().len();
    assert!(of_arm > 0 && of_arm < adjustment.effects.len());
    let skew = effect::parse("clock_skew(sensor)", laboratory.model()).unwrap();
    adjustment.effects.push(AddedEffect { id: skew, values: vec![0.004] });
    assert_eq!((adjustment.late_s(), adjustment.of_arm().len()), (0.004, of_arm));
}
