//! The arm's own sensor, in a world of its own: light that comes back from a distance, a trigger that holds on, a spot, a line of
//! sight. What is wrong with it is named, and how large it is.

use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_diagnosis::{Named, Verdict};
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;

use super::made_up::{Xorshift, laboratory};

/// A column, two links of 200 and 150 mm, and a wrist that holds the sensor: it looks down where all angles but the first add to
/// nought. It is drawn as its data sheet has it.
const ARM: &str = "
arm: seeing
convention: distal
joints:
  - {name: waist, d_mm: 200, alpha_deg: 90}
  - {name: shoulder, a_mm: 200}
  - {name: elbow, a_mm: 150}
  - {name: wrist, alpha_deg: 90}
base: {free: false}
targets: {p1: {xyz_mm: [0, 0, 48], free: false}}
sensor: {working_mm: 8, peak_mm: 5, spot_mm: 2, hysteresis_percent: 10, dark_percent: 5}
surfaces:
  table: {plane: {normal: [0, 0, 1], offset_mm: 0}}
  block: {plane: {normal: [0, 0, 1], offset_mm: 60}}
  edge: {line: {point_mm: [230, 0, 0], direction: [0, 1, 0], light: left}}
free: [joint_zero(shoulder), joint_zero(elbow)]
measured_from: world
noise: {height_mm: 0.02}
";

/// The sensor as it is.
#[derive(Clone, Copy)]
struct Eye {
    hysteresis: f64,
    /// Of the block, beside the white it was trimmed on.
    lighter: f64,
    /// Of its line of sight towards the hand's x, rad.
    tilt: f64,
}

const SOUND: Eye = Eye { hysteresis: 0.1, lighter: 0.0, tilt: 0.0 };

fn light(distance: f64) -> f64 {
    (distance / 5.0).powi(2) * (2.0 * (1.0 - distance / 5.0)).exp()
}

/// Where a function that falls passes nought.
fn falls_through(mut low: f64, mut high: f64, of: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if of(middle) > 0.0 { low = middle } else { high = middle }
    }
    low
}

/// From the wrist's axis to the face of the sensor, mm: were it nought, a wrist that is off and a sensor askew would be the same.
const REACH: f64 = 40.0;

/// Joint angles, deg, for a sensor's face at radius `r` and height `z` of a column turned by `waist`, looking down but for `lean` (deg).
fn pose(waist: f64, r: f64, z: f64, lean: f64) -> [f64; 4] {
    let (sine, cosine) = lean.to_radians().sin_cos();
    let (r, z) = (r - REACH * sine, z + REACH * cosine - 200.0);
    let elbow = -((r * r + z * z - 200.0_f64.powi(2) - 150.0_f64.powi(2)) / (2.0 * 200.0 * 150.0)).acos();
    let shoulder = z.atan2(r) - (150.0 * elbow.sin()).atan2(200.0 + 150.0 * elbow.cos());
    let (shoulder, elbow) = (shoulder.to_degrees(), elbow.to_degrees());
    [waist, shoulder, elbow, lean - shoulder - elbow]
}

fn rows(eye: Eye, seed: u64) -> String {
    let mut rng = Xorshift::seeded(seed);
    let mut text = "q1_deg,q2_deg,q3_deg,q4_deg,on,signal\n".to_owned();
    for row in 0..120 {
        let on = rng.unit() < 0.5;
        let level = if on { light(8.0) } else { (1.0 - eye.hysteresis) * light(8.0) };
        let waist = rng.between(-25.0, 25.0);
        let (surface, [q1, q2, q3, q4]) = if row % 3 == 0 {
            // Over the edge, the hand level, at some height: the fraction of the spot that has to be light.
            let distance = rng.between(6.0, 7.9);
            let fraction = ((level / light(distance)) - 0.05) / 0.95;
            let lit = |middle: f64| {
                0.5 + (middle * (1.0 - middle * middle).sqrt() + middle.asin()) / std::f64::consts::PI
            };
            let light_side = falls_through(-1.0, 1.0, |middle| fraction - lit(middle));
            let x = 230.0 - light_side + rng.noise(0.02);
            let r = x / waist.to_radians().cos() - distance * eye.tilt;
            ("edge", pose(waist, r, distance, 0.0))
        } else {
            let (name, height, shade) =
                if row % 3 == 1 { ("table", 0.0, 0.0) } else { ("block", 60.0, eye.lighter) };
            let distance = falls_through(5.0, 40.0, |distance| (1.0 + shade) * light(distance) - level);
            let lean = rng.between(-10.0, 10.0);
            let (sine, cosine) = lean.to_radians().sin_cos();
            let z = height + distance * (cosine - eye.tilt * sine) + rng.noise(0.02);
            (name, pose(waist, rng.between(170.0, 250.0), z, lean))
        };
        let signal = if on { "on" } else { "off" };
        text.push_str(&format!("{q1:.5},{q2:.5},{q3:.5},{q4:.5},{surface},{signal}\n"));
    }
    text
}

/// What is named, if anything.
fn named(eye: Eye, seed: u64) -> (Verdict, Option<Named>, String) {
    let options = Options { holdout: Holdout::None, ..Options::default() };
    let found = laboratory(ARM, &rows(eye, seed), options).diagnose(&Progress::unwatched()).unwrap();
    let sentence = diagnosis_sentence(&found);
    (found.verdict, found.named, sentence)
}

fn is_recovered(eye: Eye, effect: &str, site: &str, size: f64) {
    for seed in 1..=4 {
        let (_, named, sentence) = named(eye, seed);
        let Some(named) = named else { panic!("seed {seed}: {sentence}") };
        assert_eq!((named.effect.effect.as_str(), named.effect.site.as_str()), (effect, site), "{sentence}");
        // The light falls off by a curve of which the laboratory takes the tangent.
        let allowed = 4.0 * named.se + 0.03 * size.abs();
        assert!((named.size - size).abs() < allowed, "seed {seed}: {sentence}");
    }
}

#[test]
fn a_sound_sensor_is_not_blamed() {
    for seed in 1..=4 {
        let (verdict, named, sentence) = named(SOUND, seed);
        assert!(named.is_none() && verdict != Verdict::Located, "seed {seed}: {sentence}");
    }
}

#[test]
fn a_trigger_that_holds_on_longer_is_named() {
    is_recovered(Eye { hysteresis: 0.15, ..SOUND }, "trigger_hysteresis", "sensor", 0.05);
}

#[test]
fn a_surface_darker_than_the_white_it_was_trimmed_on_is_named() {
    is_recovered(Eye { lighter: -0.03, ..SOUND }, "reflectance", "block", -0.03);
}

#[test]
fn a_sensor_that_looks_aside_is_named() {
    is_recovered(Eye { tilt: 2.0_f64.to_radians(), ..SOUND }, "sensor_tilt", "sensor", 2.0);
}
