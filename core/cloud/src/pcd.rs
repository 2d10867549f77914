//! PCD files: the format of the Point Cloud Library, version 0.7.

use crate::cloud::Cloud;
use crate::columns::{MOST_COLUMNS, Meaning, count, gather, head, units};
use crate::number_format::{NumberFormat, Numbers};
use crate::scalars::{SCALARS, push_floats};

impl Cloud {
    /// Binary PCD of version 0.7.
    pub fn pcd(&self) -> Vec<u8> {
        let count = self.points.len();
        let fields = SCALARS.join(" ");
        let eight = |word: &str| [word; 8].join(" ");
        let head = format!(
            "# units mm\nVERSION 0.7\nFIELDS x y z {fields}\nSIZE {}\nTYPE {}\nCOUNT {}\nWIDTH {count}\nHEIGHT 1\n\
             VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n",
            eight("4"),
            eight("F"),
            eight("1")
        );
        let mut bytes = head.into_bytes();
        self.points.iter().for_each(|point| push_floats(&mut bytes, point));
        bytes
    }
}

/// Reads a PCD file, text or uncompressed binary.
///
/// # Errors
/// What is wrong with the file.
pub(crate) fn from_pcd(bytes: &[u8]) -> Result<Cloud, String> {
    let (lines, body) = head(bytes, "DATA")?;
    let words = |key: &str| -> Vec<&str> {
        let line = lines.iter().find_map(|line| line.strip_prefix(key).filter(|rest| rest.starts_with(' ')));
        line.map(|rest| rest.split_whitespace().collect()).unwrap_or_default()
    };
    let (names, sizes, kinds, counts) = (words("FIELDS"), words("SIZE"), words("TYPE"), words("COUNT"));
    let mut columns = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let (size, kind) = (sizes.get(index).unwrap_or(&""), kinds.get(index).unwrap_or(&""));
        let format = NumberFormat::of_pcd(kind, size)
            .ok_or_else(|| format!("the field `{name}` is `{kind}` of `{size}` bytes, which is no number"))?;
        let many = counts.get(index).map_or(Ok(1), |many| count(many))?;
        if many > 1000 {
            return Err(format!("the field `{name}` has {many} numbers a point"));
        }
        let meaning = if many == 1 { Meaning::of(name) } else { Meaning::Other };
        columns.extend(std::iter::repeat_n((meaning, format), many));
        if columns.len() > MOST_COLUMNS {
            return Err(format!("its points have more than {MOST_COLUMNS} numbers each"));
        }
    }
    let points =
        count(words("POINTS").first().copied().unwrap_or("")).map_err(|what| format!("POINTS: {what}"))?;
    let numbers = match words("DATA").as_slice() {
        ["ascii"] => Numbers::written(body),
        ["binary"] => Numbers::little_endian(body),
        other => {
            return Err(format!("its points are written `{}`; ascii and binary are read", other.join(" ")));
        }
    };
    gather(&columns, points, units(&lines), numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::CloudPoint;
    use nalgebra::Point3;

    #[test]
    fn both_formats_hold_as_many_bytes_as_their_headers_say() {
        let point = CloudPoint { position: Point3::new(1.0, 2.0, 3.0), stripe: 4, seen: Default::default() };
        let cloud = Cloud { points: vec![point; 7], poses: vec![vec![0.5; 6]], ..Cloud::default() };
        let after = |bytes: &[u8], mark: &[u8]| {
            let at = bytes.windows(mark.len()).position(|window| window == mark).unwrap();
            bytes.len() - at - mark.len()
        };
        assert_eq!(after(&cloud.ply(), b"end_header\n"), 7 * (8 * 4 + 3));
        assert_eq!(after(&cloud.pcd(), b"DATA binary\n"), 7 * 8 * 4);
        assert!(String::from_utf8_lossy(&cloud.ply()).contains("comment units mm"));
    }
}
