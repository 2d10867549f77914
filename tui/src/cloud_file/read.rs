//! Clouds out of files: PLY, PCD and E57, ours and other programs'.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use nalgebra::Point3;
use plumb_cell::cloud::{Cloud, CloudPoint};
use plumb_document::{FileKind, read_bytes};
use plumb_plugin::StripePoint;

use super::number_format::{NumberFormat, Numbers};

/// Why a file gives no cloud.
#[derive(Debug, thiserror::Error)]
#[error("{}: {what}", path.display())]
pub(crate) struct CloudReadError {
    /// The file.
    pub(crate) path: PathBuf,
    /// What is wrong, and what would be right.
    pub(crate) what: String,
}

/// The most points of a cloud: each takes 64 bytes here, and a file of a few bytes can promise any number (E57 packs what is alike to nothing).
/// A scan of a thousand stripes of a thousand points is a fifth of it.
const MOST_POINTS: usize = 5_000_000;

/// The most columns of a point.
const MOST_COLUMNS: usize = 1000;

/// What a column of a file means here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meaning {
    X,
    Y,
    Z,
    Intensity,
    Width,
    Sigma,
    Stripe,
    Row,
    Other,
}

impl Meaning {
    /// Of a column of that name; other programs put `scalar_` before the names of what they keep.
    fn of(name: &str) -> Self {
        match name.strip_prefix("scalar_").unwrap_or(name).to_ascii_lowercase().as_str() {
            "x" => Self::X,
            "y" => Self::Y,
            "z" => Self::Z,
            "intensity" => Self::Intensity,
            "width" => Self::Width,
            "sigma" => Self::Sigma,
            "stripe" | "profile" => Self::Stripe,
            "row" => Self::Row,
            _ => Self::Other,
        }
    }
}

/// Puts points together, column by column.
#[derive(Default)]
struct Gathered {
    points: Vec<CloudPoint>,
    mm: f64,
}

impl Gathered {
    fn add(&mut self, columns: &[Meaning], values: impl Iterator<Item = f64>) {
        let mut point = CloudPoint { place: Point3::origin(), stripe: 0, seen: StripePoint::default() };
        for (meaning, value) in columns.iter().zip(values) {
            match meaning {
                Meaning::X => point.place.x = value * self.mm,
                Meaning::Y => point.place.y = value * self.mm,
                Meaning::Z => point.place.z = value * self.mm,
                Meaning::Intensity => point.seen.intensity = value as f32,
                Meaning::Width => point.seen.width_px = value as f32,
                Meaning::Sigma => point.seen.sigma_mm = (value * self.mm) as f32,
                Meaning::Stripe => point.stripe = value as u32,
                Meaning::Row => point.seen.v_px = value as f32,
                Meaning::Other => {}
            }
        }
        // Organized clouds hold not-a-number where nothing was seen.
        if point.place.iter().all(|axis| axis.is_finite()) {
            self.points.push(point);
        }
    }
}

/// Reads a cloud from a file by its ending: `.ply`, `.pcd` or `.e57`. Lengths are mm unless a PLY or PCD says `units m` in a comment; E57 has metres.
///
/// # Errors
/// [`CloudReadError`]
pub(crate) fn read(path: &Path) -> Result<Cloud, CloudReadError> {
    let wrong = |what: String| CloudReadError { path: path.to_owned(), what };
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

/// Splits off the head up to and with the line that begins with `last`; its lines, and what follows.
fn head<'a>(bytes: &'a [u8], last: &str) -> Result<(Vec<String>, &'a [u8]), String> {
    let (mut lines, mut rest) = (Vec::new(), bytes);
    while let Some(end) = rest.iter().position(|byte| *byte == b'\n') {
        let (line, after) = rest.split_at(end);
        rest = after.get(1..).unwrap_or_default();
        let line = String::from_utf8_lossy(line).trim_end().to_owned();
        let is_last = line.starts_with(last);
        lines.push(line);
        if is_last {
            return Ok((lines, rest));
        }
        if lines.len() > 1000 {
            break;
        }
    }
    Err(format!("its head has no line `{last}`: it is cut short, or of another kind"))
}

/// How many mm a unit of the file is.
fn units(lines: &[String]) -> f64 {
    let metres = |line: &String| {
        let words: Vec<&str> = line.trim_start_matches(['#', ' ']).split_whitespace().collect();
        matches!(words.as_slice(), ["comment", "units", "m"] | ["units", "m"])
    };
    if lines.iter().any(metres) { 1000.0 } else { 1.0 }
}

fn count(word: &str) -> Result<usize, String> {
    match word.parse::<usize>() {
        Ok(count) if count <= MOST_POINTS => Ok(count),
        _ => Err(format!("`{word}` is no number of points that is read: at most {MOST_POINTS}")),
    }
}

fn gather(
    columns: &[(Meaning, NumberFormat)],
    points: usize,
    mm: f64,
    mut numbers: Numbers<'_>,
) -> Result<Cloud, String> {
    let meanings: Vec<Meaning> = columns.iter().map(|(meaning, _)| *meaning).collect();
    if ![Meaning::X, Meaning::Y, Meaning::Z].iter().all(|axis| meanings.contains(axis)) {
        return Err("its points have no x, y and z".to_owned());
    }
    let mut gathered = Gathered { points: Vec::new(), mm };
    let mut values = Vec::with_capacity(columns.len());
    for place in 0..points {
        values.clear();
        for (_, format) in columns {
            let cut = || format!("it is cut short: {place} of {points} points are there");
            values.push(numbers.next(*format).ok_or_else(cut)?);
        }
        gathered.add(&meanings, values.iter().copied());
    }
    Ok(Cloud { points: gathered.points, ..Cloud::default() })
}

fn from_ply(bytes: &[u8]) -> Result<Cloud, String> {
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

fn from_pcd(bytes: &[u8]) -> Result<Cloud, String> {
    let (lines, body) = head(bytes, "DATA")?;
    let words = |key: &str| -> Vec<&str> {
        let line = lines.iter().find_map(|line| line.strip_prefix(key).filter(|rest| rest.starts_with(' ')));
        line.map(|rest| rest.split_whitespace().collect()).unwrap_or_default()
    };
    let (names, sizes, kinds, counts) = (words("FIELDS"), words("SIZE"), words("TYPE"), words("COUNT"));
    let mut columns = Vec::new();
    for (place, name) in names.iter().enumerate() {
        let (size, kind) = (sizes.get(place).unwrap_or(&""), kinds.get(place).unwrap_or(&""));
        let format = NumberFormat::of_pcd(kind, size)
            .ok_or_else(|| format!("the field `{name}` is `{kind}` of `{size}` bytes, which is no number"))?;
        let many = counts.get(place).map_or(Ok(1), |many| count(many))?;
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

fn from_e57(bytes: Vec<u8>) -> Result<Cloud, String> {
    let told = |error: e57::Error| error.to_string();
    let mut file = e57::E57Reader::new(Cursor::new(bytes)).map_err(told)?;
    let columns = [Meaning::X, Meaning::Y, Meaning::Z, Meaning::Intensity, Meaning::Stripe, Meaning::Row];
    let mut gathered = Gathered { points: Vec::new(), mm: 1000.0 };
    for cloud in file.pointclouds() {
        let points = cloud.records.saturating_add(gathered.points.len() as u64);
        if points > MOST_POINTS as u64 {
            return Err(format!("{points} points are more than the {MOST_POINTS} that are read"));
        }
        let mut points = file.pointcloud_simple(&cloud).map_err(told)?;
        points.normalize_intensity(false);
        for point in points {
            let point = point.map_err(told)?;
            let e57::CartesianCoordinate::Valid { x, y, z } = point.cartesian else { continue };
            let intensity = f64::from(point.intensity.unwrap_or(0.0));
            let grid = [point.column, point.row].map(|index| index.max(0) as f64);
            gathered.add(&columns, [x, y, z, intensity].into_iter().chain(grid));
        }
    }
    Ok(Cloud { points: gathered.points, ..Cloud::default() })
}
