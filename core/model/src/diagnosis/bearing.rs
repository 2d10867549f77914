//! Where an error sits, told by its direction alone. Whatever turns about one joint moves the point along that joint's
//! motion, however its amount varies from pose to pose: what lies across that motion must be noise. So a place is tried
//! by taking the component along its motion out of every row, refitting what is free to the rest, and holding what is
//! left against the floor. Nothing about the mechanism is assumed.

use nalgebra::{DMatrix, DVector, Vector3};

use super::misfit::{MISFIT_LEVEL, chance};
use super::trial::Fitted;
use crate::effect::{Drive, Effect, Handle, LooksAt, Parameter, Situation, Spot, Unit};
use crate::fit::Factor;
use crate::floor::Floor;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::statistics::{chi_squared_quantile, f_tail, median};

/// What is left when everything along one place's motion is taken out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bearing {
    /// The place.
    pub(crate) spot: Spot,
    /// Sum of squares across the motion (declared sigmas squared) and its degrees of freedom.
    pub(crate) across: (f64, f64),
    /// The same over all directions, on the same rows.
    pub(crate) whole: (f64, f64),
    /// Probability of so much across if the rest is noise.
    pub(crate) p: f64,
}

impl Bearing {
    /// Whether everything that is not noise may sit here.
    pub(crate) fn passes(&self) -> bool {
        self.p >= MISFIT_LEVEL
    }

    /// Probability of what is left along the motion if it is no more than what is left across: the lack of fit where a
    /// mechanism at this place must show it.
    pub(crate) fn along(&self) -> f64 {
        let (squares, freedom) = (self.whole.0 - self.across.0, self.whole.1 - self.across.1);
        if freedom < 1.0 || self.across.1 < LEAST_FREEDOM || self.across.0 <= 0.0 {
            return 1.0;
        }
        f_tail(squares.max(0.0) / freedom / (self.across.0 / self.across.1), freedom, self.across.1)
    }
}

/// Rows looked at, at most: more tell no more about a direction.
const ENOUGH_ROWS: usize = 1500;

/// Degrees of freedom below which nothing is said.
const LEAST_FREEDOM: f64 = 8.0;

/// How much likelier (in twice the logarithm) one passing place must be than another to be told from it.
const LIKELIER: f64 = 10.0;

/// A place that may move by any amount in any row.
#[derive(Debug)]
struct Loose {
    spot: Spot,
    parameters: Vec<Parameter>,
}

impl Loose {
    fn at(spot: Spot) -> Self {
        let count = if spot == Spot::Base { 2 } else { 1 };
        let parameter = |number: usize| Parameter::new(&number.to_string(), Unit::RATIO, (-1.0, 1.0));
        Self { spot, parameters: (0..count).map(parameter).collect() }
    }
}

impl Effect for Loose {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn drive(&self, situation: &Situation<'_>, drives: &mut Vec<Drive>) {
        match self.spot {
            Spot::Joint(joint) => drives.push(situation.drive_joint(joint, 0, 1.0)),
            _ => {
                let (first, second) = crate::fit::square_to(&situation.weights.down);
                drives.extend([first, second].into_iter().enumerate().map(|(parameter, turn)| {
                    let (shift, about) = (Vector3::zeros(), Vector3::zeros());
                    Drive { parameter, handle: Handle::Twist { after: 0, shift, turn, about }, rate: 1.0 }
                }));
            }
        }
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Gravity
    }
}

/// One row, whitened: residuals, and the free parameters' columns (parameters by equations).
struct Row {
    residuals: DVector<f64>,
    columns: DMatrix<f64>,
    directions: DMatrix<f64>,
}

/// A row with some directions taken out, and how many equations are left of it.
struct Projected {
    residuals: DVector<f64>,
    columns: DMatrix<f64>,
    equations: f64,
}

impl Row {
    /// Takes the motions in `range` out.
    fn without(&self, range: std::ops::Range<usize>) -> Projected {
        let mut projected = Projected {
            residuals: self.residuals.clone(),
            columns: self.columns.clone(),
            equations: self.residuals.len() as f64,
        };
        let mut taken: Vec<DVector<f64>> = Vec::new();
        for index in range {
            let full = self.directions.row(index).transpose();
            let mut direction = full.clone();
            for earlier in &taken {
                direction -= earlier * earlier.dot(&full);
            }
            let Some(direction) = direction.try_normalize(1e-6 * full.norm().max(1e-9)) else { continue };
            let amount = direction.dot(&projected.residuals);
            projected.residuals.axpy(-amount, &direction, 1.0);
            let amounts = &projected.columns * &direction;
            projected.columns.ger(-1.0, &amounts, &direction, 1.0);
            projected.equations -= 1.0;
            taken.push(direction);
        }
        projected
    }
}

/// Sum of squares left by the best linear fit of the free parameters, and its degrees of freedom; and the rows kept.
fn left_of(rows: &[Projected], kept: &[bool], full: &DVector<f64>) -> (f64, f64, DVector<f64>) {
    let size = full.len();
    let (mut matrix, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
    let (mut squares, mut equations) = (0.0, 0.0);
    for (row, _) in rows.iter().zip(kept).filter(|(_, kept)| **kept) {
        matrix.gemm(1.0, &row.columns, &row.columns.transpose(), 1.0);
        gradient.gemv(1.0, &row.columns, &row.residuals, 1.0);
        squares += row.residuals.norm_squared();
        equations += row.equations;
    }
    // A column that the projection took away whole leaves rounding behind.
    for index in 0..size {
        if matrix[(index, index)] < 1e-10 * full[index] {
            matrix.row_mut(index).fill(0.0);
            matrix.column_mut(index).fill(0.0);
            gradient[index] = 0.0;
        }
    }
    let factor = Factor::new(&matrix);
    let step = factor.solve(&gradient);
    ((squares - gradient.dot(&step)).max(0.0), equations - factor.rank() as f64, step)
}

/// A place's own view of which rows are wild: those kept, how far each row is off by its fit, and its scatter.
struct View {
    kept: Vec<bool>,
    distances: Vec<f64>,
    scale: f64,
}

/// A row's typical distance for a scatter of one, and by how much a wild one's is greater.
fn typical(equations: f64) -> f64 {
    chi_squared_quantile(0.5, equations).sqrt()
}

/// Leaves rows out that lie far outside the others' scatter; nine turns settle it.
fn view(rows: &[Projected], full: &DVector<f64>) -> View {
    let mut view = View { kept: vec![true; rows.len()], distances: Vec::new(), scale: 1.0 };
    for _ in 0..9 {
        let (_, freedom, step) = left_of(rows, &view.kept, full);
        let counted = rows.iter().zip(&view.kept).filter(|(_, kept)| **kept);
        let equations: f64 = counted.map(|(row, _)| row.equations).sum();
        let off = |row: &Projected| (&row.residuals - row.columns.tr_mul(&step)).norm();
        view.distances = rows.iter().map(off).collect();
        let measured = rows.iter().zip(&view.distances).filter(|(row, _)| row.equations > 0.0);
        let relative: Vec<f64> = measured.map(|(row, off)| off / typical(row.equations)).collect();
        view.scale = median(&relative) * (equations / freedom.max(1.0)).sqrt();
        let near = |(row, off): (&Projected, &f64)| {
            row.equations <= 0.0 || *off <= view.scale * chi_squared_quantile(TAME, row.equations).sqrt()
        };
        let fresh: Vec<bool> = rows.iter().zip(&view.distances).map(near).collect();
        if fresh == view.kept {
            break;
        }
        view.kept = fresh;
    }
    view
}

/// Share of rows that lie nearer than a wild one when nothing is wild.
const TAME: f64 = 0.9995;

/// What all rows are off for a common scatter, less what noise alone would make it. A wild row costs the same however wild
/// it is and whatever is left of it: a place that calls rows wild which another explains pays for them.
fn surplus(rows: &[Projected], view: &View, scale: f64) -> f64 {
    let cost = |(row, off): (&Projected, &f64)| {
        let squares = (off / scale).powi(2);
        if squares > chi_squared_quantile(TAME, row.equations) { WILD } else { squares - row.equations }
    };
    rows.iter().zip(&view.distances).filter(|(row, _)| row.equations > 0.0).map(cost).sum()
}

/// Price of a wild row, in squared sigmas.
const WILD: f64 = 12.0;

impl Laboratory {
    /// Tries every joint, and the base, as the one place where everything sits that is not noise. The likeliest first;
    /// places about which the table cannot tell are left out.
    pub(crate) fn bearings(
        &self,
        fitted: &Fitted<'_>,
        floor: &Floor,
    ) -> Result<Vec<Bearing>, LaboratoryError> {
        let measured = self.measured_rows();
        let stride = measured.len().div_ceil(ENOUGH_ROWS).max(1);
        let chosen: Vec<usize> = measured.into_iter().step_by(stride).collect();
        let mut spots: Vec<Spot> = (0..self.model().chain.len()).map(Spot::Joint).collect();
        spots.push(Spot::Base);
        let loose: Vec<Loose> = spots.iter().map(|spot| Loose::at(*spot)).collect();
        let probes: Vec<&dyn Effect> = loose.iter().map(|loose| loose as &dyn Effect).collect();
        let own = fitted.machine.slots().len();
        let ones = vec![1.0; self.table().len()];
        let mut full = DVector::zeros(own);
        let rows: Vec<Row> = chosen
            .iter()
            .map(|row| {
                let block = fitted.machine.block(&fitted.fit.state, &[*row], &ones, &probes);
                let columns = block.jacobian.rows(0, own).into_owned();
                for (total, column) in full.iter_mut().zip(columns.row_iter()) {
                    *total += column.norm_squared();
                }
                let directions = block.jacobian.rows(own, block.jacobian.nrows() - own).into_owned();
                Row { residuals: DVector::from_vec(block.residuals), columns, directions }
            })
            .collect();
        let mut first = 0;
        let mut tried: Vec<(Spot, Vec<Projected>, View)> = Vec::new();
        for (spot, loose) in spots.iter().zip(&loose) {
            let range = first..first + loose.parameters.len();
            first = range.end;
            let projected: Vec<Projected> = rows.iter().map(|row| row.without(range.clone())).collect();
            let view = view(&projected, &full);
            if left_of(&projected, &view.kept, &full).1 >= LEAST_FREEDOM {
                tried.push((*spot, projected, view));
            }
        }
        // All places are judged on the same rows: those the likeliest keeps.
        let scale = tried.iter().map(|(_, _, view)| view.scale).fold(f64::INFINITY, f64::min).max(1e-300);
        let cost = |(_, rows, view): &(Spot, Vec<Projected>, View)| surplus(rows, view, scale);
        let likeliest = tried.iter().min_by(|left, right| cost(left).total_cmp(&cost(right)));
        let Some(kept) = likeliest.map(|(_, _, view)| view.kept.clone()) else { return Ok(Vec::new()) };
        let whole: Vec<Projected> = rows.iter().map(|row| row.without(0..0)).collect();
        let (whole_squares, whole_freedom, _) = left_of(&whole, &kept, &full);
        let mut found: Vec<Bearing> = tried
            .iter()
            .map(|(spot, projected, _)| {
                let (squares, freedom, _) = left_of(projected, &kept, &full);
                let p = chance(squares, freedom, floor).unwrap_or(1.0);
                let (across, whole) = ((squares, freedom.max(1.0)), (whole_squares, whole_freedom));
                Bearing { spot: *spot, across, whole, p }
            })
            .collect();
        found.sort_by(|left, right| {
            (left.across.0 / left.across.1).total_cmp(&(right.across.0 / right.across.1))
        });
        Ok(found)
    }
}

/// The places where everything may sit that is not noise, the likeliest first. A joint goes before the base, whose two
/// turns take more away. Without a floor the likeliest place is the measure of the others.
pub(crate) fn places(bearings: &[Bearing], floor: &Floor) -> Vec<Spot> {
    let variance = match (floor.scale, bearings.first()) {
        (Some(scale), _) => scale * scale,
        (None, Some(best)) => best.across.0 / best.across.1,
        (None, None) => return Vec::new(),
    };
    let worth = |bearing: &Bearing| bearing.across.0 / variance - bearing.across.1;
    let of = |wanted: &dyn Fn(&Bearing) -> bool| -> Vec<Spot> {
        let passing: Vec<&Bearing> =
            bearings.iter().filter(|bearing| bearing.passes() && wanted(bearing)).collect();
        let least = passing.iter().map(|bearing| worth(bearing)).fold(f64::INFINITY, f64::min);
        passing
            .iter()
            .filter(|bearing| worth(bearing) - least < LIKELIER)
            .map(|bearing| bearing.spot)
            .collect()
    };
    let joints = of(&|bearing| bearing.spot != Spot::Base);
    if joints.is_empty() { of(&|bearing| bearing.spot == Spot::Base) } else { joints }
}
