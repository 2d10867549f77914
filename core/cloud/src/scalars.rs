//! What files of points hold beside the positions, in single precision.

use crate::cloud::CloudPoint;

/// mm in a metre: E57 and Foxglove count in metres.
pub(crate) const MM_PER_M: f32 = 1000.0;

/// What a point has beside its position, in single precision.
pub(crate) const SCALARS: [&str; 5] = ["intensity", "width", "sigma", "stripe", "row"];

pub(crate) fn scalars(point: &CloudPoint) -> [f32; 5] {
    let seen = &point.seen;
    [seen.intensity, seen.width_px, seen.sigma_mm, point.stripe as f32, seen.v_px]
}

/// Adds a point's position, mm, and its scalars to binary data, least significant byte first.
pub(crate) fn push_floats(bytes: &mut Vec<u8>, point: &CloudPoint) {
    let coordinates = point.position.coords.map(|axis| axis as f32);
    for value in coordinates.iter().copied().chain(scalars(point)) {
        bytes.extend(value.to_le_bytes());
    }
}

/// A point's position in metres.
pub(crate) fn metres(point: &CloudPoint) -> [f32; 3] {
    let [x, y, z] = point.position.coords.into();
    [x, y, z].map(|axis| (axis / f64::from(MM_PER_M)) as f32)
}
