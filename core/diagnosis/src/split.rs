//! Which rows are fitted and which are held out to check with.

use std::collections::HashMap;
use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use crate::thresholds::{FEW_POSES, FEW_POSES_RETURNS, LONELY_FACTOR, LONELY_POSES};
use plumb_calibration::table::Table;
use plumb_estimation::Random;

/// How the held-out set is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Holdout {
    /// Whole regions of pose space, about a fifth of the poses.
    #[default]
    Regions,
    /// A random fraction, by seed; returns to one pose stay together.
    Random {
        /// Fraction held out, 0 to 1.
        fraction: f64,
        /// Seed.
        seed: u64,
    },
    /// The last fraction in the order of time.
    Time {
        /// Fraction held out, 0 to 1.
        fraction: f64,
    },
    /// The last session.
    Session,
    /// Nothing is held out.
    None,
}

/// Why a held-out set cannot be chosen.
#[derive(Debug, Error, PartialEq)]
pub enum HoldoutError {
    /// The text says no known way.
    #[error("`{0}` is no way to hold rows out; write regions, random:0.3:SEED, time:0.3, session or none")]
    Unknown(String),
    /// A fraction outside 0 to 1.
    #[error("`{0}`: the fraction held out must lie between 0 and 1")]
    Proportion(String),
    /// `session` without sessions.
    #[error("the table has no `session` column with at least two sessions to hold one out")]
    NoSessions,
}

impl FromStr for Holdout {
    type Err = HoldoutError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.split(':').collect::<Vec<_>>().as_slice() {
            ["regions"] => Ok(Self::Regions),
            ["session"] => Ok(Self::Session),
            ["none"] => Ok(Self::None),
            ["random"] => Ok(Self::Random { fraction: 0.3, seed: 1 }),
            ["random", part] => Ok(Self::Random { fraction: fraction(part, text)?, seed: 1 }),
            ["random", part, seed] => {
                let seed = seed.parse().map_err(|_| HoldoutError::Unknown(text.to_owned()))?;
                Ok(Self::Random { fraction: fraction(part, text)?, seed })
            }
            ["time"] => Ok(Self::Time { fraction: 0.3 }),
            ["time", part] => Ok(Self::Time { fraction: fraction(part, text)? }),
            _ => Err(HoldoutError::Unknown(text.to_owned())),
        }
    }
}

/// A fraction, as a part of what was written.
fn fraction(part: &str, text: &str) -> Result<f64, HoldoutError> {
    let fraction: f64 = part.parse().map_err(|_| HoldoutError::Unknown(text.to_owned()))?;
    // Of nothing held out, and of nothing fitted, there is nothing to check.
    if fraction > 0.0 && fraction < 1.0 {
        Ok(fraction)
    } else {
        Err(HoldoutError::Proportion(text.to_owned()))
    }
}

impl fmt::Display for Holdout {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Regions => formatter.write_str("regions"),
            Self::Random { fraction, seed } => write!(formatter, "random:{fraction}:{seed}"),
            Self::Time { fraction } => write!(formatter, "time:{fraction}"),
            Self::Session => formatter.write_str("session"),
            Self::None => formatter.write_str("none"),
        }
    }
}

/// Poses of a table: rows that fraction one (returns, or equal coordinates) belong together.
#[derive(Debug, Clone)]
pub(crate) struct Poses {
    /// Rows of each pose.
    pub(crate) rows: Vec<Vec<usize>>,
    /// Coordinates of each pose, each joint scaled to its range in the table.
    pub(crate) positions: Vec<Vec<f64>>,
}

/// Rows of each pose, in the order in which poses were first measured. Returns named for the side from which they came are returns to one pose.
fn rows_by_pose(table: &Table) -> Vec<Vec<usize>> {
    let mut named: HashMap<u32, usize> = HashMap::new();
    let mut placed: HashMap<Vec<u64>, usize> = HashMap::new();
    // The pose of each row so far; poses that turn out to be one are merged into the earlier.
    let mut rows: Vec<Vec<usize>> = Vec::new();
    let mut merged: Vec<usize> = Vec::new();
    for row in 0..table.len() {
        let name = table.repeat.of_row.get(row).copied().flatten();
        let coordinates: Vec<u64> = table.q_of(row).iter().map(|q| q.to_bits()).collect();
        let by_name = name.and_then(|name| named.get(&name)).map(|pose| earliest(&merged, *pose));
        let by_position = placed.get(&coordinates).map(|pose| earliest(&merged, *pose));
        let pose = match (by_name, by_position) {
            (Some(one), Some(other)) => {
                let (first, later) = (one.min(other), one.max(other));
                if first < later {
                    merged[later] = first;
                    let own = std::mem::take(&mut rows[later]);
                    rows[first].extend(own);
                }
                first
            }
            (Some(pose), None) | (None, Some(pose)) => pose,
            (None, None) => {
                rows.push(Vec::new());
                merged.push(merged.len());
                rows.len() - 1
            }
        };
        rows[pose].push(row);
        placed.insert(coordinates, pose);
        named.extend(name.map(|name| (name, pose)));
    }
    rows.retain(|rows| !rows.is_empty());
    rows.iter_mut().for_each(|rows| rows.sort_unstable());
    rows
}

/// The pose that a pose was merged into.
fn earliest(merged: &[usize], mut pose: usize) -> usize {
    while let Some(into) = merged.get(pose).filter(|into| **into != pose) {
        pose = *into;
    }
    pose
}

impl Poses {
    pub(crate) fn of(table: &Table) -> Self {
        let rows = rows_by_pose(table);
        let ranges: Vec<(f64, f64)> = (0..table.joints)
            .map(|joint| {
                let q = (0..table.len()).filter_map(|row| table.q_of(row).get(joint).copied());
                q.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)))
            })
            .collect();
        // A joint that did not move parts nothing.
        let positions = rows.iter().map(|list| {
            let q = list.first().map_or(&[][..], |row| table.q_of(*row)).iter().zip(&ranges);
            q.map(|(q, (low, high))| if high > low { (q - low) / (high - low) } else { 0.5 }).collect()
        });
        let positions = positions.collect();
        Self { rows, positions }
    }

    /// Poses put into `count` regions of like size: cut again and again across the widest spread, at the median.
    /// Only `chosen` poses take part. Replicates lists of poses.
    pub(crate) fn regions(&self, chosen: &[usize], count: usize) -> Vec<Vec<usize>> {
        let mut regions = vec![chosen.to_vec()];
        while regions.len() < count {
            // Always the largest: regions of like size give errors of like weight (the first of equals, so that the cut does not depend on the platform).
            let largest =
                regions.iter().enumerate().max_by_key(|(index, region)| (region.len(), usize::MAX - index));
            let Some((index, _)) = largest.filter(|(_, region)| region.len() >= 2) else { break };
            let region = regions.swap_remove(index);
            let (low, high) = self.cut(region);
            regions.push(low);
            regions.push(high);
        }
        regions
    }

    fn cut(&self, mut region: Vec<usize>) -> (Vec<usize>, Vec<usize>) {
        let joints = self.positions.first().map_or(0, Vec::len);
        // The first joints move the tip most: among equals they are cut first.
        let spreads: Vec<f64> =
            (0..joints).map(|joint| self.spread(&region, joint) * weight(joint)).collect();
        let widest = (0..joints).max_by(|a, b| spreads[*a].total_cmp(&spreads[*b])).unwrap_or(0);
        region.sort_by(|a, b| self.coordinate(*a, widest).total_cmp(&self.coordinate(*b, widest)));
        let high = region.split_off(region.len() / 2);
        (region, high)
    }

    fn coordinate(&self, pose: usize, joint: usize) -> f64 {
        self.positions.get(pose).and_then(|position| position.get(joint)).copied().unwrap_or(0.0)
    }

    /// Sum of squares of a joint's coordinates about their mean, over some poses.
    fn spread(&self, region: &[usize], joint: usize) -> f64 {
        let of_region = region.iter().map(|pose| self.coordinate(*pose, joint));
        let mean = of_region.clone().sum::<f64>() / region.len() as f64;
        of_region.map(|q| (q - mean).powi(2)).sum()
    }

    /// How far two poses are apart, each joint scaled to its range.
    fn apart(&self, one: usize, other: usize) -> f64 {
        let [one, other] = [one, other].map(|pose| self.positions.get(pose).map_or(&[][..], Vec::as_slice));
        one.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    }

    /// Drops from these poses those that lie far from all but a few others, by the distances usual among them. Of large tables none,
    /// for a few say little there.
    pub(crate) fn drop_lonely(&self, chosen: &mut Vec<usize>) {
        if chosen.is_empty() || chosen.len() > LONELY_POSES {
            return;
        }
        // A fifth of them are not a few.
        let few = chosen.len().div_ceil(5).min(chosen.len().saturating_sub(1));
        let reaches: Vec<f64> = chosen
            .iter()
            .map(|pose| {
                let mut distances: Vec<f64> = chosen.iter().map(|other| self.apart(*pose, *other)).collect();
                *distances.select_nth_unstable_by(few, f64::total_cmp).1
            })
            .collect();
        let mut sorted = reaches.clone();
        // Relative to the median reach: a sparse table is not lonely everywhere.
        let far = LONELY_FACTOR * *sorted.select_nth_unstable_by(reaches.len() / 2, f64::total_cmp).1;
        // Where many lie far out, that is how the table was measured.
        if reaches.iter().filter(|reach| **reach > far).count() > few {
            return;
        }
        let mut reaches = reaches.into_iter();
        chosen.retain(|_| reaches.next().is_none_or(|reach| reach <= far));
    }

    /// Rows of a list of poses.
    pub(crate) fn rows_of(&self, poses: &[usize]) -> Vec<usize> {
        poses.iter().filter_map(|pose| self.rows.get(*pose)).flatten().copied().collect()
    }
}

fn weight(joint: usize) -> f64 {
    1.0 / (1.0 + 0.2 * joint as f64)
}

/// The rows that are fitted and those that are held out.
#[derive(Debug, Clone, PartialEq)]
pub struct Split {
    /// Per row: fitted.
    pub fit: Vec<bool>,
    /// Per row: held out.
    pub check: Vec<bool>,
}

impl Split {
    /// Splits a table.
    ///
    /// # Errors
    /// Sessions asked for where there are none.
    pub fn new(table: &Table, holdout: Holdout) -> Result<Self, HoldoutError> {
        let poses = Poses::of(table);
        let check_rows = match holdout {
            Holdout::None => Vec::new(),
            Holdout::Random { fraction, seed } => random(&poses, table.len(), fraction, seed),
            Holdout::Time { fraction } => last(table, fraction),
            Holdout::Session => last_session(table)?,
            Holdout::Regions => regions(&poses, table),
        };
        let mut check = vec![false; table.len()];
        for row in check_rows {
            if let Some(flag) = check.get_mut(row) {
                *flag = true;
            }
        }
        Ok(Self { fit: check.iter().map(|held| !held).collect(), check })
    }

    /// Fits about `most` rows only, chosen at random by pose.
    pub(crate) fn keep(&mut self, table: &Table, most: usize) {
        let poses = Poses::of(table);
        let mut order: Vec<usize> = (0..poses.rows.len()).collect();
        Random::seeded(7).shuffle(&mut order);
        let mut kept = vec![false; self.fit.len()];
        let mut count = 0;
        for row in order.into_iter().flat_map(|pose| poses.rows_of(&[pose])) {
            // Pose by pose: replicates stay together, as far as there is room.
            if count < most && self.fit.get(row).copied().unwrap_or(false) {
                kept[row] = true;
                count += 1;
            }
        }
        self.fit = kept;
    }

    /// Rows that are fitted.
    pub fn fit_rows(&self) -> Vec<usize> {
        rows(&self.fit)
    }

    /// Rows that are held out.
    pub fn check_rows(&self) -> Vec<usize> {
        rows(&self.check)
    }
}

fn rows(mask: &[bool]) -> Vec<usize> {
    mask.iter().enumerate().filter(|(_, set)| **set).map(|(row, _)| row).collect()
}

fn random(poses: &Poses, rows: usize, fraction: f64, seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..poses.rows.len()).collect();
    Random::seeded(seed).shuffle(&mut order);
    let requested = (fraction * rows as f64).round() as usize;
    let mut held = Vec::new();
    for pose in order {
        if held.len() >= requested {
            break;
        }
        held.extend(poses.rows_of(&[pose]));
    }
    held
}

fn last(table: &Table, fraction: f64) -> Vec<usize> {
    let order = table.order();
    let kept = ((1.0 - fraction) * order.len() as f64).round() as usize;
    order.into_iter().skip(kept).collect()
}

fn last_session(table: &Table) -> Result<Vec<usize>, HoldoutError> {
    if table.session.names.len() < 2 {
        return Err(HoldoutError::NoSessions);
    }
    let last = (table.session.names.len() - 1) as u32;
    Ok((0..table.len())
        .filter(|row| table.session.of_row.get(*row).copied().flatten() == Some(last))
        .collect())
}

/// One region in eight, twice, from different ends of pose space. Touched positions are the regions where there are any;
/// poses that were returned to stay in the fit, for they carry the noise floor; very small tables, and those of few poses, hold out nothing. So do the few
/// that lie far from all others, such as those measured afterwards to distinguish candidates: nothing that is fitted could foretell them.
fn regions(poses: &Poses, table: &Table) -> Vec<usize> {
    if table.touch.names.len() >= 4 {
        let last = (table.touch.names.len() - 1) as u32;
        return (0..table.len())
            .filter(|row| table.touch.of_row.get(*row).copied().flatten() == Some(last))
            .collect();
    }
    // Of few poses that were measured often, as along an axis after ISO 230-2, none can be spared: what is at the ends of the travel is seen there alone.
    if poses.rows.len() < FEW_POSES && poses.rows.iter().all(|rows| rows.len() >= FEW_POSES_RETURNS) {
        return Vec::new();
    }
    let single: Vec<usize> = (0..poses.rows.len())
        .filter(|pose| poses.rows.get(*pose).is_some_and(|rows| rows.len() == 1))
        .collect();
    let chosen = if 2 * single.len() >= poses.rows.len() { single } else { (0..poses.rows.len()).collect() };
    if chosen.len() < 16 {
        return Vec::new();
    }
    let parts = poses.regions(&chosen, 8);
    let mut locked: Vec<usize> =
        [1, 6].iter().filter_map(|index| parts.get(*index)).flatten().copied().collect();
    let mut near = chosen.clone();
    poses.drop_lonely(&mut near);
    locked.retain(|pose| near.contains(pose));
    poses.rows_of(&locked)
}

#[cfg(test)]
mod tests;
