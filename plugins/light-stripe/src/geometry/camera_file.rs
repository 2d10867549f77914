//! Camera calibrations as OpenCV and ROS write them.

use std::path::Path;

use plumb_document::{FileProblems, Node, OtherKeys, Problems, parse, typed_with};
use serde::Deserialize;

use super::{Camera, Distortion};

/// Who writes camera files this way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraFormat {
    /// OpenCV's FileStorage.
    OpenCv,
    /// ROS's camera_info_manager.
    Ros,
}

#[derive(Deserialize)]
struct RawCamera {
    #[serde(alias = "imageWidth")]
    image_width: u32,
    #[serde(alias = "imageHeight")]
    image_height: u32,
    #[serde(alias = "cameraMatrix")]
    camera_matrix: RawMatrix,
    #[serde(alias = "distCoeffs")]
    distortion_coefficients: RawMatrix,
    #[serde(default)]
    distortion_model: Option<String>,
}

#[derive(Deserialize)]
struct RawMatrix {
    rows: usize,
    cols: usize,
    data: Vec<f64>,
}

/// Reads a camera file of OpenCV or ROS; what else it holds is left aside. `origin` is named in errors.
///
/// # Errors
/// [`FileProblems`]: every mistake in it.
pub fn read_camera(text: &str, origin: &str) -> Result<Camera, FileProblems> {
    let (file, problems) = (Path::new(origin), Problems::default());
    let root = parse(file, &plain_yaml(text), &problems)?;
    let raw: Option<RawCamera> = typed_with(&root, "a camera", OtherKeys::LeftAside, &problems);
    let camera = raw.and_then(|raw| raw.checked(&root, &problems));
    problems.into_result(file, text)?;
    camera.ok_or_else(|| FileProblems::whole_file(file, "this is no camera", ""))
}

/// The text with spaces where OpenCV writes a directive, a head or a tag of its own, so that positions stay as they are.
fn plain_yaml(text: &str) -> String {
    const TAG: &str = "!!opencv-matrix";
    let plain = |line: &str| match line.starts_with("%YAML") || line.trim() == "---" {
        true => String::new(),
        false => line.replace(TAG, &" ".repeat(TAG.len())),
    };
    text.lines().map(plain).collect::<Vec<_>>().join("\n")
}

impl RawCamera {
    /// Numbers that could not be read are NaN, and not looked at.
    fn checked(&self, root: &Node, problems: &Problems) -> Option<Camera> {
        let wrong = |keys: &[&str], message: String, help: &str| {
            problems.add(root.span_at(keys), message, help);
        };
        if let Some(model) = self.distortion_model.as_deref().filter(|model| *model != "plumb_bob") {
            let help = "only plumb_bob (k1, k2, p1, p2, k3) is known: calibrate with it";
            wrong(&["distortion_model"], format!("`distortion_model` is `{model}`"), help);
        }
        let matrix = &self.camera_matrix;
        let numbers: Option<[f64; 9]> = matrix.data.as_slice().try_into().ok();
        if numbers.is_none() && !matrix.data.is_empty() {
            let message = format!("`camera_matrix` has {} numbers", matrix.data.len());
            wrong(&["camera_matrix", "data"], message, "it has 9");
        }
        let [fx, skew, cx, b, fy, cy, c, d, one] = numbers?;
        if (matrix.rows, matrix.cols) != (3, 3) || [skew, b, c, d] != [0.0; 4] || one != 1.0 {
            wrong(&["camera_matrix"], "`camera_matrix` is not [fx 0 cx; 0 fy cy; 0 0 1]".to_owned(), "");
        }
        let coefficients = &self.distortion_coefficients;
        let count = coefficients.data.len();
        if coefficients.rows * coefficients.cols != count || ![0, 4, 5].contains(&count) {
            let message = format!(
                "`distortion_coefficients` has {count} numbers in {} x {}",
                coefficients.rows, coefficients.cols
            );
            wrong(&["distortion_coefficients"], message, "plumb_bob has 4 or 5: k1, k2, p1, p2, k3");
        }
        let coefficient = |index: usize| coefficients.data.get(index).copied().unwrap_or(0.0);
        let camera = Camera {
            width_px: self.image_width,
            height_px: self.image_height,
            fx_px: fx,
            fy_px: fy,
            cx_px: cx,
            cy_px: cy,
            distortion: Distortion {
                k1: coefficient(0),
                k2: coefficient(1),
                p1: coefficient(2),
                p2: coefficient(3),
                k3: coefficient(4),
            },
        };
        let is_read = !camera.numbers().iter().any(|number| number.is_nan()) && problems.is_empty();
        if let Some(problem) = camera.problem().filter(|_| is_read) {
            wrong(&["camera_matrix"], problem, "");
        }
        Some(camera)
    }
}

/// The text of a camera file.
pub fn write_camera(camera: &Camera, name: &str, format: CameraFormat) -> String {
    let Camera { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion } = camera;
    let Distortion { k1, k2, p1, p2, k3 } = distortion;
    let size = format!("image_width: {width_px}\nimage_height: {height_px}\n");
    let intrinsics = format!("[{fx_px:?}, 0.0, {cx_px:?}, 0.0, {fy_px:?}, {cy_px:?}, 0.0, 0.0, 1.0]");
    let lens = format!("[{k1:?}, {k2:?}, {p1:?}, {p2:?}, {k3:?}]");
    let matrix = |key: &str, tag: &str, rows: u32, cols: u32, kind: &str, data: &str| {
        format!("{key}:{tag}\n  rows: {rows}\n  cols: {cols}\n{kind}  data: {data}\n")
    };
    match format {
        CameraFormat::OpenCv => {
            let tagged =
                |key, rows, cols, data| matrix(key, " !!opencv-matrix", rows, cols, "  dt: d\n", data);
            format!(
                "%YAML:1.0\n---\n{size}{}{}",
                tagged("camera_matrix", 3, 3, &intrinsics),
                tagged("distortion_coefficients", 1, 5, &lens)
            )
        }
        CameraFormat::Ros => {
            let projection = format!(
                "[{fx_px:?}, 0.0, {cx_px:?}, 0.0, 0.0, {fy_px:?}, {cy_px:?}, 0.0, 0.0, 0.0, 1.0, 0.0]"
            );
            format!(
                "{size}camera_name: {name}\n{}distortion_model: plumb_bob\n{}{}{}",
                matrix("camera_matrix", "", 3, 3, "", &intrinsics),
                matrix("distortion_coefficients", "", 1, 5, "", &lens),
                matrix("rectification_matrix", "", 3, 3, "", "[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]"),
                matrix("projection_matrix", "", 3, 4, "", &projection)
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROS: &str = "\
image_width: 640
image_height: 480
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: [525.5, 0., 319.5, 0., 526, 239.5, 0., 0., 1.]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.1, 0.02, 1e-4, -2e-4, 0]
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [525, 0, 319.5, 0, 0, 525, 239.5, 0, 0, 0, 1, 0]}
";

    #[test]
    fn a_camera_goes_through_both_formats_unchanged() {
        let camera = read_camera(ROS, "head.yaml").unwrap();
        assert_eq!(camera.distortion.p2, -2e-4);
        for format in [CameraFormat::OpenCv, CameraFormat::Ros] {
            let text = write_camera(&camera, "head", format);
            assert_eq!(read_camera(&text, "again.yaml").unwrap(), camera, "{text}");
        }
    }

    #[test]
    fn what_opencv_writes_is_read() {
        let text = "%YAML:1.0\n---\ncalibration_time: \"Tue\"\nimage_width: 640\nimage_height: 480\nflags: 0\n\
            camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 5.2e+02, 0., 3.2e+02, 0.,\n       5.3e+02, 2.4e+02, 0., 0., 1. ]\n\
            distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ 0.1, 0., 0., 0., -0.5 ]\n";
        let camera = read_camera(text, "camera.yaml").unwrap();
        assert_eq!((camera.fy_px, camera.distortion.k3), (530.0, -0.5));
    }

    #[test]
    fn what_cannot_be_used_says_what_would_be_right() {
        let message =
            |from: &str, to: &str| read_camera(&ROS.replace(from, to), "head.yaml").unwrap_err().to_string();
        assert!(message("525.5, 0., 319.5", "0, 0., 319.5").contains("never calibrated"));
        assert!(message("plumb_bob", "equidistant").contains("only plumb_bob"));
        assert!(message("-2e-4, 0]", "-2e-4, 0, 1, 2, 3]").contains("plumb_bob has 4 or 5"));
        assert!(message("data: [525.5, 0.,", "data: [525.5, 0.1,").contains("is not [fx 0 cx"));
    }
}
