//! PLY files: Stanford's polygon format, of which only the vertices count here.

use std::fmt::Write as _;

use crate::cloud::Cloud;
use crate::columns::{Meaning, count, gather, head, units};
use crate::number_format::{NumberFormat, Numbers};
use crate::scalars::{SCALARS, push_floats};

impl Cloud {
    /// Binary PLY in single precision, which every reader takes; grey as colour beside the scalars, so that every viewer shows something.
    pub fn ply(&self) -> Vec<u8> {
        let mut head = format!(
            "ply\nformat binary_little_endian 1.0\ncomment units mm\nelement vertex {}\n\
             property float x\nproperty float y\nproperty float z\n",
            self.points.len()
        );
        for scalar in SCALARS {
            let _ = writeln!(head, "property float {scalar}");
        }
        head.push_str("property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n");
        let mut bytes = head.into_bytes();
        for point in &self.points {
            push_floats(&mut bytes, point);
            bytes.extend([point.seen.intensity.clamp(0.0, 255.0) as u8; 3]);
        }
        bytes
    }
}

/// Reads the vertices of a PLY file, text or binary of either byte order.
///
/// # Errors
/// What is wrong with the file.
pub(crate) fn from_ply(bytes: &[u8]) -> Result<Cloud, String> {
    if !bytes.starts_with(b"ply") {
        return Err("it does not begin with `ply`".to_owned());
    }
    let (lines, body) = head(bytes, "end_header")?;
    let (mut columns, mut points, mut of_points) = (Vec::new(), None, false);
    let mut numbers = None;
    for line in &lines {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["format", "ascii", _] => numbers = Some(Numbers::written(body)),
            ["format", "binary_little_endian", _] => numbers = Some(Numbers::little_endian(body)),
            ["format", "binary_big_endian", _] => numbers = Some(Numbers::big_endian(body)),
            ["element", "vertex", many] => (points, of_points) = (Some(count(many)?), true),
            ["element", name, _] if points.is_none() => {
                return Err(format!("its {name} come before its points; write the vertices first"));
            }
            ["element", ..] => of_points = false,
            ["property", "list", ..] if of_points => {
                return Err("its points hold lists, which no cloud does".to_owned());
            }
            ["property", kind, name] if of_points => {
                let format = NumberFormat::of_ply(kind).ok_or(format!("`{kind}` is no kind of number"))?;
                columns.push((Meaning::of(name), format));
            }
            _ => {}
        }
    }
    let numbers = numbers.ok_or("its head has no line `format`")?;
    gather(&columns, points.ok_or("its head has no line `element vertex`")?, units(&lines), numbers)
}
