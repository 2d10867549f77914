//! Camera calibrations as OpenCV and ROS write them.

use serde::Deserialize;

use super::{Camera, Distortion, WrongFile};

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
/// [`WrongFile`]
pub fn read_camera(text: &str, origin: &str) -> Result<Camera, WrongFile> {
    // OpenCV heads its files with a directive and tags its matrices, both of its own.
    let lines = text.lines().filter(|line| !line.starts_with("%YAML") && line.trim() != "---");
    let plain: String = lines.map(|line| line.replace("!!opencv-matrix", "")).collect::<Vec<_>>().join("\n");
    let raw: RawCamera = serde_yaml::from_str(&plain).map_err(|cause| WrongFile::new(origin, cause))?;
    let wrong = |what: String| WrongFile::new(origin, what);
    if let Some(model) = raw.distortion_model.as_deref().filter(|model| *model != "plumb_bob") {
        return Err(wrong(format!(
            "distortion_model is `{model}`; only plumb_bob (k1, k2, p1, p2, k3) is known: calibrate with it"
        )));
    }
    let matrix = &raw.camera_matrix;
    let [fx, skew, cx, b, fy, cy, c, d, one] = matrix.data.as_slice() else {
        return Err(wrong(format!("camera_matrix has {} numbers; it has 9", matrix.data.len())));
    };
    if (matrix.rows, matrix.cols) != (3, 3) || [*skew, *b, *c, *d] != [0.0; 4] || *one != 1.0 {
        return Err(wrong("camera_matrix is not [fx 0 cx; 0 fy cy; 0 0 1]".to_owned()));
    }
    let coefficients = &raw.distortion_coefficients;
    let count = coefficients.data.len();
    if coefficients.rows * coefficients.cols != count || ![0, 4, 5].contains(&count) {
        return Err(wrong(format!(
            "distortion_coefficients has {count} numbers in {} x {}; plumb_bob has 4 or 5: k1, k2, p1, p2, k3",
            coefficients.rows, coefficients.cols
        )));
    }
    let coefficient = |place: usize| coefficients.data.get(place).copied().unwrap_or(0.0);
    let camera = Camera {
        width_px: raw.image_width,
        height_px: raw.image_height,
        fx_px: *fx,
        fy_px: *fy,
        cx_px: *cx,
        cy_px: *cy,
        distortion: Distortion {
            k1: coefficient(0),
            k2: coefficient(1),
            p1: coefficient(2),
            p2: coefficient(3),
            k3: coefficient(4),
        },
    };
    camera.problem().map_or(Ok(camera), |problem| Err(wrong(problem)))
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
