//! The flexible regression kept with a model: a residual map, fitted to what a model leaves and judged on rows it has not seen.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Matrix3};

use super::features::{Features, Group, carrier_of, joint_carriers, knowledge};
use super::known::extent;
use super::regression::{Products, Reduced};
use super::{FEWEST_POSES, FIRST_RATIO, Folds, chosen_rows, components_of, counts, ladder, random_folds};
use crate::cross_validation::pose_groups;
use crate::thresholds::{FEW_POSES_RETURNS, MAP_ROWS, VALIDATION_BLOCKS};
use plumb_calibration::arm_model::{Along, MapCarrier, MeasuredRegion, ResidualMap, Side, Wave};
use plumb_calibration::effect::{Effect, Site};
use plumb_calibration::fit::{Fit, ResidualModel, RowBlock};
use plumb_estimation::{Cancelled, Progress, Random};

/// Length scales of the waves, relative to the mean distance of two poses: those of the flexible regression, and a finer one.
const LENGTH_SCALES: [f64; 3] = [0.25, 0.5, 1.0];

/// Random frequencies of a length scale: one for so many poses, within these limits.
const POSES_A_FREQUENCY: usize = 10;
const FREQUENCIES: (usize, usize) = (3, 32);

/// Cosines over a joint's range: one for so many poses, within these limits.
const POSES_A_COSINE: usize = 20;
const COSINES: (usize, usize) = (4, 24);

/// Functions of a joint's coordinate that change with the side of approach: the side itself and two cosines.
const SIDE_FUNCTIONS: usize = 3;

/// A map, and how well it predicts rows it has not seen.
pub(crate) struct FittedMap {
    pub(crate) map: ResidualMap,
    pub(crate) region: MeasuredRegion,
    /// Root mean square error of a point on rows left out, without the map and with it, mm.
    pub(crate) without_mm: f64,
    pub(crate) with_mm: f64,
    /// What it goes by: `pose`, `side of approach`.
    pub(crate) goes_by: Vec<String>,
    /// Too few poses to leave any out: it was judged by returns left out, so nothing shows how it does between the poses.
    pub(crate) between_unknown: bool,
}

/// The map's functions without weights, in components (columns of the flexible regression) and groups.
struct Outline {
    map: ResidualMap,
    components: Vec<Range<usize>>,
    groups: Vec<Group>,
}

impl Outline {
    fn of(problem: &ResidualModel<'_>, region: &MeasuredRegion, poses: &[Vec<f64>]) -> Self {
        let mut outline = Self { map: ResidualMap::default(), components: Vec::new(), groups: Vec::new() };
        let inputs: Vec<Vec<f64>> = poses.iter().map(|pose| region.inputs(pose)).collect();
        let extent = extent(&inputs);
        // A fixed seed: the same table gives the same map.
        let mut random = Random::seeded(31);
        let count = (poses.len() / POSES_A_FREQUENCY).clamp(FREQUENCIES.0, FREQUENCIES.1);
        for scale in LENGTH_SCALES.iter().filter(|_| extent > 0.0) {
            let waves = (0..count).flat_map(|_| waves(&inputs, scale * extent, &mut random));
            let waves: Vec<Wave> = waves.collect();
            outline.close_component(3 * waves.len());
            outline.map.waves.extend(waves);
        }
        let count = (poses.len() / POSES_A_COSINE).clamp(COSINES.0, COSINES.1);
        for (joint, range) in region.joints.iter().enumerate() {
            if range.high > range.low {
                outline.map.along.push(Along { joint, weights: vec![0.0; count] });
                outline.close_component(count);
            }
        }
        outline.close_group("pose");
        for joint in 0..region.joints.len() {
            let rows = 0..problem.table.len();
            let sides =
                [-1, 1].map(|side| rows.clone().any(|row| problem.table.approach_of(row, joint) == side));
            // From one side alone the side is a constant, which the joint's zero takes.
            if sides != [true, true] {
                continue;
            }
            outline.map.sides.push(Side { joint, weights: vec![0.0; SIDE_FUNCTIONS] });
            outline.close_component(SIDE_FUNCTIONS);
        }
        outline.close_group("side of approach");
        outline
    }

    fn close_component(&mut self, columns: usize) {
        let first = self.components.last().map_or(0, |last| last.end);
        self.components.push(first..first + columns);
    }

    fn close_group(&mut self, name: &str) {
        let first = self.groups.last().map_or(0, |last| last.components.end);
        if self.components.len() > first {
            self.groups.push(Group { name: name.to_owned(), components: first..self.components.len() });
        }
    }
}

/// Sine and cosine of a random frequency for a Gaussian kernel of this length.
fn waves(inputs: &[Vec<f64>], length: f64, random: &mut Random) -> [Wave; 2] {
    let width = inputs.first().map_or(0, Vec::len);
    let rates: Vec<f64> = (0..width).map(|_| random.normal() / length).collect();
    // A random phase: sine and cosine together make any shift of the kernel, and none is preferred.
    let phase = std::f64::consts::TAU * random.uniform();
    // cos(x - 90 deg) = sin x.
    let phases = [phase, phase - std::f64::consts::FRAC_PI_2];
    phases.map(|phase| Wave { rates: rates.clone(), phase, shift: nalgebra::Vector3::zeros() })
}

/// Writes the map's functions, carried to the readings, into a design from column `first` on; the equations of each row. `axes` are those of the base in the frame of the
/// measurements, in which the probes behind the first `free_parameters` parameters shift it.
fn write_columns(
    problem: &ResidualModel<'_>,
    (rows, region): (&[usize], &MeasuredRegion),
    outline: &Outline,
    (block, free_parameters, axes): (&RowBlock, usize, &Matrix3<f64>),
    design: &mut DMatrix<f64>,
    first: usize,
) -> Vec<Range<usize>> {
    let mut equations = Vec::with_capacity(rows.len());
    let mut next = 0;
    for row in rows {
        let own = next..next + problem.observations.range(*row).len();
        next = own.end;
        let sides: Vec<i8> =
            (0..problem.table.joints).map(|joint| problem.table.approach_of(*row, joint)).collect();
        let columns = outline.map.columns(region, problem.table.q_of(*row), &sides);
        for equation in own.clone() {
            // Readings by a shift of the base along each axis (three of them), then by each joint's coordinate.
            let by: Vec<f64> =
                block.jacobian.column(equation).iter().skip(free_parameters).copied().collect();
            let shifts =
                [0, 1, 2].map(|axis| (0..3).zip(&by).map(|(part, by)| axes[(part, axis)] * by).sum::<f64>());
            for (index, (carrier, value)) in columns.iter().enumerate() {
                let carried = match carrier {
                    MapCarrier::Shift(axis) => shifts.get(*axis).copied().unwrap_or(0.0),
                    MapCarrier::Joint(joint) => by.get(3 + joint).copied().unwrap_or(0.0),
                };
                design[(equation, first + index)] = value * carried;
            }
        }
        equations.push(own);
    }
    equations
}

/// The design of the regression, and the length each flexible column was divided by.
struct Design {
    features: Features,
    lengths: Vec<f64>,
}

impl Design {
    fn of(
        problem: &ResidualModel<'_>,
        fit: &Fit,
        rows: &[usize],
        region: &MeasuredRegion,
        outline: &Outline,
    ) -> Self {
        let shift = carrier_of(problem, "base_position", Site::Base);
        let zeros = joint_carriers(problem);
        let probes: Vec<&dyn Effect> =
            std::iter::once(&shift).chain(&zeros).flatten().map(AsRef::as_ref).collect();
        let block = problem.block(&fit.state, rows, &fit.weights, &probes);
        let free_parameters = problem.free_parameters().len();
        let fitted = fit.factor.whiten(&block.jacobian.rows(0, free_parameters).into_owned());
        let fixed = fitted.nrows();
        // Axes of the base in the frame of the measurements, in which the probes shift it.
        let axes = fit.state.base.rotation.matrix();
        let flexible = outline.components.last().map_or(0, |last| last.end);
        let mut design = DMatrix::zeros(block.residuals.len(), fixed + flexible + 1);
        design.columns_mut(0, fixed).copy_from(&fitted.transpose());
        let equations = write_columns(
            problem,
            (rows, region),
            outline,
            (&block, free_parameters, axes),
            &mut design,
            fixed,
        );
        // Columns are scaled for the regression; the map keeps its weights in mm and rad, and needs the lengths to go back.
        let mut lengths = vec![1.0; flexible];
        for component in &outline.components {
            let mut own = design.columns_mut(fixed + component.start, component.len());
            let length = own.norm() / ((own.nrows() * own.ncols()).max(1) as f64).sqrt();
            if length > 1e-12 {
                own /= length;
                lengths[component.clone()].fill(length);
            }
        }
        design.set_column(fixed + flexible, &DVector::from_vec(block.residuals));
        let knowledge = knowledge(problem, fit, design.ncols());
        let features = Features {
            design,
            fixed,
            components: outline.components.clone(),
            joints: Vec::new(),
            carriers: Vec::new(),
            groups: outline.groups.clone(),
            equations,
            knowledge,
        };
        Self { features, lengths }
    }

    /// The weights of the map's functions when all rows speak, zero for components that were not `chosen`.
    fn weights(&self, chosen: &[usize]) -> Option<Vec<f64>> {
        let features = &self.features;
        let mut all = features.knowledge.clone();
        all.add(&Products::of(&features.design));
        let reduced = Reduced::of(&all, features.fixed)?;
        let mut ratios: Vec<f64> =
            features.components.iter().map(|columns| FIRST_RATIO * columns.len() as f64).collect();
        let flexible = reduced.fit(&features.components, chosen, &mut ratios);
        Some(flexible.iter().zip(&self.lengths).map(|(weight, length)| weight / length).collect())
    }
}

/// Returns dealt into folds pose by pose; nothing where some pose has too few.
fn return_folds(poses: &[Vec<usize>]) -> Option<Vec<Vec<usize>>> {
    if poses.is_empty() || poses.iter().any(|rows| rows.len() < FEW_POSES_RETURNS) {
        return None;
    }
    let fewest = poses.iter().map(Vec::len).min().unwrap_or(FEW_POSES_RETURNS);
    let mut folds = vec![Vec::new(); fewest.min(VALIDATION_BLOCKS)];
    let count = folds.len();
    let mut random = Random::seeded(37);
    for rows in poses {
        let mut order = rows.clone();
        random.shuffle(&mut order);
        for (index, row) in order.into_iter().enumerate() {
            folds[index % count].push(row);
        }
    }
    Some(folds)
}

/// Fits a residual map to what a fit leaves; nothing where rows left out are not predicted better with it, or the poses are too few.
///
/// # Errors
/// Cancellation.
pub(crate) fn residual_map(
    problem: &ResidualModel<'_>,
    fit: &Fit,
    progress: &Progress,
) -> Result<Option<FittedMap>, Cancelled> {
    let rows = chosen_rows(problem, fit, MAP_ROWS);
    let groups = pose_groups(problem.table, &rows);
    let between_unknown = groups.len() < FEWEST_POSES;
    // Returns to one pose err alike, so a pose counts once; where returns are left out, each counts.
    let (folds, units) = match between_unknown {
        true => (return_folds(&groups), rows.iter().map(|row| vec![*row]).collect()),
        false => (Some(random_folds(&groups)), groups.clone()),
    };
    let poses: Vec<Vec<f64>> =
        groups.iter().filter_map(|rows| rows.first()).map(|row| problem.table.q_of(*row).to_vec()).collect();
    let (Some(folds), Some(region)) = (folds, MeasuredRegion::of(&problem.model.chain, &poses)) else {
        return Ok(None);
    };
    progress.report(0.9, "fitting a residual map")?;
    let mut outline = Outline::of(problem, &region, &poses);
    let design = Design::of(problem, fit, &rows, &region, &outline);
    let Some(folds) = Folds::new(problem, fit, (&design.features, &rows), folds) else { return Ok(None) };
    let start = folds.predict(&[], None);
    let ladder = ladder(&folds, &start, &units, progress)?;
    if ladder.taken.is_empty() || !counts(ladder.best.reduction_from(&start, &units)) {
        return Ok(None);
    }
    let Some(weights) = design.weights(&components_of(&ladder.taken)) else { return Ok(None) };
    outline.map.set_weights(&weights);
    let (without_mm, with_mm) = (start.rms(), ladder.best.rms());
    outline.map.not_understood = (1.0 - (with_mm / without_mm.max(1e-300)).powi(2)).clamp(0.0, 1.0);
    outline.map.drop_idle();
    Ok(Some(FittedMap {
        map: outline.map,
        region,
        without_mm,
        with_mm,
        goes_by: ladder.taken.iter().map(|group| group.name.clone()).collect(),
        between_unknown,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laboratory::Laboratory;
    use crate::testing::{sides_in_turn, two_links, with_table};

    #[test]
    fn components_follow_one_another_and_a_group_without_any_is_none() {
        let mut outline = Outline { map: ResidualMap::default(), components: Vec::new(), groups: Vec::new() };
        outline.close_group("nothing");
        outline.close_component(3);
        outline.close_component(2);
        outline.close_group("pose");
        outline.close_group("nothing new");
        outline.close_component(4);
        outline.close_group("side of approach");
        assert_eq!(outline.components, [0..3, 3..5, 5..9]);
        let groups: Vec<_> =
            outline.groups.iter().map(|group| (group.name.as_str(), group.components.clone())).collect();
        assert_eq!(groups, [("pose", 0..2), ("side of approach", 2..3)]);
    }

    #[test]
    fn returns_are_dealt_so_that_every_pose_is_in_every_fold() {
        let poses: Vec<Vec<usize>> = (0..4).map(|pose| (6 * pose..6 * pose + 6).collect()).collect();
        let folds = return_folds(&poses).unwrap();
        assert_eq!(folds.len(), VALIDATION_BLOCKS);
        for fold in &folds {
            assert!(poses.iter().all(|rows| rows.iter().any(|row| fold.contains(row))), "{fold:?}");
        }
        assert_eq!(folds.iter().map(Vec::len).sum::<usize>(), 24);
        assert!(return_folds(&[vec![0, 1], vec![2, 3, 4]]).is_none(), "two returns are too few");
    }

    #[test]
    fn the_extent_is_the_mean_distance_of_two_poses() {
        let mut random = Random::seeded(1);
        let inputs: Vec<Vec<f64>> =
            (0..400).map(|_| vec![random.uniform(), 3.0 * random.uniform()]).collect();
        let mut sum = 0.0;
        for one in &inputs {
            for other in &inputs {
                sum += (one[0] - other[0]).powi(2) + (one[1] - other[1]).powi(2);
            }
        }
        assert!((extent(&inputs) - (sum / 160_000.0).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn a_map_has_waves_of_three_lengths_cosines_of_every_joint_and_sides_of_those_that_came_from_both() {
        let silent = two_links(60, "joint_zero(*)", 0.1, 5, |_| [0.0; 2]);
        let logged = with_table(&silent, |table| table.approach = Some(sides_in_turn(60)));
        let outline = |lab: &Laboratory, poses: usize| {
            let poses: Vec<Vec<f64>> = (0..poses).map(|row| lab.table().q_of(row).to_vec()).collect();
            let region = MeasuredRegion::of(&lab.model().chain, &poses).unwrap();
            Outline::of(&lab.problem(&[]).unwrap(), &region, &poses)
        };
        // A frequency for ten poses, each a sine and a cosine along three axes; a cosine for twenty, four at least.
        let plain = outline(&silent, 60);
        assert_eq!(plain.components, [0..36, 36..72, 72..108, 108..112, 112..116]);
        assert_eq!((plain.map.waves.len(), plain.map.along.len(), plain.map.sides.len()), (36, 2, 0));
        assert_eq!(plain.groups.len(), 1);
        let sided = outline(&logged, 60);
        assert_eq!(
            (sided.components.len(), &sided.components[5]),
            (6, &(116..119)),
            "the second joint always came from below"
        );
        assert_eq!((sided.map.sides.len(), sided.map.sides[0].joint), (1, 0));
        let groups: Vec<_> =
            sided.groups.iter().map(|group| (group.name.as_str(), group.components.clone())).collect();
        assert_eq!(groups, [("pose", 0..5), ("side of approach", 5..6)]);
        // Of few poses three frequencies; of one, which has no extent, no waves and no range.
        assert_eq!(outline(&silent, 12).map.waves.len(), 3 * 6);
        let one = outline(&silent, 1);
        assert!(one.components.is_empty() && one.groups.is_empty());
    }

    #[test]
    fn the_two_waves_of_a_frequency_are_a_quarter_of_a_period_apart() {
        let mut random = Random::seeded(3);
        let [cosine, sine] = waves(&[vec![0.0; 4]], 2.0, &mut random);
        assert_eq!((cosine.rates.len(), &cosine.rates), (4, &sine.rates));
        assert!((cosine.phase - sine.phase - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        // Rates of a Gaussian kernel: half the length, twice the rate.
        let spread = |length: f64| {
            let mut random = Random::seeded(3);
            let all = (0..500).flat_map(|_| waves(&[vec![0.0; 4]], length, &mut random)[0].rates.clone());
            (all.map(|rate| rate * rate).sum::<f64>() / 2000.0).sqrt()
        };
        assert!((spread(2.0) - 0.5).abs() < 0.03 && (spread(1.0) - 1.0).abs() < 0.06, "{}", spread(2.0));
    }

    /// An error of the elbow that no effect of the library has, 1 mrad on 150 mm, beside noise of 0.02 mm.
    fn bumpy(rows: usize) -> Laboratory {
        two_links(rows, "joint_zero(*)", 0.02, 6, |[_, elbow]| [0.0, 1e-3 * (-(elbow * elbow) / 0.1).exp()])
    }

    #[test]
    fn a_map_takes_away_what_it_has_learnt_where_it_was_measured() {
        let lab = bumpy(160);
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let found = residual_map(&fitted.problem, &fitted.fit, &Progress::unwatched()).unwrap().unwrap();
        // Noise along three axes, 0.035 mm of a point, is all that it may leave.
        assert!(found.without_mm > 0.055 && found.with_mm < 0.047, "{} {}", found.without_mm, found.with_mm);
        let fraction = 1.0 - (found.with_mm / found.without_mm).powi(2);
        assert!((found.map.not_understood - fraction).abs() < 1e-12 && !found.between_unknown);
        assert_eq!(found.goes_by, ["pose"]);
        let mut mapped = lab.model().clone();
        (mapped.residual_map, mapped.measured_region) = (Some(found.map), Some(found.region));
        let lab = Laboratory::new(mapped, lab.table().clone(), lab.options().clone()).unwrap();
        let after = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let squares = |fit: &Fit| fit.residuals.iter().map(|one| one * one).sum::<f64>();
        let (before, after) = (squares(&fitted.fit), squares(&after.fit));
        // 480 residuals of noise have squares of 0.19; the bump's own 0.5 are gone from the fitted rows.
        assert!(before > 0.35 && after < 0.22, "{before} {after}");
    }

    #[test]
    fn of_noise_no_map_is_made() {
        let lab = two_links(60, "joint_zero(*)", 0.1, 8, |_| [0.0; 2]);
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        assert!(residual_map(&fitted.problem, &fitted.fit, &Progress::unwatched()).unwrap().is_none());
    }
}
