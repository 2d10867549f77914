//! Rig files: everything that is behind one name, with its conventions and a point to test them by.
//!
//! ```yaml
//! rig: paper
//! camera: {width_px: 256, height_px: 256, fx_px: 600, fy_px: 600, cx_px: 127.5, cy_px: 127.5, distortion: {k1: 0}}
//! hand_eye:                              # flange from camera
//!   xyz_mm: [0, 0, 60]
//!   rpy_deg: [0, 0, 0]                   # about fixed x, then y, then z
//! stripe_plane:                          # in the flange's frame
//!   normal: [0.8, 0, 0.6]
//!   d_mm: -216
//!   convention: n.x + d = 0              # the only one; files of n.x = d change the sign of d
//!   bow_per_mm: 0                        # left out for a flat sheet; else n.x + d = bow s^2, s down the camera's view from the flange's axis
//! self_test: {pixel: [27.5, 227.5], point_mm: [-64.286, 64.286, 445.714]}
//! contains: {camera_aim_x_deg: 0.41}     # corrections of a record that these numbers contain already; left out in a maker's file
//! ```

use std::path::Path;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use plumb_document::{
    DocumentKind, FileKind, FileProblems, Node, Problems, Span, parse_as, read_document, schema_of, typed,
    with_words,
};
use serde::{Deserialize, Serialize};

use super::{Camera, Rig, RigCorrections, StripePlane};

/// The convention of the plane that files name.
const CONVENTION: &str = "n.x + d = 0";

/// The self-test's point comes out to within this, mm.
const SELF_TEST_MM: f64 = 0.01;

/// No lens sees a stripe nearer than this sharply, mm.
const NEAREST_MM: f64 = 20.0;

/// No hand carries a rig that looks farther than this, mm.
const FARTHEST_MM: f64 = 20_000.0;

/// Why a rig file cannot be used: every mistake in it.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct RigFileError(#[from] FileProblems);

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRig {
    rig: String,
    camera: Camera,
    hand_eye: RawPose,
    stripe_plane: RawPlane,
    self_test: RawSelfTest,
    #[serde(default, skip_serializing_if = "RigCorrections::is_none")]
    contains: RigCorrections,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPose {
    xyz_mm: [f64; 3],
    rpy_deg: [f64; 3],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPlane {
    normal: [f64; 3],
    d_mm: f64,
    convention: String,
    #[serde(default, skip_serializing_if = "is_flat")]
    bow_per_mm: f64,
}

fn is_flat(bow: &f64) -> bool {
    *bow == 0.0
}

/// A sheet that bends more than this is none, 1/mm: 2.5 mm at 50 mm from its middle.
const MOST_BOW: f64 = 1e-3;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSelfTest {
    pixel: [f64; 2],
    point_mm: [f64; 3],
}

/// What editors show beside a key.
const WORDS: &[(&str, &str)] = &[
    ("rig", "The rig's name."),
    ("camera", "The camera by its pinhole model; lengths in pixels."),
    ("hand_eye", "The camera in the flange's frame."),
    ("hand_eye.rpy_deg", "About fixed x, then y, then z."),
    ("stripe_plane", "The sheet of light in the flange's frame."),
    ("stripe_plane.convention", "n.x + d = 0, the only one; for n.x = d change the sign of d_mm."),
    ("stripe_plane.bow_per_mm", "How the sheet bends; left out for a flat one."),
    ("self_test", "A pixel, and the point in the flange's frame that it has to mean."),
    ("contains", "Corrections of a record that these numbers contain already."),
];

/// The JSON Schema of rig files, for editors.
pub fn rig_schema() -> serde_json::Value {
    with_words(schema_of::<RawRig>(), "A rig: camera and sheet of light on a flange", WORDS)
}

/// Reads a rig file and tests it with its own point.
///
/// # Errors
/// [`RigFileError`]
pub fn read_rig(path: &Path) -> Result<Rig, RigFileError> {
    let text = read_document(path, FileKind::RIG)?;
    parse(&text, path)
}

fn parse(text: &str, file: &Path) -> Result<Rig, RigFileError> {
    let problems = Problems::default();
    let root = parse_as(DocumentKind::Rig, file, text, &problems)?;
    let raw: Option<RawRig> = typed(&root, "a rig", &problems);
    let rig = raw.and_then(|raw| {
        let rig = raw.checked(&root, &problems)?;
        // Only a rig that is right in every value can be tested as a whole.
        if problems.is_empty() {
            test(&rig, &raw.self_test, root.span_at(&["self_test"]), &problems);
        }
        Some(rig)
    });
    problems.into_result(file, text)?;
    rig.ok_or_else(|| FileProblems::whole_file(file, "this is no rig", "").into())
}

impl RawRig {
    /// Each part by itself. Numbers that could not be read are NaN, and not looked at.
    fn checked(&self, root: &Node, problems: &Problems) -> Option<Rig> {
        let camera_is_read = !self.camera.numbers().iter().any(|number| number.is_nan());
        if let Some(problem) = self.camera.problem().filter(|_| camera_is_read) {
            problems.add(root.span_at(&["camera"]), problem, "");
        }
        self.check_plane(root, problems);
        let plane = StripePlane::new(Vector3::from(self.stripe_plane.normal), self.stripe_plane.d_mm);
        if plane.is_none() && !self.stripe_plane.normal.iter().any(|number| number.is_nan()) {
            problems.add(
                root.span_at(&["stripe_plane", "normal"]),
                "the normal of a plane has a length",
                "write for example [0.8, 0, 0.6]",
            );
        }
        let [roll, pitch, yaw] = self.hand_eye.rpy_deg.map(f64::to_radians);
        let lens = Vector3::from(self.hand_eye.xyz_mm);
        let away_mm = (Vector3::from(self.self_test.point_mm) - lens).norm();
        if !away_mm.is_nan() && !(NEAREST_MM..=FARTHEST_MM).contains(&away_mm) {
            problems.add(
                root.span_at(&["self_test", "point_mm"]),
                format!("`point_mm` lies {away_mm:.4} mm from the lens"),
                "lengths are mm; a file in metres is to be multiplied by 1000, one in inches by 25.4",
            );
        }
        Some(Rig {
            name: self.rig.clone(),
            camera: self.camera,
            flange_from_camera: Isometry3::from_parts(
                Translation3::from(lens),
                UnitQuaternion::from_euler_angles(roll, pitch, yaw),
            ),
            plane: plane?,
            bow_per_mm: self.stripe_plane.bow_per_mm,
            contains: self.contains,
        })
    }

    fn check_plane(&self, root: &Node, problems: &Problems) {
        let RawPlane { convention, bow_per_mm, .. } = &self.stripe_plane;
        if !convention.is_empty() && convention.replace(' ', "") != CONVENTION.replace(' ', "") {
            problems.add(
                root.span_at(&["stripe_plane", "convention"]),
                format!("`convention` is `{convention}`"),
                format!(
                    "planes are `{CONVENTION}` in the flange's frame: for `n.x = d` change the sign of d_mm"
                ),
            );
        }
        if bow_per_mm.abs() > MOST_BOW {
            problems.add(
                root.span_at(&["stripe_plane", "bow_per_mm"]),
                format!("`bow_per_mm` is {bow_per_mm}"),
                format!("a sheet bends by {MOST_BOW} at most either way"),
            );
        }
    }
}

/// Whether the rig finds its own test point; what is wrong otherwise.
fn test(rig: &Rig, expected: &RawSelfTest, span: Span, problems: &Problems) {
    if let Err(cause) = rig.collineation() {
        problems.add(span, cause.to_string(), "");
        return;
    }
    let pixel = Vector2::from(expected.pixel);
    let expected_point = Point3::from(Vector3::from(expected.point_mm));
    let found = rig.point_of(pixel);
    if found.as_ref().is_ok_and(|found| (found - expected_point).norm() <= SELF_TEST_MM) {
        return;
    }
    let mut other = rig.clone();
    other.plane.d_mm = -other.plane.d_mm;
    let other_way = other.point_of(pixel).is_ok_and(|point| (point - expected_point).norm() <= SELF_TEST_MM);
    let help = match other_way {
        true => "with the other sign of d_mm it would come out right: the plane is of the convention n.x = d",
        false => {
            "camera, hand_eye and stripe_plane do not belong together, or the test's point is of an older calibration"
        }
    };
    let coordinates = |point: Point3<f64>| format!("[{:.3}, {:.3}, {:.3}]", point.x, point.y, point.z);
    let message = match found {
        Ok(found) => format!(
            "pixel [{}, {}] comes out at {} mm, not at {}, {:.3} mm away",
            pixel.x,
            pixel.y,
            coordinates(found),
            coordinates(expected_point),
            (found - expected_point).norm()
        ),
        Err(why) => format!("pixel [{}, {}]: {why}", pixel.x, pixel.y),
    };
    problems.add(span, message, help);
}

/// The text of a rig file. Its self-test lies off the picture's middle, where a shift along the principal ray would not be seen.
///
/// # Errors
/// When that position in the picture means no point: what is wrong.
pub fn write_rig(rig: &Rig) -> Result<String, String> {
    let aside = [f64::from(rig.camera.width_px) * 0.4, f64::from(rig.camera.height_px) * 0.7];
    let point = rig.point_of(Vector2::from(aside))?;
    let (roll, pitch, yaw) = rig.flange_from_camera.rotation.euler_angles();
    let raw = RawRig {
        rig: rig.name.clone(),
        camera: rig.camera,
        hand_eye: RawPose {
            xyz_mm: rig.flange_from_camera.translation.vector.into(),
            rpy_deg: [roll.to_degrees(), pitch.to_degrees(), yaw.to_degrees()],
        },
        stripe_plane: RawPlane {
            normal: rig.plane.normal.into(),
            d_mm: rig.plane.d_mm,
            convention: CONVENTION.to_owned(),
            bow_per_mm: rig.bow_per_mm,
        },
        self_test: RawSelfTest { pixel: aside, point_mm: point.coords.into() },
        contains: rig.contains,
    };
    serde_yaml::to_string(&raw).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "\
rig: paper
camera: {width_px: 256, height_px: 256, fx_px: 600, fy_px: 600, cx_px: 127.5, cy_px: 127.5}
hand_eye: {xyz_mm: [0, 0, 60], rpy_deg: [0, 0, 0]}
stripe_plane: {normal: [0.8, 0, 0.6], d_mm: -216, convention: n.x + d = 0}
self_test: {pixel: [27.5, 227.5], point_mm: [-64.285714, 64.285714, 445.714286]}
";

    fn message(from: &str, to: &str) -> String {
        assert!(GOOD.contains(from), "{from}");
        parse(&GOOD.replace(from, to), Path::new("rig.yaml")).unwrap_err().to_string()
    }

    #[test]
    fn a_rig_comes_back_from_its_file() {
        let rig = parse(GOOD, Path::new("rig.yaml")).unwrap();
        let again = parse(&write_rig(&rig).unwrap(), Path::new("again.yaml")).unwrap();
        assert!((again.plane.normal - rig.plane.normal).norm() < 1e-12);
        assert!((again.flange_from_camera.to_matrix() - rig.flange_from_camera.to_matrix()).norm() < 1e-12);
    }

    #[test]
    fn the_corrections_a_rig_contains_come_back_from_its_file() {
        let drawn = parse(GOOD, Path::new("rig.yaml")).unwrap();
        assert!(!write_rig(&drawn).unwrap().contains("contains"));
        let corrections =
            RigCorrections { camera_aim_x_deg: 0.4, camera_scale_u: 1.02, ..Default::default() };
        let corrected = drawn.corrected(&corrections).unwrap();
        let again = parse(&write_rig(&corrected).unwrap(), Path::new("again.yaml")).unwrap();
        assert_eq!(again.contains, corrections);
        assert_eq!(again.corrected(&corrections).unwrap().camera.fx_px, corrected.camera.fx_px);
        let refusal = message("self_test:", "contains: {camera_aim: 1}\nself_test:");
        assert!(refusal.contains("unknown key `camera_aim`"), "{refusal}");
    }

    #[test]
    fn a_bent_sheet_comes_back_from_its_file_and_bends_its_points() {
        let flat = parse(GOOD, Path::new("rig.yaml")).unwrap();
        let bent = Rig { bow_per_mm: 4e-5, ..flat.clone() };
        let again = parse(&write_rig(&bent).unwrap(), Path::new("again.yaml")).unwrap();
        assert_eq!(again.bow_per_mm, 4e-5);
        let pixel = Vector2::new(60.0, 230.0);
        let point = again.point_of(pixel).unwrap();
        assert!((again.pixel_of(point).unwrap() - pixel).norm() < 1e-9, "it stays on its ray");
        let out = again.plane.normal.dot(&point.coords) + again.plane.d_mm;
        // The camera looks along z with its rows along y: that is where the sheet's middle line is measured from.
        assert!((out - 4e-5 * point.y * point.y).abs() < 1e-6, "{out}");
        assert!((flat.point_of(pixel).unwrap() - point).norm() > 0.05);
        let refusal = message("convention: n.x + d = 0", "convention: n.x + d = 0, bow_per_mm: 1");
        assert!(
            refusal.contains("`bow_per_mm` is 1\n") && refusal.contains("a sheet bends by 0.001 at most"),
            "{refusal}"
        );
    }

    #[test]
    fn a_plane_of_the_other_convention_is_recognised_by_the_test_point() {
        let message = message("d_mm: -216", "d_mm: 216");
        assert!(message.contains("the plane is of the convention n.x = d"), "{message}");
    }

    #[test]
    fn another_convention_named_is_refused_with_the_cure() {
        let message = message("n.x + d = 0", "n.x = d");
        assert!(message.ends_with("for `n.x = d` change the sign of d_mm\n"), "{message}");
    }

    #[test]
    fn a_lens_in_the_sheet_is_refused() {
        let message = message("d_mm: -216", "d_mm: -36");
        assert!(message.contains("the lens lies 0.0000 mm from the sheet of light"), "{message}");
    }

    #[test]
    fn a_calibration_that_contradicts_its_test_point_is_refused() {
        let message = message("xyz_mm: [0, 0, 60]", "xyz_mm: [0, 0, 61]");
        assert!(message.contains("do not belong together"), "{message}");
    }

    #[test]
    fn a_camera_that_was_never_calibrated_is_refused() {
        assert!(message("fx_px: 600", "fx_px: 0").contains("never calibrated"));
    }

    #[test]
    fn a_file_in_other_units_is_refused_with_the_cure() {
        let metres = GOOD.replace("[0, 0, 60]", "[0, 0, 0.06]").replace("-216", "-0.216");
        let metres = metres.replace("[-64.285714, 64.285714, 445.714286]", "[-0.064286, 0.064286, 0.445714]");
        let refusal = parse(&metres, Path::new("rig.yaml")).unwrap_err().to_string();
        assert!(
            refusal.contains("0.3963 mm from the lens\n") && refusal.contains("a file in metres"),
            "{refusal}"
        );
        let refusal = message("fx_px: 600", "fx_px: 25");
        assert!(refusal.contains("fx_px and fy_px count in pixels"), "{refusal}");
    }

    #[test]
    fn every_mistake_of_a_rig_is_reported_and_none_follows_from_another() {
        let text = GOOD.replace("fx_px: 600", "fx_px: wide").replace("[0.8, 0, 0.6]", "[0, 0, 0]");
        let text = text.replace("n.x + d = 0", "n.x = d").replace("rpy_deg", "rpy_rad");
        let message = parse(&text, Path::new("rig.yaml")).unwrap_err().to_string();
        for expected in
            ["rig.yaml:2:48: `fx_px` is a number", "3:32: unknown key `rpy_rad`", "4:24: the normal", "4:59"]
        {
            assert!(message.contains(expected), "{expected}: {message}");
        }
        assert_eq!(message.matches("rig.yaml:").count(), 4, "{message}");
    }

    #[test]
    fn a_wrong_key_is_named_with_its_line() {
        let message = message("hand_eye:", "handeye:");
        assert!(message.starts_with("rig.yaml:3:1: unknown key `handeye` in a rig\n"), "{message}");
    }
}
