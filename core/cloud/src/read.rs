//! Clouds out of files, by their ending: PLY, PCD and E57, written here or by other programs.

use std::path::Path;

use plumb_document::{FileKind, read_bytes};

use crate::cloud::Cloud;
use crate::e57::from_e57;
use crate::errors::ReadError;
use crate::pcd::from_pcd;
use crate::ply::from_ply;

/// Reads a cloud from a file by its ending: `.ply`, `.pcd` or `.e57`. Lengths are mm unless a PLY or PCD says `units m` in a comment; E57 has metres.
///
/// # Errors
/// [`ReadError`]
pub fn read(path: &Path) -> Result<Cloud, ReadError> {
    let wrong = |what: String| ReadError { path: path.to_owned(), what };
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
    let bytes = read_bytes(path, FileKind::CLOUD).map_err(|cause| wrong(cause.to_string()))?;
    let cloud = match ending.as_str() {
        "ply" => from_ply(&bytes),
        "pcd" => from_pcd(&bytes),
        "e57" => from_e57(bytes),
        _ => Err(format!("clouds are read from .ply, .pcd and .e57, not from `.{ending}`")),
    };
    let cloud = cloud.map_err(wrong)?;
    if cloud.points.is_empty() {
        return Err(wrong("it holds no point".to_owned()));
    }
    Ok(cloud)
}
