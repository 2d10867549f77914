//! The size of every kind in one number, with its standard error by hand.

use nalgebra::{DMatrix, Vector3};

use crate::arm_model::{Model, StripeRig};
use crate::effect::{EffectId, Size, build, parse};

const ARM: &str = "
arm: sizes
convention: distal
joints:
  - {name: waist, d_mm: 150, alpha_deg: 90}
  - {name: lift, slides: true, limits_mm: [0, 500], screw_pitch_mm: 5}
  - {name: elbow, a_mm: 300}
targets: {p1: {free: false}}
base: {free: false}
epochs: {rows: [3, 5]}
";

fn size(effect: &str, values: &[f64], covariance: &DMatrix<f64>) -> Size {
    let mut model = Model::parse("sizes.yaml", ARM).unwrap();
    model.stripe_rig = Some(StripeRig {
        focal_px: [500.0; 2],
        principal_px: [100.0; 2],
        distortion: [0.0; 5],
        flange_from_camera: nalgebra::Isometry3::identity(),
        normal: Vector3::z(),
        d_mm: -100.0,
        bow: 0.0,
    });
    let id: EffectId = parse(effect, &model).unwrap();
    build(&id, &model).unwrap().size(values, covariance)
}

/// 180 / pi, to ten digits.
const DEGREES: f64 = 57.295_779_513;

fn is(found: &Size, value: f64, error: f64, unit: &str) -> bool {
    let near = |found: f64, expected: f64| (found - expected).abs() < 1e-8 * (1.0 + expected.abs());
    near(found.value, value) && near(found.error, error) && found.unit == unit
}

#[test]
fn a_length_of_several_numbers_has_the_error_along_itself() {
    // (3, 4) of length 5: along (0.6, 0.8) the variance is 0.36 * 4 + 0.64 * 9 + 2 * 0.48 * 1 = 8.16.
    let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 9.0]);
    let error = 8.16_f64.sqrt();
    let tilt = size("base_tilt", &[3.0, 4.0], &covariance);
    assert!(is(&tilt, 5.0 * DEGREES, error * DEGREES, "deg"), "{tilt:?}");
    let level = size("instrument_tilt", &[3.0, 4.0], &covariance);
    assert!(is(&level, 5.0 * DEGREES, error * DEGREES, "deg"), "{level:?}");
    let wave = size("joint_harmonic(elbow, 2)", &[3.0, 4.0], &covariance);
    assert!(is(&wave, 5.0 * DEGREES, error * DEGREES, "deg"), "{wave:?}");
    let screw = size("screw_wave(lift, 1)", &[3.0, 4.0], &covariance);
    assert!(is(&screw, 5.0, error, "mm"), "{screw:?}");
    let shift = size("principal_point", &[3.0, 4.0], &covariance);
    assert!(is(&shift, 5.0, error, "px"), "{shift:?}");
    // Where both parts are nothing the error is that of the worse.
    let none = size("joint_harmonic(elbow, 2)", &[0.0, 0.0], &covariance);
    assert!(is(&none, 0.0, 3.0 * DEGREES, "deg"), "{none:?}");
    let still = size(
        "base_position",
        &[0.0; 3],
        &DMatrix::from_diagonal(&Vector3::new(4.0, 9.0, 1.0).into_owned().as_slice().to_vec().into()),
    );
    assert!(is(&still, 0.0, 3.0, "mm"), "{still:?}");
}

#[test]
fn three_shifts_have_one_length_in_their_unit() {
    // (2, 3, 6) of length 7: along it 0.01 whichever way.
    let covariance = DMatrix::from_diagonal_element(3, 3, 1e-4);
    for (effect, unit) in
        [("base_position", "mm"), ("tool_offset(p1)", "mm"), ("drift", "mm/h"), ("hand_eye", "mm")]
    {
        let found = size(effect, &[2.0, 3.0, 6.0], &covariance);
        assert!(is(&found, 7.0, 0.01, unit), "{effect}: {found:?}");
    }
}

#[test]
fn a_single_number_keeps_its_sign() {
    let covariance = DMatrix::from_element(1, 1, 4e-6);
    for (effect, value, error, unit) in [
        ("joint_zero(elbow)", -0.01 * DEGREES, 2e-3 * DEGREES, "deg"),
        ("joint_zero(lift)", -0.01, 2e-3, "mm"),
        ("link_length(elbow)", -0.01, 2e-3, "mm"),
        ("joint_gain(elbow)", -0.01, 2e-3, "1"),
        ("camera_roll", -0.01 * DEGREES, 2e-3 * DEGREES, "deg"),
        ("stripe_bow", -0.01, 2e-3, "1/mm"),
        ("clock_skew", -10.0, 2.0, "ms"),
        ("axis_yaw(lift)", -10.0 * DEGREES, 2.0 * DEGREES, "deg/m"),
    ] {
        let found = size(effect, &[-0.01], &covariance);
        assert!(is(&found, value, error, unit), "{effect}: {found:?}");
    }
}

#[test]
fn flexure_is_the_root_of_its_terms_squares() {
    let mut values = [0.0; 3];
    (values[0], values[1]) = (3e-3, -4e-3);
    let mut covariance = DMatrix::zeros(3, 3);
    // Along (0.6, -0.8): 0.36 * 4 + 0.64 * 9 - 2 * 0.48 * 1 = 6.24.
    (covariance[(0, 0)], covariance[(1, 1)]) = (4e-6, 9e-6);
    (covariance[(0, 1)], covariance[(1, 0)]) = (1e-6, 1e-6);
    let found = size("gravity_flexure(elbow)", &values, &covariance);
    assert!(is(&found, 5e-3 * DEGREES, 6.24_f64.sqrt() * 1e-3 * DEGREES, "deg"), "{found:?}");
    let none = size("gravity_flexure(elbow)", &[0.0; 3], &covariance);
    assert!(none.value == 0.0 && none.error == f64::INFINITY, "of nothing there is no direction: {none:?}");
}

#[test]
fn steps_by_epoch_are_as_large_as_the_greatest_from_one_epoch_to_the_next() {
    let covariance = DMatrix::from_row_slice(2, 2, &[4e-2, 1e-2, 1e-2, 9e-2]);
    // 3 from the first to the second, then 2 back: the first is the greatest.
    let first = size("joint_zero_reset(lift)", &[3.0, 1.0], &covariance);
    assert!(is(&first, 3.0, 0.2, "mm"), "{first:?}");
    // 1, then 4 more: the change between the last two has both variances less twice what they share.
    let second = size("joint_zero_reset(lift)", &[1.0, 5.0], &covariance);
    assert!(is(&second, 4.0, 0.11_f64.sqrt(), "mm"), "{second:?}");
    // Of a base that is shifted and turned the shift alone makes the size.
    let mut values = [0.0; 12];
    (values[0], values[1], values[3]) = (3.0, 4.0, 1.0);
    let moved = size("base_reset", &values, &DMatrix::from_diagonal_element(12, 12, 1e-2));
    assert!((moved.value - 5.0).abs() < 1e-9 && moved.unit == "mm", "{moved:?}");
}
