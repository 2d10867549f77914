//! What a user is shown who has no camera, or names something else.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;

use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{Sensor, Value};
use serde_json::json;

use crate::V4l2Camera;

fn error_text(config: Value) -> String {
    V4l2Camera::create(&config, RecordingHost::new().host()).unwrap_err().text().to_owned()
}

#[test]
fn a_device_that_is_absent_or_no_camera_is_reported_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("picture.raw");
    fs::write(&file, [0; 6]).unwrap();
    let path = |path: &std::path::Path| path.display().to_string();
    for (device, expected) in [
        ("/dev/video987".to_owned(), "/dev/video987: there is no such device; this computer has "),
        (
            "/dev/null".to_owned(),
            "/dev/null: it is a device of another kind, not a camera; this computer has ",
        ),
        (path(&file), "picture.raw: it is a file, not a camera"),
        (path(folder.path()), "it is a folder, not a camera"),
    ] {
        let text = error_text(json!({"device": device}));
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
fn a_configuration_that_cannot_be_is_refused_before_anything_is_opened() {
    for (config, expected) in [
        (json!({}), "missing field `device`; a camera takes {device: /dev/video0"),
        (json!({"device": "/dev/video0", "size": 3}), "unknown field `size`"),
        (
            json!({"device": "/dev/video0", "format": "MJPG"}),
            "is compressed, which moves the edges of a line: write one of GREY, Y10",
        ),
        (
            json!({"device": "/dev/video0", "format": "RGB3"}),
            "`format: RGB3` is none: write one of GREY, Y10",
        ),
        (json!({"device": "/dev/video0", "exposure_us": 0}), "`exposure_us` is above 0"),
        (json!({"device": "/dev/video0", "frames_per_second": -1}), "`frames_per_second` is above 0"),
        (json!({"device": "/dev/video0", "every_ms": 1e9}), "`every_ms` is 1000000000; it is 0 to 60000"),
    ] {
        let text = error_text(config);
        assert!(text.contains(expected), "{text}");
    }
}
