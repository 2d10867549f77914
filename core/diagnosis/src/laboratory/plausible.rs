//! Before anything is fitted: can these numbers be those of this arm at all? Distances between measured points do not
//! depend on where base and instrument are, so they reveal wrong units whatever is free.

use nalgebra::{IsometryMatrix3, Point3, Vector3};
use plumb_kinematics::{LinkFrames, Motion};
use thiserror::Error;

use crate::thresholds::{UNITS_AGREE, UNITS_FOREIGN};
use plumb_calibration::arm_model::Model;
use plumb_calibration::arm_model::SurfaceShape;
use plumb_calibration::fit::{Sight, base_and_targets};
use plumb_calibration::table::Table;
use plumb_calibration::table::scalar::DISTANCE;

/// Numbers that cannot be meant.
#[derive(Debug, Error, PartialEq)]
pub enum ImplausibleError {
    /// A whole column, or all of a kind, in another unit than its header says.
    #[error(
        "{table}: {what} cannot be in the unit their headers say: {as_what} they would fit this arm; correct the unit in the header"
    )]
    Unit {
        /// The table.
        table: String,
        /// Which columns.
        what: String,
        /// As what they would fit.
        as_what: String,
    },
    /// One row in another unit than the others.
    #[error(
        "{table}: line {line}: {what} is in another unit than in the other rows: {as_what} it would fit; write the whole column in one unit"
    )]
    MixedRow {
        /// The table.
        table: String,
        /// Line of the file.
        line: u32,
        /// Which cells.
        what: &'static str,
        /// As what they would fit.
        as_what: &'static str,
    },
    /// Orientations written by another convention.
    #[error(
        "{table}: the orientations of {body} cannot be meant as written: {off}. Read {what}, they fit this arm to \
         {left_deg:.1} deg"
    )]
    Orientation {
        /// The table.
        table: String,
        /// Whose.
        body: String,
        /// What is left of them as they are, in words.
        off: String,
        /// How they would fit, and what to change.
        what: String,
        /// Root mean square angle that is left if they are read so.
        left_deg: f64,
    },
    /// An arm that cannot move its point.
    #[error(
        "the arm {arm} cannot move p1: in all {rows} rows the model puts it at the same place; check lengths (`a_mm`, `d_mm`), twists and the target's `xyz_mm`"
    )]
    Still {
        /// The arm.
        arm: String,
        /// Rows.
        rows: usize,
    },
    /// Points of profiles that no sensor sees so.
    #[error(
        "{table}: the points of the profiles cannot be in mm: {seen}; if they are in {as_what}, say so in the headers (`profile_x_m`; units are mm, m, in) or convert them"
    )]
    ProfileUnit {
        /// The table.
        table: String,
        /// What they are like.
        seen: String,
        /// As what they would make sense.
        as_what: &'static str,
    },
    /// Circles larger than the ball they are of.
    #[error(
        "{table}: the profiles on `{ball}` are arcs of {seen:.2} mm radius, and a ball of {radius} mm shows none larger than itself: check the unit of the profiles and its `radius_mm` (the radius, not the diameter)"
    )]
    ProfileOnBall {
        /// The table.
        table: String,
        /// The ball.
        ball: String,
        /// mm.
        seen: f64,
        /// mm.
        radius: f64,
    },
    /// Two distances from one pose that no point can have.
    #[error(
        "{table}: lines {first} and {second}: from one pose p1 cannot be {one:.3} mm from `{from}` and {other:.3} mm from `{to}`, which are {apart:.3} mm apart; measure one of them again"
    )]
    Distances {
        /// The table.
        table: String,
        /// Line of the file.
        first: u32,
        /// Line of the file.
        second: u32,
        /// mm.
        one: f64,
        /// A named point.
        from: String,
        /// mm.
        other: f64,
        /// A named point.
        to: String,
        /// mm.
        apart: f64,
    },
}

/// Rows looked at, spread over the table.
const LOOKED_AT: usize = 48;

/// Distances shorter than this part of the longest are not compared: an unknown tool turns them as much as a wrong unit would scale them.
const SHORT: f64 = 0.15;

/// Rows fewer than these say nothing of units.
const FEWEST: usize = 6;

/// Slips with units, as factors on lengths.
const LENGTH_SLIPS: [(f64, &str); 6] = [
    (1000.0, "1000 times as long (m for mm?)"),
    (0.001, "a thousandth as long (mm for m?)"),
    (25.4, "25.4 times as long (in for mm?)"),
    (1.0 / 25.4, "a 25.4th as long (mm for in?)"),
    (39.370_078_740_157_48, "39.37 times as long (m for in?)"),
    (0.0254, "0.0254 times as long (in for m?)"),
];

/// Slips with units, as factors on angles.
const ANGLE_SLIPS: [(f64, &str); 2] =
    [(180.0 / std::f64::consts::PI, "read as radians"), (std::f64::consts::PI / 180.0, "read as degrees")];

/// A row as it was read: what was commanded, and where p1 was measured.
struct Sample {
    line: u32,
    q: Vec<f64>,
    measured: Vector3<f64>,
}

/// Where the nominal arm puts a target, base frame, mm.
fn tip(model: &Model, q: &[f64], target: usize) -> Vector3<f64> {
    let tool = model.targets.get(target).map_or_else(Vector3::zeros, |target| target.xyz);
    (LinkFrames::of(&model.chain, q, &[]).flange * Point3::from(tool)).coords
}

/// Logarithms of measured over believed distance, for all pairs far enough apart to count.
fn ratios(measured: &[Vector3<f64>], believed: &[Vector3<f64>]) -> Vec<Vec<Option<f64>>> {
    let points: Vec<(&Vector3<f64>, &Vector3<f64>)> = measured.iter().zip(believed).collect();
    let distances = believed.iter().flat_map(|one| believed.iter().map(move |other| (one - other).norm()));
    let least = SHORT * distances.fold(0.0, f64::max);
    let of_point = points.iter().map(|(seen, expected)| {
        let to_others = points.iter().map(|(other_seen, other_expected)| {
            let (measured, believed) = ((*seen - *other_seen).norm(), (*expected - *other_expected).norm());
            (believed > least && believed > 0.0).then(|| (measured.max(1e-12) / believed).ln())
        });
        to_others.collect()
    });
    of_point.collect()
}

/// Where the arm puts the points if the target, which is free, sits where these measurements have it; nothing if they do not
/// agree with the arm so either.
fn with_target_found(
    model: &Model,
    target: usize,
    samples: &[Sample],
    off: f64,
) -> Option<Vec<Vector3<f64>>> {
    let own = model.targets.get(target).filter(|target| target.free)?;
    let sights: Vec<Sight> = samples
        .iter()
        .map(|sample| Sight {
            target: 0,
            measured: sample.measured,
            flange: LinkFrames::of(&model.chain, &sample.q, &[]).flange,
        })
        .collect();
    let (_, found) = base_and_targets(&sights, &IsometryMatrix3::identity(), &[own.xyz], &[true])?;
    let point = Point3::from(*found.first()?);
    let believed: Vec<Vector3<f64>> = sights.iter().map(|sight| (sight.flange * point).coords).collect();
    let measured: Vec<Vector3<f64>> = samples.iter().map(|sample| sample.measured).collect();
    (median_size(&ratios(&measured, &believed)) < UNITS_AGREE.min(off / 4.0)).then_some(believed)
}

fn median_size(ratios: &[Vec<Option<f64>>]) -> f64 {
    let sizes: Vec<f64> = ratios.iter().flatten().flatten().map(|ratio| ratio.abs()).collect();
    if sizes.is_empty() { 0.0 } else { plumb_estimation::median(&sizes) }
}

/// Refuses what cannot be meant; returns what only looks odd, in words.
pub(super) fn check(model: &Model, table: &Table) -> Result<Vec<String>, ImplausibleError> {
    distances(model, table)?;
    let mut odd = Vec::new();
    odd.extend(beyond_limits(model, table));
    odd.extend(plumb_calibration::placeholders::placeholders(&model.masses));
    odd.extend(units(model, table)?);
    Ok(odd)
}

fn beyond_limits(model: &Model, table: &Table) -> Option<String> {
    let mut first: Option<(u32, usize, f64)> = None;
    let mut count = 0;
    for row in 0..table.len() {
        for (index, (q, joint)) in table.q_of(row).iter().zip(&model.chain.joints).enumerate() {
            let slack = 1e-3 * (joint.limits.1 - joint.limits.0);
            if *q < joint.limits.0 - slack || *q > joint.limits.1 + slack {
                count += 1;
                first.get_or_insert((table.lines.get(row).copied().unwrap_or(0), index, *q));
            }
        }
    }
    let (line, index, q) = first?;
    let joint = model.chain.joints.get(index)?;
    let (shown, unit) = if joint.motion == Motion::Slides { (q, "mm") } else { (q.to_degrees(), "deg") };
    Some(format!(
        "{count} commanded coordinates lie beyond the model's limits, the first in line {line}: {} at {shown:.2} {unit}; check units and `limits`",
        joint.name
    ))
}

/// Rows in which the whole position of a target was read, some of them spread over the table.
fn samples(model: &Model, table: &Table, positions: &[[f64; 3]]) -> Vec<Sample> {
    // Distances between points of two sessions say nothing where each session has a base of its own.
    let sessions = &table.session.of_row;
    let whole: Vec<usize> = (0..table.len())
        .filter(|row| !model.base.per_session || sessions.get(*row) == sessions.first())
        .filter(|row| positions.get(*row).is_some_and(|xyz| xyz.iter().all(|part| part.is_finite())))
        .collect();
    // All pairs of rows are compared: their number grows with the square.
    let step = whole.len().div_ceil(LOOKED_AT).max(1);
    let chosen = whole.into_iter().step_by(step).filter_map(|row| {
        Some(Sample {
            line: table.lines.get(row).copied().unwrap_or(0),
            q: table.q_of(row).to_vec(),
            measured: Vector3::from(*positions.get(row)?),
        })
    });
    chosen.collect()
}

/// Whether the model puts a target at one and the same place although the joints differ.
fn is_still(samples: &[Sample], believed: &[Vector3<f64>]) -> bool {
    let distinct = samples.iter().any(|sample| samples.first().is_some_and(|first| first.q != sample.q));
    distinct
        && believed.iter().all(|point| believed.first().is_some_and(|first| (point - first).norm() < 1e-6))
}

/// A slip with units: the median disagreement that would be left if it were made good, which columns, and as what they would fit.
type Slip = (f64, String, &'static str);

/// Every length read in another unit: all coordinates, or those of one axis.
fn length_slips(target: &str, measured: &[Vector3<f64>], believed: &[Vector3<f64>]) -> Vec<Slip> {
    let mut slips = Vec::new();
    for (factor, as_what) in LENGTH_SLIPS {
        for axis in [None, Some(0), Some(1), Some(2)] {
            let scales =
                Vector3::from_fn(|part, _| if axis.is_none_or(|axis| axis == part) { factor } else { 1.0 });
            let scaled: Vec<Vector3<f64>> =
                measured.iter().map(|point| point.component_mul(&scales)).collect();
            let what = axis.and_then(|axis| ["x", "y", "z"].get(axis)).map_or_else(
                || format!("the positions of {target}"),
                |axis| format!("the {axis} coordinates of {target}"),
            );
            slips.push((median_size(&ratios(&scaled, believed)), what, as_what));
        }
    }
    slips
}

/// Joint coordinates with the angle of one joint, or of all, read in another unit.
fn with_angles_times(model: &Model, q: &[f64], factor: f64, only: Option<usize>) -> Vec<f64> {
    let angles = q.iter().enumerate().map(|(joint, q)| {
        let turns = model.chain.joints.get(joint).is_some_and(|row| row.motion == Motion::Turns);
        if turns && only.is_none_or(|only| only == joint) { q * factor } else { *q }
    });
    angles.collect()
}

/// Every angle read in another unit: all joints, or one.
fn angle_slips(model: &Model, target: usize, samples: &[Sample], measured: &[Vector3<f64>]) -> Vec<Slip> {
    let joints = model.chain.len();
    let mut slips = Vec::new();
    for (factor, as_what) in ANGLE_SLIPS {
        for only in std::iter::once(None).chain((0..joints).map(Some)) {
            let rotated = samples.iter().map(|sample| with_angles_times(model, &sample.q, factor, only));
            let believed: Vec<Vector3<f64>> = rotated.map(|q| tip(model, &q, target)).collect();
            let what =
                only.map_or_else(|| "the joints".to_owned(), |joint| format!("the values of q{}", joint + 1));
            slips.push((median_size(&ratios(measured, &believed)), what, as_what));
        }
    }
    slips
}

fn units(model: &Model, table: &Table) -> Result<Option<String>, ImplausibleError> {
    let Some(columns) = table.positions.first() else { return Ok(None) };
    let Some(target) = model.target_position(&columns.target) else { return Ok(None) };
    let samples = samples(model, table, &columns.xyz);
    if samples.len() < FEWEST {
        return Ok(None);
    }
    let measured: Vec<Vector3<f64>> = samples.iter().map(|sample| sample.measured).collect();
    let mut believed: Vec<Vector3<f64>> =
        samples.iter().map(|sample| tip(model, &sample.q, target)).collect();
    if is_still(&samples, &believed) {
        return Err(ImplausibleError::Still { arm: model.arm.clone(), rows: table.len() });
    }
    let mut plain = ratios(&measured, &believed);
    let mut off = median_size(&plain);
    if let Some(found) = with_target_found(model, target, &samples, off) {
        believed = found;
        plain = ratios(&measured, &believed);
        off = median_size(&plain);
    }
    // The table as a whole belongs to this arm; single rows may not.
    if off < UNITS_FOREIGN / 2.0 {
        mixed_rows(model, table, target, &samples, &believed, &plain)?;
        return Ok(None);
    }
    let mut slips = length_slips(&columns.target, &measured, &believed);
    slips.extend(angle_slips(model, target, &samples, &measured));
    match slips.into_iter().min_by(|left, right| left.0.total_cmp(&right.0)) {
        // A slip must explain the disagreement, not merely lessen it: down to what nominal arms show, and to a quarter.
        Some((left, what, as_what)) if left < UNITS_AGREE.min(off / 4.0) => {
            Err(ImplausibleError::Unit { table: table.source.clone(), what, as_what: as_what.to_owned() })
        }
        _ => {
            mixed_rows(model, table, target, &samples, &believed, &plain)?;
            Ok(foreign(model, &samples, &measured, target, off))
        }
    }
}

/// What to say of a table that no unit brings together with the arm: a joint that counts the other way is reported.
fn foreign(
    model: &Model,
    samples: &[Sample],
    measured: &[Vector3<f64>],
    target: usize,
    off: f64,
) -> Option<String> {
    // In a mirror all joints count the other way: several joints can answer for one slip.
    let backwards: Vec<&str> = (0..model.chain.len())
        .filter(|index| {
            let mut turned = model.clone();
            if let Some(joint) = turned.chain.joints.get_mut(*index) {
                joint.sign = -joint.sign;
            }
            let believed: Vec<Vector3<f64>> =
                samples.iter().map(|sample| tip(&turned, &sample.q, target)).collect();
            median_size(&ratios(measured, &believed)) < UNITS_AGREE.min(off / 4.0)
        })
        .filter_map(|index| Some(model.chain.joints.get(index)?.name.as_str()))
        .collect();
    if !backwards.is_empty() {
        return Some(format!(
            "the measurements would fit the arm if {} counted the other way: check the `sign`",
            backwards.join(" or ")
        ));
    }
    (off > UNITS_FOREIGN).then(|| {
        "distances between measured points have little to do with those the model expects: check the order and the signs of the joints, the convention, and the units"
            .to_owned()
    })
}

/// A row that agrees with the others only in another unit.
fn mixed_rows(
    model: &Model,
    table: &Table,
    target: usize,
    samples: &[Sample],
    believed: &[Vector3<f64>],
    plain: &[Vec<Option<f64>>],
) -> Result<(), ImplausibleError> {
    let agreeing =
        plain.iter().map(|row| row.iter().flatten().filter(|ratio| ratio.abs() < UNITS_AGREE).count());
    let agreeing: Vec<usize> = agreeing.collect();
    let most = agreeing.iter().copied().max().unwrap_or(0);
    // With fewer nobody knows which of the rows is the odd one.
    if most < 4 {
        return Ok(());
    }
    let rows = samples.iter().zip(believed).zip(agreeing);
    let (sound, odd): (Vec<_>, Vec<_>) = rows.partition(|(_, agreeing)| 4 * agreeing >= 3 * most);
    let sound: Vec<(&Sample, &Vector3<f64>)> = sound.into_iter().map(|(row, _)| row).collect();
    for ((sample, belief), _) in odd {
        let as_is = agreeing_fraction(&sound, &sample.measured, belief);
        let lengths = LENGTH_SLIPS.iter().map(|(factor, as_what)| {
            (agreeing_fraction(&sound, &(sample.measured * *factor), belief), "the position", *as_what)
        });
        let angles = ANGLE_SLIPS.iter().map(|(factor, as_what)| {
            let q: Vec<f64> = sample.q.iter().map(|q| q * factor).collect();
            (agreeing_fraction(&sound, &sample.measured, &tip(model, &q, target)), "the pose", *as_what)
        });
        // Enough of the sound rows must agree with a row read in another unit, and hardly any with it as it is.
        let slip = lengths.chain(angles).find(|(fraction, ..)| *fraction > 0.8 && *fraction > as_is + 0.3);
        if let Some((_, what, as_what)) = slip {
            let (table, line) = (table.source.clone(), sample.line);
            return Err(ImplausibleError::MixedRow { table, line, what, as_what });
        }
    }
    Ok(())
}

/// With which share of the sound rows a point agrees by its distance from theirs, if the arm puts it where is believed.
fn agreeing_fraction(
    sound: &[(&Sample, &Vector3<f64>)],
    measured: &Vector3<f64>,
    believed: &Vector3<f64>,
) -> f64 {
    let agreeing = sound.iter().filter(|(sample, other)| {
        let (is, should) = ((measured - sample.measured).norm(), (believed - *other).norm());
        should > 0.0 && (is.max(1e-12) / should).ln().abs() < UNITS_AGREE
    });
    agreeing.count() as f64 / sound.len() as f64
}

/// The point that a row's distance was measured from, where the model knows it for certain: its name, where it is, and the distance, mm.
fn distance_to_known<'t>(
    model: &Model,
    table: &'t Table,
    distances: &[f64],
    row: usize,
) -> Option<(&'t str, Vector3<f64>, f64)> {
    let name = table.distance_to.name(row)?;
    let surface = model.surfaces.get(model.surface_position(name)?).filter(|surface| !surface.free)?;
    let SurfaceShape::Point { point } = surface.shape else { return None };
    let distance = distances.get(row).copied().filter(|distance| distance.is_finite())?;
    Some((name, point, distance))
}

/// Distances from one pose to two known points must be able to meet.
fn distances(model: &Model, table: &Table) -> Result<(), ImplausibleError> {
    let Some(column) = table.scalar(&DISTANCE) else { return Ok(()) };
    // A millimetre for points that are known as well as a ruler shows, and ten sigmas of the instrument.
    let slack = 1.0 + 10.0 * model.noise.of(&DISTANCE).unwrap_or(0.0);
    let mut by_pose: std::collections::HashMap<Vec<u64>, Vec<usize>> = std::collections::HashMap::new();
    for row in 0..table.len() {
        by_pose.entry(table.q_of(row).iter().map(|q| q.to_bits()).collect()).or_default().push(row);
    }
    let mut poses: Vec<Vec<usize>> = by_pose.into_values().collect();
    poses.sort_unstable();
    for rows in poses {
        for (index, first) in rows.iter().enumerate() {
            for second in rows.iter().skip(index + 1) {
                let known = [*first, *second].map(|row| distance_to_known(model, table, column, row));
                let [Some((from, start, one)), Some((to, end, other))] = known else { continue };
                let apart = (start - end).norm();
                // The triangle inequality, twice: neither too short to meet nor so different that the farther point is beyond reach.
                if apart > one + other + slack || (from != to && (one - other).abs() > apart + slack) {
                    let [first, second] =
                        [first, second].map(|row| table.lines.get(*row).copied().unwrap_or(0));
                    return Err(ImplausibleError::Distances {
                        table: table.source.clone(),
                        first,
                        second,
                        one,
                        from: from.to_owned(),
                        other,
                        to: to.to_owned(),
                        apart,
                    });
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
