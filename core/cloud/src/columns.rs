//! What the columns of a file of points mean, and the points put together from them.

use nalgebra::Point3;
use plumb_plugin::StripePoint;

use crate::cloud::{Cloud, CloudPoint};
use crate::number_format::{NumberFormat, Numbers};

/// The most points of a cloud: each takes 64 bytes here, and a file of a few bytes can promise any number (E57 packs what is alike to nothing).
/// A scan of a thousand stripes of a thousand points is a fifth of it.
pub(crate) const MOST_POINTS: usize = 5_000_000;

/// The most columns of a point.
pub(crate) const MOST_COLUMNS: usize = 1000;

/// What a column of a file means here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Meaning {
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
    pub(crate) fn of(name: &str) -> Self {
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
pub(crate) struct Gathered {
    /// The points so far.
    pub(crate) points: Vec<CloudPoint>,
    /// How many mm a unit of the file is.
    pub(crate) mm: f64,
}

impl Gathered {
    /// Adds a point with these values; leaves it out where its position is not finite.
    pub(crate) fn add(&mut self, columns: &[Meaning], values: impl Iterator<Item = f64>) {
        let mut point = CloudPoint { position: Point3::origin(), stripe: 0, seen: StripePoint::default() };
        for (meaning, value) in columns.iter().zip(values) {
            match meaning {
                Meaning::X => point.position.x = value * self.mm,
                Meaning::Y => point.position.y = value * self.mm,
                Meaning::Z => point.position.z = value * self.mm,
                Meaning::Intensity => point.seen.intensity = value as f32,
                Meaning::Width => point.seen.width_px = value as f32,
                Meaning::Sigma => point.seen.sigma_mm = (value * self.mm) as f32,
                Meaning::Stripe => point.stripe = value as u32,
                Meaning::Row => point.seen.v_px = value as f32,
                Meaning::Other => {}
            }
        }
        // Organized clouds hold not-a-number where nothing was seen.
        if point.position.iter().all(|axis| axis.is_finite()) {
            self.points.push(point);
        }
    }
}

/// Splits off the head up to and with the line that begins with `last`; its lines, and what follows.
pub(crate) fn head<'a>(bytes: &'a [u8], last: &str) -> Result<(Vec<String>, &'a [u8]), String> {
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
pub(crate) fn units(lines: &[String]) -> f64 {
    let metres = |line: &String| {
        let words: Vec<&str> = line.trim_start_matches(['#', ' ']).split_whitespace().collect();
        matches!(words.as_slice(), ["comment", "units", "m"] | ["units", "m"])
    };
    if lines.iter().any(metres) { 1000.0 } else { 1.0 }
}

pub(crate) fn count(word: &str) -> Result<usize, String> {
    match word.parse::<usize>() {
        Ok(count) if count <= MOST_POINTS => Ok(count),
        _ => Err(format!("`{word}` is no number of points that is read: at most {MOST_POINTS}")),
    }
}

pub(crate) fn gather(
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
    for index in 0..points {
        values.clear();
        for (_, format) in columns {
            let cut = || format!("it is cut short: {index} of {points} points are there");
            values.push(numbers.next(*format).ok_or_else(cut)?);
        }
        gathered.add(&meanings, values.iter().copied());
    }
    Ok(Cloud { points: gathered.points, ..Cloud::default() })
}
