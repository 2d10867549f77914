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

use std::io;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use plumb_document::{FileKind, read_text};
use serde::{Deserialize, Serialize};

use super::{Camera, CollineationError, Rig, RigCorrections, StripePlane, WrongFile};

/// The convention of the plane that files name.
const CONVENTION: &str = "n.x + d = 0";

/// The self-test's point comes out to within this, mm.
const SELF_TEST_MM: f64 = 0.01;

/// No lens sees a stripe nearer than this sharply, mm.
const NEAREST_MM: f64 = 20.0;

/// No hand carries a rig that looks farther than this, mm.
const FARTHEST_MM: f64 = 20_000.0;

/// Why a rig file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RigFileError {
    /// Not readable.
    #[error("{}: cannot be read: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// Not of this form, or with a value that cannot be.
    #[error(transparent)]
    Wrong(#[from] WrongFile),
    /// Camera and light cannot measure.
    #[error("{origin}: {cause}")]
    Degenerate {
        /// The file.
        origin: String,
        /// Why.
        cause: CollineationError,
    },
    /// The file contradicts itself.
    #[error(
        "{origin}: self_test: pixel [{}, {}] comes out at [{:.3}, {:.3}, {:.3}] mm, not at [{:.3}, {:.3}, {:.3}], {away_mm:.3} mm away{hint}",
        pixel[0], pixel[1], found[0], found[1], found[2], wanted[0], wanted[1], wanted[2]
    )]
    SelfTest {
        /// The file.
        origin: String,
        /// The pixel.
        pixel: [f64; 2],
        /// What the file says of it, mm.
        wanted: [f64; 3],
        /// What comes out, mm.
        found: [f64; 3],
        /// How far apart they are, mm.
        away_mm: f64,
        /// What may be the matter.
        hint: &'static str,
    },
}

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

/// Reads a rig file and tests it with its own point.
///
/// # Errors
/// [`RigFileError`]
pub fn read_rig(path: &Path) -> Result<Rig, RigFileError> {
    let text = read_text(path, FileKind::RIG)
        .map_err(|cause| RigFileError::Read { path: path.to_owned(), cause: cause.into() })?;
    parse(&text, &path.display().to_string())
}

fn parse(text: &str, origin: &str) -> Result<Rig, RigFileError> {
    let raw: RawRig = serde_yaml::from_str(text).map_err(|cause| WrongFile::new(origin, cause))?;
    let wrong = |what: String| RigFileError::from(WrongFile::new(origin, what));
    if let Some(problem) = raw.camera.problem() {
        return Err(wrong(format!("camera: {problem}")));
    }
    if raw.stripe_plane.convention.replace(' ', "") != CONVENTION.replace(' ', "") {
        return Err(wrong(format!(
            "stripe_plane: convention is `{}`; planes are `{CONVENTION}` in the flange's frame: for `n.x = d` change the sign of d_mm",
            raw.stripe_plane.convention
        )));
    }
    let numbers = raw.hand_eye.xyz_mm.iter().chain(&raw.hand_eye.rpy_deg).chain(&raw.stripe_plane.normal);
    if numbers.chain([&raw.stripe_plane.d_mm]).any(|number| !number.is_finite()) {
        return Err(wrong("hand_eye or stripe_plane: a number is not finite".to_owned()));
    }
    if !(-MOST_BOW..=MOST_BOW).contains(&raw.stripe_plane.bow_per_mm) {
        return Err(wrong(format!(
            "stripe_plane: bow_per_mm is {}; a sheet bends by {MOST_BOW} at most either way",
            raw.stripe_plane.bow_per_mm
        )));
    }
    let plane = StripePlane::new(Vector3::from(raw.stripe_plane.normal), raw.stripe_plane.d_mm)
        .ok_or_else(|| wrong("stripe_plane: normal has no length".to_owned()))?;
    let [roll, pitch, yaw] = raw.hand_eye.rpy_deg.map(f64::to_radians);
    let rig = Rig {
        name: raw.rig,
        camera: raw.camera,
        flange_from_camera: Isometry3::from_parts(
            Translation3::from(Vector3::from(raw.hand_eye.xyz_mm)),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        ),
        plane,
        bow_per_mm: raw.stripe_plane.bow_per_mm,
        contains: raw.contains,
    };
    let away_mm = (Vector3::from(raw.self_test.point_mm) - rig.flange_from_camera.translation.vector).norm();
    if !(NEAREST_MM..=FARTHEST_MM).contains(&away_mm) {
        return Err(wrong(format!(
            "self_test: point_mm lies {away_mm:.4} mm from the lens: lengths are mm; a file in metres is to be multiplied by 1000, one in inches by 25.4"
        )));
    }
    test(&rig, &raw.self_test, origin)?;
    Ok(rig)
}

fn test(rig: &Rig, expected: &RawSelfTest, origin: &str) -> Result<(), RigFileError> {
    rig.collineation().map_err(|cause| RigFileError::Degenerate { origin: origin.to_owned(), cause })?;
    let pixel = Vector2::from(expected.pixel);
    let wanted = Point3::from(Vector3::from(expected.point_mm));
    let found = rig.point_of(pixel);
    if found.as_ref().is_ok_and(|found| (found - wanted).norm() <= SELF_TEST_MM) {
        return Ok(());
    }
    let mut other = rig.clone();
    other.plane.d_mm = -other.plane.d_mm;
    let other_way = other.point_of(pixel).is_ok_and(|point| (point - wanted).norm() <= SELF_TEST_MM);
    match found {
        Err(why) if !other_way => {
            let what = format!("self_test: pixel [{}, {}]: {why}", pixel.x, pixel.y);
            Err(WrongFile::new(origin, what).into())
        }
        found => {
            let found = found.map_or([f64::NAN; 3], |point| point.coords.into());
            let hint = match other_way {
                true => {
                    ": with the other sign of d_mm it would come out right: the plane is of the convention n.x = d"
                }
                false => {
                    ": camera, hand_eye and stripe_plane do not belong together, or the test's point is of an older calibration"
                }
            };
            Err(RigFileError::SelfTest {
                origin: origin.to_owned(),
                pixel: expected.pixel,
                wanted: expected.point_mm,
                away_mm: (Vector3::from(found) - wanted.coords).norm(),
                found,
                hint,
            })
        }
    }
}

/// The text of a rig file. Its self-test lies off the picture's middle, where a shift along the principal ray would not be seen.
///
/// # Errors
/// When that place of the picture means no point: what is wrong.
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
        parse(&GOOD.replace(from, to), "rig.yaml").unwrap_err().to_string()
    }

    #[test]
    fn a_rig_comes_back_from_its_file() {
        let rig = parse(GOOD, "rig.yaml").unwrap();
        let again = parse(&write_rig(&rig).unwrap(), "again.yaml").unwrap();
        assert!((again.plane.normal - rig.plane.normal).norm() < 1e-12);
        assert!((again.flange_from_camera.to_matrix() - rig.flange_from_camera.to_matrix()).norm() < 1e-12);
    }

    #[test]
    fn the_corrections_a_rig_contains_come_back_from_its_file() {
        let drawn = parse(GOOD, "rig.yaml").unwrap();
        assert!(!write_rig(&drawn).unwrap().contains("contains"));
        let corrections =
            RigCorrections { camera_aim_x_deg: 0.4, camera_scale_u: 1.02, ..Default::default() };
        let corrected = drawn.corrected(&corrections).unwrap();
        let again = parse(&write_rig(&corrected).unwrap(), "again.yaml").unwrap();
        assert_eq!(again.contains, corrections);
        assert_eq!(again.corrected(&corrections).unwrap().camera.fx_px, corrected.camera.fx_px);
        let told = message("self_test:", "contains: {camera_aim: 1}\nself_test:");
        assert!(told.contains("unknown field `camera_aim`"), "{told}");
    }

    #[test]
    fn a_bent_sheet_comes_back_from_its_file_and_bends_its_points() {
        let flat = parse(GOOD, "rig.yaml").unwrap();
        let bent = Rig { bow_per_mm: 4e-5, ..flat.clone() };
        let again = parse(&write_rig(&bent).unwrap(), "again.yaml").unwrap();
        assert_eq!(again.bow_per_mm, 4e-5);
        let pixel = Vector2::new(60.0, 230.0);
        let point = again.point_of(pixel).unwrap();
        assert!((again.pixel_of(point).unwrap() - pixel).norm() < 1e-9, "it stays on its ray");
        let out = again.plane.normal.dot(&point.coords) + again.plane.d_mm;
        // The camera looks along z with its rows along y: that is where the sheet's middle line is measured from.
        assert!((out - 4e-5 * point.y * point.y).abs() < 1e-6, "{out}");
        assert!((flat.point_of(pixel).unwrap() - point).norm() > 0.05);
        let told = message("convention: n.x + d = 0", "convention: n.x + d = 0, bow_per_mm: 1");
        assert!(told.contains("bow_per_mm is 1; a sheet bends by 0.001 at most"), "{told}");
    }

    #[test]
    fn a_plane_of_the_other_convention_is_recognised_by_the_test_point() {
        let message = message("d_mm: -216", "d_mm: 216");
        assert!(message.contains("the plane is of the convention n.x = d"), "{message}");
    }

    #[test]
    fn another_convention_named_is_refused_with_the_cure() {
        let message = message("n.x + d = 0", "n.x = d");
        assert!(message.ends_with("for `n.x = d` change the sign of d_mm"), "{message}");
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
        let told = parse(&metres, "rig.yaml").unwrap_err().to_string();
        assert!(told.contains("0.3963 mm from the lens: lengths are mm; a file in metres"), "{told}");
        let told = message("fx_px: 600", "fx_px: 25");
        assert!(told.contains("fx_px and fy_px count in pixels"), "{told}");
    }

    #[test]
    fn a_wrong_key_is_named_with_its_line() {
        let message = message("hand_eye:", "handeye:");
        assert!(message.contains("handeye") && message.contains("line 3"), "{message}");
    }
}
