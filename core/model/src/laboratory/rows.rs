//! What is left unexplained in every row, and against what it may be drawn.

use nalgebra::Vector3;
use serde::Serialize;

use crate::fit::{Fit, Machine, Reading};

/// What is left in one row.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RowResidual {
    /// Row of the table, from 0.
    pub row: usize,
    /// Line of the file.
    pub line: u32,
    /// Whether the row was locked away.
    pub held_out: bool,
    /// Weight in the fit, 1 for a row inside the others' scatter.
    pub weight: f64,
    /// Measured less predicted, mm, frame of the measurements; one a target or touched place, the mean of them where a
    /// row has several. Zero along axes that were not measured.
    pub vector_mm: [f64; 3],
    /// Root of the sum of squares of the row's lengths, mm (degrees for a row of tilts alone).
    pub size_mm: f64,
    /// Where the point is believed to be, mm, frame of the measurements.
    pub point_mm: [f64; 3],
}

/// Residuals against one quantity: what the small plots show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// What it is against: a joint's name, `moment of shoulder`, `order`, `temperature`, ...
    pub against: String,
    /// Unit of the horizontal axis.
    pub unit: String,
    /// What is drawn upwards.
    pub shows: String,
    /// Horizontal value, residual in mm, and the row.
    pub points: Vec<(f64, f64, usize)>,
}

/// Sum of squares of a row's lengths (mm2), or of its angles (deg2) if it has no lengths, and whether it has any.
pub(crate) fn row_square(machine: &Machine<'_>, residuals: &[f64], row: usize) -> Option<f64> {
    let own = residuals.get(machine.observations.range(row))?;
    let equations = machine.observations.of_row(row);
    let sum = |lengths: bool| {
        let chosen =
            own.iter().zip(equations).filter(|(_, equation)| equation.reading.is_length() == lengths);
        let (sum, count) =
            chosen.fold((0.0, 0), |(sum, count), (residual, _)| (sum + residual * residual, count + 1));
        (count > 0).then_some(sum)
    };
    let degrees = 1.0_f64.to_degrees();
    sum(true).or_else(|| sum(false).map(|square| square * degrees * degrees))
}

pub(super) fn row_residuals(machine: &Machine<'_>, fit: &Fit, held_out: &[bool]) -> Vec<RowResidual> {
    (0..machine.table.len())
        .map(|row| {
            let own = fit.residuals.get(machine.observations.range(row)).unwrap_or(&[]);
            let equations = machine.observations.of_row(row);
            let (mut vector, mut counts) = (Vector3::zeros(), Vector3::repeat(0.0_f64));
            for (equation, residual) in equations.iter().zip(own) {
                if let Reading::Position(_, axis) | Reading::Touch(_, axis) = equation.reading {
                    let axis = usize::from(axis.min(2));
                    vector[axis] += residual;
                    counts[axis] += 1.0;
                }
            }
            let mean = vector.component_div(&counts.map(|count: f64| count.max(1.0)));
            RowResidual {
                row,
                line: machine.table.lines.get(row).copied().unwrap_or(0),
                held_out: held_out.get(row).copied().unwrap_or(false),
                weight: fit.weights.get(row).copied().unwrap_or(1.0),
                vector_mm: mean.into(),
                size_mm: row_square(machine, &fit.residuals, row).unwrap_or(0.0).sqrt(),
                point_mm: machine.believed_point(&fit.state, row).into(),
            }
        })
        .collect()
}

/// The points along the arm in the row whose target stands nearest the middle of all targets.
pub(super) fn arm_in_the_middle(machine: &Machine<'_>, fit: &Fit, rows: &[RowResidual]) -> Vec<[f64; 3]> {
    let points = || rows.iter().map(|row| Vector3::from(row.point_mm));
    let middle = points().sum::<Vector3<f64>>() / (rows.len().max(1) as f64);
    let nearest = points()
        .map(|point| (point - middle).norm())
        .enumerate()
        .min_by(|one, other| one.1.total_cmp(&other.1));
    let Some((row, _)) = nearest else { return Vec::new() };
    machine.points_along(&fit.state, row).into_iter().map(Into::into).collect()
}

/// Residuals drawn against every joint, every moment of gravity that varies, approach, order and temperature.
pub(super) fn series(machine: &Machine<'_>, fit: &Fit, rows: &[RowResidual]) -> Vec<Series> {
    let mut all = Vec::new();
    let names: Vec<&str> = machine.model.chain.joints.iter().map(|joint| joint.name.as_str()).collect();
    let details: Vec<_> = (0..machine.table.len()).map(|row| machine.row_details(&fit.state, row)).collect();
    for (joint, name) in names.iter().enumerate() {
        let along = |row: usize| -> f64 {
            let vector = rows.get(row).map_or_else(Vector3::zeros, |row| Vector3::from(row.vector_mm));
            let direction = details
                .get(row)
                .and_then(|detail| detail.by_joint.get(joint))
                .copied()
                .unwrap_or_else(Vector3::zeros);
            direction.try_normalize(1e-9).map_or(0.0, |direction| vector.dot(&direction))
        };
        let shows = format!("residual along the motion of {name}, mm");
        let mut add = |against: String, unit: &str, value: &dyn Fn(usize) -> f64| {
            let points: Vec<(f64, f64, usize)> =
                (0..machine.table.len()).map(|row| (value(row), along(row), row)).collect();
            let varies = points
                .iter()
                .any(|(x, _, _)| points.first().is_some_and(|(first, _, _)| (x - first).abs() > 1e-9));
            if varies {
                all.push(Series { against, unit: unit.to_owned(), shows: shows.clone(), points });
            }
        };
        let coordinate = |row: usize| machine.table.q_of(row).get(joint).copied().unwrap_or(0.0).to_degrees();
        add((*name).to_owned(), "deg", &coordinate);
        let moment = |row: usize| {
            details.get(row).and_then(|detail| detail.moments.get(joint)).copied().unwrap_or(0.0)
        };
        if !machine.model.masses.is_empty() {
            add(format!("moment of {name}"), "N m", &moment);
        }
        let side = |row: usize| f64::from(machine.table.approach_of(row, joint));
        add(format!("approach of {name}"), "side", &side);
    }
    let size = |row: usize| rows.get(row).map_or(0.0, |row| row.size_mm);
    let mut order = vec![0.0; machine.table.len()];
    for (place, row) in machine.table.order().into_iter().enumerate() {
        if let Some(slot) = order.get_mut(row) {
            *slot = place as f64;
        }
    }
    let mut plain = |against: &str, unit: &str, values: &[f64]| {
        let points: Vec<(f64, f64, usize)> =
            values.iter().enumerate().map(|(row, x)| (*x, size(row), row)).collect();
        if points.iter().any(|(x, _, _)| points.first().is_some_and(|(first, _, _)| (x - first).abs() > 1e-9))
        {
            let shows = "size of the residual, mm".to_owned();
            all.push(Series { against: against.to_owned(), unit: unit.to_owned(), shows, points });
        }
    };
    plain("order", "row", &order);
    for (name, unit, column) in [
        ("time", "s", &machine.table.time),
        ("temperature", "deg C", &machine.table.temperature),
        ("payload", "kg", &machine.table.payload),
    ] {
        if let Some(values) = column {
            plain(name, unit, values);
        }
    }
    for covariate in &machine.table.covariates {
        plain(&covariate.name, "", &covariate.values);
    }
    all
}
