//! MCAP files with Foxglove's messages.

use std::collections::BTreeMap;
use std::io::Cursor;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use crate::cloud::Cloud;
use crate::scalars::{MM_PER_M, metres};

/// The camera that saw a cloud, for files that hold it: focal lengths and principal point in pixels, the middle of the first pixel 0, and the lens as `plumb_bob`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudCamera {
    /// Pixels in a row, and rows.
    pub size_px: [u32; 2],
    /// Focal lengths, px.
    pub focal_px: [f64; 2],
    /// Principal point, px.
    pub centre_px: [f64; 2],
    /// k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
}

/// MCAP with one `foxglove.PointCloud` on `/cloud` and, where the camera is known, its `foxglove.CameraCalibration` on `/camera`, both as JSON.
///
/// # Errors
/// What the format's library says.
pub(crate) fn mcap(
    cloud: &Cloud,
    time_ns: u64,
    camera: Option<&CloudCamera>,
) -> Result<Vec<u8>, mcap::McapError> {
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
        .map(|(index, name)| json!({"name": name, "offset": 4 * index, "type": FLOAT32}))
        .collect();
    let mut data = Vec::with_capacity(cloud.points.len() * 4 * NAMES.len());
    for point in &cloud.points {
        let seen = &point.seen;
        let others =
            [seen.intensity, seen.width_px, seen.sigma_mm / MM_PER_M, point.stripe as f32, seen.v_px];
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
