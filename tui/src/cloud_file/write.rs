//! Clouds for other programs: PLY, PCD, E57 and MCAP, by the file's ending.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Cursor, Write as _};
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use e57::{E57Writer, Extension, Record, RecordDataType, RecordName, RecordValue};
use plumb_cell::cloud::{Cloud, CloudPoint, SaveError};
use serde_json::{Value, json};

/// The camera that saw a cloud, for files that hold it: focal lengths and principal point in pixels, the middle of the first pixel 0, and the lens as `plumb_bob`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CloudCamera {
    /// Pixels in a row, and rows.
    pub(crate) size_px: [u32; 2],
    /// Focal lengths, px.
    pub(crate) focal_px: [f64; 2],
    /// Principal point, px.
    pub(crate) centre_px: [f64; 2],
    /// k1, k2, p1, p2, k3.
    pub(crate) distortion: [f64; 5],
}

/// mm in a metre: E57 and Foxglove count in metres.
const MM: f32 = 1000.0;

/// Writes the cloud into a file by its ending: `.ply` or `.pcd` (mm), `.e57` or `.mcap` (metres, as these formats have it). `time_ns` (since 1970) and the camera
/// go into an MCAP.
///
/// # Errors
/// [`SaveError`], also for another ending.
pub(crate) fn write(
    cloud: &Cloud,
    path: &Path,
    time_ns: u64,
    camera: Option<&CloudCamera>,
) -> Result<(), SaveError> {
    let failed = |cause: io::Error| SaveError { path: path.to_owned(), cause };
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
    let bytes = match ending.as_str() {
        "ply" => Ok(cloud.ply()),
        "pcd" => Ok(cloud.pcd()),
        "e57" => e57(cloud).map_err(io::Error::other),
        "mcap" => mcap(cloud, time_ns, camera).map_err(io::Error::other),
        _ => Err(io::Error::other(format!(
            "clouds are written as .ply, .pcd, .e57 and .mcap, not as `.{ending}`"
        ))),
    };
    let bytes = bytes.map_err(failed)?;
    // Half a cloud would be taken for a whole one.
    fs::File::create_new(path).map_err(failed)?.write_all(&bytes).map_err(|cause| {
        let _removed = fs::remove_file(path);
        failed(cause)
    })
}

/// E57: places in metres, intensity, the stripe as column and the picture's row as row; width (px) and sigma (m) under a name of our own.
///
/// # Errors
/// What the format's library says.
fn e57(cloud: &Cloud) -> Result<Vec<u8>, e57::Error> {
    let single = |name: RecordName| Record { name, data_type: RecordDataType::F32 };
    let integer = |name: RecordName, max: i64| {
        let data_type = RecordDataType::Integer { min: 0, max: max.max(1) };
        Record { name, data_type }
    };
    let own = |name: &str| RecordName::Unknown { namespace: "plumb".to_owned(), name: name.to_owned() };
    let most = |value: fn(&CloudPoint) -> i64| cloud.points.iter().map(value).max().unwrap_or(0);
    let (stripe, row) =
        (|point: &CloudPoint| i64::from(point.stripe), |point: &CloudPoint| point.seen.v_px as i64);
    let prototype = vec![
        Record::CARTESIAN_X_F32,
        Record::CARTESIAN_Y_F32,
        Record::CARTESIAN_Z_F32,
        Record {
            name: RecordName::Intensity,
            data_type: RecordDataType::Single { min: Some(0.0), max: Some(255.0) },
        },
        integer(RecordName::ColumnIndex, most(stripe)),
        integer(RecordName::RowIndex, most(row)),
        single(own("width")),
        single(own("sigma")),
    ];
    let mut bytes = Cursor::new(Vec::new());
    let mut file = E57Writer::new(&mut bytes, &guid(cloud, 0))?;
    file.register_extension(Extension::new("plumb", "https://plumb.invalid/e57/1"))?;
    let mut scan = file.add_pointcloud(&guid(cloud, 1), prototype)?;
    scan.set_name(Some("scan".to_owned()));
    scan.set_description(Some(
        "Points of a light stripe in the robot's base frame. column: the stripe, row: the picture's row, plumb:width: lit pixels, plumb:sigma: standard \
         uncertainty in metres."
            .to_owned(),
    ));
    for point in &cloud.points {
        let [x, y, z] = metres(point).map(RecordValue::Single);
        let seen = &point.seen;
        scan.add_point(vec![
            x,
            y,
            z,
            RecordValue::Single(seen.intensity.clamp(0.0, 255.0)),
            RecordValue::Integer(stripe(point)),
            RecordValue::Integer(row(point).max(0)),
            RecordValue::Single(seen.width_px),
            RecordValue::Single(seen.sigma_mm / MM),
        ])?;
    }
    scan.finalize()?;
    file.finalize()?;
    drop(file);
    Ok(bytes.into_inner())
}

/// MCAP with one `foxglove.PointCloud` on `/cloud` and, where the camera is known, its `foxglove.CameraCalibration` on `/camera`, both as JSON.
///
/// # Errors
/// What the format's library says.
fn mcap(cloud: &Cloud, time_ns: u64, camera: Option<&CloudCamera>) -> Result<Vec<u8>, mcap::McapError> {
    let mut bytes = Cursor::new(Vec::new());
    let mut file = mcap::WriteOptions::new().compression(None).create(&mut bytes)?;
    let mut put = |topic: &str, name: &str, schema: Value, message: Value| {
        let schema = file.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
        let channel_id = file.add_channel(schema, topic, "json", &BTreeMap::new())?;
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: 0,
            log_time: time_ns,
            publish_time: time_ns,
        };
        file.write_to_known_channel(&header, message.to_string().as_bytes())
    };
    if let Some(camera) = camera {
        put("/camera", "foxglove.CameraCalibration", calibration_schema(), calibration(camera, time_ns))?;
    }
    put("/cloud", "foxglove.PointCloud", cloud_schema(), foxglove(cloud, time_ns))?;
    file.finish()?;
    drop(file);
    Ok(bytes.into_inner())
}

/// As `foxglove.PointCloud`.
fn foxglove(cloud: &Cloud, time_ns: u64) -> Value {
    const FLOAT32: u32 = 7;
    const NAMES: [&str; 8] = ["x", "y", "z", "intensity", "width", "sigma", "stripe", "row"];
    let fields: Vec<Value> = NAMES
        .iter()
        .enumerate()
        .map(|(place, name)| json!({"name": name, "offset": 4 * place, "type": FLOAT32}))
        .collect();
    let mut data = Vec::with_capacity(cloud.points.len() * 4 * NAMES.len());
    for point in &cloud.points {
        let seen = &point.seen;
        let others = [seen.intensity, seen.width_px, seen.sigma_mm / MM, point.stripe as f32, seen.v_px];
        for value in metres(point).into_iter().chain(others) {
            data.extend(value.to_le_bytes());
        }
    }
    json!({
        "timestamp": time(time_ns),
        "frame_id": "base",
        "pose": {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}},
        "point_stride": 4 * NAMES.len(),
        "fields": fields,
        "data": STANDARD.encode(&data),
    })
}

fn metres(point: &CloudPoint) -> [f32; 3] {
    let [x, y, z] = point.place.coords.into();
    [x, y, z].map(|axis| (axis / f64::from(MM)) as f32)
}

/// A name that is the same for the same cloud and no other.
fn guid(cloud: &Cloud, part: u8) -> String {
    use sha2::{Digest, Sha256};
    let mut hash = Sha256::new();
    hash.update([part]);
    for point in &cloud.points {
        point.place.iter().for_each(|axis| hash.update(axis.to_le_bytes()));
    }
    let hex: String = hash.finalize().iter().take(16).map(|byte| format!("{byte:02X}")).collect();
    let part = |from: usize, to: usize| hex.get(from..to).unwrap_or_default().to_owned();
    format!("{{{}-{}-{}-{}-{}}}", part(0, 8), part(8, 12), part(12, 16), part(16, 20), part(20, 32))
}

fn time(time_ns: u64) -> Value {
    json!({"sec": time_ns / 1_000_000_000, "nsec": time_ns % 1_000_000_000})
}

fn calibration(camera: &CloudCamera, time_ns: u64) -> Value {
    let ([fx, fy], [cx, cy]) = (camera.focal_px, camera.centre_px);
    json!({
        "timestamp": time(time_ns),
        "frame_id": "camera",
        "width": camera.size_px[0],
        "height": camera.size_px[1],
        "distortion_model": "plumb_bob",
        "D": camera.distortion,
        "K": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    })
}

fn object(title: &str, properties: Value) -> Value {
    json!({"title": title, "type": "object", "properties": properties})
}

fn time_schema() -> Value {
    object("time", json!({"sec": {"type": "integer"}, "nsec": {"type": "integer"}}))
}

fn cloud_schema() -> Value {
    let number = json!({"type": "number"});
    let position = object("foxglove.Vector3", json!({"x": number, "y": number, "z": number}));
    let turn = object("foxglove.Quaternion", json!({"x": number, "y": number, "z": number, "w": number}));
    let integer = json!({"type": "integer"});
    let field = object(
        "foxglove.PackedElementField",
        json!({"name": {"type": "string"}, "offset": integer, "type": integer}),
    );
    object(
        "foxglove.PointCloud",
        json!({
            "timestamp": time_schema(),
            "frame_id": {"type": "string"},
            "pose": object("foxglove.Pose", json!({"position": position, "orientation": turn})),
            "point_stride": integer,
            "fields": {"type": "array", "items": field},
            "data": {"type": "string", "contentEncoding": "base64"},
        }),
    )
}

fn calibration_schema() -> Value {
    let numbers = json!({"type": "array", "items": {"type": "number"}});
    object(
        "foxglove.CameraCalibration",
        json!({
            "timestamp": time_schema(),
            "frame_id": {"type": "string"},
            "width": {"type": "integer"},
            "height": {"type": "integer"},
            "distortion_model": {"type": "string"},
            "D": numbers,
            "K": numbers,
            "R": numbers,
            "P": numbers,
        }),
    )
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::*;
    use nalgebra::Point3;
    use plumb_plugin::StripePoint;

    fn cloud() -> Cloud {
        let point = |number: u32| CloudPoint {
            place: Point3::new(f64::from(number), 530.5, -300.0 + 0.25 * f64::from(number)),
            stripe: number / 10,
            seen: StripePoint {
                v_px: (number % 10) as f32,
                width_px: 5.0,
                intensity: 200.0,
                sigma_mm: 0.045,
                ..StripePoint::default()
            },
        };
        Cloud { points: (0..95).map(point).collect(), ..Cloud::default() }
    }

    #[test]
    fn a_cloud_comes_back_from_ply_pcd_and_e57_as_it_went() {
        let folder = tempfile::tempdir().unwrap();
        for ending in ["ply", "pcd", "e57"] {
            let path = folder.path().join(format!("cloud.{ending}"));
            write(&cloud(), &path, 0, None).unwrap();
            let back = read(&path).unwrap();
            assert_eq!(back.points.len(), 95, "{ending}");
            for (back, went) in back.points.iter().zip(&cloud().points) {
                assert!((back.place - went.place).norm() < 1e-4, "{ending}: {back:?}");
                assert_eq!((back.stripe, back.seen.v_px), (went.stripe, went.seen.v_px), "{ending}");
                assert_eq!(back.seen.intensity, 200.0, "{ending}");
            }
        }
    }

    #[test]
    fn what_was_cut_short_anywhere_is_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        for (ending, bytes) in
            [("ply", cloud().ply()), ("pcd", cloud().pcd()), ("e57", e57(&cloud()).unwrap())]
        {
            let path = folder.path().join(format!("cloud.{ending}"));
            for length in (0..bytes.len() - 1).step_by(37) {
                fs::write(&path, &bytes[..length]).unwrap();
                let error = read(&path).unwrap_err().to_string();
                assert!(error.contains(&format!("cloud.{ending}: ")), "{error}");
            }
        }
    }

    #[test]
    fn clouds_of_other_programs_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let given = |name: &str, text: &str| {
            fs::write(folder.path().join(name), text).unwrap();
            read(&folder.path().join(name))
        };
        let ply = "ply\nformat ascii 1.0\ncomment units m\nelement vertex 2\nproperty double x\nproperty double y\n\
            property double z\nproperty float scalar_Intensity\nelement face 0\nproperty list uchar int vertex_indices\n\
            end_header\n0.1 0.2 0.3 7\n1 2 nan 9\n";
        let cloud = given("a.ply", ply).unwrap();
        assert_eq!(cloud.points.len(), 1, "a place that is no place is left out");
        assert_eq!(
            (cloud.points[0].place, cloud.points[0].seen.intensity),
            (Point3::new(100.0, 200.0, 300.0), 7.0)
        );
        let pcd = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z normal\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 3\nWIDTH 1\n\
            HEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3 0 0 1\n";
        assert_eq!(given("a.pcd", pcd).unwrap().points[0].place, Point3::new(1.0, 2.0, 3.0));
        let told = |name: &str, text: &str| given(name, text).unwrap_err().to_string();
        assert!(
            told("b.pcd", &pcd.replace("ascii", "binary_compressed")).contains("ascii and binary are read")
        );
        assert!(told("b.ply", &ply.replace("double z", "double w")).contains("no x, y and z"));
        assert!(told("c.ply", &ply.replace("vertex 2", "vertex 3")).contains("2 of 3 points are there"));
        assert!(told("d.ply", &ply.replace("vertex 2", "vertex 0")).contains("holds no point"));
        assert!(told("e.xyz", "1 2 3").contains("not from `.xyz`"));
    }

    #[test]
    fn an_mcap_holds_foxgloves_cloud_and_camera() {
        let camera = CloudCamera {
            size_px: [256, 256],
            focal_px: [694.4, 694.5],
            centre_px: [127.5, 127.0],
            distortion: [-0.1, 0.0, 0.0, 0.0, 0.0],
        };
        let bytes = mcap(&cloud(), 1_500_000_000, Some(&camera)).unwrap();
        let messages: Vec<_> =
            mcap::MessageStream::new(&bytes).unwrap().collect::<Result<Vec<_>, _>>().unwrap();
        let names: Vec<&str> =
            messages.iter().map(|message| message.channel.schema.as_ref().unwrap().name.as_str()).collect();
        assert_eq!(names, ["foxglove.CameraCalibration", "foxglove.PointCloud"]);
        let told: Vec<Value> =
            messages.iter().map(|message| serde_json::from_slice(&message.data).unwrap()).collect();
        assert_eq!(told[0]["K"][4], 694.5);
        assert_eq!(
            (&told[1]["timestamp"]["nsec"], &told[1]["point_stride"]),
            (&json!(500_000_000), &json!(32))
        );
        assert_eq!(told[1]["data"].as_str().unwrap().len(), (95 * 32_usize).div_ceil(3) * 4);
    }
}
