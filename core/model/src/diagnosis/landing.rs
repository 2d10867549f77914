//! Poses for the arm's own sensor: it tells nothing in mid-air, so every pose is brought onto the surface it is to trigger over, and only to places
//! like those where it did.

use nalgebra::Vector3;

use crate::file::{AddedEffect, SurfaceShape};
use crate::fit::{Machine, Observations, State};
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::table::Table;

/// Where the sensor triggered so far: a plane, and places on it.
#[derive(Debug, Clone)]
pub(super) struct Ground {
    /// The plane's name.
    pub(super) name: String,
    normal: Vector3<f64>,
    offset: f64,
    /// Where the model's first target was at the trigger poses, mm.
    places: Vec<Vector3<f64>>,
    /// How far from the nearest of them a new place may be, mm.
    apart: f64,
    /// Of joints whose drive keeps attitudes: the joint, the one before it, and the least and greatest angle between the two so far, rad. Their stops lie there,
    /// and no file tells them.
    bends: Vec<(usize, usize, f64, f64)>,
}

/// Rounds of moving a joint until the point is on the plane, and how near to it is near enough, mm.
const ROUNDS: usize = 12;
const ON_IT: f64 = 0.01;

/// A joint that moves the point by less than this is not the one to bring it onto the plane, mm/rad.
const LEAST_LEVER: f64 = 20.0;

/// How far a joint is turned to see what it does to the point's height, rad.
const PROBE: f64 = 1e-5;

impl Ground {
    /// Of a table in which the sensor triggered over a plane and nothing else was read; nothing of any other.
    pub(super) fn of(lab: &Laboratory, state: &State, effects: &[AddedEffect]) -> Option<Self> {
        let table = lab.table();
        let finite = |column: &Option<Vec<f64>>| column.iter().flatten().any(|value| value.is_finite());
        let reads_else = !table.positions.is_empty()
            || finite(&table.height)
            || finite(&table.distance)
            || table.tilt.is_some()
            || !table.touch.names.is_empty();
        if lab.model().sensor.is_none() || reads_else {
            return None;
        }
        let plane = |name: &String| {
            let surface = lab.model().surfaces.iter().find(|surface| surface.name == *name)?;
            match surface.shape {
                SurfaceShape::Plane { normal, offset } => Some((name.clone(), normal, offset)),
                _ => None,
            }
        };
        let (index, (name, normal, offset)) =
            table.on.names.iter().enumerate().find_map(|(index, name)| Some((index, plane(name)?)))?;
        let machine = Machine::new(lab.model(), table, lab.observations(), effects).ok()?;
        let over = |row: &usize| table.on.of_row.get(*row).copied().flatten() == Some(index as u32);
        let places: Vec<Vector3<f64>> =
            (0..table.len()).filter(over).map(|row| machine.believed_point(state, row)).collect();
        let extent = |axis: usize| {
            let along = || places.iter().map(|place| place[axis]);
            along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min)
        };
        let count = places.len().max(1) as f64;
        let apart = (extent(0).max(1.0) * extent(1).max(1.0) / count).sqrt();
        let bend = |(joint, row): (usize, &plumb_kinematics::Joint)| {
            let less = row.less?;
            let angles = (0..table.len()).filter_map(|row| bend_of(table.q_of(row), joint, less));
            let (low, high) =
                angles.fold((f64::MAX, f64::MIN), |(low, high), angle| (low.min(angle), high.max(angle)));
            Some((joint, less, low, high))
        };
        let bends = lab.model().chain.joints.iter().enumerate().filter_map(bend).collect();
        (places.len() > 1).then_some(Self { name, normal, offset, places, apart, bends })
    }

    /// Whether no joint bends further against the one before it than it did already.
    fn is_bent_so(&self, q: &[f64]) -> bool {
        self.bends.iter().all(|(joint, less, low, high)| {
            bend_of(q, *joint, *less).is_none_or(|angle| (*low..=*high).contains(&angle))
        })
    }

    /// How high a point is over the plane, mm.
    fn height(&self, point: &Vector3<f64>) -> f64 {
        self.normal.dot(point) - self.offset
    }

    fn is_known(&self, point: &Vector3<f64>) -> bool {
        self.places.iter().any(|place| (place - point).norm() <= self.apart)
    }
}

/// The angle of a joint against another.
fn bend_of(q: &[f64], joint: usize, less: usize) -> Option<f64> {
    Some(q.get(joint)? - q.get(less)?)
}

/// Turns one joint of each row of `table` until the point is on the plane; whether that was possible within `ranges`, at a place like those known.
///
/// # Errors
/// The table does not fit the model.
pub(super) fn land(
    lab: &Laboratory,
    ground: &Ground,
    (state, effects): (&State, &[AddedEffect]),
    table: &mut Table,
    ranges: &[(f64, f64)],
) -> Result<Vec<bool>, LaboratoryError> {
    let joints = table.joints;
    let points = |table: &Table| -> Result<Vec<Vector3<f64>>, LaboratoryError> {
        let observations = Observations::new(lab.model(), table)?;
        let machine = Machine::new(lab.model(), table, &observations, effects)?;
        Ok((0..table.len()).map(|row| machine.believed_point(state, row)).collect())
    };
    let turned = |table: &Table, joint: usize| {
        let mut other = table.clone();
        other.q.iter_mut().skip(joint).step_by(joints.max(1)).for_each(|q| *q += PROBE);
        other
    };
    let levers = |table: &Table, heights: &[f64], joint: usize| -> Result<Vec<f64>, LaboratoryError> {
        let moved = points(&turned(table, joint))?;
        Ok(moved.iter().zip(heights).map(|(point, height)| (ground.height(point) - height) / PROBE).collect())
    };
    let heights = |table: &Table| -> Result<Vec<f64>, LaboratoryError> {
        Ok(points(table)?.iter().map(|point| ground.height(point)).collect())
    };
    // The joint that moves each point up and down most.
    let mut best: Vec<(f64, usize)> = vec![(0.0, 0); table.len()];
    let at_first = heights(table)?;
    for joint in 0..joints {
        for (best, lever) in best.iter_mut().zip(levers(table, &at_first, joint)?) {
            if lever.abs() > best.0 {
                *best = (lever.abs(), joint);
            }
        }
    }
    for _ in 0..ROUNDS {
        let now = heights(table)?;
        let all = (0..joints).map(|joint| levers(table, &now, joint)).collect::<Result<Vec<_>, _>>()?;
        for (row, (height, (_, joint))) in now.iter().zip(&best).enumerate() {
            let lever = all.get(*joint).and_then(|levers| levers.get(row)).copied().unwrap_or(0.0);
            if let Some(q) = table.q.get_mut(row * joints + joint)
                && lever.abs() > LEAST_LEVER
            {
                *q -= (height / lever).clamp(-0.3, 0.3);
            }
        }
    }
    let ends = points(table)?;
    Ok(ends
        .iter()
        .enumerate()
        .map(|(row, end)| {
            let inside =
                table.q_of(row).iter().zip(ranges).all(|(q, (low, high))| (*low..=*high).contains(q));
            inside
                && ground.is_bent_so(table.q_of(row))
                && ground.height(end).abs() < ON_IT
                && ground.is_known(end)
        })
        .collect())
}
