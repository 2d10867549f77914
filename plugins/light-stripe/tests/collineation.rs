//! Agin's collineation, from his matrices and from the plane, against points whose position is known.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use nalgebra::{
    Isometry3, Matrix4, Point3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3, Vector4,
};
use plumb_light_stripe::geometry::{
    Camera, Collineation, CollineationError, Distortion, NoPoint, StripePlane,
};
use proptest::prelude::*;

fn pose(turn: Vector3<f64>, position: Vector3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(position), UnitQuaternion::from_scaled_axis(turn))
}

/// A pinhole at the origin: (x, y, z) falls on (f x / z, f y / z), with f / z for a depth.
fn pinhole(f: f64, mx: f64, my: f64) -> Matrix4<f64> {
    Matrix4::new(mx, 0., 0., 0., 0., my, 0., 0., 0., 0., 0., 1., 0., 0., 1. / f, 0.)
}

/// Duda and Hart's: the origin in the picture, the lens f behind it.
fn duda_hart(f: f64, mx: f64, my: f64) -> Matrix4<f64> {
    Matrix4::new(mx, 0., 0., 0., 0., my, 0., 0., 0., 0., 1., 0., 0., 0., 1. / f, 1.)
}

prop_compose! {
    fn vector(size: f64)(x in -size..size, y in -size..size, z in -size..size) -> Vector3<f64> {
        Vector3::new(x, y, z)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn both_forms_give_the_point_whose_picture_was_taken(
        turn in vector(2.0),
        position in vector(500.0),
        tilt in vector(0.05),
        aside in vector(5.0),
        scale in (0.5..2.0, 0.5..2.0),
        on_sheet in (-80.0..80.0, 200.0..450.0),
    ) {
        let (f, (mx, my)) = (25.0, scale);
        let camera = pose(turn, position);
        let toward = -(100.0_f64 / 300.0).atan();
        let projector = camera
            * pose(Vector3::y() * toward, Vector3::new(100.0, aside.y, aside.z))
            * pose(tilt, Vector3::zeros());
        let point = projector * Point3::new(0.0, on_sheet.0, on_sheet.1);
        let seen = camera.inverse() * point;

        for projection in [pinhole(f, mx, my), duda_hart(f, mx, my)] {
            let image = projection * seen.to_homogeneous();
            let pixel = Vector2::new(image.x, image.y) / image.w;
            let k = Collineation::from_matrices(&camera.to_matrix(), &projection, &projector.to_matrix()).unwrap();
            let found = k.point(pixel).unwrap();
            prop_assert!((found - point).norm() < 1e-8, "{} mm", (found - point).norm());
        }

        let lens = Camera {
            width_px: 1, height_px: 1, fx_px: f * mx, fy_px: f * my, cx_px: 0.0, cy_px: 0.0,
            distortion: Distortion::default(),
        };
        let normal = projector.rotation * Vector3::x();
        let plane = StripePlane::new(normal, -normal.dot(&projector.translation.vector)).unwrap();
        let k = Collineation::from_plane(&camera, &lens.ray_from_pixel(), &plane).unwrap();
        let pixel = lens.pixel(Vector2::new(seen.x, seen.y) / seen.z);
        prop_assert!((k.point(pixel).unwrap() - point).norm() < 1e-8);

        let agin = Collineation::from_matrices(&camera.to_matrix(), &pinhole(f, mx, my), &projector.to_matrix()).unwrap();
        prop_assert!((agin.matrix() - k.matrix()).norm() < 1e-9 * k.matrix().norm());

        let (mut x, mut y, mut z) = ([0.0_f32], [0.0_f32], [0.0_f32]);
        k.points(&[pixel.x as f32], &[pixel.y as f32], &mut x, &mut y, &mut z);
        let single = Point3::new(f64::from(x[0]), f64::from(y[0]), f64::from(z[0]));
        prop_assert!((single - point).norm() < 0.02, "{}", (single - point).norm());
    }

    #[test]
    fn a_lens_straightens_what_it_bends(
        k1 in -0.3..0.3, k2 in -0.05..0.05, p1 in -0.003..0.003, p2 in -0.003..0.003, k3 in -0.01..0.01,
        x in -0.5..0.5, y in -0.5..0.5,
    ) {
        let lens = Distortion { k1, k2, p1, p2, k3 };
        let straight = Vector2::new(x, y);
        let again = lens.straighten(lens.distort(straight)).unwrap();
        prop_assert!((again - straight).norm() < 1e-9, "{again} {straight}");
    }
}

#[test]
fn a_lens_in_the_sheet_and_rays_that_miss_it_mean_no_point() {
    let plane = StripePlane::new(Vector3::x(), -50.0).unwrap();
    let rays = Camera {
        width_px: 100,
        height_px: 100,
        fx_px: 100.0,
        fy_px: 100.0,
        cx_px: 0.0,
        cy_px: 0.0,
        distortion: Distortion::default(),
    }
    .ray_from_pixel();
    let at = |x: f64| Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), UnitQuaternion::identity());
    let in_sheet = Collineation::from_plane(&at(50.0), &rays, &plane);
    assert!(matches!(in_sheet, Err(CollineationError::LensInSheet { .. })));
    let beside = Collineation::from_plane(&at(0.0), &rays, &plane).unwrap();
    assert_eq!(beside.point(Vector2::new(0.0, 3.0)), Err(NoPoint::Parallel));
    assert_eq!(beside.point(Vector2::new(-1.0, 3.0)), Err(NoPoint::Behind));
    assert!((beside.point(Vector2::new(10.0, 0.0)).unwrap() - Point3::new(50.0, 0.0, 500.0)).norm() < 1e-9);
}

#[test]
fn a_three_row_projection_has_no_inverse() {
    let flat = Matrix4::from_diagonal(&Vector4::new(1.0, 1.0, 0.0, 1.0));
    let turned = Rotation3::from_axis_angle(&Vector3::y_axis(), -0.3).to_homogeneous();
    let error = Collineation::from_matrices(&Matrix4::identity(), &flat, &turned).unwrap_err();
    assert!(error.to_string().contains("write it 4 x 4"), "{error}");
}
