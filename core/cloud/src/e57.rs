//! E57 files (ASTM E2807), which surveyors exchange.

use std::io::Cursor;

use e57::{E57Writer, Extension, Record, RecordDataType, RecordName, RecordValue};

use crate::cloud::{Cloud, CloudPoint};
use crate::columns::{Gathered, MOST_POINTS, Meaning};
use crate::scalars::{MM_PER_M, metres};

/// E57: positions in metres, intensity, the stripe as column and the picture's row as row; width (px) and sigma (m) under a name of our own.
///
/// # Errors
/// What the format's library says.
pub(crate) fn e57(cloud: &Cloud) -> Result<Vec<u8>, e57::Error> {
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
            RecordValue::Single(seen.sigma_mm / MM_PER_M),
        ])?;
    }
    scan.finalize()?;
    file.finalize()?;
    drop(file);
    Ok(bytes.into_inner())
}

/// A name that is the same for the same cloud and no other.
fn guid(cloud: &Cloud, part: u8) -> String {
    use sha2::{Digest, Sha256};
    let mut hash = Sha256::new();
    hash.update([part]);
    for point in &cloud.points {
        point.position.iter().for_each(|axis| hash.update(axis.to_le_bytes()));
    }
    let hex: String = hash.finalize().iter().take(16).map(|byte| format!("{byte:02X}")).collect();
    let part = |from: usize, to: usize| hex.get(from..to).unwrap_or_default().to_owned();
    format!("{{{}-{}-{}-{}-{}}}", part(0, 8), part(8, 12), part(12, 16), part(16, 20), part(20, 32))
}

/// Reads every cloud of an E57 file into one.
///
/// # Errors
/// What is wrong with the file.
pub(crate) fn from_e57(bytes: Vec<u8>) -> Result<Cloud, String> {
    let message = |error: e57::Error| error.to_string();
    let mut file = e57::E57Reader::new(Cursor::new(bytes)).map_err(message)?;
    let columns = [Meaning::X, Meaning::Y, Meaning::Z, Meaning::Intensity, Meaning::Stripe, Meaning::Row];
    let mut gathered = Gathered { points: Vec::new(), mm: 1000.0 };
    for cloud in file.pointclouds() {
        let points = cloud.records.saturating_add(gathered.points.len() as u64);
        if points > MOST_POINTS as u64 {
            return Err(format!("{points} points are more than the {MOST_POINTS} that are read"));
        }
        let mut points = file.pointcloud_simple(&cloud).map_err(message)?;
        points.normalize_intensity(false);
        for point in points {
            let point = point.map_err(message)?;
            let e57::CartesianCoordinate::Valid { x, y, z } = point.cartesian else { continue };
            let intensity = f64::from(point.intensity.unwrap_or(0.0));
            let grid = [point.column, point.row].map(|index| index.max(0) as f64);
            gathered.add(&columns, [x, y, z, intensity].into_iter().chain(grid));
        }
    }
    Ok(Cloud { points: gathered.points, ..Cloud::default() })
}
