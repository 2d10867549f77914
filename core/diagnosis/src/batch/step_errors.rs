//! How the error falls as a batch's effects come in one after another, in mm: over the rows that were fitted, each counted
//! alike whatever its sigma or weight, and over regions each predicted without itself.

use nalgebra::DVector;

use super::pool::{Pick, Pool};
use crate::cross_validation::region_blocks;
use crate::fitted::Fitted;
use crate::growth::StepRms;
use crate::laboratory::points_in;
use plumb_calibration::effect::Effect;
use plumb_calibration::fit::RowBlock;
use plumb_calibration::measurement::Observations;
use plumb_estimation::{NormalEquations, over_chunks};

/// Normal equations in mm (degrees in a table of angles alone) of what is fitted and what was picked, by region.
pub(super) struct StepErrors {
    regions: Vec<NormalEquations>,
    total: NormalEquations,
    /// What is known beforehand of what was fitted and of all picks.
    precisions: Vec<f64>,
    /// Measured points of all regions.
    points: f64,
}

impl StepErrors {
    /// One pass over the rows, for these picks in this order.
    pub(super) fn gather(fitted: &Fitted<'_>, pool: &Pool, picks: &[Pick], precisions: &[f64]) -> Self {
        let (problem, fit) = (&fitted.problem, &fitted.fit);
        let probes: Vec<&dyn Effect> =
            picks.iter().filter_map(|pick| Some(pool.probes.get(pick.probe)?.effect.as_ref())).collect();
        let size = problem.free_parameters().len()
            + probes.iter().map(|probe| probe.parameters().len()).sum::<usize>();
        let unit = problem.observations.unit();
        // Every row counts alike: the fit's robust weights would hide what the error of a measured point is.
        let ones = vec![1.0; problem.table.len()];
        let blocks = region_blocks(problem.table, &fit.rows);
        let regions = blocks.iter().map(|rows| {
            let mut region = NormalEquations::zeros(size);
            over_chunks(
                rows,
                || NormalEquations::zeros(size),
                |sum, chunk| {
                    let mut block = problem.block(&fit.state, chunk, &ones, &probes);
                    in_units_shown(&mut block, problem.observations, chunk);
                    sum.take(&block.residuals, &block.jacobian);
                },
                |sum| region.add(&sum),
            );
            region
        });
        let regions: Vec<NormalEquations> = regions.collect();
        let mut total = NormalEquations::zeros(size);
        regions.iter().for_each(|region| total.add(region));
        // Where lengths are measured a row of angles alone adds no point to the mean.
        let mut rows = blocks.concat();
        rows.retain(|row| {
            let mut own = problem.observations.of_row(*row).iter();
            own.any(|equation| equation.factor_in(unit).is_some())
        });
        Self {
            regions,
            total,
            precisions: precisions.to_vec(),
            points: points_in(problem, &rows).max(1) as f64,
        }
    }

    /// With the first `count` picks in.
    pub(super) fn after(&self, pool: &Pool, picks: &[Pick], count: usize) -> StepRms {
        let columns = pool.columns(picks.get(..count).unwrap_or(picks));
        let precisions = self.precisions.get(..columns.len()).unwrap_or(&self.precisions);
        let without = pool.values_without_regions(&columns, precisions);
        let apart = self.regions.iter().zip(&without).map(|(region, values)| left(region, values)).sum();
        let together = left(&self.total, &pool.values(&columns, precisions));
        StepRms { fit: self.mean_root(together), cv: Some(self.mean_root(apart)) }
    }

    /// Root of the mean over the measured points, mm or degrees, of a sum of their squares. Rounding can take a sum of squares below zero.
    fn mean_root(&self, squares: f64) -> f64 {
        (squares.max(0.0) / self.points).sqrt()
    }
}

/// Brings the equations of these rows from declared sigmas to the unit of the table's readings; angles then count nothing beside lengths.
fn in_units_shown(block: &mut RowBlock, observations: &Observations, rows: &[usize]) {
    for (index, equation) in rows.iter().flat_map(|row| observations.of_row(*row)).enumerate() {
        let unit = equation.factor_in(observations.unit()).map_or(0.0, |factor| equation.sigma * factor);
        if let Some(residual) = block.residuals.get_mut(index) {
            *residual *= unit;
        }
        block.jacobian.column_mut(index).scale_mut(unit);
    }
}

/// Squares left when the first columns take these values.
fn left(normal: &NormalEquations, values: &DVector<f64>) -> f64 {
    let count = values.len();
    // |r - J v|^2 = r.r - 2 v.J r + v.J J^T v: the first columns of the normal equations are enough, no row is looked at again.
    let matrix = normal.matrix.view((0, 0), (count, count));
    normal.squares - 2.0 * values.dot(&normal.gradient.rows(0, count)) + values.dot(&(matrix * values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laboratory::{Laboratory, Options};
    use crate::split::Holdout;
    use plumb_calibration::arm_model::Model;
    use plumb_calibration::table::Table;

    fn laboratory(model: &str, table: &str) -> Laboratory {
        let model = Model::parse("model.yaml", &format!("{}{model}", crate::testing::TWO_LINKS)).unwrap();
        let table = Table::parse("table.csv", table).unwrap();
        Laboratory::new(model, table, Options { holdout: Holdout::None, ..Options::default() }).unwrap()
    }

    /// Rows of positions and orientations of which each is off.
    fn of_poses() -> Laboratory {
        let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm,p1_rx_deg,p1_ry_deg,p1_rz_deg\n".to_owned();
        for row in 0..8 {
            let (q, off) = ([10.0 * f64::from(row), 30.0], 0.2 + 0.1 * f64::from(row));
            let (first, both) = (q[0].to_radians(), (q[0] + q[1]).to_radians());
            let (x, y) = (200.0 * first.cos() + 150.0 * both.cos(), 200.0 * first.sin() + 150.0 * both.sin());
            text.push_str(&format!("{},{},{},{y},{off},0,0,{}\n", q[0], q[1], x - off, q[0] + q[1] + off));
        }
        laboratory("free: []\nnoise: {p1_mm: 0.5, p1_deg: 0.25}\n", &text)
    }

    /// Rows of directions of which each is off.
    fn of_directions() -> Laboratory {
        let mut text = "q1_deg,q2_deg,p1_azimuth_deg\n".to_owned();
        for row in 0..8 {
            let (q, off) = ([10.0 * f64::from(row), 30.0], 0.2 + 0.1 * f64::from(row));
            let (first, both) = (q[0].to_radians(), (q[0] + q[1]).to_radians());
            let (x, y) = (200.0 * first.cos() + 150.0 * both.cos(), 200.0 * first.sin() + 150.0 * both.sin());
            text.push_str(&format!("{},{},{}\n", q[0], q[1], y.atan2(x).to_degrees() + off));
        }
        laboratory("free: []\nnoise: {azimuth_deg: 0.25}\n", &text)
    }

    /// Brings two rows to the unit shown, and holds each equation to its residual and factor there, by whether it is a length; how many there were.
    fn shown(lab: &Laboratory, expected: impl Fn(bool, f64, f64) -> (f64, f64)) -> usize {
        let problem = lab.problem(&[]).unwrap();
        let (state, rows) = (problem.start(), [1, 4]);
        let gain =
            plumb_calibration::effect::EffectId::at("joint_gain", plumb_calibration::effect::Site::Joint(0));
        let gain = plumb_calibration::effect::build(&gain, lab.model()).unwrap();
        let block = || problem.block(&state, &rows, &[1.0; 8], &[gain.as_ref()]);
        let (plain, residuals, mut shown) = (block(), problem.residuals(&state), block());
        in_units_shown(&mut shown, problem.observations, &rows);
        let equations = rows.iter().flat_map(|row| {
            let own = &residuals[problem.observations.range(*row)];
            problem.observations.of_row(*row).iter().zip(own)
        });
        let mut count = 0;
        for (index, (equation, residual)) in equations.enumerate() {
            let (expected, unit) = expected(equation.measurand.is_length(), *residual, equation.sigma);
            // A block holds what is measured less what is predicted, or the other way round.
            assert!((shown.residuals[index].abs() - expected.abs()).abs() < 1e-9);
            let columns = shown.jacobian.column(index) - plain.jacobian.column(index) * unit;
            assert!(columns.amax() < 1e-9);
            count += 1;
        }
        assert!(shown.residuals.iter().any(|one| one.abs() > 0.1));
        count
    }

    #[test]
    fn equations_are_brought_to_mm_and_to_degrees_where_angles_alone_are_measured() {
        let of_lengths = |is_length, residual, sigma| if is_length { (residual, sigma) } else { (0.0, 0.0) };
        assert_eq!(shown(&of_poses(), of_lengths), 12);
        let of_angles = |_, residual: f64, sigma: f64| (residual.to_degrees(), sigma.to_degrees());
        assert_eq!(shown(&of_directions(), of_angles), 2);
    }

    #[test]
    fn the_root_of_the_mean_is_over_points_and_rounding_below_zero_is_nothing() {
        let (regions, precisions) = (Vec::new(), Vec::new());
        let step_errors = StepErrors { regions, total: NormalEquations::zeros(0), precisions, points: 4.0 };
        assert_eq!(
            (step_errors.mean_root(36.0), step_errors.mean_root(2.25), step_errors.mean_root(-1e-9)),
            (3.0, 0.75, 0.0)
        );
    }
}
