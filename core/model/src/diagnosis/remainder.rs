//! What is left when nothing more can be named: what of everything recorded it still goes with, and in what shape. A
//! permutation test asks (which knows no distribution), once for all covariates together.

use nalgebra::Vector3;

use super::trial::Fitted;
use super::wording::{figure, listed};
use crate::fit::Reading;
use crate::statistics::{Random, f_tail};
use crate::validation::pose_groups;

/// Rows, or poses, looked at.
const LOOKED_AT: usize = 600;

/// Shuffles; a covariate counts when none of them does as much.
const SHUFFLES: usize = 199;

/// Levels a covariate is cut into.
const LEVELS: usize = 8;

/// Share of what the levels explain that a simple shape must have to be called by its name.
const CLEARLY: f64 = 0.8;

/// Orders looked at, periods a turn.
const ORDERS: std::ops::RangeInclusive<u32> = 1..=64;

/// What the rest goes with, the clearest first, and its shape in words.
pub(super) struct Remainder {
    pub(super) covariates: Vec<String>,
    pub(super) shape: String,
}

/// One thing that was recorded, or follows from the pose.
struct Covariate {
    name: String,
    unit: &'static str,
    /// Whether it turns: radians of a joint.
    turns: bool,
    values: Vec<f64>,
}

/// What is left, seen along one direction: a value a unit, mm.
struct Component {
    name: String,
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
pub(super) fn remainder(fitted: &Fitted<'_>) -> Remainder {
    let sheets = [by_pose(fitted), by_row(fitted)];
    let mut random = Random::seeded(11);
    let mut found: Vec<(usize, Find)> = Vec::new();
    let mut chance: f64 = 0.0;
    for (index, sheet) in sheets.iter().enumerate() {
        let levels: Vec<Vec<usize>> =
            sheet.covariates.iter().map(|covariate| levels(&covariate.values)).collect();
        let count = sheet.components.first().map_or(0, |component| component.values.len());
        let mut order: Vec<usize> = (0..count).collect();
        found.extend(strongest(sheet, &levels, &order).into_iter().map(|find| (index, find)));
        for _ in 0..SHUFFLES {
            random.shuffle(&mut order);
            let most = strongest(sheet, &levels, &order).into_iter().map(|find| find.strength);
            chance = most.fold(chance, f64::max);
        }
    }
    found.retain(|(_, find)| find.strength > chance);
    found.sort_by(|left, right| right.1.strength.total_cmp(&left.1.strength));
    let name = |(sheet, find): &(usize, Find)| {
        Some(sheets.get(*sheet)?.covariates.get(find.covariate)?.name.clone())
    };
    let covariates: Vec<String> = found.iter().filter_map(name).collect();
    let first = found.first().and_then(|(sheet, find)| shape(sheets.get(*sheet)?, *find));
    Remainder { shape: first.unwrap_or_else(|| nothing(&sheets)), covariates }
}

/// What to say when nothing recorded goes with the rest.
fn nothing(sheets: &[Sheet; 2]) -> String {
    let conditions: Vec<String> =
        sheets.iter().skip(1).flat_map(|sheet| &sheet.covariates).map(|one| one.name.clone()).collect();
    format!(
        "it goes with no joint, moment or condition on record ({}); return to some poses from either side, after waiting, and under load",
        listed(&conditions, "and")
    )
}

/// For every covariate the component it explains best.
fn strongest(sheet: &Sheet, levels: &[Vec<usize>], order: &[usize]) -> Vec<Find> {
    let one = |(covariate, levels): (usize, &Vec<usize>)| {
        let finds = sheet.components.iter().enumerate().filter_map(|(component, values)| {
            let (between, within, count) = explained(&values.values, levels, order);
            let (above, below) = (count as f64 - 1.0, order.len() as f64 - count as f64);
            (above >= 1.0 && below >= 1.0 && within > 0.0).then(|| {
                let p = f_tail(between / above / (within / below), above, below);
                Find { covariate, component, strength: -p.max(1e-300).ln() }
            })
        });
        finds.max_by(|left, right| left.strength.total_cmp(&right.strength))
    };
    levels.iter().enumerate().filter_map(one).collect()
}

/// Squares between levels, within them, and how many levels are used; `order` says whose value stands in each place.
fn explained(values: &[f64], levels: &[usize], order: &[usize]) -> (f64, f64, usize) {
    let mut sums = [(0.0, 0.0); LEVELS];
    let (mut total, mut sum, mut count) = (0.0, 0.0, 0.0);
    for (level, place) in levels.iter().zip(order) {
        let value = values.get(*place).copied().unwrap_or(0.0);
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
    let share = |value: &f64| sorted.partition_point(|other| other < value) * LEVELS / sorted.len().max(1);
    values.iter().map(|value| share(value).min(LEVELS - 1)).collect()
}

/// How a component goes with a covariate, in words.
fn shape(sheet: &Sheet, find: Find) -> Option<String> {
    let (covariate, component) =
        (sheet.covariates.get(find.covariate)?, sheet.components.get(find.component)?);
    let levels = levels(&covariate.values);
    let mut means: Vec<(f64, f64, f64)> = Vec::new();
    for level in 0..LEVELS {
        let own = || levels.iter().enumerate().filter(|(_, other)| **other == level).map(|(index, _)| index);
        let count = own().count() as f64;
        let mean = |values: &[f64]| own().filter_map(|index| values.get(index)).sum::<f64>() / count;
        if count > 0.0 {
            means.push((mean(&covariate.values), mean(&component.values), count));
        }
    }
    let (first, last) = (*means.first()?, *means.last()?);
    let at = |value: f64| {
        let shown = if covariate.turns { value.to_degrees() } else { value };
        format!("{} {}", figure(shown), covariate.unit).trim_end().to_owned()
    };
    let along = &component.name;
    let name = &covariate.name;
    if let Some((order, amplitude)) = waves(covariate, component) {
        return Some(format!(
            "{along} it swings {order} times a turn of {name}, by {} mm",
            figure(amplitude)
        ));
    }
    if means.len() <= 3 {
        return Some(format!(
            "{along} it differs by {} mm between {name} {} and {}",
            figure(last.1 - first.1),
            at(first.0),
            at(last.0)
        ));
    }
    let weight: f64 = means.iter().map(|mean| mean.2).sum();
    let average = |of: &dyn Fn(&(f64, f64, f64)) -> f64| {
        means.iter().map(|mean| mean.2 * of(mean)).sum::<f64>() / weight
    };
    let (middle, level) = (average(&|mean| mean.0), average(&|mean| mean.1));
    let spread = average(&|mean| (mean.1 - level).powi(2));
    let slope = average(&|mean| (mean.0 - middle) * (mean.1 - level))
        / average(&|mean| (mean.0 - middle).powi(2)).max(1e-300);
    let straight = slope * slope * average(&|mean| (mean.0 - middle).powi(2)) / spread.max(1e-300);
    let jump = |split: usize| {
        let (low, high) = means.split_at(split);
        let mean = |part: &[(f64, f64, f64)]| {
            part.iter().map(|mean| mean.1 * mean.2).sum::<f64>() / part.iter().map(|mean| mean.2).sum::<f64>()
        };
        let share = low.iter().map(|mean| mean.2).sum::<f64>() / weight;
        let height = mean(high) - mean(low);
        (share * (1.0 - share) * height * height / spread.max(1e-300), height, split)
    };
    let step = (1..means.len()).map(jump).max_by(|left, right| left.0.total_cmp(&right.0))?;
    if step.0 > CLEARLY && step.0 > straight {
        let (before, after) = (means.get(step.2 - 1)?, means.get(step.2)?);
        let where_ = at(0.5 * (before.0 + after.0));
        return Some(format!("{along} it jumps by {} mm at {name} {where_}", figure(step.1)));
    }
    if straight > CLEARLY {
        let rise = slope * (last.0 - first.0);
        return Some(format!(
            "{along} it changes steadily with {name}, by {} mm from {} to {}",
            figure(rise),
            at(first.0),
            at(last.0)
        ));
    }
    let highest = means.iter().max_by(|left, right| left.1.total_cmp(&right.1))?;
    let lowest = means.iter().min_by(|left, right| left.1.total_cmp(&right.1))?;
    Some(format!(
        "{along} it bends with {name}: {} mm near {} and {} mm near {}",
        figure(lowest.1),
        at(lowest.0),
        figure(highest.1),
        at(highest.0)
    ))
}

/// Periods a turn and amplitude of the one wave that explains most, if it explains more than levels would.
fn waves(covariate: &Covariate, component: &Component) -> Option<(u32, f64)> {
    if !covariate.turns {
        return None;
    }
    let order: Vec<usize> = (0..component.values.len()).collect();
    let (between, within, _) = explained(&component.values, &levels(&covariate.values), &order);
    let wave = |order: u32| {
        let (mut s, mut c, mut ss, mut cc, mut sc) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (angle, value) in covariate.values.iter().zip(&component.values) {
            let (sine, cosine) = (f64::from(order) * angle).sin_cos();
            s += sine * value;
            c += cosine * value;
            ss += sine * sine;
            cc += cosine * cosine;
            sc += sine * cosine;
        }
        let determinant = ss * cc - sc * sc;
        if determinant <= 1e-9 * ss * cc {
            return (0.0, 0.0, order);
        }
        let (a, b) = ((cc * s - sc * c) / determinant, (ss * c - sc * s) / determinant);
        (a * s + b * c, a.hypot(b), order)
    };
    let best = ORDERS.map(wave).max_by(|left, right| left.0.total_cmp(&right.0))?;
    // A wave that makes no full turn within the poses is no wave.
    let reach = covariate.values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        - covariate.values.iter().copied().fold(f64::INFINITY, f64::min);
    let turns = f64::from(best.2) * reach / std::f64::consts::TAU;
    (best.0 > between.max(0.2 * (between + within)) && turns > 1.0).then_some((best.2, best.1))
}

/// What a row has left, as a vector; nothing where no point was measured.
fn vector(fitted: &Fitted<'_>, row: usize) -> Option<Vector3<f64>> {
    let (machine, fit) = (&fitted.machine, &fitted.fit);
    let own = fit.residuals.get(machine.observations.range(row))?;
    let mut sum = Vector3::zeros();
    let mut any = false;
    for (equation, residual) in machine.observations.of_row(row).iter().zip(own) {
        if let Reading::Position(_, axis) | Reading::Touch(_, axis) = equation.reading {
            sum[usize::from(axis.min(2))] += residual;
            any = true;
        }
    }
    any.then(|| sum * fit.weights.get(row).copied().unwrap_or(1.0))
}

/// What some rows have left, seen along the motion of every joint and along the axes of the measurements; or as it was read.
fn components(fitted: &Fitted<'_>, units: &[Vec<usize>]) -> Vec<Component> {
    let (machine, fit) = (&fitted.machine, &fitted.fit);
    let mean = |unit: &[usize], of: &dyn Fn(usize) -> f64| {
        unit.iter().map(|row| of(*row)).sum::<f64>() / unit.len().max(1) as f64
    };
    let first = units.iter().flatten().next().copied();
    if first.is_none_or(|row| vector(fitted, row).is_none()) {
        let reading = |row: usize| {
            let residual =
                fit.residuals.get(machine.observations.range(row)).and_then(|own| own.first().copied());
            residual.unwrap_or(0.0) * fit.weights.get(row).copied().unwrap_or(1.0)
        };
        let values = units.iter().map(|unit| mean(unit, &reading)).collect();
        return vec![Component { name: "in what was read".to_owned(), values }];
    }
    let along = |joint: usize, row: usize| {
        let motion = machine.row_details(&fit.state, row).by_joint.get(joint).copied();
        let direction = motion.and_then(|motion| motion.try_normalize(1e-9)).unwrap_or_else(Vector3::zeros);
        vector(fitted, row).map_or(0.0, |vector| vector.dot(&direction))
    };
    let joints = machine.model.chain.joints.iter().enumerate().map(|(index, joint)| Component {
        name: format!("along the motion of {}", joint.name),
        values: units.iter().map(|unit| mean(unit, &|row| along(index, row))).collect(),
    });
    let axes = ["x", "y", "z"].iter().enumerate().map(|(axis, name)| Component {
        name: format!("along {name}"),
        values: units
            .iter()
            .map(|unit| mean(unit, &|row| vector(fitted, row).map_or(0.0, |vector| vector[axis])))
            .collect(),
    });
    joints.chain(axes).collect()
}

/// The covariates that vary.
fn varying(covariates: Vec<Covariate>) -> Vec<Covariate> {
    let varies = |one: &Covariate| {
        let first = one.values.first().copied().unwrap_or(f64::NAN);
        one.values.iter().all(|value| value.is_finite())
            && one.values.iter().any(|value| (value - first).abs() > 1e-9)
    };
    covariates.into_iter().filter(varies).collect()
}

/// What follows from the pose, by pose: returns to one pose share what the model does wrong there.
fn by_pose(fitted: &Fitted<'_>) -> Sheet {
    let machine = &fitted.machine;
    let poses = pose_groups(machine.table, &fitted.fit.rows);
    let poses: Vec<Vec<usize>> =
        poses.into_iter().filter(|rows| !rows.is_empty()).collect::<Vec<_>>().thin(LOOKED_AT);
    let mut covariates = Vec::new();
    let first = |unit: &Vec<usize>| unit.first().copied().unwrap_or(0);
    let details: Vec<Vec<f64>> =
        poses.iter().map(|unit| machine.row_details(&fitted.fit.state, first(unit)).moments).collect();
    for (index, joint) in machine.model.chain.joints.iter().enumerate() {
        let turns = joint.motion == plumb_kinematics::Motion::Turns;
        let q = |unit: &Vec<usize>| machine.table.q_of(first(unit)).get(index).copied().unwrap_or(0.0);
        covariates.push(Covariate {
            name: joint.name.clone(),
            unit: if turns { "deg" } else { "mm" },
            turns,
            values: poses.iter().map(q).collect(),
        });
        covariates.push(Covariate {
            name: format!("moment of {}", joint.name),
            unit: "N m",
            turns: false,
            values: details.iter().map(|moments| moments.get(index).copied().unwrap_or(0.0)).collect(),
        });
    }
    Sheet { covariates: varying(covariates), components: components(fitted, &poses) }
}

/// What was recorded besides, by row.
fn by_row(fitted: &Fitted<'_>) -> Sheet {
    let table = fitted.machine.table;
    let rows = fitted.fit.rows.clone().thin(LOOKED_AT);
    let mut covariates = Vec::new();
    let mut add = |name: String, unit: &'static str, of: &dyn Fn(usize) -> f64| {
        let values = rows.iter().map(|row| of(*row)).collect();
        covariates.push(Covariate { name, unit, turns: false, values });
    };
    for (index, joint) in fitted.machine.model.chain.joints.iter().enumerate() {
        let side = |row: usize| f64::from(table.approach_of(row, index));
        add(format!("side of approach of {}", joint.name), "", &side);
    }
    let mut place = vec![0.0; table.len()];
    for (order, row) in table.order().into_iter().enumerate() {
        if let Some(slot) = place.get_mut(row) {
            *slot = order as f64;
        }
    }
    match &table.time {
        Some(times) => add("time".to_owned(), "s", &|row| times.get(row).copied().unwrap_or(f64::NAN)),
        None => add("order".to_owned(), "", &|row| place.get(row).copied().unwrap_or(0.0)),
    }
    for (name, unit, column) in
        [("temperature", "deg C", &table.temperature), ("payload", "kg", &table.payload)]
    {
        if let Some(values) = column {
            add(name.to_owned(), unit, &|row| values.get(row).copied().unwrap_or(f64::NAN));
        }
    }
    if table.session.names.len() > 1 {
        let of = |row: usize| table.session.of_row.get(row).copied().flatten().map_or(f64::NAN, f64::from);
        add("session".to_owned(), "", &of);
    }
    for covariate in &table.covariates {
        add(covariate.name.clone(), "", &|row| covariate.values.get(row).copied().unwrap_or(f64::NAN));
    }
    let units: Vec<Vec<usize>> = rows.iter().map(|row| vec![*row]).collect();
    Sheet { covariates: varying(covariates), components: components(fitted, &units) }
}

/// Fewer of many, spread evenly.
trait Thin {
    fn thin(self, most: usize) -> Self;
}

impl<T> Thin for Vec<T> {
    fn thin(self, most: usize) -> Self {
        let stride = self.len().div_ceil(most).max(1);
        self.into_iter().step_by(stride).collect()
    }
}
