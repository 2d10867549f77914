//! How the error falls as a batch's effects come in one after another, in mm: over the rows that were fitted, each counted
//! alike whatever its sigma or weight, and over regions each predicted without itself.

use nalgebra::DVector;

use super::pool::{Pick, Pool};
use crate::cross_validation::region_blocks;
use crate::fitted::Fitted;
use crate::growth::StepRms;
use crate::laboratory::points_in;
use plumb_calibration::effect::Effect;
use plumb_estimation::{NormalEquations, over_chunks};

/// Normal equations in mm (degrees in a table of tilts alone) of what is fitted and what was picked, by region.
pub(super) struct Fall {
    regions: Vec<NormalEquations>,
    total: NormalEquations,
    /// Measured points of all regions.
    points: f64,
}

impl Fall {
    /// One pass over the rows, for these picks in this order.
    pub(super) fn gather(fitted: &Fitted<'_>, pool: &Pool, picks: &[Pick]) -> Self {
        let (machine, fit) = (&fitted.machine, &fitted.fit);
        let probes: Vec<&dyn Effect> =
            picks.iter().filter_map(|pick| Some(pool.probes.get(pick.probe)?.effect.as_ref())).collect();
        let size = machine.slots().len() + probes.iter().map(|probe| probe.parameters().len()).sum::<usize>();
        let equations = &machine.observations.equations;
        let lengths = equations.iter().any(|equation| equation.measurand.is_length());
        let ones = vec![1.0; machine.table.len()];
        let gather = |rows: &Vec<usize>| {
            let mut total = NormalEquations::zeros(size);
            over_chunks(
                rows,
                || NormalEquations::zeros(size),
                |sum, chunk| {
                    let mut block = machine.block(&fit.state, chunk, &ones, &probes);
                    let own = chunk.iter().flat_map(|row| machine.observations.of_row(*row)).enumerate();
                    for (index, equation) in own {
                        let unit = match (lengths, equation.measurand.is_length()) {
                            (true, true) => equation.sigma,
                            (true, false) => 0.0,
                            (false, _) => equation.sigma.to_degrees(),
                        };
                        if let Some(residual) = block.residuals.get_mut(index) {
                            *residual *= unit;
                        }
                        block.jacobian.column_mut(index).scale_mut(unit);
                    }
                    sum.take(&block.residuals, &block.jacobian);
                },
                |sum| total.add(&sum),
            );
            total
        };
        let blocks = region_blocks(machine.table, &fit.rows);
        let regions: Vec<NormalEquations> = blocks.iter().map(gather).collect();
        let mut total = NormalEquations::zeros(size);
        regions.iter().for_each(|region| total.add(region));
        let measured = |row: &usize| {
            let mut own = machine.observations.of_row(*row).iter();
            own.any(|equation| !lengths || equation.measurand.is_length())
        };
        let rows: Vec<usize> = blocks.into_iter().flatten().filter(measured).collect();
        Self { regions, total, points: points_in(machine, &rows).max(1) as f64 }
    }

    /// With the first `count` picks in.
    pub(super) fn after(&self, pool: &Pool, picks: &[Pick], count: usize) -> StepRms {
        let columns = pool.columns(picks.get(..count).unwrap_or(picks));
        let root = |squares: f64| (squares.max(0.0) / self.points).sqrt();
        let without = pool.values_without_regions(&columns);
        let apart = self.regions.iter().zip(&without).map(|(region, values)| left(region, values)).sum();
        StepRms { fit: root(left(&self.total, &pool.values(&columns))), cv: Some(root(apart)) }
    }
}

/// Squares left when the first columns take these values.
fn left(normal: &NormalEquations, values: &DVector<f64>) -> f64 {
    let count = values.len();
    let matrix = normal.matrix.view((0, 0), (count, count));
    normal.squares - 2.0 * values.dot(&normal.gradient.rows(0, count)) + values.dot(&(matrix * values))
}
