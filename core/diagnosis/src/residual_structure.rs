//! What is left when nothing more can be named: what of everything recorded it still goes with, and in what shape. A
//! permutation test asks (Edgington 1995, Randomization Tests), once for all covariates together by the maximum over them
//! (Westfall and Young 1993).

mod shape;

use nalgebra::Vector3;

pub use shape::{CategoryMeans, Description, ResidualShape, Trend};
use shape::{LevelMean, classify};

use crate::cross_validation::pose_groups;
use crate::fitted::Fitted;
use crate::thresholds::{LEVELS, SHUFFLES, STRUCTURE_ROWS, WAVE_FRACTION};
use plumb_calibration::measurement::ReadingUnit;
use plumb_calibration::table::{MOST_LEVELS, Table};
use plumb_estimation::{Random, f_tail};

/// Orders looked at, periods a turn.
const ORDERS: std::ops::RangeInclusive<u32> = 1..=64;

/// What the rest goes with, the clearest first, and its shape.
pub(super) struct ResidualStructure {
    pub(super) covariates: Vec<String>,
    pub(super) shape: Description,
}

/// One thing that was recorded, or follows from the pose.
struct Covariate {
    name: String,
    unit: &'static str,
    /// Whether it is an angle: radians of a joint.
    turns: bool,
    values: Vec<f64>,
    /// The categories that are at 0, 1, ... where it is categorical; none for numbers.
    categories: Vec<String>,
}

impl Covariate {
    /// Of numbers that are no angles.
    fn of_numbers(name: String, unit: &'static str, values: Vec<f64>) -> Self {
        Self { name, unit, turns: false, values, categories: Vec::new() }
    }

    /// The level of every value; a category is a level.
    fn levels(&self) -> Vec<usize> {
        match self.categories.is_empty() {
            true => levels(&self.values),
            false => self.values.iter().map(|value| *value as usize).collect(),
        }
    }
}

/// What is left, seen along one direction: a value a unit of rows, in the unit of the table's readings.
struct Component {
    name: String,
    unit: ReadingUnit,
    values: Vec<f64>,
}

/// Everything by row or by pose.
struct Sheet {
    covariates: Vec<Covariate>,
    components: Vec<Component>,
}

/// What the levels of a covariate explain of a component.
#[derive(Clone, Copy)]
struct Find {
    covariate: usize,
    component: usize,
    /// Minus the logarithm of the probability that noise would do as much.
    strength: f64,
}

/// Looks at what a fit has left.
pub(super) fn residual_structure(fitted: &Fitted<'_>) -> ResidualStructure {
    let sheets = [by_pose(fitted), by_row(fitted)];
    let mut random = Random::seeded(11);
    let mut found: Vec<(usize, Find)> = Vec::new();
    let mut chance: f64 = 0.0;
    for (index, sheet) in sheets.iter().enumerate() {
        let levels: Vec<Vec<usize>> = sheet.covariates.iter().map(Covariate::levels).collect();
        let count = sheet.components.first().map_or(0, |component| component.values.len());
        let mut order: Vec<usize> = (0..count).collect();
        found.extend(strongest(sheet, &levels, &order).into_iter().map(|find| (index, find)));
        for _ in 0..SHUFFLES {
            random.shuffle(&mut order);
            let most = strongest(sheet, &levels, &order).into_iter().map(|find| find.strength);
            chance = most.fold(chance, f64::max);
        }
    }
    // Chance is the greatest strength of any covariate under any shuffle: its comparison pays for all covariates at once (Westfall & Young 1993).
    found.retain(|(_, find)| find.strength > chance);
    found.sort_by(|left, right| right.1.strength.total_cmp(&left.1.strength));
    let known = found.iter().filter_map(|(sheet, find)| sheets.get(*sheet)?.covariates.get(find.covariate));
    let covariates: Vec<String> = known.map(|covariate| covariate.name.clone()).collect();
    let first = found.first().and_then(|(sheet, find)| describe(sheets.get(*sheet)?, *find));
    let shape = first.unwrap_or_else(|| Description::Unrelated(conditions(&sheets)));
    ResidualStructure { shape, covariates }
}

/// Every condition on record, where none of them goes with the rest.
fn conditions(sheets: &[Sheet; 2]) -> Vec<String> {
    sheets.iter().skip(1).flat_map(|sheet| &sheet.covariates).map(|one| one.name.clone()).collect()
}

/// For every covariate the component it explains best.
fn strongest(sheet: &Sheet, levels: &[Vec<usize>], order: &[usize]) -> Vec<Find> {
    let each = levels.iter().enumerate().filter_map(|(covariate, levels)| {
        let finds = sheet.components.iter().enumerate().filter_map(|(component, values)| {
            let (between, within, count) = explained(&values.values, levels, order);
            let (above, below) = (count as f64 - 1.0, order.len() as f64 - count as f64);
            (above >= 1.0 && below >= 1.0 && within > 0.0).then(|| {
                let p = f_tail(between / above / (within / below), above, below);
                Find { covariate, component, strength: -p.max(1e-300).ln() }
            })
        });
        finds.max_by(|left, right| left.strength.total_cmp(&right.strength))
    });
    each.collect()
}

/// Squares between levels, within them, and how many levels are used; `order` says whose value is at each index.
fn explained(values: &[f64], levels: &[usize], order: &[usize]) -> (f64, f64, usize) {
    let mut sums = [(0.0, 0.0); MOST_LEVELS];
    let (mut total, mut sum, mut count) = (0.0, 0.0, 0.0);
    for (level, index) in levels.iter().zip(order) {
        let value = values.get(*index).copied().unwrap_or(0.0);
        if let Some(slot) = sums.get_mut(*level) {
            slot.0 += value;
            slot.1 += 1.0;
        }
        total += value * value;
        sum += value;
        count += 1.0;
    }
    let mean = sum / f64::max(count, 1.0);
    let used: Vec<&(f64, f64)> = sums.iter().filter(|(_, count)| *count > 0.0).collect();
    let between: f64 = used.iter().map(|(sum, count)| count * (sum / count - mean).powi(2)).sum();
    let total = total - count * mean * mean;
    (between, (total - between).max(0.0), used.len())
}

/// The level of every value: the value itself where there are few, else equal shares.
fn levels(values: &[f64]) -> Vec<usize> {
    let mut sorted: Vec<f64> = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut distinct = sorted.clone();
    distinct.dedup();
    if distinct.len() <= LEVELS {
        return values.iter().map(|value| distinct.partition_point(|other| other < value)).collect();
    }
    let ranks = values.iter().map(|value| sorted.partition_point(|other| other < value));
    // Equal values have equal ranks, and with it one level.
    ranks.map(|rank| (rank * LEVELS / sorted.len().max(1)).min(LEVELS - 1)).collect()
}

/// How a component goes with a covariate.
fn describe(sheet: &Sheet, find: Find) -> Option<Description> {
    let covariate = sheet.covariates.get(find.covariate)?;
    let component = sheet.components.get(find.component)?;
    match covariate.categories.is_empty() {
        true => trend(covariate, component).map(Description::Trend),
        false => Some(Description::Categories(category_means(covariate, component))),
    }
}

/// Mean of a component over the rows of every category that has any.
fn category_means(covariate: &Covariate, component: &Component) -> CategoryMeans {
    let mut sums = vec![(0.0, 0.0); covariate.categories.len()];
    for (level, value) in covariate.levels().into_iter().zip(&component.values) {
        if let Some((sum, count)) = sums.get_mut(level) {
            *sum += value;
            *count += 1.0;
        }
    }
    let used = covariate.categories.iter().zip(sums).filter(|(_, (_, count))| *count > 0.0);
    CategoryMeans {
        along: component.name.clone(),
        against: covariate.name.clone(),
        of_residual: component.unit,
        means: used.map(|(category, (sum, count))| (category.clone(), sum / count)).collect(),
    }
}

/// How a component goes with a covariate of numbers.
fn trend(covariate: &Covariate, component: &Component) -> Option<Trend> {
    let wave = match covariate.turns {
        true => strongest_wave(&covariate.values, &component.values),
        false => None,
    };
    Some(Trend {
        along: component.name.clone(),
        against: covariate.name.clone(),
        unit: covariate.unit,
        of_residual: component.unit,
        in_degrees: covariate.turns,
        shape: classify(&level_means(&covariate.values, &component.values), wave)?,
    })
}

/// Mean of a covariate and of a component over the rows of each level that has any.
fn level_means(covariate: &[f64], component: &[f64]) -> Vec<LevelMean> {
    let mut sums = [LevelMean { at: 0.0, mean: 0.0, count: 0.0 }; LEVELS];
    for ((level, at), value) in levels(covariate).into_iter().zip(covariate).zip(component) {
        if let Some(sum) = sums.get_mut(level) {
            (sum.at, sum.mean, sum.count) = (sum.at + at, sum.mean + value, sum.count + 1.0);
        }
    }
    let used = sums.into_iter().filter(|sum| sum.count > 0.0);
    used.map(|sum| LevelMean { at: sum.at / sum.count, mean: sum.mean / sum.count, ..sum }).collect()
}

/// Squares that a wave of this order explains, and its amplitude; nothing where the values do not determine it.
fn wave(order: u32, angles: &[f64], values: &[f64]) -> Option<(f64, f64)> {
    let (mut s, mut c, mut ss, mut cc, mut sc) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (angle, value) in angles.iter().zip(values) {
        let (sine, cosine) = (f64::from(order) * angle).sin_cos();
        s += sine * value;
        c += cosine * value;
        ss += sine * sine;
        cc += cosine * cosine;
        sc += sine * cosine;
    }
    let determinant = ss * cc - sc * sc;
    if determinant <= 1e-9 * ss * cc {
        return None;
    }
    let (a, b) = ((cc * s - sc * c) / determinant, (ss * c - sc * s) / determinant);
    Some((a * s + b * c, a.hypot(b)))
}

/// Periods a rotation and amplitude of the one wave that explains most, if it explains more than levels would.
fn strongest_wave(angles: &[f64], values: &[f64]) -> Option<(u32, f64)> {
    let order: Vec<usize> = (0..values.len()).collect();
    let (between, within, _) = explained(values, &levels(angles), &order);
    let waves = ORDERS.filter_map(|order| Some((order, wave(order, angles, values)?)));
    let (order, (squares, amplitude)) = waves.max_by(|left, right| left.1.0.total_cmp(&right.1.0))?;
    // A wave that makes no full turn within the poses is no wave.
    let reach = angles.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        - angles.iter().copied().fold(f64::INFINITY, f64::min);
    let rotations = f64::from(order) * reach / std::f64::consts::TAU;
    (squares > between.max(WAVE_FRACTION * (between + within)) && rotations > 1.0)
        .then_some((order, amplitude))
}

/// What a row has left, as a vector; nothing where no point was measured.
fn vector(fitted: &Fitted<'_>, row: usize) -> Option<Vector3<f64>> {
    let (problem, fit) = (&fitted.problem, &fitted.fit);
    let own = fit.residuals.get(problem.observations.range(row))?;
    let mut sum = Vector3::zeros();
    let mut any = false;
    for (equation, residual) in problem.observations.of_row(row).iter().zip(own) {
        if let Some(axis) = equation.measurand.coordinate() {
            sum[axis] += residual;
            any = true;
        }
    }
    // Weighed as in the fit: one outlier must not make a shape.
    any.then(|| sum * fit.weights.get(row).copied().unwrap_or(1.0))
}

/// What is left of the first of a row's readings, in the unit of the table's readings; nothing (0) where none has that unit.
fn first_reading(fitted: &Fitted<'_>, row: usize) -> f64 {
    let (problem, fit) = (&fitted.problem, &fitted.fit);
    let own = fit.residuals.get(problem.observations.range(row)).unwrap_or(&[]);
    let unit = problem.observations.unit();
    let mut shown = problem
        .observations
        .of_row(row)
        .iter()
        .zip(own)
        .filter_map(|(equation, residual)| Some(residual * equation.factor_in(unit)?));
    // Weighed as in the fit, as a vector is.
    shown.next().unwrap_or(0.0) * fit.weights.get(row).copied().unwrap_or(1.0)
}

/// What some rows have left, seen along the motion of every joint and along the axes of the measurements; or as it was read.
fn components(fitted: &Fitted<'_>, units: &[Vec<usize>]) -> Vec<Component> {
    let (problem, fit) = (&fitted.problem, &fitted.fit);
    let unit = problem.observations.unit();
    let first = units.iter().flatten().next().copied();
    if first.is_none_or(|row| vector(fitted, row).is_none()) {
        return vec![Component {
            name: "in what was read".to_owned(),
            unit,
            values: means(units, |row| first_reading(fitted, row)),
        }];
    }
    let joints = problem.model.chain.joints.iter().enumerate().map(|(index, joint)| Component {
        name: format!("along the motion of {}", joint.name),
        unit,
        values: means(units, |row| {
            let motion = problem.row_details(&fit.state, row).by_joint.get(index).copied();
            let direction =
                motion.and_then(|motion| motion.try_normalize(1e-9)).unwrap_or_else(Vector3::zeros);
            vector(fitted, row).map_or(0.0, |vector| vector.dot(&direction))
        }),
    });
    let axes = ["x", "y", "z"].iter().enumerate().map(|(axis, name)| Component {
        name: format!("along {name}"),
        unit,
        values: means(units, |row| vector(fitted, row).map_or(0.0, |vector| vector[axis])),
    });
    joints.chain(axes).collect()
}

/// The mean of a number of rows over each unit of them.
fn means(units: &[Vec<usize>], of: impl Fn(usize) -> f64) -> Vec<f64> {
    let means =
        units.iter().map(|unit| unit.iter().map(|row| of(*row)).sum::<f64>() / unit.len().max(1) as f64);
    means.collect()
}

/// The covariates that vary.
fn varying(covariates: Vec<Covariate>) -> Vec<Covariate> {
    let varying = covariates.into_iter().filter(|one| {
        let first = one.values.first().copied().unwrap_or(f64::NAN);
        // One that is not known in every row would be tested on other rows than the rest.
        one.values.iter().all(|value| value.is_finite())
            && one.values.iter().any(|value| (value - first).abs() > 1e-9)
    });
    varying.collect()
}

/// What follows from the pose, by pose: returns to one pose share what the model does wrong there.
fn by_pose(fitted: &Fitted<'_>) -> Sheet {
    let problem = &fitted.problem;
    let poses = pose_groups(problem.table, &fitted.fit.rows);
    let poses: Vec<Vec<usize>> =
        poses.into_iter().filter(|rows| !rows.is_empty()).collect::<Vec<_>>().thin(STRUCTURE_ROWS);
    let mut covariates = Vec::new();
    // The joints are the same in all rows of a pose, and so are the moments but for the load.
    let first: Vec<usize> = poses.iter().filter_map(|unit| unit.first().copied()).collect();
    let details: Vec<Vec<f64>> =
        first.iter().map(|row| problem.row_details(&fitted.fit.state, *row).moments).collect();
    for (index, joint) in problem.model.chain.joints.iter().enumerate() {
        let turns = joint.motion == plumb_kinematics::Motion::Turns;
        covariates.push(Covariate {
            name: joint.name.clone(),
            unit: if turns { "deg" } else { "mm" },
            turns,
            values: first
                .iter()
                .map(|row| problem.table.q_of(*row).get(index).copied().unwrap_or(0.0))
                .collect(),
            categories: Vec::new(),
        });
        covariates.push(Covariate {
            name: format!("moment of {}", joint.name),
            unit: "N m",
            turns: false,
            values: details.iter().map(|moments| moments.get(index).copied().unwrap_or(0.0)).collect(),
            categories: Vec::new(),
        });
    }
    Sheet { covariates: varying(covariates), components: components(fitted, &poses) }
}

/// The sessions and the user's own columns, in some rows. A column of more categories than [`MOST_LEVELS`] is left out: the
/// warnings say so.
fn categorical(table: &Table, rows: &[usize]) -> Vec<Covariate> {
    let mut all = Vec::new();
    if (2..=MOST_LEVELS).contains(&table.session.names.len()) {
        let of_rows = rows.iter().map(|row| table.session.of_row.get(*row).copied().flatten());
        let values = of_rows.map(|session| session.map_or(f64::NAN, f64::from)).collect();
        let categories = table.session.names.clone();
        all.push(Covariate { categories, ..Covariate::of_numbers("session".to_owned(), "", values) });
    }
    for one in table.covariates.iter().filter(|one| !one.has_too_many_levels()) {
        let values = rows.iter().map(|row| one.number(*row)).collect();
        let categories = one.levels().to_vec();
        all.push(Covariate { categories, ..Covariate::of_numbers(one.name.clone(), "", values) });
    }
    all
}

/// What was recorded besides, by row.
fn by_row(fitted: &Fitted<'_>) -> Sheet {
    let table = fitted.problem.table;
    let rows = fitted.fit.rows.clone().thin(STRUCTURE_ROWS);
    let mut covariates = Vec::new();
    for (index, joint) in fitted.problem.model.chain.joints.iter().enumerate() {
        let sides = rows.iter().map(|row| f64::from(table.approach_of(*row, index)));
        let name = format!("side of approach of {}", joint.name);
        covariates.push(Covariate::of_numbers(name, "", sides.collect()));
    }
    let mut ranks = vec![0.0; table.len()];
    for (order, row) in table.order().into_iter().enumerate() {
        if let Some(slot) = ranks.get_mut(row) {
            *slot = order as f64;
        }
    }
    // Where time is logged the order says the same with less.
    let order = table.time.is_none().then_some(ranks);
    let columns = [
        ("time", "s", &table.time),
        ("order", "", &order),
        ("temperature", "deg C", &table.temperature),
        ("payload", "kg", &table.payload),
    ];
    for (name, unit, column) in columns {
        let Some(column) = column else { continue };
        let values = rows.iter().map(|row| column.get(*row).copied().unwrap_or(f64::NAN));
        covariates.push(Covariate::of_numbers(name.to_owned(), unit, values.collect()));
    }
    covariates.extend(categorical(table, &rows));
    let units: Vec<Vec<usize>> = rows.iter().map(|row| vec![*row]).collect();
    Sheet { covariates: varying(covariates), components: components(fitted, &units) }
}

/// Fewer of many, spread evenly.
trait Thin {
    fn thin(self, most: usize) -> Self;
}

impl<T> Thin for Vec<T> {
    fn thin(self, most: usize) -> Self {
        // Evenly and not by chance: order and time are among what is asked.
        let stride = self.len().div_ceil(most).max(1);
        self.into_iter().step_by(stride).collect()
    }
}

#[cfg(test)]
mod tests;
