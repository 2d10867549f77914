//! Where an error sits, told by its direction alone. Whatever turns about one joint moves the point along that joint's
//! motion, however its amount varies from pose to pose: what lies across that motion must be noise. So a place is tried
//! by taking the component along its motion out of every row, refitting what is free to the rest, and holding what is
//! left against the floor. Nothing about the mechanism is assumed.

use std::mem::{Discriminant, discriminant};
use std::ops::Range;

use nalgebra::{DMatrix, DVector, Vector3};

use super::misfit::{MISFIT_LEVEL, chance};
use super::trial::Fitted;
use crate::effect::{Drive, Effect, Handle, LooksAt, Parameter, Situation, Spot, Unit};
use crate::fit::{Factor, Normal, Reading, for_each};
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
    /// The same, and over all directions, on rows that are not wild in any direction, every instrument's scatter brought to
    /// one: a wild row that happens to lie along the motion says nothing of it, and a level quieter than was declared would make
    /// a tracker's rows look as if something were left in them.
    tame: ((f64, f64), (f64, f64)),
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
        let (across, whole) = self.tame;
        let (squares, freedom) = (whole.0 - across.0, whole.1 - across.1);
        if freedom < 1.0 || across.1 < LEAST_FREEDOM || across.0 <= 0.0 {
            return 1.0;
        }
        f_tail(squares.max(0.0) / freedom / (across.0 / across.1), freedom, across.1)
    }
}

/// Rows looked at, at most: more tell no more about a direction.
const ENOUGH_ROWS: usize = 1500;

/// Rows handled at once by one thread.
const CHUNK: usize = 128;

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

/// Some rows, whitened: residuals, and the free parameters' columns (parameters by equations).
struct Rows {
    residuals: DVector<f64>,
    columns: DMatrix<f64>,
    /// First equation of each row, and one past the last.
    first: Vec<usize>,
}

/// Rows with some directions taken out, and how many equations are left of each.
struct Projected {
    rows: Rows,
    equations: Vec<f64>,
}

impl Rows {
    fn range(&self, row: usize) -> Range<usize> {
        let at = |index: usize| self.first.get(index).copied().unwrap_or(0);
        at(row)..at(row + 1)
    }

    fn len(&self) -> usize {
        self.first.len().saturating_sub(1)
    }

    /// Every equation divided by its own scatter.
    fn over(&self, scatter: &DVector<f64>) -> Self {
        Self {
            residuals: self.residuals.component_div(scatter),
            columns: over(&self.columns, scatter),
            first: self.first.clone(),
        }
    }

    /// Takes the motions in `range` of the `directions` (motions by equations) out of every row.
    fn without(&self, directions: &DMatrix<f64>, range: Range<usize>) -> Projected {
        let mut rows = Self {
            residuals: self.residuals.clone(),
            columns: self.columns.clone(),
            first: self.first.clone(),
        };
        let mut equations = Vec::with_capacity(self.len());
        for row in 0..self.len() {
            let own = self.range(row);
            let mut left = own.len() as f64;
            let mut taken: Vec<DVector<f64>> = Vec::new();
            for index in range.clone() {
                let full = directions.view((index, own.start), (1, own.len())).transpose();
                let mut direction = full.column(0).into_owned();
                for earlier in &taken {
                    direction -= earlier * earlier.dot(&full);
                }
                let Some(direction) = direction.try_normalize(1e-6 * full.norm().max(1e-9)) else { continue };
                let mut residuals = rows.residuals.rows_mut(own.start, own.len());
                let amount = direction.dot(&residuals);
                residuals.axpy(-amount, &direction, 1.0);
                let mut columns = rows.columns.columns_mut(own.start, own.len());
                let amounts = &columns * &direction;
                columns.ger(-1.0, &amounts, &direction, 1.0);
                left -= 1.0;
                taken.push(direction);
            }
            equations.push(left);
        }
        Projected { rows, equations }
    }
}

/// Normal equations of those rows of a projection that are kept.
struct Kept {
    normal: Normal,
    equations: f64,
    kept: Vec<bool>,
}

impl Kept {
    fn none(projected: &Projected) -> Self {
        let normal = Normal::zeros(projected.rows.columns.nrows());
        Self { normal, equations: 0.0, kept: vec![false; projected.rows.len()] }
    }

    /// Keeps these rows; only those that come or go are counted anew.
    fn keep(&mut self, projected: &Projected, kept: &[bool]) {
        for (wanted, sign) in [(true, 1.0), (false, -1.0)] {
            let changed: Vec<usize> = (0..projected.rows.len())
                .filter(|row| kept.get(*row) == Some(&wanted) && self.kept.get(*row) == Some(&!wanted))
                .collect();
            if changed.is_empty() {
                continue;
            }
            let places: Vec<usize> = changed.iter().flat_map(|row| projected.rows.range(*row)).collect();
            let residuals: Vec<f64> =
                places.iter().filter_map(|place| projected.rows.residuals.get(*place)).copied().collect();
            let mut own = Normal::zeros(self.normal.gradient.len());
            own.take(&residuals, &projected.rows.columns.select_columns(&places));
            match wanted {
                true => self.normal.add(&own),
                false => self.normal.subtract(&own),
            }
            let equations = changed.iter().filter_map(|row| projected.equations.get(*row));
            self.equations += sign * equations.sum::<f64>();
        }
        self.kept = kept.to_vec();
    }

    /// Sum of squares left by the best linear fit of the free parameters, its degrees of freedom, and that fit.
    fn left(&self, full: &DVector<f64>) -> (f64, f64, DVector<f64>) {
        let (mut matrix, mut gradient) = (self.normal.matrix.clone(), self.normal.gradient.clone());
        // A column that the projection took away whole leaves rounding behind.
        for index in 0..full.len() {
            if matrix[(index, index)] < 1e-10 * full[index] {
                matrix.row_mut(index).fill(0.0);
                matrix.column_mut(index).fill(0.0);
                gradient[index] = 0.0;
            }
        }
        let factor = Factor::new(&matrix);
        let step = factor.solve(&gradient);
        let squares = (self.normal.squares - gradient.dot(&step)).max(0.0);
        (squares, self.equations - factor.rank() as f64, step)
    }
}

/// [`Kept::left`] of some rows of a projection.
fn left_of(projected: &Projected, kept: &[bool], full: &DVector<f64>) -> (f64, f64) {
    let mut some = Kept::none(projected);
    some.keep(projected, kept);
    let (squares, freedom, _) = some.left(full);
    (squares, freedom)
}

/// A matrix (anything by equations) with every equation's column divided by its scatter.
fn over(columns: &DMatrix<f64>, scatter: &DVector<f64>) -> DMatrix<f64> {
    let mut divided = columns.clone();
    for (mut column, scatter) in divided.column_iter_mut().zip(scatter) {
        column /= *scatter;
    }
    divided
}

/// Per equation: the scatter of its instrument about the best fit, in declared sigmas; nothing if there is but one instrument.
fn scatter(
    all: &Projected,
    kept: &[bool],
    full: &DVector<f64>,
    instruments: &[Discriminant<Reading>],
) -> Option<DVector<f64>> {
    let first = instruments.first()?;
    if instruments.iter().all(|instrument| instrument == first) {
        return None;
    }
    let mut some = Kept::none(all);
    some.keep(all, kept);
    let (squares, freedom, step) = some.left(full);
    let off = &all.rows.residuals - all.rows.columns.tr_mul(&step);
    let of = |wanted: &Discriminant<Reading>| {
        let rows = (0..all.rows.len()).filter(|row| kept.get(*row) == Some(&true));
        let places = rows.flat_map(|row| all.rows.range(row));
        let own = places.filter(|place| instruments.get(*place) == Some(wanted));
        let (own, count) =
            own.fold((0.0, 0.0), |(sum, count), place| (sum + off[place] * off[place], count + 1.0));
        // Too few say nothing of their instrument: they are taken to be as good as the rest.
        if count < LEAST_FREEDOM { squares / some.equations } else { own / count }
    };
    let freed = (some.equations / freedom.max(1.0)).sqrt();
    let least = 1e-3 * (squares / some.equations).sqrt().max(1e-9);
    let mut known: Vec<(Discriminant<Reading>, f64)> = Vec::new();
    for instrument in instruments {
        if !known.iter().any(|(known, _)| known == instrument) {
            known.push((*instrument, of(instrument).sqrt().max(least) * freed));
        }
    }
    let scatter = instruments.iter().map(|instrument| {
        known.iter().find(|(known, _)| known == instrument).map_or(1.0, |(_, scatter)| *scatter)
    });
    Some(DVector::from_iterator(instruments.len(), scatter))
}

/// A place's own view of which rows are wild: those kept, how far each row is off by its fit, and its scatter.
struct View {
    kept: Vec<bool>,
    distances: Vec<f64>,
    scale: f64,
}

/// A quantile's root by the number of equations.
fn corners(share: f64, rows: &Rows) -> Vec<f64> {
    let most = (0..rows.len()).map(|row| rows.range(row).len()).max().unwrap_or(0);
    (0..=most).map(|equations| chi_squared_quantile(share, equations as f64).sqrt()).collect()
}

/// Leaves rows out that lie far outside the others' scatter; nine turns settle it.
fn view(projected: &Projected, full: &DVector<f64>) -> View {
    let rows = &projected.rows;
    let mut view = View { kept: vec![true; rows.len()], distances: Vec::new(), scale: 1.0 };
    let (typical, wild) = (corners(0.5, rows), corners(TAME, rows));
    let of = |corners: &[f64], equations: f64| corners.get(equations as usize).copied().unwrap_or(1.0);
    let mut some = Kept::none(projected);
    for _ in 0..9 {
        some.keep(projected, &view.kept);
        let (_, freedom, step) = some.left(full);
        let off = &rows.residuals - rows.columns.tr_mul(&step);
        let norm = |row: usize| off.rows(rows.range(row).start, rows.range(row).len()).norm();
        view.distances = (0..rows.len()).map(norm).collect();
        let measured =
            projected.equations.iter().zip(&view.distances).filter(|(equations, _)| **equations > 0.0);
        let relative: Vec<f64> = measured.map(|(equations, off)| off / of(&typical, *equations)).collect();
        view.scale = median(&relative) * (some.equations / freedom.max(1.0)).sqrt();
        let near =
            |(equations, off): (&f64, &f64)| *equations <= 0.0 || *off <= view.scale * of(&wild, *equations);
        let fresh: Vec<bool> = projected.equations.iter().zip(&view.distances).map(near).collect();
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
fn surplus(projected: &Projected, view: &View, scale: f64) -> f64 {
    let wild = corners(TAME, &projected.rows);
    let cost = |(equations, off): (&f64, &f64)| {
        let squares = (off / scale).powi(2);
        let edge = wild.get(*equations as usize).copied().unwrap_or(0.0).powi(2);
        if squares > edge { WILD } else { squares - equations }
    };
    let rows = projected.equations.iter().zip(&view.distances);
    rows.filter(|(equations, _)| **equations > 0.0).map(cost).sum()
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
        let chunks: Vec<&[usize]> = chosen.chunks(CHUNK).collect();
        let state = &fitted.fit.state;
        let blocks = for_each(&chunks, |chunk| fitted.machine.block(state, chunk, &ones, &probes));
        let equations = blocks.iter().map(|block| block.residuals.len()).sum();
        let width = own + loose.iter().map(|loose| loose.parameters.len()).sum::<usize>();
        let mut all = DMatrix::zeros(width, equations);
        let mut residuals = Vec::with_capacity(equations);
        for block in blocks {
            all.columns_mut(residuals.len(), block.residuals.len()).copy_from(&block.jacobian);
            residuals.extend(block.residuals);
        }
        let mut first = vec![0];
        for row in &chosen {
            first.push(first.last().copied().unwrap_or(0) + fitted.machine.observations.range(*row).len());
        }
        let (columns, directions) = (all.rows(0, own).into_owned(), all.rows(own, width - own).into_owned());
        let full = DVector::from_iterator(own, columns.row_iter().map(|column| column.norm_squared()));
        let rows = Rows { residuals: DVector::from_vec(residuals), columns, first };
        let mut ranges: Vec<(Spot, Range<usize>)> = Vec::new();
        for (spot, loose) in spots.iter().zip(&loose) {
            let start = ranges.last().map_or(0, |(_, last)| last.end);
            ranges.push((*spot, start..start + loose.parameters.len()));
        }
        let tried = for_each(&ranges, |(spot, range)| {
            let projected = rows.without(&directions, range.clone());
            let view = view(&projected, &full);
            let told = left_of(&projected, &view.kept, &full).1 >= LEAST_FREEDOM;
            told.then_some((*spot, projected, view))
        });
        let tried: Vec<(Spot, Projected, View)> = tried.into_iter().flatten().collect();
        // All places are judged on the same rows: those the likeliest keeps.
        let scale = tried.iter().map(|(_, _, view)| view.scale).fold(f64::INFINITY, f64::min).max(1e-300);
        let cost = |(_, rows, view): &(Spot, Projected, View)| surplus(rows, view, scale);
        let likeliest = tried.iter().min_by(|left, right| cost(left).total_cmp(&cost(right)));
        let Some(kept) = likeliest.map(|(_, _, view)| view.kept.clone()) else { return Ok(Vec::new()) };
        let all_ways = rows.without(&directions, 0..0);
        let near = view(&all_ways, &full).kept;
        let tame: Vec<bool> = kept.iter().zip(near).map(|(kept, near)| *kept && near).collect();
        let instruments = chosen.iter().flat_map(|row| fitted.machine.observations.of_row(*row));
        let instruments: Vec<Discriminant<Reading>> =
            instruments.map(|equation| discriminant(&equation.reading)).collect();
        let scatter = scatter(&all_ways, &tame, &full, &instruments);
        let levelled = scatter.map(|scatter| (rows.over(&scatter), over(&directions, &scatter)));
        let whole = match &levelled {
            None => left_of(&all_ways, &tame, &full),
            Some((rows, directions)) => left_of(&rows.without(directions, 0..0), &tame, &full),
        };
        let mut found: Vec<Bearing> = for_each(&tried, |(spot, projected, _)| {
            let (squares, freedom) = left_of(projected, &kept, &full);
            let p = chance(squares, freedom, floor).unwrap_or(1.0);
            let range = ranges.iter().find(|(known, _)| known == spot).map(|(_, range)| range.clone());
            let across = match (&levelled, range) {
                (Some((rows, directions)), Some(range)) => {
                    left_of(&rows.without(directions, range), &tame, &full)
                }
                _ => left_of(projected, &tame, &full),
            };
            Bearing { spot: *spot, across: (squares, freedom.max(1.0)), tame: (across, whole), p }
        });
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
